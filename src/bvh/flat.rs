//! Rays that leave a plane do not meet it again.

use glam::Vec3;

use super::tests::{Random, opaque, ray, single, soup};
use super::traverse::{NO_RECORD, closest, occluded};

#[test]
fn only_what_lies_in_one_plane_is_flat() {
    let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let (o, x) = (p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0));
    let is_flat = |d: Vec3| super::pairs::is_flat([o, x, p(1.0, 1.0, 2.0), d]);
    assert!(is_flat(o) && is_flat(p(0.0, 1.0, 2.0)));
    // A fold, the least of folds, and a plane that is not believed: its volume would be rounded.
    assert!(!is_flat(p(0.0, 1.0, -2.0)));
    assert!(!is_flat(p(0.0, 1.0, f32::from_bits(2.0f32.to_bits() + 1))));
    assert!(!is_flat(p(1e-20, 1.0, 2.0)));
    // Across an axis everything is.
    assert!(super::pairs::is_flat(
        [(0.1, 0.3), (0.7, 0.3), (0.7, 1e9), (1e-9, 0.9)].map(|(x, z)| p(x, 0.1, z))
    ));
}

/// Rays that leave a box's wall or a fold: the plane that they leave does not count, everything else does.
#[test]
fn a_plane_is_not_met_twice() {
    let mut random = Random(14);
    let mut corners = soup(20, 0.5, &mut random);
    for z in [-1.0, 1.0] {
        let [a, b, c, d] =
            [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)].map(|(x, y)| Vec3::new(x, y, z));
        corners.extend([a, b, c, a, c, d]);
        // A roof over the walls, whose halves see each other.
        let top = [a, b, c].map(|v| v * 1.5);
        corners.extend([
            top[0],
            top[1],
            top[2],
            top[0],
            top[2],
            d * Vec3::new(1.0, 1.0, 4.0),
        ]);
    }
    let bvh = single(&corners);
    let (mut named, mut unnamed) = (0, 0);
    for _ in 0..20_000 {
        let first = ray(random.cube() * 2.0, random.direction());
        let Some(hit) = closest(&bvh, &first, &opaque) else {
            continue;
        };
        let start = first.origin + first.direction * (hit.t * (1.0 - 1e-4));
        let mut next = ray(start, random.direction());
        let triangle = 3 * hit.primitive as usize;
        let normal = (corners[triangle + 1] - corners[triangle])
            .cross(corners[triangle + 2] - corners[triangle]);
        if normal.dot(next.direction) * normal.dot(first.direction) > 0.0 {
            next.direction = -next.direction;
        }
        let expected = closest(&bvh, &next, &opaque);
        next.from = hit.record;
        assert_eq!(closest(&bvh, &next, &opaque), expected);
        assert_eq!(occluded(&bvh, &next, &opaque), expected.is_some());
        // The halves of the roofs, and nothing else, have no name.
        let is_roof = [22, 23, 26, 27].contains(&hit.primitive);
        assert_eq!(hit.record == NO_RECORD, is_roof);
        // Sent back at the plane, the ray does not find it.
        next.direction = first.direction;
        let beyond = closest(&bvh, &next, &opaque);
        if is_roof {
            unnamed += 1;
        } else {
            named += 1;
            assert_ne!(beyond.map(|beyond| beyond.primitive), Some(hit.primitive));
        }
    }
    assert!(named > 1000 && unnamed > 100, "{named}, {unnamed}");
}
