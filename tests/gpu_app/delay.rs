//! How old what is drawn is: vertices read back from where Bevy's cameras take them.

use super::{DX, app_in_step, check, metrics, settle};
use bevy::prelude::*;
use bevy::render::mesh::allocator::{MeshAllocator, MeshAllocatorSettings};
use bevy::render::render_resource::BufferUsages;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::{Render, RenderApp, RenderSystems};
use bevy::time::TimeUpdateStrategy;
use bevy_clay::prelude::*;
use glam::DVec3;
use libtest_mimic::Failed;
use std::ops::Range;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Wall and clay time of a frame [s].
const FRAME: f64 = 0.005;
const GRAVITY: f64 = 9.81;
/// Words of a vertex: position, normal, number of its edge.
const VERTEX_WORDS: usize = 7;

/// What is looked at, and what was seen.
#[derive(Default)]
struct Seen {
    mesh: Option<AssetId<Mesh>>,
    /// Least height [m] of what was drawn of it last.
    height: Option<f32>,
}

#[derive(Resource, Clone, Default)]
struct Look(Arc<Mutex<Seen>>);

/// Words of a buffer's part.
fn read(device: &RenderDevice, queue: &RenderQueue, buffer: &wgpu::Buffer, words: Range<usize>) -> Vec<u32> {
    let size = 4 * words.len() as u64;
    let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
    let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
    let staging = device.wgpu_device().create_buffer(&descriptor);
    let mut encoder = device.wgpu_device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 4 * words.start as u64, &staging, 0, size);
    queue.submit([encoder.finish()]);
    staging.slice(..).map_async(wgpu::MapMode::Read, |result| result.expect("mapped"));
    device.wgpu_device().poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
    bytemuck::pod_collect_to_vec(&staging.slice(..).get_mapped_range())
}

/// The lowest corner of all triangles that have a size.
fn look(look: Res<Look>, device: Res<RenderDevice>, queue: Res<RenderQueue>, allocator: Res<MeshAllocator>) {
    let mut look = look.0.lock().expect("the look");
    let Some(id) = look.mesh else { return };
    let (Some(vertices), Some(indices)) = (allocator.mesh_vertex_slice(&id), allocator.mesh_index_slice(&id)) else { return };
    let words = |range: &Range<u32>, each: usize| range.start as usize * each..range.end as usize * each;
    let corners = read(&device, &queue, vertices.buffer, words(&vertices.range, VERTEX_WORDS));
    let triangles = read(&device, &queue, indices.buffer, words(&indices.range, 1));
    let height = |v: &u32| f32::from_bits(corners[*v as usize * VERTEX_WORDS + 1]);
    let sized = triangles.chunks(3).filter(|t| t[0] != t[1]);
    look.height = sized.flatten().map(height).reduce(f32::min);
}

/// Clay in free fall is drawn where the last frame that was reported left it, in the same frame of the app;
/// with the GPU engine where the last one did that the device has run, which may not have been reported yet.
pub(super) fn frame_drawn_is_the_frame_simulated() -> Result<(), Failed> {
    for engine in [EngineChoice::Native, EngineChoice::Gpu] {
        let mut app = app_in_step();
        let seen = Look::default();
        let render = app.get_sub_app_mut(RenderApp).ok_or("no render world")?;
        render.world_mut().get_resource_or_init::<MeshAllocatorSettings>().extra_buffer_usages |= BufferUsages::COPY_SRC;
        render.insert_resource(seen.clone()).add_systems(Render, look.in_set(RenderSystems::Cleanup));
        let gravity = Some(DVec3::NEG_Y * GRAVITY);
        let settings = ClaySettings { engine, gravity, surface: SurfaceBackend::Gpu, is_responsive: false, ..default() };
        let clay = app.world_mut().spawn((Clay::snapshot(super::cube()), settings)).id();
        settle(&mut app, "the surface", |world| metrics(world, clay).triangle_count > 0)?;
        seen.0.lock().expect("the look").mesh = app.world().get::<Mesh3d>(clay).map(|mesh| mesh.id());
        app.update();
        let height = || seen.0.lock().expect("the look").height.map(f64::from).ok_or("nothing is drawn");
        let start = height()?;
        let fall = |time: f64| GRAVITY * time * time / 2.0;
        let mut wrong = None;
        let mut is_done = |world: &World| {
            let pending = world.get::<ClayEngine>(clay).map_or(0, ClayEngine::pending);
            let under_way = if engine == EngineChoice::Gpu { pending as f64 * FRAME } else { 0.0 };
            let time = metrics(world, clay).time;
            // The frame before the third left it a tenth of a cell higher.
            let range = (fall(time) - 0.04 * DX)..=(fall(time + under_way) + 0.04 * DX);
            match height().map(|height| start - height) {
                Ok(fallen) if range.contains(&fallen) => {}
                fallen => wrong = Some(format!("{engine:?}: fell by {fallen:?} m, expected {range:?}, after {time:.3} s")),
            }
            wrong.is_some() || pending == 0
        };
        for _ in 0..5 {
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(FRAME)));
            app.update();
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
            settle(&mut app, "a frame", &mut is_done)?;
        }
        if let Some(wrong) = wrong {
            return Err(wrong.into());
        }
        check(metrics(app.world(), clay).time > 4.5 * FRAME, "the clay stands")?;
    }
    Ok(())
}
