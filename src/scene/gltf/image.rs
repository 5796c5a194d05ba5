//! PNG and JPEG → texels. The header is read first, so that an image that
//! claims too much is refused before any memory is taken for it.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::texture::ColorSpace;
use super::{Check, quote};
use crate::scene::Texels;
use crate::store::{Entry, Key};

/// What the head of an image says.
#[derive(Clone, Copy)]
pub(super) struct Header {
    format: ImageFormat,
    pub width: u32,
    pub height: u32,
    /// Whether channels have sixteen bits.
    pub is_wide: bool,
}

/// Reads the head of an image. `texels` is (what is left of the limit, the limit).
pub(super) fn header(
    bytes: &[u8],
    mime_type: Option<&str>,
    longest_side: u32,
    texels: (u64, u64),
) -> Check<Header> {
    if let Some(mime) = mime_type.filter(|m| !matches!(*m, "image/png" | "image/jpeg")) {
        return Err(format!(
            "{} is not supported, only PNG and JPEG are",
            quote(mime)
        ));
    }
    let Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) = image::guess_format(bytes) else {
        return Err(String::from("is neither a PNG nor a JPEG image"));
    };
    let decoder = ImageReader::with_format(Cursor::new(bytes), format)
        .into_decoder()
        .map_err(broken)?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, longest_side)?;
    let size = u64::from(width) * u64::from(height);
    check_total(size, texels.0, texels.1)?;
    if size > most_pixels(bytes, format) {
        return Err(format!(
            "claims {width} × {height} pixels, which {} bytes cannot hold",
            bytes.len()
        ));
    }
    let color = decoder.color_type();
    Ok(Header {
        format,
        width,
        height,
        is_wide: color.bytes_per_pixel() == 2 * color.channel_count(),
    })
}

/// The texels of an image with this head; `cache` is a folder of those that were decoded before.
pub(super) fn texels(
    bytes: &[u8],
    header: &Header,
    color_space: ColorSpace,
    cache: Option<&Path>,
) -> Check<Texels> {
    let Some(folder) = cache else {
        return decode(bytes, header, color_space);
    };
    let srgb = color_space == ColorSpace::Srgb;
    let mut key = Key::new("texels");
    key.add(&[u8::from(header.is_wide && srgb)]);
    key.add(bytes);
    let entry = Entry::new(folder, key);
    let count = 4 * header.width as usize * header.height as usize;
    match entry.read() {
        Some(data) if !header.is_wide && data.len() == count => {
            return Ok(Texels::Rgba8 { data, srgb });
        }
        Some(data) if header.is_wide && data.len() == 2 * count => {
            return Ok(Texels::Rgba16(bytemuck::pod_collect_to_vec(&data)));
        }
        _ => {}
    }
    let texels = decode(bytes, header, color_space)?;
    match &texels {
        Texels::Rgba8 { data, .. } => entry.write(&[data]),
        Texels::Rgba16(data) => entry.write(&[bytemuck::cast_slice(data)]),
    }
    Ok(texels)
}

fn decode(bytes: &[u8], header: &Header, color_space: ColorSpace) -> Check<Texels> {
    // The decoder's own allocations, for bombs in other places than the pixels:
    // sixteen-bit RGBA twice over, and a fixed sum for tables and metadata.
    const DECODER_OVERHEAD: u64 = 1 << 26;
    let size = u64::from(header.width) * u64::from(header.height);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(size * 16 + DECODER_OVERHEAD);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), header.format);
    reader.limits(limits);
    let decoded = reader.decode().map_err(broken)?;
    if header.format == ImageFormat::Jpeg && !is_whole_jpeg(bytes) {
        return Err(String::from("ends before its end: the JPEG is incomplete"));
    }
    Ok(to_texels(decoded, color_space))
}

fn broken(error: image::ImageError) -> String {
    format!("cannot be decoded: {error}")
}

/// The most pixels that an image of so many bytes can have: its decoder takes the memory for all
/// of them before it finds that they are not there.
fn most_pixels(bytes: &[u8], format: ImageFormat) -> u64 {
    // deflate needs two bits for 258 bytes
    const DEFLATE: u64 = 1032;
    // a block of 8 × 8 takes one bit at least, that of its mean
    const JPEG: u64 = 64;
    let bits = bytes.len() as u64 * 8;
    if format == ImageFormat::Jpeg {
        return bits.saturating_mul(JPEG);
    }
    // bits of a channel and kind of pixels, which the header has after the size
    let at = |i: usize| bytes.get(i).copied().unwrap_or(0);
    let (depth, kind) = (u64::from(at(24)).max(1), at(25));
    let channels = match kind {
        2 => 3,
        4 => 2,
        6 => 4,
        _ => 1,
    };
    bits.saturating_mul(DEFLATE) / (depth * channels)
}

/// Whether a JPEG has its end. The decoder paints what is missing grey.
/// Within a scan no marker but restarts can occur, so the last scan starts before the end of the image.
fn is_whole_jpeg(bytes: &[u8]) -> bool {
    const START_OF_SCAN: [u8; 2] = [0xFF, 0xDA];
    const END_OF_IMAGE: [u8; 2] = [0xFF, 0xD9];
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    last(END_OF_IMAGE) > last(START_OF_SCAN)
}

/// Refuses images without pixels or with sides beyond the limit.
pub(super) fn check_size(width: u32, height: u32, longest_side: u32) -> Check<()> {
    if width == 0 || height == 0 {
        return Err(format!("is {width} × {height} pixels: empty"));
    }
    if width > longest_side || height > longest_side {
        return Err(format!(
            "is {width} × {height} pixels, larger than the cap of {longest_side} × {longest_side} (Limits::image_side)"
        ));
    }
    Ok(())
}

/// Refuses an image that would take all of them beyond the limit.
pub(super) fn check_total(size: u64, left: u64, cap: u64) -> Check<()> {
    if size > left {
        return Err(format!(
            "its {size} texels take the scene beyond the cap of {cap} texels in total (Limits::texels)"
        ));
    }
    Ok(())
}

fn to_texels(image: DynamicImage, color_space: ColorSpace) -> Texels {
    use DynamicImage::{ImageLuma16, ImageLumaA16, ImageRgb16, ImageRgba16};
    match image {
        ImageLuma16(_) | ImageLumaA16(_) | ImageRgb16(_) | ImageRgba16(_) => {
            let mut data = image.into_rgba16().into_raw();
            if color_space == ColorSpace::Srgb {
                for texel in data.chunks_exact_mut(4) {
                    for channel in &mut texel[..3] {
                        *channel = linear_from_srgb(*channel);
                    }
                }
            }
            Texels::Rgba16(data)
        }
        _ => Texels::Rgba8 {
            data: image.into_rgba8().into_raw(),
            srgb: color_space == ColorSpace::Srgb,
        },
    }
}

/// The curve of IEC 61966-2-1 on sixteen bits.
fn linear_from_srgb(encoded: u16) -> u16 {
    let x = f64::from(encoded) / 65535.0;
    let linear = if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    };
    (linear * 65535.0).round() as u16
}
