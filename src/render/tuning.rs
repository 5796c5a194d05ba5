//! What tests and measurements may change of a render, and the picture stays the same.

use super::{geometry, passes};

/// Details that do not change the picture; for tests and measurements.
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
    /// Whether kernels read the scene's arrays by their addresses, where the device can; `None`: on CPUs that gather.
    pub addresses: Option<bool>,
    /// Whether the device's own structures hold boxes, and shaders test the triangles in them; `None`: on CPUs, whose
    /// own test has gaps at edges.
    pub boxes: Option<bool>,
    /// Renders by a kernel that is slower and tells more.
    pub study: Study,
}

/// Kernels for the limit report; for our own tree only.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Study {
    /// The kernel that everybody uses.
    #[default]
    None,
    /// Traces every ray twice: the same image, later by the time that traversal takes.
    Twice,
    /// Counts what traversal does.
    Counts,
}

/// What traversal did in a pass.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default)]
pub struct TraversalCounts {
    pub rays: u64,
    /// Nodes visited.
    pub nodes: u64,
    /// Leaf records read.
    pub records: u64,
    /// Steps that lanes made.
    pub steps: u64,
    /// Steps that all lanes of their subgroups had time for.
    pub lane_steps: u64,
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
            study: Study::None,
        }
    }
}
