//! Emitters as the kernels sample them: the alias table over emissive triangles
//! and punctual lights.
//!
//! \[Vose91\] Vose, A Linear Algorithm for Generating Random Numbers with a Given
//! Distribution, IEEE TSE 17(9).

use std::f64::consts::PI;

use glam::Vec3;

use crate::layout;
use crate::scene::{LightKind, PunctualLight};

/// One emitter with the power that decides how often it is sampled.
pub(crate) struct Emitter {
    /// The record of the table, without the table's own fields.
    pub light: layout::Light,
    /// Emitted power, up to one common factor, or its share of all; > 0.
    pub power: f64,
    /// Triangles: the placement of the group that has it.
    pub placement: u32,
}

/// Luminance of linear Rec. 709: a scalar for deciding how to sample, never for radiance itself.
pub(crate) fn luminance(c: [f64; 3]) -> f64 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

/// Luminance that does not vanish for a colour that is not black: a pure blue
/// lamp is dim to the eye but not to the estimator.
pub(crate) fn sampling_weight(c: Vec3) -> f64 {
    let c = c.as_dvec3();
    luminance(c.to_array()).max(c.max_element() / 3.0)
}

/// The record of a punctual light at `position` (metres, relative to the scene's
/// origin) in a scene of the given radius, metres.
pub(crate) fn punctual(light: &PunctualLight, position: Vec3, radius: f64) -> Option<Emitter> {
    let weight = sampling_weight(light.intensity);
    let mut record = layout::Light {
        position: position.to_array(),
        direction: light.direction.to_array(),
        intensity: light.intensity.to_array(),
        ..Default::default()
    };
    let power = match light.kind {
        LightKind::Point => {
            record.kind = layout::LIGHT_POINT;
            4.0 * PI * weight
        }
        LightKind::Spot {
            cos_inner,
            cos_outer,
        } => {
            record.kind = layout::LIGHT_SPOT;
            record.cos_inner = cos_inner;
            record.cos_outer = cos_outer;
            2.0 * PI * (1.0 - 0.5 * f64::from(cos_inner + cos_outer)) * weight
        }
        LightKind::Directional => {
            record.kind = layout::LIGHT_DIRECTIONAL;
            PI * radius * radius * weight
        }
    };
    (power > 0.0).then_some(Emitter {
        light: record,
        power,
        placement: 0,
    })
}

/// The table over all emitters, by power or, for the yardstick, uniformly.
pub(crate) fn table(emitters: Vec<Emitter>, is_uniform: bool) -> Vec<layout::Light> {
    let weights: Vec<f64> = emitters
        .iter()
        .map(|e| if is_uniform { 1.0 } else { e.power })
        .collect();
    let total = weights.iter().sum::<f64>();
    emitters
        .into_iter()
        .zip(alias_table(&weights))
        .zip(&weights)
        .map(|((emitter, (keep, alias)), weight)| layout::Light {
            keep,
            alias,
            choice: (weight / total) as f32,
            ..emitter.light
        })
        .collect()
}

/// Walker's alias table: entry i is kept with probability `.0`, else `.1` is taken. \[Vose91\]
pub(crate) fn alias_table(weights: &[f64]) -> Vec<(f32, u32)> {
    let total: f64 = weights.iter().sum();
    let scale = weights.len() as f64 / total;
    let mut scaled: Vec<f64> = weights.iter().map(|w| w * scale).collect();
    let mut table: Vec<(f32, u32)> = (0..weights.len() as u32).map(|i| (1.0, i)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) =
        (0..weights.len()).partition(|&i| scaled[i] < 1.0);
    while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
        small.pop();
        table[s] = (scaled[s] as f32, l as u32);
        scaled[l] -= 1.0 - scaled[s];
        if scaled[l] < 1.0 {
            large.pop();
            small.push(l);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alias_table_reproduces_the_weights() {
        let weights = [0.0, 1.0, 5.0, 0.25, 3.75, 0.0, 10.0];
        let table = alias_table(&weights);
        let mut probability = vec![0.0; weights.len()];
        for (i, (keep, alias)) in table.iter().enumerate() {
            probability[i] += f64::from(*keep) / weights.len() as f64;
            probability[*alias as usize] += (1.0 - f64::from(*keep)) / weights.len() as f64;
        }
        for (p, w) in probability.iter().zip(weights) {
            // The kept share is rounded to fp32: 6e-8 of an entry.
            assert!((p - w / 20.0).abs() < 1e-7, "{p} {w}");
        }
    }
}
