//! The library's one error type. Each message says what was attempted, on what,
//! and, where it is known, what to do about it.

use std::path::PathBuf;

/// Shorthand for results of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that a caller cannot foresee. Broken invariants panic instead.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be opened, read or written.
    #[error("{action} {}: {source}", path.display())]
    Io {
        /// What was attempted, as a verb: `read`, `write`, `rename` …
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A scene file that is broken, outside its limits, or asks for what is not supported.
    #[error("scene {}: {what}", path.display())]
    Scene {
        /// The scene file.
        path: PathBuf,
        /// What is wrong with it, where, and what would be right.
        what: String,
    },
    /// A setting out of range or at odds with another.
    #[error("setting {name}: {what}")]
    Settings {
        /// The setting as the user types it, e.g. `--spp`.
        name: &'static str,
        /// What is wrong and what would be right.
        what: String,
    },
    /// A file of another render than the one at hand.
    #[error("{}: {field} does not fit: {what}", path.display())]
    Mismatch {
        /// The file.
        path: PathBuf,
        /// What differs, by its name in headers.
        field: &'static str,
        /// What it is there and here.
        what: String,
    },
    /// A file that another process is going to write.
    #[error("{} is in use by another render; wait for it or name another file", path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// No device, or none that can run what was asked for.
    #[error("{what}: {missing}")]
    Unsupported {
        /// What was asked for: a backend, a device.
        what: String,
        /// What is missing, and which package or device would give it.
        missing: String,
    },
    /// Host or device memory is exhausted, or a limit of the device is exceeded.
    #[error("out of memory: {what} needs {bytes} bytes")]
    OutOfMemory {
        /// What the memory was for.
        what: String,
        /// How much was asked for, bytes.
        bytes: u64,
    },
    /// A Vulkan call failed.
    #[error("{op}: {result}")]
    Vulkan {
        /// The call or step.
        op: String,
        /// Vulkan's code.
        result: ash::vk::Result,
    },
    /// The device went away; everything on it is gone.
    #[error("device lost during {pass}")]
    DeviceLost {
        /// The pass that was running.
        pass: String,
    },
    /// An image could not be encoded or decoded.
    #[error("image {}: {what}", path.display())]
    Image {
        /// The image file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}
