//! The one root of everything on the GPU: instance, device, queue, allocator.

use std::ffi::CString;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::{khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationSizes, AllocatorDebugSettings};

use super::caps::{BUILD_EXTENSIONS, Caps, DeviceKind};
use super::failed;
use super::instance::{Instance, ValidationLog};
use super::kept::Kept;
use crate::error::{Error, Result};

/// Memory is taken from the driver in blocks of this size; what is larger gets a
/// block of its own. Small enough to leave shared GPUs room, large enough that
/// a scene stays far below the limit on the number of blocks (4096 at least).
const DEVICE_BLOCK_BYTES: u64 = 64 << 20;
const HOST_BLOCK_BYTES: u64 = 32 << 20;

/// Which device to open and what it must be able to do.
#[derive(Clone, Copy, Debug, Default)]
pub struct DeviceRequest<'a> {
    /// Index in [`enumerate`]'s list or part of the name, in any case; `None`
    /// is the fastest kind that can do what is asked.
    pub select: Option<&'a str>,
    /// Runs the Khronos validation layer with synchronisation validation.
    pub validation: bool,
    /// Enables acceleration structures and ray query.
    pub ray_query: bool,
    /// Enables acceleration structures and ray tracing pipelines.
    pub ray_pipeline: bool,
}

impl DeviceRequest<'_> {
    fn needs_acceleration(&self) -> bool {
        self.ray_query || self.ray_pipeline
    }
}

/// The devices of this machine in the loader's order. Fails with
/// [`Error::Unsupported`] where there is no loader, no driver or no device.
pub fn enumerate() -> Result<Vec<Caps>> {
    let instance = Instance::new(false)?;
    Ok(query_all(&instance)?
        .into_iter()
        .map(|(_, caps)| caps)
        .collect())
}

fn query_all(instance: &Instance) -> Result<Vec<(vk::PhysicalDevice, Caps)>> {
    let devices = instance.physical_devices()?;
    (0..)
        .zip(devices)
        .map(|(index, physical)| Ok((physical, Caps::query(instance, physical, index)?)))
        .collect()
}

/// An open device. Everything made from it holds it, so it goes last.
pub struct Device {
    // Fields are dropped in this order, and it matters: the allocator frees its
    // blocks through the device; the device (in `root`) is destroyed before the
    // instance, which it holds. Nothing is in flight by then: `run` has waited.
    allocator: Mutex<Allocator>,
    pub(super) acceleration: Option<khr::acceleration_structure::Device>,
    ray_pipelines: Option<khr::ray_tracing_pipeline::Device>,
    names: Option<ash::ext::debug_utils::Device>,
    queue: Mutex<vk::Queue>,
    pub(super) kept: Kept,
    caps: Caps,
    physical: vk::PhysicalDevice,
    root: Root,
}

/// The raw device and, dropped after it, its instance.
struct Root {
    raw: ash::Device,
    instance: Instance,
}

impl Drop for Root {
    fn drop(&mut self) {
        // SAFETY: all objects of the device held it and are gone. Waiting fails
        // only on a lost device, whose objects may be destroyed all the same.
        unsafe {
            let _ = self.raw.device_wait_idle();
            self.raw.destroy_device(None);
        }
    }
}

