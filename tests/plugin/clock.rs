//! The clay's own clock: pause, speed, time that goes by without it, schedules, gravity.

use super::*;
use bevy::ecs::schedule::ScheduleLabel;

/// A ball beside the clay that steps to its other side while `meanwhile` is done to the app, and what that
/// did to the clay: how far the middle of the clay went \[cells\].
fn slash(app: &mut App, clay: Entity, meanwhile: impl FnOnce(&mut App)) -> f64 {
    let at = |x: f64| Transform::from_translation((DVec3::new(x, 2.0, 4.0) * DX).as_vec3());
    let tool = app.world_mut().spawn((SculptTool::ball(1.5 * DX as f32), at(-1.0))).id();
    tick(app, clay);
    let middle = |app: &App| state(app, clay).particles.iter().map(|p| p.grid().x).sum::<f64>();
    let (before, count) = (middle(app), state(app, clay).particles.len() as f64);
    app.world_mut().entity_mut(tool).insert(at(9.0));
    meanwhile(app);
    tick(app, clay);
    ((middle(app) - before) / count).abs()
}

/// A tool that is on the other side when time goes on was not swept through the clay: whatever stopped it.
#[test]
fn tools_do_not_slash_through_clay_that_stood() {
    type Pause = fn(&mut App, Entity);
    let pauses: [(&str, Pause); 5] = [
        ("its clock", |app, clay| {
            let pause = |app: &mut App, paused| app.world_mut().get_mut::<ClayClock>(clay).expect("a clock").paused = paused;
            pause(app, true);
            tick(app, clay);
            pause(app, false);
        }),
        ("its speed", |app, clay| {
            let speed = |app: &mut App, speed| app.world_mut().get_mut::<ClayClock>(clay).expect("a clock").speed = speed;
            speed(app, 0.0);
            tick(app, clay);
            speed(app, 1.0);
        }),
        ("the app's clock", |app, clay| {
            app.world_mut().resource_mut::<Time<Virtual>>().pause();
            tick(app, clay);
            app.world_mut().resource_mut::<Time<Virtual>>().unpause();
        }),
        ("its schedule", |app, _| {
            app.insert_resource(Stands(true));
            app.insert_resource(TimeUpdateStrategy::ManualDuration(TICK));
            (0..3).for_each(|_| app.update());
            app.insert_resource(Stands(false));
        }),
        ("sleep", |app, _| {
            app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(8)));
            app.update();
        }),
    ];
    for (name, pause) in pauses {
        let mut app = app();
        app.init_resource::<Stands>();
        app.configure_sets(Update, ClaySystems::Step.run_if(|stands: Res<Stands>| !stands.0));
        let clay = spawn(&mut app, cube(4, 0.0));
        let moved = slash(&mut app, clay, |app| pause(app, clay));
        assert!(moved < 0.01, "{name}: the clay went {moved} cells");
    }
    // Without a pause it is swept.
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 0.0));
    let moved = slash(&mut app, clay, |_| ());
    assert!(moved > 0.01, "swept, the clay went {moved} cells");
}

/// Whether the clay's systems are left out.
#[derive(Resource, Default)]
struct Stands(bool);

/// A clock at half speed is half as fast; one of a speed that cannot be is named, and the clay stands until
/// it is mended.
#[test]
fn clock_of_the_clay_has_a_speed() {
    let mut app = app();
    let clay = spawn(&mut app, cube(2, 12.0));
    let set = |app: &mut App, speed| app.world_mut().get_mut::<ClayClock>(clay).expect("a clock").speed = speed;
    set(&mut app, 0.5);
    for _ in 0..4 {
        tick(&mut app, clay);
    }
    let time = metrics(&app, clay).time;
    assert!((time - 0.02).abs() < 1e-9, "{time} s");
    for speed in [-1.0, f64::NAN] {
        set(&mut app, speed);
        tick(&mut app, clay);
        let error = status(&app, clay).error.as_ref().expect("an error").to_string();
        assert!(error.contains("clock speed"), "{error}");
        assert_eq!(metrics(&app, clay).time, time);
    }
    set(&mut app, 1.0);
    tick(&mut app, clay);
    assert_eq!(status(&app, clay).error, None);
    assert!(metrics(&app, clay).time > time);
}

