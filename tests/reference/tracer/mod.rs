//! The second opinion: a slow path tracer in double precision, written from the
//! equations. It shares nothing with the renderer but the plain data of
//! `etendue::scene`: other random numbers, other intersection, other sampling of
//! microfacets, and none of the techniques that make renderers fast and hard to
//! trust. Light is found only by walking into it: no next event estimation, no
//! multiple importance sampling, no roulette, no depth limit.
//!
//! Each colour channel is traced on its own as monochromatic light. Losses are
//! analogue: whatever takes the fraction a of the light ends the path with
//! probability a, as a photon would end. Radiance over the square of the
//! index of refraction is carried, so interfaces have no factor of their own.
//!
//! Not supported, and refused: textures, vertex colours, punctual lights (a path
//! never meets a point; use a small emissive sphere).
#![allow(
    dead_code,
    reason = "several test programs share this folder, none uses all"
)]

pub mod camera;
pub mod dielectric;
pub mod geometry;
pub mod medium;
pub mod microfacet;
pub mod path;
pub mod rng;
pub mod sky;
pub mod solids;
pub mod surface;

pub use path::{Picture, Plan, picture};
