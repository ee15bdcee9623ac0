//! Clay on the GPU engine inside a Bevy app that renders, without a window: the same clay, moved between
//! engines, and an app that outlives the device.
//!
//! `CLAY_GPU=off|auto|require`: without an adapter the tests are listed as ignored, or, where one is
//! required, fail.

mod delay;
mod feel;
mod group;
mod look;
mod recover;
mod shown;
mod software;

use bevy::app::{PluginGroupBuilder, PluginsState};
use bevy::ecs::schedule::{InternedScheduleLabel, ScheduleLabel, SystemKey};
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::renderer::RenderGraph;
use bevy::render::{ExtractSchedule, Render, RenderApp};
use bevy::time::TimeUpdateStrategy;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::prelude::*;
use glam::DVec3;
use libtest_mimic::{Arguments, Failed, Trial};
use std::collections::HashMap;
use std::time::{Duration, Instant};

const DX: f64 = 0.005;
/// So weak that the cube falls all the time [m/s^2].
const GRAVITY: f64 = 0.5;
/// Longest that a test waits for what has to come: it guards against hanging, and says nothing of speed.
const PATIENCE: Duration = Duration::from_secs(300);

/// A cube of clay 4 cells wide, 8 cells above the floor.
fn cube() -> Snapshot {
    let domain = Domain::new(DVec3::ZERO, DVec3::new(8.0, 16.0, 8.0) * DX, DX, Walls::default()).expect("domain");
    let corner = domain.to_grid(DVec3::new(2.0, 8.0, 2.0) * DX);
    let at = |i: i32| DVec3::new(f64::from(i % 8), f64::from(i / 8 % 8), f64::from(i / 64)) * 0.5 + 0.25;
    let particle = |i: i32| Particle::at(corner + at(i), (DX.powi(3) / 8.0) as f32, i.cast_unsigned());
    Snapshot::new(domain, Preset::SoftClay.material(), (0..512).map(particle).collect())
}

/// Bevy's plugins without a window.
fn plugins() -> PluginGroupBuilder {
    let window = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    DefaultPlugins.set(window).disable::<WinitPlugin>().disable::<LogPlugin>()
}

/// An app that renders without a window; its clock stands.
fn app() -> App {
    let mut app = App::new();
    app.add_plugins((plugins(), ClayPlugins)).insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    app
}

/// An app whose frames are drawn before the next begins.
fn app_in_step() -> App {
    let mut app = App::new();
    let plugins = plugins().disable::<PipelinedRenderingPlugin>();
    app.add_plugins((plugins, ClayPlugins)).insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    app
}

/// Updates until `done`; an app that exits fails.
fn settle(app: &mut App, what: &str, mut done: impl FnMut(&World) -> bool) -> Result<(), Failed> {
    let start = Instant::now();
    while app.plugins_state() == PluginsState::Adding {
        std::thread::sleep(Duration::from_millis(1));
    }
    if app.plugins_state() == PluginsState::Ready {
        app.finish();
        app.cleanup();
    }
    while !done(app.world()) {
        app.update();
        if app.should_exit().is_some() {
            return Err(format!("the app ended while it waited for {what}").into());
        }
        if start.elapsed() > PATIENCE {
            let states: Vec<_> = app.world_mut().query::<&ClayStatus>().iter(app.world()).cloned().collect();
            return Err(format!("waited in vain for {what}: {states:?}").into());
        }
    }
    Ok(())
}

fn spawn(app: &mut App, engine: EngineChoice) -> Result<Entity, Failed> {
    let settings = ClaySettings {
        engine,
        snapshot_interval: 0.01,
        mesh: MeshQuality::Off,
        gravity: Some(DVec3::NEG_Y * GRAVITY),
        ..default()
    };
    let clay = app.world_mut().spawn((Clay::snapshot(cube()), settings)).id();
    settle(app, "an engine", |world| world.get::<ClayEngine>(clay).is_some())?;
    Ok(clay)
}

fn status(world: &World, clay: Entity) -> &ClayStatus {
    world.get::<ClayStatus>(clay).expect("status")
}

fn metrics(world: &World, clay: Entity) -> &ClayMetrics {
    world.get::<ClayMetrics>(clay).expect("metrics")
}

/// Runs frames of 5 ms until the clay is `time` [s] further.
fn run(app: &mut App, clay: Entity, time: f64) -> Result<(), Failed> {
    let until = metrics(app.world(), clay).time + time - 1e-9;
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(5)));
    settle(app, "frames of clay", |world| metrics(world, clay).time >= until)?;
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    settle(app, "the last frame", |world| world.get::<ClayEngine>(clay).is_some_and(|e| e.pending() == 0))
}

