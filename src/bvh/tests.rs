//! The tree and its traversal against brute force, and against gaps.

use glam::{Affine3A, EulerRot, Quat, Vec3};

use super::topology::{Effort, Topology};
use super::traverse::{Hit, NO_RECORD, Ray, closest, closest_exhaustive, occluded};
use super::*;

/// SplitMix64: repeatable numbers without a dependency.
pub(super) struct Random(pub(super) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub(super) fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// In the cube [−1, 1)³.
    pub(super) fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    pub(super) fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.cube();
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    pub(super) fn index(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }
}

pub(super) fn opaque(_: u32, _: u32, _: [f32; 2]) -> bool {
    true
}

/// Small triangles in a cube of two metres.
pub(super) fn soup(count: usize, size: f32, random: &mut Random) -> Vec<Vec3> {
    (0..count)
        .flat_map(|_| {
            let centre = random.cube();
            [(); 3].map(|()| centre + random.cube() * size)
        })
        .collect()
}

pub(super) fn single(positions: &[Vec3]) -> Bvh {
    let group = GroupDesc {
        positions,
        masked: &[],
    };
    let bvh = Bvh::build(&[group], &[], Quality::Balanced).unwrap();
    bvh.validate().unwrap();
    bvh
}

pub(super) fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray {
        origin,
        direction,
        t_min: 0.0,
        t_max: f32::INFINITY,
        from: NO_RECORD,
    }
}

/// Compares both traversals with brute force and returns the number of hits. Distances may differ by `tolerance`.
/// Ids must be equal unless the second triangle is within the tolerance as well, and a hit may be lost or found
/// only where it grazes: where the ray moved sideways by the tolerance decides otherwise.
fn compare(
    bvh: &Bvh,
    rays: usize,
    tolerance: f32,
    random: &mut Random,
    is_opaque: traverse::IsOpaque,
) -> usize {
    let mut hits = 0;
    for _ in 0..rays {
        let mut ray = ray(random.cube() * 1.5, random.direction());
        if random.index(2) == 0 {
            ray.t_min = random.unit() * 0.5;
            ray.t_max = ray.t_min + random.unit() * 2.0;
        }
        let found = closest(bvh, &ray, is_opaque);
        let (expected, second) = closest_exhaustive(bvh, &ray, is_opaque);
        assert_eq!(occluded(bvh, &ray, is_opaque), found.is_some(), "{ray:?}");
        let agree = |a: Option<Hit>, b: Option<Hit>| match (a, b) {
            (None, None) => true,
            (Some(a), Some(b)) => (a.t - b.t).abs() <= tolerance,
            _ => false,
        };
        if let (Some(a), Some(b)) = (found, expected) {
            if agree(found, expected) && second - f64::from(b.t) > f64::from(2.0 * tolerance) {
                assert_eq!(
                    (a.instance, a.primitive),
                    (b.instance, b.primitive),
                    "{ray:?}"
                );
                hits += 1;
            }
        }
        let mut grazes = || {
            (0..64).any(|_| {
                let moved = Ray {
                    origin: ray.origin + random.cube() * tolerance,
                    ..ray
                };
                agree(found, closest_exhaustive(bvh, &moved, is_opaque).0)
            })
        };
        assert!(
            agree(found, expected) || grazes(),
            "{ray:?}: {found:?} instead of {expected:?}"
        );
    }
    hits
}

#[test]
fn agrees_with_brute_force() {
    let mut random = Random(1);
    let bvh = single(&soup(500, 0.3, &mut random));
    // Coordinates are about 2: rounding is about 2·2⁻²⁴ times the 20 of the triangle test, and more when grazing.
    assert!(compare(&bvh, 4000, 2e-5, &mut random, &opaque) > 1000);
}

