//! Direct light: how often each emitter is chosen, and what a sample says.

use etendue::layout::{self, Light, Material, NONE, Params};
use glam::{DVec3, Vec4};

use crate::fixture::Rng;
use crate::scene::{Answer, LIGHT, Query, Scene, alias_table};
use crate::statistics::{Family, chi_square};
use crate::{finish, open};

fn queries(count: usize, seed: u64) -> Vec<Query> {
    let mut rng = Rng(seed);
    (0..count)
        .map(|_| Query {
            u: [0; 4].map(|_| rng.uniform32()),
            ..Query::default()
        })
        .collect()
}

const WEIGHTS: [f64; 7] = [5.0, 1.0, 0.03, 2.0, 9.0, 0.4, 1.5];
const INTENSITY: [f32; 3] = [3.0, 2.0, 0.5];

/// Points along +X at 1, 2, … metres, a spot and a directional light.
fn punctual(env_choice: f64) -> Scene {
    let total: f64 = WEIGHTS.iter().sum();
    let mut lights: Vec<Light> = alias_table(&WEIGHTS)
        .iter()
        .zip(WEIGHTS)
        .enumerate()
        .map(|(i, (&(keep, alias), weight))| Light {
            kind: layout::LIGHT_POINT,
            keep,
            alias,
            choice: (weight / total) as f32,
            position: [1.0 + i as f32, 0.0, 0.0],
            intensity: INTENSITY,
            ..Light::default()
        })
        .collect();
    // 20° off its axis, between its cones.
    let (sin, cos) = 20f64.to_radians().sin_cos();
    lights[3].kind = layout::LIGHT_SPOT;
    lights[3].direction = [-cos as f32, sin as f32, 0.0];
    lights[3].cos_inner = 10f32.to_radians().cos();
    lights[3].cos_outer = 35f32.to_radians().cos();
    lights[5].kind = layout::LIGHT_DIRECTIONAL;
    lights[5].direction = [0.6, -0.8, 0.0];
    Scene {
        params: Params {
            light_count: WEIGHTS.len() as u32,
            env_choice: env_choice as f32,
            table_choice: 1.0 - env_choice as f32,
            env_radiance: [1.0; 3],
            env_width: 1,
            env_height: 1,
            env_cos_rotation: 1.0,
            env_shift: 31,
            ..Params::default()
        },
        lights,
        env_map: vec![[1.0, 1.0, 1.0, EVEN as f32]],
        // Two runs, and a cell for each.
        env_table: vec![[0, NONE], [1, NONE]],
        has_environment: env_choice > 0.0,
        has_punctual: true,
        ..Scene::default()
    }
}

/// Density in (u, v) of a map of one texel, over 2π².
const EVEN: f64 = 0.5 / (std::f64::consts::PI * std::f64::consts::PI);

/// Which entry a sample is of; the environment comes last.
fn entry(answer: &Answer) -> usize {
    match answer.b[3] {
        1.0 => WEIGHTS.len(),
        3.0 => 5,
        _ => answer.c[0] as usize - 1,
    }
}

/// Irradiance of an entry at the origin, facing it.
fn irradiance(i: usize) -> DVec3 {
    let intensity = glam::Vec3::from(INTENSITY).as_dvec3();
    let distance = (i + 1) as f64;
    let cosine = |degrees: f64| degrees.to_radians().cos();
    match i {
        5 => intensity,
        3 => {
            let ramp = (cosine(20.0) - cosine(35.0)) / (cosine(10.0) - cosine(35.0));
            intensity * ramp * ramp / (distance * distance)
        }
        _ => intensity / (distance * distance),
    }
}

#[test]
fn lights_are_chosen_as_often_as_their_table_says() {
    let Some(device) = open() else { return };
    let mut family = Family::default();
    let total: f64 = WEIGHTS.iter().sum();
    for env_choice in [0.0, 0.3] {
        let answers = punctual(env_choice).ask(&device, LIGHT, &queries(1 << 20, 21));
        let mut p: Vec<f64> = WEIGHTS
            .iter()
            .map(|w| w / total * (1.0 - env_choice))
            .collect();
        p.push(env_choice);
        let mut counts = vec![0; p.len()];
        for answer in &answers {
            let i = entry(answer);
            counts[i] += 1;
            let wi = Vec4::from(answer.a).truncate().as_dvec3();
            let (density, error) = if i == WEIGHTS.len() {
                // the sine near a pole comes from a rounded direction
                let sine = wi.x.hypot(wi.z);
                (p[i] * EVEN / sine, 5e-7 / sine)
            } else {
                (p[i], 3e-7)
            };
            // Three roundings, of choice, table and product.
            assert!(
                (f64::from(answer.a[3]) / density - 1.0).abs() < error,
                "{answer:?}"
            );
            if i < WEIGHTS.len() {
                let got = Vec4::from(answer.b).truncate().as_dvec3();
                // The ramp of the spot cancels: 6e-8 of a difference of 0.17, squared.
                let error = (got / irradiance(i) - 1.0).abs().max_element();
                assert!(error < 3e-6, "{i}: {got} instead of {}", irradiance(i));
                let to = if i == 5 {
                    DVec3::new(-0.6, 0.8, 0.0)
                } else {
                    DVec3::X
                };
                assert!((wi - to).length() < 3e-7, "{i}: {wi}");
            }
        }
        family.add(
            format!("lights, environment {env_choice}"),
            chi_square(&counts, &p),
        );
    }
    family.assert("choice of lights");
    finish(device);
}

