//! The Bevy plugin in an app without window.

mod clock;
mod events;
mod feel;
mod gizmos;
mod hands;
mod sources;
mod tools;
#[cfg(feature = "touch")]
mod touch;

use bevy::camera::primitives::Aabb;
use bevy::ecs::schedule::{LogLevel, ScheduleBuildSettings};
use bevy::prelude::*;
use bevy::tasks::AsyncComputeTaskPool;
use bevy::time::TimeUpdateStrategy;
use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use glam::DVec3;
use std::sync::{Arc, RwLock, mpsc};
use std::time::{Duration, Instant};

const DX: f64 = 0.005;
const TICK: Duration = Duration::from_millis(10);
/// Longest that a test waits for what has to come: it guards against hanging, and says nothing of speed.
const PATIENCE: Duration = Duration::from_secs(300);

/// A cube of clay, `width` cells wide with 8 particles per cell, its underside `height` cells above the
/// floor.
fn cube(width: i32, height: f64) -> Snapshot {
    let room = DVec3::new(8.0, 24.0, 8.0) * DX;
    let domain = Domain::new(DVec3::ZERO, room, DX, Walls::default()).expect("domain");
    let corner = domain.to_grid(DVec3::new(2.0, height, 2.0) * DX);
    let n = 2 * width;
    let at = |i: i32| DVec3::new(f64::from(i % n), f64::from(i / n % n), f64::from(i / (n * n))) * 0.5 + 0.25;
    let particle = |i: i32| Particle::at(corner + at(i), (DX.powi(3) / 8.0) as f32, i.cast_unsigned());
    Snapshot::new(domain, Preset::SoftClay.material(), (0..n * n * n).map(particle).collect())
}

/// Every report of the app, in order.
#[derive(Resource, Default)]
struct Reports(Vec<ClayReport>);

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, ClayPlugins))
        .init_resource::<Reports>()
        .add_systems(Last, |mut new: MessageReader<ClayReport>, mut all: ResMut<Reports>| all.0.extend(new.read().cloned()));
    app.edit_schedule(Update, |s| {
        s.set_build_settings(ScheduleBuildSettings { ambiguity_detection: LogLevel::Error, ..default() });
    });
    // Bevy's clock starts with the first update.
    app.update();
    app
}

/// Updates with the clock stopped until `done`.
fn settle(app: &mut App, what: &str, mut done: impl FnMut(&World) -> bool) {
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    let start = Instant::now();
    loop {
        app.update();
        if done(app.world()) {
            return;
        }
        assert!(start.elapsed() < PATIENCE, "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A clay whose engine runs.
fn spawn(app: &mut App, snapshot: Snapshot) -> Entity {
    spawn_clay(app, Clay::snapshot(snapshot))
}

/// The same, of any source.
fn spawn_clay(app: &mut App, clay: Clay) -> Entity {
    // Frames that follow the clock alone: runs repeat.
    let settings = ClaySettings { engine: EngineChoice::Native, is_responsive: false, ..default() };
    let clay = app.world_mut().spawn((clay, settings)).id();
    settle(app, "an engine", |world| world.get::<ClayEngine>(clay).is_some());
    clay
}

/// One tick of the clock, then as many updates with the clock stopped as the frame takes.
fn tick(app: &mut App, clay: Entity) {
    app.insert_resource(TimeUpdateStrategy::ManualDuration(TICK));
    app.update();
    settle(app, "the end of a frame", |world| engine(world, clay).pending() == 0);
}

fn engine(world: &World, clay: Entity) -> &ClayEngine {
    world.get::<ClayEngine>(clay).expect("engine")
}

fn status(app: &App, clay: Entity) -> &ClayStatus {
    app.world().get::<ClayStatus>(clay).expect("status")
}

fn metrics(app: &App, clay: Entity) -> &ClayMetrics {
    app.world().get::<ClayMetrics>(clay).expect("metrics")
}

/// The state, which the CPU engine hands out at once.
fn state(app: &App, clay: Entity) -> Snapshot {
    let mut ticket = engine(app.world(), clay).request_state().expect("clay");
    ticket.take().expect("an engine").expect("a state")().expect("a device")
}

/// Height [m] of the centre of mass.
fn height(app: &App, clay: Entity) -> f64 {
    let snapshot = state(app, clay);
    let sum: f64 = snapshot.particles.iter().map(|p| snapshot.domain.to_world(p.grid()).y).sum();
    sum / snapshot.particles.len() as f64
}

/// The app above runs with ambiguities as errors: a system that touches clay without an order is found, one
/// within a set is not.
#[test]
#[should_panic(expected = "ambig")]
fn schedule_with_an_unordered_system_is_refused() {
    let mut app = app();
    app.add_systems(Update, (|_: Query<&mut ClayEngine>| {}).after(ClaySystems::Report).before(ClaySystems::Step));
    app.update();
    app.add_systems(Update, |_: Query<&mut ClayEngine>| {});
    app.update();
}

/// A dropped cube falls g t^2 / 2 within 1 %, by the clay's own time, which is the clock's.
#[test]
fn dropped_cube_falls_as_it_should() {
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 16.0));
    let start = height(&app, clay);
    for _ in 0..11 {
        tick(&mut app, clay);
    }
    let report = app.world().resource::<Reports>().0.last().expect("report").report.clone();
    let fallen = start - height(&app, clay);
    let expected = 9.81 * report.time.powi(2) / 2.0;
    assert!(report.health.is_ok(), "{}", report.health);
    assert!((fallen / expected - 1.0).abs() < 0.01, "{fallen} m instead of {expected} m in {} s", report.time);
    let (clock, given_up) = (app.world().resource::<Time>().elapsed_secs_f64(), metrics(&app, clay).given_up);
    assert!(
        (report.time + given_up - clock).abs() < 1e-9,
        "clay at {} s, {given_up} s given up, clock at {clock} s",
        report.time
    );
}

/// The frame loop never waits: at most two frames are under way, the clock's surplus is counted, not queued.
#[test]
fn update_gives_time_up_instead_of_waiting() {
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 16.0));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(100)));
    for _ in 0..10 {
        app.update();
        assert!(engine(app.world(), clay).pending() <= 2);
    }
    let given_up = metrics(&app, clay).given_up;
    assert!(given_up > 0.5, "{given_up} s of 1 s given up at 33 ms per frame");
}

