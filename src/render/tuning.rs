//! What tests and measurements may change of a render.

use super::{geometry, passes};

/// Details that do not change the picture, unless they say so; for tests and measurements.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Tuning {
    /// Most samples of a pass; a power of two.
    pub max_pass: u64,
    /// Most tiles of a batch.
    pub max_tiles: u32,
    /// Shared meshes are copied into world space up to so many triangles.
    pub copy_limit: usize,
    /// Compiles in everything, whether the scene needs it or not.
    pub everything: bool,
    /// Stands for the bytes that are free on the device.
    pub device_bytes: Option<u64>,
    /// Whether few flat pieces are tested without a walk of our own tree; `None`: on CPUs, where it is faster.
    pub planes: Option<bool>,
    /// Whether a small tree of our own lies in uniform buffers; `None`: on CPUs, which read them faster. Never where
    /// kernels read by addresses.
    pub small: Option<bool>,
    /// Whether kernels read the scene's arrays by their addresses, where the device can; `None`: on CPUs that gather fast.
    pub addresses: Option<bool>,
    /// Whether the device's own structures hold boxes, and shaders test the triangles in them; `None`: on CPUs, whose
    /// own test has gaps at edges.
    pub boxes: Option<bool>,
    /// Whether photons may tell paths where to look. Without, the picture is another one of the same expected value.
    pub guide: bool,
    /// Renders by a kernel that is slower and tells more.
    pub study: Study,
}

/// Kernels for the limit report.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Study {
    /// The kernel that everybody uses.
    #[default]
    None,
    /// Counts what our own tree's traversal does.
    Counts,
    /// Keeps the rays that our own tree is asked, and what they meet.
    Record,
    /// Looks up what rays meet instead of tracing them: the same image, sooner by the time that traversal takes.
    Recall,
    /// Traces recorded rays, by any traversal, and renders nothing.
    Replay,
    /// Reads recorded rays, and neither traces them nor renders.
    Read,
}

impl Study {
    /// Whether the kernel reads or writes rays.
    pub(super) fn has_stream(self) -> bool {
        !matches!(self, Self::None | Self::Counts)
    }
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            max_pass: 1 << passes::MAX_PASS_LEVEL,
            max_tiles: u32::MAX,
            copy_limit: geometry::DEFAULT_COPY_LIMIT,
            everything: false,
            device_bytes: None,
            planes: None,
            small: None,
            addresses: None,
            boxes: None,
            guide: true,
            study: Study::None,
        }
    }
}
