//! Every triangle against every ray in double precision, from the scene itself:
//! nothing is shared with the renderer but the scene's documented meaning and the
//! order in which instances and primitives are counted.

use etendue::layout::{NONE, ProbeHit, ProbeRay};
use etendue::scene::{AlphaMode, Material, Scene, Texels};
use glam::{DAffine3, DVec2, DVec3, Vec3};

use crate::Levels;

/// Roundings of single precision that positions, rays and transforms gather, relative to the coordinates involved.
const ROUNDING: f64 = 16.0 / (1u64 << 24) as f64;
/// Tolerance of distances, relative.
pub const T_TOLERANCE: f64 = 1e-5;
/// Tolerance of weights.
const BARY_TOLERANCE: f64 = 1e-4;

struct Triangle {
    instance: u32,
    primitive: u32,
    corners: [DVec3; 3],
    /// Texture coordinates and threshold where it may be cut out.
    mask: Option<([DVec2; 3], f64)>,
}

/// A scene as a list of triangles relative to its origin.
pub struct Brute {
    pub origin: DVec3,
    triangles: Vec<Triangle>,
    /// Largest coordinate that single precision had to hold.
    size: f64,
    checker: Option<(u32, Vec<u8>)>,
}

/// A triangle that a ray meets or may meet.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    pub t: f64,
    pub instance: u32,
    pub primitive: u32,
    bary: [f64; 2],
    t_slack: f64,
    bary_slack: f64,
    /// Met whatever the rounding.
    is_certain: bool,
    /// Met in exact arithmetic.
    pub is_hit: bool,
}

/// The point that the renderer subtracts from all positions: the middle of scenes that are far away, else 0.
pub fn origin(scene: &Scene) -> DVec3 {
    let (low, high) = scene.bounds().unwrap_or_default();
    let centre = 0.5 * (low + high);
    if centre.abs().max_element() > (high - low).length() {
        centre
    } else {
        DVec3::ZERO
    }
}

/// Width and texels of the texture that cuts out, when any material is cut out.
fn checker(scene: &Scene) -> Option<(u32, Vec<u8>)> {
    let is_cut = |m: &Material| matches!(m.alpha_mode, AlphaMode::Mask { .. });
    scene.materials.iter().any(is_cut).then(|| {
        let texture = &scene.textures[0];
        let Texels::Rgba8 { data, .. } = &texture.texels else {
            panic!("only eight bits are looked up here")
        };
        (texture.width, data.clone())
    })
}

impl Brute {
    pub fn new(scene: &Scene, levels: Levels) -> Self {
        let mut brute = Self {
            origin: origin(scene),
            triangles: Vec::new(),
            size: 0.0,
            checker: checker(scene),
        };
        let uses = |mesh| scene.instances.iter().filter(|i| i.mesh == mesh).count();
        // Instance 0 is everything in world space; shared meshes follow in the scene's order.
        let (mut flat, mut placed) = (0, 0);
        for instance in &scene.instances {
            let is_shared = levels == Levels::Two && uses(instance.mesh) > 1;
            let place = DAffine3 {
                translation: instance.world_from_object.translation - brute.origin,
                ..instance.world_from_object
            };
            let first = if is_shared { 0 } else { flat };
            if is_shared {
                placed += 1;
            }
            let id = if is_shared { placed } else { 0 };
            brute.append(scene, instance.mesh, &place, id, first);
            if !is_shared {
                flat += scene.meshes[instance.mesh as usize].triangles.len() as u32;
            }
        }
        brute
    }