/// A tool that an app moves is swept through the clay and feels it.
#[test]
fn tool_moved_by_the_app_feels_the_clay() {
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 0.0));
    let place = Transform::from_translation((DVec3::new(4.0, 6.5, 4.0) * DX).as_vec3());
    let tool = app.world_mut().spawn((SculptTool::ball(2.0 * DX as f32), place)).id();
    let down = |mut tools: Query<&mut Transform, With<SculptTool>>, time: Res<Time>| {
        tools.iter_mut().for_each(|mut t| t.translation.y -= 0.2 * time.delta_secs());
    };
    app.add_systems(Update, down.in_set(ClaySystems::Tool));
    for _ in 0..5 {
        tick(&mut app, clay);
    }
    let last = app.world().resource::<Reports>().0.last().expect("report").clone();
    let last = last.tool(tool).expect("the tool's report");
    assert!(last.force.y > 0.0, "pressed down, the ball feels {} N", last.force);
}

/// A knife that is switched off and on again before another frame is planned has been put down anew: its cut
/// is another.
#[test]
fn knife_put_down_anew_begins_another_cut() {
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 0.0));
    let at = |z: f64| Transform::from_translation((DVec3::new(4.0, 3.0, z) * DX).as_vec3());
    let blade = SculptTool::blade(8.0 * DX as f32, 8.0 * DX as f32);
    let knife = app.world_mut().spawn((blade, at(3.0))).id();
    let seen = |app: &mut App| {
        tick(app, clay);
        let report = &app.world().resource::<Reports>().0.last().expect("report").report;
        (report.sheets.iter().collect::<Vec<_>>(), report.body_max)
    };
    assert_eq!([(); 3].map(|()| seen(&mut app)), [(); 3].map(|()| (vec![1], 0)));
    for is_active in [false, true] {
        let mut knife = app.world_mut().entity_mut(knife);
        knife.get_mut::<SculptTool>().expect("knife").is_active = is_active;
        knife.insert(at(5.0));
        app.update();
    }
    // Both have gone through by then, and made three bodies; the knife is in the second one.
    let last = (0..6).map(|_| seen(&mut app)).last();
    assert_eq!(last, Some((vec![2], 2)));
}

