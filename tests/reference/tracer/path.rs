//! The estimator: walk until the light ends or leaves, and add what was emitted on the way.
//!
//! [Kajiya86] Kajiya, The Rendering Equation.

use etendue::scene::{AlphaMode, Material, Projection, Scene};
use glam::{DVec3, Vec3};

use super::dielectric::{Interface, Way, solid, thin};
use super::geometry::{Geometry, Hit, NONE};
use super::medium::{Flight, deflect, fly};
use super::microfacet;
use super::rng::Rng;
use super::solids::{Inside, Solids};
use super::surface::{Opaque, normals, opaque, transmitting_share};
use super::{camera, sky};

/// Threads of a picture.
const THREADS: usize = 2;

/// Light that is trapped without loss walks for ever; after so many events it is
/// given up as dark, and counted in [`Picture::given_up`].
const PATIENCE: u32 = 20_000;

/// What to trace.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Width and height of the frame, pixels.
    pub side: u32,
    /// Samples of each pixel and channel.
    pub samples: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Channels that are traced: 1 for a scene without colours.
    pub channels: usize,
}

/// Means of a square frame, row by row from the top.
pub struct Picture {
    /// Mean radiance of each pixel, cd/m²; channels that were not traced are 0.
    pub mean: Vec<[f64; 3]>,
    /// Variance of that mean.
    pub variance: Vec<[f64; 3]>,
    /// Paths that were given up.
    pub given_up: u64,
}

/// Traces the first camera of the scene.
pub fn picture(scene: &Scene, plan: &Plan) -> Picture {
    let tracer = Tracer::new(scene);
    let pixels = (plan.side * plan.side) as usize;
    let mut results: Vec<(usize, Pixel)> = std::thread::scope(|scope| {
        let work: Vec<_> = (0..THREADS)
            .map(|thread| {
                let tracer = &tracer;
                scope.spawn(move || {
                    (thread..pixels)
                        .step_by(THREADS)
                        .map(|pixel| (pixel, tracer.pixel(plan, pixel)))
                        .collect::<Vec<_>>()
                })
            })
            .collect();
        work.into_iter()
            .flat_map(|handle| handle.join().expect("a thread panicked"))
            .collect()
    });
    results.sort_by_key(|(pixel, _)| *pixel);
    Picture {
        mean: results.iter().map(|(_, p)| p.mean).collect(),
        variance: results.iter().map(|(_, p)| p.variance).collect(),
        given_up: results.iter().map(|(_, p)| p.given_up).sum(),
    }
}

#[derive(Default)]
struct Pixel {
    mean: [f64; 3],
    variance: [f64; 3],
    given_up: u64,
}

/// A scene with what is derived from it.
pub struct Tracer<'a> {
    scene: &'a Scene,
    geometry: Geometry,
    solids: Solids,
}

/// Light on its way, backwards.
struct Walk {
    position: DVec3,
    direction: DVec3,
    /// Triangle that it starts on.
    from: usize,
    inside: Inside,
    /// Factor on what is found.
    weight: f64,
}

impl Walk {
    /// Goes on with a weight: below 1 it is the probability to go on at all.
    fn survives(&mut self, weight: f64, rng: &mut Rng) -> bool {
        self.weight *= weight.max(1.0);
        rng.happens(weight)
    }
}

