//! Clay from what an app has: shapes, meshes, scenes, snapshots, recordings; saved and loaded by reflection.

use super::*;
use bevy::asset::RenderAssetUsages;
use bevy::reflect::serde::{ReflectDeserializer, ReflectSerializer};
use serde::de::DeserializeSeed;

/// Volume \[m^3\], low and high corner of the particles in the clay's frame.
fn extent(app: &App, clay: Entity) -> (f64, DVec3, DVec3) {
    let state = state(app, clay);
    let places = || state.particles.iter().map(|p| state.domain.to_world(p.grid()));
    (state.rest_volume(), places().reduce(DVec3::min).expect("clay"), places().reduce(DVec3::max).expect("clay"))
}

/// Shapes and scenes stand on the floor, with the volume that they have by themselves.
#[test]
fn shapes_and_scenes_become_clay() {
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.02f64.powi(3);
    let scene = ClayScene::from_ron("(clay: [Box(size: (0.04, 0.02, 0.03), center: (0, 0.01, 0))], cell_width: 0.004)");
    let sources = [
        (Clay::block(Vec3::new(0.04, 0.02, 0.03)).with_cell_width(0.004), 0.04 * 0.02 * 0.03, 0.02),
        (Clay::ball(0.02).with_cell_width(0.004), ball, 0.04),
        (Clay::scene(scene.expect("a scene")), 0.04 * 0.02 * 0.03, 0.02),
    ];
    for (clay, volume, height) in sources {
        let mut app = app();
        let name = format!("{:?}", clay.source);
        let clay = spawn_clay(&mut app, clay);
        let (filled, low, high) = extent(&app, clay);
        assert!((filled / volume - 1.0).abs() < 0.02, "{name}: {filled} of {volume}");
        assert!((0.0..0.002).contains(&low.y) && (high.y - height).abs() < 0.002, "{name}: {low} to {high}");
        assert!((low.x + high.x).abs() < 0.002 && (low.z + high.z).abs() < 0.002, "{name}: {low} to {high}");
        tick(&mut app, clay);
        assert_eq!(status(&app, clay).error, None);
    }
}

/// A mesh becomes clay where it is, once it is there; one that cannot be is named.
#[test]
fn meshes_become_clay() {
    let mut app = app_with_meshes();
    let mesh = Mesh::from(Cuboid::new(0.03, 0.02, 0.02)).translated_by(Vec3::new(0.01, 0.05, 0.0));
    let late = app.world().resource::<Assets<Mesh>>().reserve_handle();
    let settings = ClaySettings { engine: EngineChoice::Native, ..default() };
    let clay = app.world_mut().spawn((Clay::mesh(late.clone()).with_cell_width(0.0025), settings)).id();
    for _ in 0..5 {
        app.update();
    }
    assert!(app.world().get::<ClayEngine>(clay).is_none() && status(&app, clay).error.is_none());
    app.world_mut().resource_mut::<Assets<Mesh>>().insert(late.id(), mesh).expect("a place for it");
    settle(&mut app, "clay of the mesh", |world| world.get::<ClayEngine>(clay).is_some());
    let (volume, low, high) = extent(&app, clay);
    assert!((volume / (0.03 * 0.02 * 0.02) - 1.0).abs() < 0.05, "{volume}");
    assert!((low - DVec3::new(-0.005, 0.04, -0.01)).abs().max_element() < 0.0015, "{low}");
    assert!((high - DVec3::new(0.025, 0.06, 0.01)).abs().max_element() < 0.0015, "{high}");
    let bad = Mesh::new(bevy::mesh::PrimitiveTopology::LineList, RenderAssetUsages::default());
    let bad = app.world_mut().resource_mut::<Assets<Mesh>>().add(bad);
    app.world_mut().entity_mut(clay).insert(Clay::mesh(bad));
    settle(&mut app, "a refusal", |world| world.get::<ClayStatus>(clay).is_some_and(|s| s.error.is_some()));
    assert!(matches!(status(&app, clay).error, Some(ClayError::Source(_))), "{:?}", status(&app, clay).error);
    let before = metrics(&app, clay).time;
    tick(&mut app, clay);
    assert!(metrics(&app, clay).time > before, "the clay that was there goes on");
}

