//! The camera and the frame as the kernels see them.

use glam::{DAffine3, DMat3, DMat4, DVec3};

use super::geometry::Geometry;
use crate::layout;
use crate::scene::{Camera, Projection, Scene};
use crate::settings::{Sensor, Settings};

fn aspect(settings: &Settings) -> f64 {
    f64::from(settings.width) / f64::from(settings.height)
}

/// Middle and radius of a sphere that holds the scene, metres.
pub(super) fn sphere(scene: &Scene) -> (DVec3, f64) {
    let (low, high) = scene.bounds().unwrap_or_default();
    (0.5 * (low + high), 0.5 * (high - low).length())
}

/// A camera that sees what the light meter does, or stands where it is.
fn meter(scene: &Scene, sensor: &Sensor) -> Camera {
    let (centre, radius) = sphere(scene);
    // A view without an angle: every pixel sees the same ray.
    let ray = Projection::Perspective {
        yfov: 0.0,
        aspect: None,
    };
    let (from, forward, projection) = match *sensor {
        Sensor::Irradiance { position, normal } => (position, normal, ray),
        Sensor::Radiance {
            position,
            direction,
        } => (position, direction, ray),
        Sensor::Intensity { direction } => {
            let mag = radius as f32;
            let square = Projection::Orthographic {
                xmag: mag,
                ymag: mag,
            };
            (centre + 1.1 * radius * direction, -direction, square)
        }
        Sensor::Flux => (centre, DVec3::Z, ray),
    };
    let right = forward.any_orthonormal_vector();
    Camera {
        name: String::from("meter"),
        world_from_camera: DAffine3 {
            matrix3: DMat3::from_cols(right, right.cross(forward), -forward),
            translation: from,
        },
        projection,
    }
}

/// The camera that the settings choose, or one that frames the scene.
fn camera(scene: &Scene, settings: &Settings) -> Camera {
    if let Some(sensor) = &settings.sensor {
        return meter(scene, sensor);
    }
    let chosen = scene.cameras.get(settings.camera.unwrap_or(0));
    chosen
        .cloned()
        .unwrap_or_else(|| scene.framing_camera(aspect(settings)))
}

/// A box that holds every point where a camera ray starts, metres.
pub(super) fn camera_origins(scene: &Scene, settings: &Settings) -> (DVec3, DVec3) {
    if settings.sensor == Some(Sensor::Flux) {
        let (centre, radius) = sphere(scene);
        return (centre - 2.0 * radius, centre + 2.0 * radius);
    }
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
    let (kind, camera_right) = match settings.sensor {
        Some(Sensor::Irradiance { .. }) => (layout::CAMERA_IRRADIANCE, sphere(scene).1 * DVec3::X),
        Some(Sensor::Flux) => (layout::CAMERA_FLUX, sphere(scene).1 * DVec3::X),
        _ => (kind, right * half_width),
    };
    let window = settings.window();
    let (width, height) = (window.x1 - window.x0, window.y1 - window.y0);
    layout::Params {
        camera_position: (pose.w_axis.truncate() - geometry.origin)
            .as_vec3()
            .to_array(),
        camera_kind: kind,
        camera_right: camera_right.as_vec3().to_array(),
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
