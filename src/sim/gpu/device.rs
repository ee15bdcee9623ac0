//! A device without a window, the limits that clay needs, and what to do where there is none.

use super::super::engine::{EngineError, StateLost};
use bytemuck::{Pod, pod_collect_to_vec};
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

/// Storage buffers that one pass binds at most.
pub(super) const STORAGE_BUFFERS: u32 = 8;

/// Why a device cannot run clay.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// No adapter answers.
    #[error("no graphics adapter: {0}")]
    NoAdapter(String),
    /// The adapter gave no device.
    #[error("the adapter gives no device: {0}")]
    NoDevice(String),
    /// A limit of the adapter.
    #[error("the adapter's {name} is {value}, needed are {needed}{}", fits.as_ref().map(|f| format!("; {f} at most fit")).unwrap_or_default())]
    Limit {
        /// The limit, as wgpu names it.
        name: &'static str,
        /// What the adapter has.
        value: u64,
        /// What is needed.
        needed: u64,
        /// The largest clay that fits, in words.
        fits: Option<String>,
    },
    /// The device refused a shader or a buffer.
    #[error("the device refused {what}: {reason}")]
    Refused {
        /// What was refused.
        what: String,
        /// The device's reason.
        reason: String,
    },
}

impl From<GpuError> for EngineError {
    fn from(error: GpuError) -> Self {
        Self::Device(Arc::new(error))
    }
}

/// A device and its queue, with the adapter they came from.
#[derive(Clone, Debug)]
pub struct GpuDevice {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The adapter.
    pub info: wgpu::AdapterInfo,
}

impl GpuDevice {
    /// The default adapter's device, with all its limits, for programs without a window. Blocks for as long
    /// as the driver takes.
    ///
    /// # Errors
    /// No adapter, or one that gives no device.
    pub fn headless() -> Result<Self, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let options =
            wgpu::RequestAdapterOptions { power_preference: wgpu::PowerPreference::HighPerformance, ..Default::default() };
        let adapter = wait(instance.request_adapter(&options)).map_err(|e| GpuError::NoAdapter(e.to_string()))?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("bevy_clay:device"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = wait(adapter.request_device(&descriptor)).map_err(|e| GpuError::NoDevice(e.to_string()))?;
        Ok(Self { device, queue, info: adapter.get_info() })
    }

    /// Whether the adapter is a processor that draws in software: the native engine is faster there.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// One line: the adapter, its driver and version.
    pub fn describe(&self) -> String {
        let i = &self.info;
        format!("{} ({} {})", i.name, i.driver, i.driver_info)
    }
}

/// What the environment variable `CLAY_GPU` says: whether tests and examples may or must use a graphics
/// adapter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GpuMode {
    /// `off`: no adapter is asked for.
    Off,
    /// `auto`, or unset: one is used if there is one.
    #[default]
    Auto,
    /// `require`: its absence is an error.
    Require,
}

impl GpuMode {
    /// Reads `CLAY_GPU`.
    ///
    /// # Errors
    /// A value that is none of `off`, `auto` and `require`, named.
    pub fn from_env() -> Result<Self, String> {
        match std::env::var("CLAY_GPU").as_deref() {
            Err(std::env::VarError::NotPresent) | Ok("auto" | "") => Ok(Self::Auto),
            Ok("off") => Ok(Self::Off),
            Ok("require") => Ok(Self::Require),
            other => Err(format!("CLAY_GPU = {other:?}: must be off, auto or require")),
        }
    }
}

/// Checks a number that is needed against a limit of the device.
pub(crate) fn check(name: &'static str, value: u64, needed: u64, fits: Option<String>) -> Result<(), GpuError> {
    if needed > value { Err(GpuError::Limit { name, value, needed, fits }) } else { Ok(()) }
}

/// Runs `work` and hands out what the device found wrong with it, instead of wgpu's own handler, which ends
/// the program.
pub(crate) fn guarded<T>(device: &wgpu::Device, what: &str, work: impl FnOnce() -> T) -> Result<T, GpuError> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = work();
    let errors = [wait(validation.pop()), wait(memory.pop())];
    match errors.into_iter().flatten().next() {
        Some(error) => Err(GpuError::Refused { what: what.into(), reason: error.to_string() }),
        None => Ok(made),
    }
}

/// What lies in `range` \[bytes\] of a buffer that is mapped.
///
/// wgpu frees all buffers of a device that the app destroys, those that are mapped too, in whatever poll
/// comes next. It cannot be asked whether it has, and panics where one is read then.
///
/// # Errors
/// The buffer went with its device.
pub(crate) fn read_mapped<T: Pod>(buffer: &wgpu::Buffer, range: Range<u64>) -> Result<Vec<T>, StateLost> {
    let read = || pod_collect_to_vec(&buffer.get_mapped_range(range));
    catch_unwind(AssertUnwindSafe(read)).map_err(|_| StateLost)
}

/// Waits for a future that the driver fulfils by itself: wgpu's are ready at once on all native back ends.
fn wait<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        match future.as_mut().poll(&mut context) {
            Poll::Ready(value) => return value,
            Poll::Pending => std::thread::yield_now(),
        }
    }
}
