//! The clay's own look: its shader goes through the app's pipelines, and an app's material goes before it.

use super::{app_in_step, check, cube, settle};
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::render_resource::{CachedPipelineState, PipelineCache, PipelineDescriptor};
use bevy_clay::prelude::*;
use libtest_mimic::Failed;

/// An app that draws clay into an image, with the look; the clay has what `material` inserts.
fn app_with(material: impl Bundle) -> Result<(App, Entity), Failed> {
    let mut app = app_in_step();
    let world = app.world_mut();
    let picture = Image::new_target_texture(64, 64, wgpu::TextureFormat::Rgba8UnormSrgb, None);
    let picture = world.resource_mut::<Assets<Image>>().add(picture);
    let place = Transform::from_xyz(0.02, 0.05, 0.2).looking_at(Vec3::new(0.02, 0.05, 0.02), Vec3::Y);
    let lens = Projection::Perspective(PerspectiveProjection { near: 0.01, ..default() });
    world.spawn((Camera3d::default(), lens, place, RenderTarget::from(picture)));
    let settings = ClaySettings { engine: EngineChoice::Native, ..default() };
    let clay = world.spawn((Clay::snapshot(cube()), settings, ClayClock { paused: true, ..default() }, material)).id();
    settle(&mut app, "the clay's mesh", |world| world.get::<Mesh3d>(clay).is_some())?;
    Ok((app, clay))
}

/// Clay without a material is drawn with the look, by a pipeline that compiles, and with nothing else.
pub(super) fn clay_without_a_material_gets_the_look() -> Result<(), Failed> {
    let (mut app, clay) = app_with(())?;
    check(app.world().get::<MeshMaterial3d<ClayLookMaterial>>(clay).is_some(), "the clay has no look")?;
    check(app.world().get::<MeshMaterial3d<StandardMaterial>>(clay).is_none(), "it has another material beside it")?;
    let start = std::time::Instant::now();
    loop {
        app.update();
        let cache = app.get_sub_app(RenderApp).ok_or("no render world")?.world().resource::<PipelineCache>();
        let of_look = cache.pipelines().filter(|pipeline| match &pipeline.descriptor {
            PipelineDescriptor::RenderPipelineDescriptor(d) => d
                .fragment
                .as_ref()
                .is_some_and(|fragment| fragment.shader.path().is_some_and(|path| path.to_string().ends_with("look.wgsl"))),
            PipelineDescriptor::ComputePipelineDescriptor(_) => false,
        });
        for pipeline in of_look {
            match &pipeline.state {
                CachedPipelineState::Ok(_) => return Ok(()),
                CachedPipelineState::Err(error) if !format!("{error:?}").contains("NotLoaded") => {
                    return Err(format!("{error}").into());
                }
                _ => {}
            }
        }
        check(start.elapsed() < super::PATIENCE, "the clay is not drawn")?;
    }
}

/// Clay with a material of the app's keeps it.
pub(super) fn look_leaves_the_materials_of_the_app() -> Result<(), Failed> {
    let (app, clay) = app_with(MeshMaterial3d::<StandardMaterial>::default())?;
    check(app.world().get::<MeshMaterial3d<ClayLookMaterial>>(clay).is_none(), "the clay has a look beside its material")
}
