//! From scene-linear radiance to what a display shows. Only 8-bit files pass
//! through here; EXR is always linear.
//!
//! References: \[Hill15\] Stephen Hill's fit of the ACES RRT and sRGB ODT, in Matt
//! Pettineo's BakingLab (ACES.hlsl). \[Sobotka22\] Troy Sobotka, AgX.
//! \[Wrensch23\] Benjamin Wrensch, Minimal AgX Implementation (matrices and the
//! polynomial of degree six for the default contrast). \[Khronos24\] Khronos PBR
//! Neutral Tone Mapper specification. \[IEC 61966-2-1\] sRGB.

/// A tone curve for display formats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// Linear values clamped to 0 … 1 and stored as they are; the file says gamma 1.
    None,
    /// Linear values clamped to 0 … 1, then the sRGB transfer curve.
    #[default]
    Srgb,
    /// ACES filmic look: Hill's fit of RRT and ODT, without extra exposure.
    Aces,
    /// AgX, default look, Wrensch's fit.
    Agx,
    /// Khronos PBR Neutral: true colours below 0.8, compressed highlights.
    PbrNeutral,
}

impl Tone {
    /// Every curve.
    pub const ALL: [Self; 5] = [
        Self::None,
        Self::Srgb,
        Self::Aces,
        Self::Agx,
        Self::PbrNeutral,
    ];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Srgb => "srgb",
            Self::Aces => "aces",
            Self::Agx => "agx",
            Self::PbrNeutral => "pbr-neutral",
        }
    }

    /// Whether the stored values carry the sRGB transfer curve.
    pub fn is_encoded(self) -> bool {
        self != Self::None
    }

    /// The stored byte values of a pixel of linear Rec. 709 radiance, exposure applied.
    pub fn bytes(self, linear: [f32; 3]) -> [u8; 3] {
        // NaN, which is not above 0, becomes 0
        let linear = linear.map(|v| if v > 0.0 { v.min(MAX_INPUT) } else { 0.0 });
        let display = match self {
            Self::None | Self::Srgb => linear,
            Self::Aces => aces(linear),
            Self::Agx => agx(linear),
            Self::PbrNeutral => pbr_neutral(linear),
        };
        display.map(|v| {
            let v = v.clamp(0.0, 1.0);
            let stored = if self.is_encoded() { encode_srgb(v) } else { v };
            // `as` cannot overflow: the value is in 0.5 … 255.5
            (stored * 255.0 + 0.5) as u8
        })
    }
}

/// All curves have reached their end long before, and squares stay finite.
const MAX_INPUT: f32 = 1e8;

/// [IEC 61966-2-1]: linear 0 … 1 to encoded 0 … 1.
fn encode_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

