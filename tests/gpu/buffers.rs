//! Memory: contents, limits, exhaustion.

use std::process::Command;

use etendue::Error;
use etendue::gpu::{Buffer, Device, DeviceKind, DeviceRequest, Memory, TexelFormat, Usage};

use crate::compute::Kernel;
use crate::{finish, missing_of, open};

#[test]
fn buffers_hold_what_was_written() {
    let Some(device) = open(false) else { return };
    // Two full staging chunks of 16 MiB and a rest that is no multiple of 4.
    let data: Vec<u8> = (0..(32 << 20) + 77u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let large = Buffer::from_slice(&device, "large", Usage::STORAGE, &data).unwrap();
    assert_eq!(large.bytes(), (32 << 20) + 80);
    let mut back = large.read::<u8>(data.len() + 3).unwrap();
    assert_eq!(back.split_off(data.len()), [0, 0, 0], "padding is zero");
    assert!(back == data);

    // A write in the middle, across a chunk's border of the read.
    large.write((16 << 20) - 2, &[1u8, 2, 3, 4]).unwrap();
    let back = large.read::<u8>((16 << 20) + 3).unwrap();
    assert_eq!(
        back[(16 << 20) - 3..],
        [data[(16 << 20) - 3], 1, 2, 3, 4, data[(16 << 20) + 2]]
    );

    for memory in [Memory::DeviceLocal, Memory::Upload, Memory::Readback] {
        let buffer = Buffer::new(&device, "small", 24, Usage::UNIFORM, memory).unwrap();
        buffer.write(0, &[1.5f32, 2.5, 3.5]).unwrap();
        buffer.write(4, &[7.0f32]).unwrap();
        assert_eq!(buffer.read::<f32>(3).unwrap(), [1.5, 7.0, 3.5]);
        device
            .run("clear", |commands| commands.fill_zero(&buffer))
            .unwrap();
        assert_eq!(buffer.read::<f32>(3).unwrap(), [0.0; 3]);
    }
    // What lies behind the data is zero even where the memory was used before.
    let dirt = Buffer::from_slice(&device, "dirt", Usage::STORAGE, &[0xFFu8; 1024]).unwrap();
    drop(dirt);
    let odd = Buffer::from_slice(&device, "odd", Usage::STORAGE, &[7u8; 13]).unwrap();
    assert_eq!(odd.read::<u8>(16).unwrap()[12..], [7, 0, 0, 0]);
    let empty = Buffer::from_slice::<f32>(&device, "empty", Usage::STORAGE, &[]).unwrap();
    assert_eq!(empty.bytes(), 16);
    assert_eq!(empty.read::<u32>(4).unwrap(), [0; 4]);

    drop((large, odd, empty));
    finish(device);
}

#[test]
fn limits_are_errors_with_the_figure() {
    let Some(device) = open(false) else { return };
    let caps = device.caps().clone();
    let refuse = |bytes: u64, usage| {
        let result = Buffer::new(&device, "huge", bytes, usage, Memory::DeviceLocal);
        missing_of(result.err().unwrap())
    };
    let storage = caps.max_storage_range.min(caps.max_buffer_bytes);
    assert!(refuse(storage + 1, Usage::STORAGE).contains(&storage.to_string()));
    let texels = (caps.max_texel_elements * 4).min(caps.max_buffer_bytes);
    let message = refuse(texels + 1, Usage::texel(TexelFormat::R32Uint));
    assert!(message.contains(&texels.to_string()));
    assert!(refuse(u64::MAX, Usage::TRANSFER).contains(&caps.max_buffer_bytes.to_string()));
    // Acceleration structures need a device that was opened for them.
    assert!(refuse(64, Usage::ACCELERATION_INPUT).contains("without ray tracing"));

    let kernel = Kernel::new(&device, 4);
    let groups = [1, caps.max_groups[1].saturating_add(1), 1];
    if caps.max_groups[1] < u32::MAX {
        let result = device.run("too much", |commands| {
            commands.dispatch(&kernel.pipeline, &kernel.set, &kernel.push, groups);
        });
        assert!(missing_of(result.err().unwrap()).contains("at most"));
    }
    drop(kernel);
    finish(device);
}

/// Set in the child process of [`exhausted_memory_is_an_error`].
const CHILD: &str = "ETENDUE_TEST_EXHAUST_MEMORY";

/// Address space of the child, KiB: enough for the driver, too little for [`HOGS`] buffers.
const CHILD_KIB: u64 = 8 << 20;

/// Buffers of 1 GiB that the child asks for.
const HOGS: u64 = 12;

/// On a device that computes on the processor, memory is exhausted where the process
/// reaches its limit of address space. So the test runs itself again under such a limit.
#[test]
#[cfg(target_os = "linux")]
fn exhausted_memory_is_an_error() {
    if std::env::var_os(CHILD).is_some() {
        return exhaust_memory();
    }
    let Some(device) = open(false) else { return };
    let kind = device.caps().kind;
    finish(device);
    if kind != DeviceKind::Cpu {
        println!("skipped: a limit of address space does not bound the memory of a GPU");
        return;
    }
    let output = Command::new("sh")
        .args(["-c", &format!("ulimit -v {CHILD_KIB}; exec \"$0\" \"$@\"")])
        .arg(std::env::current_exe().unwrap())
        .args([
            "--exact",
            "buffers::exhausted_memory_is_an_error",
            "--nocapture",
        ])
        .env(CHILD, "1")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && text.contains("1 passed"),
        "{output:?}"
    );
}

#[cfg(target_os = "linux")]
fn exhaust_memory() {
    let device = Device::open(&DeviceRequest::default()).unwrap();
    let bytes = 1 << 30;
    let new = || Buffer::new(&device, "hog", bytes, Usage::TRANSFER, Memory::DeviceLocal);
    let (buffers, errors): (Vec<_>, Vec<_>) = (0..HOGS).map(|_| new()).partition(Result::is_ok);
    let error = errors.into_iter().next().unwrap().err().unwrap();
    assert!(
        matches!(&error, Error::OutOfMemory { what, bytes: b } if *b == bytes && what.contains("hog")),
        "{error}"
    );
    // What was freed can be had again.
    drop(buffers);
    assert!(new().is_ok());
}