#[test]
fn alpha_decides_on_masked_triangles_only() {
    let mut random = Random(2);
    let positions = soup(300, 0.4, &mut random);
    let masked: Vec<_> = (0..300).map(|i| i % 2 == 0).collect();
    let group = GroupDesc {
        positions: &positions,
        masked: &masked,
    };
    let bvh = Bvh::build(&[group], &[], Quality::Balanced).unwrap();
    bvh.validate().unwrap();
    let holes = |_: u32, primitive: u32, bary: [f32; 2]| {
        assert!(primitive % 2 == 0, "asked about a triangle without mask");
        bary[0] > 0.5
    };
    assert!(compare(&bvh, 3000, 2e-5, &mut random, &holes) > 500);
    let glass = |_: u32, _: u32, _: [f32; 2]| false;
    for _ in 0..1000 {
        let hit = closest(&bvh, &ray(random.cube(), random.direction()), &glass);
        assert!(hit.is_none_or(|hit| hit.primitive % 2 == 1));
    }
}

/// Neighbours share records, whichever corner each triangle starts with, and weights belong to the corners as given.
#[test]
fn triangles_of_one_record_keep_their_corners() {
    let mut random = Random(9);
    let n = 24;
    let mut heights: Vec<f32> = Vec::new();
    heights.resize_with((n + 1) * (n + 1), || random.unit() * 0.2);
    let point = |i: usize, j: usize| {
        let at = |k: usize| 2.0 * k as f32 / n as f32 - 1.0;
        Vec3::new(at(i), heights[i * (n + 1) + j], at(j))
    };
    let mut positions = Vec::new();
    for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
        for mut corners in [
            [point(i, j), point(i + 1, j), point(i + 1, j + 1)],
            [point(i, j), point(i + 1, j + 1), point(i, j + 1)],
        ] {
            corners.rotate_left(random.index(3));
            positions.extend(corners);
        }
    }
    let masked: Vec<_> = (0..2 * n * n).map(|_| random.index(2) == 0).collect();
    let group = GroupDesc {
        positions: &positions,
        masked: &masked,
    };
    let bvh = Bvh::build(&[group], &[], Quality::Balanced).unwrap();
    bvh.validate().unwrap();
    assert!(bvh.triangles.len() < 2 * n * n * 6 / 10);
    let holes = |_: u32, _: u32, bary: [f32; 2]| bary[0] > 0.3;
    assert!(compare(&bvh, 8000, 2e-5, &mut random, &holes) > 500);
    let mut hits = 0;
    for _ in 0..4000 {
        let ray = ray(random.cube() * 1.5, random.direction());
        let Some(hit) = closest(&bvh, &ray, &opaque) else {
            continue;
        };
        let [a, b, c] = [0, 1, 2].map(|corner| positions[3 * hit.primitive as usize + corner]);
        let met = a + hit.bary[0] * (b - a) + hit.bary[1] * (c - a);
        // Rounding of both, and of the weights where the triangle is seen edge-on.
        assert!((met - (ray.origin + hit.t * ray.direction)).length() < 1e-4);
        hits += 1;
    }
    assert!(hits > 500);
}

fn columns(m: Affine3A) -> [[f32; 3]; 4] {
    let [x, y, z, t] = m.to_cols_array_2d();
    [x, y, z, t]
}

/// Rotated, mirrored and unevenly scaled copies of two groups and an empty one.
fn instances(random: &mut Random, count: usize) -> Vec<InstanceDesc> {
    let mut all = vec![InstanceDesc::identity(0), InstanceDesc::identity(2)];
    for _ in 0..count {
        let [a, b, c] = (random.cube() * 3.0).to_array();
        let mut scale = (random.cube() * 0.3 + 0.5) * 0.5;
        if random.index(2) == 0 {
            scale.x = -scale.x;
        }
        let placed = Affine3A::from_scale_rotation_translation(
            scale,
            Quat::from_euler(EulerRot::XYZ, a, b, c),
            random.cube(),
        );
        all.push(InstanceDesc {
            group: random.index(2) as u32,
            world_from_object: columns(placed),
            object_from_world: columns(placed.inverse()),
        });
    }
    all
}

#[test]
fn instances_agree_with_brute_force() {
    let mut random = Random(3);
    let (a, b) = (soup(60, 0.4, &mut random), soup(40, 0.6, &mut random));
    let groups = [&a[..], &b[..], &[]].map(|positions| GroupDesc {
        positions,
        masked: &[],
    });
    let instances = instances(&mut random, 20);
    let bvh = Bvh::build(&groups, &instances, Quality::Best).unwrap();
    bvh.validate().unwrap();
    // As above; the transform adds its rounding, and scales down to 0.1 enlarge it.
    assert!(compare(&bvh, 2000, 1e-4, &mut random, &opaque) > 300);
}

