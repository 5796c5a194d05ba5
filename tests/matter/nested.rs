//! Solids in solids: what overlaps, what touches, and priorities.

use etendue::render::Tuning;
use etendue::scene::{Medium, Phase, Scene};
use etendue::settings::Settings;
use glam::Vec3;

use crate::common::backends::pair;
use crate::common::*;
use crate::tier::count;
use crate::{block, channel_mean, fresnel, glass, grey, oblique};

/// Transmittance of glass, liquid and glass in layers, where `touch` tells for the liquid's faces whether
/// the index changes there; ray transfer with all reflections by adding layers.
fn layers(interfaces: &[(f64, f64)], taus: &[f64]) -> (f64, f64) {
    // (R from above, T, R from below) of what has been added so far.
    let (mut r_up, mut t, mut r_down) = (interfaces[0].0, interfaces[0].1, interfaces[0].0);
    for (next, tau) in interfaces[1..].iter().zip(taus) {
        let (r, s) = *next;
        let round = 1.0 / (1.0 - r_down * r * tau * tau);
        let r_new = r_up + t * t * r * tau * tau * round;
        let t_new = t * s * tau * round;
        r_down = r + s * s * r_down * tau * tau * round;
        (r_up, t) = (r_new, t_new);
    }
    (r_up, t)
}

/// Reflectance and transmittance of air | n0 | n1 | … | air, each `alpha_d` thick optically, at `degrees`.
fn stack(indices: &[f64], alpha_d: &[f64], degrees: f64) -> (f64, f64) {
    let sin = degrees.to_radians().sin();
    let cos = |n: f64| (1.0 - (sin / n).powi(2)).sqrt();
    let all: Vec<f64> = [1.0].iter().chain(indices).chain(&[1.0]).copied().collect();
    let interfaces: Vec<(f64, f64)> = all
        .windows(2)
        .map(|w| fresnel(cos(w[0]), w[1] / w[0]))
        .map(|r| (r, 1.0 - r))
        .collect();
    let taus: Vec<f64> = indices
        .iter()
        .zip(alpha_d)
        .map(|(n, a)| (-a / cos(*n)).exp())
        .collect();
    layers(&interfaces, &taus)
}

fn lit_from_below(scene: &mut Scene) {
    let sky = square(Vec3::new(0.0, 0.0, -50.0), Vec3::Z, 4000.0);
    add(scene, sky, emitter(0.0, 1.0));
}

fn slab(low: f32, high: f32) -> etendue::scene::Mesh {
    block(Vec3::new(-20.0, -20.0, low), Vec3::new(20.0, 20.0, high))
}

fn assert_transmits(what: &str, scene: &Scene, settings: &Settings, truth: f64) {
    let Some(r) = render(scene, settings, Tuning::default()) else {
        return;
    };
    assert_eq!(r.report.ledger.interior_overflows, 0);
    let seen = channel_mean(&r.film, 0);
    let (mean, off, bound) = (seen.mean, (seen.mean - truth).abs(), seen.chance());
    println!("{what}: {mean:.6}, truth {truth:.6}, off {off:.1e} ± {bound:.1e}");
    assert!(off + bound <= 4e-3, "{what}: {mean} instead of {truth}");
}

/// Glass, liquid, glass; the liquid reaches `overlap` into the glass, which has priority.
#[test]
fn liquid_between_panes_does_not_depend_on_the_overlap() {
    let alpha = 0.3;
    for backend in pair() {
        for degrees in [0.0, 60.0] {
            let truth = stack(&[1.5, 1.33, 1.5], &[0.0, alpha, 0.0], degrees).1;
            for overlap in [0.0, 1e-4, 1e-1] {
                let mut scene = empty();
                lit_from_below(&mut scene);
                let mut pane = glass(1.5, Medium::default());
                pane.volume.as_mut().unwrap().priority = 1;
                add(&mut scene, slab(-0.5, 0.0), pane.clone());
                add(&mut scene, slab(-2.0, -1.5), pane);
                let liquid = glass(1.33, grey(alpha as f32, 0.0, Phase::Isotropic));
                add(&mut scene, slab(-1.5 - overlap, -0.5 + overlap), liquid);
                scene.cameras = vec![oblique(degrees, 0.1)];
                let settings = Settings {
                    backend,
                    ..settings(16, count(512, 4096))
                };
                let what = format!("{backend:?}, {degrees}°, overlap {overlap}");
                assert_transmits(&what, &scene, &settings, truth);
            }
        }
    }
}

#[test]
fn touching_solids_of_one_index_are_one() {
    for (n, truth) in [
        ([1.5, 1.5], stack(&[1.5], &[0.0], 60.0).1),
        ([1.5, 2.0], stack(&[1.5, 2.0], &[0.0, 0.0], 60.0).1),
    ] {
        let mut scene = empty();
        lit_from_below(&mut scene);
        add(
            &mut scene,
            slab(-0.5, 0.0),
            glass(n[0] as f32, Medium::default()),
        );
        add(
            &mut scene,
            slab(-1.0, -0.5),
            glass(n[1] as f32, Medium::default()),
        );
        scene.cameras = vec![oblique(60.0, 0.1)];
        assert_transmits(&format!("{n:?}"), &scene, &settings(16, 4096), truth);
    }
}

/// An inner solid needs no priority: the smaller one fills the space. Only its own absorption counts inside.
#[test]
fn inner_solids_fill_the_space_by_default() {
    for outer_first in [true, false] {
        let mut scene = empty();
        lit_from_below(&mut scene);
        let outer = (
            slab(-3.0, 0.0),
            glass(1.0, grey(0.2, 0.0, Phase::Isotropic)),
        );
        let inner = (
            block(Vec3::new(-9.0, -9.0, -2.0), Vec3::new(9.0, 9.0, -1.0)),
            glass(1.0, grey(0.7, 0.0, Phase::Isotropic)),
        );
        let order = if outer_first {
            [outer, inner]
        } else {
            [inner, outer]
        };
        for (mesh, material) in order {
            add(&mut scene, mesh, material);
        }
        scene.cameras = vec![oblique(30.0, 0.1)];
        let truth = (-(2.0 * 0.2 + 0.7) / 30f64.to_radians().cos()).exp();
        assert_transmits("matched", &scene, &settings(8, 16), truth);
        // The camera inside the inner solid, looking down: 0.5 m of it and 1 m of the outer one.
        scene.cameras = vec![parallel(
            glam::DVec3::new(0.0, 0.0, -1.5),
            glam::DVec3::new(0.0, 0.0, -9.0),
            0.1,
        )];
        assert_transmits(
            "inside",
            &scene,
            &settings(8, 16),
            (-0.5f64 * 0.7 - 0.2).exp(),
        );
    }
}
