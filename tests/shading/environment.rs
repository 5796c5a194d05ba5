//! The environment map: directions against densities, and there and back.

use std::f64::consts::{PI, TAU};

use etendue::layout::{EnvTexel, Params};
use glam::DVec3;

use crate::fixture::Rng;
use crate::scene::{ENVIRONMENT, Query, RADIANCE, Scene, alias_table};
use crate::statistics::{Family, chi_square};
use crate::{finish, open};

const WIDTH: usize = 16;
const HEIGHT: usize = 8;
const FACTOR: f64 = 2.5;
const ROTATION: f64 = 0.7;
const CHOICE: f64 = 0.75;

/// Borders of the rows, cosines from the zenith down.
fn edge(row: usize) -> f64 {
    (PI * row as f64 / HEIGHT as f64).cos()
}

fn solid_angle(row: usize) -> f64 {
    TAU / WIDTH as f64 * (edge(row) - edge(row + 1))
}

/// Densities of the texels (any will do for the sampler; some are 0) and the scene.
fn map() -> (Vec<f64>, Vec<[f64; 3]>, Scene) {
    let mut rng = Rng(11);
    let count = WIDTH * HEIGHT;
    let mut texels: Vec<[f32; 4]> = Vec::new();
    for i in 0..count {
        let scale = if i == 53 { 300.0 } else { 1.0 };
        texels.push([0; 4].map(|_| scale * rng.uniform32()));
    }
    let weights: Vec<f64> = (0..count)
        .map(|i| {
            if i % 7 == 3 {
                0.0
            } else {
                f64::from(texels[i][0]).sqrt() * solid_angle(i / WIDTH)
            }
        })
        .collect();
    let total: f64 = weights.iter().sum();
    let densities: Vec<f64> = (0..count)
        .map(|i| weights[i] / total / solid_angle(i / WIDTH))
        .collect();
    let table = alias_table(&weights);
    let env_table = table
        .iter()
        .zip(&densities)
        .map(|(&(keep, alias), &pdf)| EnvTexel {
            keep,
            alias,
            pdf: pdf as f32,
        });
    let scene = Scene {
        params: Params {
            env_radiance: [FACTOR as f32; 3],
            env_width: WIDTH as u32,
            env_height: HEIGHT as u32,
            env_choice: CHOICE as f32,
            env_cos_rotation: ROTATION.cos() as f32,
            env_sin_rotation: ROTATION.sin() as f32,
            ..Params::default()
        },
        env_table: env_table.collect(),
        env_map: texels.clone(),
        has_environment: true,
        ..Scene::default()
    };
    let texels = texels
        .iter()
        .map(|t| [t[0], t[1], t[2]].map(f64::from))
        .collect();
    (densities, texels, scene)
}

/// What stood in direction d of the map stands at R_y(rotation)·d in the world.
fn uv_of(world: DVec3) -> [f64; 2] {
    let d = glam::DQuat::from_rotation_y(-ROTATION) * world;
    [0.5 + d.x.atan2(-d.z) / TAU, d.x.hypot(d.z).atan2(d.y) / PI]
}

/// Bilinear between the texels' centres, around in u, held in v.
fn lookup(texels: &[[f64; 3]], [u, v]: [f64; 2]) -> DVec3 {
    let (x, y) = (u * WIDTH as f64 - 0.5, v * HEIGHT as f64 - 0.5);
    let mut sum = DVec3::ZERO;
    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let (cx, cy) = (x.floor() + dx, y.floor() + dy);
        let weight = (1.0 - (x - cx).abs()) * (1.0 - (y - cy).abs());
        let column = cx.rem_euclid(WIDTH as f64) as usize;
        let row = cy.clamp(0.0, HEIGHT as f64 - 1.0) as usize;
        sum += DVec3::from(texels[row * WIDTH + column]) * weight;
    }
    sum * FACTOR
}

/// Error of (u, v) from directions in single precision: a handful of roundings and an
/// arc tangent whose error on software devices is 1e-6; counted in texels.
const UV_ERROR: f64 = 2e-6;

/// The texel that holds (u, v), or none within the error of its border.
fn cell_of([u, v]: [f64; 2], sine: f64) -> Option<usize> {
    let (x, y) = (u * WIDTH as f64, v * HEIGHT as f64);
    let near = |t: f64, error: f64| (t - t.round()).abs() < error;
    let margin = UV_ERROR * WIDTH as f64;
    if near(x, margin / sine) || near(y, margin) {
        return None;
    }
    Some(y as usize * WIDTH + x as usize)
}

/// Largest difference of neighbouring texels after the factor: bounds the slope of the look-up.
const STEEPEST: f64 = 300.0 * FACTOR;

