//! The Vulkan layer against a real device, under validation with synchronisation
//! validation: a clean run leaves no message, not even while its device is destroyed.
//!
//! Without a device the tests print why they are skipped; with the environment
//! variable `ETENDUE_REQUIRE_DEVICE=1` they fail instead.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "tests may unwrap, and they say why they skip"
)]

mod buffers;
mod compute;
mod devices;
mod rays;
mod validation;

use std::sync::Arc;

use etendue::Error;
use etendue::gpu::{Device, DeviceRequest};

/// Invocations a work group in the test kernels.
const GROUP: usize = 64;

/// How a device traces rays.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rays {
    None,
    Query,
    Pipeline,
}

/// A device under validation, or the printed reason why there is none.
fn open(ray_query: bool) -> Option<Arc<Device>> {
    open_for(if ray_query { Rays::Query } else { Rays::None })
}

fn open_for(rays: Rays) -> Option<Arc<Device>> {
    let request = DeviceRequest {
        select: None,
        validation: true,
        ray_query: rays == Rays::Query,
        ray_pipeline: rays == Rays::Pipeline,
    };
    match Device::open(&request) {
        Ok(device) => Some(device),
        Err(error @ Error::Unsupported { .. }) if !is_required(rays) => {
            println!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// A device is needed where the variable is set, and rays of its own where it is `1`.
fn is_required(rays: Rays) -> bool {
    std::env::var_os("ETENDUE_REQUIRE_DEVICE").is_some_and(|v| v == "1" || rays == Rays::None)
}

/// Destroys the device and asserts that validation had nothing to say.
fn finish(device: Arc<Device>) {
    let log = device.validation_log();
    let device =
        Arc::into_inner(device).expect("the test dropped everything that holds the device");
    drop(device);
    assert_eq!(log.messages(), Vec::<String>::new());
}

fn missing_of(error: Error) -> String {
    match error {
        Error::Unsupported { what, missing } => format!("{what}: {missing}"),
        error => panic!("expected Unsupported, got: {error}"),
    }
}
