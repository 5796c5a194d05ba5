//! Images come back from their files as they were, and files are never half written.
#![allow(clippy::unwrap_used, reason = "a step that fails fails the test")]

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use etendue::Error;
use etendue::film::Film;
use etendue::image_io::{
    Aov, Channel, Format, Image, Metadata, Tone, Value, probe_writable, read_exr, write_bytes,
    write_exr, write_png,
};
use etendue::settings::Crop;

/// Values that only 32-bit float channels keep.
const ODD: [f32; 10] = [
    0.0,
    -0.0,
    1e9,
    1e-45,   // the smallest subnormal
    1.5e-39, // a subnormal
    f32::MIN_POSITIVE,
    f32::MAX,
    f32::INFINITY,
    1.0 / 3.0,
    65_505.0, // beyond half floats
];

/// A crop of 5 × 4 pixels.
fn sample_image() -> Image {
    let mut metadata = Metadata::new();
    metadata.insert("scene".into(), "möbius/strip №1.gltf".into());
    metadata.insert("seed".into(), u64::MAX.to_string().into());
    metadata.insert("exposure".into(), 0.1.into());
    metadata.insert("empty".into(), "".into());
    let names = ["R", "G", "B", "albedo.R", "normal.X", "depth.Z", "samples"];
    let channels = names.iter().enumerate().map(|(i, name)| Channel {
        name: (*name).to_owned(),
        values: (0..20).map(|p| ODD[(p + i) % ODD.len()]).collect(),
    });
    Image {
        window: Crop {
            x0: 7,
            y0: 2,
            x1: 12,
            y1: 6,
        },
        full: (16, 9),
        channels: channels.collect(),
        metadata,
    }
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

/// Names in a folder.
fn list(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn exr_returns_every_bit_both_windows_and_the_header() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    let image = sample_image();
    write_exr(&path, &image).unwrap();
    let back = read_exr(&path).unwrap();
    assert_eq!((back.window, back.full), (image.window, image.full));
    assert_eq!(back.metadata, image.metadata);
    assert_eq!(back.channels.len(), image.channels.len());
    for channel in &image.channels {
        let values = back.channel(&channel.name).unwrap();
        assert_eq!(bits(values), bits(&channel.values), "{}", channel.name);
    }
}

/// Compression works on blocks of 32 rows and tables of the values that occur: here
/// every one of many blocks is full of arbitrary bits, NaN included.
#[test]
fn arbitrary_bits_survive_compression() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    let mut image = sample_image();
    image.full = (211, 300);
    image.window = Crop {
        x0: 0,
        y0: 7,
        x1: 211,
        y1: 300,
    };
    let mut state = 1_u64;
    for channel in &mut image.channels {
        channel.values = std::iter::repeat_with(|| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            f32::from_bits((state >> 32) as u32)
        })
        .take(211 * 293)
        .collect();
    }
    // one flat, one with few values
    image.channels[0].values.fill(0.25);
    for (i, value) in image.channels[1].values.iter_mut().enumerate() {
        *value = ODD[i / 50 % ODD.len()];
    }
    write_exr(&path, &image).unwrap();
    let back = read_exr(&path).unwrap();
    for channel in &image.channels {
        let values = back.channel(&channel.name).unwrap();
        assert!(bits(values) == bits(&channel.values), "{}", channel.name);
    }
}

#[test]
fn the_header_says_what_the_numbers_mean() {
    use exr::math::Vec2;
    use exr::meta::attribute::{SampleType, Text};

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    write_exr(&path, &sample_image()).unwrap();
    let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
    let header = &meta.headers[0];
    assert_eq!(header.own_attributes.white_luminance, Some(1.0));
    let primaries = header.shared_attributes.chromaticities.unwrap();
    assert_eq!(primaries.red, Vec2(0.64, 0.33));
    assert_eq!(primaries.white, Vec2(0.3127, 0.3290));
    for channel in &header.channels.list {
        assert_eq!(channel.sample_type, SampleType::F32);
    }
    let seed = Text::from("etendue:seed");
    assert!(header.own_attributes.other.contains_key(&seed));
}

