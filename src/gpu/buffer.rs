//! Buffers: memory that shaders see. A [`Buffer`] is a cheap handle; the memory
//! is freed with the last one.

use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use gpu_allocator::{AllocationError, MemoryLocation};

use super::device::Device;
use super::failed;
use super::usage::Usage;
use crate::error::{Error, Result};

/// Copies between host and device-local memory go through a staging buffer of at
/// most this size: large enough to hide the cost of a submission (about 0.1 ms),
/// small enough not to double the memory of a scene.
pub(super) const STAGING_BYTES: usize = 16 << 20;

/// Sizes are rounded up to whole texels of the widest format; this also keeps
/// fills and push constants of four bytes in range.
const GRANULE: u64 = 16;

/// Where a buffer lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    /// Next to the GPU; the host copies through a staging buffer.
    DeviceLocal,
    /// Written by the host, read by the GPU.
    Upload,
    /// Written by the GPU, read by the host.
    Readback,
}

/// Memory on a device; clones share it.
#[derive(Clone)]
pub struct Buffer(Arc<Inner>);

struct Inner {
    device: Arc<Device>,
    name: String,
    raw: vk::Buffer,
    /// Made when it is first asked for: lavapipe compiles for each.
    view: Mutex<vk::BufferView>,
    allocation: Option<Allocation>,
    bytes: u64,
    usage: Usage,
    memory: Memory,
}

impl Drop for Inner {
    fn drop(&mut self) {
        // SAFETY: recordings hold their buffers and `run` has waited, so nothing uses them;
        // destroying a null handle does nothing. The view goes before its buffer.
        unsafe {
            let view = self.view.get_mut().unwrap_or_else(PoisonError::into_inner);
            self.device.raw().destroy_buffer_view(*view, None);
            self.device.raw().destroy_buffer(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            if let Err(error) = self.device.allocator().free(allocation) {
                tracing::error!(buffer = self.name, %error, "memory could not be freed");
            }
        }
    }
}

impl Buffer {
    /// A buffer with undefined contents, of `bytes` rounded up to a multiple of
    /// 16 (at least 16). Fails with [`Error::Unsupported`] where a limit of the device
    /// is exceeded and [`Error::OutOfMemory`] where memory is.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        bytes: u64,
        usage: Usage,
        memory: Memory,
    ) -> Result<Self> {
        let limit = limit(device, usage);
        let is_of_rays = usage.flags.intersects(
            vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR
                | vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR
                | vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR,
        );
        let has_address = usage.allows(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS);
        if is_of_rays || has_address && !device.caps().addresses {
            device.acceleration()?;
        }
        // Rounded without overflow: what does not fit 64 bits exceeds every limit.
        let bytes = bytes
            .max(1)
            .checked_next_multiple_of(GRANULE)
            .unwrap_or(u64::MAX);
        if bytes > limit.0 {
            return Err(Error::Unsupported {
                what: format!("buffer \"{name}\" of {bytes} bytes"),
                missing: format!(
                    "{} takes at most {} bytes for {}",
                    device.caps().name,
                    limit.0,
                    limit.1
                ),
            });
        }
        let info = vk::BufferCreateInfo::default()
            .size(bytes)
            .usage(
                usage.flags
                    | vk::BufferUsageFlags::TRANSFER_SRC
                    | vk::BufferUsageFlags::TRANSFER_DST,
            )
            .sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: the size is not 0 and within the device's limit.
        let raw = unsafe { device.raw().create_buffer(&info, None) }
            .map_err(|result| allocation_failed(name, bytes, result))?;
        let mut inner = Inner {
            device: Arc::clone(device),
            name: name.to_owned(),
            raw,
            view: Mutex::new(vk::BufferView::null()),
            allocation: None,
            bytes,
            usage,
            memory,
        };
        inner.allocate()?;
        device.set_name(raw, name);
        Ok(Self(Arc::new(inner)))
    }

    /// A device-local buffer with these contents, zeros up to a multiple of 16
    /// bytes behind them; an empty slice becomes 16 bytes of zeros.
    pub fn from_slice<T: Pod>(
        device: &Arc<Device>,
        name: &str,
        usage: Usage,
        data: &[T],
    ) -> Result<Self> {
        let data: &[u8] = bytemuck::cast_slice(data);
        let buffer = Self::new(device, name, data.len() as u64, usage, Memory::DeviceLocal)?;
        buffer.write(0, data)?;
        let padding = buffer.bytes() - data.len() as u64;
        if padding > 0 {
            let zeros = [0u8; GRANULE as usize];
            buffer.write(data.len() as u64, &zeros[..padding as usize])?;
        }
        Ok(buffer)
    }

    /// Size in bytes, rounding included.
    pub fn bytes(&self) -> u64 {
        self.0.bytes
    }