/// A material that the engine refuses stops the clay with its reason; the app goes on, and so does the clay
/// when it is mended.
#[test]
fn refused_material_stops_the_clay_by_name_until_it_is_mended() {
    let mut app = app();
    let clay = spawn(&mut app, cube(2, 0.0));
    let bad = ClayMaterial { poisson_ratio: 0.5, ..ClayMaterial::default() };
    app.world_mut().entity_mut(clay).insert(bad);
    for _ in 0..3 {
        tick(&mut app, clay);
    }
    let error = status(&app, clay).error.as_ref().expect("error").to_string();
    assert!(error.contains("poisson_ratio"), "{error}");
    assert_eq!(metrics(&app, clay).time, 0.0);
    app.world_mut().entity_mut(clay).insert(ClayMaterial::default());
    tick(&mut app, clay);
    assert_eq!(status(&app, clay).error, None);
    assert!(metrics(&app, clay).time > 0.0);
}

/// Clay is made of what its file says now; a bad file is named and leaves it alone.
#[test]
fn clay_follows_its_file() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("mine.clay.ron");
    let write = |text: &str| std::fs::write(&path, text).expect("file");
    write("(extends: \"plasticine.clay.ron\", density: 1500)");
    let mut app = app();
    let clay = spawn(&mut app, cube(2, 12.0));
    let softened = ClayMaterial { softening: 0.5, ..ClayMaterial::default() };
    app.world_mut().entity_mut(clay).insert((softened, MaterialFile::new(&path)));
    let is_dense = |density: f64| move |world: &World| world.get::<ClayMaterial>(clay).is_some_and(|m| m.density == density);
    settle(&mut app, "the file", is_dense(1500.0));
    // The softening is the hand's.
    let expected = ClayMaterial { density: 1500.0, softening: 0.5, ..Preset::Plasticine.material() };
    assert_eq!(app.world().get::<ClayMaterial>(clay), Some(&expected));
    write("(extends: \"plasticine.clay.ron\", density: \"1.6 g/cm^3\", color: Red)");
    settle(&mut app, "a change", is_dense(1600.0));
    assert!(
        status(&app, clay).warnings[0].contains("mine.clay.ron:1:57: unknown key `color`"),
        "{:?}",
        status(&app, clay).warnings
    );
    // Bad, gone, bad in another way: the material stays, the reason is shown, the clay goes on.
    let bad: [(&dyn Fn(), &str); 3] = [
        (&|| write("(density: \"1500 kPa\")"), "mine.clay.ron:1:2: density"),
        (&|| std::fs::remove_file(&path).expect("gone"), "No such file"),
        (&|| write("(extends: \"base.clay.ron\")"), "base.clay.ron"),
    ];
    for (spoil, part) in bad {
        spoil();
        settle(&mut app, part, |world| {
            world.get::<ClayStatus>(clay).is_some_and(|s| s.error.as_ref().is_some_and(|e| e.to_string().contains(part)))
        });
        assert!(is_dense(1600.0)(app.world()));
        let before = metrics(&app, clay).time;
        tick(&mut app, clay);
        assert!(metrics(&app, clay).time > before);
    }
    // A file that it extends counts too.
    std::fs::write(folder.path().join("base.clay.ron"), "(density: 1700)").expect("file");
    settle(&mut app, "the base", is_dense(1700.0));
    tick(&mut app, clay);
    assert_eq!((status(&app, clay).error.as_ref(), status(&app, clay).warnings.len()), (None, 0));
    // A clay that follows no file any more is left alone.
    app.world_mut().entity_mut(clay).remove::<MaterialFile>();
    write("(density: 1800)");
    std::thread::sleep(Duration::from_millis(500));
    tick(&mut app, clay);
    assert!(is_dense(1700.0)(app.world()));
}

/// A snapshot that no engine can use is named; the clay that was there goes on.
#[test]
fn refused_snapshot_leaves_the_clay_as_it_was() {
    let mut app = app();
    let clay = spawn(&mut app, cube(2, 12.0));
    tick(&mut app, clay);
    let mut bad = cube(2, 12.0);
    bad.particles[3].rest_volume = -1.0;
    app.world_mut().entity_mut(clay).insert(Clay::snapshot(bad));
    settle(&mut app, "a refusal", |world| world.get::<ClayStatus>(clay).is_some_and(|s| s.error.is_some()));
    let error = status(&app, clay).error.as_ref().expect("error").to_string();
    assert!(error.contains("rest_volume"), "{error}");
    let before = metrics(&app, clay).time;
    tick(&mut app, clay);
    assert!(before > 0.0 && metrics(&app, clay).time > before, "{before} s, {} s", metrics(&app, clay).time);
    app.world_mut().entity_mut(clay).insert(Clay::snapshot(cube(3, 12.0)));
    settle(&mut app, "the next clay", |world| world.get::<ClayStatus>(clay).is_some_and(|s| s.particle_count == 216));
    assert_eq!((status(&app, clay).error.as_ref(), metrics(&app, clay).time), (None, 0.0));
}