#[test]
fn films_become_layers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    let window = Crop {
        x0: 1,
        y0: 0,
        x1: 3,
        y1: 1,
    };
    let mut film = Film::new(window, (4, 2), true);
    for sample in 0..2 {
        let pixel = |k: f32| {
            let x = k * (1.0 + sample as f32);
            let radiance = [x, 2.0 * x, 3.0 * x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            // and one that was dropped
            let first_hit = [0.1, 0.2, 0.3, 0.0, 0.0, 1.0, 5.0, 1.0, sample as f32];
            [&radiance[..], &first_hit[..]].concat()
        };
        let values = [pixel(1.0), pixel(10.0)].concat();
        film.add(sample, 0, values).unwrap();
    }
    let image = Image::from_film(&film, &Aov::ALL, Metadata::new()).unwrap();
    write_exr(&path, &image).unwrap();
    let back = read_exr(&path).unwrap();
    // samples 1 and 2 times k: mean 1.5 k, standard error √(0.5 / 2) k
    let expected: [(&str, [f32; 2]); 9] = [
        ("R", [1.5, 15.0]),
        ("B", [4.5, 45.0]),
        ("stderr.R", [0.5, 5.0]),
        ("albedo.G", [0.2, 0.2]),
        ("normal.Z", [1.0, 1.0]),
        ("depth.Z", [5.0, 5.0]),
        ("coverage", [1.0, 1.0]),
        ("samples", [2.0, 2.0]),
        ("dropped", [1.0, 1.0]),
    ];
    for (name, values) in expected {
        assert_eq!(back.channel(name).unwrap(), values, "{name}");
    }
    // Student's t with two degrees of freedom: 4.3027 in tables
    let interval = back.channel("interval.R").unwrap();
    let is_near = |(half, expected): (&f32, f32)| (half / expected - 1.0).abs() < 1e-4;
    let expected = [0.5 * 4.3027, 5.0 * 4.3027];
    assert!(interval.iter().zip(expected).all(is_near), "{interval:?}");
    assert_eq!(back.channels.len(), 3 + 3 + 3 + 1 + 1 + 3 + 3 + 1 + 1);

    let bare = Film::new(window, (4, 2), false);
    assert!(Image::from_film(&bare, &[Aov::Albedo], Metadata::new()).is_err());
}

#[test]
fn broken_images_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    let mut short = sample_image();
    short.channels[1].values.pop();
    let mut twice = sample_image();
    twice.channels[1].name = String::from("R");
    for image in [short, twice] {
        let result = write_exr(&path, &image);
        assert!(matches!(result, Err(Error::Image { .. })), "{result:?}");
    }
    assert!(list(folder.path()).is_empty());

    fs::write(&path, b"v/1\x01 this is not an image").unwrap();
    assert!(matches!(read_exr(&path), Err(Error::Image { .. })));
    write_exr(&path, &sample_image()).unwrap();
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    assert!(matches!(read_exr(&path), Err(Error::Image { .. })));
    let missing = read_exr(&folder.path().join("missing.exr"));
    assert!(matches!(missing, Err(Error::Io { .. })));
}

/// Header and pixels of a PNG, without colour management.
fn read_png(path: &Path) -> (png::Info<'static>, Vec<u8>) {
    let file = std::io::BufReader::new(fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    (reader.info().clone(), bytes)
}

#[test]
fn png_is_exposed_encoded_and_labelled() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.png");
    let mut image = sample_image();
    for (channel, value) in image.channels.iter_mut().zip([0.25, 0.125, 10.0]) {
        channel.values.fill(value);
    }
    write_png(&path, &image, Tone::Srgb, 1.0).unwrap();
    let (info, bytes) = read_png(&path);
    assert_eq!((info.width, info.height), (5, 4));
    assert!(info.srgb.is_some());
    // sRGB of 0.5 and 0.25 is 0.7354 and 0.5371
    assert_eq!(bytes[..3], [188, 137, 255]);

    write_png(&path, &image, Tone::None, 1.0).unwrap();
    let (info, bytes) = read_png(&path);
    assert!(info.srgb.is_none());
    assert_eq!(info.gama_chunk, Some(png::ScaledFloat::new(1.0)));
    assert!(info.chrm_chunk.is_some());
    assert_eq!(bytes[..3], [128, 64, 255]);

    image.channels.remove(0);
    let result = write_png(&path, &image, Tone::Srgb, 0.0);
    assert!(matches!(result, Err(Error::Image { .. })));
}

#[test]
fn the_suffix_picks_the_format() {
    assert_eq!(Format::of(Path::new("a/b.EXR")).unwrap(), Format::Exr);
    assert_eq!(Format::of(Path::new("b.c.png")).unwrap(), Format::Png);
    for name in ["a.jpg", "exr", ".png", "png.", ""] {
        let message = Format::of(Path::new(name)).unwrap_err().to_string();
        assert!(message.contains(".exr") && message.contains(".png"));
    }
}

