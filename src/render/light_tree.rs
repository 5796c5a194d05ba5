//! A tree over the emitters that have a place, by which kernels choose those that matter at a point: each
//! step goes to one of two clusters in proportion to a bound on what they give there.
//!
//! \[Conty18\] Conty Estevez, Kulla, Importance Sampling of Many Lights with
//! Adaptive Tree Splitting: the cost of a split, bounds of clusters.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::lights::{Emitter, alias_table};
use crate::layout;

/// Triangles of a leaf, which shares them out by power, at most …
const LEAF: usize = 4;
/// … if they face much the same way: cosine of the widest cone of their normals.
const LEAF_CONE: f64 = 0.5;
/// Bins for each axis in which splits are tried.
const BINS: usize = 12;
/// More emitters than this are chosen by power alone, so that a way to a leaf surely fits 32 bits.
const MOST: usize = 1 << 22;
/// What single precision and the packed axis may be off, relative and in cosines.
const ROUNDING: f64 = 1e-5;
const AXIS_ROUNDING: f64 = 1e-3;
/// Narrower spots count as this wide, steradians.
const LEAST_LIT: f64 = 1e-6;

/// The tree as kernels read it.
#[derive(Default)]
pub(crate) struct LightTree {
    /// The emitters, leaf by leaf, with the alias tables of the leaves.
    pub lights: Vec<layout::Light>,
    /// Texels of the inner nodes, root first.
    pub nodes: Vec<[u32; 4]>,
    /// For each emissive triangle in the order of placements and triangles: its
    /// placement, its triangle, the way to its leaf, the bits of the leaf's power.
    pub keys: Vec<[u32; 4]>,
}

/// Where an emitter is and where it shines to.
#[derive(Clone, Copy)]
struct Place {
    corners: [DVec3; 3],
    centre: DVec3,
    cone: Option<Cone>,
    power: f64,
}

/// Directions about an axis: normals of emitters, or all that spots shine to.
#[derive(Clone, Copy)]
struct Cone {
    axis: DVec3,
    /// Of its half angle.
    cos: f64,
    /// Nothing goes beyond it; else what does falls off as the cosine of the angle beyond.
    is_sharp: bool,
}

/// What is known of several emitters.
#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
    cone: Option<Cone>,
    power: f64,
}

/// A cluster that waits to be split, and the texel of its parent that is to know it.
struct Open {
    range: std::ops::Range<usize>,
    depth: u32,
    trail: u32,
    slot: usize,
}

impl Place {
    fn of(emitter: &Emitter) -> Self {
        let light = &emitter.light;
        let at = DVec3::from(light.position.map(f64::from));
        if light.kind != layout::LIGHT_TRIANGLE {
            let axis = DVec3::from(light.direction.map(f64::from)).normalize_or_zero();
            let has_cone = light.kind == layout::LIGHT_SPOT && axis != DVec3::ZERO;
            return Self {
                corners: [at; 3],
                centre: at,
                cone: has_cone.then(|| Cone {
                    axis,
                    cos: f64::from(light.cos_outer),
                    is_sharp: true,
                }),
                power: emitter.power,
            };
        }
        let [a, b] = [light.edge1, light.edge2].map(|e| DVec3::from(e.map(f64::from)));
        let is_mirrored = light.material & layout::LIGHT_MIRRORED != 0;
        let normal = a.cross(b) * if is_mirrored { -1.0 } else { 1.0 };
        let axis = normal.normalize_or_zero();
        let is_one_sided = light.material & layout::LIGHT_DOUBLE_SIDED == 0 && axis != DVec3::ZERO;
        Self {
            corners: [at, at + a, at + b],
            centre: at + (a + b) / 3.0,
            cone: is_one_sided.then_some(Cone {
                axis,
                cos: 1.0,
                is_sharp: false,
            }),
            power: emitter.power,
        }
    }
}

impl Cone {
    /// The least cone about both; `None` for all directions.
    fn union(self, other: Self) -> Option<Self> {
        let (a, b) = if self.cos < other.cos {
            (self, other)
        } else {
            (other, self)
        };
        let (wide, narrow) = (a.cos.clamp(-1.0, 1.0).acos(), b.cos.clamp(-1.0, 1.0).acos());
        let between = a.axis.angle_between(b.axis);
        let is_sharp = self.is_sharp && other.is_sharp;
        if between + narrow <= wide {
            return Some(Self { is_sharp, ..a });
        }
        let half = 0.5 * (wide + between + narrow);
        let normal = a.axis.cross(b.axis).normalize_or_zero();
        if half >= PI || normal == DVec3::ZERO {
            return None;
        }
        let axis = glam::DQuat::from_axis_angle(normal, half - wide) * a.axis;
        Some(Self {
            axis,
            cos: half.cos(),
            is_sharp,
        })
    }
}