/// What a recorded run left is clay again.
#[test]
fn recordings_become_clay() {
    use bevy_clay::scene::recording::{Event, Recorder};
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.rec");
    let clay = cube(2, 4.0);
    let mut engine = NativeEngine::new();
    let mut recorder = Recorder::create(&path, &engine).expect("a file");
    let mut planner = Planner::new(&clay);
    engine.load(&clay).expect("sound clay");
    recorder.write(&Event::Load(clay.clone())).expect("written");
    for _ in 0..3 {
        let Decision::Run(plan) = planner.frame(&clay.material, 0.01, &[]) else { panic!("a frame") };
        recorder.write(&Event::Plan(plan.clone())).expect("written");
        engine.submit(plan).expect("a sound plan");
        planner.sent();
        let mut report = engine.wait().expect("a report");
        recorder.write(&Event::Report(report.plan_id)).expect("written");
        planner.note(&mut report);
    }
    drop(recorder);
    let end = engine.save().expect("a state");
    let mut app = app();
    let clay = spawn_clay(&mut app, Clay::recording(&path));
    assert_eq!(state(&app, clay).checksum(), end.checksum());
    app.world_mut().entity_mut(clay).insert(Clay::recording("nowhere.rec"));
    settle(&mut app, "a refusal", |world| world.get::<ClayStatus>(clay).is_some_and(|s| s.error.is_some()));
    assert!(status(&app, clay).error.as_ref().is_some_and(|e| e.to_string().contains("nowhere.rec")));
}

/// Written and read by reflection, as Bevy's scenes are, clay comes back as itself.
#[test]
fn reflected_clay_comes_back_as_itself() {
    let app = app();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let scene = ClayScene::from_ron("(clay: [Sphere(radius: 0.02)], cell_width: 0.004, seed: 7)").expect("a scene");
    let snapshot = cube(3, 1.0);
    let clays = [
        Clay::block(Vec3::new(0.01, 0.02, 0.03)).with_cell_width(0.001),
        Clay::ball(0.05),
        Clay::scene(scene),
        Clay::scene_file("some/where.scene.ron"),
        Clay::recording("a/run.rec"),
        Clay::snapshot(snapshot.clone()),
    ];
    for clay in clays {
        let text = ron::to_string(&ReflectSerializer::new(&clay, &registry)).expect("a text");
        let mut reader = ron::Deserializer::from_str(&text).expect("a text");
        let read = ReflectDeserializer::new(&registry).deserialize(&mut reader).expect("a value");
        let back = Clay::from_reflect(&*read).expect("clay");
        match (&clay.source, &back.source) {
            (ClaySource::Snapshot(_), ClaySource::Snapshot(saved)) => assert!(saved.0.to_bytes() == snapshot.to_bytes()),
            _ => assert_eq!(clay, back),
        }
    }
}

/// The material of a clay that is replaced is the new one's, unless the app has set another.
#[test]
fn material_comes_with_the_clay() {
    let mut app = app();
    let of = |preset: Preset| Snapshot { material: preset.material(), ..cube(2, 12.0) };
    let clay = spawn(&mut app, of(Preset::SoftClay));
    let material = |app: &App| *app.world().get::<ClayMaterial>(clay).expect("a material");
    assert_eq!(material(&app), Preset::SoftClay.material());
    let replace = |app: &mut App, preset: Preset| {
        app.world_mut().entity_mut(clay).insert(Clay::snapshot(of(preset)));
        app.update();
        tick(app, clay);
    };
    replace(&mut app, Preset::Wax);
    assert_eq!(material(&app), Preset::Wax.material());
    let own = ClayMaterial { density: 1234.0, ..Preset::Putty.material() };
    app.world_mut().entity_mut(clay).insert(own);
    replace(&mut app, Preset::StiffClay);
    assert_eq!(material(&app), own);
}