/// Paused clay stands; the clock's time is neither owed nor given up.
#[test]
fn paused_clay_stands_still() {
    let mut app = app();
    let clay = spawn(&mut app, cube(2, 12.0));
    let pause = |app: &mut App, is_paused| app.world_mut().get_mut::<ClayClock>(clay).expect("a clock").paused = is_paused;
    pause(&mut app, true);
    for _ in 0..5 {
        tick(&mut app, clay);
    }
    assert_eq!(metrics(&app, clay).time, 0.0);
    pause(&mut app, false);
    tick(&mut app, clay);
    let ClayMetrics { time, given_up, .. } = *metrics(&app, clay);
    assert!((time - 0.01).abs() < 1e-9 && given_up == 0.0, "{time} s, {given_up} s given up");
}

/// Two apps in one process are strangers: the second's clay, gravity and tools leave the first's bits alone.
#[test]
fn two_apps_share_no_state() {
    let run = |beside: bool| {
        let (mut first, mut second) = (app(), app());
        let clay = spawn(&mut first, cube(2, 12.0));
        let other = spawn(&mut second, cube(3, 2.0));
        second.world_mut().get_mut::<ClaySettings>(other).expect("settings").gravity = Some(DVec3::X);
        for _ in 0..4 {
            tick(&mut first, clay);
            if beside {
                tick(&mut second, other);
            }
        }
        let reports = std::mem::take(&mut first.world_mut().resource_mut::<Reports>().0);
        let state = state(&first, clay).to_bytes();
        let strangers = reports.iter().filter(|r| r.clay != clay).count();
        assert_eq!(strangers, 0);
        (state, reports.len(), second.world().resource::<Reports>().0.len())
    };
    let (alone, beside) = (run(false), run(true));
    assert!(alone.0 == beside.0, "the second app changed the first one's clay");
    assert_eq!((alone.1, alone.2), (4, 0));
    assert_eq!((beside.1, beside.2), (4, 4));
}

/// The solver's own types reflect, so that an inspector can edit them field by field.
#[test]
fn components_are_registered_and_edited_by_reflection() {
    let mut app = app();
    let clay = spawn(&mut app, cube(2, 0.0));
    app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").gravity = Some(DVec3::ZERO);
    let tool = app.world_mut().spawn(SculptTool::default()).id();
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let mut edit = |entity: Entity, component: &str, field: &str, value: f64| {
        let registry = registry.read();
        let data =
            registry.get_with_short_type_path(component).expect("registered").data::<ReflectComponent>().expect("component");
        let mut reflected = data.reflect_mut(app.world_mut().entity_mut(entity)).expect("component of the entity");
        *reflected.path_mut::<f64>(field).expect("field") = value;
    };
    edit(clay, "ClayMaterial", "poisson_ratio", 0.25);
    edit(clay, "ClaySettings", "gravity.0.y", -1.0);
    edit(tool, "SculptTool", "shape.radius", 0.001);
    edit(tool, "SculptTool", "contact.friction", 0.5);
    assert_eq!(app.world().get::<ClayMaterial>(clay).expect("material").poisson_ratio, 0.25);
    assert_eq!(app.world().get::<ClaySettings>(clay).expect("settings").gravity, Some(DVec3::NEG_Y));
    let expected = SculptTool { contact: Contact::Separate { friction: 0.5 }, ..SculptTool::ball(0.001) };
    let tool = app.world().get::<SculptTool>(tool).expect("tool");
    assert_eq!((tool.contact, tool.is_active), (expected.contact, true));
    assert!(matches!(tool.shape, ToolShape::Sphere { radius } if radius == 0.001));
}

/// Does some work while every thread for work aside is held up.
fn while_threads_are_held<T>(work: impl FnOnce() -> T) -> T {
    let pool = AsyncComputeTaskPool::get();
    let gate = Arc::new(RwLock::new(()));
    let held = gate.write().expect("nobody else has it");
    let (reached, all) = mpsc::channel();
    for _ in 0..pool.thread_num() {
        let (gate, reached) = (gate.clone(), reached.clone());
        pool.spawn(async move {
            reached.send(()).expect("a test that waits");
            drop(gate.read());
        })
        .detach();
    }
    for _ in 0..pool.thread_num() {
        all.recv_timeout(PATIENCE).expect("a thread of the pool");
    }
    let result = work();
    drop(held);
    result
}

