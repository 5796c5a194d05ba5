//! The unsafe calls of wgpu: shaders that it checks less, or not at all, and what it calls experimental. The
//! fifth rule of this folder holds for shaders: they are compiled by this crate and trusted.

use std::borrow::Cow;

/// A module that naga translates without checks at run time.
pub fn unchecked(device: &wgpu::Device, words: &[u32]) -> wgpu::ShaderModule {
    let desc = wgpu::ShaderModuleDescriptor {
        label: Some("unchecked"),
        source: wgpu::ShaderSource::SpirV(Cow::Borrowed(words)),
    };
    // SAFETY: the kernels stay within their buffers, end their loops and divide integers by
    // counts above zero only.
    unsafe { device.create_shader_module_trusted(desc, wgpu::ShaderRuntimeChecks::unchecked()) }
}

/// A module that goes to the driver as it is. `group`: the size of its work groups.
pub fn passed(device: &wgpu::Device, words: &[u32], group: (u32, u32, u32)) -> wgpu::ShaderModule {
    let desc = wgpu::ShaderModuleDescriptorPassthrough {
        label: Some("passed"),
        entry_points: Cow::Owned(vec![wgpu::PassthroughShaderEntryPoint {
            name: Cow::Borrowed("main"),
            workgroup_size: group,
        }]),
        spirv: Some(Cow::Borrowed(words)),
        ..Default::default()
    };
    // SAFETY: shaderc made the module for Vulkan 1.2 with core features, or ray queries where wgpu enabled
    // them; its blocks have std430 offsets, and its bindings are those of the layout that it is used with.
    unsafe { device.create_shader_module_passthrough(desc) }
}

/// Leave to ask for ray queries.
pub fn experimental() -> wgpu::ExperimentalFeatures {
    // SAFETY: wgpu warns of errors of its own in what is experimental. Structures are built once,
    // from buffers of the sizes that are told, before any kernel runs, and only render's yardstick uses them.
    unsafe { wgpu::ExperimentalFeatures::enabled() }
}
