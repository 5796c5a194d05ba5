//! Finding and opening devices.

use etendue::Error;
use etendue::gpu::{Device, DeviceKind, DeviceRequest, enumerate};

use crate::{Rays, is_required, missing_of};

#[test]
fn devices_are_listed_and_selected() {
    let devices = match enumerate() {
        Ok(devices) => devices,
        Err(error @ Error::Unsupported { .. }) if !is_required(Rays::None) => {
            println!("skipped: {error}");
            return;
        }
        Err(error) => panic!("{error}"),
    };
    for (index, caps) in devices.iter().enumerate() {
        assert_eq!(caps.index, index);
        assert!(!caps.name.is_empty());
        // A device that traces rays also computes, and a CPU never traces by circuits.
        assert!(caps.compute.is_ok() || caps.ray_query.is_err());
        assert!(caps.compute.is_ok() || caps.ray_pipeline.is_err());
        assert!(!caps.ray_hardware_likely || caps.kind != DeviceKind::Cpu);
        assert!(!caps.ray_hardware_likely || caps.ray_query.is_ok());
        for missing in [&caps.compute, &caps.ray_query, &caps.ray_pipeline]
            .into_iter()
            .filter_map(|r| r.as_ref().err())
        {
            assert!(!missing.is_empty(), "what is missing has a name");
        }
    }
    let Some(able) = devices.iter().find(|caps| caps.compute.is_ok()) else {
        assert!(!is_required(Rays::None), "no device computes");
        println!("skipped: no device computes");
        return;
    };
    let select = |select: &str| {
        let request = DeviceRequest {
            select: Some(select),
            ..DeviceRequest::default()
        };
        Device::open(&request)
    };
    let by_index = select(&able.index.to_string()).unwrap();
    assert_eq!(by_index.caps().index, able.index);
    let by_name = select(&able.name.to_uppercase()).unwrap();
    assert_eq!(by_name.caps().name, able.name);
    let message = missing_of(select("no such device").err().unwrap());
    assert!(message.contains("no such device") && message.contains(&able.name));
}
