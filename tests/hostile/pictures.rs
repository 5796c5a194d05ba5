//! Pictures that claim more than they hold.

use std::fs;
use std::path::Path;

use super::builder::{data_uri, png};
use super::corpus::{Case, case, text, with_environment, with_image};

/// A picture in a data URI.
fn picture(name: &'static str, says: &'static str, bytes: impl Fn() -> Vec<u8> + 'static) -> Case {
    text(name, says, move || {
        with_image(&data_uri(&bytes())).to_gltf().into_bytes()
    })
}

/// A PNG whose header claims another size.
fn claiming(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = png(1, 1, &[0; 4]);
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    let sum = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&sum.to_be_bytes());
    bytes
}

/// CRC-32 of PNG chunks.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |c: u32| {
        if c & 1 == 1 {
            c >> 1 ^ 0xEDB8_8320
        } else {
            c >> 1
        }
    };
    let byte = |crc: u32, byte: &u8| (0..8).fold(crc ^ u32::from(*byte), |c, _| step(c));
    !bytes.iter().fold(!0, byte)
}

pub fn pictures() -> Vec<Case> {
    let sky = |name, says, bytes: &'static [u8]| {
        case(name, says, move |scene: &Path, _: &Path| {
            fs::write(scene.join("sky.hdr"), bytes).unwrap();
            fs::write(
                scene.join("scene.gltf"),
                with_environment("sky.hdr").to_gltf(),
            )
            .unwrap();
        })
    };
    vec![
        picture("a PNG of 60000 × 60000", "cap of 16384 × 16384", || {
            claiming(60_000, 60_000)
        }),
        picture(
            "a PNG of 16000 × 16000 without data",
            "cannot hold",
            || claiming(16_000, 16_000),
        ),
        picture(
            "a JPEG of 16000 × 16000 without data",
            "cannot hold",
            || {
                let picture = image::DynamicImage::new_rgb8(8, 8);
                let mut bytes = std::io::Cursor::new(Vec::new());
                picture
                    .write_to(&mut bytes, image::ImageFormat::Jpeg)
                    .unwrap();
                let mut bytes = bytes.into_inner();
                let frame = bytes
                    .windows(2)
                    .position(|pair| pair == [0xFF, 0xC0])
                    .unwrap();
                let side = 16_000_u16.to_be_bytes();
                bytes[frame + 5..frame + 7].copy_from_slice(&side);
                bytes[frame + 7..frame + 9].copy_from_slice(&side);
                bytes
            },
        ),
        picture("a PNG of no width", "images[0]", || claiming(0, 1)),
        picture("a PNG that ends early", "images[0]", || {
            let whole = png(64, 64, &[7; 64 * 64 * 4]);
            whole[..whole.len() - 20].to_vec()
        }),
        picture("a picture of another kind", "images[0]", || {
            b"GIF89a\xFF\xFF\xFF\xFF\0\0\0;".to_vec()
        }),
        sky(
            "a sky of 30000 × 30000",
            "cap of 16384",
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n",
        ),
        sky(
            "a sky of 16000 × 16000 without data",
            "cannot hold",
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16000 +X 16000\n",
        ),
        sky("a sky that is none", "neither", b"\x76\x2f\x31\x00 no EXR"),
    ]
}
