//! What the plugin puts on an entity to show its clay, and takes away again.

use super::{DX, GRAVITY, app, check, cube, metrics, plugins, settle, status, triangles};
use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::NoAutoAabb;
use bevy::ecs::component::ComponentId;
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::mesh::allocator::MeshAllocatorSettings;
use bevy::render::render_resource::AsBindGroup;
use bevy_clay::prelude::*;
use glam::DVec3;
use libtest_mimic::Failed;
use std::collections::BTreeSet;

/// A material of the app's own.
#[derive(Asset, TypePath, AsBindGroup, Clone, Default)]
struct Striped {}

impl Material for Striped {}

const BACKENDS: [SurfaceBackend; 2] = [SurfaceBackend::Cpu, SurfaceBackend::Gpu];

/// Clay on the processor's engine that rests where it is.
fn resting(surface: SurfaceBackend) -> (Clay, ClaySettings) {
    (Clay::snapshot(cube()), ClaySettings { engine: EngineChoice::Native, gravity: Some(DVec3::ZERO), surface, ..default() })
}

fn has<C: Component>(world: &World, entity: Entity) -> bool {
    world.get::<C>(entity).is_some()
}

/// Updates a few times, so that what comes a frame later has come.
fn pass(app: &mut App) {
    (0..5).for_each(|_| app.update());
}

/// Clay is drawn with one material: the app's, of any kind, whenever it is put there; the plugin's own where
/// there is none.
pub(super) fn clay_has_one_material() -> Result<(), Failed> {
    for surface in BACKENDS {
        let mut app = app();
        app.add_plugins(MaterialPlugin::<Striped>::default());
        let striped = MeshMaterial3d(app.world_mut().resource_mut::<Assets<Striped>>().add(Striped {}));
        let dressed = app.world_mut().spawn((resting(surface), striped.clone())).id();
        let plain = app.world_mut().spawn(resting(surface)).id();
        let is_shown = |world: &World| [dressed, plain].iter().all(|e| has::<Mesh3d>(world, *e));
        settle(&mut app, "the surfaces", is_shown)?;
        pass(&mut app);
        let own = |app: &App, entity| has::<MeshMaterial3d<ClayLookMaterial>>(app.world(), entity);
        check(!own(&app, dressed), format!("{surface:?}: clay with the app's material is drawn with the plugin's too"))?;
        check(own(&app, plain), format!("{surface:?}: clay without a material is not drawn"))?;
        app.world_mut().entity_mut(plain).insert(striped.clone());
        pass(&mut app);
        check(!own(&app, plain), format!("{surface:?}: the plugin's material stays beside the app's"))?;
        app.world_mut().entity_mut(plain).remove::<MeshMaterial3d<Striped>>();
        pass(&mut app);
        check(own(&app, plain), format!("{surface:?}: without the app's material the clay is not drawn"))?;
        let blue = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial::default());
        app.world_mut().entity_mut(plain).insert(MeshMaterial3d(blue.clone()));
        pass(&mut app);
        let now = app.world().get::<MeshMaterial3d<StandardMaterial>>(plain).map(|m| m.0.clone());
        check(now == Some(blue), format!("{surface:?}: the app's standard material is {now:?}"))?;
        check(!own(&app, plain), format!("{surface:?}: the plugin's material stays beside the app's standard one"))?;
    }
    Ok(())
}

/// The components of an entity.
fn components(world: &World, entity: Entity) -> BTreeSet<ComponentId> {
    world.entity(entity).archetype().components().iter().copied().collect()
}

/// Their types' paths, of those that are registered for reflection.
fn names(world: &World, ids: &BTreeSet<ComponentId>) -> Vec<String> {
    let registry = world.resource::<AppTypeRegistry>().read();
    let name = |id: &ComponentId| {
        let type_id = world.components().get_info(*id).and_then(|info| info.type_id());
        let path = type_id.and_then(|id| registry.get_type_info(id)).map(|info| info.type_path());
        path.map_or_else(|| format!("{type_id:?}"), Into::into)
    };
    ids.iter().map(name).collect()
}

/// With `Clay` goes all that the plugin put on its entity, and nothing that the app did; clay that comes back
/// is newer than all that was.
pub(super) fn removed_clay_leaves_no_trace() -> Result<(), Failed> {
    for surface in BACKENDS {
        for has_own in [false, true] {
            let mut app = app();
            let (clay, settings) = resting(surface);
            let material = cube().material;
            let entity = app
                .world_mut()
                .spawn((settings, material, ClayClock::default(), Transform::default(), Visibility::default()))
                .id();
            if has_own {
                let red = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial::default());
                app.world_mut().entity_mut(entity).insert((MeshMaterial3d(red), NoAutoAabb));
            }
            settle(&mut app, "a start", |_| true)?;
            let before = components(app.world(), entity);
            let mut generation = 0;
            for _ in 0..2 {
                app.world_mut().entity_mut(entity).insert(clay.clone());
                settle(&mut app, "the surface", |world| metrics(world, entity).triangle_count > 0)?;
                check(has::<Mesh3d>(app.world(), entity) && has::<Aabb>(app.world(), entity), "nothing to draw")?;
                let now = app.world().get::<ClayEngine>(entity).map_or(0, |e| e.revision().0);
                check(now > generation, format!("engine {now} follows engine {generation}"))?;
                generation = now;
                app.world_mut().entity_mut(entity).remove::<Clay>();
                pass(&mut app);
                let after = components(app.world(), entity);
                let left: BTreeSet<_> = after.difference(&before).copied().collect();
                let gone: BTreeSet<_> = before.difference(&after).copied().collect();
                let (left, gone) = (names(app.world(), &left), names(app.world(), &gone));
                check(left.is_empty() && gone.is_empty(), format!("{surface:?}: left {left:?}, took {gone:?}"))?;
            }
        }
    }
    Ok(())
}