impl Bounds {
    fn of(place: &Place) -> Self {
        let [a, b, c] = place.corners;
        Self {
            low: a.min(b).min(c),
            high: a.max(b).max(c),
            cone: place.cone,
            power: place.power,
        }
    }

    fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            cone: self.cone.zip(other.cone).and_then(|(a, b)| a.union(b)),
            power: self.power + other.power,
        }
    }

    /// Solid angle that is lit, where what is beyond the cone counts by its cosine. [Conty18] Eq. 1
    fn lit(&self) -> f64 {
        let angle = self.cone.map_or(PI, |c| c.cos.clamp(-1.0, 1.0).acos());
        let beyond = match self.cone {
            Some(cone) if cone.is_sharp => 0.0,
            _ => FRAC_PI_2,
        };
        let reach = (angle + beyond).min(PI);
        2.0 * PI * (1.0 - angle.cos())
            + FRAC_PI_2
                * (2.0 * reach * angle.sin()
                    - (angle - 2.0 * reach).cos()
                    - 2.0 * angle * angle.sin()
                    + angle.cos())
    }

    /// Power × size × solid angle lit. [Conty18]
    fn cost(&self) -> f64 {
        self.power * (self.high - self.low).length_squared() * self.lit()
    }

    /// Power over the solid angle lit, negative where nothing goes beyond the cone.
    fn intensity(&self) -> f64 {
        let is_sharp = self.cone.is_some_and(|c| c.is_sharp);
        let intensity = self.power / self.lit().max(LEAST_LIT);
        if is_sharp { -intensity } else { intensity }
    }
}

/// Whether a tree over these emitters has more than one leaf.
pub(crate) fn is_needed(emitters: &[Emitter]) -> bool {
    let places = || emitters.iter().map(Place::of).collect::<Vec<_>>();
    let all = || (0..emitters.len()).collect::<Vec<_>>();
    (2..=MOST).contains(&emitters.len()) && (emitters.len() > LEAF || !is_leaf(&places(), &all()))
}

fn is_leaf(places: &[Place], members: &[usize]) -> bool {
    // spots are told apart by their cones
    let is_face = |m: &usize| places[*m].cone.is_some_and(|c| !c.is_sharp);
    let is_narrow = |bounds: Bounds| bounds.cone.is_some_and(|c| c.cos >= LEAF_CONE);
    let is_alike = || members.iter().all(is_face) && is_narrow(bounds(places, members));
    members.len() == 1 || members.len() <= LEAF && is_alike()
}

fn bounds(places: &[Place], members: &[usize]) -> Bounds {
    let all = members.iter().map(|&m| Bounds::of(&places[m]));
    all.reduce(Bounds::union).expect("clusters are not empty")
}

/// The tree over emitters with a place, triangles first and these in the order of placements and
/// triangles; `first` is the index that its first light has in the table.
pub(crate) fn build(emitters: &[Emitter], first: usize) -> LightTree {
    let places: Vec<Place> = emitters.iter().map(Place::of).collect();
    let is_triangle = |e: &&Emitter| e.light.kind == layout::LIGHT_TRIANGLE;
    let triangles = emitters.iter().take_while(is_triangle).count();
    let deep = u32::BITS - 1 - places.len().ilog2();
    let mut members: Vec<usize> = (0..places.len()).collect();
    let mut tree = LightTree {
        keys: vec![[0; 4]; triangles],
        ..LightTree::default()
    };
    let mut open = vec![Open {
        range: 0..members.len(),
        depth: 0,
        trail: 0,
        slot: usize::MAX,
    }];
    while let Some(Open {
        range,
        depth,
        trail,
        slot,
    }) = open.pop()
    {
        let cluster = &mut members[range.clone()];
        let bounds = bounds(&places, cluster);
        let link = if slot != usize::MAX && is_leaf(&places, cluster) {
            let link = first + tree.lights.len();
            assert!(link < 1 << 28, "the light table fits its links");
            tree.add_leaf(emitters, cluster, link);
            for &member in cluster.iter().filter(|m| **m < triangles) {
                let Emitter {
                    light, placement, ..
                } = &emitters[member];
                tree.keys[member] = [
                    *placement,
                    light.triangle,
                    trail,
                    (bounds.power as f32).to_bits(),
                ];
            }
            layout::LIGHT_LEAF | ((cluster.len() - 1) as u32) << 28 | link as u32
        } else {
            let middle = range.start + split(&places, cluster, &bounds, depth < deep);
            let node = tree.nodes.len();
            tree.nodes.extend([[0; 4]; 4]);
            let child = |range, right: u32| Open {
                range,
                depth: depth + 1,
                trail: trail | right << depth,
                slot: node + 2 * right as usize,
            };
            open.extend([child(middle..range.end, 1), child(range.start..middle, 0)]);
            (node / 4) as u32
        };
        if slot != usize::MAX {
            let texels = texels(&places, &members[range], &bounds, link);
            tree.nodes[slot..slot + 2].copy_from_slice(&texels);
        }
    }
    tree
}

