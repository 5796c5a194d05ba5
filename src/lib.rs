//! etendue: a physically based path tracer on Vulkan. glTF in, radiometrically
//! right OpenEXR out.

pub mod bvh;
pub mod chart;
pub mod checkpoint;
pub mod compare;
pub mod error;
#[doc(hidden)]
pub mod fault;
pub mod film;
pub mod gpu;
mod guide;
pub mod image_io;
pub mod layout;
mod mutant;
pub mod render;
pub mod scene;
pub mod selftest;
pub mod settings;
pub mod spec;
#[doc(hidden)]
pub mod spirv;
mod store;
pub mod tails;
#[cfg(feature = "wgpu")]
mod wgpu;

pub use error::{Error, Result};

/// Which sources this is built of: files of other builds may differ in some bits.
pub const BUILD: &str = env!("ETENDUE_BUILD");
