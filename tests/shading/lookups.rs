//! Texture look-ups and camera rays against double precision.

use etendue::layout::{self, Params, TextureUse};
use glam::{DQuat, DVec3, Vec4};

use crate::fixture::Rng;
use crate::scene::{Answer, CAMERA, Query, Scene, TEXTURE};
use crate::{finish, open};

/// Unit roundoff of single precision.
const ROUNDING: f64 = 5.960_464_5e-8;

const WIDTH: usize = 5;
const HEIGHT: usize = 3;

/// IEC 61966-2-1.
fn srgb(byte: u32) -> f64 {
    let v = f64::from(byte) / 255.0;
    if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// The image in the device's words and in linear values, for each format.
struct Image {
    words: Vec<u32>,
    values: Vec<[f64; 4]>,
}

fn image(format: u32, rng: &mut Rng) -> Image {
    let mut image = Image {
        words: Vec::new(),
        values: Vec::new(),
    };
    for _ in 0..WIDTH * HEIGHT {
        let c = [0; 4].map(|_| (rng.bits() >> 48) as u32);
        if format == layout::FORMAT_RGBA16 {
            image.words.extend([c[0] | c[1] << 16, c[2] | c[3] << 16]);
            image.values.push(c.map(|v| f64::from(v) / 65_535.0));
            continue;
        }
        let c = c.map(|v| v & 255);
        image.words.push(c[0] | c[1] << 8 | c[2] << 16 | c[3] << 24);
        let mut value = c.map(|v| f64::from(v) / 255.0);
        if format == layout::FORMAT_SRGB8 {
            value = [srgb(c[0]), srgb(c[1]), srgb(c[2]), value[3]];
        }
        image.values.push(value);
    }
    image
}

/// glTF's wrapping: repeat tiles, mirror turns every second tile, clamp holds the border.
fn wrap(i: i64, size: usize, mode: u32) -> usize {
    let size = size as i64;
    let wrapped = match mode {
        layout::WRAP_CLAMP => i.clamp(0, size - 1),
        layout::WRAP_MIRROR => {
            let k = i.rem_euclid(2 * size);
            k.min(2 * size - 1 - k)
        }
        _ => i.rem_euclid(size),
    };
    wrapped as usize
}

#[test]
fn textures_are_wrapped_filtered_and_decoded() {
    const EACH: usize = 4000;
    let Some(device) = open() else { return };
    let mut rng = Rng(31);
    let mut texels: Vec<u32> = (0..256).map(|b| (srgb(b) as f32).to_bits()).collect();
    let mut uses = Vec::new();
    let mut images = Vec::new();
    // A turned, scaled and shifted one, as KHR_texture_transform gives.
    let rows = [[1.3f32, -0.4, 0.25], [0.6, 0.9, -1.75]];
    for format in [
        layout::FORMAT_RGBA8,
        layout::FORMAT_SRGB8,
        layout::FORMAT_RGBA16,
    ] {
        let image = image(format, &mut rng);
        for k in 0..18 {
            let (wrap_u, wrap_v, filter) = (k % 3, k / 3 % 3, k / 9);
            uses.push(TextureUse {
                first_texel: texels.len() as u32,
                width: WIDTH as u32,
                height: HEIGHT as u32,
                format: format | wrap_u << 4 | wrap_v << 8 | filter << 12,
                uv_row_u: if k % 2 == 0 { [1.0, 0.0, 0.0] } else { rows[0] },
                uv_row_v: if k % 2 == 0 { [0.0, 1.0, 0.0] } else { rows[1] },
                ..TextureUse::default()
            });
        }
        texels.extend(&image.words);
        images.push(image);
    }
    let scene = Scene {
        texture_uses: uses.clone(),
        texels,
        ..Scene::default()
    };
    let mut queries = Vec::new();
    for index in 0..uses.len() {
        for i in 0..EACH {
            // Near the image, some far away, and on the borders of texels exactly.
            let reach = if i % 4 == 0 { 1000.0 } else { 3.0 };
            let mut at = || {
                let x = reach * (2.0 * rng.uniform() - 1.0);
                (if i % 16 == 1 {
                    (x * 4.0).round() / 4.0
                } else {
                    x
                }) as f32
            };
            queries.push(Query {
                u: [at(), at(), 0.0, 0.0],
                index: [index as u32, 0],
            });
        }
    }
    let answers = scene.ask(&device, TEXTURE, &queries);
    let mut skipped = 0;
    for (q, answer) in queries.iter().zip(&answers) {
        let index = q.index[0] as usize;
        let image = &images[index / 18];
        if !is_right(&uses[index], image, q.u, answer.a) {
            skipped += 1;
        }
    }
    // Nearest texels at their borders only: every sixteenth query is put there on purpose.
    assert!(
        skipped < queries.len() / 20,
        "{skipped} of {}",
        queries.len()
    );
    finish(device);
}

/// Asserts one look-up; false where rounding may choose the next texel.
fn is_right(applied: &TextureUse, image: &Image, at: [f32; 4], got: [f32; 4]) -> bool {
    let [s, t] = [at[0], at[1]].map(f64::from);
    let row = |r: [f32; 3]| {
        let terms = [f64::from(r[0]) * s, f64::from(r[1]) * t, f64::from(r[2])];
        (
            terms.iter().sum::<f64>(),
            terms.iter().map(|x| x.abs()).sum::<f64>(),
        )
    };
    let ((u, size_u), (v, size_v)) = (row(applied.uv_row_u), row(applied.uv_row_v));
    let (x, y) = (u * WIDTH as f64, v * HEIGHT as f64);
    // Five roundings of the largest term of the transform, then three near the image.
    let off = |size: f64, texels: usize| (5.0 * size + 24.0) * ROUNDING * texels as f64;
    let (off_x, off_y) = (off(size_u, WIDTH), off(size_v, HEIGHT));
    let (wrap_u, wrap_v) = (applied.format >> 4 & 15, applied.format >> 8 & 15);
    let texel = |i: f64, j: f64| {
        let (i, j) = (
            wrap(i as i64, WIDTH, wrap_u),
            wrap(j as i64, HEIGHT, wrap_v),
        );
        image.values[j * WIDTH + i]
    };
    let mut expected = [0.0; 4];
    let mut tolerance = 4.0 * ROUNDING;
    if applied.format >> 12 == layout::FILTER_NEAREST {
        if (x - x.round()).abs() < off_x || (y - y.round()).abs() < off_y {
            return false;
        }
        expected = texel(x.floor(), y.floor());
    } else {
        // Neighbours differ by one at most, so this is the slope.
        tolerance += off_x + off_y;
        let (x, y) = (x - 0.5, y - 0.5);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (i, j) = (x.floor() + dx, y.floor() + dy);
            let weight = (1.0 - (x - i).abs()) * (1.0 - (y - j).abs());
            for (sum, value) in expected.iter_mut().zip(texel(i, j)) {
                *sum += weight * value;
            }
        }
    }
    for (g, e) in got.into_iter().zip(expected) {
        assert!(
            (f64::from(g) - e).abs() <= tolerance,
            "{applied:?} {at:?}: {got:?}, {expected:?}"
        );
    }
    true
}

