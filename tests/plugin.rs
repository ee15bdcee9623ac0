//! The Bevy plugin in an app without window: clock, clay, reports.

use bevy::ecs::schedule::{LogLevel, ScheduleBuildSettings};
use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use bevy_clay::prelude::*;
use bevy_clay::sim::tool::ToolShape;
use glam::DVec3;
use std::time::{Duration, Instant};

const DX: f64 = 0.005;
const TICK: Duration = Duration::from_millis(10);

/// A cube of clay, `width` cells wide with 8 particles per cell, its underside `height` cells above the floor.
fn cube(width: i32, height: f64) -> Snapshot {
    let room = DVec3::new(8.0, 24.0, 8.0) * DX;
    let domain = Domain::new(DVec3::ZERO, room, DX, Walls::default()).expect("domain");
    let corner = domain.to_grid(DVec3::new(2.0, height, 2.0) * DX);
    let n = 2 * width;
    let at = |i: i32| DVec3::new(f64::from(i % n), f64::from(i / n % n), f64::from(i / (n * n))) * 0.5 + 0.25;
    let particle = |i: i32| Particle::at(corner + at(i), (DX.powi(3) / 8.0) as f32, i.cast_unsigned());
    Snapshot { domain, material: Preset::SoftClay.material(), time: 0.0, particles: (0..n * n * n).map(particle).collect() }
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

fn spawn(app: &mut App, snapshot: &Snapshot) -> Entity {
    app.world_mut().spawn(Clay::new(snapshot).expect("clay")).id()
}

/// One tick of the clock, then as many updates with the clock stopped as the frame takes.
fn tick(app: &mut App, clay: Entity) {
    app.insert_resource(TimeUpdateStrategy::ManualDuration(TICK));
    app.update();
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    let start = Instant::now();
    while app.world_mut().get_mut::<Clay>(clay).expect("clay").engine().pending() > 0 {
        assert!(start.elapsed() < Duration::from_secs(60), "a frame did not end");
        std::thread::sleep(Duration::from_millis(1));
        app.update();
    }
}

/// Height [m] of the centre of mass.
fn height(app: &mut App, clay: Entity) -> f64 {
    let snapshot = app.world_mut().get_mut::<Clay>(clay).expect("clay").engine().save().expect("state");
    let sum: f64 = snapshot.particles.iter().map(|p| snapshot.domain.to_world(p.grid()).y).sum();
    sum / snapshot.particles.len() as f64
}

/// The app above runs with ambiguities as errors: a system that touches clay without an order is found, one within a set is not.
#[test]
#[should_panic(expected = "ambig")]
fn schedule_with_an_unordered_system_is_refused() {
    let mut app = app();
    app.add_systems(Update, (|_: Query<&mut Clay>| {}).after(ClaySystems::Report).before(ClaySystems::Step));
    app.update();
    app.add_systems(Update, |_: Query<&mut Clay>| {});
    app.update();
}

/// A dropped cube falls g t^2 / 2 within 1 %, by the clay's own time, which is the clock's.
#[test]
fn dropped_cube_falls_as_it_should() {
    let mut app = app();
    let clay = spawn(&mut app, &cube(4, 16.0));
    let start = height(&mut app, clay);
    for _ in 0..11 {
        tick(&mut app, clay);
    }
    let report = app.world().resource::<Reports>().0.last().expect("report").report.clone();
    let fallen = start - height(&mut app, clay);
    let expected = 9.81 * report.time.powi(2) / 2.0;
    assert!(report.health.is_ok(), "{}", report.health);
    assert!((fallen / expected - 1.0).abs() < 0.01, "{fallen} m instead of {expected} m in {} s", report.time);
    let clock = app.world().resource::<Time>().elapsed_secs_f64();
    assert!((report.time - clock).abs() < 1e-9, "clay at {} s, clock at {clock} s", report.time);
}

/// The frame loop never waits: at most two frames are under way, the clock's surplus is counted, not queued.
#[test]
fn update_gives_time_up_instead_of_waiting() {
    let mut app = app();
    let clay = spawn(&mut app, &cube(4, 16.0));
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(100)));
    for _ in 0..10 {
        app.update();
        let mut clay = app.world_mut().get_mut::<Clay>(clay).expect("clay");
        assert!(clay.engine().pending() <= 2);
    }
    let given_up = app.world().get::<Clay>(clay).expect("clay").given_up();
    assert!(given_up > 0.5, "{given_up} s of 1 s given up at 33 ms per frame");
}

/// A tool that an app moves is swept through the clay and feels it.
#[test]
fn tool_moved_by_the_app_feels_the_clay() {
    let mut app = app();
    let clay = spawn(&mut app, &cube(4, 0.0));
    let tool = Tool { shape: ToolShape::Sphere { radius: 2.0 * DX }, contact: Contact::default() };
    let pose = Pose { position: DVec3::new(4.0, 6.5, 4.0) * DX, ..Pose::default() };
    app.world_mut().spawn(SculptTool { id: 7, tool, pose });
    let down = |mut tools: Query<&mut SculptTool>, time: Res<Time>| {
        tools.iter_mut().for_each(|mut t| t.pose.position.y -= 0.2 * time.delta_secs_f64());
    };
    app.add_systems(Update, down.in_set(ClaySystems::Tool));
    for _ in 0..5 {
        tick(&mut app, clay);
    }
    let last = app.world().resource::<Reports>().0.last().expect("report").report.tools[0];
    assert_eq!(last.id, 7);
    assert!(last.force.y > 0.0, "pressed down, the ball feels {} N", last.force);
}

/// A material that the engine refuses stops the clay with its reason; the app goes on.
#[test]
fn refused_material_stops_the_clay_by_name() {
    let mut app = app();
    let clay = spawn(&mut app, &cube(2, 0.0));
    let bad = ClayMaterial { poisson_ratio: 0.5, ..ClayMaterial::default() };
    app.world_mut().entity_mut(clay).insert(bad);
    for _ in 0..3 {
        tick(&mut app, clay);
    }
    let error = app.world().get::<Clay>(clay).expect("clay").error().expect("error").to_string();
    assert!(error.contains("poisson_ratio"), "{error}");
}

/// Two apps in one process are strangers: the second's clay, gravity and tools leave the first's bits alone.
#[test]
fn two_apps_share_no_state() {
    let run = |beside: bool| {
        let (mut first, mut second) = (app(), app());
        let clay = spawn(&mut first, &cube(2, 12.0));
        let other = spawn(&mut second, &cube(3, 2.0));
        second.world_mut().get_mut::<Clay>(other).expect("clay").limits.gravity = DVec3::X;
        for _ in 0..4 {
            tick(&mut first, clay);
            if beside {
                tick(&mut second, other);
            }
        }
        let reports = std::mem::take(&mut first.world_mut().resource_mut::<Reports>().0);
        let state = first.world_mut().get_mut::<Clay>(clay).expect("clay").engine().save().expect("state").to_bytes();
        let strangers = reports.iter().filter(|r| r.clay != clay).count();
        assert_eq!(strangers, 0);
        (state, reports.len(), second.world().resource::<Reports>().0.len())
    };
    let (alone, beside) = (run(false), run(true));
    assert!(alone.0 == beside.0, "the second app changed the first one's clay");
    assert_eq!((alone.1, alone.2), (4, 0));
    assert_eq!((beside.1, beside.2), (4, 4));
}
