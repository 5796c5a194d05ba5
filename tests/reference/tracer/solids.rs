//! Which solid fills the space at a point. Every placed closed mesh of a
//! transmitting material with a volume is a shell; where shells overlap, the one
//! with the highest priority counts, among equal ones the smallest.

use etendue::scene::{Material, Medium, Scene};
use glam::DVec3;

use super::geometry::{Geometry, NONE};

/// The shells that contain a point, one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inside(u64);

impl Inside {
    /// After crossing the boundary of a shell from its front (into it) or from its back.
    pub fn crossed(self, shell: usize, enters: bool) -> Self {
        let bit = 1 << shell;
        Self(if enters { self.0 | bit } else { self.0 & !bit })
    }
}

struct Shell {
    instance: usize,
    priority: i32,
    /// Enclosed volume, m³.
    size: f64,
}

/// All shells of a scene, the ones that win overlaps first.
pub struct Solids {
    shells: Vec<Shell>,
    of_instance: Vec<Option<usize>>,
}

/// Whether the material bounds a solid that light can enter.
pub fn is_solid(m: &Material) -> bool {
    m.volume.is_some() && m.transmission > 0.0 && !m.unlit
}

fn material(scene: &Scene, instance: usize) -> &Material {
    let mesh = scene.instances[instance].mesh as usize;
    &scene.materials[scene.meshes[mesh].material as usize]
}

impl Solids {
    pub fn new(scene: &Scene, geometry: &Geometry) -> Self {
        let mut shells: Vec<Shell> = (0..scene.instances.len())
            .filter(|&instance| is_solid(material(scene, instance)))
            .map(|instance| Shell {
                instance,
                priority: material(scene, instance).volume.unwrap().priority,
                size: enclosed(geometry, instance),
            })
            .collect();
        assert!(shells.len() <= 64, "one bit a shell");
        shells.sort_by(|a, b| b.priority.cmp(&a.priority).then(a.size.total_cmp(&b.size)));
        let of_instance = (0..scene.instances.len())
            .map(|i| shells.iter().position(|shell| shell.instance == i))
            .collect();
        Self {
            shells,
            of_instance,
        }
    }

    /// The shell that an instance is, if it is one.
    pub fn shell(&self, instance: usize) -> Option<usize> {
        self.of_instance[instance]
    }

    /// The shell that fills the space: the first one that contains the point.
    pub fn filling(&self, inside: Inside) -> Option<usize> {
        (inside.0 != 0).then(|| inside.0.trailing_zeros() as usize)
    }

    /// Index of refraction of what fills the space; 1 outside.
    pub fn index(&self, scene: &Scene, inside: Inside) -> f64 {
        self.filling(inside).map_or(1.0, |shell| {
            let ior = material(scene, self.shells[shell].instance).ior;
            if ior == 0.0 {
                f64::INFINITY
            } else {
                f64::from(ior)
            }
        })
    }

    /// The medium that fills the space.
    pub fn medium<'a>(&self, scene: &'a Scene, inside: Inside) -> Option<&'a Medium> {
        match self.filling(inside) {
            None => scene.medium.as_ref(),
            Some(shell) => material(scene, self.shells[shell].instance)
                .volume
                .as_ref()
                .map(|volume| &volume.medium),
        }
    }

    /// The shells around a point: those whose boundary a ray crosses an odd number of times.
    pub fn around(&self, geometry: &Geometry, mut p: DVec3, direction: DVec3) -> Inside {
        let mut inside = Inside::default();
        if self.shells.is_empty() {
            return inside;
        }
        let mut skip = NONE;
        while let Some(hit) = geometry.closest(p, direction, skip) {
            if let Some(shell) = self.shell(geometry.triangles[hit.triangle].instance) {
                inside.0 ^= 1 << shell;
            }
            p += hit.t * direction;
            skip = hit.triangle;
        }
        inside
    }
}

/// Volume within an instance, m³: the sum of signed tetrahedra.
fn enclosed(geometry: &Geometry, instance: usize) -> f64 {
    let sum: f64 = geometry
        .triangles
        .iter()
        .filter(|t| t.instance == instance)
        .map(|t| t.v0.dot(t.e1.cross(t.e2)) / 6.0)
        .sum();
    sum.abs()
}
