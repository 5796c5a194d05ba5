//! What covers the middle of each pixel: the number of the placed primitive and of its material.

use glam::Vec3;

use super::Renderer;
use crate::error::Result;
use crate::layout::{self, NONE, ProbeHit, ProbeRay};

/// Rays that are asked for at once: with what they meet 72 bytes each.
const RAYS: usize = 1 << 20;

/// Whose triangles follow in a placed group, up to the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Owner {
    /// Index into [`super::geometry::Geometry::placements`].
    pub placement: u32,
    /// Its first triangle within the group.
    pub first_triangle: u32,
    /// Index into [`crate::scene::Scene::instances`].
    pub instance: u32,
    /// Index into [`crate::scene::Scene::materials`].
    pub material: u32,
}

/// Numbers for each pixel of the window row by row; −1 where nothing was met.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Identities {
    /// Of the placed primitive: an index into [`crate::scene::Scene::instances`].
    pub instances: Vec<f32>,
    /// Of the material: an index into [`crate::scene::Scene::materials`].
    pub materials: Vec<f32>,
}

impl Identities {
    /// Adds what a ray met; `owners` are sorted.
    fn push(&mut self, hit: &ProbeHit, owners: &[Owner]) {
        let at = (hit.instance, hit.primitive);
        let after = owners.partition_point(|o| (o.placement, o.first_triangle) <= at);
        let owner = match hit.primitive {
            NONE => None,
            _ => after.checked_sub(1).map(|i| owners[i]),
        };
        let number = |of: fn(Owner) -> u32| owner.map_or(-1.0, |owner| of(owner) as f32);
        self.instances.push(number(|owner| owner.instance));
        self.materials.push(number(|owner| owner.material));
    }
}

/// The ray through the middle of pixel i of the window, as camera.glsl has it.
fn ray(params: &layout::Params, i: u32) -> ProbeRay {
    let column = params.window_x + i % params.window_width;
    let row = params.window_y + i / params.window_width;
    let u = (column as f32 + 0.5) / params.width as f32;
    let v = (row as f32 + 0.5) / params.height as f32;
    let [position, right, up, forward] = [
        params.camera_position,
        params.camera_right,
        params.camera_up,
        params.camera_forward,
    ]
    .map(Vec3::from);
    let offset = (2.0 * u - 1.0) * right + (1.0 - 2.0 * v) * up;
    let (origin, direction) = if params.camera_kind == layout::CAMERA_ORTHOGRAPHIC {
        (position + offset, forward)
    } else {
        (position, (forward + offset).normalize())
    };
    ProbeRay {
        origin: origin.to_array(),
        t_min: 0.0,
        direction: direction.to_array(),
        t_max: f32::INFINITY,
        from: NONE,
    }
}

impl Renderer {
    /// What covers the middle of each pixel of the window; what is cut out is passed by.
    ///
    /// # Errors
    /// The device fails, or traces no single rays (wgpu).
    pub fn identities(&self) -> Result<Identities> {
        let params = *self.backend.frame().params;
        let pixels: Vec<u32> = (0..params.window_width * params.window_height).collect();
        let mut identities = Identities::default();
        for some in pixels.chunks(RAYS) {
            let rays: Vec<_> = some.iter().map(|&i| ray(&params, i)).collect();
            for hit in self.backend.probe(&rays)? {
                identities.push(&hit, &self.owners);
            }
        }
        Ok(identities)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_belong_to_the_last_owner_before_them() {
        let owner = |placement, first_triangle, instance| Owner {
            placement,
            first_triangle,
            instance,
            material: 10 + instance,
        };
        // the second one has no triangles
        let owners = [
            owner(0, 0, 0),
            owner(0, 2, 3),
            owner(0, 2, 4),
            owner(2, 0, 1),
            owner(3, 0, 2),
        ];
        let mut met = Identities::default();
        for (instance, primitive) in [(0, 0), (0, 1), (0, 2), (0, 9), (2, 7), (3, 0), (NONE, NONE)]
        {
            let hit = ProbeHit {
                instance,
                primitive,
                ..ProbeHit::default()
            };
            met.push(&hit, &owners);
        }
        assert_eq!(met.instances, [0.0, 0.0, 4.0, 4.0, 1.0, 2.0, -1.0]);
        assert_eq!(met.materials, [10.0, 10.0, 14.0, 14.0, 11.0, 12.0, -1.0]);
    }
}
