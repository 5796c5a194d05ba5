//! Random numbers: xoshiro256++ seeded by splitmix64.
//!
//! [Blackman21] Blackman, Vigna, Scrambled Linear Pseudorandom Number Generators.

use std::f64::consts::TAU;

use glam::DVec3;

/// A stream of random numbers.
pub struct Rng {
    state: [u64; 4],
}

impl Rng {
    /// The stream that belongs to a list of keys, such as seed, pixel and channel.
    pub fn new(keys: &[u64]) -> Self {
        let mut x = 0x243f_6a88_85a3_08d3_u64;
        let mut mixed = || {
            x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        };
        let mut state = [mixed(), mixed(), mixed(), mixed()];
        for key in keys {
            // Keys enter one after the other and are stirred in between.
            state[0] ^= key.wrapping_mul(0xd134_2543_de82_ef95);
            let mut rng = Self { state };
            state = std::array::from_fn(|_| {
                (0..8).for_each(|_| {
                    rng.bits();
                });
                rng.bits()
            });
        }
        Self { state }
    }

    /// 64 random bits. [Blackman21]
    fn bits(&mut self) -> u64 {
        let s = &mut self.state;
        let result = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        result
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// True with probability `p`.
    pub fn happens(&mut self, p: f64) -> bool {
        self.uniform() < p
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.uniform() - 1.0;
        around(DVec3::Z, z, TAU * self.uniform())
    }

    /// Density cosθ/π about +Z: the unit sphere moved up by one, seen from the origin.
    pub fn cosine(&mut self) -> DVec3 {
        (self.direction() + DVec3::Z).normalize_or(DVec3::Z)
    }
}

/// The unit vector at angle arccos `cosine` to the unit vector `axis`, turned by `phi`.
pub fn around(axis: DVec3, cosine: f64, phi: f64) -> DVec3 {
    let (x, y) = tangents(axis);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    x * (sine * phi.cos()) + y * (sine * phi.sin()) + axis * cosine
}

/// Two unit vectors that make a right-handed frame with the unit vector `z`.
pub fn tangents(z: DVec3) -> (DVec3, DVec3) {
    // Cross with the axis that is farthest from z.
    let a = z.abs();
    let axis = if a.x <= a.y && a.x <= a.z {
        DVec3::X
    } else if a.y <= a.z {
        DVec3::Y
    } else {
        DVec3::Z
    };
    let x = axis.cross(z).normalize();
    (x, z.cross(x))
}
