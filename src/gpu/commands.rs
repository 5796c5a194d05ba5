//! Record, submit, wait: the only way work reaches the GPU.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::time::{Duration, Instant};

use ash::vk;

use super::buffer::Buffer;
use super::device::Device;
use super::failed;
use super::pipeline::{BindSet, Pipeline};
use crate::error::{Error, Result};

/// A fence is waited for in slices of this length, so that a wait shows up in the log.
const WAIT_SLICE: Duration = Duration::from_secs(5);

/// How long a [`Device::run`] took, seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuTime {
    /// Between the device's own timestamps; as `wall` where its queue has none.
    pub gpu: f64,
    /// From submission to completion as the host saw it.
    pub wall: f64,
}

/// A recording. It keeps alive what was recorded until the work is done.
pub struct Commands {
    device: Arc<Device>,
    pool: vk::CommandPool,
    raw: vk::CommandBuffer,
    fence: vk::Fence,
    timestamps: vk::QueryPool,
    keep: RefCell<Vec<Box<dyn Any>>>,
    /// Something was recorded since the last barrier.
    dirty: Cell<bool>,
    /// The first limit that was exceeded while recording.
    error: RefCell<Option<Error>>,
}

impl Drop for Commands {
    fn drop(&mut self) {
        let device = self.device.raw();
        // SAFETY: `submit` has waited, or nothing was submitted; null handles are ignored.
        // The pool frees its command buffer.
        unsafe {
            device.destroy_query_pool(self.timestamps, None);
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}

impl Device {
    /// Records commands, submits them and waits until they are done. `name` says
    /// in messages what was running. Fails with [`Error::DeviceLost`] when the device
    /// goes away and with [`Error::Unsupported`] when a recorded dispatch exceeds a limit.
    pub fn run(self: &Arc<Self>, name: &str, record: impl FnOnce(&Commands)) -> Result<GpuTime> {
        let commands = Commands::begin(self, name)?;
        record(&commands);
        commands.submit(name)
    }
}

impl Commands {
    /// Runs `groups` work groups of the pipeline. `push` must have the length that
    /// the pipeline was made with, and the set must have been made for it.
    /// What was recorded before is finished and visible first.
    pub fn dispatch(&self, pipeline: &Pipeline, set: &BindSet, push: &[u8], groups: [u32; 3]) {
        self.check(pipeline, set, push);
        assert!(
            pipeline.table().is_none(),
            "pipeline \"{}\" traces rays and has no work groups",
            pipeline.name()
        );
        let limit = self.device.caps().max_groups;
        if (0..3).any(|axis| groups[axis] > limit[axis]) {
            self.refuse(Error::Unsupported {
                what: format!(
                    "dispatch of {groups:?} work groups of \"{}\"",
                    pipeline.name()
                ),
                missing: format!("{} runs at most {limit:?}", self.device.caps().name),
            });
            return;
        }
        self.before_command();
        self.keep(set.clone());
        self.keep(pipeline.clone());
        self.bind(pipeline, set, push);
        // SAFETY: pipeline, set and push constants were just bound; the counts are within the limit.
        unsafe {
            self.device
                .raw()
                .cmd_dispatch(self.raw, groups[0], groups[1], groups[2]);
        }
    }

    /// Panics where the three do not belong together.
    pub(super) fn check(&self, pipeline: &Pipeline, set: &BindSet, push: &[u8]) {
        assert!(
            set.fits(pipeline) && pipeline.is_of(&self.device),
            "bind set \"{}\" was made for another pipeline than \"{}\"",
            set.name(),
            pipeline.name()
        );
        assert!(
            push.len() == pipeline.push_bytes() as usize,
            "pipeline \"{}\" takes {} bytes of push constants, not {}",
            pipeline.name(),
            pipeline.push_bytes(),
            push.len()
        );
    }

    /// Fills the buffer with zeros.
    pub fn fill_zero(&self, buffer: &Buffer) {
        assert!(buffer.is_of(&self.device), "a buffer of another device");
        self.before_command();
        self.keep(buffer.clone());
        // SAFETY: every buffer allows transfers and has a size that is a multiple of four.
        unsafe {
            self.device
                .raw()
                .cmd_fill_buffer(self.raw, buffer.raw(), 0, vk::WHOLE_SIZE, 0);
        }
    }

    /// Copies `bytes` between buffers that do not overlap. Panics where they would leave a buffer.
    pub fn copy(
        &self,
        source: &Buffer,
        source_offset: u64,
        target: &Buffer,
        target_offset: u64,
        bytes: u64,
    ) {
        assert!(
            source.is_of(&self.device) && target.is_of(&self.device),
            "a buffer of another device"
        );
        assert!(source.raw() != target.raw(), "a copy within one buffer");
        source.check_range(source_offset, bytes);
        target.check_range(target_offset, bytes);
        if bytes == 0 {
            return;
        }
        self.before_command();
        self.keep(source.clone());
        self.keep(target.clone());
        let region = vk::BufferCopy {
            src_offset: source_offset,
            dst_offset: target_offset,
            size: bytes,
        };
        // SAFETY: both ranges were checked and every buffer allows transfers.
        unsafe {
            self.device
                .raw()
                .cmd_copy_buffer(self.raw, source.raw(), target.raw(), &[region]);
        }
    }

    /// Everything before is finished and visible to everything after. Also
    /// inserted between any two commands, so callers need it only for emphasis.
    pub fn barrier(&self) {
        let barrier = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE);
        self.pipeline_barrier(vk::PipelineStageFlags::ALL_COMMANDS, barrier);
        self.dirty.set(false);
    }

    /// To be called before every command: orders it after the last one.
    pub(super) fn before_command(&self) {
        if self.dirty.replace(true) {
            self.barrier();
            self.dirty.set(true);
        }
    }

    /// Keeps an object alive until the work is done.
    pub(super) fn keep(&self, object: impl Any) {
        self.keep.borrow_mut().push(Box::new(object));
    }

    pub(super) fn device(&self) -> &Device {
        &self.device
    }

    pub(super) fn raw(&self) -> vk::CommandBuffer {
        self.raw
    }

    /// Binds a pipeline and what it reads.
    pub(super) fn bind(&self, pipeline: &Pipeline, set: &BindSet, push: &[u8]) {
        let device = self.device.raw();
        let point = pipeline.point();
        // SAFETY: the objects are alive and kept by the caller, the set's layout is the
        // pipeline's, and `push` fills the pipeline's range.
        unsafe {
            device.cmd_bind_pipeline(self.raw, point, pipeline.raw());
            let sets = [set.raw()];
            device.cmd_bind_descriptor_sets(self.raw, point, pipeline.layout(), 0, &sets, &[]);
            if !push.is_empty() {
                let stage = pipeline.stages();
                device.cmd_push_constants(self.raw, pipeline.layout(), stage, 0, push);
            }
        }
    }

    /// Starts a recording.
    pub(super) fn begin(device: &Arc<Device>, name: &str) -> Result<Self> {
        let mut this = Self {
            device: Arc::clone(device),
            pool: vk::CommandPool::null(),
            raw: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            timestamps: vk::QueryPool::null(),
            keep: RefCell::default(),
            dirty: Cell::new(false),
            error: RefCell::default(),
        };
        this.create()
            .map_err(failed(format!("prepare \"{name}\"")))?;
        device.set_name(this.raw, name);
        Ok(this)
    }

    fn create(&mut self) -> Result<(), vk::Result> {
        let device = self.device.raw();
        let family = self.device.caps().queue_family;
        let pool = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(family);
        // SAFETY: plain creations on a live device; each handle is stored in its owner at once.
        unsafe {
            self.pool = device.create_command_pool(&pool, None)?;
            self.fence = device.create_fence(&vk::FenceCreateInfo::default(), None)?;
        }
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(self.pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool was just made and is used by this thread only.
        self.raw = unsafe { device.allocate_command_buffers(&info) }?[0];
        let once = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: a fresh command buffer.
        unsafe { device.begin_command_buffer(self.raw, &once) }?;
        if self.device.caps().timestamp_bits > 0 {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2);
            // SAFETY: the queue has timestamps; the queries are reset before they are written.
            unsafe {
                self.timestamps = device.create_query_pool(&info, None)?;
                device.cmd_reset_query_pool(self.raw, self.timestamps, 0, 2);
                device.cmd_write_timestamp(
                    self.raw,
                    vk::PipelineStageFlags::TOP_OF_PIPE,
                    self.timestamps,
                    0,
                );
            }
        }
        Ok(())
    }

    /// Ends the recording, submits it and waits.
    fn submit(self, name: &str) -> Result<GpuTime> {
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        self.end().map_err(failed(name))?;
        let device = self.device.raw();
        let buffers = [self.raw];
        let info = vk::SubmitInfo::default().command_buffers(&buffers);
        let start = Instant::now();
        let queue = self.device.exclusive();
        // SAFETY: the recording is complete, the fence unsignalled, the queue locked.
        unsafe { device.queue_submit(*queue, &[info], self.fence) }.map_err(failed(name))?;
        if let Err(result) = self.wait(name) {
            // The work may still run: nothing that it uses may go before it does.
            // SAFETY: the queue is locked.
            let _ = unsafe { device.device_wait_idle() };
            return Err(failed(name)(result));
        }
        drop(queue);
        let wall = start.elapsed().as_secs_f64();
        let gpu = self.gpu_seconds().map_err(failed(name))?.unwrap_or(wall);
        Ok(GpuTime { gpu, wall })
    }

    fn end(&self) -> Result<(), vk::Result> {
        // What the GPU wrote becomes visible to the host.
        let barrier = vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ);
        self.pipeline_barrier(vk::PipelineStageFlags::HOST, barrier);
        let device = self.device.raw();
        // SAFETY: the buffer is being recorded; the second query was reset in `create`.
        unsafe {
            if self.timestamps != vk::QueryPool::null() {
                device.cmd_write_timestamp(
                    self.raw,
                    vk::PipelineStageFlags::BOTTOM_OF_PIPE,
                    self.timestamps,
                    1,
                );
            }
            device.end_command_buffer(self.raw)
        }
    }

