//! Stands between this crate and the Vulkan loader, for tests of faults: each call that
//! can fail is counted, and the planned one fails without reaching the driver. Only
//! with the feature `faults`, and only in threads that have planned some.

use std::cell::RefCell;
use std::ffi::{CStr, c_char, c_void};
use std::mem::transmute;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use ash::vk;

use super::instance::ValidationLog;
use crate::fault::{self, Kind, Manner};

/// A function whose type is not known here.
type Any = unsafe extern "system" fn();
/// Pointers and handles of instances, devices, queues and command buffers.
type P = *mut c_void;
type Proc = unsafe extern "system" fn(P, *const c_char) -> vk::PFN_vkVoidFunction;

/// Whether a call tells of a lost device.
#[derive(Clone, Copy, PartialEq)]
enum Loss {
    Never,
    Told,
    /// Told, by a call that returns only when work is done. It waits before it fails: the
    /// work does run here, and what it uses must not go before it ends.
    Waited,
}

/// A call that can fail.
struct Call {
    index: usize,
    name: &'static CStr,
    wrapper: Any,
    loss: Loss,
}

const COUNT: usize = 32;

/// Where the calls go, as addresses.
static REAL: [AtomicUsize; COUNT] = [const { AtomicUsize::new(0) }; COUNT];
static REAL_INSTANCE_PROC: AtomicUsize = AtomicUsize::new(0);
static REAL_DEVICE_PROC: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static LOGS: RefCell<Vec<Arc<ValidationLog>>> = const { RefCell::new(Vec::new()) };
}

macro_rules! wrapper {
    ($name:ident: $($argument:ident $T:ident),*) => {
        unsafe extern "system" fn $name<const I: usize, $($T: Copy),*>(
            $($argument: $T),*
        ) -> vk::Result {
            let real = REAL[I].load(Ordering::Relaxed);
            // SAFETY: the address of this call's function, whose arguments these are; the
            // caller's promises are passed on.
            pass(&CALLS[I], || unsafe {
                transmute::<usize, unsafe extern "system" fn($($T),*) -> vk::Result>(real)(
                    $($argument),*
                )
            })
        }
    };
}

wrapper!(w1: a A);
wrapper!(w2: a A, b B);
wrapper!(w3: a A, b B, c C);
wrapper!(w4: a A, b B, c C, d D);
wrapper!(w5: a A, b B, c C, d D, e E);
wrapper!(w6: a A, b B, c C, d D, e E, f F);
wrapper!(w7: a A, b B, c C, d D, e E, f F, g G);
wrapper!(w8: a A, b B, c C, d D, e E, f F, g G, h H);

macro_rules! calls {
    ($($index:literal $name:literal $wrapper:ident($($T:ident)*) $loss:ident;)*) => {
        [$(Call {
            index: $index,
            name: $name,
            // SAFETY: only the address is kept; callers know the type.
            wrapper: unsafe {
                transmute::<unsafe extern "system" fn($($T),*) -> vk::Result, Any>(
                    $wrapper::<$index, $($T),*>,
                )
            },
            loss: Loss::$loss,
        }),*]
    };
}

/// All that this crate and its allocator use. 64-bit handles are `u64`, flags `u32`.
static CALLS: [Call; COUNT] = calls! {
    0 c"vkEnumerateInstanceVersion" w1(P) Never;
    1 c"vkEnumerateInstanceExtensionProperties" w3(P P P) Never;
    2 c"vkCreateInstance" w3(P P P) Never;
    3 c"vkEnumeratePhysicalDevices" w3(P P P) Never;
    4 c"vkEnumerateDeviceExtensionProperties" w4(P P P P) Never;
    5 c"vkCreateDebugUtilsMessengerEXT" w4(P P P P) Never;
    6 c"vkCreateDevice" w4(P P P P) Told;
    7 c"vkSetDebugUtilsObjectNameEXT" w2(P P) Never;
    8 c"vkAllocateMemory" w4(P P P P) Never;
    9 c"vkMapMemory" w6(P u64 u64 u64 u32 P) Never;
    10 c"vkCreateBuffer" w4(P P P P) Never;
    11 c"vkCreateBufferView" w4(P P P P) Never;
    12 c"vkBindBufferMemory" w4(P u64 u64 u64) Never;
    13 c"vkCreateCommandPool" w4(P P P P) Never;
    14 c"vkCreateFence" w4(P P P P) Never;
    15 c"vkCreateQueryPool" w4(P P P P) Never;
    16 c"vkAllocateCommandBuffers" w3(P P P) Never;
    17 c"vkBeginCommandBuffer" w2(P P) Never;
    18 c"vkEndCommandBuffer" w1(P) Never;
    19 c"vkQueueSubmit" w4(P u32 P u64) Told;
    20 c"vkWaitForFences" w5(P u32 P u32 u64) Waited;
    21 c"vkDeviceWaitIdle" w1(P) Waited;
    22 c"vkGetQueryPoolResults" w8(P u64 u32 u32 usize P u64 u32) Told;
    23 c"vkCreateShaderModule" w4(P P P P) Never;
    24 c"vkCreateDescriptorSetLayout" w4(P P P P) Never;
    25 c"vkCreatePipelineLayout" w4(P P P P) Never;
    26 c"vkCreateDescriptorPool" w4(P P P P) Never;
    27 c"vkAllocateDescriptorSets" w3(P P P) Never;
    28 c"vkCreateComputePipelines" w6(P u64 u32 P P P) Never;
    29 c"vkCreateAccelerationStructureKHR" w4(P P P P) Never;
    30 c"vkCreateRayTracingPipelinesKHR" w7(P u64 u64 u32 P P P) Never;
    31 c"vkGetRayTracingShaderGroupHandlesKHR" w6(P u64 u32 u32 usize P) Never;
};

