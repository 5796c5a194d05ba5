//! Renders of the limit report: one pass by a kernel that studies it, and the rays of a pass.

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;

use super::traversal::GROUP;
use super::vulkan::{Input, RECORDS, texel};
use super::{Control, Renderer, Study};
use crate::error::{Error, Result};
use crate::gpu::{BindingKind, Buffer, Device, Memory, TexelFormat, Usage};
use crate::layout::{self, StreamRay};

/// What traversal did in a pass.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default)]
pub struct TraversalCounts {
    pub rays: u64,
    /// Nodes visited.
    pub nodes: u64,
    /// Leaf records read.
    pub records: u64,
    /// Steps that lanes made.
    pub steps: u64,
    /// Steps that all lanes of their subgroups had time for.
    pub lane_steps: u64,
    /// Rays of a replay that met something else than is recorded.
    pub different: u64,
}

/// One pass.
#[doc(hidden)]
#[derive(Clone, Debug)]
pub struct Studied {
    pub seconds: f64,
    /// Beside rays of a kernel that counts them.
    pub counts: TraversalCounts,
    /// The film's floats; of a replay whatever was there before.
    pub film: Vec<f32>,
}

/// The rays of a pass, those of each pixel in order, and what they met.
#[doc(hidden)]
#[derive(Clone, Debug)]
pub struct Stream {
    /// Where the rays of each pixel begin, tile by tile, and, one more, where all end.
    pub(super) starts: Vec<u32>,
    pub(super) rays: Vec<StreamRay>,
}

impl Stream {
    /// With room for so many rays of each pixel.
    pub(super) fn with_room(counts: &[u32]) -> Result<Self> {
        let mut starts = vec![0];
        let mut end = 0u32;
        for &count in counts {
            end = end.checked_add(count).ok_or_else(|| Error::Unsupported {
                what: String::from("a recording of 2^32 rays"),
                missing: String::from("they are counted in 32 bits"),
            })?;
            starts.push(end);
        }
        Ok(Self {
            starts,
            rays: vec![StreamRay::default(); end as usize],
        })
    }