    fn wait(&self, name: &str) -> Result<(), vk::Result> {
        let slice = WAIT_SLICE.as_nanos() as u64;
        let mut waited = Duration::ZERO;
        loop {
            // SAFETY: the fence belongs to a submission on this device.
            match unsafe {
                self.device
                    .raw()
                    .wait_for_fences(&[self.fence], true, slice)
            } {
                Err(vk::Result::TIMEOUT) => {
                    waited += WAIT_SLICE;
                    tracing::debug!(pass = name, seconds = waited.as_secs(), "still running");
                }
                result => return result,
            }
        }
    }

    /// Seconds between the two timestamps; `None` without timestamps.
    fn gpu_seconds(&self) -> Result<Option<f64>, vk::Result> {
        if self.timestamps == vk::QueryPool::null() {
            return Ok(None);
        }
        let mut ticks = [0u64; 2];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: both queries were written by the submission that has just completed.
        unsafe {
            self.device
                .raw()
                .get_query_pool_results(self.timestamps, 0, &mut ticks, flags)
        }?;
        let caps = self.device.caps();
        let mask = u64::MAX >> (64 - caps.timestamp_bits.min(64));
        let elapsed = ticks[1].wrapping_sub(ticks[0]) & mask;
        Ok(Some(elapsed as f64 * caps.timestamp_period * 1e-9))
    }

    fn pipeline_barrier(&self, target: vk::PipelineStageFlags, barrier: vk::MemoryBarrier<'_>) {
        // SAFETY: the buffer is being recorded; stages and accesses are valid on every queue.
        unsafe {
            self.device.raw().cmd_pipeline_barrier(
                self.raw,
                vk::PipelineStageFlags::ALL_COMMANDS,
                target,
                vk::DependencyFlags::empty(),
                &[barrier],
                &[],
                &[],
            );
        }
    }

    /// Makes the submission fail with this error, if it is the first.
    pub(super) fn refuse(&self, error: Error) {
        self.error.borrow_mut().get_or_insert(error);
    }
}
