//! The camera and the frame as the kernels see them.

use glam::{DMat4, DVec3};

use super::geometry::Geometry;
use crate::layout;
use crate::scene::{Camera, Projection, Scene};
use crate::settings::Settings;

fn aspect(settings: &Settings) -> f64 {
    f64::from(settings.width) / f64::from(settings.height)
}

/// The camera that the settings choose, or one that frames the scene.
fn camera(scene: &Scene, settings: &Settings) -> Camera {
    let chosen = scene.cameras.get(settings.camera.unwrap_or(0));
    chosen
        .cloned()
        .unwrap_or_else(|| scene.framing_camera(aspect(settings)))
}

/// A box that holds every point where a camera ray starts, metres.
pub(super) fn camera_origins(scene: &Scene, settings: &Settings) -> (DVec3, DVec3) {
    let camera = camera(scene, settings);
    let pose = camera.world_from_camera;
    let reach = match camera.projection {
        Projection::Perspective { .. } => DVec3::ZERO,
        Projection::Orthographic { ymag, .. } => {
            let half = f64::from(ymag);
            let (x, y) = (pose.matrix3.x_axis, pose.matrix3.y_axis);
            half * (aspect(settings) * x.abs() + y.abs())
        }
    };
    (pose.translation - reach, pose.translation + reach)
}

/// Camera, frame and limits; lights and environment are filled in later.
pub(super) fn params(scene: &Scene, settings: &Settings, geometry: &Geometry) -> layout::Params {
    let aspect = aspect(settings);
    let camera = camera(scene, settings);
    let pose = DMat4::from(camera.world_from_camera);
    let (right, up, back) = (
        pose.x_axis.truncate(),
        pose.y_axis.truncate(),
        pose.z_axis.truncate(),
    );
    let (half_width, half_height, kind) = match camera.projection {
        // The vertical angle holds; the width follows from the picture.
        Projection::Perspective { yfov, .. } => {
            let half = (0.5 * f64::from(yfov)).tan();
            (half * aspect, half, layout::CAMERA_PERSPECTIVE)
        }
        Projection::Orthographic { ymag, .. } => {
            let half = f64::from(ymag);
            (half * aspect, half, layout::CAMERA_ORTHOGRAPHIC)
        }
    };
    let window = settings.window();
    let (width, height) = (window.x1 - window.x0, window.y1 - window.y0);
    layout::Params {
        camera_position: (pose.w_axis.truncate() - geometry.origin)
            .as_vec3()
            .to_array(),
        camera_kind: kind,
        camera_right: (right * half_width).as_vec3().to_array(),
        width: settings.width,
        camera_up: (up * half_height).as_vec3().to_array(),
        height: settings.height,
        camera_forward: (-back).as_vec3().to_array(),
        window_x: window.x0,
        window_y: window.y0,
        window_width: width,
        window_height: height,
        tiles_x: width.div_ceil(layout::TILE),
        tiles_y: height.div_ceil(layout::TILE),
        seed_low: settings.seed as u32,
        seed_high: (settings.seed >> 32) as u32,
        max_depth: if settings.max_depth == 0 {
            layout::NONE
        } else {
            settings.max_depth
        },
        ..Default::default()
    }
}