    /// How many rays they are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// How many of them met something.
    #[must_use]
    pub fn rays_met(&self) -> usize {
        let met = self.rays.iter().filter(|ray| ray.primitive != layout::NONE);
        met.count()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// The same rays, neighbours alike: in the order of their kind, the octant of their direction, their origin and direction
    /// along Morton curves. Pixels get equal numbers, such that those of a work group trace neighbours in each step.
    #[must_use]
    pub fn sorted(&self) -> Self {
        let origins = self.rays.iter().map(|ray| Vec3::from(ray.origin));
        let low = origins.clone().fold(Vec3::INFINITY, Vec3::min);
        let high = origins.fold(Vec3::NEG_INFINITY, Vec3::max);
        let extent = (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
        let key = |ray: &StreamRay| {
            let is_shadow = ray.flags & layout::STREAM_IS_SHADOW != 0;
            let direction = Vec3::from(ray.direction);
            let octant = u64::from(direction.is_negative_bitmask());
            let place = morton((Vec3::from(ray.origin) - low) / extent);
            u64::from(is_shadow) << 63 | octant << 60 | place << 30 | morton(direction.abs())
        };
        let mut order: Vec<(u64, &StreamRay)> = self.rays.iter().map(|r| (key(r), r)).collect();
        order.sort_by_key(|(key, _)| *key);

        let pixels = self.starts.len() - 1;
        let group = GROUP as usize;
        let each = order.len().div_ceil(pixels.max(1)).max(1);
        let mut starts = vec![0];
        let mut rays = Vec::with_capacity(order.len());
        for pixel in 0..pixels {
            let first = pixel / group * group * each + pixel % group;
            let places = (0..each).map(|step| first + step * group);
            rays.extend(
                places
                    .map_while(|at| order.get(at))
                    .map(|(_, ray)| StreamRay {
                        flags: ray.flags & layout::STREAM_IS_SHADOW,
                        ..**ray
                    }),
            );
            starts.push(rays.len() as u32);
        }
        Self { starts, rays }
    }
}

/// What kernels bind that record, recall or replay rays, with `usage` besides where they read.
pub(super) fn inputs(
    device: &Arc<Device>,
    stream: &Stream,
    study: Study,
    usage: Usage,
) -> Result<[Input; 3]> {
    let array = match usage == Usage::ADDRESS {
        true => BindingKind::Address,
        false => BindingKind::Texel,
    };
    let kind = match study {
        Study::Record => BindingKind::Storage,
        _ => array,
    };
    let rays = texel(
        device,
        "rays",
        RECORDS,
        &stream.rays,
        usage | Usage::STORAGE,
    )?;
    let word = TexelFormat::R32Uint;
    let starts = texel(device, "starts of rays", word, &stream.starts, usage)?;
    let bytes = 4 * stream.starts.len() as u64;
    let counts = Buffer::new(
        device,
        "counts of rays",
        bytes,
        Usage::STORAGE,
        Memory::DeviceLocal,
    )?;
    Ok([
        (layout::BIND_STREAM, kind, rays),
        (layout::BIND_STREAM_STARTS, array, starts),
        (layout::BIND_STREAM_COUNTS, BindingKind::Storage, counts),
    ])
}

/// Place of a point of the unit cube along a Morton curve through cells of 2⁻¹⁰.
fn morton(point: Vec3) -> u64 {
    let spread = |x: f32| {
        let cell = (x * 1024.0) as u64;
        (0..10).fold(0, |bits, k| bits | (cell.min(1023) >> k & 1) << (3 * k))
    };
    spread(point.x) | spread(point.y) << 1 | spread(point.z) << 2
}

impl Renderer {
    /// Renders the first 2^`level` samples in one pass.
    ///
    /// # Errors
    /// The device fails.
    #[doc(hidden)]
    pub fn study(&mut self, level: u32) -> Result<Studied> {
        self.backend.reset_ledger()?;
        let start = Instant::now();
        let film = self.pass(0, level, &mut |_| Control::Continue)?;
        Ok(Studied {
            seconds: start.elapsed().as_secs_f64(),
            counts: self.backend.traversal_counts()?,
            film: film.unwrap_or_default(),
        })
    }

    /// The rays of such a pass, where [`super::Tuning::study`] is [`super::Study::Record`].
    ///
    /// # Errors
    /// More rays than a buffer of the device holds; the device fails.
    #[doc(hidden)]
    pub fn record(&mut self, level: u32) -> Result<Stream> {
        let pixels = self.backend.frame().tiles() * layout::TILE * layout::TILE;
        self.backend
            .hold(&Stream::with_room(&vec![0; pixels as usize])?)?;
        self.study(level)?;
        let mut stream = Stream::with_room(&self.backend.recorded_counts()?)?;
        self.backend.hold(&stream)?;
        self.study(level)?;
        stream.rays = self.backend.recorded_rays(stream.len())?;
        Ok(stream)
    }

    /// Gives the kernel that recalls or replays a pass its rays.
    ///
    /// # Errors
    /// More rays than a buffer of the device holds; the device fails.
    #[doc(hidden)]
    pub fn hold(&mut self, stream: &Stream) -> Result<()> {
        self.backend.hold(stream)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays that are told apart by their `from`, every third one a shadow ray.
    fn stream(counts: &[u32]) -> Stream {
        let mut stream = Stream::with_room(counts).unwrap();
        for (k, ray) in (0u32..).zip(&mut stream.rays) {
            let x = (k * 7919 % 101) as f32 / 101.0;
            ray.from = k;
            ray.origin = [x, 1.0 - x, x * x];
            ray.direction = [x - 0.5, 0.25 - x, 0.1];
            ray.flags = layout::STREAM_IS_FIRST;
            if k % 3 == 0 {
                ray.flags |= layout::STREAM_IS_SHADOW;
            }
        }
        stream
    }

    #[test]
    fn sorting_loses_no_ray_and_keeps_kinds_together() {
        let before = stream(&[[200, 0, 317, 1]; 32].concat());
        let after = before.sorted();
        assert_eq!(after.starts.len(), before.starts.len());
        assert_eq!(after.starts.last().map(|n| *n as usize), Some(before.len()));
        let mut names: Vec<u32> = after.rays.iter().map(|r| r.from).collect();
        names.sort_unstable();
        assert!(names.iter().copied().eq(0..before.len() as u32));
        // each pixel's rays are in the order of the curve, plain ones before shadow rays
        for range in after.starts.windows(2) {
            let own = &after.rays[range[0] as usize..range[1] as usize];
            assert!(own.is_sorted_by_key(|r| r.flags), "flags out of order");
            assert!(
                own.len().abs_diff(130) <= 2,
                "{} rays of a pixel",
                own.len()
            );
        }
    }

    #[test]
    fn neighbours_on_the_curve_share_their_leading_bits() {
        assert_eq!(morton(Vec3::ZERO), 0);
        assert_eq!(morton(Vec3::ONE), (1 << 30) - 1);
        assert_eq!(morton(Vec3::new(0.5, 0.0, 0.0)), 1 << 27);
        assert_eq!(morton(Vec3::new(0.0, 1.0 / 1024.0, 0.5)), 2 | 4 << 27);
    }
}