#[test]
fn a_failing_write_leaves_the_old_file_and_no_rest() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    write_exr(&path, &sample_image()).unwrap();
    let old = fs::read(&path).unwrap();
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    assert!(matches!(probe_writable(&path), Err(Error::Io { .. })));
    let result = write_exr(&path, &sample_image());
    assert!(matches!(result, Err(Error::Io { .. })));
    assert_eq!(fs::read(&path).unwrap(), old);
    assert_eq!(list(folder.path()), ["out.exr"]);

    // a folder cannot be replaced by a file
    let target = folder.path().join("folder.png");
    fs::create_dir(&target).unwrap();
    assert!(probe_writable(&target).is_err());
    assert!(write_bytes(&target, b"new").is_err());
    assert_eq!(list(folder.path()), ["folder.png", "out.exr"]);

    let nowhere = folder.path().join("missing/out.exr");
    let message = probe_writable(&nowhere).unwrap_err().to_string();
    assert!(message.contains("missing/out.exr"), "{message}");
}

/// A limit on file sizes cuts the temporary file short, as a full disk would. The
/// limit holds for a whole process, so the test runs itself once more under it.
#[cfg(target_os = "linux")]
#[test]
fn a_write_cut_short_leaves_the_old_file_and_no_rest() {
    const TARGET: &str = "ETENDUE_TEST_TARGET";
    if let Some(target) = std::env::var_os(TARGET) {
        let result = write_bytes(Path::new(&target), &vec![7; 1 << 20]);
        assert!(matches!(result, Err(Error::Io { .. })), "{result:?}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.bin");
    fs::write(&path, b"old").unwrap();
    let child = std::process::Command::new("sh")
        .args(["-c", "ulimit -f 1; trap '' XFSZ; exec \"$@\"", "sh"])
        .arg(std::env::current_exe().unwrap())
        .args([
            "--exact",
            "a_write_cut_short_leaves_the_old_file_and_no_rest",
        ])
        .env(TARGET, &path)
        .output()
        .unwrap();
    let output = String::from_utf8_lossy(&child.stdout);
    assert!(
        child.status.success() && output.contains("1 passed"),
        "{output}"
    );
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(list(folder.path()), ["out.bin"]);
    assert!(write_bytes(Path::new("/dev/full"), b"x").is_err());
}

#[test]
fn probing_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    probe_writable(&path).unwrap();
    assert!(list(folder.path()).is_empty());
    fs::write(&path, b"old").unwrap();
    probe_writable(&path).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(list(folder.path()), ["out.exr"]);
}

#[cfg(unix)]
#[test]
fn links_devices_and_permissions_are_respected() {
    use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};

    let folder = tempfile::tempdir().unwrap();
    let (target, link) = (folder.path().join("target"), folder.path().join("link"));
    symlink("target", &link).unwrap();
    // to nowhere at first, then to a file
    for content in [b"first", b"again"] {
        write_bytes(&link, content).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&target).unwrap(), content);
    }
    fs::set_permissions(&target, fs::Permissions::from_mode(0o640)).unwrap();
    write_bytes(&target, b"kept").unwrap();
    let mode = fs::metadata(&target).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o640);

    let null = Path::new("/dev/null");
    write_bytes(null, b"gone").unwrap();
    probe_writable(null).unwrap();
    assert!(fs::metadata(null).unwrap().file_type().is_char_device());
}

/// Writers of one file never mix: a reader sees one of the versions, complete.
#[test]
fn many_writers_of_one_file_leave_one_whole_version() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    let version = |seed: f64| {
        let mut image = sample_image();
        image.metadata.insert("version".into(), seed.into());
        for channel in &mut image.channels {
            channel.values.fill(seed as f32);
        }
        image
    };
    let check = |image: &Image| {
        let Value::Number(seed) = image.metadata["version"] else {
            panic!("a number was written");
        };
        assert_eq!(image.channel("R").unwrap(), [seed as f32; 20]);
    };
    write_exr(&path, &version(0.0)).unwrap();
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let writers: Vec<_> = (1..4)
            .map(|writer| {
                let (path, version) = (&path, &version);
                scope.spawn(move || {
                    for round in 0..10 {
                        let seed = f64::from(writer * 100 + round);
                        write_exr(path, &version(seed)).unwrap();
                    }
                })
            })
            .collect();
        let reader = scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                check(&read_exr(&path).unwrap());
            }
        });
        for writer in writers {
            writer.join().unwrap();
        }
        done.store(true, Ordering::Relaxed);
        reader.join().unwrap();
    });
    assert_eq!(list(folder.path()), ["out.exr"]);
}
