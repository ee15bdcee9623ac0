//! The surface straight on the graphics device: passes write it into the mesh that Bevy draws, in the frame
//! in which the clay moves.
//!
//! The mesh is an asset like any other, so that materials, shadows and any number of cameras see it; its
//! vertices and indices stand in the slabs of Bevy's mesh allocator, where the passes write them each frame
//! before any camera. How many are drawn is settled when the asset is made: the mesh is as large as its
//! capacity, and triangles that are not there are points. Where the capacity is too small, the next one takes
//! its place.
//!
//! The passes bind the mesh's own parts of the slabs alone, so slabs are as large as the app has them. What
//! [`DrawPlugin`] changes in the app is one thing: buffers of Bevy's mesh allocator get the usage `STORAGE`
//! beside their own. They keep the usages that they were made with, all meshes share those of indices, and
//! whether some clay is to be drawn from there may be settled at any time: so it is asked for at the start.
//! Where a buffer has it not, or is laid out otherwise than the passes write it, the processor makes the
//! surface, and `ClayStatus::error` says so.

mod drawn;
mod layout;
mod passes;

pub(super) use drawn::Drawn;

use super::bridge::{AppDevice, DeviceNumber, SharedDevice};
use super::clay::{Clay, ClaySettings, MeshQuality, SurfaceBackend};
use super::engine::ClayEngine;
use super::entity;
use super::held::HeldTime;
use super::schedule::ClaySystems;
use super::show::{self, DrawnByDevice};
use crate::sim::gpu::GpuError;
use crate::surface::field::Tier;
use crate::surface::gpu::SurfaceKernels;
use bevy::camera::primitives::Aabb;
use bevy::core_pipeline::schedule::camera_driver;
use bevy::prelude::*;
use bevy::render::mesh::allocator::MeshAllocatorSettings;
use bevy::render::render_resource::BufferUsages;
use bevy::render::renderer::{RenderGraph, RenderGraphSystems};
use bevy::render::{Extract, ExtractSchedule, Render, RenderApp, RenderSystems};
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use drawn::{Capacity, Job, JobSource};
use std::sync::Arc;

/// Triangles that the first mesh of a clay has room for.
const CAPACITY_FIRST: u32 = 16_384;

/// Why the device does not make a clay's surface after all, until its engine or the device is another.
#[derive(Component, Clone)]
pub(super) struct Declined {
    reason: String,
    generation: u64,
    device: SharedDevice,
}

impl Declined {
    /// What went wrong, in one line.
    pub(super) fn reason(&self) -> &str {
        &self.reason
    }
}

/// The compiled passes of the app's device.
#[derive(Resource, Default)]
pub(super) struct Compiled {
    device: Option<SharedDevice>,
    under_way: Option<Task<Result<SurfaceKernels, GpuError>>>,
    kernels: Option<SurfaceKernels>,
    /// Why no surface is made on it.
    fault: Option<String>,
}

impl Compiled {
    /// The passes of `device`, once they are compiled.
    fn get(&mut self, device: &SharedDevice) -> Option<SurfaceKernels> {
        if self.device.as_ref() != Some(device) {
            let wgpu = device.wgpu().clone();
            let under_way = AsyncComputeTaskPool::get().spawn(async move { SurfaceKernels::new(&wgpu) });
            *self = Self { device: Some(device.clone()), under_way: Some(under_way), ..Self::default() };
        }
        match self.under_way.as_mut().and_then(check_ready) {
            Some(Ok(kernels)) => (self.kernels, self.under_way) = (Some(kernels), None),
            Some(Err(error)) => {
                warn!("clay surfaces are made on the processor: {error}");
                (self.fault, self.under_way) = (Some(error.to_string()), None);
            }
            None => {}
        }
        self.kernels.clone().filter(|_| self.fault.is_none())
    }

    /// Whether they are being compiled.
    pub(super) fn is_under_way(&self) -> bool {
        self.under_way.is_some()
    }
}

/// Makes surfaces on the graphics device; does nothing in an app without one. Without it the processor makes
/// all surfaces, and the buffers of Bevy's mesh allocator are as the app has them.
#[derive(Clone, Copy, Debug, Default)]
pub struct DrawPlugin;

impl Plugin for DrawPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Compiled>()
            .add_observer(end)
            .add_systems(Update, choose.in_set(ClaySystems::Show).before(show::swap));
    }

    fn finish(&self, app: &mut App) {
        let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
        render.world_mut().get_resource_or_init::<MeshAllocatorSettings>().extra_buffer_usages |= BufferUsages::STORAGE;
        render
            .init_resource::<passes::Surfaces>()
            .add_systems(ExtractSchedule, extract)
            .add_systems(
                RenderGraph,
                passes::record
                    .run_if(resource_exists::<DeviceNumber>)
                    .in_set(RenderGraphSystems::Render)
                    .after(super::gpu::record)
                    .before(camera_driver),
            )
            .add_systems(Render, passes::upload.run_if(resource_exists::<DeviceNumber>).in_set(RenderSystems::PrepareResources))
            .add_systems(Render, passes::submitted.in_set(RenderSystems::Cleanup));
    }
}

