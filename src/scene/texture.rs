//! Decoded images and how they are looked up.

/// What happens to coordinates outside 0 … 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Tile.
    #[default]
    Repeat,
    /// Tile, every second copy mirrored.
    Mirror,
    /// Repeat the edge texel.
    Clamp,
}

/// Reconstruction between texels; glTF's minification filters are not used,
/// since many samples a pixel integrate the footprint without bias.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The texel that holds the point.
    Nearest,
    /// Bilinear, in linear light.
    #[default]
    Linear,
}

/// Texels row by row from the top left, four channels each.
#[derive(Clone, Debug)]
pub enum Texels {
    /// Eight bits a channel. With `srgb` RGB hold the sRGB curve, A is linear.
    Rgba8 {
        /// RGBA bytes.
        data: Vec<u8>,
        /// Whether RGB must be decoded before filtering.
        srgb: bool,
    },
    /// Sixteen bits a channel, linear.
    Rgba16(Vec<u16>),
}

/// An image with its sampler.
#[derive(Clone, Debug)]
pub struct Texture {
    /// For messages: image name or URI.
    pub name: String,
    /// Texels a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The image itself.
    pub texels: Texels,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
    /// Reconstruction.
    pub filter: Filter,
}

/// A texture applied to a material, with KHR_texture_transform folded in:
/// `uv' = (m[0]·(u,v) + m[0].z, m[1]·(u,v) + m[1].z)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`super::Scene::textures`].
    pub texture: u32,
    /// Which set of coordinates: 0 or 1.
    pub uv_set: u32,
    /// Rows of the 2 × 3 matrix on (u, v, 1).
    pub uv_transform: [[f32; 3]; 2],
}
