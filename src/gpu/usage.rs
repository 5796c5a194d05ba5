//! What buffers are for: the flags that Vulkan wants when they are made.

use std::ops::BitOr;

use ash::vk;

/// Format of the elements of a texel buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelFormat {
    /// Four 32-bit unsigned integers.
    Rgba32Uint,
    /// Four 32-bit floats.
    Rgba32Float,
    /// Two 32-bit unsigned integers.
    Rg32Uint,
    /// One 32-bit unsigned integer.
    R32Uint,
}

impl TexelFormat {
    /// Bytes of one element.
    pub fn bytes(self) -> u64 {
        match self {
            Self::Rgba32Uint | Self::Rgba32Float => 16,
            Self::Rg32Uint => 8,
            Self::R32Uint => 4,
        }
    }

    pub(super) fn vulkan(self) -> vk::Format {
        match self {
            Self::Rgba32Uint => vk::Format::R32G32B32A32_UINT,
            Self::Rgba32Float => vk::Format::R32G32B32A32_SFLOAT,
            Self::Rg32Uint => vk::Format::R32G32_UINT,
            Self::R32Uint => vk::Format::R32_UINT,
        }
    }
}

/// What a buffer is for; join several with `|`. Copies and fills are always allowed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Usage {
    pub(super) flags: vk::BufferUsageFlags,
    pub(super) texel: Option<TexelFormat>,
}

impl Usage {
    /// Copies only.
    pub const TRANSFER: Self = Self::of(vk::BufferUsageFlags::empty());
    /// A storage buffer of a shader.
    pub const STORAGE: Self = Self::of(vk::BufferUsageFlags::STORAGE_BUFFER);
    /// A uniform buffer of a shader.
    pub const UNIFORM: Self = Self::of(vk::BufferUsageFlags::UNIFORM_BUFFER);
    /// Vertices, indices or instances from which acceleration structures are built.
    pub const ACCELERATION_INPUT: Self =
        Self::with_address(vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR);
    /// Holds an acceleration structure.
    pub const ACCELERATION_STORAGE: Self =
        Self::with_address(vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR);
    /// Working memory of a build.
    pub const SCRATCH: Self = Self::with_address(vk::BufferUsageFlags::STORAGE_BUFFER);
    /// Handles of the shaders that rays call.
    pub const SHADER_TABLE: Self =
        Self::with_address(vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR);

    /// Read by shaders at [`super::Buffer::shader_address`], where [`super::Caps::addresses`] says so.
    pub const ADDRESS: Self = Self::of(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS);

    const fn with_address(flags: vk::BufferUsageFlags) -> Self {
        let address = vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        Self::of(vk::BufferUsageFlags::from_raw(
            flags.as_raw() | address.as_raw(),
        ))
    }

    const fn of(flags: vk::BufferUsageFlags) -> Self {
        Self { flags, texel: None }
    }

    /// A uniform texel buffer of a shader. One buffer has one format.
    pub const fn texel(format: TexelFormat) -> Self {
        Self {
            flags: vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER,
            texel: Some(format),
        }
    }

    pub(super) fn allows(self, flags: vk::BufferUsageFlags) -> bool {
        self.flags.contains(flags)
    }
}

impl BitOr for Usage {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        assert!(
            self.texel.is_none() || other.texel.is_none() || self.texel == other.texel,
            "a buffer has one texel format"
        );
        Self {
            flags: self.flags | other.flags,
            texel: self.texel.or(other.texel),
        }
    }
}
