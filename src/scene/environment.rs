//! Radiance from infinity: a constant or a latitude–longitude map.

use std::sync::Arc;

use glam::Vec3;

/// Light that arrives from all sides.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same radiance from every direction, cd/m² per channel.
    Constant(Vec3),
    /// A latitude–longitude map. The centre of the image looks along −Z, +Y is
    /// up and u grows towards +X.
    Map {
        /// Texels a row.
        width: u32,
        /// Rows, the first one at the zenith.
        height: u32,
        /// Linear Rec. 709 texels, row by row; finite and not negative.
        texels: Arc<Vec<[f32; 3]>>,
        /// Factor that turns texels into radiance, cd/m².
        intensity: f32,
        /// Right-handed rotation about +Y, radians: what stood in direction d
        /// stands at R_y(rotation)·d.
        rotation: f32,
    },
}