/// Clay that is not to be shown any more has nothing on it to be drawn.
pub(super) fn quality_off_takes_the_mesh_away() -> Result<(), Failed> {
    for surface in BACKENDS {
        let mut app = app();
        let clay = app.world_mut().spawn(resting(surface)).id();
        settle(&mut app, "the surface", |world| has::<Mesh3d>(world, clay) && has::<ClaySurface>(world, clay))?;
        pass(&mut app);
        app.world_mut().get_mut::<ClaySettings>(clay).ok_or("settings")?.mesh = MeshQuality::Off;
        pass(&mut app);
        let world = app.world();
        let left = [
            has::<Mesh3d>(world, clay),
            has::<Aabb>(world, clay),
            has::<NoAutoAabb>(world, clay),
            has::<MeshMaterial3d<ClayLookMaterial>>(world, clay),
            has::<ClaySurface>(world, clay),
        ];
        check(left == [false; 5], format!("{surface:?}: mesh, bounds, bounds by hand, material, surface: {left:?}"))?;
        app.world_mut().get_mut::<ClaySettings>(clay).ok_or("settings")?.mesh = MeshQuality::Fine;
        settle(&mut app, "the surface again", |world| has::<MeshMaterial3d<ClayLookMaterial>>(world, clay))?;
    }
    Ok(())
}

/// The app's limits for slabs of meshes stay as they are; slabs beyond what a binding may have do no harm.
pub(super) fn slabs_stay_as_large_as_the_app_has_them() -> Result<(), Failed> {
    let mut app = App::new();
    app.add_plugins(plugins());
    let render = app.get_sub_app_mut(RenderApp).ok_or("no render world")?;
    render.world_mut().get_resource_or_init::<MeshAllocatorSettings>().min_slab_size = 160 << 20;
    app.add_plugins(ClayPlugins);
    let clay = app.world_mut().spawn(resting(SurfaceBackend::Gpu)).id();
    settle(&mut app, "an engine", |world| has::<ClayEngine>(world, clay))?;
    let (_, expected) = triangles(app.world(), clay);
    settle(&mut app, "the surface", |world| {
        metrics(world, clay).triangle_count == expected || status(world, clay).error.is_some()
    })?;
    pass(&mut app);
    check(status(app.world(), clay).error.is_none(), format!("{:?}", status(app.world(), clay).error))?;
    let mut app = App::new();
    app.add_plugins((plugins(), ClayPlugins));
    settle(&mut app, "a start", |_| true)?;
    let render = app.get_sub_app(RenderApp);
    if let Some(settings) = render.and_then(|render| render.world().get_resource::<MeshAllocatorSettings>()) {
        let usual = MeshAllocatorSettings::default();
        let limits = |s: &MeshAllocatorSettings| [s.min_slab_size, s.max_slab_size, s.large_threshold];
        check(limits(settings) == limits(&usual), format!("{:?} instead of {:?}", limits(settings), limits(&usual)))?;
    }
    Ok(())
}

/// A mesh whose vertices are laid out otherwise than the passes write them is left alone: the processor makes
/// the surface, and the status says so in one line.
pub(super) fn mesh_of_another_layout_is_not_written() -> Result<(), Failed> {
    let mut app = app();
    let clay = app.world_mut().spawn(resting(SurfaceBackend::Gpu)).id();
    settle(&mut app, "the surface", |world| metrics(world, clay).triangle_count > 0)?;
    let mesh = app.world().get::<Mesh3d>(clay).ok_or("nothing to draw")?.id();
    let corner = [DX as f32 * GRAVITY as f32, 0.0, 0.0];
    let other = Mesh::new(bevy::mesh::PrimitiveTopology::TriangleList, bevy::asset::RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![corner; 3])
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 1.0, 0.0]; 3])
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, vec![[0.0; 2]; 3])
        .with_inserted_indices(bevy::mesh::Indices::U32(vec![0, 1, 2]));
    app.world_mut().resource_mut::<Assets<Mesh>>().insert(mesh, other)?;
    settle(&mut app, "a word about it", |world| status(world, clay).error.is_some())?;
    let error = status(app.world(), clay).error.as_ref().map(ToString::to_string).unwrap_or_default();
    check(error.contains("32 bytes") && error.lines().count() == 1, error)?;
    settle(&mut app, "the processor's surface", |world| {
        world.get::<ClaySurface>(clay).is_some_and(|s| s.mesh().is_some()) && has::<Mesh3d>(world, clay)
    })
}
