//! Punctual lights (KHR_lights_punctual), in world space.

use glam::{DVec3, Vec3};

/// Shape of a punctual light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Radiates `intensity` cd to all sides.
    Point,
    /// A point that radiates within a cone.
    Spot {
        /// Cosine of the angle up to which the light is full.
        cos_inner: f32,
        /// Cosine of the angle from which it is dark; not negative.
        cos_outer: f32,
    },
    /// Parallel light; `intensity` is the illuminance in lx on a surface that faces it.
    Directional,
}

/// A light without extent.
#[derive(Clone, Debug)]
pub struct PunctualLight {
    /// Name in the file, or `light N`.
    pub name: String,
    /// What it is.
    pub kind: LightKind,
    /// Where it is, metres.
    pub position: DVec3,
    /// Where it shines to, unit length (spot and directional).
    pub direction: Vec3,
    /// Colour × intensity per channel: cd, or lx when directional.
    pub intensity: Vec3,
}
