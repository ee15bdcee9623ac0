//! The render world's part: cameras of windows are turned to the pictures once they are extracted, and draw
//! when they are due.

use super::screens::{Picture, Screens};
use super::stretch::{Overlays, Present};
use bevy::camera::visibility::RenderLayers;
use bevy::camera::{ImageRenderTarget, NormalizedRenderTarget, Viewport};
use bevy::ecs::schedule::ScheduleLabel;
use bevy::ecs::system::SystemState;
use bevy::pbr::{ExtractedDirectionalLight, ExtractedPointLight};
use bevy::prelude::*;
use bevy::render::camera::{ExtractedCamera, MipBias, SortedCameras, TemporalJitter, sort_cameras};
use bevy::render::render_resource::PipelineCache;
use bevy::render::renderer::{RenderDevice, RenderQueue};
use bevy::render::sync_world::MainEntity;
use bevy::render::view::{ExtractedView, NoIndirectDrawing, RenderVisibleEntities, ViewUniformOffset};
use bevy::render::{Render, RenderSystems};
use std::time::{Duration, Instant};

/// Time between two frames that draw nothing: as a slow display would set the pace. A frame of an app with
/// panels takes a processor 5 to 9 ms.
const PACE: Duration = Duration::from_millis(20);

pub(super) fn build(render: &mut SubApp) {
    render
        .add_systems(
            Render,
            turn.after(RenderSystems::ExtractCommands).before(RenderSystems::PrepareAssets).before(RenderSystems::PrepareMeshes),
        )
        .add_systems(Render, arrange.after(sort_cameras).in_set(RenderSystems::CreateViews))
        .add_systems(Render, (measure, pace).chain().in_set(RenderSystems::Cleanup));
}

/// What makes a camera draw; as Bevy takes it from cameras that are not active.
type Extracted = (
    ExtractedCamera,
    ExtractedView,
    RenderVisibleEntities,
    TemporalJitter,
    MipBias,
    RenderLayers,
    Projection,
    NoIndirectDrawing,
    ViewUniformOffset,
);

/// What is turned of a camera.
type Turned<'a> = (Entity, &'a MainEntity, &'a mut ExtractedCamera, &'a mut ExtractedView, Option<&'a mut Msaa>);

/// What is turned: the cameras, and the lights, whose shadows are left out.
type Turn<'w, 's> = (
    Res<'w, Screens>,
    Res<'w, Overlays>,
    Query<'w, 's, Turned<'static>>,
    Query<'w, 's, &'static mut ExtractedDirectionalLight>,
    Query<'w, 's, &'static mut ExtractedPointLight>,
);

/// Turns the cameras of windows to their pictures; lets them draw nothing while they are not due, and the one
/// that shows the picture nothing else while panels are not.
fn turn(world: &mut World, state: &mut SystemState<Turn>) -> Result {
    let mut idle = vec![];
    let (screens, overlays, mut cameras, mut suns, mut lamps) = state.get_mut(world)?;
    if screens.windows.is_empty() {
        return Ok(());
    }
    if !screens.has_shadows {
        suns.iter_mut().for_each(|mut sun| sun.shadow_maps_enabled = false);
        lamps.iter_mut().for_each(|mut lamp| lamp.shadow_maps_enabled = false);
    }
    for (entity, main, mut camera, mut view, msaa) in &mut cameras {
        let Some(NormalizedRenderTarget::Window(window)) = &camera.target else { continue };
        let window = window.entity();
        let Some(screen) = screens.windows.get(&window) else { continue };
        let is_screen = main.entity() == screen.camera;
        let is_picture = !is_screen && !screens.full.contains(&main.entity());
        if !screens.due.is_any || is_picture && !screens.due.is_view {
            idle.push(entity);
        } else if is_picture {
            shrink(screens.picture(screen), &mut camera, &mut view);
            msaa.into_iter().for_each(|mut msaa| *msaa = Msaa::Off);
        } else if is_screen && !screens.due.is_panels && overlays.has(window, camera.physical_target_size) {
            camera.schedule = Present.intern();
        }
    }
    for entity in idle {
        world.entity_mut(entity).remove::<Extracted>();
    }
    Ok(())
}

/// Turns a camera of the window to its picture.
fn shrink(picture: &Picture, camera: &mut ExtractedCamera, view: &mut ExtractedView) {
    let Some(whole) = camera.physical_target_size.filter(|size| size.min_element() > 0) else { return };
    let shrunk = |pixels: UVec2| (pixels.as_vec2() * picture.size.as_vec2() / whole.as_vec2()).round().as_uvec2();
    let mut part = camera.viewport.clone().unwrap_or(Viewport { physical_size: whole, ..default() });
    part.physical_position = shrunk(part.physical_position);
    part.physical_size = shrunk(part.physical_size).max(UVec2::ONE);
    part.clamp_to_size(picture.size);
    view.viewport = UVec4::from((part.physical_position, part.physical_size));
    camera.physical_viewport_size = Some(part.physical_size);
    camera.physical_target_size = Some(picture.size);
    camera.viewport = camera.viewport.take().map(|_| part);
    camera.target = Some(NormalizedRenderTarget::Image(ImageRenderTarget::from(picture.image.clone())));
}

/// Has each picture drawn before it is stretched. Among cameras of the same order Bevy has those of windows
/// come first: the window would show the picture before, and nothing at first.
fn arrange(screens: Res<Screens>, mains: Query<&MainEntity>, mut cameras: ResMut<SortedCameras>) {
    let is_screen = |camera: Entity| {
        let main = mains.get(camera).map(|main| main.entity());
        main.is_ok_and(|main| screens.shown_by(main).is_some())
    };
    cameras.0.sort_by_key(|camera| (camera.order, is_screen(camera.entity)));
}

/// Learns when the device has drawn the windows, and whether all that there was.
fn measure(screens: Res<Screens>, cache: Res<PipelineCache>, queue: Res<RenderQueue>, device: Res<RenderDevice>) {
    if screens.due.is_any && !screens.windows.is_empty() {
        let meter = screens.meter.clone();
        meter.note(cache.waiting_pipelines().next().is_some());
        queue.on_submitted_work_done(move || meter.end());
    }
    // An error here is the loss of the device, which Bevy hears of by itself.
    let _ = device.poll(wgpu::PollType::Poll);
}

/// Holds frames that draw nothing to a pace: no window does.
fn pace(screens: Res<Screens>, mut last: Local<Option<Instant>>) {
    let rest = last.map_or(Duration::ZERO, |last| PACE.saturating_sub(last.elapsed()));
    if !screens.due.is_any && !screens.windows.is_empty() {
        std::thread::sleep(rest);
    }
    *last = Some(Instant::now());
}
