//! One table of labelled rays, each with the answer worked out by hand, and the
//! same rays against the brute-force search.

use etendue::layout::{NONE, ProbeHit, ProbeRay};
use etendue::scene::{AlphaMode, Scene};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use crate::backends::offered;
use crate::brute::{Brute, T_TOLERANCE, check};
use crate::scenes::{checker, cut_out, fan, lambert, mesh, scaled, scene, single};
use crate::{Levels, finish, prober};

/// What a ray of the table must meet.
enum Expect {
    Miss,
    /// Distance, and the (instance, primitive) pairs that are right; several at ties.
    Hit(f32, Vec<(u32, u32)>),
    /// Whatever the brute-force search allows.
    Brute,
}
use Expect::{Hit, Miss};

struct Case {
    label: &'static str,
    ray: ProbeRay,
    expect: Expect,
}

fn case(
    label: &'static str,
    from: [f32; 3],
    to: [f32; 3],
    range: [f32; 2],
    expect: Expect,
) -> Case {
    Case {
        label,
        ray: ProbeRay {
            origin: from,
            t_min: range[0],
            direction: to,
            t_max: range[1],
            from: NONE,
        },
        expect,
    }
}

const FAR: f32 = 3e38;
const ALL: [f32; 2] = [0.0, FAR];
const DOWN: [f32; 3] = [0.0, 0.0, -1.0];

fn assert_answer(label: &str, case: &Case, hit: &ProbeHit) {
    let found = (hit.instance, hit.primitive);
    match &case.expect {
        Miss => assert_eq!(
            (hit.t, found, hit.occluded),
            (-1.0, (NONE, NONE), 0),
            "{label}"
        ),
        Hit(t, allowed) => {
            assert!(allowed.contains(&found), "{label}: {hit:?}");
            let error = f64::from((hit.t - t).abs());
            assert!(error <= T_TOLERANCE * f64::from(*t), "{label}: {hit:?}");
            assert_eq!(hit.occluded, 1, "{label}");
        }
        Expect::Brute => {}
    }
}

/// Holds the cases against the scene, on all backends.
fn run(name: &str, scene: &Scene, levels: Levels, cases: &[Case]) {
    let brute = Brute::new(scene, levels);
    let rays: Vec<_> = cases.iter().map(|c| c.ray).collect();
    for backend in offered() {
        let Some(renderer) = prober(scene, backend, levels) else {
            return;
        };
        for (case, hit) in cases.iter().zip(renderer.probe(&rays).unwrap()) {
            let label = format!("{name}, {}, {levels:?}, {}", case.label, backend.name());
            assert_answer(&label, case, &hit);
            if let Err(error) = check(&hit, &brute.trace(&case.ray)) {
                panic!("{label}: {error}");
            }
        }
        finish(&renderer);
    }
}

