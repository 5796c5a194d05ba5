//! The environment map: directions against densities, and there and back.

use std::f64::consts::{PI, TAU};

use etendue::layout::{NONE, Params};
use glam::DVec3;

use crate::fixture::Rng;
use crate::scene::{ENVIRONMENT, Query, RADIANCE, Scene};
use crate::statistics::{Family, chi_square};
use crate::{finish, open};

const WIDTH: usize = 16;
const HEIGHT: usize = 8;
const FACTOR: f64 = 2.5;
const ROTATION: f64 = 0.7;
const CHOICE: f64 = 0.75;

/// Densities at the centres of the texels over 2π² (any will do for the sampler; some are 0), radiances and the scene.
fn map() -> (Vec<f64>, Vec<[f64; 3]>, Scene) {
    let mut rng = Rng(11);
    let count = WIDTH * HEIGHT;
    let mut texels: Vec<[f32; 4]> = Vec::new();
    for i in 0..count {
        let scale = if i == 53 { 300.0 } else { 1.0 };
        texels.push([0; 4].map(|_| scale * rng.uniform32()));
    }
    let values: Vec<f64> = (0..count)
        .map(|i| {
            if i % 7 == 3 {
                0.0
            } else {
                f64::from(texels[i][0]).sqrt()
            }
        })
        .collect();
    let cells: Vec<f64> = (0..WIDTH * (HEIGHT + 1))
        .map(|cell| {
            let (column, row) = (cell % WIDTH, cell / WIDTH);
            let middle = [(column + 1) as f64 / WIDTH as f64, middle_of(row)];
            bilinear(|i| values[i], middle) * height_of(row) / WIDTH as f64
        })
        .collect();
    let total: f64 = cells.iter().sum();
    let densities: Vec<f64> = values.iter().map(|v| v / total / (TAU * PI)).collect();
    for (texel, density) in texels.iter_mut().zip(&densities) {
        texel[3] = *density as f32;
    }
    let scene = Scene {
        params: Params {
            env_radiance: [FACTOR as f32; 3],
            env_width: WIDTH as u32,
            env_height: HEIGHT as u32,
            env_choice: CHOICE as f32,
            env_cos_rotation: ROTATION.cos() as f32,
            env_sin_rotation: ROTATION.sin() as f32,
            env_shift: RUN_SHIFT,
            ..Params::default()
        },
        env_table: cell_table(&cells),
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

/// log₂ of the places in a run of the table: some runs lie in one cell, others hold several.
const RUN_SHIFT: u32 = 26;

/// The table of cells in the order of their indices: runs of places, then the last place of each cell.
fn cell_table(cells: &[f64]) -> Vec<[u32; 2]> {
    let total: f64 = cells.iter().sum();
    let mut sum = 0.0;
    let mut entries = Vec::new();
    for (i, cell) in cells.iter().enumerate() {
        sum += cell / total;
        if *cell > 0.0 {
            let end = (sum * 2_f64.powi(32)).round() as u64;
            entries.push([(end - 1) as u32, i as u32]);
        }
    }
    let runs = 1_u32 << (32 - RUN_SHIFT);
    let entry = |place: u32| entries.iter().filter(|e| e[0] < place).count();
    let look = |run: u32| {
        let first = entry(run << RUN_SHIFT);
        let last = entry((run << RUN_SHIFT) + (1 << RUN_SHIFT) - 1);
        match first == last {
            true => [entries[first][1], NONE],
            false => [runs + first as u32, runs + last as u32],
        }
    };
    let mut table: Vec<[u32; 2]> = (0..runs).map(look).collect();
    assert!(table.iter().any(|w| w[1] == NONE) && table.iter().any(|w| w[1] != NONE));
    table.extend(entries);
    table
}

/// Height of a row of cells in v, and its middle. Rows lie between those of texels; half a row is left at each pole.
fn height_of(row: usize) -> f64 {
    let share = if row == 0 || row == HEIGHT { 0.5 } else { 1.0 };
    share / HEIGHT as f64
}

fn middle_of(row: usize) -> f64 {
    match row {
        0 => 0.25 / HEIGHT as f64,
        HEIGHT => 1.0 - 0.25 / HEIGHT as f64,
        _ => row as f64 / HEIGHT as f64,
    }
}

/// What stood in direction d of the map stands at R_y(rotation)·d in the world.
fn uv_of(world: DVec3) -> [f64; 2] {
    let d = glam::DQuat::from_rotation_y(-ROTATION) * world;
    [0.5 + d.x.atan2(-d.z) / TAU, d.x.hypot(d.z).atan2(d.y) / PI]
}

/// Bilinear between the texels' centres, around in u, held in v.
fn bilinear<T: std::ops::Mul<f64, Output = T> + std::iter::Sum>(
    value: impl Fn(usize) -> T,
    [u, v]: [f64; 2],
) -> T {
    let (x, y) = (u * WIDTH as f64 - 0.5, v * HEIGHT as f64 - 0.5);
    [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
        .into_iter()
        .map(|(dx, dy)| {
            let (cx, cy) = (x.floor() + dx, y.floor() + dy);
            let weight = (1.0 - (x - cx).abs()) * (1.0 - (y - cy).abs());
            let column = cx.rem_euclid(WIDTH as f64) as usize;
            let row = cy.clamp(0.0, HEIGHT as f64 - 1.0) as usize;
            value(row * WIDTH + column) * weight
        })
        .sum()
}

fn lookup(texels: &[[f64; 3]], uv: [f64; 2]) -> DVec3 {
    bilinear(|i| DVec3::from(texels[i]), uv) * FACTOR
}

/// Density per steradian, with the choice of the map.
fn density(densities: &[f64], uv: [f64; 2], sine: f64) -> f64 {
    CHOICE * bilinear(|i| densities[i], uv) / sine
}

/// Error of (u, v) from directions in single precision: a handful of roundings and an
/// arc tangent whose error on software devices is 1e-6; counted in texels.
const UV_ERROR: f64 = 2e-6;

/// Largest difference of neighbouring texels after the factor: bounds the slope of the look-up.
const STEEPEST: f64 = 300.0 * FACTOR;

/// How far the density may be off for what `UV_ERROR` moves it, and three roundings of it and of the sine.
fn density_error(densities: &[f64], pdf: f64, sine: f64) -> f64 {
    let steepest = densities.iter().fold(0.0, |a: f64, b| a.max(*b));
    CHOICE * steepest * UV_ERROR * WIDTH as f64 * 2.0 / (sine * sine) + 1e-6 * pdf
}

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
        let pdf = density(&densities, uv, sine);
        for got in [answer.a[3], answer.b[3]] {
            let error = (f64::from(got) - pdf).abs();
            assert!(
                error < density_error(&densities, pdf, sine),
                "{wi}: {got} {pdf}"
            );
        }
    }

    let mut family = Family::default();
    let p = world_cells(&densities, PHI, Y);
    assert!((p.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    family.add(String::from("environment"), chi_square(&counts, &p));
    family.assert("environment");
    finish(device);
}

/// Exact probabilities: the density is bilinear in (u, v) on the parts that cells of the world and
/// of the map have in common, so that its value at their middle is its mean.
fn world_cells(densities: &[f64], columns: usize, rows: usize) -> Vec<f64> {
    let mut p = vec![0.0; columns * rows];
    for (i, p) in p.iter_mut().enumerate() {
        let (column, line) = ((i % columns) as f64, (i / columns) as f64);
        let v_of = |line: f64| (1.0 - 2.0 * line / rows as f64).clamp(-1.0, 1.0).acos() / PI;
        // Azimuth of the world plus the rotation is that of the map; u = 0.5 looks along −Z.
        let u_of = |column: f64| column / columns as f64 + ROTATION / TAU + 0.5;
        for [u0, u1] in parts([u_of(column), u_of(column + 1.0)], WIDTH) {
            for [v0, v1] in parts([v_of(line), v_of(line + 1.0)], HEIGHT) {
                let middle = [(0.5 * (u0 + u1)).rem_euclid(1.0), 0.5 * (v0 + v1)];
                let mean = TAU * PI * bilinear(|i| densities[i], middle);
                *p += mean * (u1 - u0) * (v1 - v0);
            }
        }
    }
    p
}

/// Cuts a range at the centres of `count` texels a unit.
fn parts([low, high]: [f64; 2], count: usize) -> Vec<[f64; 2]> {
    let mut cuts = vec![low];
    let mut k = (low * count as f64 - 0.5).floor() + 1.0;
    while (k + 0.5) / (count as f64) < high {
        cuts.push((k + 0.5) / count as f64);
        k += 1.0;
    }
    cuts.push(high);
    cuts.windows(2).map(|w| [w[0], w[1]]).collect()
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
        let pdf = density(&densities, uv, sine);
        assert!(
            (f64::from(answer.a[3]) - pdf).abs() <= density_error(&densities, pdf, sine),
            "{d}"
        );
    }
    println!("environment_uv off by {worst:?}");
    finish(device);
}
