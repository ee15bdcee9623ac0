//! The render world's part: particles to the device where they are not there, the passes into the slabs, what
//! they say back.

use super::super::bridge::{DeviceNumber, SharedDevice};
use super::drawn::{Drawn, Job, JobSource};
use super::layout::check_mesh;
use crate::sim::engine::Deferred;
use crate::sim::frame::{SurfaceParticle, SurfaceSource};
use crate::sim::gpu::{GpuError, guarded};
use crate::sim::params::Domain;
use crate::surface::field::{SurfaceSettings, Tier};
use crate::surface::gpu::{GpuSurface, MeshTarget, StatusReadback, SurfaceRoom, flag};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::mesh::allocator::MeshAllocator;
use bevy::render::render_asset::RenderAssets;
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue};
use bevy::tasks::futures::now_or_never;
use std::sync::{Mutex, PoisonError};

/// The surfaces of the frame that is rendered.
#[derive(Resource, Default)]
pub(super) struct Surfaces {
    /// In a mutex because what makes particles may be sent, and not shared.
    jobs: Mutex<Vec<Job>>,
    /// Of whom they are.
    drawn: Vec<Drawn>,
    made: HashMap<Entity, Made>,
}

impl Surfaces {
    pub(super) fn set_jobs(&mut self, jobs: Vec<Job>) {
        self.made.retain(|entity, _| jobs.iter().any(|job| job.entity == *entity));
        self.drawn = jobs.iter().map(|job| job.drawn.clone()).collect();
        self.jobs = Mutex::new(jobs);
    }

    /// Says why none of them can be made.
    pub(super) fn fail(&self, reason: &str) {
        for drawn in &self.drawn {
            drawn.told().fault.get_or_insert_with(|| reason.into());
        }
    }
}

/// A surface and what it is made for.
struct Made {
    tier: Tier,
    domain: Domain,
    device: SharedDevice,
    surface: GpuSurface,
    particle_count: u32,
    /// Particles from the processor, and in which state: engine and revision.
    upload: Option<(wgpu::Buffer, (u64, u64))>,
    /// Where the mesh stood when it was last written.
    place: Option<Place>,
    readback: StatusReadback,
}

/// A mesh's place in the slabs.
#[derive(Clone, Debug, PartialEq)]
struct Place {
    vertices: wgpu::Buffer,
    vertex_first: u32,
    indices: wgpu::Buffer,
    index_first: u32,
}

impl Made {
    fn new(drawn: &Drawn, particle_count: u32, room: SurfaceRoom) -> Result<Self, GpuError> {
        let settings = SurfaceSettings::new(drawn.tier);
        let surface = GpuSurface::with_grains(&drawn.kernels, &drawn.domain, particle_count, &settings, room)?;
        let readback = StatusReadback::new(drawn.device.wgpu());
        let (tier, domain, device) = (drawn.tier, drawn.domain, drawn.device.clone());
        Ok(Self { tier, domain, device, surface, particle_count, upload: None, place: None, readback })
    }

    /// Whether it is made for these particles and this mesh.
    fn fits(&self, drawn: &Drawn, particle_count: u32) -> bool {
        (self.tier, self.domain, self.particle_count) == (drawn.tier, drawn.domain, particle_count) && self.device == drawn.device
    }
}

/// Records the passes of every surface, after those of the engines and before any camera.
pub(super) fn record(
    mut context: RenderContext,
    device: Res<DeviceNumber>,
    queue: Res<RenderQueue>,
    slabs: (Res<MeshAllocator>, Res<RenderAssets<RenderMesh>>),
    mut surfaces: ResMut<Surfaces>,
) {
    let Surfaces { jobs, made, .. } = &mut *surfaces;
    let jobs = std::mem::take(jobs.get_mut().unwrap_or_else(PoisonError::into_inner));
    for job in jobs.into_iter().filter(|job| job.drawn.device.is(*device)) {
        let (entity, drawn) = (job.entity, job.drawn.clone());
        match one(job, made, &queue, (&slabs.0, &slabs.1)) {
            Ok(Some(commands)) => context.add_command_buffer(commands),
            Ok(None) => {}
            Err(reason) => {
                made.remove(&entity);
                drawn.told().fault.get_or_insert(reason);
            }
        }
    }
}

/// The commands of one surface; none while there is nothing to be made or nowhere to put it.
fn one(
    job: Job,
    made: &mut HashMap<Entity, Made>,
    queue: &RenderQueue,
    (allocator, meshes): (&MeshAllocator, &RenderAssets<RenderMesh>),
) -> Result<Option<wgpu::CommandBuffer>, String> {
    let Job { entity, drawn, source } = job;
    let id = drawn.mesh.id();
    let (Some(mesh), Some(vertices), Some(indices)) =
        (meshes.get(id), allocator.mesh_vertex_slice(&id), allocator.mesh_index_slice(&id))
    else {
        return Ok(None);
    };
    check_mesh(mesh, [vertices.buffer, indices.buffer].map(|buffer| buffer.usage()))?;
    let place = Place {
        vertices: (**vertices.buffer).clone(),
        vertex_first: vertices.range.start,
        indices: (**indices.buffer).clone(),
        index_first: indices.range.start,
    };
    let Some(particles) = particles(&drawn, entity, &source, made)? else { return Ok(None) };
    let Some(surface) = made.get_mut(&entity) else { return Ok(None) };
    let device = drawn.device.wgpu();
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("bevy_clay:surface") });
    let target = MeshTarget {
        vertices: &place.vertices,
        vertex_first: place.vertex_first,
        vertex_capacity: vertices.range.len() as u32,
        indices: &place.indices,
        index_first: place.index_first,
        index_capacity: indices.range.len() as u32,
    };
    let is_elsewhere = surface.place.as_ref() != Some(&place);
    surface.surface.encode(queue, &mut encoder, (&particles, surface.particle_count), &target, is_elsewhere);
    surface.place = Some(place.clone());
    surface.readback.encode(&mut encoder, &surface.surface);
    let commands = encoder.finish();
    // Ready at once on every native back end.
    match now_or_never(scope.pop()) {
        Some(Some(error)) => Err(error.to_string()),
        _ => Ok(Some(commands)),
    }
}