/// Rays at a fan of four triangles of half width `s`, at z = 0, with degenerate triangles before it.
fn square_cases(s: f32) -> Vec<Case> {
    let one = |i: u32| vec![(0, i)];
    let hit = |t: f32, ids| Hit(t * s, ids);
    let at = |x: f32, y: f32, z: f32| [x * s, y * s, z * s];
    let next_up = f32::from_bits(s.to_bits() + 1);
    let next_down = f32::from_bits(s.to_bits() - 1);
    let slope = |x: f32, y: f32, z: f32| Vec3::new(x, y, z).normalize().to_array();
    let up = [0.0, 0.0, 1.0];
    let all = || (0..4).map(|i| (0, i)).collect::<Vec<_>>();
    let top = at(0.25, -0.5, 1.0);
    vec![
        case("hit from the front", top, DOWN, ALL, hit(1.0, one(0))),
        case(
            "hit from behind",
            at(0.5, 0.25, -2.0),
            up,
            ALL,
            hit(2.0, one(1)),
        ),
        case("beside", at(1.5, 0.0, 1.0), DOWN, ALL, Miss),
        case("away", top, up, ALL, Miss),
        case("too near", top, DOWN, [2.0 * s, FAR], Miss),
        case("too far", top, DOWN, [0.0, 0.5 * s], Miss),
        case("ends on it", top, DOWN, [0.0, s], Miss),
        case(
            "ends right behind it",
            top,
            DOWN,
            [0.0, next_up],
            hit(1.0, one(0)),
        ),
        case("starts on it", top, DOWN, [s, FAR], Miss),
        case(
            "starts right before it",
            top,
            DOWN,
            [next_down, FAR],
            hit(1.0, one(0)),
        ),
        case("origin on it", at(0.25, -0.5, 0.0), DOWN, ALL, Miss),
        case("empty interval", top, DOWN, [s, s], Miss),
        case("−0 twice", top, [-0.0, -0.0, -1.0], ALL, hit(1.0, one(0))),
        case("−0 in x", top, [-0.0, 0.0, -1.0], ALL, hit(1.0, one(0))),
        case(
            "−0 in y, up",
            at(0.25, -0.5, -1.0),
            [0.0, -0.0, 1.0],
            ALL,
            hit(1.0, one(0)),
        ),
        case(
            "0 in y only",
            at(-0.5, 0.25, 1.0),
            slope(-1e-3, 0.0, -1.0),
            ALL,
            Expect::Brute,
        ),
        case(
            "grazing",
            at(-3.0, 0.25, 0.003),
            slope(1.0, 0.0, -0.001),
            ALL,
            Expect::Brute,
        ),
        case(
            "grazing, over it",
            at(-3.0, 0.25, 0.003),
            slope(1.0, 0.0, -0.0005),
            ALL,
            Miss,
        ),
        case(
            "in its plane",
            at(-3.0, 0.25, 0.0),
            [1.0, 0.0, 0.0],
            ALL,
            Miss,
        ),
        case(
            "in its plane, −0",
            at(-3.0, 0.25, 0.0),
            [1.0, -0.0, -0.0],
            ALL,
            Miss,
        ),
        case(
            "in its plane, along an edge",
            at(-3.0, 1.0, 0.0),
            [1.0, 0.0, 0.0],
            ALL,
            Miss,
        ),
        case(
            "beside its plane",
            at(-3.0, 0.25, 1e-3),
            [1.0, 0.0, 0.0],
            ALL,
            Miss,
        ),
        case(
            "shared edge",
            at(0.5, 0.5, 1.0),
            DOWN,
            ALL,
            hit(1.0, vec![(0, 1), (0, 2)]),
        ),
        case(
            "shared edge, from behind",
            at(-0.5, 0.5, -1.0),
            up,
            ALL,
            hit(1.0, vec![(0, 2), (0, 3)]),
        ),
        case(
            "shared vertex",
            at(0.0, 0.0, 1.0),
            DOWN,
            ALL,
            hit(1.0, all()),
        ),
        case(
            "shared vertex, aslant",
            at(1.0, 0.5, 1.0),
            slope(-1.0, -0.5, -1.0),
            ALL,
            hit(1.5, all()),
        ),
        case(
            "degenerate: no area",
            at(0.25, 0.0, 2.0),
            DOWN,
            ALL,
            hit(2.0, one(1)),
        ),
        case(
            "degenerate: in a line",
            at(-0.5, 0.25, 2.0),
            DOWN,
            ALL,
            hit(2.0, one(3)),
        ),
        case(
            "degenerate: a point",
            at(0.75, 0.5, 2.0),
            DOWN,
            ALL,
            hit(2.0, one(1)),
        ),
    ]
}

