//! What is drawn over clay and tools for those who look for what is wrong.

use super::*;
use bevy::gizmos::{GizmoHandles, GizmoPlugin};
use bevy::log::tracing::subscriber;
use bevy::log::tracing_subscriber::fmt;
use bevy::mesh::MeshPlugin;
use std::any::TypeId;
use std::io::Write;
use std::sync::{Mutex, PoisonError};

/// An app with gizmos, and without a window; only `kind` is drawn.
fn app_with(kind: impl FnOnce(&mut ClayGizmos)) -> App {
    let mut app = app();
    app.add_plugins((TransformPlugin, AssetPlugin::default(), MeshPlugin, GizmoPlugin, ClayGizmosPlugin));
    app.edit_schedule(PostUpdate, |s| {
        s.set_build_settings(ScheduleBuildSettings { ambiguity_detection: LogLevel::Error, ..default() });
    });
    only(&mut app, kind);
    app
}

/// Draws nothing but that.
fn only(app: &mut App, kind: impl FnOnce(&mut ClayGizmos)) {
    let mut store = app.world_mut().resource_mut::<GizmoConfigStore>();
    let (_, group) = store.config_mut::<ClayGizmos>();
    *group = ClayGizmos { tools: None, forces: None, contacts: None, blocks: None, cuts: None, ..default() };
    kind(group);
}

/// The ends of the lines that the last update drew, in the world.
fn drawn(world: &World) -> Vec<Vec3> {
    let handle = &world.resource::<GizmoHandles>().handles()[&TypeId::of::<ClayGizmos>()];
    let Some(handle) = handle else { return vec![] };
    let lines = world.resource::<Assets<GizmoAsset>>().get(handle).expect("lines").buffer().buffer();
    let ends = lines.list_positions.iter().chain(lines.strip_positions).copied();
    // What is not a number ends a strip.
    ends.filter(|p| p.is_finite()).collect()
}

/// Every shape's lines lie on its surface, where the entity has it, scaled with it, and reach as far as it.
#[test]
fn lines_of_tools_lie_on_their_surfaces() {
    let mut app = app_with(|group| group.tools = Some(Color::WHITE));
    let place = Transform::from_xyz(0.2, -0.1, 0.3)
        .with_rotation(Quat::from_euler(EulerRot::XYZ, 0.4, 1.2, -0.7))
        .with_scale(Vec3::splat(1.5));
    for shape in ToolShape::ALL {
        let tool = app.world_mut().spawn((SculptTool::new(shape), place)).id();
        app.update();
        let lines = drawn(app.world());
        let local = |p: &Vec3| place.compute_affine().inverse().transform_point3(*p).as_dvec3();
        let off = lines.iter().map(|p| shape.distance(local(p)).abs()).fold(0.0, f64::max);
        let far = lines.iter().map(|p| local(p).length()).fold(0.0, f64::max);
        assert!(off < 1e-5, "{shape:?}: {off} off its surface");
        assert!((far / shape.bounding_radius() - 1.0).abs() < 1e-5, "{shape:?}: {far} from its origin");
        app.world_mut().get_mut::<SculptTool>(tool).expect("a tool").is_active = false;
        app.update();
        assert_eq!(drawn(app.world()), []);
    }
}

/// A tool is drawn where the clay has it, not where the hand is.
#[test]
fn tool_is_drawn_where_the_clay_has_it() {
    let mut app = app_with(|group| group.tools = Some(Color::WHITE));
    let clay = spawn(&mut app, cube(4, 0.0));
    let moved = Vec3::new(0.5, 0.0, -0.2);
    app.world_mut().entity_mut(clay).insert(Transform::from_translation(moved));
    let tool = app.world_mut().spawn((SculptTool::ball(0.01), Transform::from_xyz(0.52, 0.05, -0.18))).id();
    tick(&mut app, clay);
    app.world_mut().get_mut::<Transform>(tool).expect("a place").translation.y = 1.0;
    settle(&mut app, "lines", |world| !drawn(world).is_empty());
    let pose = engine(app.world(), clay).tool_pose(tool).expect("a pose").position.as_vec3() + moved;
    assert!((pose.y - 0.05).abs() < 1e-3, "{pose}");
    for p in drawn(app.world()) {
        assert!((p.distance(pose) - 0.01).abs() < 1e-5, "{p} about {pose}");
    }
}

