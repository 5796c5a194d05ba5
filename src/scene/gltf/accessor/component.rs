//! Types of numbers in accessors, and how they are decoded.

use crate::scene::gltf::Check;
use crate::scene::gltf::json::Shape;

/// Component types that an accessor may have, as a set.
#[derive(Clone, Copy)]
pub(in crate::scene::gltf) struct Kinds(u8);

impl Kinds {
    /// 32-bit floats.
    pub const FLOAT: Self = Self(1);
    /// Normalised 8 and 16 bits without sign.
    pub const UNSIGNED_NORMALIZED: Self = Self(2);
    /// Normalised 8 and 16 bits with sign.
    pub const SIGNED_NORMALIZED: Self = Self(4);
    /// Integers of 8 and 16 bits, with or without sign, taken as they are.
    pub const SMALL_INTEGER: Self = Self(8);
    /// Unsigned integers of 8, 16 and 32 bits.
    pub const INDEX: Self = Self(16);

    /// Either set.
    pub const fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether both sets have a kind in common.
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether the combination is in the set.
    pub(super) fn allows(self, component: Component, normalized: bool) -> bool {
        use Component::{F32, I8, I16, U8, U16, U32};
        let of = match (component, normalized) {
            (F32, false) => Self::FLOAT.0,
            (U8 | U16, true) => Self::UNSIGNED_NORMALIZED.0,
            (I8 | I16, true) => Self::SIGNED_NORMALIZED.0,
            (U8 | U16, false) => Self::SMALL_INTEGER.0 | Self::INDEX.0,
            (I8 | I16, false) => Self::SMALL_INTEGER.0,
            (U32, false) => Self::INDEX.0,
            (F32 | U32, true) => 0,
        };
        self.0 & of != 0
    }
}

/// The type of one number of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    /// The type that a file's code stands for.
    pub fn from_code(code: Option<u32>, user: &str) -> Check<Self> {
        match code {
            Some(5120) => Ok(Self::I8),
            Some(5121) => Ok(Self::U8),
            Some(5122) => Ok(Self::I16),
            Some(5123) => Ok(Self::U16),
            Some(5125) => Ok(Self::U32),
            Some(5126) => Ok(Self::F32),
            Some(code) => Err(format!("{user}: componentType {code} is not known")),
            None => Err(format!("{user}: componentType is missing")),
        }
    }

    /// Bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Decodes the component at the start of `bytes`.
    pub fn float(self, bytes: &[u8], normalized: bool) -> f32 {
        let two = || [bytes[0], bytes[1]];
        let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
        // Normalised integers as the specification's section 3.11 maps them.
        let (value, scale): (f32, f32) = match self {
            Self::I8 => (f32::from(bytes[0] as i8), 127.0),
            Self::U8 => (f32::from(bytes[0]), 255.0),
            Self::I16 => (f32::from(i16::from_le_bytes(two())), 32767.0),
            Self::U16 => (f32::from(u16::from_le_bytes(two())), 65535.0),
            Self::U32 => return u32::from_le_bytes(four()) as f32,
            Self::F32 => return f32::from_le_bytes(four()),
        };
        if normalized {
            (value / scale).max(-1.0)
        } else {
            value
        }
    }

    /// Decodes an unsigned integer.
    pub fn index(self, bytes: &[u8]) -> u32 {
        match self.size() {
            1 => bytes[0].into(),
            2 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
            _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }
}

/// Numbers in an element.
pub(super) fn components(shape: Shape) -> usize {
    match shape {
        Shape::Scalar => 1,
        Shape::Vec2 => 2,
        Shape::Vec3 => 3,
        Shape::Vec4 | Shape::Mat2 => 4,
        Shape::Mat3 => 9,
        Shape::Mat4 => 16,
    }
}
