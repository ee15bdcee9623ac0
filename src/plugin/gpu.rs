//! The GPU engine inside Bevy's frame: its passes are recorded into the render graph, before any camera, on
//! the app's own device.
//!
//! What the clay gets wrong there never ends the app: its commands are checked before they are submitted, a
//! fault stops the engine, and the clay goes on elsewhere. See `recover` for a device that is lost.

use super::bridge::{self, Bridge, DeviceNumber};
use super::engine::ClayEngine;
use bevy::core_pipeline::schedule::camera_driver;
use bevy::prelude::*;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderGraph, RenderGraphSystems};
use bevy::render::{Extract, ExtractSchedule, Render, RenderApp, RenderSystems};

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

/// Drives GPU engines from the render world; does nothing in an app without one. Without it the graphics
/// device is left alone: clay runs on the CPU engine, and the processor makes its surface.
#[derive(Clone, Copy, Debug, Default)]
pub struct GpuPlugin;

impl Plugin for GpuPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<DeviceNumber>().add_systems(First, bridge::count);
    }

    fn finish(&self, app: &mut App) {
        let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
        render
            .init_resource::<Bridges>()
            .init_resource::<DeviceNumber>()
            .add_systems(ExtractSchedule, extract)
            .add_systems(RenderGraph, record.in_set(RenderGraphSystems::Render).before(camera_driver))
            .add_systems(Render, submitted.in_set(RenderSystems::Cleanup));
    }
}

/// Takes over the engines of the main world.
fn extract(
    engines: Extract<Query<&ClayEngine>>,
    device: Extract<Res<DeviceNumber>>,
    mut bridges: ResMut<Bridges>,
    mut number: ResMut<DeviceNumber>,
) {
    *number = **device;
    bridges.all.clear();
    bridges.all.extend(engines.iter().filter(|e| e.stopped.is_none()).filter_map(|e| e.bridge.clone()));
}

/// Records the passes of every engine on this device.
pub(super) fn record(mut context: RenderContext, device: Res<DeviceNumber>, mut bridges: ResMut<Bridges>) {
    let Bridges { all, recorded } = &mut *bridges;
    recorded.clear();
    for bridge in all.iter().filter(|b| b.device.is(*device)) {
        if let Some(commands) = bridge.record() {
            context.add_command_buffer(commands);
            recorded.push(bridge.clone());
        }
    }
}

/// Tells the engines that their commands are on their way, and asks the device what has ended: on this thread
/// nothing else is submitted meanwhile, and a lost device tells only who asks.
fn submitted(device: Res<RenderDevice>, mut bridges: ResMut<Bridges>) {
    bridges.recorded.drain(..).for_each(|bridge| bridge.link.submitted());
    if !bridges.all.is_empty() {
        // An error here is the loss of the device, which Bevy hears of by itself.
        let _ = device.poll(wgpu::PollType::Poll);
    }
}
