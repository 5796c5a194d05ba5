//! Closed meshes that are filled: which of them overlap, which fills the space
//! where they do, and the material records that tell them apart.

use glam::DVec3;

use crate::scene::{Instance, Mesh, Scene};

/// Comparisons of boxes after which solids simply count as overlapping.
const MAX_COMPARISONS: usize = 10_000_000;
/// Boxes this close, relative to the larger one, count as touching.
const TOUCHING: f64 = 1e-5;

/// The solids of a scene. A *record* is a material as the kernels see it: its index
/// in the scene, or beyond those a copy for one solid of several that overlap.
#[derive(Debug, Default)]
pub struct Solids {
    /// Record of each instance of the scene.
    pub records: Vec<u32>,
    /// Materials that are copied, for the records beyond the scene's own.
    pub copies: Vec<u32>,
    /// Which solid fills the space where several overlap: the one of the highest rank, above 0. By record.
    pub ranks: Vec<u32>,
    /// Whether any two may overlap or touch.
    pub are_nested: bool,
    boxes: Vec<Bounds>,
}

type Bounds = (DVec3, DVec3);

/// One closed mesh, or several meshes of one node and material that close together.
struct Solid {
    instances: Vec<usize>,
    bounds: Bounds,
    /// Signed, m³.
    volume: f64,
    record: u32,
}

impl Solids {
    /// Finds the solids of a scene.
    pub fn of(scene: &Scene) -> Self {
        let material = |i: &Instance| scene.meshes[i.mesh as usize].material;
        let mut found = find(scene);
        let mut solids = Self {
            records: scene.instances.iter().map(material).collect(),
            ranks: vec![0; scene.materials.len()],
            are_nested: any_touch(&found),
            boxes: found.iter().map(|s| s.bounds).collect(),
            ..Self::default()
        };
        if !solids.are_nested {
            return solids;
        }
        // Each overlapping solid has a record of its own, so that a boundary says whose it is.
        let mut is_used = vec![false; scene.materials.len()];
        for solid in &mut found {
            let own = solid.record as usize;
            if std::mem::replace(&mut is_used[own], true) {
                solid.record = solids.ranks.len() as u32;
                solids.copies.push(own as u32);
                solids.ranks.push(0);
            }
            for &i in &solid.instances {
                solids.records[i] = solid.record;
            }
        }
        let priority = |s: &Solid| {
            let m = &scene.materials[solids.origin(s.record) as usize];
            m.volume.as_ref().map_or(0, |v| v.priority)
        };
        let mut order: Vec<&Solid> = found.iter().collect();
        order.sort_by(|a, b| {
            let by_volume = b.volume.abs().total_cmp(&a.volume.abs());
            priority(a).cmp(&priority(b)).then(by_volume)
        });
        let ranks: Vec<(u32, u32)> = order.iter().map(|s| s.record).zip(1..).collect();
        for (record, rank) in ranks {
            solids.ranks[record as usize] = rank;
        }
        solids
    }

    /// The scene's material of a record.
    pub fn origin(&self, record: u32) -> u32 {
        let own = self.ranks.len() - self.copies.len();
        match (record as usize).checked_sub(own) {
            None => record,
            Some(copy) => self.copies[copy],
        }
    }

    /// The material of each record.
    pub fn materials<'a>(
        &'a self,
        scene: &'a Scene,
    ) -> impl Iterator<Item = &'a crate::scene::Material> {
        let copy = |m: &u32| &scene.materials[*m as usize];
        scene.materials.iter().chain(self.copies.iter().map(copy))
    }

    /// Whether a point of the box may be inside a solid.
    pub fn may_hold(&self, points: Bounds) -> bool {
        self.boxes.iter().any(|b| touch(b, &points))
    }
}

/// Every solid of the scene in the order of its first instance.
fn find(scene: &Scene) -> Vec<Solid> {
    let mut found: Vec<Solid> = Vec::new();
    for (i, instance) in scene.instances.iter().enumerate() {
        let mesh = &scene.meshes[instance.mesh as usize];
        if scene.materials[mesh.material as usize].volume.is_none() {
            continue;
        }
        let Some((low, high)) = bounds(mesh, instance) else {
            continue;
        };
        let volume = volume(mesh) * instance.world_from_object.matrix3.determinant();
        // Parts of one glTF mesh stand next to each other.
        if let Some(last) = found.last_mut() {
            let before = &scene.instances[last.instances[0]];
            if last.record == mesh.material
                && before.mesh != instance.mesh
                && before.name == instance.name
                && before.world_from_object == instance.world_from_object
            {
                last.instances.push(i);
                last.bounds = (last.bounds.0.min(low), last.bounds.1.max(high));
                last.volume += volume;
                continue;
            }
        }
        found.push(Solid {
            instances: vec![i],
            bounds: (low, high),
            volume,
            record: mesh.material,
        });
    }
    found
}