#[test]
fn camera_rays_go_through_their_pixels() {
    const SIZE: [u32; 2] = [1920, 1080];
    let Some(device) = open() else { return };
    let turn = DQuat::from_euler(glam::EulerRot::YXZ, 0.8, -0.3, 0.2);
    let position = DVec3::new(3.0, -1.5, 20.0);
    let mut rng = Rng(32);
    let mut queries: Vec<Query> = (0..100_000)
        .map(|_| Query {
            u: [0.0, rng.uniform32(), rng.uniform32(), 0.0],
            index: SIZE.map(|n| (rng.uniform() * f64::from(n)) as u32),
        })
        .collect();
    queries.push(Query::default());
    for kind in [layout::CAMERA_PERSPECTIVE, layout::CAMERA_ORTHOGRAPHIC] {
        let is_perspective = kind == layout::CAMERA_PERSPECTIVE;
        // Half of the picture's height at distance 1 or in metres.
        let half = if is_perspective {
            25f64.to_radians().tan()
        } else {
            4.0
        };
        let half_width = half * f64::from(SIZE[0]) / f64::from(SIZE[1]);
        let scene = Scene {
            params: Params {
                camera_kind: kind,
                camera_position: position.as_vec3().to_array(),
                camera_right: (turn * DVec3::X * half_width).as_vec3().to_array(),
                camera_up: (turn * DVec3::Y * half).as_vec3().to_array(),
                camera_forward: (turn * DVec3::NEG_Z).as_vec3().to_array(),
                width: SIZE[0],
                height: SIZE[1],
                ..Params::default()
            },
            ..Scene::default()
        };
        let answers: Vec<Answer> = scene.ask(&device, CAMERA, &queries);
        for (q, answer) in queries.iter().zip(&answers) {
            let at =
                |k: usize| (f64::from(q.index[k]) + f64::from(q.u[1 + k])) / f64::from(SIZE[k]);
            // Row 0 is at the top.
            let (x, y) = ((2.0 * at(0) - 1.0) * half_width, (1.0 - 2.0 * at(1)) * half);
            let (origin, direction) = if is_perspective {
                (position, turn * DVec3::new(x, y, -1.0).normalize())
            } else {
                (position + turn * DVec3::new(x, y, 0.0), turn * DVec3::NEG_Z)
            };
            let got = [answer.a, answer.b].map(|v| Vec4::from(v).truncate().as_dvec3());
            // Ten roundings of the largest numbers: 20 m, and 1: a five-hundredth of a pixel.
            assert!(
                (got[0] - origin).length() < 200.0 * ROUNDING,
                "{q:?}: {} {origin}",
                got[0]
            );
            assert!(
                (got[1] - direction).length() < 10.0 * ROUNDING,
                "{q:?}: {} {direction}",
                got[1]
            );
        }
    }
    finish(device);
}
