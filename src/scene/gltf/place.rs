//! Nodes with meshes → instances: one for each primitive, times
//! EXT_mesh_gpu_instancing.

use glam::{DAffine3, DVec3};

use super::accessor::{Buffers, Kinds, Reader};
use super::json::{Instancing, Root, Shape};
use super::mesh::Meshes;
use super::node::{FARTHEST, Nodes, Placed, is_singular, unit_quaternion};
use super::{Check, Limits, Warnings, quote};
use crate::scene::Instance;

/// Places the meshes that the scene's nodes refer to; beside each instance its node.
pub(super) fn instances(
    root: &Root,
    buffers: &Buffers,
    nodes: &Nodes,
    meshes: &Meshes,
    limits: &Limits,
    warnings: &mut Warnings,
) -> Check<(Vec<Instance>, Vec<u32>)> {
    let mut placer = Placer {
        instances: Vec::new(),
        owners: Vec::new(),
        meshes,
        limits,
        warnings,
    };
    let mut skinned = 0_u64;
    for placed in nodes.iter() {
        let Some(mesh) = placed.node.mesh else {
            continue;
        };
        skinned += u64::from(placed.node.skin.is_some());
        let extensions = placed.node.extensions.as_deref();
        match extensions.and_then(|e| e.instancing.as_ref()) {
            None => placer.place(&placed, mesh, placed.world)?,
            Some(instancing) => {
                let transforms = Transforms::new(buffers, instancing, placed.index)?;
                for i in 0..transforms.count {
                    placer.place(&placed, mesh, placed.world * transforms.get(i)?)?;
                }
            }
        }
    }
    let (instances, owners) = (placer.instances, placer.owners);
    if skinned > 0 {
        warnings.push(format!(
            "{skinned} skinned meshes are shown as they are stored: skins are not applied"
        ));
    }
    if !root.animations.is_empty() {
        warnings.push(format!("{} animations are ignored", root.animations.len()));
    }
    Ok((instances, owners))
}

struct Placer<'a> {
    instances: Vec<Instance>,
    owners: Vec<u32>,
    meshes: &'a Meshes,
    limits: &'a Limits,
    warnings: &'a mut Warnings,
}

impl Placer<'_> {
    /// Adds one instance for each primitive of a mesh.
    fn place(&mut self, placed: &Placed, mesh: u32, world: DAffine3) -> Check<()> {
        if is_singular(&world) {
            self.warnings.push(format!(
                "node {} is left out: its transform flattens the mesh",
                quote(&placed.name())
            ));
            return Ok(());
        }
        for mesh in self.meshes.primitives_of(mesh) {
            let m = world.matrix3;
            let stretch = m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs();
            let farthest = stretch.max_element() * self.meshes.extent(mesh)
                + world.translation.abs().max_element();
            if farthest.is_nan() || farthest > FARTHEST {
                return Err(format!(
                    "nodes[{}] places vertices farther out than {FARTHEST:e} m",
                    placed.index
                ));
            }
            if self.instances.len() as u64 >= self.limits.instances {
                return Err(format!(
                    "more instances than the cap of {} (Limits::instances)",
                    self.limits.instances
                ));
            }
            self.owners.push(placed.index as u32);
            self.instances.push(Instance {
                name: placed.name(),
                mesh,
                world_from_object: world,
            });
        }
        Ok(())
    }
}

/// The accessors of EXT_mesh_gpu_instancing.
struct Transforms<'a> {
    count: u64,
    translation: Option<Reader<'a>>,
    rotation: Option<Reader<'a>>,
    scale: Option<Reader<'a>>,
    user: String,
}

impl<'a> Transforms<'a> {
    fn new(buffers: &'a Buffers, instancing: &Instancing, node: usize) -> Check<Self> {
        let user = format!("nodes[{node}]: EXT_mesh_gpu_instancing");
        let read = |index: Option<u32>, name: &str, shape: Shape, kinds: Kinds| {
            index
                .map(|index| buffers.reader(index, &format!("{name} of {user}"), &[shape], kinds))
                .transpose()
        };
        let attributes = &instancing.attributes;
        let quantized = Kinds::FLOAT.or(Kinds::SIGNED_NORMALIZED);
        let translation = read(
            attributes.translation,
            "TRANSLATION",
            Shape::Vec3,
            Kinds::FLOAT,
        )?;
        let rotation = read(attributes.rotation, "ROTATION", Shape::Vec4, quantized)?;
        let scale = read(attributes.scale, "SCALE", Shape::Vec3, Kinds::FLOAT)?;
        let readers = [&translation, &rotation, &scale].into_iter().flatten();
        let counts: Vec<u64> = readers.map(|reader| reader.count).collect();
        let Some(&count) = counts.first() else {
            return Err(format!(
                "{user} has none of TRANSLATION, ROTATION and SCALE"
            ));
        };
        if counts.iter().any(|&other| other != count) {
            return Err(format!("{user}: its attributes differ in count"));
        }
        Ok(Self {
            count,
            translation,
            rotation,
            scale,
            user,
        })
    }

    fn get(&self, i: u64) -> Check<DAffine3> {
        let read = |reader: &Option<Reader>, default: [f64; 4]| match reader {
            Some(reader) => reader.finite(i).map(|x| x.map(f64::from)),
            None => Ok(default),
        };
        let [tx, ty, tz, _] = read(&self.translation, [0.0; 4])?;
        let [sx, sy, sz, _] = read(&self.scale, [1.0; 4])?;
        let rotation = unit_quaternion(read(&self.rotation, [0.0, 0.0, 0.0, 1.0])?)
            .ok_or_else(|| format!("{}: rotation {i} is no unit quaternion", self.user))?;
        Ok(DAffine3::from_scale_rotation_translation(
            DVec3::new(sx, sy, sz),
            rotation,
            DVec3::new(tx, ty, tz),
        ))
    }
}