impl LightTree {
    fn add_leaf(&mut self, emitters: &[Emitter], cluster: &[usize], first: usize) {
        let weights: Vec<f64> = cluster.iter().map(|&m| emitters[m].power).collect();
        let total: f64 = weights.iter().sum();
        for ((&member, (keep, alias)), weight) in
            cluster.iter().zip(alias_table(&weights)).zip(&weights)
        {
            let light = emitters[member].light;
            self.lights.push(layout::Light {
                keep,
                alias: first as u32 + alias,
                choice: (weight / total) as f32,
                // so far the share of a unit area in all power
                emission_pdf: (f64::from(light.emission_pdf) / total) as f32,
                ..light
            });
        }
    }
}

/// Sorts a cluster into two and says how many are in the first: where a cut costs least, or half of them.
fn split(places: &[Place], cluster: &mut [usize], bounds: &Bounds, by_cost: bool) -> usize {
    let half = cluster.len() / 2;
    let centres = || cluster.iter().map(|&m| places[m].centre);
    let low = centres().fold(DVec3::INFINITY, DVec3::min);
    let extent = centres().fold(DVec3::NEG_INFINITY, DVec3::max) - low;
    let mut best: Option<(f64, usize, usize)> = None;
    if by_cost {
        for axis in 0..3 {
            if let Some((cost, bin)) = best_bin(places, cluster, axis, low[axis], extent[axis]) {
                // Long clusters are cut across their length.
                let long = bounds.high - bounds.low;
                let cost = cost * long.max_element() / long[axis].max(1e-3 * long.max_element());
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, bin));
                }
            }
        }
    }
    if let Some((_, axis, bin)) = best {
        let is_left = |&m: &usize| bin_of(places[m].centre[axis], low[axis], extent[axis]) <= bin;
        cluster.sort_by_key(|m| !is_left(m));
        return cluster.iter().filter(|m| is_left(m)).count();
    }
    let axis = if extent.x >= extent.y.max(extent.z) {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    cluster.sort_by(|&a, &b| places[a].centre[axis].total_cmp(&places[b].centre[axis]));
    half
}

fn bin_of(x: f64, low: f64, extent: f64) -> usize {
    (((x - low) / extent * BINS as f64) as usize).min(BINS - 1)
}

/// The last bin of the left part where a cut across the axis costs least.
fn best_bin(
    places: &[Place],
    cluster: &[usize],
    axis: usize,
    low: f64,
    extent: f64,
) -> Option<(f64, usize)> {
    if extent <= 0.0 {
        return None;
    }
    let mut bins = [None::<Bounds>; BINS];
    for &m in cluster {
        let bin = &mut bins[bin_of(places[m].centre[axis], low, extent)];
        let own = Bounds::of(&places[m]);
        *bin = Some(bin.map_or(own, |b| b.union(own)));
    }
    let sum = |part: &[Option<Bounds>]| part.iter().flatten().copied().reduce(Bounds::union);
    (0..BINS - 1)
        .filter_map(|i| {
            let (left, right) = (sum(&bins[..=i])?, sum(&bins[i + 1..])?);
            Some((left.cost() + right.cost(), i))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
}

/// What a parent knows of a child: a sphere, a cone, the intensity, and where it goes on.
fn texels(places: &[Place], members: &[usize], bounds: &Bounds, link: u32) -> [[u32; 4]; 2] {
    let centre = (0.5 * (bounds.low + bounds.high)).as_vec3();
    let radius = members
        .iter()
        .flat_map(|&m| places[m].corners)
        .map(|p| p.distance(centre.as_dvec3()))
        .fold(0.0, f64::max);
    let radius =
        (radius * (1.0 + ROUNDING) + ROUNDING * f64::from(centre.abs().max_element())) as f32;
    let (axis, cos) = match bounds.cone {
        None => (DVec3::Z, -1.0),
        Some(cone) => (cone.axis, (cone.cos - AXIS_ROUNDING).max(-1.0)),
    };
    let [x, y, z] = centre.to_array().map(f32::to_bits);
    let sine = (1.0 - cos * cos).sqrt();
    [
        [x, y, z, up(radius) | (sine * 65535.0).round() as u32],
        [
            snorms(axis.x, axis.y),
            snorms(axis.z, cos),
            (bounds.intensity() as f32).to_bits(),
            link,
        ],
    ]
}

/// Two numbers in 16 bits each, as `packSnorm2x16` would.
fn snorms(low: f64, high: f64) -> u32 {
    let pack = |x: f64| u32::from((x * 32767.0).round() as i16 as u16);
    pack(low) | pack(high) << 16
}

/// Bits of a float that is not negative, rounded up to one whose lower 16 bits are 0.
fn up(x: f32) -> u32 {
    x.to_bits().saturating_add(0xFFFF) & 0xFFFF_0000
}