/// One emissive triangle, its front towards the origin or away from it.
fn triangle(is_front: bool, is_double_sided: bool) -> ([DVec3; 3], Scene) {
    let corners: [[f32; 3]; 3] = [[1.0, 2.0, -1.0], [-2.0, 2.5, 0.5], [0.5, 1.5, 2.0]];
    let order: [u32; 3] = if is_front { [0, 1, 2] } else { [0, 2, 1] };
    let corner = |i: usize| corners[order[i] as usize];
    let edge = |i: usize| std::array::from_fn(|axis| corner(i)[axis] - corner(0)[axis]);
    let scene = Scene {
        params: Params {
            light_count: 1,
            table_choice: 0.8,
            ..Params::default()
        },
        triangles: vec![[order[0], order[1], order[2], 0]],
        vertices: corners
            .iter()
            .flat_map(|&[x, y, z]| [[x, y, z, 0.0], [0.0; 4]])
            .collect(),
        materials: vec![Material {
            emission: INTENSITY,
            emission_pdf: 0.37,
            flags: if is_double_sided {
                layout::MATERIAL_DOUBLE_SIDED
            } else {
                0
            },
            ..Material::default()
        }],
        lights: vec![Light {
            kind: layout::LIGHT_TRIANGLE,
            keep: 1.0,
            choice: 1.0,
            position: corner(0),
            edge1: edge(1),
            edge2: edge(2),
            material: layout::LIGHT_PLAIN
                | if is_double_sided {
                    layout::LIGHT_DOUBLE_SIDED
                } else {
                    0
                },
            intensity: INTENSITY,
            emission_pdf: 0.37,
            ..Light::default()
        }],
        has_area_lights: true,
        ..Scene::default()
    };
    (
        order.map(|i| DVec3::from(corners[i as usize].map(f64::from))),
        scene,
    )
}

#[test]
fn emissive_triangles_are_sampled_by_area() {
    const SIDE: usize = 32;
    let Some(device) = open() else { return };
    let mut family = Family::default();
    for (is_front, is_double_sided) in [(true, false), (true, true), (false, true), (false, false)]
    {
        let ([a, b, c], scene) = triangle(is_front, is_double_sided);
        let answers = scene.ask(&device, LIGHT, &queries(1 << 19, 22));
        let normal = (b - a).cross(c - a).normalize();
        let is_lit = normal.dot(-a) > 0.0 || is_double_sided;
        if !is_lit {
            assert!(
                answers.iter().all(|answer| answer.a[3] == 0.0),
                "the back is dark"
            );
            continue;
        }
        let mut counts = vec![0; SIDE * SIDE];
        for answer in &answers {
            let target = Vec4::from(answer.c).truncate().as_dvec3();
            // Off the plane by the bound on the error of its points at most.
            assert!((target - a).dot(normal).abs() < 1e-5, "{target}");
            let weight = |u: DVec3, v: DVec3| {
                (u - target).cross(v - target).dot(normal) / (b - a).cross(c - a).length()
            };
            let (second, third) = (weight(c, a), weight(a, b));
            // Uniform over the square: the share of the area nearer to the first corner, and the angle.
            let near = (second + third).powi(2);
            let cell = |t: f64| ((t * SIDE as f64).max(0.0) as usize).min(SIDE - 1);
            counts[cell(near) * SIDE + cell(third / (second + third))] += 1;
            let distance2 = target.length_squared();
            let wi = target / distance2.sqrt();
            let pdf = 0.8 * 0.37 * distance2 / normal.dot(wi).abs();
            // The target is off the sampled point by up to 3e-6 m at 1.5 m.
            assert!(
                (f64::from(answer.a[3]) / pdf - 1.0).abs() < 2e-5,
                "{answer:?} {pdf}"
            );
            assert_eq!(answer.b[..3], INTENSITY);
            assert!((Vec4::from(answer.a).truncate().as_dvec3() - wi).length() < 1e-5);
        }
        let p = vec![1.0 / (SIDE * SIDE) as f64; SIDE * SIDE];
        family.add(
            format!("triangle {is_front} {is_double_sided}"),
            chi_square(&counts, &p),
        );
    }
    family.assert("emissive triangles");
    finish(device);
}