/// The particles on the device, with a surface in `made` that fits them; none for clay without particles.
fn particles(
    drawn: &Drawn,
    entity: Entity,
    source: &JobSource,
    made: &mut HashMap<Entity, Made>,
) -> Result<Option<wgpu::Buffer>, String> {
    match source {
        JobSource::Engine(bridge) => {
            let Some((buffer, count)) = bridge.link.surface_particles().filter(|p| p.1 > 0) else { return Ok(None) };
            fit(drawn, entity, made, count)?;
            Ok(Some(buffer))
        }
        JobSource::Processor(revision, _) => {
            let state = (drawn.generation, *revision);
            let upload = made.get(&entity).and_then(|made| made.upload.as_ref());
            Ok(upload.filter(|upload| upload.1 == state).map(|upload| upload.0.clone()))
        }
    }
}

/// Takes the particles of clay on the processor to the device where they have changed: beside what else
/// prepares the frame, so that the passes need not wait for it.
pub(super) fn upload(device: Res<DeviceNumber>, queue: Res<RenderQueue>, mut surfaces: ResMut<Surfaces>) {
    let Surfaces { jobs, made, .. } = &mut *surfaces;
    let jobs = jobs.get_mut().unwrap_or_else(PoisonError::into_inner);
    for job in jobs.iter_mut().filter(|job| job.drawn.device.is(*device)) {
        let JobSource::Processor(revision, make) = &mut job.source else { continue };
        let Some(make) = make.take() else { continue };
        let state = (job.drawn.generation, *revision);
        if let Err(reason) = take_up(&job.drawn, job.entity, (state, make), made, &queue) {
            made.remove(&job.entity);
            job.drawn.told().fault.get_or_insert(reason);
        }
    }
}

/// Makes sure of a surface in `made` that fits, with the particles of this state.
fn take_up(
    drawn: &Drawn,
    entity: Entity,
    (state, make): ((u64, u64), Deferred<SurfaceSource>),
    made: &mut HashMap<Entity, Made>,
    queue: &RenderQueue,
) -> Result<(), String> {
    if let Some(known) = made.get(&entity)
        && known.fits(drawn, known.particle_count)
        && let Some(upload) = known.upload.clone().filter(|upload| upload.1 == state)
    {
        fit(drawn, entity, made, known.particle_count)?;
        // What is made anew, with more room, has no particles yet.
        made.entry(entity).and_modify(|made| made.upload = Some(upload));
        return Ok(());
    }
    let source = make().map_err(|e| e.to_string())?;
    let count = source.particles.len() as u32;
    if count == 0 {
        made.remove(&entity);
        return Ok(());
    }
    fit(drawn, entity, made, count)?;
    let Some(made) = made.get_mut(&entity) else { return Ok(()) };
    let upload = || {
        let buffer = made.upload.take().map_or_else(|| upload_buffer(drawn, count), |upload| upload.0);
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&source.particles));
        made.upload = Some((buffer, state));
    };
    guarded(drawn.device.wgpu(), "the surface's particles", upload).map_err(|e| e.to_string())
}

/// Makes a surface for `count` particles in `made`, if there is none that fits, or if the last status asks
/// for more room.
fn fit(drawn: &Drawn, entity: Entity, made: &mut HashMap<Entity, Made>, count: u32) -> Result<(), String> {
    let fitting = made.get(&entity).filter(|m| m.fits(drawn, count));
    let status = fitting.and_then(|made| made.readback.take());
    if let Some(status) = status {
        drawn.told().status = Some(status);
    }
    let room = fitting.map_or_else(|| SurfaceRoom::for_particles(count as usize), |m| m.surface.room());
    let needs_more = status.filter(|s| s.flags & (flag::BLOCKS_FULL | flag::SHEETS_FULL | flag::BODIES_FULL) != 0);
    let grown = needs_more.map_or(room, |status| room.grown(&status));
    if fitting.is_none() || grown != room {
        made.insert(entity, Made::new(drawn, count, grown).map_err(|e| e.to_string())?);
    } else if needs_more.is_some() {
        return Err("the clay has more cuts or bodies, or takes more room, than a surface on the device can have".into());
    }
    Ok(())
}

fn upload_buffer(drawn: &Drawn, count: u32) -> wgpu::Buffer {
    drawn.device.wgpu().create_buffer(&wgpu::BufferDescriptor {
        label: Some("bevy_clay:surface particles"),
        size: u64::from(count) * size_of::<SurfaceParticle>() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Asks for the statuses whose copies are on their way, and asks the device what has come.
pub(super) fn submitted(device: Res<RenderDevice>, surfaces: Res<Surfaces>) {
    surfaces.made.values().for_each(|made| made.readback.submitted());
    if !surfaces.made.is_empty() {
        // An error here is the loss of the device, which Bevy hears of by itself.
        let _ = device.poll(wgpu::PollType::Poll);
    }
}
