//! Where the picture is taken from.

use glam::{DAffine3, DMat3, DQuat, DVec3};

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

impl Camera {
    /// A perspective camera, `yfov` 45°, that has the whole box (corners `low` and
    /// `high`, metres) in view: from the front (+Z) and 15° above, looking at its
    /// centre. `aspect` is width over height. A box without size is seen from 1 m.
    pub fn framing(low: DVec3, high: DVec3, aspect: f64) -> Self {
        const YFOV: f64 = std::f64::consts::FRAC_PI_4;
        const ELEVATION: f64 = std::f64::consts::PI / 12.0;
        // Room left around the box.
        const MARGIN: f64 = 1.05;
        let rotation = DQuat::from_rotation_x(-ELEVATION);
        let center = low * 0.5 + high * 0.5;
        let half = high * 0.5 - low * 0.5;
        let tan_y = (YFOV / 2.0).tan() / MARGIN;
        let tan_x = tan_y * aspect;
        let mut distance = 0.0_f64;
        for corner in 0..8 {
            let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let offset = half * DVec3::new(sign(0), sign(1), sign(2));
            let p = rotation.inverse() * offset;
            // In view when |x| ≤ depth·tan and |y| likewise, depth = distance − z.
            let depth = (p.x.abs() / tan_x).max(p.y.abs() / tan_y);
            distance = distance.max(p.z + depth);
        }
        if distance <= 0.0 {
            distance = 1.0;
        }
        Self {
            name: String::from("framing"),
            world_from_camera: DAffine3 {
                matrix3: DMat3::from_quat(rotation),
                translation: center + rotation * DVec3::Z * distance,
            },
            projection: Projection::Perspective {
                yfov: YFOV as f32,
                aspect: None,
            },
        }
    }
}
