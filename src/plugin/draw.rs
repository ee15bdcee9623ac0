//! The surface straight on the graphics device: passes write it into the mesh that Bevy draws, in the frame
//! in which the clay moves.
//!
//! The mesh is an asset like any other, so that materials, shadows and any number of cameras see it; its
//! vertices and indices stand in the slabs of Bevy's mesh allocator, where the passes write them each frame
//! before any camera. How many are drawn is settled when the asset is made: the mesh is as large as its
//! capacity, and triangles that are not there are points. Where the capacity is too small, the next one takes
//! its place.

mod drawn;
mod passes;

pub(super) use drawn::Drawn;

use super::bridge::{AppDevice, SharedDevice};
use super::clay::{Clay, ClaySettings, MeshQuality, SurfaceBackend};
use super::engine::ClayEngine;
use super::held::HeldTime;
use super::schedule::ClaySystems;
use super::show::{self, DrawnByDevice};
use crate::sim::gpu::GpuError;
use crate::surface::field::Tier;
use crate::surface::gpu::SurfaceKernels;
use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::NoAutoAabb;
use bevy::core_pipeline::schedule::camera_driver;
use bevy::prelude::*;
use bevy::render::mesh::allocator::MeshAllocatorSettings;
use bevy::render::render_resource::BufferUsages;
use bevy::render::renderer::{RenderGraph, RenderGraphSystems};
use bevy::render::{Extract, ExtractSchedule, Render, RenderApp, RenderSystems};
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use drawn::{Capacity, Job, JobSource, SLAB_MAX};
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
    /// What went wrong.
    pub(super) fn reason(&self) -> &str {
        &self.reason
    }
}

/// The compiled passes of the app's device.
#[derive(Resource, Default)]
struct Compiled {
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
}

/// Makes surfaces on the graphics device; does nothing in an app without one.
pub(super) struct DrawPlugin;

impl Plugin for DrawPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Compiled>().add_systems(Update, choose.in_set(ClaySystems::Show).before(show::swap));
        open_slabs(app);
    }

    fn finish(&self, app: &mut App) {
        // The renderer may have been added after this plugin.
        open_slabs(app);
        let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
        render
            .init_resource::<passes::Surfaces>()
            .add_systems(ExtractSchedule, extract)
            .add_systems(
                RenderGraph,
                passes::record.in_set(RenderGraphSystems::Render).after(super::gpu::record).before(camera_driver),
            )
            .add_systems(Render, passes::submitted.in_set(RenderSystems::Cleanup));
    }
}

/// Lets passes write into the slabs of meshes, of a size that a binding may have.
fn open_slabs(app: &mut App) {
    let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
    let mut settings = render.world_mut().get_resource_or_init::<MeshAllocatorSettings>();
    settings.extra_buffer_usages |= BufferUsages::STORAGE;
    settings.max_slab_size = settings.max_slab_size.min(SLAB_MAX);
    settings.large_threshold = settings.large_threshold.min(SLAB_MAX);
}

/// What is drawn now.
type Shown<'a> = (Option<&'a Drawn>, Option<&'a Declined>, Has<MeshMaterial3d<StandardMaterial>>);

/// What the mesh is put into.
type Store<'w> = (Option<ResMut<'w, Assets<Mesh>>>, Option<ResMut<'w, Assets<StandardMaterial>>>);

/// Chooses where each clay's surface is made; gives those that the device makes a mesh that is large enough.
fn choose(
    mut clays: Query<(Entity, &ClaySettings, &ClayEngine, Shown), With<Clay>>,
    app: AppDevice,
    (meshes, mut materials): Store,
    mut compiled: ResMut<Compiled>,
    mut commands: Commands,
    mut held: ResMut<HeldTime>,
) {
    let _watch = held.watch();
    let Some(mut meshes) = meshes else { return };
    let device = app.get();
    for (entity, settings, engine, (drawn, declined, has_material)) in &mut clays {
        let mut entity = commands.entity(entity);
        let generation = engine.generation;
        let is_declined = |device: &&SharedDevice| declined.is_some_and(|d| (d.generation, &d.device) == (generation, *device));
        let wanted = device.as_ref().filter(|device| is_wanted_on(device, settings) && !is_declined(device));
        if declined.is_some() && wanted.is_some() {
            entity.remove::<Declined>();
        }
        let ready = wanted.and_then(|device| Some((device.clone(), compiled.get(device)?)));
        let (Some((device, kernels)), Some(domain)) = (ready, engine.domain()) else {
            if drawn.is_some() {
                // The next surface of the processor takes the mesh's place.
                entity.remove::<(Drawn, DrawnByDevice, Mesh3d, Aabb)>();
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
                warn!("a clay's surface is made on the processor: {reason}");
                entity.insert(Declined { reason, generation, device });
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
        entity.insert((Mesh3d(mesh.clone()), Aabb::from_min_max(low, high), NoAutoAabb));
        let drawn = Drawn { mesh, capacity, tier, domain, generation, kernels, device, told: Arc::default() };
        entity.insert((drawn, DrawnByDevice));
        if let Some(materials) = materials.as_mut().filter(|_| !has_material) {
            entity.insert(MeshMaterial3d(materials.add(show::clay_material())));
        }
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
            None => JobSource::Processor(engine.revision, engine.surface_deferred()?),
        };
        Some(Job { entity, drawn: drawn.clone(), source })
    };
    surfaces.set_jobs(clays.iter().filter_map(job).collect());
}
