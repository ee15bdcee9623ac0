//! The render world's part: cameras of windows are turned to the small pictures once they are extracted, and
//! the pictures are stretched over the windows.

use super::screens::{Screen, Screens};
use bevy::asset::{embedded_asset, load_embedded_asset};
use bevy::camera::visibility::RenderLayers;
use bevy::camera::{ImageRenderTarget, NormalizedRenderTarget, Viewport};
use bevy::core_pipeline::{Core2d, Core2dSystems};
use bevy::ecs::system::SystemState;
use bevy::pbr::{ExtractedDirectionalLight, ExtractedPointLight};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::render::camera::{ExtractedCamera, MipBias, TemporalJitter};
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::binding_types::{sampler, texture_2d};
use bevy::render::render_resource::{
    BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId, ColorTargetState, ColorWrites,
    FilterMode, FragmentState, PipelineCache, RenderPassDescriptor, RenderPipelineDescriptor, Sampler, SamplerBindingType,
    SamplerDescriptor, ShaderStages, TextureFormat, TextureSampleType, VertexState,
};
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::sync_world::MainEntity;
use bevy::render::texture::GpuImage;
use bevy::render::view::{ExtractedView, NoIndirectDrawing, RenderVisibleEntities, ViewTarget, ViewUniformOffset};
use bevy::render::{Render, RenderStartup, RenderSystems};
use std::time::{Duration, Instant};

/// Time between two frames that draw nothing: as a display would set the pace.
const PACE: Duration = Duration::from_millis(8);

/// Makes the shader part of the program.
pub(super) fn embed(app: &mut App) {
    embedded_asset!(app, "stretch.wgsl");
}

pub(super) fn build(render: &mut SubApp) {
    render
        .add_systems(RenderStartup, make_stretch)
        .add_systems(
            Render,
            turn.after(RenderSystems::ExtractCommands).before(RenderSystems::PrepareAssets).before(RenderSystems::PrepareMeshes),
        )
        // As Bevy's own for its upscaling: whoever makes pipelines takes turns at the cache.
        .add_systems(Render, prepare.in_set(RenderSystems::Prepare).ambiguous_with_all())
        .add_systems(Render, (measure, pace).chain().in_set(RenderSystems::Cleanup))
        .add_systems(Core2d, stretch.in_set(Core2dSystems::Prepass));
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
    Query<'w, 's, Turned<'static>>,
    Query<'w, 's, &'static mut ExtractedDirectionalLight>,
    Query<'w, 's, &'static mut ExtractedPointLight>,
);

/// Turns the cameras of windows to their pictures; lets them draw nothing while they are not due.
fn turn(world: &mut World, state: &mut SystemState<Turn>) -> Result {
    let mut idle = vec![];
    let (screens, mut cameras, mut suns, mut lamps) = state.get_mut(world)?;
    if screens.windows.is_empty() {
        return Ok(());
    }
    if !screens.has_shadows {
        suns.iter_mut().for_each(|mut sun| sun.shadow_maps_enabled = false);
        lamps.iter_mut().for_each(|mut lamp| lamp.shadow_maps_enabled = false);
    }
    for (entity, main, mut camera, mut view, msaa) in &mut cameras {
        let Some(NormalizedRenderTarget::Window(window)) = &camera.target else { continue };
        let Some(screen) = screens.windows.get(&window.entity()) else { continue };
        if !screens.is_due {
            idle.push(entity);
        } else if main.entity() != screen.camera && !screens.full.contains(&main.entity()) {
            shrink(screen, &mut camera, &mut view);
            msaa.into_iter().for_each(|mut msaa| *msaa = Msaa::Off);
        }
    }
    for entity in idle {
        world.entity_mut(entity).remove::<Extracted>();
    }
    Ok(())
}

/// Turns a camera of the window to its picture.
fn shrink(screen: &Screen, camera: &mut ExtractedCamera, view: &mut ExtractedView) {
    let Some(whole) = camera.physical_target_size.filter(|size| size.min_element() > 0) else { return };
    let shrunk = |pixels: UVec2| (pixels.as_vec2() * screen.size.as_vec2() / whole.as_vec2()).round().as_uvec2();
    let mut part = camera.viewport.clone().unwrap_or(Viewport { physical_size: whole, ..default() });
    part.physical_position = shrunk(part.physical_position);
    part.physical_size = shrunk(part.physical_size).max(UVec2::ONE);
    part.clamp_to_size(screen.size);
    view.viewport = UVec4::from((part.physical_position, part.physical_size));
    camera.physical_viewport_size = Some(part.physical_size);
    camera.physical_target_size = Some(screen.size);
    camera.viewport = camera.viewport.take().map(|_| part);
    camera.target = Some(NormalizedRenderTarget::Image(ImageRenderTarget::from(screen.picture.clone())));
}

