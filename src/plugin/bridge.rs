//! The app's graphics device, and both worlds' hold on an engine that runs there.

use crate::sim::engine::EngineError;
use crate::sim::gpu::{GpuDevice, GpuEngine, GpuError, GpuLink};
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy::render::renderer::{RenderAdapterInfo, RenderDevice, RenderQueue};
use bevy::tasks::futures::now_or_never;

/// Counts the app's graphics devices: in the main world as they come, in the render world as they are taken
/// over from there. wgpu numbers devices anew after a loss, so that the next one equals the first.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct DeviceNumber(u64);

/// Counts on where Bevy has put in another device, which it does between two frames of the app.
pub(super) fn count(device: Option<Res<RenderDevice>>, mut number: ResMut<DeviceNumber>) {
    if device.is_some_and(|device| device.is_changed()) {
        number.0 += 1;
    }
}

/// The app's device, if it renders.
#[derive(SystemParam)]
pub(super) struct AppDevice<'w> {
    device: Option<Res<'w, RenderDevice>>,
    queue: Option<Res<'w, RenderQueue>>,
    info: Option<Res<'w, RenderAdapterInfo>>,
    number: Option<Res<'w, DeviceNumber>>,
}

impl AppDevice<'_> {
    /// The device as it is now; none without [`GpuPlugin`](super::gpu::GpuPlugin), which runs what is done
    /// there.
    pub(super) fn get(&self) -> Option<SharedDevice> {
        let (device, queue, info) = (self.device.as_ref()?, self.queue.as_ref()?, self.info.as_ref()?);
        let number = self.number.as_ref()?;
        let (device, info) = (device.wgpu_device().clone(), wgpu::AdapterInfo::clone(info));
        Some(SharedDevice { device: GpuDevice { device, queue: wgpu::Queue::clone(queue), info }, number: **number })
    }
}

/// A device of the app.
#[derive(Clone)]
pub(super) struct SharedDevice {
    device: GpuDevice,
    number: DeviceNumber,
}

impl PartialEq for SharedDevice {
    fn eq(&self, other: &Self) -> bool {
        self.is(other.number)
    }
}

impl SharedDevice {
    /// Whether it is the device of this number.
    pub(super) fn is(&self, number: DeviceNumber) -> bool {
        self.number == number
    }

    /// The device itself.
    pub(super) fn wgpu(&self) -> &wgpu::Device {
        &self.device.device
    }

    /// Whether the adapter is a graphics processor.
    pub(super) fn is_hardware(&self) -> bool {
        use wgpu::DeviceType::{DiscreteGpu, IntegratedGpu, VirtualGpu};
        matches!(self.device.info.device_type, DiscreteGpu | IntegratedGpu | VirtualGpu)
    }

    /// An engine on it. Compiles shaders: takes its time.
    pub(super) fn engine(&self) -> Result<(GpuEngine, Bridge), GpuError> {
        let (engine, link) = GpuEngine::linked(self.device.clone())?;
        Ok((engine, Bridge { device: self.clone(), link }))
    }
}

/// Both worlds' hold on one engine.
#[derive(Clone)]
pub(super) struct Bridge {
    pub(super) device: SharedDevice,
    pub(super) link: GpuLink,
}

impl Bridge {
    /// Stops the engine for what went wrong in the render world.
    pub(super) fn fail(&self, reason: String) {
        self.link.fail(EngineError::Stopped(reason));
    }

    /// The passes that wait as a command buffer; nothing if there are none, or if the device finds them
    /// faulty.
    pub(super) fn record(&self) -> Option<wgpu::CommandBuffer> {
        let device = &self.device.device.device;
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("bevy_clay:frame") });
        let is_recorded = self.link.encode(&mut encoder);
        let commands = is_recorded.then(|| encoder.finish());
        // Ready at once on every native back end.
        if let Some(Some(error)) = now_or_never(scope.pop()) {
            self.fail(error.to_string());
            return None;
        }
        commands
    }
}
