//! Cameras of the file → cameras in world space, without scale.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3};

use super::json::{Camera as CameraJson, Root};
use super::node::{Nodes, Placed};
use super::{Check, get, quote};
use crate::scene::{Camera, Projection};

/// Places the cameras that the scene's nodes refer to; all cameras of the file are checked.
pub(super) fn load(root: &Root, nodes: &Nodes) -> Check<Vec<Camera>> {
    let mut projections = Vec::new();
    for (i, camera) in root.cameras.iter().enumerate() {
        projections.push(projection(camera, &format!("cameras[{i}]"))?);
    }
    let mut cameras = Vec::new();
    for placed in nodes.iter() {
        let Some(index) = placed.node.camera else {
            continue;
        };
        let user = format!("nodes[{}].camera", placed.index);
        let projection = *get(&projections, index, "cameras", &user)?;
        let own = &root.cameras[index as usize].name;
        let name = own.as_ref().or(placed.node.name.as_ref());
        cameras.push(Camera {
            name: name.map_or_else(|| format!("camera {}", cameras.len()), Clone::clone),
            world_from_camera: rigid(&placed)?,
            projection,
        });
    }
    Ok(cameras)
}

/// The node's place and orientation. The viewing axis is kept, and up as far as it is normal to it.
fn rigid(placed: &Placed) -> Check<DAffine3> {
    let m = placed.world.matrix3;
    let back = m.z_axis.try_normalize();
    let axes = back.and_then(|back| {
        let up = m.y_axis.try_normalize()?.reject_from_normalized(back);
        // Up that all but coincides with the axis has no direction left.
        (up.length() > 1e-9).then(|| (up.normalize(), back))
    });
    let (up, back) = axes.ok_or_else(|| {
        format!(
            "nodes[{}]: its transform leaves the camera no direction",
            placed.index
        )
    })?;
    Ok(DAffine3 {
        matrix3: DMat3::from_cols(up.cross(back), up, back),
        translation: placed.world.translation,
    })
}

fn projection(camera: &CameraJson, user: &str) -> Check<Projection> {
    match camera.kind.as_deref() {
        Some("perspective") => {
            let p = camera
                .perspective
                .as_ref()
                .ok_or_else(|| format!("{user}: perspective is missing"))?;
            let user = format!("{user}.perspective");
            let yfov = required(p.yfov, &user, "yfov")?;
            if !(yfov > 0.0 && yfov < PI && (yfov as f32) > 0.0) {
                return Err(format!("{user}: yfov {yfov} is not between 0 and π"));
            }
            let aspect = p
                .aspect_ratio
                .map(|aspect| positive(aspect, &user, "aspectRatio"))
                .transpose()?;
            let znear = required(p.znear, &user, "znear")?;
            positive(znear, &user, "znear")?;
            check_far(p.zfar, znear, &user)?;
            Ok(Projection::Perspective {
                yfov: yfov as f32,
                aspect,
            })
        }
        Some("orthographic") => {
            let o = camera
                .orthographic
                .as_ref()
                .ok_or_else(|| format!("{user}: orthographic is missing"))?;
            let user = format!("{user}.orthographic");
            let znear = required(o.znear, &user, "znear")?;
            if znear < 0.0 {
                return Err(format!("{user}: znear {znear} is negative"));
            }
            check_far(Some(required(o.zfar, &user, "zfar")?), znear, &user)?;
            Ok(Projection::Orthographic {
                xmag: positive(required(o.xmag, &user, "xmag")?, &user, "xmag")?,
                ymag: positive(required(o.ymag, &user, "ymag")?, &user, "ymag")?,
            })
        }
        Some(other) => Err(format!(
            "{user}: type {} is not known, only perspective and orthographic",
            quote(other)
        )),
        None => Err(format!("{user}: type is missing")),
    }
}

fn required(value: Option<f64>, user: &str, name: &str) -> Check<f64> {
    value.ok_or_else(|| format!("{user}: {name} is missing"))
}

fn positive(value: f64, user: &str, name: &str) -> Check<f32> {
    let single = value as f32;
    if single > 0.0 && single.is_finite() {
        Ok(single)
    } else {
        Err(format!("{user}: {name} {value} is not positive and finite"))
    }
}

fn check_far(zfar: Option<f64>, znear: f64, user: &str) -> Check<()> {
    match zfar {
        Some(zfar) if zfar <= znear => {
            Err(format!("{user}: zfar {zfar} is not beyond znear {znear}"))
        }
        _ => Ok(()),
    }
}