impl<'a> Tracer<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        assert!(scene.lights.is_empty(), "paths never meet punctual lights");
        assert!(scene.meshes.iter().all(|mesh| mesh.colors.is_empty()));
        let textured = |m: &Material| m.textures().next().is_some();
        assert!(!scene.materials.iter().any(textured), "no textures");
        let geometry = Geometry::new(scene);
        let solids = Solids::new(scene, &geometry);
        Self {
            scene,
            geometry,
            solids,
        }
    }

    fn pixel(&self, plan: &Plan, pixel: usize) -> Pixel {
        let (x, y) = (pixel as u32 % plan.side, pixel as u32 / plan.side);
        let camera = &self.scene.cameras[0];
        // A pinhole is one point; parallel rays start at many.
        let pinhole = matches!(camera.projection, Projection::Perspective { .. })
            .then(|| self.around(camera.world_from_camera.translation));
        let mut result = Pixel::default();
        for channel in 0..plan.channels {
            let mut rng = Rng::new(&[plan.seed, pixel as u64, channel as u64]);
            let (mut mean, mut squares) = (0.0, 0.0);
            for n in 1..=plan.samples {
                let (position, direction) = camera::ray(camera, plan.side, x, y, &mut rng);
                let inside = pinhole.unwrap_or_else(|| self.around(position));
                let value = self.radiance(position, direction, inside, channel, &mut rng);
                let value = value.unwrap_or_else(|| {
                    result.given_up += 1;
                    0.0
                });
                // Welford's running mean and sum of squared deviations.
                let off = value - mean;
                mean += off / f64::from(n);
                squares += off * (value - mean);
            }
            let n = f64::from(plan.samples);
            result.mean[channel] = mean;
            result.variance[channel] = squares / (n * (n - 1.0).max(1.0));
        }
        result
    }

    /// The shells around a point.
    pub fn around(&self, p: DVec3) -> Inside {
        // Any direction will do; this one lies in no plane or edge of the scenes.
        let direction = DVec3::new(0.3141, 0.5926, 0.5358).normalize();
        self.solids.around(&self.geometry, p, direction)
    }

    /// One estimate of the radiance that arrives at `position` against `direction`, cd/m²;
    /// `None` when the path was given up.
    pub fn radiance(
        &self,
        position: DVec3,
        direction: DVec3,
        inside: Inside,
        channel: usize,
        rng: &mut Rng,
    ) -> Option<f64> {
        let mut walk = Walk {
            position,
            direction,
            from: NONE,
            inside,
            weight: 1.0,
        };
        // L/n² is what interfaces preserve.
        let squared_index = |inside| self.solids.index(self.scene, inside).powi(2);
        let at_camera = squared_index(inside);
        let mut sum = 0.0;
        for _ in 0..PATIENCE {
            let hit = self
                .geometry
                .closest(walk.position, walk.direction, walk.from);
            let distance = hit.map_or(f64::INFINITY, |hit| hit.t);
            let medium = self.solids.medium(self.scene, walk.inside);
            match fly(medium, channel, distance, rng) {
                Flight::Absorbed => return Some(sum),
                Flight::Scattered(way) => {
                    let phase = medium.expect("something scattered").phase;
                    walk.position += way * walk.direction;
                    walk.direction = deflect(phase, walk.direction, rng);
                    walk.from = NONE;
                    continue;
                }
                Flight::Passed => {}
            }
            let scale = walk.weight * at_camera / squared_index(walk.inside);
            let Some(hit) = hit else {
                let sky = self.scene.environment.as_ref();
                return Some(sum + scale * sky::radiance(sky, walk.direction, channel));
            };
            let (emitted, goes_on) = self.surface(&mut walk, &hit, channel, rng);
            sum += scale * emitted;
            if !goes_on {
                return Some(sum);
            }
        }
        None
    }

    /// Meets a surface: the radiance that it emits towards the walker, and whether the walk goes on.
    fn surface(&self, walk: &mut Walk, hit: &Hit, channel: usize, rng: &mut Rng) -> (f64, bool) {
        let triangle = &self.geometry.triangles[hit.triangle];
        let mesh = &self.scene.meshes[self.scene.instances[triangle.instance].mesh as usize];
        let m = &self.scene.materials[mesh.material as usize];
        let wo = -walk.direction;
        let (ng, ns, is_front) = normals(triangle, hit, wo);
        walk.position = triangle.v0 + hit.bary[0] * triangle.e1 + hit.bary[1] * triangle.e2;
        walk.from = hit.triangle;

        // A boundary that does not change what fills the space is not there.
        let shell = self.solids.shell(triangle.instance);
        let beyond = shell.map(|shell| walk.inside.crossed(shell, is_front));
        if let Some(beyond) = beyond {
            if self.solids.filling(beyond) == self.solids.filling(walk.inside) {
                walk.inside = beyond;
                return (0.0, true);
            }
        }
        if !covers(m, rng) {
            assert!(shell.is_none(), "a solid must not blend");
            return (0.0, true);
        }
        let emitted = emission(m, is_front)[channel];
        if m.unlit {
            return (f64::from(emitted), false);
        }
        let way = if rng.happens(transmitting_share(m)) {
            let interface = self.interface(m, walk.inside, beyond, channel);
            if beyond.is_some() {
                solid(wo, ns, ng, &interface, rng)
            } else {
                thin(wo, ns, ng, &interface, rng)
            }
        } else {
            opaque(wo, ns, ng, &Opaque::new(m, channel), rng).map(|(wi, weight)| Way {
                wi,
                weight,
                crosses: false,
            })
        };
        let Some(way) = way else {
            return (f64::from(emitted), false);
        };
        walk.direction = way.wi;
        if way.crosses {
            walk.inside = beyond.unwrap_or(walk.inside);
        }
        let goes_on = walk.survives(way.weight, rng);
        (f64::from(emitted), goes_on)
    }

    /// The interface that a material makes: of a solid between here and `beyond`, else of a sheet.
    fn interface(
        &self,
        m: &Material,
        here: Inside,
        beyond: Option<Inside>,
        channel: usize,
    ) -> Interface {
        let index = |inside| self.solids.index(self.scene, inside);
        let eta = match beyond {
            Some(beyond) => index(beyond) / index(here),
            None if m.ior == 0.0 => f64::INFINITY,
            None => f64::from(m.ior),
        };
        Interface {
            eta,
            alpha: microfacet::alpha(m.roughness),
            strength: f64::from(m.specular) * f64::from(m.specular_color[channel]),
            tint: f64::from(m.base_color[channel]),
        }
    }
}

/// Whether light meets the surface at all.
fn covers(m: &Material, rng: &mut Rng) -> bool {
    match m.alpha_mode {
        AlphaMode::Opaque => true,
        AlphaMode::Mask { cutoff } => m.base_color.w >= cutoff,
        AlphaMode::Blend => rng.happens(f64::from(m.base_color.w)),
    }
}

/// Emitted radiance towards one side, cd/m².
fn emission(m: &Material, is_front: bool) -> Vec3 {
    if m.unlit {
        m.base_color.truncate()
    } else if is_front || m.double_sided {
        m.emission
    } else {
        Vec3::ZERO
    }
}