/// Force that was felt before a pause is over in it.
#[test]
fn lifted_tools_feel_nothing() {
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 0.0));
    let at = |y: f64| Transform::from_translation((DVec3::new(4.0, y, 4.0) * DX).as_vec3());
    let tool = app.world_mut().spawn((SculptTool::ball(2.0 * DX as f32), at(6.5))).id();
    for step in 1..4 {
        app.world_mut().entity_mut(tool).insert(at(6.5 - 0.5 * f64::from(step)));
        tick(&mut app, clay);
    }
    let force = |app: &App| app.world().get::<ToolForce>(tool).expect("a force").force;
    assert!(force(&app).y > 0.1);
    app.world_mut().get_mut::<ClayClock>(clay).expect("a clock").paused = true;
    (0..3).for_each(|_| tick(&mut app, clay));
    assert_eq!(force(&app), Vec3::ZERO);
}

/// Clay on a turntable is pulled down all the same; one clay may have a gravity of its own.
#[test]
fn gravity_is_the_worlds() {
    let fall = |turn: Quat, own: Option<DVec3>| {
        let mut app = app();
        let clay = spawn(&mut app, cube(2, 12.0));
        app.world_mut().entity_mut(clay).insert(Transform::from_rotation(turn));
        app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").gravity = own;
        let middle = |app: &App| {
            let state = state(app, clay);
            let sum: DVec3 = state.particles.iter().map(|p| state.domain.to_world(p.grid())).sum();
            sum / state.particles.len() as f64
        };
        let before = middle(&app);
        for _ in 0..3 {
            tick(&mut app, clay);
        }
        turn * (middle(&app) - before).as_vec3()
    };
    let straight = fall(Quat::IDENTITY, None);
    assert!(straight.y < -1e-3 && straight.x.abs() < 1e-6);
    let turned = fall(Quat::from_rotation_x(1.0), None);
    assert!((turned - straight).length() < 1e-3 * straight.length(), "{straight}, {turned}");
    let aside = fall(Quat::IDENTITY, Some(DVec3::X * 9.81));
    assert!((aside.x + straight.y).abs() < 1e-3 * aside.x && aside.y.abs() < 1e-6, "{aside}");
}

/// In a schedule of its own the clay follows that schedule's clock, as often as it runs.
#[test]
fn clay_runs_in_the_schedule_that_is_chosen() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, ClayPlugins.set(SchedulePlugin::new(FixedUpdate))))
        .insert_resource(Time::<Fixed>::from_duration(Duration::from_millis(4)))
        .init_resource::<Reports>()
        .add_systems(Last, |mut new: MessageReader<ClayReport>, mut all: ResMut<Reports>| all.0.extend(new.read().cloned()));
    for schedule in [FixedUpdate.intern(), Update.intern()] {
        app.edit_schedule(schedule, |s| {
            s.set_build_settings(ScheduleBuildSettings { ambiguity_detection: LogLevel::Error, ..default() });
        });
    }
    app.update();
    let settings = ClaySettings { engine: EngineChoice::Native, is_responsive: false, ..default() };
    let clay = app.world_mut().spawn((Clay::snapshot(cube(4, 0.0)), settings)).id();
    let at = |y: f64| Transform::from_translation((DVec3::new(4.0, y, 4.0) * DX).as_vec3());
    let tool = app.world_mut().spawn((SculptTool::ball(2.0 * DX as f32), at(6.5))).id();
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(1)));
    let start = Instant::now();
    while app.world().get::<ClayEngine>(clay).is_none() {
        app.update();
        assert!(start.elapsed() < PATIENCE, "no engine");
    }
    let before = app.world().resource::<Time<Fixed>>().elapsed_secs_f64();
    let down = move |mut tools: Query<&mut Transform, With<SculptTool>>, time: Res<Time>| {
        tools.iter_mut().for_each(|mut t| t.translation.y -= 0.2 * time.delta_secs());
    };
    app.add_systems(FixedUpdate, down.in_set(ClaySystems::Tool));
    // Frames of the app of half a step and of three steps.
    for milliseconds in [2, 12].into_iter().cycle().take(60) {
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(milliseconds)));
        app.update();
        // Time for the engine, which the clock knows nothing of.
        std::thread::sleep(Duration::from_millis(10));
    }
    let clock = app.world().resource::<Time<Fixed>>().elapsed_secs_f64() - before;
    let metrics = metrics(&app, clay);
    // Two frames may be under way, and a third owed.
    let followed = metrics.time + metrics.given_up;
    assert!(metrics.time > 0.0 && followed < clock + 1e-9 && followed > clock - 0.1, "{} s of {clock} s", metrics.time);
    assert!(app.world().resource::<Reports>().0.iter().any(|r| r.tool(tool).is_some_and(|t| t.force.y > 0.1)));
}
