//! PNG: eight bits a channel for the eye.

use std::path::Path;

use ::png::{BitDepth, ColorType, Encoder, EncodingError, ScaledFloat, SourceChromaticities};

use super::{Image, Tone, atomic};
use crate::error::{Error, Result};

/// Writes the channels R, G, B of the window as PNG, atomically: multiplied by
/// 2^`exposure_ev`, through the tone curve. The file says how its values are
/// encoded: an sRGB chunk, or gamma 1 for [`Tone::None`], with Rec. 709 primaries.
///
/// # Errors
/// [`Error::Io`] when the file cannot be written, [`Error::Image`] when a colour channel is missing.
pub fn write_png(path: &Path, image: &Image, tone: Tone, exposure_ev: f32) -> Result<()> {
    let fail = |what: String| Error::Image {
        path: path.to_owned(),
        what,
    };
    let pixels = image
        .rgb()
        .ok_or_else(|| fail(String::from("PNG needs the channels R, G and B")))?;
    let exposure = exposure_ev.exp2();
    let bytes: Vec<u8> = pixels
        .into_iter()
        .flat_map(|pixel| tone.bytes(pixel.map(|v| v * exposure)))
        .collect();
    let file = encode(image.size(), &bytes, tone)
        .map_err(|error| fail(format!("cannot be encoded: {error}")))?;
    atomic::write_bytes(path, &file)
}

fn encode(size: (usize, usize), bytes: &[u8], tone: Tone) -> Result<Vec<u8>, EncodingError> {
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, size.0 as u32, size.1 as u32);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    if tone.is_encoded() {
        encoder.set_source_srgb(::png::SrgbRenderingIntent::RelativeColorimetric);
    } else {
        encoder.set_source_gamma(ScaledFloat::new(1.0));
        encoder.set_source_chromaticities(SourceChromaticities::new(
            (0.3127, 0.3290),
            (0.64, 0.33),
            (0.30, 0.60),
            (0.15, 0.06),
        ));
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(file)
}
