//! What is known of the processors that CPU drivers run on: which vectors are fast, and which loads (docs/decisions.md).

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;

/// Read by Mesa's driver for CPUs, lavapipe: bits of its vectors.
const VECTOR_WIDTH: &str = "LP_NATIVE_VECTOR_WIDTH";
/// Where Mesa keeps compiled kernels.
const KERNEL_CACHE: &str = "MESA_SHADER_CACHE_DIR";

/// Makes lavapipe compute with vectors of 512 bits in this process where they are known to be faster, which it does not do by
/// itself: on Intel's processors since Sapphire Rapids. Pictures have the same bits.
///
/// Mesa's cache of kernels does not tell widths apart, so those of 512 bits get a folder of their own in it. For the start
/// of a program, before devices are asked for: nothing is done once there are other threads, nor where the environment
/// says how wide vectors are.
pub fn widen_vectors() {
    let is_chosen = env::var_os(VECTOR_WIDTH).is_some();
    if is_chosen || !is_wide_fast() || !is_single_threaded() {
        return;
    }
    let Some(folder) = kernel_cache() else {
        return;
    };
    // Mesa makes the last folder only; without it, kernels are not kept.
    let _ = fs::create_dir_all(&folder);
    // SAFETY: no other thread reads the environment meanwhile, since there is none.
    unsafe {
        env::set_var(VECTOR_WIDTH, "512");
        env::set_var(KERNEL_CACHE, folder);
    }
}

/// Whether reading by 64-bit addresses, which lavapipe makes gathers of, is faster than texel buffers, where vectors hold so many
/// floats.
#[must_use]
pub fn gathers_fast(lanes: u32) -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx512vl") && (is_amd() || lanes >= 16);
    #[cfg(not(target_arch = "x86_64"))]
    return false;
}

fn is_wide_fast() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx512fp16") && !is_amd();
    #[cfg(not(target_arch = "x86_64"))]
    return false;
}

#[cfg(target_arch = "x86_64")]
fn is_amd() -> bool {
    // instructions that nobody else has
    is_x86_feature_detected!("sse4a")
}

/// False where it cannot be known.
fn is_single_threaded() -> bool {
    fs::read_dir("/proc/self/task").is_ok_and(|threads| threads.count() == 1)
}

/// The folder of kernels of 512 bits, in that which Mesa would take.
fn kernel_cache() -> Option<PathBuf> {
    let folder = |name: &str| {
        let is_set = |value: &OsString| !value.is_empty();
        env::var_os(name).filter(is_set).map(PathBuf::from)
    };
    folder(KERNEL_CACHE)
        .or_else(|| folder("XDG_CACHE_HOME"))
        .or_else(|| Some(folder("HOME")?.join(".cache")))
        .map(|cache| cache.join("etendue-512-bits"))
}
