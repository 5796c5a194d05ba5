//! The glTF loader: exact arrays from good files, refusals with a reason from
//! broken ones, and nothing opened outside the scene's folder. All files are
//! built here.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "the lint's exception for tests does not reach their helpers; figures are printed"
)]

#[path = "loader/broken.rs"]
mod broken;
#[path = "loader/broken_shading.rs"]
mod broken_shading;
#[path = "loader/builder.rs"]
mod builder;
#[path = "loader/geometry.rs"]
mod geometry;
#[path = "loader/hostile.rs"]
mod hostile;
#[path = "loader/media.rs"]
mod media;
#[path = "loader/shading.rs"]
mod shading;
#[path = "loader/world.rs"]
mod world;
