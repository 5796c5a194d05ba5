//! Radiance from infinity.

use std::f64::consts::{PI, TAU};

use etendue::scene::Environment;
use glam::DVec3;

/// Radiance that arrives from the unit direction `d`, cd/m².
pub fn radiance(environment: Option<&Environment>, d: DVec3, channel: usize) -> f64 {
    match environment {
        None => 0.0,
        Some(Environment::Constant(radiance)) => f64::from(radiance[channel]),
        Some(Environment::Map {
            width,
            height,
            texels,
            intensity,
            rotation,
        }) => {
            // What stands at R_y(rotation)·d stood in direction d.
            let (sin, cos) = f64::from(*rotation).sin_cos();
            let (x, z) = (d.x * cos - d.z * sin, d.x * sin + d.z * cos);
            // Longitude from −Z towards +X, and the angle from the zenith.
            let u = 0.5 + x.atan2(-z) / TAU;
            let v = d.y.clamp(-1.0, 1.0).acos() / PI;
            let (w, h) = (i64::from(*width), i64::from(*height));
            // Texels are samples at their centres; columns wrap, rows end.
            let texel = |x: i64, y: i64| {
                let at = y.clamp(0, h - 1) * w + x.rem_euclid(w);
                f64::from(texels[at as usize][channel])
            };
            let (x, y) = (u * w as f64 - 0.5, v * h as f64 - 0.5);
            let (x0, y0) = (x.floor(), y.floor());
            let (fx, fy) = (x - x0, y - y0);
            let (x0, y0) = (x0 as i64, y0 as i64);
            let row = |y| (1.0 - fx) * texel(x0, y) + fx * texel(x0 + 1, y);
            f64::from(*intensity) * ((1.0 - fy) * row(y0) + fy * row(y0 + 1))
        }
    }
}
