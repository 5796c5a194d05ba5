//! Devices that stay open, and kernels that stay compiled, from one render to the next.

use std::sync::{Arc, Mutex, PoisonError};

use crate::error::Result;
use crate::gpu::{Device, DeviceRequest};

/// Devices and their kernels, for renderers that come and go. Without one a renderer opens
/// and compiles for itself. Pictures are the same to the bit.
#[doc(hidden)]
#[derive(Default)]
pub struct Workshop(Mutex<Vec<Place>>);

struct Place {
    /// The request: device, validation, ray query, ray tracing pipeline.
    key: (Option<String>, [bool; 3]),
    device: Arc<Device>,
}

impl Workshop {
    /// One without devices; they are opened when they are asked for.
    #[must_use]
    pub const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// The device of this request, which keeps its pipelines.
    pub(super) fn open(&self, request: &DeviceRequest<'_>) -> Result<Arc<Device>> {
        let key = (
            request.select.map(str::to_owned),
            [request.validation, request.ray_query, request.ray_pipeline],
        );
        let mut places = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = places.iter().find(|place| place.key == key) {
            return Ok(Arc::clone(&place.device));
        }
        let device = Device::open(request)?;
        device.keep_pipelines();
        places.push(Place {
            key,
            device: Arc::clone(&device),
        });
        Ok(device)
    }
}

impl Drop for Workshop {
    fn drop(&mut self) {
        let places = self.0.get_mut().unwrap_or_else(PoisonError::into_inner);
        for place in places {
            place.device.forget_pipelines();
        }
    }
}
