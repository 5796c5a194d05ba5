//! `etendue measure`: a light meter in a scene.

use std::time::Instant;

use etendue::film::Film;
use etendue::render::{Control, DeviceOptions, Progress, Reading, Renderer, Work};
use etendue::scene::Scene;
use etendue::settings::{Sensor, Settings};
use etendue::{Error, Result};
use glam::DVec3;
use serde_json::json;

use super::args::MeasureArgs;
use super::failure::{Failure, Outcome};
use super::interrupt::Interrupt;
use super::numbers::numbers;
use super::pilot;
use super::render::load_scene;
use super::{write_stderr, write_stdout};

/// Side of the sensor's frame: its pixels are readings of the same thing, 1024 in all.
const SIDE: u32 = 32;
/// Thousands of samples when none are asked for.
const DEFAULT_SPP: u64 = 1024;
/// Standard errors on either side of a value that hold the truth in 95 of 100 cases.
const CONFIDENCE_95: f64 = 1.959_964;
/// Planck's constant times the speed of light, J·m (exact since 2019).
const PLANCK_LIGHT: f64 = 6.626_070_15e-34 * 299_792_458.0;

/// What is measured, with its name and units: photometric, radiometric, and of its photons.
struct Quantity {
    sensor: Sensor,
    name: &'static str,
    units: [&'static str; 3],
}

/// Measures and prints the reading.
pub fn run(args: &MeasureArgs) -> Result<Outcome, Failure> {
    let interrupt = Interrupt::install()?;
    let env = args.env.as_deref();
    let (mut scene, _) = load_scene(
        &args.scene,
        env,
        (args.env_intensity, args.env_rotation),
        None,
    )?;
    if !args.quiet {
        for warning in &scene.warnings {
            write_stderr(&format!("warning: {warning}"));
        }
    }
    let (quantity, node) = quantity(args, &scene).map_err(Failure::usage)?;
    if let Some(node) = node {
        scene = scene.luminaire(node);
    }
    let settings = Settings {
        width: SIDE,
        height: SIDE,
        samples: 0..args.spp.unwrap_or(DEFAULT_SPP),
        seed: args.seed,
        max_depth: args.max_depth,
        backend: args.backend.into(),
        sensor: Some(quantity.sensor),
        ..Settings::default()
    };
    let device = DeviceOptions {
        device: args.device.clone(),
        ..DeviceOptions::default()
    };
    let mut renderer = Renderer::new(&scene, &settings, &device)?;
    interrupt.begin_rendering();
    let begun = Instant::now();
    let has_taken = |share: f64| {
        let time = args.time.unwrap_or(f64::INFINITY);
        begun.elapsed().as_secs_f64() >= share * time
    };
    let pilot_share = 1.0 / pilot::MOST as f64;
    if let Some(limit) = args.noise {
        let mut film = Film::of(&settings);
        renderer.restart(settings.samples.clone(), settings.pilot().seed)?;
        let needed = pilot::plan(limit, settings.samples.end, |samples| {
            let so_far = std::mem::replace(&mut film, Film::of(&settings));
            let mut control =
                |_: &Progress| match interrupt.is_requested() || has_taken(pilot_share) {
                    true => Control::Stop,
                    false => Control::Continue,
                };
            let range = 0..samples;
            film = renderer.resume(so_far, Work::default(), &[range], &mut control)?;
            if film.samples() < samples {
                return Ok(None);
            }
            let (value, error) = Reading::of(&film, &quantity.sensor, &scene)?.luminance();
            Ok(Some(if error == 0.0 { 0.0 } else { error / value }))
        })?;
        let end = needed.unwrap_or(settings.samples.end);
        renderer.restart(0..end, args.seed)?;
    }
    let mut is_interrupted = false;
    let film = renderer.render(&mut |progress| {
        is_interrupted = interrupt.is_requested();
        match is_interrupted || (progress.samples_done > 0 && has_taken(1.0)) {
            true => Control::Stop,
            false => Control::Continue,
        }
    })?;
    interrupt.begin_writing();
    if film.samples() < 2 {
        write_stderr("error: interrupted before two samples were complete; there is no reading");
        return Ok(Outcome::Interrupted);
    }
    let reading = Reading::of(&film, &quantity.sensor, &scene).map_err(Failure::usage)?;
    let ledger = renderer.report().ledger;
    if ledger.non_finite > 0 && !args.quiet {
        let count = ledger.non_finite;
        write_stderr(&format!(
            "warning: {count} samples were not finite and count as dark"
        ));
    }
    let samples = film.samples() * film.pixels() as u64;
    write_stdout(&text(args, &quantity, &reading, samples))?;
    Ok(match is_interrupted {
        true => Outcome::Interrupted,
        false => Outcome::Done,
    })
}

/// What the arguments ask for, and of which node.
fn quantity(args: &MeasureArgs, scene: &Scene) -> Result<(Quantity, Option<usize>)> {
    let at = |v: [f64; 6]| (DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]));
    let of = |sensor, name, units| Quantity {
        sensor,
        name,
        units,
    };
    if let Some(v) = args.irradiance {
        let (position, normal) = (at(v).0, unit("--irradiance", at(v).1)?);
        let units = ["lx", "W/m²", "photons/(s·m²)"];
        let sensor = Sensor::Irradiance { position, normal };
        return Ok((of(sensor, "irradiance", units), None));
    }
    if let Some(v) = args.radiance {
        let (position, direction) = (at(v).0, unit("--radiance", at(v).1)?);
        let units = ["cd/m²", "W/(m²·sr)", "photons/(s·m²·sr)"];
        let sensor = Sensor::Radiance {
            position,
            direction,
        };
        return Ok((of(sensor, "radiance", units), None));
    }
    if let Some(text) = &args.intensity {
        let wrong = |what: String| Error::Settings {
            name: "--intensity",
            what,
        };
        // The name may hold commas; the direction is what follows the third from the end.
        let mut parts = text.rsplitn(4, ',');
        let direction: Vec<&str> = parts.by_ref().take(3).collect();
        let Some(name) = parts.next() else {
            return Err(wrong(format!("{text:?} is not NODE,DX,DY,DZ")));
        };
        let forwards: Vec<&str> = direction.into_iter().rev().collect();
        let [x, y, z] = numbers::<3>(&forwards.join(",")).map_err(wrong)?;
        let direction = unit("--intensity", DVec3::new(x, y, z))?;
        let node = node(scene, "--intensity", name)?;
        let units = ["cd", "W/sr", "photons/(s·sr)"];
        let sensor = Sensor::Intensity { direction };
        return Ok((of(sensor, "intensity", units), Some(node)));
    }
    let name = args.flux.as_deref().unwrap_or_default();
    let node = node(scene, "--flux", name)?;
    let units = ["lm", "W", "photons/s"];
    Ok((of(Sensor::Flux, "flux", units), Some(node)))
}