/// What the pictures are stretched with.
#[derive(Resource)]
struct Stretch {
    layout: BindGroupLayoutDescriptor,
    sampler: Sampler,
    shader: Handle<Shader>,
    pipelines: HashMap<TextureFormat, CachedRenderPipelineId>,
}

fn make_stretch(device: Res<RenderDevice>, assets: Res<AssetServer>, mut commands: Commands) {
    let entries = (texture_2d(TextureSampleType::Float { filterable: true }), sampler(SamplerBindingType::Filtering));
    let layout =
        BindGroupLayoutDescriptor::new("bevy_clay:screen", &BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, entries));
    let sampler = device.create_sampler(&SamplerDescriptor {
        label: Some("bevy_clay:screen"),
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        ..default()
    });
    let shader = load_embedded_asset!(assets.as_ref(), "stretch.wgsl");
    commands.insert_resource(Stretch { layout, sampler, shader, pipelines: HashMap::default() });
}

impl Stretch {
    fn descriptor(&self, format: TextureFormat) -> RenderPipelineDescriptor {
        let target = ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL };
        RenderPipelineDescriptor {
            label: Some("bevy_clay:screen".into()),
            layout: vec![self.layout.clone()],
            vertex: VertexState { shader: self.shader.clone(), entry_point: Some("vertex".into()), ..default() },
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                entry_point: Some("fragment".into()),
                targets: vec![Some(target)],
                ..default()
            }),
            ..default()
        }
    }
}

/// Makes the pipelines that the windows' formats need, so that no window is shown empty.
fn prepare(
    screens: Res<Screens>,
    views: Query<(&MainEntity, &ViewTarget)>,
    mut stretch: ResMut<Stretch>,
    mut cache: ResMut<PipelineCache>,
) {
    let is_screen = |main: &MainEntity| screens.windows.values().any(|screen| screen.camera == main.entity());
    for (_, view) in views.iter().filter(|(main, _)| is_screen(main)) {
        let format = view.main_texture_format();
        if !stretch.pipelines.contains_key(&format) {
            let pipeline = cache.queue_render_pipeline(stretch.descriptor(format));
            cache.block_on_render_pipeline(pipeline);
            stretch.pipelines.insert(format, pipeline);
        }
    }
}

/// Stretches a window's picture over the view of its camera.
fn stretch(
    view: ViewQuery<(&MainEntity, &ViewTarget)>,
    (screens, stretch): (Res<Screens>, Res<Stretch>),
    images: Res<RenderAssets<GpuImage>>,
    cache: Res<PipelineCache>,
    mut context: RenderContext,
) {
    let (main, target) = view.into_inner();
    let Some(screen) = screens.windows.values().find(|screen| screen.camera == main.entity()) else { return };
    let pipeline = stretch.pipelines.get(&target.main_texture_format()).and_then(|id| cache.get_render_pipeline(*id));
    let (Some(pipeline), Some(picture)) = (pipeline, images.get(&screen.picture)) else { return };
    let bindings = context.render_device().create_bind_group(
        "bevy_clay:screen",
        &cache.get_bind_group_layout(&stretch.layout),
        &BindGroupEntries::sequential((&picture.texture_view, &stretch.sampler)),
    );
    let mut pass = context.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("bevy_clay:screen"),
        color_attachments: &[Some(target.get_color_attachment())],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, &bindings, &[]);
    pass.draw(0..3, 0..1);
}

/// Learns when the device has drawn the windows.
fn measure(screens: Res<Screens>, queue: Res<RenderQueue>, device: Res<RenderDevice>) {
    if screens.is_due && !screens.windows.is_empty() {
        let meter = screens.meter.clone();
        queue.on_submitted_work_done(move || meter.end());
    }
    // An error here is the loss of the device, which Bevy hears of by itself.
    let _ = device.poll(wgpu::PollType::Poll);
}

/// Holds frames that draw nothing to a pace: no window does.
fn pace(screens: Res<Screens>, mut last: Local<Option<Instant>>) {
    let rest = last.map_or(Duration::ZERO, |last| PACE.saturating_sub(last.elapsed()));
    if !screens.is_due && !screens.windows.is_empty() {
        std::thread::sleep(rest);
    }
    *last = Some(Instant::now());
}
