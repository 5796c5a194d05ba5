//! What the arguments of `etendue render` mean for a scene.

use etendue::image_io::Aov;
use etendue::scene::{Camera, Projection, Scene};
use etendue::settings::Settings;
use etendue::{Error, Result};

use super::args::RenderArgs;

/// Width of the frame when none is asked for, pixels.
const DEFAULT_WIDTH: u32 = 1280;
/// Samples per pixel when none are asked for.
pub const DEFAULT_SPP: u64 = 128;
/// Aspect of the frame when neither arguments nor camera tell.
const DEFAULT_ASPECT: f64 = 16.0 / 9.0;

/// What the arguments mean for this scene.
pub fn settings(args: &RenderArgs, scene: &Scene) -> Result<Settings> {
    let camera = match &args.camera {
        Some(name) => Some(find_camera(scene, name)?),
        None => None,
    };
    let (width, height) = frame(scene, camera, args.width, args.height, DEFAULT_WIDTH);
    let samples = args.samples.clone();
    let settings = Settings {
        width,
        height,
        crop: args.crop,
        samples: samples.unwrap_or_else(|| 0..args.spp.unwrap_or(DEFAULT_SPP)),
        seed: args.seed,
        max_depth: args.max_depth,
        backend: args.backend.into(),
        estimator: args.estimator.into(),
        camera,
        adaptive: args.adaptive,
        share: args.share,
        aovs: args.aovs().into_iter().any(Aov::needs_first_hit),
        ..Settings::default()
    };
    settings.validate()?;
    Ok(settings)
}

/// Width and height of the frame: as asked, else by the camera's aspect, else so wide.
pub fn frame(
    scene: &Scene,
    camera: Option<usize>,
    width: Option<u32>,
    height: Option<u32>,
    default_width: u32,
) -> (u32, u32) {
    let aspect = scene
        .cameras
        .get(camera.unwrap_or(0))
        .and_then(aspect)
        .unwrap_or(DEFAULT_ASPECT);
    match (width, height) {
        (Some(width), Some(height)) => (width, height),
        (None, Some(height)) => (pixels(f64::from(height) * aspect), height),
        (width, None) => {
            let width = width.unwrap_or(default_width);
            (width, pixels(f64::from(width) / aspect))
        }
    }
}

/// Whole pixels, at least one.
fn pixels(length: f64) -> u32 {
    // `as` saturates; `validate` refuses what is too large
    length.round().max(1.0) as u32
}

/// Width over height that a camera asks for.
fn aspect(camera: &Camera) -> Option<f64> {
    match camera.projection {
        Projection::Perspective { aspect, .. } => aspect.map(f64::from),
        Projection::Orthographic { xmag, ymag } => Some(f64::from(xmag) / f64::from(ymag)),
    }
    .filter(|aspect| aspect.is_finite() && *aspect > 0.0)
}

/// A camera by its name or, where none is called so, by its index.
fn find_camera(scene: &Scene, asked: &str) -> Result<usize> {
    let by_name = scene.cameras.iter().position(|c| c.name == asked);
    let by_index = || asked.parse().ok().filter(|&i| i < scene.cameras.len());
    by_name.or_else(by_index).ok_or_else(|| {
        let names: Vec<_> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        Error::Settings {
            name: "--camera",
            what: match names.is_empty() {
                true => format!("there is no {asked}: the scene has no cameras"),
                false => format!("there is no {asked}; the scene has {}", names.join(", ")),
            },
        }
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use glam::DAffine3;

    use super::super::args::{Arguments, Command};
    use super::*;

    fn parse(line: &str) -> RenderArgs {
        let words = "etendue render scene.gltf -o out.exr".split(' ');
        match Arguments::parse_from(words.chain(line.split_whitespace())).command {
            Command::Render(args) => *args,
            _ => unreachable!("the line says render"),
        }
    }

    fn scene() -> Scene {
        let camera = |name: &str, projection| Camera {
            name: name.to_owned(),
            world_from_camera: DAffine3::IDENTITY,
            projection,
        };
        let wide = Projection::Perspective {
            yfov: 1.0,
            aspect: Some(2.0),
        };
        let open = Projection::Perspective {
            yfov: 1.0,
            aspect: None,
        };
        let flat = Projection::Orthographic {
            xmag: 1.0,
            ymag: 4.0,
        };
        Scene {
            cameras: vec![
                camera("1", wide),
                camera("open", open),
                camera("flat", flat),
            ],
            ..Scene::default()
        }
    }

    #[test]
    fn the_frame_follows_the_camera() {
        let size = |line: &str, scene: &Scene| {
            let settings = settings(&parse(line), scene).unwrap();
            (settings.width, settings.height)
        };
        assert_eq!(size("", &scene()), (1280, 640));
        assert_eq!(size("--width 100", &scene()), (100, 50));
        assert_eq!(size("--height 100", &scene()), (200, 100));
        assert_eq!(size("--width 100 --height 3", &scene()), (100, 3));
        assert_eq!(size("--camera open", &scene()), (1280, 720));
        assert_eq!(size("--camera flat --width 100", &scene()), (100, 400));
        assert_eq!(size("", &Scene::default()), (1280, 720));
    }

    #[test]
    fn cameras_go_by_name_before_index() {
        let index = |name: &str| settings(&parse(&format!("--camera {name}")), &scene());
        // a camera is called 1, and it is the first one
        assert_eq!(index("1").unwrap().camera, Some(0));
        assert_eq!(index("2").unwrap().camera, Some(2));
        let message = index("3").unwrap_err().to_string();
        assert!(message.contains("1, open, flat"), "{message}");
    }

    #[test]
    fn samples_come_from_either_option() {
        let samples = |line: &str| settings(&parse(line), &scene()).unwrap().samples;
        assert_eq!(samples(""), 0..128);
        assert_eq!(samples("--spp 5"), 0..5);
        assert_eq!(samples("--samples 5..9"), 5..9);
    }

    #[test]
    fn only_first_hit_layers_cost_anything() {
        let aovs = |line: &str| settings(&parse(line), &scene()).unwrap().aovs;
        assert!(!aovs("--aov stderr,samples"));
        assert!(aovs("--aov stderr,depth"));
        assert!(aovs("--aov dropped"));
    }
}
