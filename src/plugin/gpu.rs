//! The GPU engine inside Bevy's frame: its passes are recorded into the render graph, before any camera, on
//! the app's own device.
//!
//! What the clay gets wrong there never ends the app: its commands are checked before they are submitted, a
//! fault stops the engine, and the clay goes on elsewhere. See `recover` for a device that is lost.

use super::engine::ClayEngine;
use crate::sim::gpu::{GpuDevice, GpuEngine, GpuError, GpuLink};
use bevy::core_pipeline::schedule::camera_driver;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy::render::renderer::{RenderAdapterInfo, RenderContext, RenderDevice, RenderGraph, RenderGraphSystems, RenderQueue};
use bevy::render::{Extract, ExtractSchedule, Render, RenderApp, RenderSystems};
use bevy::tasks::futures::now_or_never;
use std::sync::{Arc, Mutex, PoisonError};

/// The app's device, if it renders.
#[derive(SystemParam)]
pub(super) struct AppDevice<'w> {
    device: Option<Res<'w, RenderDevice>>,
    queue: Option<Res<'w, RenderQueue>>,
    info: Option<Res<'w, RenderAdapterInfo>>,
}

impl AppDevice<'_> {
    /// The device as it is now.
    pub(super) fn get(&self) -> Option<SharedDevice> {
        let (device, queue, info) = (self.device.as_ref()?, self.queue.as_ref()?, self.info.as_ref()?);
        let (device, info) = (device.wgpu_device().clone(), wgpu::AdapterInfo::clone(info));
        Some(SharedDevice {
            device: GpuDevice { device, queue: wgpu::Queue::clone(queue), info },
            mark: RenderQueue::clone(queue),
        })
    }
}

/// A device of the app. wgpu numbers devices anew after a loss, so that the next one equals the first; Bevy's
/// queue tells them apart.
#[derive(Clone)]
pub(super) struct SharedDevice {
    device: GpuDevice,
    mark: RenderQueue,
}

impl PartialEq for SharedDevice {
    fn eq(&self, other: &Self) -> bool {
        self.is_of(&other.mark)
    }
}

impl SharedDevice {
    /// Whether it is the device of this queue.
    pub(super) fn is_of(&self, queue: &RenderQueue) -> bool {
        Arc::ptr_eq(&self.mark.0, &queue.0)
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
        Ok((engine, Bridge { device: self.clone(), link, fault: Arc::default() }))
    }
}

/// Both worlds' hold on one engine.
#[derive(Clone)]
pub(super) struct Bridge {
    pub(super) device: SharedDevice,
    pub(super) link: GpuLink,
    fault: Arc<Mutex<Option<String>>>,
}

impl Bridge {
    /// What went wrong in the render world, once.
    pub(super) fn take_fault(&self) -> Option<String> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Says what went wrong, for the main world to act on.
    fn fail(&self, reason: String) {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
    }

    /// The passes that wait as a command buffer; nothing if there are none, or if the device finds them
    /// faulty.
    fn record(&self) -> Option<wgpu::CommandBuffer> {
        let device = &self.device.device.device;
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("clay") });
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

/// The engines of the frame that is rendered.
#[derive(Resource, Default)]
pub(super) struct Bridges {
    all: Vec<Bridge>,
    /// Those whose commands go out with this frame.
    recorded: Vec<Bridge>,
}

impl Bridges {
    /// Stops every engine that runs on the app's device.
    pub(super) fn fail(&self, reason: &str) {
        self.all.iter().for_each(|bridge| bridge.fail(reason.into()));
    }
}

/// Drives GPU engines from the render world; does nothing in an app without one.
pub(super) struct GpuPlugin;

impl Plugin for GpuPlugin {
    fn build(&self, _: &mut App) {}

    fn finish(&self, app: &mut App) {
        let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
        render
            .init_resource::<Bridges>()
            .add_systems(ExtractSchedule, extract)
            .add_systems(RenderGraph, record.in_set(RenderGraphSystems::Render).before(camera_driver))
            .add_systems(Render, submitted.in_set(RenderSystems::Cleanup));
    }
}

/// Takes over the engines of the main world.
#[expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]
fn extract(engines: Extract<Query<&ClayEngine>>, mut bridges: ResMut<Bridges>) {
    bridges.all.clear();
    bridges.all.extend(engines.iter().filter(|e| e.stopped.is_none()).filter_map(|e| e.bridge.clone()));
}

/// Records the passes of every engine on this device.
#[expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]
pub(super) fn record(mut context: RenderContext, queue: Res<RenderQueue>, mut bridges: ResMut<Bridges>) {
    let Bridges { all, recorded } = &mut *bridges;
    recorded.clear();
    for bridge in all.iter().filter(|b| b.device.is_of(&queue)) {
        if let Some(commands) = bridge.record() {
            context.add_command_buffer(commands);
            recorded.push(bridge.clone());
        }
    }
}

/// Tells the engines that their commands are on their way, and asks the device what has ended: on this thread
/// nothing else is submitted meanwhile, and a lost device tells only who asks.
#[expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]
fn submitted(device: Res<RenderDevice>, mut bridges: ResMut<Bridges>) {
    bridges.recorded.drain(..).for_each(|bridge| bridge.link.submitted());
    if !bridges.all.is_empty() {
        // An error here is the loss of the device, which Bevy hears of by itself.
        let _ = device.poll(wgpu::PollType::Poll);
    }
}
