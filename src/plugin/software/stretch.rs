//! The pictures are stretched over their windows, and what panels and texts there are is laid over them. A
//! window whose panels are not drawn anew shows those of before: they are kept in a texture.

use super::screens::Screens;
use bevy::asset::{embedded_asset, load_embedded_asset};
use bevy::core_pipeline::Core2d;
use bevy::core_pipeline::upscaling::upscaling;
use bevy::ecs::entity::EntityHashMap;
use bevy::ecs::schedule::{ScheduleBuildSettings, ScheduleLabel};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::render::camera::ExtractedCamera;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::binding_types::{sampler, texture_2d};
use bevy::render::render_resource::{
    BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId, ColorTargetState, ColorWrites,
    Extent3d, FilterMode, FragmentState, PipelineCache, RenderPassDescriptor, RenderPipelineDescriptor, Sampler,
    SamplerBindingType, SamplerDescriptor, ShaderStages, Texture, TextureDescriptor, TextureDimension, TextureFormat,
    TextureSampleType, TextureUsages, TextureView, TextureViewDescriptor, VertexState,
};
use bevy::render::renderer::{RenderContext, RenderDevice, ViewQuery};
use bevy::render::sync_world::MainEntity;
use bevy::render::texture::GpuImage;
use bevy::render::view::ViewTarget;
use bevy::render::{Render, RenderStartup, RenderSystems};

/// What a camera runs that shows a window's picture and draws nothing.
#[derive(ScheduleLabel, Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Present;

/// Makes the shader part of the program.
pub(super) fn embed(app: &mut App) {
    embedded_asset!(app, "stretch.wgsl");
}

pub(super) fn build(render: &mut SubApp) {
    let mut present = Schedule::new(Present);
    // As Bevy's own: commands are for the frame's other schedules.
    present.set_build_settings(ScheduleBuildSettings { auto_insert_apply_deferred: false, ..default() });
    render
        .init_resource::<Overlays>()
        .add_schedule(present)
        .add_systems(RenderStartup, make_stretch)
        // As Bevy's own for its upscaling: whoever makes pipelines takes turns at the cache.
        .add_systems(Render, prepare.in_set(RenderSystems::Prepare).ambiguous_with_all())
        .add_systems(Core2d, stretch.after(upscaling))
        .add_systems(Present, stretch);
}

/// What panels and texts look like, by window.
#[derive(Resource, Default)]
pub(super) struct Overlays(EntityHashMap<Overlay>);

/// That of a window.
struct Overlay {
    texture: Texture,
    view: TextureView,
    format: TextureFormat,
}

impl Overlay {
    fn new(size: Extent3d, format: TextureFormat, device: &RenderDevice) -> Self {
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("bevy_clay:panels"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&TextureViewDescriptor::default());
        Self { texture, view, format }
    }
}

impl Overlays {
    /// Whether there is one of this size.
    pub(super) fn has(&self, window: Entity, size: Option<UVec2>) -> bool {
        let found = self.0.get(&window).map(|overlay| UVec2::new(overlay.texture.width(), overlay.texture.height()));
        found.is_some() && found == size
    }
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
    let colour = || texture_2d(TextureSampleType::Float { filterable: true });
    let entries = (colour(), sampler(SamplerBindingType::Filtering), colour());
    let layout =
        BindGroupLayoutDescriptor::new("bevy_clay:screen", &BindGroupLayoutEntries::sequential(ShaderStages::FRAGMENT, entries));
    let sampler = device.create_sampler(&SamplerDescriptor {
        label: Some("bevy_clay:screen"),
        mag_filter: FilterMode::Linear,
        min_filter: FilterMode::Linear,
        ..default()
    });
    let shader = load_embedded_asset!(assets.as_ref(), "stretch.wgsl");
    // What another device had is gone with it.
    commands.insert_resource(Overlays::default());
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

/// Makes the pipelines that the windows' formats need, so that no window is shown empty, and the textures
/// that keep their panels.
fn prepare(
    screens: Res<Screens>,
    views: Query<(&MainEntity, &ViewTarget)>,
    device: Res<RenderDevice>,
    (mut stretch, mut overlays): (ResMut<Stretch>, ResMut<Overlays>),
    mut cache: ResMut<PipelineCache>,
) {
    overlays.0.retain(|window, _| screens.windows.contains_key(window));
    for (main, view) in &views {
        let Some((window, _)) = screens.shown_by(main.entity()) else { continue };
        let Some(format) = view.out_texture_view_format() else { continue };
        if !stretch.pipelines.contains_key(&format) {
            let pipeline = cache.queue_render_pipeline(stretch.descriptor(format));
            cache.block_on_render_pipeline(pipeline);
            stretch.pipelines.insert(format, pipeline);
        }
        let (size, format) = (view.main_texture().size(), view.main_texture_format());
        if overlays.0.get(&window).is_none_or(|overlay| overlay.texture.size() != size || overlay.format != format) {
            overlays.0.insert(window, Overlay::new(size, format, &device));
        }
    }
}

/// Stretches a window's picture over it, and lays over that what its camera has drawn.
fn stretch(
    view: ViewQuery<(&MainEntity, &ViewTarget, &ExtractedCamera)>,
    (screens, stretch, overlays): (Res<Screens>, Res<Stretch>, Res<Overlays>),
    images: Res<RenderAssets<GpuImage>>,
    cache: Res<PipelineCache>,
    mut context: RenderContext,
) {
    let (main, target, camera) = view.into_inner();
    let Some((window, screen)) = screens.shown_by(main.entity()) else { return };
    let format = target.out_texture_view_format();
    let pipeline = format.and_then(|format| stretch.pipelines.get(&format)).and_then(|id| cache.get_render_pipeline(*id));
    let found = (pipeline, images.get(&screens.picture(screen).image), overlays.0.get(&window));
    let (Some(pipeline), Some(picture), Some(overlay)) = found else { return };
    if camera.schedule != Present.intern() {
        let (from, to) = (target.main_texture().as_image_copy(), overlay.texture.as_image_copy());
        context.command_encoder().copy_texture_to_texture(from, to, overlay.texture.size());
    }
    let bindings = context.render_device().create_bind_group(
        "bevy_clay:screen",
        &cache.get_bind_group_layout(&stretch.layout),
        &BindGroupEntries::sequential((&picture.texture_view, &stretch.sampler, &overlay.view)),
    );
    let Some(window) = target.out_texture_color_attachment(Some(LinearRgba::BLACK)) else { return };
    let mut pass = context.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("bevy_clay:screen"),
        color_attachments: &[Some(window)],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, &bindings, &[]);
    pass.draw(0..3, 0..1);
}