fn bounds(mesh: &Mesh, instance: &Instance) -> Option<Bounds> {
    let place = |v: &u32| {
        let p = mesh.positions[*v as usize].as_dvec3();
        instance.world_from_object.transform_point3(p)
    };
    let mut corners = mesh.triangles.iter().flatten().map(place);
    let first = corners.next()?;
    Some(corners.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
}

/// Signed volume that a closed mesh encloses, positive where its fronts are outside; object space, m³.
fn volume(mesh: &Mesh) -> f64 {
    let corner = |v: u32| mesh.positions[v as usize].as_dvec3();
    let part = |t: &[u32; 3]| corner(t[0]).cross(corner(t[1])).dot(corner(t[2])) / 6.0;
    mesh.triangles.iter().map(part).sum()
}

fn touch(a: &Bounds, b: &Bounds) -> bool {
    let slack = TOUCHING * (a.1 - a.0).length().max((b.1 - b.0).length());
    (a.0 - slack).cmple(b.1).all() && (b.0 - slack).cmple(a.1).all()
}

/// Whether any two boxes touch: a sweep along x.
fn any_touch(solids: &[Solid]) -> bool {
    let mut order: Vec<&Bounds> = solids.iter().map(|s| &s.bounds).collect();
    order.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
    let mut comparisons = 0;
    for (i, a) in order.iter().enumerate() {
        for b in &order[i + 1..] {
            let slack = TOUCHING * (a.1 - a.0).length().max((b.1 - b.0).length());
            if b.0.x > a.1.x + slack {
                break;
            }
            comparisons += 1;
            if touch(a, b) || comparisons > MAX_COMPARISONS {
                return true;
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Volume};
    use glam::{DAffine3, Vec3};

    /// A tetrahedron of the given size at x, of material `m`.
    fn add(scene: &mut Scene, x: f64, size: f32, material: u32) {
        scene.instances.push(Instance {
            name: format!("solid {}", scene.instances.len()),
            mesh: scene.meshes.len() as u32,
            world_from_object: DAffine3::from_translation(DVec3::new(x, 0.0, 0.0)),
        });
        scene.meshes.push(Mesh {
            positions: vec![Vec3::ZERO, size * Vec3::X, size * Vec3::Y, size * Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            material,
            ..Mesh::default()
        });
    }

    fn scene(priorities: &[i32]) -> Scene {
        let solid = |&priority| Material {
            transmission: 1.0,
            volume: Some(Volume {
                priority,
                ..Volume::default()
            }),
            ..Material::default()
        };
        Scene {
            materials: priorities.iter().map(solid).collect(),
            ..Scene::default()
        }
    }

    #[test]
    fn apart_solids_need_nothing() {
        let mut scene = scene(&[0]);
        add(&mut scene, 0.0, 1.0, 0);
        add(&mut scene, 2.0, 1.0, 0);
        let solids = Solids::of(&scene);
        assert!(!solids.are_nested);
        assert_eq!(solids.records, [0, 0]);
        let at = |x| (DVec3::new(x, 0.1, 0.1), DVec3::new(x, 0.1, 0.1));
        assert!(solids.may_hold(at(0.5)) && !solids.may_hold(at(1.5)));
    }

    #[test]
    fn overlapping_solids_are_told_apart_and_ranked() {
        let mut scene = scene(&[0, 3]);
        add(&mut scene, 0.0, 1.0, 0);
        add(&mut scene, 0.2, 0.5, 0);
        add(&mut scene, 0.0, 9.0, 1);
        let solids = Solids::of(&scene);
        assert!(solids.are_nested);
        // The second solid of material 0 is a copy; smaller ones outrank larger ones, priority everything.
        assert_eq!(solids.records, [0, 2, 1]);
        assert_eq!(solids.origin(2), 0);
        assert_eq!(solids.ranks, [1, 3, 2]);
        assert_eq!(solids.materials(&scene).count(), 3);
    }
}
