//! The light meter: readings of irradiance, radiance, intensity and flux with their standard errors.

use std::f64::consts::PI;

use glam::DVec3;

use super::view::sphere;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::scene::{LightKind, PunctualLight, Scene};
use crate::settings::Sensor;

/// A quantity of each channel with its standard error, in the unit that the scene's own units give:
/// lx, cd/m², cd or lm where emission is in cd/m².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Red, green, blue (linear Rec. 709).
    pub value: [f64; 3],
    /// Standard errors of the same.
    pub error: [f64; 3],
}

impl Reading {
    /// What the pixels say of the sensor in this scene. For [`Sensor::Intensity`] and [`Sensor::Flux`] the
    /// scene is the luminaire alone, see [`Scene::luminaire`].
    ///
    /// # Errors
    /// A directional light has neither intensity nor flux; and lights without
    /// extent among surfaces, whose shadow on the light this meter does not know.
    pub fn of(film: &Film, sensor: &Sensor, scene: &Scene) -> Result<Self> {
        let radius = sphere(scene).1;
        let (factor, direct) = match sensor {
            Sensor::Irradiance { .. } => (PI, [0.0; 3]),
            Sensor::Radiance { .. } => (1.0, [0.0; 3]),
            Sensor::Intensity { direction } => (
                (2.0 * radius).powi(2),
                punctual(scene, |light| intensity(light, *direction))?,
            ),
            Sensor::Flux => (4.0 * PI.powi(2) * radius.powi(2), punctual(scene, flux)?),
        };
        let count = film.pixels() as f64;
        let mut reading = Self::default();
        for channel in 0..3 {
            let sum: f64 = film.mean().iter().map(|p| f64::from(p[channel])).sum();
            let errors = film.standard_error();
            let square: f64 = errors.iter().map(|e| f64::from(e[channel]).powi(2)).sum();
            reading.value[channel] = factor * sum / count + direct[channel];
            reading.error[channel] = factor * square.sqrt() / count;
        }
        Ok(reading)
    }

    /// Luminance-weighted value and its standard error; the channels of a path go together.
    pub fn luminance(&self) -> (f64, f64) {
        let weigh = |v: &[f64; 3]| 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];
        (weigh(&self.value), weigh(&self.error))
    }
}

/// What lights without extent add.
fn punctual(scene: &Scene, of: impl Fn(&PunctualLight) -> Result<f64>) -> Result<[f64; 3]> {
    let mut sum = [0.0; 3];
    if !scene.lights.is_empty() && !scene.instances.is_empty() {
        return Err(refused(
            "the node holds surfaces as well as lights without extent, whose shadows on them are not known; give the lamp a surface that emits",
        ));
    }
    for light in &scene.lights {
        let factor = of(light)?;
        for (channel, sum) in sum.iter_mut().enumerate() {
            *sum += factor * f64::from(light.intensity[channel]);
        }
    }
    Ok(sum)
}

fn refused(what: &str) -> Error {
    Error::Settings {
        name: "measure",
        what: what.to_owned(),
    }
}

/// Share of a light's intensity that goes into a direction.
fn intensity(light: &PunctualLight, direction: DVec3) -> Result<f64> {
    match light.kind {
        LightKind::Point => Ok(1.0),
        LightKind::Spot {
            cos_inner,
            cos_outer,
        } => {
            let (inner, outer) = (f64::from(cos_inner), f64::from(cos_outer));
            let cosine = light.direction.as_dvec3().dot(direction);
            let ramp = (cosine - outer) / (inner - outer).max(1e-6);
            Ok(ramp.clamp(0.0, 1.0).powi(2))
        }
        LightKind::Directional => Err(refused("a directional light has no intensity")),
    }
}

/// Flux of a light of unit intensity: its profile over all directions.
fn flux(light: &PunctualLight) -> Result<f64> {
    match light.kind {
        LightKind::Point => Ok(4.0 * PI),
        LightKind::Spot {
            cos_inner,
            cos_outer,
        } => {
            // The square of a linear ramp in the cosine has a third of its width as integral.
            let (inner, outer) = (f64::from(cos_inner), f64::from(cos_outer));
            Ok(2.0 * PI * ((1.0 - inner) + (inner - outer) / 3.0))
        }
        LightKind::Directional => Err(refused("a directional light has no flux")),
    }
}