/// The engine of a large clay starts, and its surface is made, aside: while no thread is free for that,
/// updates go on without them. How long the main thread is held is measured by `cargo bench --bench frames`.
#[test]
fn main_thread_waits_for_neither_engine_nor_surface() {
    let mut app = app_with_meshes();
    let clay = while_threads_are_held(|| {
        let clay = app.world_mut().spawn(Clay::default()).id();
        (0..5).for_each(|_| app.update());
        assert!(app.world().get::<ClayEngine>(clay).is_none(), "the main thread started the engine");
        clay
    });
    settle(&mut app, "a surface", |world| world.get::<ClaySurface>(clay).is_some());
    let revision = |app: &App| app.world().get::<ClaySurface>(clay).expect("surface").revision();
    let before = while_threads_are_held(|| {
        let before = revision(&app);
        tick(&mut app, clay);
        (0..5).for_each(|_| app.update());
        assert_eq!(revision(&app), before, "the main thread made the surface");
        before
    });
    settle(&mut app, "the next surface", |world| world.get::<ClaySurface>(clay).expect("surface").revision() > before);
}

/// An app that has meshes, but draws none.
fn app_with_meshes() -> App {
    let mut app = app();
    app.add_plugins(AssetPlugin::default()).init_asset::<Mesh>();
    app
}

/// The surface appears as a mesh with the right bounds and encloses the clay; clay at rest is not extracted
/// again, clay that moved is.
#[test]
fn mesh_follows_the_clay_and_rests_with_it() {
    let mut app = app_with_meshes();
    let clay = spawn(&mut app, cube(4, 4.0));
    settle(&mut app, "a mesh", |world| world.get::<Mesh3d>(clay).is_some());
    let world = app.world();
    let (mesh, bounds) = (world.get::<Mesh3d>(clay).expect("mesh"), world.get::<Aabb>(clay).expect("bounds"));
    let mesh = world.resource::<Assets<Mesh>>().get(mesh).expect("asset");
    let surface = world.get::<ClaySurface>(clay).expect("surface").mesh().expect("mesh").clone();
    assert_eq!(mesh.count_vertices(), surface.positions.len());
    let centre = Vec3::new(4.0, 6.0, 4.0) * DX as f32;
    assert!((Vec3::from(bounds.center) - centre).length() < 0.1 * DX as f32, "centre {}", bounds.center);
    assert!((Vec3::from(bounds.half_extents) - 2.0 * DX as f32).abs().max_element() < 0.3 * DX as f32, "{}", bounds.half_extents);
    assert!((surface.volume() / (4.0 * DX).powi(3) - 1.0).abs() < 0.1, "volume {}", surface.volume());
    assert!(metrics(&app, clay).triangle_count == surface.triangles.len() && metrics(&app, clay).mesh_ms > 0.0);

    let revision = |world: &World| world.get::<ClaySurface>(clay).expect("surface").revision();
    let at_rest = revision(app.world());
    for _ in 0..20 {
        app.update();
        std::thread::sleep(Duration::from_millis(2));
    }
    assert_eq!(revision(app.world()), at_rest);
    let still = app.world().get::<ClaySurface>(clay).and_then(ClaySurface::mesh).expect("surface");
    assert!(Arc::ptr_eq(&surface, still), "extracted again");
    tick(&mut app, clay);
    settle(&mut app, "the next surface", |world| revision(world) > at_rest);

    app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").mesh = MeshQuality::Off;
    settle(&mut app, "no mesh", |world| world.get::<Mesh3d>(clay).is_none() && world.get::<ClaySurface>(clay).is_none());
}