impl Device {
    /// Opens a device. Fails with [`Error::Unsupported`] where none was found,
    /// where the selection fits none, or where something that was asked for is missing.
    pub fn open(request: &DeviceRequest<'_>) -> Result<Arc<Self>> {
        let instance = Instance::new(request.validation)?;
        let (physical, caps) = choose(query_all(&instance)?, request)?;
        let raw = create(&instance, physical, &caps, request)?;
        let root = Root { raw, instance };
        let Root { raw, instance } = &root;

        // SAFETY: the family was enabled with one queue at creation.
        let queue = unsafe { raw.get_device_queue(caps.queue_family, 0) };
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: physical,
            debug_settings: AllocatorDebugSettings::default(),
            buffer_device_address: caps.addresses || request.needs_acceleration(),
            allocation_sizes: AllocationSizes::new(DEVICE_BLOCK_BYTES, HOST_BLOCK_BYTES),
        })
        .map_err(|error| Error::Unsupported {
            what: format!("memory of {}", caps.name),
            missing: error.to_string(),
        })?;
        tracing::info!(device = caps.name, driver = caps.driver, "device opened");
        Ok(Arc::new(Self {
            allocator: Mutex::new(allocator),
            acceleration: request
                .needs_acceleration()
                .then(|| khr::acceleration_structure::Device::new(&instance.raw, raw)),
            ray_pipelines: request
                .ray_pipeline
                .then(|| khr::ray_tracing_pipeline::Device::new(&instance.raw, raw)),
            names: instance
                .debug_utils
                .then(|| ash::ext::debug_utils::Device::new(&instance.raw, raw)),
            queue: Mutex::new(queue),
            kept: Kept::default(),
            caps,
            physical,
            root,
        }))
    }

    /// What this device can do.
    pub fn caps(&self) -> &Caps {
        &self.caps
    }

    /// Bytes of this device's memory that buffers have, and bytes that were taken from the
    /// driver for them.
    pub fn memory(&self) -> (u64, u64) {
        let report = self.allocator().generate_report();
        (report.total_allocated_bytes, report.total_capacity_bytes)
    }

    /// Bytes that may still be taken from the device's own memory, where the driver tells;
    /// else how large it is.
    pub fn free_memory(&self) -> u64 {
        let is_told = self.caps.memory_budget;
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut properties = vk::PhysicalDeviceMemoryProperties2::default();
        if is_told {
            properties = properties.push_next(&mut budget);
        }
        let instance = &self.root.instance.raw;
        // SAFETY: the device is of this instance and has the extension of what is chained.
        unsafe { instance.get_physical_device_memory_properties2(self.physical, &mut properties) };
        let heaps = properties.memory_properties;
        (0..)
            .zip(heaps.memory_heaps_as_slice())
            .filter(|(_, heap)| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
            .map(|(index, heap): (usize, _)| {
                if is_told {
                    budget.heap_budget[index].saturating_sub(budget.heap_usage[index])
                } else {
                    heap.size
                }
            })
            .max()
            .unwrap_or(0)
    }

    /// Every error and warning of the validation layer so far; empty without validation.
    pub fn validation_messages(&self) -> Vec<String> {
        self.root.instance.log.messages()
    }

    /// The same list as an object that outlives the device.
    pub fn validation_log(&self) -> Arc<ValidationLog> {
        Arc::clone(&self.root.instance.log)
    }

    /// From here on each pipeline is compiled once and kept, and with it this device, until
    /// [`Self::forget_pipelines`].
    pub fn keep_pipelines(&self) {
        self.kept.begin();
    }

    /// Lets go of the pipelines that were kept.
    pub fn forget_pipelines(&self) {
        self.kept.end();
    }

    pub(super) fn raw(&self) -> &ash::Device {
        &self.root.raw
    }

    /// The functions of VK_KHR_acceleration_structure, or why there are none.
    pub(super) fn acceleration(&self) -> Result<&khr::acceleration_structure::Device> {
        self.acceleration
            .as_ref()
            .ok_or_else(|| Error::Unsupported {
                what: String::from("acceleration structures"),
                missing: format!("{} was opened without ray tracing", self.caps.name),
            })
    }

    /// The functions of VK_KHR_ray_tracing_pipeline, or why there are none.
    pub(super) fn ray_pipelines(&self) -> Result<&khr::ray_tracing_pipeline::Device> {
        self.ray_pipelines
            .as_ref()
            .ok_or_else(|| Error::Unsupported {
                what: String::from("ray tracing pipelines"),
                missing: format!("{} was opened without them", self.caps.name),
            })
    }

    /// The queue, and with it the right to let the GPU or the host touch memory.
    pub(super) fn exclusive(&self) -> MutexGuard<'_, vk::Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn allocator(&self) -> MutexGuard<'_, Allocator> {
        self.allocator
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Names an object for debuggers and validation messages.
    pub(super) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        let Some(names) = &self.names else { return };
        // A name with an inner NUL is not worth an error.
        let Ok(name) = CString::new(name) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default()
            .object_handle(handle)
            .object_name(&name);
        // SAFETY: the handle belongs to this device and is not used elsewhere meanwhile: its
        // owner has just made it. A failure (no host memory) costs the name only.
        let _ = unsafe { names.set_debug_utils_object_name(&info) };
    }
}