fn transform(rows: [[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// [Hill15]: linear Rec. 709 to linear display values.
fn aces(v: [f32; 3]) -> [f32; 3] {
    // sRGB → XYZ → D65 to D60 → AP1 → RRT saturation
    const INPUT: [[f32; 3]; 3] = [
        [0.59719, 0.35458, 0.04823],
        [0.07600, 0.90834, 0.01566],
        [0.02840, 0.13383, 0.83777],
    ];
    // ODT saturation → XYZ → D60 to D65 → sRGB
    const OUTPUT: [[f32; 3]; 3] = [
        [1.60475, -0.53108, -0.07367],
        [-0.10208, 1.10813, -0.00605],
        [-0.00327, -0.07276, 1.07602],
    ];
    let fitted = transform(INPUT, v).map(|v| {
        let numerator = v * (v + 0.024_578_6) - 0.000_090_537;
        let denominator = v * (0.983_729 * v + 0.432_951) + 0.238_081;
        numerator / denominator
    });
    transform(OUTPUT, fitted)
}

/// \[Sobotka22\] as fitted in [Wrensch23]: linear Rec. 709 to linear display values.
fn agx(v: [f32; 3]) -> [f32; 3] {
    const INSET: [[f32; 3]; 3] = [
        [0.842_479_05, 0.078_433_6, 0.079_223_745],
        [0.042_328_242, 0.878_468_64, 0.079_166_13],
        [0.042_375_655, 0.078_433_6, 0.879_143],
    ];
    const OUTSET: [[f32; 3]; 3] = [
        [1.196_879, -0.098_020_88, -0.099_029_74],
        [-0.052_896_85, 1.151_903_1, -0.098_961_18],
        [-0.052_971_635, -0.098_043_45, 1.151_073_7],
    ];
    // stops below and above 1 that the curve spans
    const MIN_EV: f32 = -12.473_93;
    const MAX_EV: f32 = 4.026_069;
    let curve = transform(INSET, v).map(|v| {
        // log2(0) is −∞ and lands on MIN_EV
        let x = (v.log2().clamp(MIN_EV, MAX_EV) - MIN_EV) / (MAX_EV - MIN_EV);
        const COEFFICIENTS: [f32; 7] = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.002_32];
        COEFFICIENTS.iter().fold(0.0, |sum, c| sum * x + c)
    });
    // the curve's output is meant for a display of gamma 2.2
    transform(OUTSET, curve).map(|v| v.max(0.0).powf(2.2))
}

/// [Khronos24]: linear Rec. 709 to linear display values.
fn pbr_neutral(v: [f32; 3]) -> [f32; 3] {
    // F90 of the usual dielectric: the offset undoes its reflection of a white surrounding
    const FRESNEL: f32 = 0.04;
    const START: f32 = 0.8 - FRESNEL;
    const DESATURATION: f32 = 0.15;
    let darkest = v[0].min(v[1]).min(v[2]);
    let offset = if darkest < 2.0 * FRESNEL {
        darkest - darkest * darkest / (4.0 * FRESNEL)
    } else {
        FRESNEL
    };
    let v = v.map(|v| v - offset);
    let peak = v[0].max(v[1]).max(v[2]);
    if peak < START {
        return v;
    }
    let room = 1.0 - START;
    let new_peak = 1.0 - room * room / (peak + room - START);
    let grey = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    v.map(|v| {
        let v = v * (new_peak / peak);
        v + (new_peak - v) * grey
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Anchors that follow from the definitions, within the rounding of f32.
    #[test]
    fn curves_meet_their_definitions() {
        assert_eq!(Tone::None.bytes([0.5, 0.0, 2.0]), [128, 0, 255]);
        // [IEC 61966-2-1]: 0.215861 is code 128, 0.0012141 is code 4 in the linear part
        assert_eq!(
            Tone::Srgb.bytes([0.215_861, 0.001_214_1, 1.0]),
            [128, 4, 255]
        );
        // the fit at 0.18: numerator 0.0367336, denominator 0.3478860 → 0.10559
        // along the grey axis; rows of INPUT sum to 1, of OUTPUT to 1.0 ± 1e-5
        let grey = aces([0.18; 3]);
        for v in grey {
            assert!((v - 0.105_59).abs() < 2e-5, "{grey:?}");
        }
        // neutral keeps what lies between the toe and the shoulder, less the offset
        let kept = pbr_neutral([0.5, 0.3, 0.2]);
        for (v, expected) in kept.iter().zip([0.46, 0.26, 0.16]) {
            assert!((v - expected).abs() < 1e-6, "{kept:?}");
        }
        // in the toe: x − (x − x²/0.16) = 6.25 x²
        assert!((pbr_neutral([0.04; 3])[0] - 0.01).abs() < 1e-7);
    }

    /// [Sobotka22]: the curve's pivot takes 0.18 (10 of 16.5 stops) to the code 0.5.
    /// \[Wrensch23\] gives the fit's mean squared error as 3.67e-6; allowed is three times its root.
    #[test]
    fn agx_puts_middle_grey_in_the_middle() {
        let code = agx([0.18; 3])[0].powf(1.0 / 2.2);
        assert!((code - 0.5).abs() < 3.0 * 3.67e-6_f32.sqrt(), "{code}");
    }

    #[test]
    fn every_curve_rises_along_grey_and_survives_odd_values() {
        for tone in Tone::ALL {
            let mut last = 0;
            for step in 0..400 {
                let x = 2.0_f32.powf(step as f32 / 10.0 - 20.0);
                let [r, g, b] = tone.bytes([x; 3]);
                assert!(r >= last, "{tone:?} falls at {x}");
                // matrices of five digits: channels agree within one step
                assert!(r.abs_diff(g) <= 1 && r.abs_diff(b) <= 1, "{tone:?} at {x}");
                last = r;
            }
            assert!(last >= 250, "{tone:?} ends at {last}");
            assert_eq!(tone.bytes([f32::INFINITY; 3]), tone.bytes([1e8; 3]));
            assert_eq!(tone.bytes([f32::NAN, -1.0, 0.0]), tone.bytes([0.0; 3]));
        }
    }
}
