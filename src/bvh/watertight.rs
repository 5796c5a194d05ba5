//! Closed meshes have no gaps: from inside, every ray hits, also where triangles
//! meet and at any scale and distance from the origin.

use glam::Vec3;

use super::tests::{Random, opaque, ray, single};
use super::traverse::{closest, occluded};

/// A sphere with a rough surface: triangles of all shapes, vertices shared to the bit. Corners, three a triangle.
fn rough_sphere(rings: usize, segments: usize, random: &mut Random) -> Vec<Vec3> {
    let mut point = |ring: usize, segment: usize| {
        let (theta, phi) = (
            std::f32::consts::PI * ring as f32 / rings as f32,
            std::f32::consts::TAU * segment as f32 / segments as f32,
        );
        let direction = Vec3::new(
            theta.sin() * phi.cos(),
            theta.sin() * phi.sin(),
            theta.cos(),
        );
        direction * (0.8 + 0.2 * random.unit())
    };
    let (north, south) = (point(0, 0), point(rings, 0));
    let grid: Vec<Vec<_>> = (1..rings)
        .map(|ring| (0..segments).map(|segment| point(ring, segment)).collect())
        .collect();
    let mut corners = Vec::new();
    for s in 0..segments {
        let next = (s + 1) % segments;
        corners.extend([north, grid[0][s], grid[0][next]]);
        corners.extend([south, grid[rings - 2][next], grid[rings - 2][s]]);
        for pair in grid.windows(2) {
            corners.extend([pair[0][s], pair[1][s], pair[1][next]]);
            corners.extend([pair[0][s], pair[1][next], pair[0][next]]);
        }
    }
    corners
}

/// Of `rays` aimed at vertices and edges, how many leave the mesh. `centre` is inside.
fn leaks(corners: &[Vec3], centre: Vec3, size: f32, rays: usize, random: &mut Random) -> usize {
    let bvh = single(corners);
    (0..rays)
        .filter(|index| {
            // Half of the rays start at the centre, where differences of coordinates are often exact.
            let origin = match index % 2 {
                0 => centre,
                _ => centre + random.cube() * 0.4 * size,
            };
            let triangle = 3 * random.index(corners.len() / 3);
            let (a, b) = (corners[triangle], corners[triangle + 1 + random.index(2)]);
            let along = [0.0, 0.5, random.unit()][random.index(3)];
            // Both unit length, as the renderer has it, and as it comes, which aims better.
            let direction = a + (b - a) * along - origin;
            let direction = match random.index(2) {
                0 => direction / size,
                _ => (direction / size).normalize(),
            };
            let ray = ray(origin, direction);
            let hit = closest(&bvh, &ray, &opaque).is_some();
            assert_eq!(hit, occluded(&bvh, &ray, &opaque));
            !hit
        })
        .count()
}

fn leaks_everywhere(rays: usize) -> usize {
    let mut random = Random(11);
    let sphere = rough_sphere(40, 60, &mut random);
    let mut lost = 0;
    for exponent in [-6, -3, 0, 3, 6] {
        let size = 10f32.powi(exponent);
        // In sizes of the mesh: at 10⁵ a vertex has 7 bits left, and triangles collapse.
        for distance in [0.0, 1.0, 1e2, 1e4, 1e5] {
            let centre = random.direction() * distance * size;
            let moved: Vec<_> = sphere.iter().map(|&v| v * size + centre).collect();
            let count = leaks(&moved, centre, size, rays, &mut random);
            assert_eq!(count, 0, "size {size}, centre {centre}");
            lost += count;
        }
    }
    lost
}

#[test]
fn no_gaps_at_edges_and_vertices_in_ten_million_rays() {
    assert_eq!(leaks_everywhere(400_000), 0);
}

/// The surface of a cube as a grid of `n` × `n` squares a side, whose vertices are multiples of 1/n.
fn grid_cube(n: i32) -> Vec<Vec3> {
    let mut corners = Vec::new();
    for axis in 0..3 {
        for side in [-n, n] {
            let point = |i: i32, j: i32| {
                let mut v = [0; 3];
                v[axis] = side;
                v[(axis + 1) % 3] = i;
                v[(axis + 2) % 3] = j;
                Vec3::from(v.map(|x| x as f32 / n as f32))
            };
            for i in -n..n {
                for j in -n..n {
                    corners.extend([point(i, j), point(i + 1, j), point(i + 1, j + 1)]);
                    corners.extend([point(i, j), point(i + 1, j + 1), point(i, j + 1)]);
                }
            }
        }
    }
    corners
}

/// Directions with zeros of both signs, through vertices and edges that lie exactly on planes of boxes.
#[test]
fn no_gaps_along_the_axes() {
    let n = 8;
    let bvh = single(&grid_cube(n));
    for axis in 0..3 {
        for i in -2 * n..=2 * n {
            for j in -2 * n..=2 * n {
                for (sign, zero) in [(1.0, 0.0), (1.0, -0.0), (-1.0, 0.0), (-1.0, -0.0)] {
                    let (mut origin, mut direction) = ([0.25; 3], [zero; 3]);
                    direction[axis] = sign;
                    origin[(axis + 1) % 3] = i as f32 / (2 * n) as f32;
                    origin[(axis + 2) % 3] = j as f32 / (2 * n) as f32;
                    let ray = ray(origin.into(), direction.into());
                    let hit = closest(&bvh, &ray, &opaque);
                    assert_eq!(hit.map(|hit| hit.t), Some(1.0 - sign * 0.25), "{ray:?}");
                }
            }
        }
    }
}

/// Directions that are nearly zero along an axis, down to the smallest number: slopes must not overflow.
#[test]
fn no_gaps_beside_the_axes() {
    let bvh = single(&grid_cube(8));
    let mut random = Random(12);
    for exponent in 0..149 {
        for _ in 0..100 {
            let tiny = f32::from_bits(1)
                * 2f32.powi(exponent.min(127))
                * 2f32.powi((exponent - 127).max(0));
            let direction = Vec3::new(tiny, 1.0, -tiny);
            let origin = Vec3::from([(); 3].map(|()| random.index(9) as f32 / 8.0 - 0.5));
            let hit = closest(&bvh, &ray(origin, direction), &opaque);
            assert!(hit.is_some(), "{origin}, {direction}");
        }
    }
}
