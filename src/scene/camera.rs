//! Where the picture is taken from.

use glam::DAffine3;

/// How the camera maps directions or points to pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole.
    Perspective {
        /// Full vertical field of view, radians, in (0, π).
        yfov: f32,
        /// Width over height that the file asks for.
        aspect: Option<f32>,
    },
    /// Parallel rays along the viewing axis.
    Orthographic {
        /// Half the width of the view, metres.
        xmag: f32,
        /// Half the height of the view, metres.
        ymag: f32,
    },
}

/// A camera in the world. It looks along its local −Z, +Y is up (as in glTF).
/// Scaling is removed from the transform.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name in the file, or `camera N`.
    pub name: String,
    /// Rigid transform, camera to world.
    pub world_from_camera: DAffine3,
    /// Perspective or orthographic.
    pub projection: Projection,
}