    fn append(&mut self, scene: &Scene, mesh: u32, place: &DAffine3, instance: u32, first: u32) {
        let mesh = &scene.meshes[mesh as usize];
        let cutoff = match scene.materials[mesh.material as usize].alpha_mode {
            AlphaMode::Mask { cutoff } => Some(f64::from(cutoff)),
            _ => None,
        };
        // Copying into world space keeps the front in front: mirrored triangles are turned round.
        let turn = instance == 0 && place.matrix3.determinant() < 0.0;
        for (index, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            let order = if turn { [a, c, b] } else { [a, b, c] };
            let corners =
                order.map(|v| place.transform_point3(mesh.positions[v as usize].as_dvec3()));
            for corner in corners {
                self.size = self.size.max(corner.abs().max_element());
            }
            self.size = self.size.max(place.translation.abs().max_element());
            self.triangles.push(Triangle {
                instance,
                primitive: first + index as u32,
                corners,
                mask: cutoff
                    .map(|cutoff| (order.map(|v| mesh.uvs[0][v as usize].as_dvec2()), cutoff)),
            });
        }
    }

    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].corners
    }

    /// Everything that the ray meets or may meet, its interval observed.
    pub fn trace(&self, ray: &ProbeRay) -> Vec<Candidate> {
        let origin = Vec3::from(ray.origin).as_dvec3();
        let direction = Vec3::from(ray.direction).as_dvec3();
        let reach = self.size + origin.abs().max_element();
        self.triangles
            .iter()
            .filter_map(|triangle| self.meet(triangle, origin, direction, reach))
            .filter_map(|mut candidate| {
                let (low, high) = (f64::from(ray.t_min), f64::from(ray.t_max));
                let slack = candidate.t_slack;
                candidate.is_hit &= candidate.t > low && candidate.t < high;
                candidate.is_certain &= candidate.t > low + slack && candidate.t < high - slack;
                (candidate.t > low - slack && candidate.t < high + slack).then_some(candidate)
            })
            .collect()
    }

    fn meet(&self, triangle: &Triangle, o: DVec3, d: DVec3, reach: f64) -> Option<Candidate> {
        let [a, b, c] = triangle.corners;
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let det = -normal.dot(d);
        if det == 0.0 {
            return None;
        }
        let from_a = o - a;
        let around = d.cross(from_a);
        let (v, w) = (-ac.dot(around) / det, ab.dot(around) / det);
        let t = from_a.dot(normal) / det;
        // A ray displaced by rounding slides over the plane by so much, and that counts against the heights.
        let area2 = normal.length();
        let shift = ROUNDING * reach * area2 / det.abs() * d.length();
        let longest = ab.length().max(ac.length()).max((c - b).length());
        let bary_slack = shift * longest / area2;
        let inside = v.min(w).min(1.0 - v - w);
        if inside < -bary_slack || !t.is_finite() {
            return None;
        }
        let (is_solid, is_settled) = self.alpha(triangle, v, w, bary_slack);
        if !is_solid && is_settled {
            return None;
        }
        Some(Candidate {
            t,
            instance: triangle.instance,
            primitive: triangle.primitive,
            bary: [v, w],
            t_slack: shift.max(T_TOLERANCE * t.abs()),
            bary_slack: bary_slack.max(BARY_TOLERANCE),
            is_certain: inside > bary_slack && is_settled,
            is_hit: inside >= 0.0 && is_solid,
        })
    }

    /// Whether the point is there, and whether that is beyond doubt: not so at the border of a texel.
    fn alpha(&self, triangle: &Triangle, v: f64, w: f64, slack: f64) -> (bool, bool) {
        let (Some((uv, cutoff)), Some((width, texels))) = (&triangle.mask, &self.checker) else {
            return (true, true);
        };
        let at = (uv[0] + (uv[1] - uv[0]) * v + (uv[2] - uv[0]) * w) * f64::from(*width);
        let cell = at
            .floor()
            .clamp(DVec2::ZERO, DVec2::splat(f64::from(width - 1)));
        let alpha = texels[4 * (cell.y as usize * *width as usize + cell.x as usize) + 3];
        let border = (at - at.round()).abs().min_element();
        let doubt = 4.0 * f64::from(*width) * slack.max(1e-6);
        (f64::from(alpha) / 255.0 >= *cutoff, border > doubt)
    }
}

/// The nearest hit in exact arithmetic.
pub fn nearest(candidates: &[Candidate]) -> Option<&Candidate> {
    candidates
        .iter()
        .filter(|c| c.is_hit)
        .min_by(|a, b| a.t.total_cmp(&b.t))
}

/// Whether the answer has the very ids of the nearest hit; fails when it is neither that nor a tie, an edge or a
/// distance on the interval's end within rounding.
pub fn check(hit: &ProbeHit, candidates: &[Candidate]) -> Result<bool, String> {
    let fail = |what: &str| Err(format!("{what}: {hit:?}, candidates {candidates:?}"));
    let expected = nearest(candidates);
    let is_hit = hit.primitive != NONE;
    if (hit.occluded != 0) != is_hit {
        return fail("closest and any hit contradict each other");
    }
    let own = candidates
        .iter()
        .find(|c| (c.instance, c.primitive) == (hit.instance, hit.primitive));
    let t = f64::from(hit.t);
    let far = if is_hit { t } else { f64::INFINITY };
    if candidates
        .iter()
        .any(|c| c.is_certain && c.t + c.t_slack < far)
    {
        return fail("a certain hit was missed");
    }
    if !is_hit {
        return Ok(expected.is_none());
    }
    let Some(own) = own else {
        return fail("the triangle is not on the ray");
    };
    if (own.t - t).abs() > own.t_slack {
        return fail("the distance is wrong");
    }
    let off = |i: usize| (own.bary[i] - f64::from(hit.bary[i])).abs();
    if off(0).max(off(1)) > own.bary_slack {
        return fail("the weights are wrong");
    }
    Ok(expected.is_some_and(|e| (e.instance, e.primitive) == (hit.instance, hit.primitive)))
}