/// The state, which comes back from the device while the app goes on; no time passes for the clay.
fn state(app: &mut App, clay: Entity) -> Snapshot {
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    let mut ticket = app.world().get::<ClayEngine>(clay).expect("engine").request_state().expect("clay");
    loop {
        app.update();
        if let Some(make) = ticket.take().expect("an engine") {
            return make().expect("a device");
        }
    }
}

/// Height [m] of the centre of mass.
fn height(snapshot: &Snapshot) -> f64 {
    let sum: f64 = snapshot.particles.iter().map(|p| snapshot.domain.to_world(p.grid()).y).sum();
    sum / snapshot.particles.len() as f64
}

fn check(holds: bool, what: impl Into<String>) -> Result<(), Failed> {
    if holds { Ok(()) } else { Err(what.into().into()) }
}

/// A dropped cube falls g t^2 / 2 within 1 %, driven by the render graph.
fn dropped_cube_falls_on_the_gpu_engine() -> Result<(), Failed> {
    let mut app = app();
    let clay = spawn(&mut app, EngineChoice::Gpu)?;
    let name = &status(app.world(), clay).engine;
    check(name.starts_with("GPU") || name.is_empty(), format!("runs on the {name}"))?;
    run(&mut app, clay, 0.05)?;
    check(status(app.world(), clay).engine.starts_with("GPU"), status(app.world(), clay).engine.clone())?;
    let (after, expected) = (state(&mut app, clay), GRAVITY * metrics(app.world(), clay).time.powi(2) / 2.0);
    let fallen = height(&cube()) - height(&after);
    check((fallen / expected - 1.0).abs() < 0.01, format!("{fallen} m instead of {expected} m"))?;
    // The app that draws the clay itself sees the same.
    let surface = app.world().get::<ClayEngine>(clay).and_then(ClayEngine::surface).expect("a surface");
    let count = surface.particles.len() as f64;
    let mean = surface.particles.iter().map(|p| f64::from(p.position[1])).sum::<f64>() / count;
    let expected = after.particles.iter().map(|p| p.grid().y).sum::<f64>() / count;
    check((mean - expected).abs() < 1e-4, format!("its surface stands at {mean} cells, the clay at {expected}"))
}

/// Changing the engine moves the clay over, particle by particle, there and back; nothing that ran meanwhile
/// is taken back.
fn change_of_engine_keeps_the_state() -> Result<(), Failed> {
    let mut app = app();
    let clay = spawn(&mut app, EngineChoice::Native)?;
    run(&mut app, clay, 0.02)?;
    for (choice, name) in [(EngineChoice::Gpu, "GPU"), (EngineChoice::Native, "native")] {
        let before = state(&mut app, clay);
        app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").engine = choice;
        settle(&mut app, name, |world| status(world, clay).engine.starts_with(name))?;
        let after = state(&mut app, clay);
        let key = |s: &Snapshot| {
            let mut all: Vec<_> = s.particles.iter().map(|p| (p.id, p.cell, p.offset.map(f32::to_bits))).collect();
            all.sort_unstable();
            all
        };
        check(key(&before) == key(&after), format!("the particles moved on the way to the {name} engine"))?;
        check(before.time == after.time, format!("{} s became {} s", before.time, after.time))?;
        run(&mut app, clay, 0.02)?;
        check(metrics(app.world(), clay).time > before.time + 0.019, "the clay stands")?;
    }
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(5)));
    for (choice, name) in [(EngineChoice::Gpu, "GPU"), (EngineChoice::Native, "native")] {
        let mut times = vec![];
        app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").engine = choice;
        settle(&mut app, name, |world| {
            times.push(metrics(world, clay).time);
            status(world, clay).engine.starts_with(name)
        })?;
        check(times.is_sorted(), format!("on the way to the {name} engine the clay went back: {times:?}"))?;
    }
    Ok(())
}

/// An engine that stops while the clay moves away from it: the clay goes on from what was kept.
fn clay_leaves_an_engine_that_stops() -> Result<(), Failed> {
    let mut app = app();
    let clay = spawn(&mut app, EngineChoice::Gpu)?;
    run(&mut app, clay, 0.05)?;
    app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").engine = EngineChoice::Native;
    recover::commit_fault(&app, "bevy_clay:fault");
    settle(&mut app, "the native engine", |world| status(world, clay).engine.starts_with("native"))?;
    let before = metrics(app.world(), clay).time;
    run(&mut app, clay, 0.02)?;
    check(metrics(app.world(), clay).time > before + 0.019, "the clay stands")
}