/// A ray from above meets the top of a cube that falls, where the cube is then; one beside it meets nothing.
/// What it meets lies in the box of the surface.
#[test]
fn ray_meets_the_top_of_the_dropped_cube() {
    let mut app = app_with_meshes();
    let clay = spawn(&mut app, cube(4, 16.0));
    let down = |x: f64| Ray3d::new((DVec3::new(x, 40.0, 4.0) * DX).as_vec3(), Dir3::NEG_Y);
    let surface = |world: &World| world.get::<ClaySurface>(clay).cloned();
    settle(&mut app, "a surface", |world| surface(world).is_some());
    let (first, start) = (surface(app.world()).expect("surface"), height(&app, clay));
    let top = first.cast(down(4.0)).expect("the top");
    assert!((top.point.y / DX - 20.0).abs() < 0.15 && top.normal.y > 0.98, "{top:?}");
    assert!((top.distance + top.point.y - 40.0 * DX).abs() < 1e-6);
    assert!(first.cast(down(1.0)).is_none(), "beside the cube");
    let (low, high) = first.bounds().expect("bounds");
    assert!(top.point.cmpge(low - 1e-6).all() && top.point.cmple(high + 1e-6).all(), "{} is not in {low} to {high}", top.point);

    (0..11).for_each(|_| tick(&mut app, clay));
    let frames = app.world().resource::<Reports>().0.len() as u64;
    settle(&mut app, "the last surface", |world| surface(world).is_some_and(|s| s.revision().1 == frames));
    let fallen = start - height(&app, clay);
    let now = surface(app.world()).expect("surface").cast(down(4.0)).expect("the top");
    assert!(fallen > DX && ((top.point.y - now.point.y) / fallen - 1.0).abs() < 0.05, "{fallen} m, {top:?}, {now:?}");
    assert_eq!(first.cast(down(4.0)), Some(top), "a clone stays as it was");
}

/// A particle far from the body is drawn, as a ball of its volume in the same mesh and within its bounds; the
/// surface that apps read, and export, is the body alone.
#[test]
fn lone_particle_shows_as_a_ball() {
    let mut app = app_with_meshes();
    let mut snapshot = cube(4, 4.0);
    let place = DVec3::new(4.0, 20.0, 5.0) * DX;
    let volume = DX.powi(3) / 8.0;
    snapshot.particles.push(Particle::at(snapshot.domain.to_grid(place), volume as f32, 512));
    let clay = spawn(&mut app, snapshot);
    settle(&mut app, "a mesh", |world| world.get::<Mesh3d>(clay).is_some());
    let world = app.world();
    let surface = world.get::<ClaySurface>(clay).expect("surface");
    let grains = surface.grains();
    let [grain] = grains else { panic!("{grains:?}") };
    assert!(
        grain.particle == 512 && (Vec3::from_array(grain.position) - place.as_vec3()).length() < 1e-4 * DX as f32,
        "{grain:?}"
    );
    let mesh = world.get::<Mesh3d>(clay).and_then(|m| world.resource::<Assets<Mesh>>().get(m)).expect("asset");
    let body = surface.mesh().expect("mesh");
    assert_eq!(mesh.count_vertices(), body.positions.len() + 12 * grains.len());
    assert_eq!(mesh.indices().expect("indices").len(), 3 * (body.triangles.len() + 20 * grains.len()));
    assert_eq!(metrics(&app, clay).triangle_count, body.triangles.len() + 20 * grains.len());
    let positions = mesh.attribute(Mesh::ATTRIBUTE_POSITION).and_then(|a| a.as_float3()).expect("positions");
    let ball: Vec<DVec3> = positions[positions.len() - 12..].iter().map(|p| Vec3::from_array(*p).as_dvec3() - place).collect();
    let radius = (0.75 * volume / std::f64::consts::PI).cbrt();
    assert!(ball.iter().all(|p| (p.length() / radius - 1.1821).abs() < 1e-3), "{ball:?}");
    let bounds = world.get::<Aabb>(clay).expect("bounds");
    assert!(f64::from(bounds.max().y) > place.y + radius, "the ball is within {bounds:?}");
    assert!(body.bounds().expect("a body").1.y < 9.0 * DX, "the body alone");
}

/// A surface that is on its way when the clay is replaced is never shown.
#[test]
fn surface_of_a_replaced_clay_is_dropped() {
    let mut app = app_with_meshes();
    let clay = spawn_clay(&mut app, Clay::default());
    assert!(app.world().get::<ClaySurface>(clay).is_none(), "64,000 particles take longer than an update");
    app.world_mut().entity_mut(clay).insert(Clay::snapshot(cube(2, 0.0)));
    settle(&mut app, "a surface", |world| world.get::<ClaySurface>(clay).is_some());
    let volume = app.world().get::<ClaySurface>(clay).expect("surface").mesh().expect("mesh").volume();
    assert!(volume < 2.0 * (2.0 * DX).powi(3), "{volume} m^3 is the first clay's");
}

/// With the clay goes its engine.
#[test]
fn removed_clay_takes_its_engine_along() {
    let mut app = app();
    let clay = spawn(&mut app, cube(2, 0.0));
    app.world_mut().entity_mut(clay).remove::<Clay>();
    app.update();
    assert!(app.world().get::<ClayEngine>(clay).is_none());
}
