//! Mistakes made on purpose, so that tests can show that validation sees them.
//! Nothing here is submitted: each fault is recorded (or made) and thrown away.

use std::sync::Arc;

use ash::vk;

use super::buffer::Buffer;
use super::commands::Commands;
use super::device::Device;
use super::failed;
use super::pipeline::{BindSet, Pipeline};
use crate::error::Result;

/// A copy that reads what a fill wrote, with no barrier between them. (Between
/// dispatches newer layers only look when a heuristic is switched on.)
pub fn missing_barrier(device: &Arc<Device>, source: &Buffer, target: &Buffer) -> Result<()> {
    let commands = Commands::begin(device, "fault: missing barrier")?;
    let region = vk::BufferCopy {
        src_offset: 0,
        dst_offset: 0,
        size: source.bytes().min(target.bytes()),
    };
    // SAFETY: never submitted; the fault is in the recording only.
    unsafe {
        let raw = device.raw();
        raw.cmd_fill_buffer(commands.raw(), source.raw(), 0, vk::WHOLE_SIZE, 0);
        raw.cmd_copy_buffer(commands.raw(), source.raw(), target.raw(), &[region]);
    }
    Ok(())
}

/// More work groups than the device runs.
pub fn too_many_groups(
    device: &Arc<Device>,
    pipeline: &Pipeline,
    set: &BindSet,
    push: &[u8],
) -> Result<()> {
    let commands = Commands::begin(device, "fault: too many groups")?;
    commands.bind(pipeline, set, push);
    let groups = device.caps().max_groups[1].saturating_add(1);
    // SAFETY: as above.
    unsafe { device.raw().cmd_dispatch(commands.raw(), 1, groups, 1) };
    Ok(())
}

/// A storage binding that points to a buffer made for something else.
pub fn wrong_usage(device: &Arc<Device>, set: &BindSet, binding: u32, buffer: &Buffer) {
    let buffers = [vk::DescriptorBufferInfo {
        buffer: buffer.raw(),
        offset: 0,
        range: vk::WHOLE_SIZE,
    }];
    let write = vk::WriteDescriptorSet::default()
        .dst_set(set.raw())
        .dst_binding(binding)
        .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
        .buffer_info(&buffers);
    // SAFETY: the handles are alive and the set is not in use; the usage is the fault.
    unsafe { device.raw().update_descriptor_sets(&[write], &[]) };
}

/// A copy that starts within the buffers and ends outside.
pub fn copy_past_end(device: &Arc<Device>, source: &Buffer, target: &Buffer) -> Result<()> {
    let commands = Commands::begin(device, "fault: copy past the end")?;
    let region = vk::BufferCopy {
        src_offset: 0,
        dst_offset: 0,
        size: source.bytes().max(target.bytes()) + 16,
    };
    // SAFETY: as above.
    unsafe {
        device
            .raw()
            .cmd_copy_buffer(commands.raw(), source.raw(), target.raw(), &[region]);
    }
    Ok(())
}

/// A buffer that nobody destroys; reported when the device goes.
pub fn leaked_buffer(device: &Arc<Device>) -> Result<()> {
    let info = vk::BufferCreateInfo::default()
        .size(16)
        .usage(vk::BufferUsageFlags::TRANSFER_SRC);
    // SAFETY: a valid description; forgetting the handle is the fault.
    let _forgotten = unsafe { device.raw().create_buffer(&info, None) }
        .map_err(failed("create a buffer to forget"))?;
    Ok(())
}