/// A ball of `radius` cells that floats in its room.
fn ball(radius: f64) -> Snapshot {
    let size = 2.0 * radius.ceil() + 8.0;
    let domain = Domain::new(DVec3::ZERO, DVec3::splat(size) * DX, DX, Walls::default()).expect("domain");
    let middle = domain.to_grid(DVec3::splat(size / 2.0) * DX);
    let n = 2 * (2.0 * radius.ceil()) as i32;
    let at = |i: i32| DVec3::new(f64::from(i % n), f64::from(i / n % n), f64::from(i / n / n)) * 0.5 + 0.25 - radius.ceil();
    let inside = (0..n * n * n).map(at).filter(|at| at.length() < radius);
    let particles = inside.zip(0..).map(|(at, id)| Particle::at(middle + at, (DX.powi(3) / 8.0) as f32, id)).collect();
    Snapshot::new(domain, Preset::SoftClay.material(), particles)
}

/// Triangles that the processor makes of the clay as it stands, of the surface and with its balls.
fn triangles(world: &World, clay: Entity) -> (usize, usize) {
    let source = world.get::<ClayEngine>(clay).and_then(ClayEngine::surface).expect("a surface");
    let all = extract_with_grains(&source, &SurfaceSettings::new(Tier::Fine));
    (all.mesh.triangles.len(), all.drawn().triangles.len())
}

/// The cube, and a particle alone, far above it.
fn cube_and_particle() -> Snapshot {
    let mut snapshot = cube();
    let place = snapshot.domain.to_grid(DVec3::new(3.0, 14.0, 5.0) * DX);
    snapshot.particles.push(Particle::at(place, (DX.powi(3) / 8.0) as f32, 512));
    snapshot
}

/// The device makes as many triangles as the processor, of either engine's clay, at the start, after it has
/// moved, and of clay that the first mesh has no room for; who makes them may change at any time.
fn surface_is_made_on_the_device() -> Result<(), Failed> {
    let clays = [
        (EngineChoice::Native, cube_and_particle(), 20),
        (EngineChoice::Gpu, cube_and_particle(), 20),
        (EngineChoice::Native, ball(12.2), 0),
    ];
    for (engine, snapshot, of_balls) in clays {
        let mut app = app();
        let gravity = Some(DVec3::NEG_Y * GRAVITY);
        let settings = ClaySettings { engine, gravity, surface: SurfaceBackend::Gpu, ..default() };
        let clay = app.world_mut().spawn((Clay::snapshot(snapshot), settings)).id();
        settle(&mut app, "an engine", |world| world.get::<ClayEngine>(clay).is_some())?;
        let (body, expected) = triangles(app.world(), clay);
        check(expected == body + of_balls, format!("{expected} triangles with balls, {body} without"))?;
        settle(&mut app, "the surface", |world| metrics(world, clay).triangle_count == expected)?;
        let mesh = |world: &World| world.get::<Mesh3d>(clay).map(|mesh| mesh.id());
        let drawn = mesh(app.world());
        check(drawn.is_some(), "nothing to draw")?;
        run(&mut app, clay, 0.01)?;
        let (body, expected) = triangles(app.world(), clay);
        check(expected == body + of_balls, format!("{expected} triangles with balls, {body} without, after a while"))?;
        // What changes by less than a hundredth is not extracted anew.
        let is_near = |count: usize| count.abs_diff(expected) <= expected / 50;
        settle(&mut app, "the surface after a while", |world| is_near(metrics(world, clay).triangle_count))?;
        app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").surface = SurfaceBackend::Cpu;
        let by_processor =
            |world: &World| world.get::<ClaySurface>(clay).map_or(0, |s| s.mesh().map_or(0, |m| m.triangles.len())) == body;
        settle(&mut app, "the processor's surface", |world| {
            by_processor(world) && mesh(world).is_some_and(|m| Some(m) != drawn)
        })?;
        app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").surface = SurfaceBackend::Gpu;
        settle(&mut app, "the device's again", |world| !by_processor(world) && metrics(world, clay).triangle_count == expected)?;
    }
    Ok(())
}

