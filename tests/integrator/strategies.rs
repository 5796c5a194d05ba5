//! All ways to find light have the same mean.

use std::sync::Arc;

use etendue::render::Tuning;
use etendue::scene::{
    AlphaMode, Environment, Filter, Material, Scene, Texels, Texture, TextureRef, Wrap,
};
use etendue::settings::{Estimator, Settings, Strategy};
use glam::{DVec3, Vec3};

use crate::common::*;
use crate::statistics::Estimate;

/// What is compared; the first one is the reference.
const VARIANTS: [(Strategy, Estimator); 4] = [
    (Strategy::Mis, Estimator::Full),
    (Strategy::Mis, Estimator::Textbook),
    (Strategy::LightOnly, Estimator::Full),
    (Strategy::BsdfOnly, Estimator::Full),
];

/// Effort and demand of one scene.
pub struct Plan {
    /// Samples a pixel of each variant: they even out the errors.
    pub samples: [u64; 4],
    /// Relative difference of two means that is allowed, chance included.
    pub delta: f64,
}

/// Means of all variants, each with a seed of its own, agree with the first.
pub fn agree(name: &str, scene: &Scene, plan: &Plan, tuning: Tuning) {
    let mut first = None;
    for (i, (strategy, estimator)) in VARIANTS.into_iter().enumerate() {
        let settings = Settings {
            strategy,
            estimator,
            seed: 21 + i as u64,
            ..settings(16, plan.samples[i])
        };
        let Some(r) = render(scene, &settings, tuning) else {
            return;
        };
        let this = Estimate::of_image(&r.film);
        let what = format!("{name}, {strategy:?}, {estimator:?}");
        println!("{what}: {:.6} ± {:.6}", this.mean, this.error);
        let Some(other) = first else {
            first = Some(this);
            continue;
        };
        let (off, bound) = this.off_from(other);
        assert!(off + bound <= plan.delta, "{what}: {this:?} and {other:?}");
    }
}

#[test]
fn lambert_room_with_a_quad_light() {
    let mut scene = empty();
    add(&mut scene, room(1.0), lambert(0.5));
    add(
        &mut scene,
        square(0.98 * Vec3::Y, -Vec3::Y, 0.7),
        emitter(0.0, 4.0),
    );
    let mut block = sphere(1);
    block
        .positions
        .iter_mut()
        .for_each(|p| *p = 0.3 * *p - 0.6 * Vec3::Y);
    add(&mut scene, faceted(block), lambert(0.8));
    scene.cameras = vec![pinhole(
        DVec3::new(0.1, 0.0, 0.95),
        DVec3::new(0.0, -0.2, -1.0),
        70.0,
    )];
    let plan = Plan {
        samples: [4096, 4096, 4096, 16_384],
        delta: 1e-2,
    };
    agree("room", &scene, &plan, Tuning::default());
}

#[test]
fn rough_metal_with_a_spherical_emitter() {
    let mut scene = empty();
    add(
        &mut scene,
        square(Vec3::ZERO, Vec3::Y, 4.0),
        metal(0.9, 0.3),
    );
    let mut lamp = sphere(1);
    lamp.positions
        .iter_mut()
        .for_each(|p| *p += Vec3::new(0.0, 1.6, -1.5));
    add(&mut scene, faceted(lamp), emitter(0.0, 2.0));
    scene.cameras = vec![pinhole(DVec3::new(0.0, 2.0, 2.5), DVec3::Z * 0.2, 25.0)];
    let plan = Plan {
        samples: [8192, 8192, 32_768, 8192],
        delta: 1.5e-2,
    };
    agree("metal", &scene, &plan, Tuning::default());
}

#[test]
fn sun_in_a_map_behind_an_occluder() {
    let mut scene = empty();
    add(&mut scene, square(Vec3::ZERO, Vec3::Y, 4.0), lambert(0.7));
    add(&mut scene, square(Vec3::Y, Vec3::Y, 0.5), lambert(0.2));
    let mut texels = vec![[0.5; 3]; 16 * 8];
    texels[16 + 5] = [8.0, 7.0, 6.0];
    scene.environment = Some(Environment::Map {
        width: 16,
        height: 8,
        texels: Arc::new(texels),
        intensity: 1.3,
        rotation: 0.7,
    });
    scene.cameras = vec![pinhole(DVec3::new(0.0, 3.0, 4.0), DVec3::ZERO, 35.0)];
    let plan = Plan {
        samples: [16_384, 16_384, 32_768, 16_384],
        delta: 5e-3,
    };
    agree("sun", &scene, &plan, Tuning::default());
}

#[test]
fn pane_and_cut_out_under_a_quad_light() {
    let mut scene = empty();
    add(&mut scene, square(-Vec3::Y, Vec3::Y, 3.0), lambert(0.7));
    let mut pane = lambert(0.4);
    pane.alpha_mode = AlphaMode::Blend;
    pane.base_color.w = 0.5;
    add(
        &mut scene,
        square(Vec3::new(-0.5, -0.3, 0.0), Vec3::Y, 0.5),
        pane,
    );
    let checker = Material {
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        base_color_texture: Some(TextureRef {
            texture: 0,
            uv_set: 0,
            uv_transform: [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
        }),
        ..lambert(0.9)
    };
    scene.textures = vec![Texture {
        name: String::from("checker"),
        width: 2,
        height: 2,
        texels: Texels::Rgba8 {
            data: [[255; 4], [255, 255, 255, 0], [255, 255, 255, 0], [255; 4]].concat(),
            srgb: true,
        },
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    }];
    add(
        &mut scene,
        square(Vec3::new(0.5, -0.4, 0.0), Vec3::Y, 0.5),
        checker,
    );
    add(
        &mut scene,
        square(0.3 * Vec3::Y, -Vec3::Y, 1.5),
        emitter(0.0, 3.0),
    );
    scene.cameras = vec![pinhole(
        DVec3::new(0.0, 0.2, 3.0),
        DVec3::new(0.0, -0.7, 0.0),
        40.0,
    )];
    let plan = Plan {
        samples: [16_384; 4],
        delta: 5e-3,
    };
    agree("pane", &scene, &plan, Tuning::default());
}
