//! What the user's device and driver really do: arithmetic, rays, and a closed form of each topic of physics.

mod numbers;
mod physics;
mod rays;
mod scenes;

use crate::error::Result;
use crate::film::Film;
use crate::gpu::{Device, DeviceRequest};
use crate::render::{Control, DeviceOptions, Renderer};
use crate::settings::{BackendChoice, Settings};

/// One thing that was tested.
#[derive(Clone, Debug)]
pub struct Check {
    /// `numbers`, `rays` or `physics`.
    pub group: &'static str,
    /// What was tested.
    pub name: String,
    /// What is promised or right.
    pub expected: String,
    /// What the device does.
    pub measured: String,
    /// Whether that is good enough.
    pub is_right: bool,
}

impl Check {
    fn new(
        group: &'static str,
        name: &str,
        expected: &str,
        measured: String,
        is_right: bool,
    ) -> Self {
        Self {
            group,
            name: name.to_owned(),
            expected: expected.to_owned(),
            measured,
            is_right,
        }
    }
}

/// What a self-test found.
#[derive(Clone, Debug)]
pub struct SelfTest {
    /// Name of the device.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// What was tested.
    pub checks: Vec<Check>,
    /// Backends that were not tested, and what they lack.
    pub missing: Vec<(BackendChoice, String)>,
}

/// Tests a device, by index or a part of its name. `tell` hears of each check when it is done.
///
/// # Errors
/// There is no suitable device, or it fails outright.
pub fn run(select: Option<&str>, tell: &mut dyn FnMut(&Check)) -> Result<SelfTest> {
    let device = Device::open(&DeviceRequest {
        select,
        ..DeviceRequest::default()
    })?;
    let caps = device.caps();
    let mut test = SelfTest {
        device: caps.name.clone(),
        driver: caps.driver.clone(),
        checks: Vec::new(),
        missing: Vec::new(),
    };
    let options = DeviceOptions {
        // The same device, whatever its name matches.
        device: Some(caps.index.to_string()),
        ..DeviceOptions::default()
    };
    let mut backends = vec![BackendChoice::Bvh];
    match &caps.ray_query {
        Ok(()) => backends.push(BackendChoice::RayQuery),
        Err(lacks) => test.missing.push((BackendChoice::RayQuery, lacks.clone())),
    }
    let mut add = |checks: Vec<Check>| {
        checks.iter().for_each(&mut *tell);
        test.checks.extend(checks);
    };
    add(numbers::checks(&device)?);
    drop(device);
    for &backend in &backends {
        add(rays::checks(backend, &options)?);
    }
    if let [a, b] = backends[..] {
        add(vec![physics::agreement([a, b], &options)?]);
    }
    add(physics::checks(BackendChoice::Auto, &options)?);
    Ok(test)
}

/// A square frame.
fn settings(side: u32, samples: u64) -> Settings {
    Settings {
        width: side,
        height: side,
        samples: 0..samples,
        ..Settings::default()
    }
}

/// Everything that the settings ask for.
fn film(renderer: &mut Renderer) -> Result<Film> {
    renderer.render(&mut |_| Control::Continue)
}

/// Random numbers for arguments and rays: SplitMix64.
struct Random(u64);

impl Random {
    /// In 0 … 1.
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In `low` … `high`.
    fn between(&mut self, low: f32, high: f32) -> f32 {
        (f64::from(low) + self.unit() * f64::from(high - low)) as f32
    }
}
