//! Rays of the camera: a pixel is the mean radiance over its area.

use etendue::scene::{Camera, Projection};
use glam::DVec3;

use super::rng::Rng;

/// Origin and unit direction of a ray through pixel (`x`, `y`) of a square frame
/// of `side` pixels; row 0 is at the top.
pub fn ray(camera: &Camera, side: u32, x: u32, y: u32, rng: &mut Rng) -> (DVec3, DVec3) {
    // Place in the frame, −1 … 1, x to the right and y up.
    let place = |pixel: u32, u: f64| 2.0 * (f64::from(pixel) + u) / f64::from(side) - 1.0;
    let (right, up) = (place(x, rng.uniform()), -place(y, rng.uniform()));
    let place = &camera.world_from_camera;
    match camera.projection {
        Projection::Perspective { yfov, .. } => {
            let tan = (f64::from(yfov) / 2.0).tan();
            let d = DVec3::new(tan * right, tan * up, -1.0);
            (place.translation, (place.matrix3 * d).normalize())
        }
        Projection::Orthographic { xmag, ymag } => {
            assert_eq!(xmag, ymag, "square frames only");
            let p = f64::from(ymag) * DVec3::new(right, up, 0.0);
            (
                place.transform_point3(p),
                (place.matrix3 * -DVec3::Z).normalize(),
            )
        }
    }
}
