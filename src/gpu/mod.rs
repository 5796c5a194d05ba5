//! Vulkan, owned: devices, buffers, pipelines, acceleration structures.
//! Knows nothing of scenes or light; the renderer hands it plain data.
//!
//! The safety policy. This folder is the only one where `unsafe` is allowed;
//! every public function is safe. That rests on five rules:
//!
//! 1. **Work never outlives its call.** [`Device::run`] records, submits and
//!    waits. What a recording refers to is kept alive by the recording.
//! 2. **Wrap at once.** A raw handle goes into its owner before the next call
//!    that can fail. Owners hold the [`Device`] and what they were made from.
//! 3. **One user at a time.** A submission, and every host access to mapped
//!    memory, holds the device's queue lock; so neither races with the other.
//! 4. **Sizes, kinds and limits are checked here.** A limit that depends on the
//!    user's data is an `Err` that states the figure; a wrong argument of a caller
//!    (a missing binding, a range past the end) is a panic that says which.
//! 5. **Shaders are trusted.** The SPIR-V given to [`Pipeline`] is
//!    compiled by this crate's build script; that it stays within its buffers is
//!    proved by tests and validation, not by this module. What it reads or writes
//!    by an address is held by its bind set, which keeps it alive.
//!
//! Beside Vulkan, [`widen_vectors`] changes the environment, while the process has a single thread.
#![allow(
    unsafe_code,
    reason = "Vulkan is a C interface; the five rules above keep it inside this folder"
)]

mod accel;
mod buffer;
mod caps;
mod commands;
mod device;
#[doc(hidden)]
pub mod faults;
mod instance;
mod kept;
#[cfg(feature = "wgpu")]
pub(crate) mod passthrough;
mod pipeline;
mod processor;
mod rays;
#[cfg(feature = "faults")]
#[doc(hidden)]
pub mod shim;
mod usage;

pub use accel::{Blas, BlasGeometry, Tlas, TlasInstance};
pub use buffer::{Buffer, Memory};
pub use caps::{Caps, DeviceKind};
pub use commands::{Commands, GpuTime};
pub use device::{Device, DeviceRequest, enumerate};
pub use instance::ValidationLog;
pub use pipeline::{BindSet, BindingKind, Pipeline, PipelineDesc, Resource};
pub use processor::{gathers_fast, widen_vectors};
pub use rays::RayStages;
pub use usage::{TexelFormat, Usage};

/// Turns Vulkan's code into the library's error; `op` says what was attempted.
fn failed(op: impl Into<String>) -> impl FnOnce(ash::vk::Result) -> crate::Error {
    move |result| match result {
        ash::vk::Result::ERROR_DEVICE_LOST => crate::Error::DeviceLost { pass: op.into() },
        result => crate::Error::Vulkan {
            op: op.into(),
            result,
        },
    }
}
