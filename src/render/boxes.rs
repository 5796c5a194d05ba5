//! Boxes around triangles, for devices whose own test of triangles has gaps at edges: their structures hold the
//! boxes, and shaders test what is in them (`shear.glsl`).

use glam::{DAffine3, DVec3};

use super::geometry::{Geometry, Group};

/// Rounding of the tests of boxes and triangles relative to the distance, as for our own tree
/// (`BVH_BOX_ROUNDING` of `traverse_software.glsl`).
const ROUNDING: f64 = 1.0 / 524_288.0;

/// What rounding may do to rays in the space of each group, metres there, if they start in the scene or at `camera`.
pub(super) fn slacks(geometry: &Geometry, camera: DVec3) -> Vec<f32> {
    let sizes: Vec<f64> = geometry.groups.iter().map(|g| size(geometry, g)).collect();
    let world = geometry
        .placements
        .iter()
        .map(|p| largest(&p.world_from_object, sizes[p.group]))
        .fold(camera.abs().max_element(), f64::max);
    let mut reaches = sizes;
    for placement in &geometry.placements {
        let reach = largest(&placement.world_from_object.inverse(), world);
        reaches[placement.group] = reaches[placement.group].max(reach);
    }
    // differences of two coordinates
    reaches
        .iter()
        .map(|reach| (2.0 * ROUNDING * reach) as f32)
        .collect()
}

/// The boxes of a group's triangles in its space, low and high corners, enlarged by `slack`.
pub(super) fn around(geometry: &Geometry, group: &Group, slack: f32) -> Vec<[[f32; 3]; 2]> {
    group
        .triangles
        .clone()
        .map(|t| {
            let [a, b, c] = geometry.corners(t);
            let (low, high) = (a.min(b).min(c) - slack, a.max(b).max(c) + slack);
            [low.to_array(), high.to_array()]
        })
        .collect()
}

/// The largest coordinate of a group's triangles in its space.
fn size(geometry: &Geometry, group: &Group) -> f64 {
    let corners = group.triangles.clone().flat_map(|t| geometry.corners(t));
    let most = |most: f32, corner: glam::Vec3| most.max(corner.abs().max_element());
    f64::from(corners.fold(0.0, most))
}

/// The largest coordinate that a point may have whose coordinates were at most `size`.
fn largest(map: &DAffine3, size: f64) -> f64 {
    let m = map.matrix3;
    let rows = m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs();
    (rows * size + map.translation.abs()).max_element()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slack_is_that_of_the_space_of_the_group() {
        let mut geometry = Geometry {
            vertices: vec![
                [1.0, 0.0, 0.0, 0.0],
                [0.0; 4],
                [0.0, 3.0, 0.0, 0.0],
                [0.0; 4],
                [0.0, 0.0, 2.0, 0.0],
                [0.0; 4],
            ],
            triangles: vec![[0, 1, 2, 0]],
            groups: vec![Group {
                triangles: 0..1,
                has_cutouts: false,
            }],
            ..Geometry::default()
        };
        let place = |world_from_object| super::super::geometry::Placement {
            group: 0,
            world_from_object,
        };
        geometry.placements = vec![place(DAffine3::IDENTITY)];
        assert_eq!(slacks(&geometry, DVec3::ZERO), [6.0 / 524_288.0]);
        assert_eq!(slacks(&geometry, DVec3::splat(-8.0)), [16.0 / 524_288.0]);
        // what is small in the world is far from its camera
        geometry.placements = vec![place(DAffine3::from_scale(DVec3::splat(0.5)))];
        assert_eq!(slacks(&geometry, DVec3::splat(-8.0)), [32.0 / 524_288.0]);
        let boxes = around(&geometry, &geometry.groups[0], 0.5);
        assert_eq!(boxes, [[[-0.5; 3], [1.5, 3.5, 2.5]]]);
    }
}