#[test]
fn directions_have_their_density() {
    let Some(device) = open() else { return };
    let (densities, texels, scene) = map();
    let mut rng = Rng(12);
    let queries: Vec<Query> = (0..1 << 20)
        .map(|_| Query {
            u: [0; 4].map(|_| rng.uniform32()),
            ..Query::default()
        })
        .collect();
    let answers = scene.ask(&device, ENVIRONMENT, &queries);

    // Cells of the world, which lie askew to the texels: azimuth from −Z to +X, and height.
    const PHI: usize = 64;
    const Y: usize = 32;
    let mut counts = vec![0; PHI * Y];
    let mut on_border = 0;
    for answer in &answers {
        let wi = glam::Vec4::from(answer.a).truncate().as_dvec3();
        assert!(
            (wi.length() - 1.0).abs() < 1e-6,
            "unit to a few roundings: {wi}"
        );
        let phi = wi.x.atan2(-wi.z).rem_euclid(TAU);
        let row = ((1.0 - wi.y) / 2.0 * Y as f64) as usize;
        counts[row.min(Y - 1) * PHI + ((phi / TAU * PHI as f64) as usize).min(PHI - 1)] += 1;

        // There and back: radiance and density of the sample are those of its direction.
        let (uv, sine) = (uv_of(wi), wi.x.hypot(wi.z));
        let expected = lookup(&texels, uv);
        for radiance in [answer.b, answer.c] {
            let error = (glam::Vec4::from(radiance).truncate().as_dvec3() - expected).abs();
            let slope = STEEPEST * UV_ERROR * WIDTH as f64 * 2.0 / sine;
            assert!(
                error.max_element() < slope + 1e-6,
                "{wi}: {radiance:?}, {expected}"
            );
        }
        match cell_of(uv, sine) {
            None => on_border += 1,
            Some(cell) => {
                let pdf = CHOICE * densities[cell];
                for got in [answer.a[3], answer.b[3]] {
                    // Three roundings.
                    assert!(
                        (f64::from(got) / pdf - 1.0).abs() < 2e-7,
                        "{wi}: {got} {pdf}"
                    );
                }
            }
        }
    }
    // Of the lines within the margin: 2 · margin of each texel in both axes.
    assert!(on_border < answers.len() / 1000, "{on_border}");

    let mut family = Family::default();
    let p = world_cells(&densities, PHI, Y);
    assert!((p.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    family.add(String::from("environment"), chi_square(&counts, &p));
    family.assert("environment");
    finish(device);
}

/// Exact probabilities: overlaps of the world's cells with the turned texels.
fn world_cells(densities: &[f64], columns: usize, rows: usize) -> Vec<f64> {
    let overlap = |a: [f64; 2], b: [f64; 2]| (a[1].min(b[1]) - a[0].max(b[0])).max(0.0);
    let mut p = vec![0.0; columns * rows];
    for (texel, density) in densities.iter().enumerate() {
        let (x, row) = (texel % WIDTH, texel / WIDTH);
        // Azimuth of the map less the rotation; u = 0.5 looks along −Z.
        let start = TAU * (x as f64 / WIDTH as f64 - 0.5) - ROTATION;
        let phi = [start, start + TAU / WIDTH as f64];
        for (i, p) in p.iter_mut().enumerate() {
            let (column, line) = ((i % columns) as f64, (i / columns) as f64);
            let step = TAU / columns as f64;
            let around: f64 = [-2.0, -1.0, 0.0, 1.0]
                .map(|turn| TAU * turn + step * column)
                .map(|low| overlap(phi, [low, low + step]))
                .iter()
                .sum();
            let high = 1.0 - 2.0 * line / rows as f64;
            let height = overlap([edge(row + 1), edge(row)], [high - 2.0 / rows as f64, high]);
            *p += density * around * height;
        }
    }
    p
}

#[test]
fn every_direction_finds_its_place() {
    let Some(device) = open() else { return };
    let (densities, texels, scene) = map();
    let mut rng = Rng(13);
    let mut directions: Vec<glam::Vec3> = (0..200_000).map(|_| rng.unit()).collect();
    // Around the poles, where acos would lose half of the digits, and on the axes.
    directions.extend((0..10_000).map(|i| {
        let pole = if i % 2 == 0 {
            glam::Vec3::Y
        } else {
            glam::Vec3::NEG_Y
        };
        (pole + 1e-4 * rng.unit()).normalize()
    }));
    directions.extend(glam::Vec3::AXES);
    directions.extend(glam::Vec3::AXES.map(|a| -a));
    let queries: Vec<Query> = directions
        .iter()
        .map(|d| Query {
            u: [d.x, d.y, d.z, 0.0],
            ..Query::default()
        })
        .collect();
    let answers = scene.ask(&device, RADIANCE, &queries);
    let mut worst = [0.0_f64; 2];
    for (d, answer) in directions.iter().zip(&answers) {
        let d = d.as_dvec3();
        let (uv, sine) = (uv_of(d), d.x.hypot(d.z));
        let [u, v] = [answer.b[0], answer.b[1]].map(f64::from);
        // u is worth less near a pole; 0 and 1 are the same place.
        let du = (u - uv[0] - (u - uv[0]).round()).abs() * sine;
        let dv = (v - uv[1]).abs();
        worst = [worst[0].max(du), worst[1].max(dv)];
        assert!(
            du < UV_ERROR && dv < UV_ERROR,
            "{d}: {u} {v} instead of {uv:?}"
        );
        if sine < 1e-7 {
            continue;
        }
        let expected = lookup(&texels, uv);
        let got = glam::Vec4::from(answer.a).truncate().as_dvec3();
        let slope = STEEPEST * UV_ERROR * WIDTH as f64 * 2.0 / sine;
        assert!(
            (got - expected).abs().max_element() < slope + 1e-6,
            "{d}: {got}, {expected}"
        );
        if let Some(cell) = cell_of(uv, sine) {
            let pdf = CHOICE * densities[cell];
            assert!((f64::from(answer.a[3]) - pdf).abs() <= 2e-7 * pdf, "{d}");
        }
    }
    println!("environment_uv off by {worst:?}");
    finish(device);
}
