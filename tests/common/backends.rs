//! What the device of the tests traces rays with. Our own tree is always first.

use etendue::gpu;
use etendue::settings::BackendChoice;

/// Whether a test may not be skipped: with the environment variable `ETENDUE_REQUIRE_DEVICE`. Its value `1`
/// asks for every traversal (lavapipe has them), another one only for a device (`scripts/gpu.sh`).
pub fn is_device_required() -> bool {
    std::env::var_os("ETENDUE_REQUIRE_DEVICE").is_some()
}

/// Every traversal that a device here offers; the printed reasons why others are left out. All of them without any
/// device and where all are required: opening them tells why there is none.
pub fn offered() -> Vec<BackendChoice> {
    let all = [
        BackendChoice::Bvh,
        BackendChoice::RayQuery,
        BackendChoice::RayPipeline,
    ];
    let are_all_required = std::env::var_os("ETENDUE_REQUIRE_DEVICE").is_some_and(|v| v == "1");
    let Ok(devices) = gpu::enumerate() else {
        return all.to_vec();
    };
    let missing = |backend: &BackendChoice| {
        let lacks = |caps: &gpu::Caps| match backend {
            BackendChoice::RayQuery => caps.ray_query.clone().err(),
            BackendChoice::RayPipeline => caps.ray_pipeline.clone().err(),
            _ => None,
        };
        let reasons: Option<Vec<String>> = devices.iter().map(lacks).collect();
        reasons.map(|reasons| reasons.join("; "))
    };
    let is_offered = |backend: &BackendChoice| match missing(backend) {
        Some(reason) if !are_all_required => {
            println!("skipped: {}: no device has {reason}", backend.name());
            false
        }
        _ => true,
    };
    all.into_iter().filter(is_offered).collect()
}

/// Our own tree and the first traversal of the device's own: what every test can afford. (A ray tracing
/// pipeline would meet the triangles of ray query once more.)
pub fn pair() -> Vec<BackendChoice> {
    offered().into_iter().take(2).collect()
}