#[test]
fn identity_instance_changes_nothing() {
    let mut random = Random(4);
    let positions = soup(1000, 0.1, &mut random);
    let group = GroupDesc {
        positions: &positions,
        masked: &[],
    };
    let one = Bvh::build(&[group], &[], Quality::Balanced).unwrap();
    let two = Bvh::build(&[group], &[InstanceDesc::identity(0)], Quality::Balanced).unwrap();
    for _ in 0..20_000 {
        let ray = ray(random.cube(), random.direction());
        let unnamed = closest(&one, &ray, &opaque).map(|hit| Hit {
            record: NO_RECORD,
            ..hit
        });
        assert_eq!(unnamed, closest(&two, &ray, &opaque));
    }
}

#[test]
fn nothing_is_hit_in_nothing() {
    let empty = GroupDesc {
        positions: &[],
        masked: &[],
    };
    let ray = ray(Vec3::ZERO, Vec3::X);
    for (groups, instances) in [
        (&[][..], &[][..]),
        (&[empty][..], &[][..]),
        (&[empty][..], &[InstanceDesc::identity(0)][..]),
    ] {
        let bvh = Bvh::build(groups, instances, Quality::Balanced).unwrap();
        bvh.validate().unwrap();
        assert!(!bvh.nodes.is_empty() && !bvh.triangles.is_empty());
        assert_eq!(closest(&bvh, &ray, &opaque), None);
        assert!(!occluded(&bvh, &ray, &opaque));
    }
}

#[test]
fn one_triangle() {
    let bvh = single(&[Vec3::ZERO, Vec3::X, Vec3::Y]);
    let down = ray(Vec3::new(0.25, 0.5, 2.0), Vec3::NEG_Z);
    let hit = closest(&bvh, &down, &opaque).unwrap();
    assert_eq!((hit.t, hit.bary, hit.primitive), (2.0, [0.25, 0.5], 0));
    // The ends of the interval are excluded.
    for (t_min, t_max, expected) in [
        (0.0, 2.0, false),
        (2.0, 9.0, false),
        (0.0, 2.0 + 2.0 * f32::EPSILON, true),
        (2.0 - f32::EPSILON, 9.0, true),
    ] {
        let ray = Ray {
            t_min,
            t_max,
            ..down
        };
        assert_eq!(closest(&bvh, &ray, &opaque).is_some(), expected);
        assert_eq!(occluded(&bvh, &ray, &opaque), expected);
    }
    // Seen from behind, along the plane, past the edge.
    assert!(occluded(
        &bvh,
        &ray(Vec3::new(0.25, 0.5, -2.0), Vec3::Z),
        &opaque
    ));
    assert!(!occluded(
        &bvh,
        &ray(Vec3::new(0.25, 0.5, 0.0), Vec3::X),
        &opaque
    ));
    assert!(!occluded(
        &bvh,
        &ray(Vec3::new(0.6, 0.5, 2.0), Vec3::NEG_Z),
        &opaque
    ));
}

#[test]
fn degenerate_sets_are_built_and_never_lost() {
    let mut random = Random(5);
    let flat: Vec<_> = soup(3000, 0.05, &mut random)
        .into_iter()
        .map(|v| Vec3::new(v.x, 0.5, v.z))
        .collect();
    let identical = [Vec3::ZERO, Vec3::X, Vec3::Y].repeat(100_000);
    let points = [Vec3::ONE; 3].repeat(5000);
    // Each triangle lies in the next, which is larger by a tenth: trees of such sets are chains.
    let nested: Vec<_> = (0..600)
        .flat_map(|i| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|v| v * 1.1f32.powi(i - 350)))
        .collect();
    for positions in [&flat, &identical, &points, &nested] {
        let bvh = single(positions);
        assert_eq!(bvh.groups[0].triangle_count as usize * 3, positions.len());
    }
    // Rays straight down on the flat set: directions with zeros of both signs.
    let bvh = single(&flat);
    for index in 0..1000 {
        let t = &flat[3 * index..3 * index + 3];
        let (from, zero) = ((t[0] + t[1] + t[2]) / 3.0, [0.0, -0.0][index % 2]);
        let down = ray(Vec3::new(from.x, 3.0, from.z), Vec3::new(zero, -1.0, -zero));
        assert_eq!(closest(&bvh, &down, &opaque).map(|hit| hit.t), Some(2.5));
    }
    let none = single(&points);
    assert!(!occluded(
        &none,
        &ray(Vec3::ZERO, Vec3::ONE.normalize()),
        &opaque
    ));
}