    /// Copies `data` to `offset` (bytes). Panics where it would leave the buffer.
    pub fn write<T: Pod>(&self, offset: u64, data: &[T]) -> Result<()> {
        let data: &[u8] = bytemuck::cast_slice(data);
        self.check_range(offset, data.len() as u64);
        if self.mapped().is_some() {
            self.copy_in(offset, data);
            return Ok(());
        }
        if data.is_empty() {
            return Ok(());
        }
        let staging = self.staging(data.len(), Memory::Upload)?;
        let mut at = offset;
        for chunk in data.chunks(STAGING_BYTES) {
            staging.copy_in(0, chunk);
            let bytes = chunk.len() as u64;
            self.0.device.run("upload", |commands| {
                commands.copy(&staging, 0, self, at, bytes);
            })?;
            at += bytes;
        }
        Ok(())
    }

    /// The first `count` elements. Panics where there are fewer.
    pub fn read<T: Pod>(&self, count: usize) -> Result<Vec<T>> {
        let mut data = vec![T::zeroed(); count];
        self.read_into(&mut data)?;
        Ok(data)
    }

    /// Fills `data` from the start of the buffer. Panics where the buffer is shorter.
    pub fn read_into<T: Pod>(&self, data: &mut [T]) -> Result<()> {
        let data: &mut [u8] = bytemuck::cast_slice_mut(data);
        self.check_range(0, data.len() as u64);
        if self.mapped().is_some() {
            self.copy_out(data);
            return Ok(());
        }
        if data.is_empty() {
            return Ok(());
        }
        let staging = self.staging(data.len(), Memory::Readback)?;
        let mut at = 0;
        for chunk in data.chunks_mut(STAGING_BYTES) {
            let bytes = chunk.len() as u64;
            self.0.device.run("read back", |commands| {
                commands.copy(self, at, &staging, 0, bytes);
            })?;
            staging.copy_out(chunk);
            at += bytes;
        }
        Ok(())
    }

    pub(super) fn raw(&self) -> vk::Buffer {
        self.0.raw
    }

    /// The view of a texel buffer; null of others.
    pub(super) fn view(&self) -> Result<vk::BufferView> {
        let mut view = self.0.view.lock().unwrap_or_else(PoisonError::into_inner);
        if *view == vk::BufferView::null() {
            *view = self.0.create_view()?;
        }
        Ok(*view)
    }

    pub(super) fn usage(&self) -> Usage {
        self.0.usage
    }

    pub(super) fn name(&self) -> &str {
        &self.0.name
    }

    pub(super) fn is_of(&self, device: &Arc<Device>) -> bool {
        Arc::ptr_eq(&self.0.device, device)
    }

    /// Where shaders find the buffer, if its usage has addresses.
    pub fn shader_address(&self) -> Option<u64> {
        let usage = self.0.usage;
        let has_address = usage.allows(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS);
        has_address.then(|| self.address())
    }

    /// Where shaders and builds find the buffer; only with a usage that has addresses.
    pub(super) fn address(&self) -> vk::DeviceAddress {
        assert!(
            self.0
                .usage
                .allows(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS),
            "buffer \"{}\" was made without an address",
            self.0.name
        );
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.0.raw);
        // SAFETY: the usage allows it, hence (checked in `new`) the device was opened with the feature.
        unsafe { self.0.device.raw().get_buffer_device_address(&info) }
    }

    pub(super) fn check_range(&self, offset: u64, bytes: u64) {
        assert!(
            offset
                .checked_add(bytes)
                .is_some_and(|end| end <= self.0.bytes),
            "{bytes} bytes at {offset} leave buffer \"{}\" of {} bytes",
            self.0.name,
            self.0.bytes
        );
    }

    fn staging(&self, bytes: usize, memory: Memory) -> Result<Self> {
        let bytes = bytes.min(STAGING_BYTES) as u64;
        Self::new(&self.0.device, "staging", bytes, Usage::TRANSFER, memory)
    }

    /// The host's view of an upload or read-back buffer. Device-local memory that
    /// happens to be mapped (CPU devices) is staged all the same: one path, tested everywhere.
    fn mapped(&self) -> Option<*mut u8> {
        if self.0.memory == Memory::DeviceLocal {
            return None;
        }
        let pointer = self.0.allocation.as_ref()?.mapped_ptr()?;
        Some(pointer.as_ptr().cast())
    }

    fn copy_in(&self, offset: u64, data: &[u8]) {
        self.check_range(offset, data.len() as u64);
        let target = self.mapped().expect("only host-visible buffers get here");
        let _alone = self.0.device.exclusive();
        // SAFETY: the range was checked, the memory is coherent and stays mapped while the
        // buffer lives, and under the lock neither GPU nor host touches it.
        unsafe {
            std::ptr::copy_nonoverlapping(data.as_ptr(), target.add(offset as usize), data.len());
        }
    }

    fn copy_out(&self, data: &mut [u8]) {
        self.check_range(0, data.len() as u64);
        let source = self.mapped().expect("only host-visible buffers get here");
        let _alone = self.0.device.exclusive();
        // SAFETY: as in `copy_in`; `run` has made the GPU's writes visible to the host.
        unsafe { std::ptr::copy_nonoverlapping(source, data.as_mut_ptr(), data.len()) };
    }
}