fn unit(name: &'static str, v: DVec3) -> Result<DVec3> {
    v.try_normalize().ok_or_else(|| Error::Settings {
        name,
        what: String::from("the direction must have a length"),
    })
}

fn node(scene: &Scene, name: &'static str, asked: &str) -> Result<usize> {
    scene.find_node(asked).ok_or_else(|| {
        let lit = |n: &&etendue::scene::Node| !n.instances.is_empty() || !n.lights.is_empty();
        let names = scene.nodes.iter().filter(lit).map(|n| n.name.as_str());
        let names: Vec<&str> = names.take(20).collect();
        let known = names.join(", ");
        let what = format!("there is no node {asked:?}; nodes with meshes or lights: {known}");
        Error::Settings { name, what }
    })
}

/// The reading as people or programs read it.
fn text(args: &MeasureArgs, quantity: &Quantity, reading: &Reading, samples: u64) -> String {
    let unit = quantity.units[usize::from(args.wavelength.is_some())];
    // One photon has the energy h c/λ.
    let photons = args.wavelength.map(|nm| nm * 1e-9 / PLANCK_LIGHT);
    let (luminance, luminance_error) = reading.luminance();
    let scaled = |v: [f64; 3], by: f64| v.map(|x| x * by);
    if args.json {
        let mut object = json!({
            "quantity": quantity.name,
            "unit": unit,
            "value": reading.value,
            "half_width_95": scaled(reading.error, CONFIDENCE_95),
            "luminance": luminance,
            "luminance_half_width_95": CONFIDENCE_95 * luminance_error,
            "samples": samples,
        });
        if let Some(per_watt) = photons {
            object["wavelength_nm"] = json!(args.wavelength);
            object["photon_unit"] = json!(quantity.units[2]);
            object["photons"] = json!(scaled(reading.value, per_watt));
        }
        return format!("{object}\n");
    }
    let mut text = format!(
        "{} ({unit}), 95 % confidence, {samples} samples\n",
        quantity.name
    );
    let channels = ["red", "green", "blue"].into_iter();
    let lines = channels.zip(reading.value.into_iter().zip(reading.error));
    for (name, (value, error)) in lines.chain([("luminance", (luminance, luminance_error))]) {
        let rate = photons.map(|p| format!("   {:.6e} {}", value * p, quantity.units[2]));
        text += &format!(
            "  {name:<10} {value:>14.7} ± {:.2e}{}\n",
            CONFIDENCE_95 * error,
            rate.unwrap_or_default()
        );
    }
    text
}
