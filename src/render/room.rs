//! How much memory of a device a render takes, known before it takes it.

use super::report::Memory;
use super::upload::SceneData;
use crate::bvh::Bvh;
use crate::error::{Error, Result};
use crate::gpu::Device;

/// What a render will take, with a film of so many bytes. Without our tree the
/// device's own acceleration structures come on top.
pub(super) fn estimate(data: &SceneData, bvh: Option<&Bvh>, film: u64) -> Memory {
    Memory {
        geometry: data.geometry.bytes(),
        acceleration: bvh.map_or(0, Bvh::bytes),
        textures: data.texture_bytes(),
        tables: data.table_bytes(),
        film,
    }
}

/// Refuses what the device has no room for, before anything is copied to it; `limit`
/// stands for what is free.
pub(super) fn check(device: &Device, needed: &Memory, limit: Option<u64>) -> Result<u64> {
    let free = limit.unwrap_or_else(|| device.free_memory());
    let bytes = needed.total();
    tracing::debug!(bytes, free, "device memory");
    if bytes > free {
        let device = &device.caps().name;
        let what = format!("the render on {device}, where {free} bytes are free,");
        return Err(Error::OutOfMemory { what, bytes });
    }
    Ok(free)
}
