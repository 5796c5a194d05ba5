//! Planted faults: each one is reported, so silence elsewhere means something.

use std::sync::Arc;

use etendue::gpu::{Buffer, Device, Memory, Usage, faults};

use crate::compute::Kernel;
use crate::open;

/// Commits one fault and asserts that exactly what was expected is reported.
fn assert_reported(rule: &str, commit: impl FnOnce(&Arc<Device>, &Kernel)) {
    let Some(device) = open(false) else { return };
    let kernel = Kernel::new(&device, 64);
    assert_eq!(device.validation_messages(), Vec::<String>::new());
    commit(&device, &kernel);
    drop(kernel);
    let log = device.validation_log();
    drop(device);
    let messages = log.messages();
    assert!(
        messages.iter().any(|m| m.contains(rule)),
        "{rule} is not in {messages:#?}"
    );
}

#[test]
fn validation_sees_a_missing_barrier() {
    assert_reported("SYNC-HAZARD-READ-AFTER-WRITE", |device, kernel| {
        let target = Buffer::new(device, "target", 64, Usage::TRANSFER, Memory::DeviceLocal);
        faults::missing_barrier(device, &kernel.sums, &target.unwrap()).unwrap();
    });
}

#[test]
fn validation_sees_too_many_groups() {
    assert_reported("VUID-vkCmdDispatch-groupCountY-00387", |device, kernel| {
        faults::too_many_groups(device, &kernel.pipeline, &kernel.set, &kernel.push).unwrap();
    });
}

#[test]
fn validation_sees_a_wrong_usage() {
    assert_reported(
        "VUID-VkWriteDescriptorSet-descriptorType-00331",
        |device, kernel| {
            faults::wrong_usage(device, &kernel.set, 9, &kernel.inputs[0]);
        },
    );
}

#[test]
fn validation_sees_a_copy_past_the_end() {
    assert_reported("VUID-vkCmdCopyBuffer-size-", |device, kernel| {
        faults::copy_past_end(device, &kernel.inputs[4], &kernel.sums).unwrap();
    });
}

#[test]
fn validation_sees_a_leak() {
    assert_reported("VUID-vkDestroyDevice-device-", |device, _| {
        faults::leaked_buffer(device).unwrap();
    });
}
