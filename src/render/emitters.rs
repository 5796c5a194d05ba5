//! Which emitters a scene has, and how often each list of them is asked for light.

use super::light_tree;
use super::lights::{self, Emitter};
use super::solids::Solids;
use super::upload::SceneData;
use crate::layout;
use crate::scene::{AlphaMode, Scene};
use crate::settings::{Estimator, Settings};
use crate::spec;

/// Shares of direct light that the environment map gets at least and at most
/// beside other lights, and distant lights beside the tree: none may starve.
const SHARE: (f64, f64) = (0.1, 0.9);

impl SceneData {
    /// Fills the light table and the tree; `emissions` is the mean emission of each material, `env_power`
    /// the power of the environment's map.
    pub fn add_lights(
        &mut self,
        scene: &Scene,
        settings: &Settings,
        solids: &Solids,
        emissions: &[f64],
        env_power: f64,
    ) {
        let mut emitters = self.emissive_triangles(scene, solids, emissions);
        self.spec.area_lights = !emitters.is_empty();
        let triangles = emitters.len();
        for light in &scene.lights {
            let position = (light.position - self.geometry.origin).as_vec3();
            emitters.extend(lights::punctual(light, position, self.geometry.radius));
        }
        self.spec.punctual = emitters.len() > triangles;
        self.spec.equiangular =
            self.spec.scattering && settings.estimator == Estimator::Full && !emitters.is_empty();

        let is_uniform = settings.estimator == Estimator::Textbook;
        let count = emitters.len();
        let total = if is_uniform {
            count as f64
        } else {
            emitters.iter().map(|e| e.power).sum()
        };
        // Between 0 and 1 they fit single precision, however bright and large lamps are.
        for emitter in &mut emitters {
            emitter.power /= total;
        }
        let is_distant = |e: &Emitter| e.light.kind == layout::LIGHT_DIRECTIONAL;
        let (distant, placed): (Vec<_>, Vec<_>) = emitters.into_iter().partition(is_distant);
        self.spec.light_tree = !is_uniform && light_tree::is_needed(&placed);
        for (record, emission) in self.materials.iter_mut().zip(emissions) {
            if *emission > 0.0 && count > 0 {
                // Power of a unit area, as in `emissive_triangles`.
                let power = std::f64::consts::PI * emission * sides(record.flags);
                record.emission_pdf = (power / total) as f32;
                record.flags |= layout::MATERIAL_EMISSIVE;
            }
        }
        let env_choice = match (self.spec.environment, count) {
            (false, _) => 0.0,
            (true, 0) => 1.0,
            (true, _) if is_uniform => 1.0 / (count + 1) as f64,
            (true, _) => (env_power / (env_power + total)).clamp(SHARE.0, SHARE.1),
        };
        self.params.env_choice = env_choice as f32;
        self.params.table_choice = 1.0 - self.params.env_choice;
        if self.spec.light_tree {
            let share = if distant.is_empty() {
                0.0
            } else {
                let power: f64 = distant.iter().map(|e| e.power).sum();
                power.clamp(SHARE.0, SHARE.1)
            };
            self.params.tree_choice = self.params.table_choice * (1.0 - share) as f32;
            self.params.table_choice *= share as f32;
            self.add_table(distant, is_uniform);
            self.add_tree(placed);
        } else {
            let emitters = placed.into_iter().chain(distant).collect();
            self.add_table(emitters, is_uniform);
        }
        if self.lights.is_empty() {
            // What kernels that were compiled for lights read without any.
            self.lights = vec![[0; 4]; layout::LIGHT_TEXELS as usize];
        }
    }

    /// Lights that are chosen wherever they are needed with the same probability.
    fn add_table(&mut self, mut emitters: Vec<Emitter>, is_uniform: bool) {
        self.params.light_count = emitters.len() as u32;
        if is_uniform && !emitters.is_empty() {
            self.params.light_uniform = 1.0 / emitters.len() as f32;
        }
        self.put_densities(&mut emitters);
        let lights = lights::table(emitters, is_uniform);
        self.lights = bytemuck::cast_slice(&lights).to_vec();
    }