/// Has every surface on the device made by the processor, for what went wrong there.
pub(super) fn fail(render: &World, reason: &str) {
    if let Some(surfaces) = render.get_resource::<passes::Surfaces>() {
        surfaces.fail(reason);
    }
}

/// Ends what the device draws of a [`Clay`] that goes.
fn end(gone: On<Remove, Clay>, mut commands: Commands) {
    commands.entity(gone.entity).try_remove::<(Drawn, DrawnByDevice, Declined)>().queue_silenced(entity::hide);
}

/// What the device draws of a clay, or why it does not.
type Shown<'a> = (Option<&'a Drawn>, Option<&'a Declined>);

/// Chooses where each clay's surface is made; gives those that the device makes a mesh that is large enough.
fn choose(
    clays: Query<(Entity, &ClaySettings, &ClayEngine, Shown), With<Clay>>,
    app: AppDevice,
    meshes: Option<ResMut<Assets<Mesh>>>,
    mut compiled: ResMut<Compiled>,
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let Some(mut meshes) = meshes else { return };
    let device = app.get();
    for (entity, settings, engine, (drawn, declined)) in &clays {
        let mut entity = commands.entity(entity);
        let generation = engine.generation;
        let is_declined = |device: &&SharedDevice| declined.is_some_and(|d| (d.generation, &d.device) == (generation, *device));
        let wanted = device.as_ref().filter(|device| is_wanted_on(device, settings));
        let is_settled = wanted.is_some_and(|device| is_declined(&device));
        if declined.is_some() && !is_settled {
            entity.try_remove::<Declined>();
        }
        let wanted = wanted.filter(|_| !is_settled);
        let ready = wanted.and_then(|device| Some((device.clone(), compiled.get(device)?)));
        let (Some((device, kernels)), Some(domain)) = (ready, engine.domain()) else {
            if drawn.is_some() {
                // The next surface of the processor takes the mesh's place.
                entity.try_remove::<(Drawn, DrawnByDevice)>().queue_silenced(entity::hide);
            }
            continue;
        };
        // What was said of another engine's clay counts no more.
        let told = drawn.filter(|d| d.generation == generation);
        let capacity = drawn.map_or(Capacity::of_triangles(CAPACITY_FIRST), |d| d.capacity);
        let capacity = told.map_or(Ok(capacity), Drawn::capacity_wanted);
        let capacity = match told.and_then(Drawn::take_fault).map_or(capacity, Err) {
            Ok(capacity) => capacity,
            Err(reason) => {
                let reason = reason.split_whitespace().collect::<Vec<_>>().join(" ");
                warn!("a clay's surface is made on the processor: {reason}");
                entity.queue_silenced(entity::put(Declined { reason, generation, device }));
                continue;
            }
        };
        let tier = if settings.mesh == MeshQuality::Coarse { Tier::Coarse } else { Tier::Fine };
        let is_same_room = |d: &&Drawn| (d.capacity, d.domain) == (capacity, domain) && d.device == device;
        if drawn.filter(is_same_room).is_some_and(|d| (d.tier, d.generation) == (tier, generation)) {
            continue;
        }
        let (low, high) = domain.corners();
        let (low, high) = (low.as_vec3(), high.as_vec3());
        // Another tier or engine in the same room goes on in the same mesh.
        let kept = drawn.filter(is_same_room).map(|d| d.mesh.clone());
        let mesh = kept.unwrap_or_else(|| meshes.add(capacity.placeholder((low, high))));
        entity.queue_silenced(entity::show(mesh.clone(), Aabb::from_min_max(low, high)));
        let drawn = Drawn { mesh, capacity, tier, domain, generation, kernels, device, told: Arc::default() };
        entity.queue_silenced(entity::put((drawn, DrawnByDevice)));
    }
}

/// Whether the surface of clay with these settings is to be made on the app's device.
fn is_wanted_on(device: &SharedDevice, settings: &ClaySettings) -> bool {
    let is_wanted = match settings.surface {
        SurfaceBackend::Auto => device.is_hardware(),
        SurfaceBackend::Cpu => false,
        SurfaceBackend::Gpu => true,
    };
    is_wanted && settings.mesh != MeshQuality::Off
}

/// Takes over what is to be drawn.
fn extract(clays: Extract<Query<(Entity, &ClayEngine, &Drawn)>>, mut surfaces: ResMut<passes::Surfaces>) {
    let job = |(entity, engine, drawn): (Entity, &ClayEngine, &Drawn)| {
        let source = match &engine.bridge {
            Some(bridge) => JobSource::Engine(bridge.clone()),
            None => JobSource::Processor(engine.revision, Some(engine.surface_deferred()?)),
        };
        Some(Job { entity, drawn: drawn.clone(), source })
    };
    surfaces.set_jobs(clays.iter().filter_map(job).collect());
}