/// No system of the plugin runs in an order left to chance, in any schedule of both worlds.
fn systems_have_an_order() -> Result<(), Failed> {
    let mut app = App::new();
    app.add_plugins((plugins().disable::<PipelinedRenderingPlugin>(), ClayPlugins, SoftwareDrawingPlugin));
    spawn(&mut app, EngineChoice::Gpu)?;
    let mut found = vec![];
    let mut look = |world: &World, label: InternedScheduleLabel, ours: &[&str]| -> Result<(), Failed> {
        let schedule = world.resource::<Schedules>().get(label).ok_or_else(|| format!("no schedule {label:?}"))?;
        let names: HashMap<SystemKey, String> =
            schedule.systems()?.map(|(key, system)| (key, system.name().shortname().to_string())).collect();
        let missing = ours.iter().find(|name| !names.values().any(|n| n == *name));
        check(missing.is_none(), format!("{missing:?} is not in {label:?}: {names:?}"))?;
        // Where Bevy builds a schedule anew it may name sync points that it has taken out.
        let named = |key| names.get(key).map(|name| name.split(" (").next().unwrap_or_default());
        for (a, b, on) in schedule.graph().conflicting_systems().iter() {
            let (Some(a), Some(b)) = (named(a), named(b)) else { continue };
            if ours.contains(&a) || ours.contains(&b) {
                let on: Vec<_> = on.iter().filter_map(|id| world.components().get_name(*id)).collect();
                found.push(format!("{label:?}: {a}, {b}: {on:?}"));
            }
        }
        Ok(())
    };
    let systems = ["start", "admit", "report", "keep", "step", "choose", "swap", "request", "status", "measure"];
    look(app.world(), Update.intern(), &systems)?;
    look(app.world(), PostUpdate.intern(), &["keep"])?;
    look(app.world(), Last.intern(), &["decide"])?;
    let render = app.get_sub_app(RenderApp).ok_or("no render world")?.world();
    look(render, ExtractSchedule.intern(), &["extract"])?;
    look(render, RenderGraph.intern(), &["record"])?;
    look(render, Render.intern(), &["upload", "submitted", "turn", "prepare", "measure", "pace"])?;
    check(found.is_empty(), format!("{found:#?}"))
}

type Test = fn() -> Result<(), Failed>;

fn main() {
    let mut arguments = Arguments::from_args();
    // Software adapters use all cores for each.
    arguments.test_threads.get_or_insert(1);
    let trials: [(&str, Test); 24] = [
        ("dropped_cube_falls_on_the_gpu_engine", dropped_cube_falls_on_the_gpu_engine),
        ("change_of_engine_keeps_the_state", change_of_engine_keeps_the_state),
        ("clay_leaves_an_engine_that_stops", clay_leaves_an_engine_that_stops),
        ("arm_takes_clay_from_the_gpu_engine", feel::arm_takes_clay_from_the_gpu_engine),
        ("clay_goes_on_after_the_device_is_lost", recover::clay_goes_on_after_the_device_is_lost),
        ("fault_of_the_clay_does_not_end_the_app", recover::fault_of_the_clay_does_not_end_the_app),
        ("fault_of_the_app_goes_to_the_app", recover::fault_of_the_app_goes_to_the_app),
        ("surface_is_made_on_the_device", surface_is_made_on_the_device),
        ("frame_drawn_is_the_frame_simulated", delay::frame_drawn_is_the_frame_simulated),
        ("cameras_of_windows_draw_fewer_pixels", software::cameras_of_windows_draw_fewer_pixels),
        ("pictures_follow_their_window", software::pictures_follow_their_window),
        ("hardware_draws_as_ever", software::hardware_draws_as_ever),
        ("clay_without_a_material_gets_the_look", look::clay_without_a_material_gets_the_look),
        ("look_leaves_the_materials_of_the_app", look::look_leaves_the_materials_of_the_app),
        ("systems_have_an_order", systems_have_an_order),
        ("fault_of_an_app_with_like_names_goes_to_the_app", recover::fault_of_an_app_with_like_names_goes_to_the_app),
        (
            "handler_of_the_app_stands_while_clay_is_on_the_processor",
            recover::handler_of_the_app_stands_while_clay_is_on_the_processor,
        ),
        ("loss_of_a_device_made_by_hand_is_the_apps", recover::loss_of_a_device_made_by_hand_is_the_apps),
        ("any_plugin_may_be_disabled", group::any_plugin_may_be_disabled),
        ("clay_has_one_material", shown::clay_has_one_material),
        ("removed_clay_leaves_no_trace", shown::removed_clay_leaves_no_trace),
        ("quality_off_takes_the_mesh_away", shown::quality_off_takes_the_mesh_away),
        ("slabs_stay_as_large_as_the_app_has_them", shown::slabs_stay_as_large_as_the_app_has_them),
        ("mesh_of_another_layout_is_not_written", shown::mesh_of_another_layout_is_not_written),
    ];
    let mode = GpuMode::from_env().expect("CLAY_GPU");
    let is_ignored = mode == GpuMode::Off || mode == GpuMode::Auto && GpuDevice::headless().is_err();
    let trial = |(name, run)| Trial::test(name, run).with_ignored_flag(is_ignored);
    libtest_mimic::run(&arguments, trials.into_iter().map(trial).collect()).exit();
}