    /// Lights that are chosen by where they are needed.
    fn add_tree(&mut self, mut emitters: Vec<Emitter>) {
        self.put_densities(&mut emitters);
        let tree = light_tree::build(&emitters, self.params.light_count as usize);
        self.lights.extend(bytemuck::cast_slice(&tree.lights));
        self.params.light_nodes = self.lights.len() as u32;
        self.lights.extend(tree.nodes);
        self.params.light_keys = self.lights.len() as u32;
        self.params.light_key_count = tree.keys.len() as u32;
        self.lights.extend(tree.keys);
    }

    /// Gives emissive triangles the density of their material.
    fn put_densities(&self, emitters: &mut [Emitter]) {
        for Emitter { light, .. } in emitters {
            if light.kind == layout::LIGHT_TRIANGLE {
                let material = light.material & layout::TRIANGLE_MATERIAL_MASK;
                light.emission_pdf = self.materials[material as usize].emission_pdf;
            }
        }
    }

    /// Every placed triangle that emits, with its power: π · radiance · area · sides.
    fn emissive_triangles(
        &self,
        scene: &Scene,
        solids: &Solids,
        emissions: &[f64],
    ) -> Vec<Emitter> {
        let mut emitters = Vec::new();
        for (index, placement) in (0..).zip(&self.geometry.placements) {
            for triangle in self.geometry.groups[placement.group].triangles.clone() {
                let material =
                    self.geometry.triangles[triangle][3] & layout::TRIANGLE_MATERIAL_MASK;
                let emission = emissions[material as usize];
                if emission <= 0.0 {
                    continue;
                }
                let record = &self.materials[material as usize];
                let [a, b, c] = self
                    .geometry
                    .corners(triangle)
                    .map(|p| placement.world_from_object.transform_point3(p.as_dvec3()));
                let area = 0.5 * (b - a).cross(c - a).length();
                let power = std::f64::consts::PI * emission * area * sides(record.flags);
                if power > 0.0 {
                    let is_mirrored = placement.world_from_object.matrix3.determinant() < 0.0;
                    let flags = light_flags(scene, solids.origin(material), record, is_mirrored);
                    let light = layout::Light {
                        kind: layout::LIGHT_TRIANGLE,
                        position: a.as_vec3().to_array(),
                        material: material | flags,
                        edge1: (b - a).as_vec3().to_array(),
                        triangle: triangle as u32,
                        edge2: (c - a).as_vec3().to_array(),
                        intensity: record.emission,
                        ..Default::default()
                    };
                    emitters.push(Emitter {
                        light,
                        power,
                        placement: index,
                    });
                }
            }
        }
        emitters
    }
}

/// What the light table says of an emitter's material and placement.
fn light_flags(scene: &Scene, material: u32, record: &layout::Material, is_mirrored: bool) -> u32 {
    let m = &scene.materials[material as usize];
    let has_colors = scene
        .meshes
        .iter()
        .any(|mesh| mesh.material == material && !mesh.colors.is_empty());
    let is_plain =
        !spec::has_textures(m) && m.alpha_mode == AlphaMode::Opaque && !(m.unlit && has_colors);
    let is_double_sided = record.flags & layout::MATERIAL_DOUBLE_SIDED != 0;
    [
        (is_plain, layout::LIGHT_PLAIN),
        (is_double_sided, layout::LIGHT_DOUBLE_SIDED),
        (is_mirrored, layout::LIGHT_MIRRORED),
    ]
    .iter()
    .fold(0, |flags, (on, flag)| flags | if *on { *flag } else { 0 })
}

/// Sides that emit.
fn sides(flags: u32) -> f64 {
    if flags & layout::MATERIAL_DOUBLE_SIDED != 0 {
        2.0
    } else {
        1.0
    }
}