/// A pressed ball has an arrow of its force, from where the clay touches it.
#[test]
fn force_is_drawn_from_the_point_of_touch() {
    let mut app = app_with(|group| group.forces = Some(Color::WHITE));
    let clay = spawn(&mut app, cube(4, 0.0));
    let radius = 2.0 * DX as f32;
    let place = Transform::from_translation((DVec3::new(4.0, 5.9, 4.0) * DX).as_vec3());
    let tool = app.world_mut().spawn((SculptTool::ball(radius), place)).id();
    for _ in 0..3 {
        tick(&mut app, clay);
    }
    app.update();
    let force = app.world().get::<ToolForce>(tool).expect("a force").force;
    assert!(force.y > 0.0, "{force}");
    let lines = drawn(app.world());
    let touched = place.translation - radius * force.normalize();
    assert!(lines[0].distance(touched) < 1e-6, "{} is not {touched}", lines[0]);
    assert!((lines[1] - lines[0]).distance(0.01 * force) < 1e-6, "{:?} of {force}", &lines[..2]);
    only(&mut app, |group| group.contacts = Some(Color::WHITE));
    app.update();
    let cross = drawn(app.world());
    assert_eq!(cross.len(), 6);
    assert!((cross.iter().sum::<Vec3>() / 6.0).distance(touched) < 1e-6, "{cross:?} about {touched}");
}

/// The outer edges of the blocks around the clay, in the clay's place; none when they, or all, are switched
/// off.
#[test]
fn blocks_around_the_clay_are_drawn_until_they_are_switched_off() {
    let mut app = app_with(|group| group.blocks = Some(Color::WHITE));
    let clay = spawn(&mut app, cube(4, 0.0));
    app.world_mut().entity_mut(clay).insert(Transform::from_xyz(0.0, 3.0, 0.0).with_scale(Vec3::splat(2.0)));
    settle(&mut app, "blocks", |world| !drawn(world).is_empty());
    let state = state(&app, clay);
    let corner = |p: DVec3| state.domain.to_world((p / 4.0).floor() * 4.0);
    let place = |p: DVec3| 2.0 * p.as_vec3() + 3.0 * Vec3::Y;
    let lines = drawn(app.world());
    let grids = || state.particles.iter().map(Particle::grid);
    let low = grids().map(|p| place(corner(p))).reduce(Vec3::min).expect("particles");
    let high = grids().map(|p| place(corner(p + 4.0))).reduce(Vec3::max).expect("particles");
    let bounds = |pick: fn(Vec3, Vec3) -> Vec3| lines.iter().copied().reduce(pick).expect("lines");
    assert!(bounds(Vec3::min).distance(low) < 1e-5 && bounds(Vec3::max).distance(high) < 1e-5, "{low} to {high}");
    let edge = 2.0 * 4.0 * DX as f32;
    assert!(lines.chunks(2).all(|line| (line[0].distance(line[1]) - edge).abs() < 1e-5));
    only(&mut app, |_| {});
    app.update();
    assert_eq!(drawn(app.world()), []);
    only(&mut app, |group| group.blocks = Some(Color::WHITE));
    settle(&mut app, "blocks again", |world| !drawn(world).is_empty());
    app.world_mut().resource_mut::<GizmoConfigStore>().config_mut::<ClayGizmos>().0.enabled = false;
    app.update();
    assert_eq!(drawn(app.world()), []);
}

/// Both sides of a kept cut are drawn, each at its own side, and only once there is one.
#[test]
fn both_sides_of_a_cut_are_drawn() {
    let mut app = app_with(|group| group.cuts = Some(Color::WHITE));
    let mut whole = cube(4, 0.0);
    let other = spawn(&mut app, whole.clone());
    let middle = whole.domain.to_grid(DVec3::splat(4.0) * DX).x;
    for p in &mut whole.particles {
        let off = p.grid().x - middle;
        if off.abs() < 1.5 {
            p.tags[0] = Tag { sheet: 1, side: off.signum() as i8 };
        }
    }
    app.world_mut().entity_mut(other).insert(Transform::from_xyz(9.0, 0.0, 0.0));
    let clay = spawn(&mut app, whole);
    settle(&mut app, "cuts", |world| !drawn(world).is_empty());
    let lines = drawn(app.world());
    assert!(lines.iter().all(|p| (p.x - 4.0 * DX as f32).abs() < 1.5 * DX as f32), "{lines:?}");
    let is_front = |p: &Vec3| p.x > 4.0 * DX as f32;
    assert!(lines.chunks(2).all(|line| is_front(&line[0]) == is_front(&line[1])), "a line crosses the cut");
    let fronts = lines.iter().filter(|p| is_front(p)).count();
    assert_eq!(2 * fronts, lines.len());
    app.world_mut().entity_mut(clay).remove::<Clay>();
    app.update();
    assert_eq!(drawn(app.world()), []);
}

/// What is logged.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Without Bevy's gizmos the app goes on, and is told once.
#[test]
fn app_without_gizmos_is_told_and_goes_on() {
    let log = Log::default();
    let writer = log.clone();
    let log_all = fmt().with_writer(move || writer.clone()).finish();
    subscriber::with_default(log_all, || {
        let mut app = app();
        app.add_plugins(ClayGizmosPlugin);
        let clay = spawn(&mut app, cube(2, 0.0));
        tick(&mut app, clay);
        assert!(metrics(&app, clay).time > 0.0);
    });
    let text = String::from_utf8(log.0.lock().unwrap_or_else(PoisonError::into_inner).clone()).expect("text");
    assert_eq!(text.matches("add Bevy's GizmoPlugin").count(), 1, "{text}");
}