const _: () = {
    let mut index = 0;
    while index < COUNT {
        assert!(CALLS[index].index == index, "a call at another place");
        index += 1;
    }
};

/// Makes the call, or lets it fail.
fn pass(call: &Call, real: impl FnOnce() -> vk::Result) -> vk::Result {
    let name = call.name.to_str().expect("names of calls are ASCII");
    let result = match fault::strikes(Kind::Vulkan, name) {
        Some(Manner::Lost) if call.loss != Loss::Never => vk::Result::ERROR_DEVICE_LOST,
        None | Some(Manner::Lost) => return real(),
        Some(Manner::Once) if call.loss == Loss::Waited => {
            return vk::Result::ERROR_OUT_OF_HOST_MEMORY;
        }
        Some(_) => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
    };
    if call.loss == Loss::Waited {
        let _ = real();
    }
    result
}

/// The loader as this crate is to see it.
pub(super) fn interpose(entry: ash::Entry) -> ash::Entry {
    if !fault::is_armed(Kind::Vulkan) {
        return entry;
    }
    let real = entry.static_fn().get_instance_proc_addr as usize;
    REAL_INSTANCE_PROC.store(real, Ordering::Relaxed);
    // The library stays loaded for good: the entry made below does not hold it.
    std::mem::forget(entry);
    let functions = ash::StaticFn {
        // SAFETY: an instance's handle is a pointer.
        get_instance_proc_addr: unsafe {
            transmute::<Proc, vk::PFN_vkGetInstanceProcAddr>(instance_proc)
        },
    };
    // SAFETY: the functions are the loader's or pass on to them.
    unsafe { ash::Entry::from_static_fn(functions) }
}

/// What validation said of the instances of this thread since the last time.
pub fn take_logs() -> Vec<Arc<ValidationLog>> {
    LOGS.take()
}

pub(super) fn watch(log: &Arc<ValidationLog>) {
    if fault::is_armed(Kind::Vulkan) {
        LOGS.with_borrow_mut(|logs| logs.push(Arc::clone(log)));
    }
}

unsafe extern "system" fn instance_proc(
    instance: P,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: stored in `interpose`; the caller's promises are passed on.
    let (found, name) = unsafe {
        let real: Proc = transmute(REAL_INSTANCE_PROC.load(Ordering::Relaxed));
        (real(instance, name), CStr::from_ptr(name))
    };
    if name == c"vkGetDeviceProcAddr" {
        REAL_DEVICE_PROC.store(found? as usize, Ordering::Relaxed);
        // SAFETY: only the address is kept; callers know the type.
        return Some(unsafe { transmute::<Proc, Any>(device_proc) });
    }
    replaced(name, found)
}

unsafe extern "system" fn device_proc(device: P, name: *const c_char) -> vk::PFN_vkVoidFunction {
    // SAFETY: stored in `instance_proc`; the caller's promises are passed on.
    let (found, name) = unsafe {
        let real: Proc = transmute(REAL_DEVICE_PROC.load(Ordering::Relaxed));
        (real(device, name), CStr::from_ptr(name))
    };
    replaced(name, found)
}

/// The wrapper of a call that can fail; other functions as they are.
fn replaced(name: &CStr, found: vk::PFN_vkVoidFunction) -> vk::PFN_vkVoidFunction {
    let real = found?;
    let Some(call) = CALLS.iter().find(|call| call.name == name) else {
        return Some(real);
    };
    REAL[call.index].store(real as usize, Ordering::Relaxed);
    Some(call.wrapper)
}