impl Inner {
    fn allocate(&mut self) -> Result<()> {
        let device = self.device.raw();
        // SAFETY: the buffer was made from this device.
        let requirements = unsafe { device.get_buffer_memory_requirements(self.raw) };
        let mut desc = AllocationCreateDesc {
            name: &self.name,
            requirements,
            location: match self.memory {
                Memory::DeviceLocal => MemoryLocation::GpuOnly,
                Memory::Upload => MemoryLocation::CpuToGpu,
                Memory::Readback => MemoryLocation::GpuToCpu,
            },
            linear: true,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let mut allocator = self.device.allocator();
        let allocation = allocator.allocate(&desc).or_else(|_| {
            // A whole block may not fit where this buffer alone still does.
            desc.allocation_scheme = AllocationScheme::DedicatedBuffer(self.raw);
            allocator.allocate(&desc)
        });
        drop(allocator);
        let allocation = self.allocation.insert(allocation.map_err(|error| {
            tracing::debug!(buffer = self.name, %error, "allocation failed");
            match error {
                AllocationError::NoCompatibleMemoryTypeFound => Error::Unsupported {
                    what: format!("buffer \"{}\"", self.name),
                    missing: format!("no memory type for {:?}", self.memory),
                },
                _ => out_of_memory(&self.name, self.bytes),
            }
        })?);
        if is_map_failure(allocation) {
            return Err(out_of_memory(&self.name, self.bytes));
        }
        // SAFETY: fresh buffer and memory of this device; offset and type follow the requirements.
        unsafe { device.bind_buffer_memory(self.raw, allocation.memory(), allocation.offset()) }
            .map_err(|result| allocation_failed(&self.name, self.bytes, result))
    }

    fn create_view(&self) -> Result<vk::BufferView> {
        let Some(format) = self.usage.texel else {
            return Ok(vk::BufferView::null());
        };
        let info = vk::BufferViewCreateInfo::default()
            .buffer(self.raw)
            .format(format.vulkan())
            .range(vk::WHOLE_SIZE);
        // SAFETY: the buffer has the usage and memory; its size is a multiple of the texel's and
        // within the limit. These three formats are mandatory for uniform texel buffers.
        unsafe { self.device.raw().create_buffer_view(&info, None) }
            .map_err(|result| allocation_failed(&self.name, self.bytes, result))
    }
}

/// The largest buffer for this usage, bytes, and which use limits it.
fn limit(device: &Device, usage: Usage) -> (u64, &'static str) {
    let caps = device.caps();
    let mut limit = (caps.max_buffer_bytes, "any buffer");
    let mut lower = |bytes: u64, of| {
        if bytes < limit.0 {
            limit = (bytes, of);
        }
    };
    // Scratch memory has the usage of a storage buffer but is never bound as one.
    if usage.allows(vk::BufferUsageFlags::STORAGE_BUFFER) && usage != Usage::SCRATCH {
        lower(caps.max_storage_range, "a storage buffer");
    }
    if usage.allows(vk::BufferUsageFlags::UNIFORM_BUFFER) {
        lower(caps.max_uniform_range, "a uniform buffer");
    }
    if let Some(format) = usage.texel {
        lower(
            caps.max_texel_elements.saturating_mul(format.bytes()),
            "a texel buffer of this format",
        );
    }
    limit
}

/// Whether the memory is none: lavapipe (Mesa 25.0) does not look at mmap's answer
/// and hands out MAP_FAILED, which is −1, as the start of a mapped block.
fn is_map_failure(allocation: &Allocation) -> bool {
    allocation.mapped_ptr().is_some_and(|pointer| {
        let block = (pointer.as_ptr() as usize).wrapping_sub(allocation.offset() as usize);
        block == usize::MAX
    })
}

fn out_of_memory(name: &str, bytes: u64) -> Error {
    Error::OutOfMemory {
        what: format!("buffer \"{name}\""),
        bytes,
    }
}

fn allocation_failed(name: &str, bytes: u64, result: vk::Result) -> Error {
    match result {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            out_of_memory(name, bytes)
        }
        result => failed(format!("create buffer \"{name}\""))(result),
    }
}