/// The fan with three triangles without area in front of it.
fn square(s: f32) -> Scene {
    let mut square = fan();
    let first = square.positions.len() as u32;
    square.positions.extend([
        Vec3::new(0.25, 0.0, 0.5),
        Vec3::new(0.25, 0.5, 0.5),
        Vec3::new(-0.75, 0.25, 0.25),
        Vec3::new(-0.5, 0.25, 0.25),
        Vec3::new(-0.25, 0.25, 0.25),
        Vec3::new(0.75, 0.5, 0.125),
    ]);
    square.uvs[0].clear();
    let [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map(|i| first + i);
    square.triangles.extend([[a, a, b], [c, d, e], [f, f, f]]);
    single(scaled(square, s))
}

#[test]
fn square_at_all_sizes() {
    for s in [1.0, 1e6, 1e-6] {
        run(
            &format!("square of {s}"),
            &square(s),
            Levels::Flat,
            &square_cases(s),
        );
    }
}

#[test]
fn nothing_and_one_triangle() {
    let rays = |expect: [Expect; 3]| {
        let [a, b, c] = expect;
        vec![
            case("middle", [0.25, 0.25, 1.0], DOWN, ALL, a),
            case("along x", [-1.0, 0.25, 0.0], [1.0, 0.0, 0.0], ALL, b),
            case("outside", [0.75, 0.75, 1.0], DOWN, ALL, c),
        ]
    };
    let empty = scene(Vec::new(), Vec::new());
    run("empty", &empty, Levels::Flat, &rays([Miss, Miss, Miss]));
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let one = single(mesh(corners, vec![[0, 1, 2]]));
    let hit = Hit(1.0, vec![(0, 0)]);
    run("one triangle", &one, Levels::Flat, &rays([hit, Miss, Miss]));
}

/// A fan cut out by a checkerboard, 1 before a whole one.
fn behind_a_mask(alpha_mode: AlphaMode) -> Scene {
    let mut back = fan();
    back.material = 1;
    for p in &mut back.positions {
        p.z = -1.0;
    }
    let here = || vec![DAffine3::IDENTITY];
    let mut scene = scene(
        vec![(fan(), here()), (back, here())],
        vec![cut_out(alpha_mode), lambert(0.5)],
    );
    scene.textures.push(checker());
    scene
}

#[test]
fn alpha_mask_on_and_off() {
    // Texel (column, row) of four by four has its middle here; row 0 is at v = 0. The triangle follows from where
    // that is: 0 below, 1 right, 2 above, 3 left of the middle.
    let place = |c: f32, r: f32| [0.5 * c - 0.75 + 0.0625, 0.5 * r - 0.75, 1.0];
    let texels = [
        (1.0, 0.0, 0),
        (2.0, 0.0, 0),
        (3.0, 1.0, 1),
        (3.0, 2.0, 1),
        (1.0, 3.0, 2),
        (2.0, 3.0, 2),
        (0.0, 1.0, 3),
        (0.0, 2.0, 3),
    ];
    for (mode, is_cut) in [
        (AlphaMode::Mask { cutoff: 0.5 }, true),
        (AlphaMode::Mask { cutoff: 1.0 }, true),
        (AlphaMode::Mask { cutoff: 0.0 }, false),
        (AlphaMode::Opaque, false),
    ] {
        let mut cases = Vec::new();
        for (column, row, triangle) in texels {
            let is_hole = is_cut && (column + row) % 2.0 == 1.0;
            let (t, id) = if is_hole {
                (2.0, 4 + triangle)
            } else {
                (1.0, triangle)
            };
            let from = place(column, row);
            cases.push(case("texel", from, DOWN, ALL, Hit(t, vec![(0, id)])));
            let near = if is_hole {
                Miss
            } else {
                Hit(1.0, vec![(0, id)])
            };
            cases.push(case("texel, short", from, DOWN, [0.0, 1.5], near));
        }
        run(
            &format!("{mode:?}"),
            &behind_a_mask(mode),
            Levels::Flat,
            &cases,
        );
    }
}

/// An L of three triangles, which no turn or mirror maps to itself, placed in many ways.
pub fn placed() -> Scene {
    let corners = [
        [0., 0., 0.],
        [2., 0., 0.],
        [0., 1., 0.],
        [0., 0., 0.5],
        [0.3, 0.2, 0.9],
    ];
    let shape = mesh(
        corners.map(Vec3::from).to_vec(),
        vec![[0, 1, 2], [0, 2, 3], [1, 2, 4]],
    );
    let turn = DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1., 2., -2.) / 3.0, 0.7));
    let stretch = DMat3::from_diagonal(DVec3::new(0.2, 3.0, 1.5));
    let shear = DMat3::from_cols(
        DVec3::X,
        DVec3::new(0.5, 1.0, 0.0),
        DVec3::new(0.0, -0.25, 2.0),
    );
    let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    let linear = [
        DMat3::IDENTITY,
        mirror,
        turn,
        stretch,
        turn * stretch,
        mirror * turn * stretch * turn.transpose(),
        shear,
        -2.0 * turn * shear,
        turn * 1e-2,
    ];
    let place = |(i, matrix3): (usize, &DMat3)| DAffine3 {
        matrix3: *matrix3,
        translation: DVec3::new(5.0 * (i % 3) as f64 - 5.0, 5.0 * (i / 3) as f64 - 5.0, 0.0),
    };
    let places = linear.iter().enumerate().map(place).collect();
    let mut ground = scaled(fan(), 10.0);
    for p in &mut ground.positions {
        p.z = -6.0;
    }
    scene(
        vec![(shape, places), (ground, vec![DAffine3::IDENTITY])],
        vec![lambert(0.5)],
    )
}

#[test]
fn instances_by_hand() {
    // Rays down at the first triangle of the plain shape and of its mirror image, and beside the mirror image; the
    // plain one stands at (−5, −5), the mirrored one at (0, −5).
    let from = |x: f32| [x, -4.75, 3.0];
    for (levels, plain, mirrored) in [
        (Levels::Flat, (0, 0), (0, 3)),
        (Levels::Two, (1, 0), (2, 0)),
    ] {
        // Only the first triangle is met there from below.
        let below = |x: f32| [x, -4.75, -3.0];
        let up = [0.0, 0.0, 1.0];
        let ground = (0..4).map(|i| (0, if levels == Levels::Flat { 27 + i } else { i }));
        let cases = vec![
            case("plain", below(-4.0), up, ALL, Hit(3.0, vec![plain])),
            case("mirrored", below(-1.0), up, ALL, Hit(3.0, vec![mirrored])),
            case(
                "beside the mirrored",
                from(1.0),
                DOWN,
                ALL,
                Hit(9.0, ground.collect()),
            ),
            case("beside, no further", from(1.0), DOWN, [0.0, 8.9], Miss),
        ];
        run("instances", &placed(), levels, &cases);
    }
}