/// What keeps a device from serving the request, if anything does.
fn obstacle(caps: &Caps, request: &DeviceRequest<'_>) -> Option<String> {
    let mut needed = vec![&caps.compute];
    if request.ray_query {
        needed.push(&caps.ray_query);
    }
    if request.ray_pipeline {
        needed.push(&caps.ray_pipeline);
    }
    needed.into_iter().find_map(|able| able.clone().err())
}

fn choose(
    devices: Vec<(vk::PhysicalDevice, Caps)>,
    request: &DeviceRequest<'_>,
) -> Result<(vk::PhysicalDevice, Caps)> {
    let what = if request.ray_query {
        "a device with ray query"
    } else if request.ray_pipeline {
        "a device with ray tracing pipelines"
    } else {
        "a device"
    };
    let listing = devices
        .iter()
        .map(|(_, caps)| match obstacle(caps, request) {
            Some(missing) => format!("{} \"{}\" lacks {missing}", caps.index, caps.name),
            None => format!("{} \"{}\"", caps.index, caps.name),
        })
        .collect::<Vec<_>>()
        .join("; ");
    if let Some(select) = request.select {
        let (physical, caps) = find(devices, select).ok_or_else(|| Error::Unsupported {
            what: format!("device \"{select}\""),
            missing: format!("there is none of this index or name; there are: {listing}"),
        })?;
        return match obstacle(&caps, request) {
            None => Ok((physical, caps)),
            Some(missing) => Err(Error::Unsupported {
                what: format!("{what}: \"{}\" lacks", caps.name),
                missing,
            }),
        };
    }
    devices
        .into_iter()
        .filter(|(_, caps)| obstacle(caps, request).is_none())
        .min_by_key(|(_, caps)| match caps.kind {
            DeviceKind::Discrete => 0,
            DeviceKind::Integrated => 1,
            DeviceKind::Virtual => 2,
            DeviceKind::Other => 3,
            DeviceKind::Cpu => 4,
        })
        .ok_or_else(|| Error::Unsupported {
            what: String::from(what),
            missing: format!("none here can do it: {listing}"),
        })
}

/// The device of this index; of a text that is no number, the first one whose name contains it.
fn find(
    mut devices: Vec<(vk::PhysicalDevice, Caps)>,
    select: &str,
) -> Option<(vk::PhysicalDevice, Caps)> {
    let lower = select.to_lowercase();
    let index: Option<usize> = select.parse().ok();
    let is_meant = |caps: &Caps| match index {
        // the names of drivers have numbers in them, too
        Some(index) => caps.index == index,
        None => caps.name.to_lowercase().contains(&lower),
    };
    let position = devices.iter().position(|(_, caps)| is_meant(caps))?;
    Some(devices.swap_remove(position))
}

fn create(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    caps: &Caps,
    request: &DeviceRequest<'_>,
) -> Result<ash::Device> {
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(caps.queue_family)
        .queue_priorities(&[1.0])];
    let mut extensions = Vec::new();
    if request.needs_acceleration() {
        extensions.extend(BUILD_EXTENSIONS.map(std::ffi::CStr::as_ptr));
    }
    let mut f12 = vk::PhysicalDeviceVulkan12Features::default()
        .scalar_block_layout(true)
        .buffer_device_address(caps.addresses || request.needs_acceleration());
    let f10 = vk::PhysicalDeviceFeatures::default().shader_int64(caps.addresses);
    let mut f13 = vk::PhysicalDeviceVulkan13Features::default().maintenance4(true);
    let mut f_build =
        vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
    let mut f_query = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
    let mut f_pipeline =
        vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default().ray_tracing_pipeline(true);
    let mut info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_features(&f10)
        .push_next(&mut f12);
    if caps.maintenance4 {
        info = info.push_next(&mut f13);
    }
    if request.needs_acceleration() {
        info = info.push_next(&mut f_build);
    }
    if request.ray_query {
        extensions.push(khr::ray_query::NAME.as_ptr());
        info = info.push_next(&mut f_query);
    }
    if request.ray_pipeline {
        extensions.push(khr::ray_tracing_pipeline::NAME.as_ptr());
        info = info.push_next(&mut f_pipeline);
    }
    info = info.enabled_extension_names(&extensions);
    // SAFETY: `choose` has made sure that the device has all features and extensions asked for.
    unsafe { instance.raw.create_device(physical, &info, None) }
        .map_err(failed(format!("open device \"{}\"", caps.name)))
}