#[test]
fn too_deep_trees_are_replaced() {
    let mut random = Random(6);
    let positions = soup(2500, 0.02, &mut random);
    let boxes: Vec<_> = positions
        .chunks(3)
        .map(|t| {
            let (low, high) = (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
            obvhs::aabb::Aabb::new(low.into(), high.into())
        })
        .collect();
    let effort = Effort::Group(Quality::Balanced);
    assert!(Topology::build(&boxes, effort, 32).levels() > 4);
    // 8⁴ ≥ 2500/3 > 8³: four levels are as few as a tree can have.
    assert_eq!(Topology::build(&boxes, effort, 4).levels(), 4);
    for count in 1..200 {
        let balanced = Topology::balanced(&boxes[..count]);
        let mut seen = vec![0; count];
        for node in &balanced.nodes {
            for slot in 0..8 {
                if let topology::Slot::Leaf(range) = Topology::slot(node, slot) {
                    range.for_each(|entry| seen[balanced.order[entry] as usize] += 1);
                }
            }
        }
        assert_eq!(seen, vec![1; count]);
    }
}

#[test]
fn building_twice_gives_the_same() {
    let positions = soup(20_000, 0.02, &mut Random(7));
    for quality in [Quality::Fast, Quality::Balanced, Quality::Best] {
        let group = GroupDesc {
            positions: &positions,
            masked: &[],
        };
        let build = || Bvh::build(&[group], &[], quality).unwrap();
        assert!(build() == build());
    }
}

#[test]
fn bad_coordinates_are_refused() {
    for bad in [
        f32::NAN,
        f32::INFINITY,
        -f32::INFINITY,
        2.0 * MAX_COORDINATE,
    ] {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::new(0.0, bad, 0.0)];
        let group = GroupDesc {
            positions: &positions,
            masked: &[],
        };
        let error = Bvh::build(&[group], &[], Quality::Balanced).unwrap_err();
        assert!(error.to_string().contains("triangle 0"), "{error}");
        let mut instance = InstanceDesc::identity(0);
        instance.world_from_object[3][1] = bad;
        let group = GroupDesc {
            positions: &[Vec3::ZERO, Vec3::X, Vec3::Y],
            masked: &[],
        };
        let error = Bvh::build(&[group], &[instance], Quality::Balanced).unwrap_err();
        assert!(error.to_string().contains("instance 0"), "{error}");
    }
}

#[test]
fn validation_finds_damage() {
    let bvh = single(&soup(100, 0.2, &mut Random(8)));
    type Damage = (&'static str, fn(&mut Bvh));
    let damage: [Damage; 6] = [
        ("does not contain", |b| b.triangles[50][0] = 1e6),
        ("twice", |b| b.triangles[0][3] = b.triangles[1][3]),
        ("out of range", |b| b.nodes[0][4] = 1_000_000),
        ("in no leaf", |b| {
            // Emptying the first leaf found loses its records.
            let (node, slot) = (0..b.nodes.len() * 8)
                .map(|i| (i / 8, i % 8))
                .find(|&(n, s)| matches!(child(&b.nodes[n], s), Child::Leaf(..)))
                .unwrap();
            b.nodes[node][6 + slot / 4] &= !(0xff << (8 * (slot % 4)));
        }),
        ("another tree", |b| b.groups[0].record_count -= 1),
        ("never reached", |b| b.nodes.push([0; 20])),
    ];
    for (message, apply) in damage {
        let mut broken = bvh.clone();
        apply(&mut broken);
        let found = broken.validate().unwrap_err();
        assert!(found.contains(message), "{found} instead of {message}");
    }
}
