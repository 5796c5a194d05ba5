//! Radiance from infinity: a constant or a latitude–longitude map, read from
//! Radiance `.hdr` or OpenEXR.

use std::io::{Cursor, Read};
use std::path::Path;
use std::sync::Arc;

use exr::prelude::{MetaData, ReadChannels, ReadLayers};
use glam::Vec3;
use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;
use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::scene::gltf::Limits;

/// Light that arrives from all sides.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same radiance from every direction, cd/m² per channel.
    Constant(Vec3),
    /// A latitude–longitude map. The centre of the image looks along −Z, +Y is
    /// up and u grows towards +X.
    Map {
        /// Texels a row.
        width: u32,
        /// Rows, the first one at the zenith.
        height: u32,
        /// Linear Rec. 709 texels, row by row; finite and not negative.
        texels: Arc<Vec<[f32; 3]>>,
        /// Factor that turns texels into radiance, cd/m².
        intensity: f32,
        /// Right-handed rotation about +Y, radians: what stood in direction d
        /// stands at R_y(rotation)·d.
        rotation: f32,
    },
}

/// An environment from a file of its own.
#[derive(Clone, Debug)]
pub struct LoadedEnvironment {
    /// The map, with intensity 1 and rotation 0.
    pub environment: Environment,
    /// What had to be changed, for the user to read.
    pub warnings: Vec<String>,
    /// SHA-256 of the file, hexadecimal.
    pub hash: String,
}

/// Reads a latitude–longitude map from a Radiance `.hdr` or OpenEXR file (told
/// apart by content), within the default [`Limits`]. Colours are taken as linear
/// Rec. 709; negative values become 0 with a warning.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read, [`Error::Image`] when it is
/// neither format, broken, too large, or holds NaN or infinity.
pub fn load_environment(path: &Path) -> Result<LoadedEnvironment> {
    let limits = Limits::default();
    let io = |source| Error::Io {
        action: "read",
        path: path.to_owned(),
        source,
    };
    let image = |what| Error::Image {
        path: path.to_owned(),
        what,
    };
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(io)?;
    file.take(limits.file_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(io)?;
    if bytes.len() as u64 > limits.file_bytes {
        return Err(image(format!(
            "is larger than the cap of {} bytes (Limits::file_bytes)",
            limits.file_bytes
        )));
    }
    let map = decode_map(&bytes, limits.image_side, limits.texels).map_err(image)?;
    let digest = Sha256::digest(&bytes);
    Ok(LoadedEnvironment {
        environment: Environment::Map {
            width: map.width,
            height: map.height,
            texels: Arc::new(map.texels),
            intensity: 1.0,
            rotation: 0.0,
        },
        warnings: map.warnings,
        hash: digest.iter().map(|byte| format!("{byte:02x}")).collect(),
    })
}

/// Texels of a map, and what had to be changed about them.
pub(crate) struct DecodedMap {
    pub width: u32,
    pub height: u32,
    pub texels: Vec<[f32; 3]>,
    pub warnings: Vec<String>,
}

/// Decodes `.hdr` or OpenEXR bytes of at most `longest_side`² and `most_texels` texels.
pub(crate) fn decode_map(
    bytes: &[u8],
    longest_side: u32,
    most_texels: u64,
) -> Result<DecodedMap, String> {
    const EXR_MAGIC: &[u8] = &[0x76, 0x2f, 0x31, 0x01];
    /// Bytes of texels that a header is trusted with, whatever the size of the file.
    const FEW: u64 = 1 << 26;
    /// Pictures compress further than this only if they are all but empty.
    const MOST_COMPRESSED: u64 = 1 << 14;
    let check = |width: u64, height: u64| {
        let cap = u64::from(longest_side);
        if width == 0 || height == 0 {
            return Err(format!("is {width} × {height} pixels: empty"));
        }
        if width > cap || height > cap {
            return Err(format!(
                "is {width} × {height} pixels, larger than the cap of {cap} × {cap} (Limits::image_side)"
            ));
        }
        if width * height * 12 > FEW.max(MOST_COMPRESSED * bytes.len() as u64) {
            return Err(format!(
                "claims {width} × {height} pixels, which {} bytes cannot hold",
                bytes.len()
            ));
        }
        if width * height > most_texels {
            return Err(format!(
                "is {width} × {height} pixels, more than the {most_texels} that the cap still allows (Limits::texels)"
            ));
        }
        Ok(())
    };
    let (width, height, mut texels) = if bytes.starts_with(EXR_MAGIC) {
        decode_exr(bytes, check)?
    } else if bytes.starts_with(b"#?") {
        decode_hdr(bytes, check)?
    } else {
        return Err(String::from(
            "is neither a Radiance .hdr nor an OpenEXR image",
        ));
    };
    let mut negative = 0_u64;
    for (i, texel) in texels.iter_mut().enumerate() {
        for channel in texel {
            if !channel.is_finite() {
                return Err(format!(
                    "texel ({}, {}) is not finite",
                    i % width as usize,
                    i / width as usize
                ));
            }
            if *channel < 0.0 {
                *channel = 0.0;
                negative += 1;
            }
        }
    }
    let mut warnings = Vec::new();
    if negative > 0 {
        warnings.push(format!("{negative} negative values are taken as 0"));
    }
    Ok(DecodedMap {
        width,
        height,
        texels,
        warnings,
    })
}

type Pixels = (u32, u32, Vec<[f32; 3]>);

fn decode_hdr(
    bytes: &[u8],
    check: impl Fn(u64, u64) -> Result<(), String>,
) -> Result<Pixels, String> {
    let broken = |error: image::ImageError| format!("cannot be decoded: {error}");
    // Not strict: `#?RGBE` is as common a first line as `#?RADIANCE`.
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes)).map_err(broken)?;
    let (width, height) = decoder.dimensions();
    check(width.into(), height.into())?;
    let image = image::DynamicImage::from_decoder(decoder).map_err(broken)?;
    let texels = image.into_rgb32f().pixels().map(|pixel| pixel.0).collect();
    Ok((width, height, texels))
}

fn decode_exr(
    bytes: &[u8],
    check: impl Fn(u64, u64) -> Result<(), String>,
) -> Result<Pixels, String> {
    let broken = |error: exr::error::Error| format!("cannot be decoded: {error}");
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(broken)?;
    for header in &meta.headers {
        let size = header.layer_size;
        check(size.width() as u64, size.height() as u64)?;
        // Each chunk has eight bytes in a table at least.
        if header.chunk_count > bytes.len() / 8 {
            return Err(format!("claims {} chunks", header.chunk_count));
        }
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0.0_f32; 3]; size.area()]),
            |(width, texels), at, (r, g, b): (f32, f32, f32)| {
                texels[at.y() * *width + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(broken)?;
    let size = image.layer_data.size;
    let (_, texels) = image.layer_data.channel_data.pixels;
    Ok((size.width() as u32, size.height() as u32, texels))
}
