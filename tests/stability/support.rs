//! What the cases share.

use etendue::Error;
use etendue::film::Film;
use etendue::layout::{NONE, ProbeRay};
use etendue::render::{DeviceOptions, Renderer, Tuning};
use etendue::scene::Scene;
use etendue::settings::Settings;
use glam::{DVec3, Vec3};

use crate::common::WORKSHOP;
use crate::common::backends::is_device_required;
pub use crate::common::backends::pair;
pub use crate::random::Random;
pub use crate::statistics::Estimate;

impl Random {
    /// Uniform in [−1, 1]³.
    pub fn cube(&mut self) -> DVec3 {
        DVec3::from([(); 3].map(|()| 2.0 * self.unit() - 1.0))
    }
}

/// Mean over pixels and channels.
pub fn mean_of(film: &Film) -> f64 {
    Estimate::of_image(film).mean
}

/// Largest difference of pixels, relative to the brighter one or to a hundredth of the mean.
pub fn largest_difference(a: &Film, b: &Film) -> f64 {
    let floor = 0.01 * mean_of(b);
    a.mean()
        .iter()
        .flatten()
        .zip(b.mean().iter().flatten())
        .map(|(x, y)| (f64::from(*x), f64::from(*y)))
        .map(|(x, y)| (x - y).abs() / x.max(y).max(floor).max(1e-300))
        .fold(0.0, f64::max)
}

/// A renderer under validation, or the error that it makes; `None` with a printed reason without a device.
pub fn open(scene: &Scene, settings: &Settings, tuning: Tuning) -> Option<Result<Renderer, Error>> {
    let options = DeviceOptions {
        validation: true,
        ..DeviceOptions::default()
    };
    match Renderer::made_in(&WORKSHOP, scene, settings, &options, tuning) {
        Err(error @ Error::Unsupported { .. }) if !is_device_required() => {
            println!("skipped: {error}");
            None
        }
        other => Some(other),
    }
}

/// A ray without bounds.
pub fn ray(origin: Vec3, direction: Vec3) -> ProbeRay {
    ProbeRay {
        origin: origin.to_array(),
        t_min: 0.0,
        direction: direction.to_array(),
        t_max: 3e38,
        from: NONE,
    }
}
