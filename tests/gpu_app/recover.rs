//! Errors of the graphics device: whose they are, and an app that outlives them.

use super::{GRAVITY, app, check, cube, height, metrics, plugins, run, settle, spawn, state, status};
use bevy::log::tracing::field::{Field, Visit};
use bevy::log::tracing::{Event, Level, Metadata, Subscriber, span, subscriber};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::error_handler::{RenderErrorHandler, RenderErrorPolicy};
use bevy::render::renderer::{RenderDevice, initialize_renderer};
use bevy::render::settings::{RenderCreation, WgpuSettings};
use bevy::time::TimeUpdateStrategy;
use bevy_clay::prelude::*;
use libtest_mimic::Failed;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Asks the device for a buffer that there is no room for, by this name.
pub(super) fn commit_fault(app: &App, label: &str) {
    let device = app.world().resource::<RenderDevice>().wgpu_device().clone();
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::STORAGE;
    let _ = device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size: 1 << 60, usage, mapped_at_creation: false });
}

/// The app outlives its device: another one is made, and the clay goes on from its last kept state, no
/// further back than the interval.
pub(super) fn clay_goes_on_after_the_device_is_lost() -> Result<(), Failed> {
    let mut app = app();
    let clay = spawn(&mut app, EngineChoice::Gpu)?;
    run(&mut app, clay, 0.05)?;
    // The copy that is due.
    std::thread::sleep(Duration::from_millis(20));
    for _ in 0..20 {
        app.update();
        std::thread::sleep(Duration::from_millis(2));
    }
    let before = metrics(app.world(), clay).time;
    let device = app.world().resource::<RenderDevice>().wgpu_device().clone();
    // The loss shows where Bevy polls the device; devices of two instances compare equal.
    let put_in = |world: &World| world.resource_ref::<RenderDevice>().last_changed();
    let first = put_in(app.world());
    // With a frame under way, whose results go with the device.
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(5)));
    settle(&mut app, "a frame under way", |world| world.get::<ClayEngine>(clay).is_some_and(|e| e.pending() > 0))?;
    device.destroy();
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    settle(&mut app, "another device", |world| put_in(world) != first)?;
    settle(&mut app, "the engine on it", |world| world.get::<ClayEngine>(clay).is_some_and(|e| e.pending() == 0))?;
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(5)));
    settle(&mut app, "clay that goes on", |world| metrics(world, clay).time > before)?;
    let after = state(&mut app, clay);
    let fallen = height(&cube()) - height(&after);
    let expected = GRAVITY * after.time.powi(2) / 2.0;
    check((fallen / expected - 1.0).abs() < 0.01, format!("{fallen} m instead of {expected} m: not where it left off"))?;
    check(status(app.world(), clay).engine.starts_with("GPU"), status(app.world(), clay).engine.clone())
}

/// A validation error in the clay's work stops its engine, not the app; the clay goes on natively and says
/// why.
pub(super) fn fault_of_the_clay_does_not_end_the_app() -> Result<(), Failed> {
    let mut app = app();
    let clay = spawn(&mut app, EngineChoice::Gpu)?;
    run(&mut app, clay, 0.02)?;
    commit_fault(&app, "bevy_clay:fault");
    let is_native = |world: &World| status(world, clay).engine.starts_with("native");
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(5)));
    settle(&mut app, "the native engine", is_native)?;
    let error = status(app.world(), clay).error.as_ref().map(ToString::to_string).unwrap_or_default();
    check(error.contains("bevy_clay:fault"), format!("error: {error}"))?;
    let before = metrics(app.world(), clay).time;
    run(&mut app, clay, 0.02)?;
    check(metrics(app.world(), clay).time > before, "the clay stands")
}

/// Errors that are not the clay's go where they went before.
pub(super) fn fault_of_the_app_goes_to_the_app() -> Result<(), Failed> {
    static SEEN: AtomicUsize = AtomicUsize::new(0);
    let mut app = app();
    app.insert_resource(RenderErrorHandler(|_, _, _| {
        SEEN.fetch_add(1, Ordering::Relaxed);
        RenderErrorPolicy::Ignore
    }));
    let clay = spawn(&mut app, EngineChoice::Native)?;
    commit_fault(&app, "the app's");
    run(&mut app, clay, 0.02)?;
    check(SEEN.load(Ordering::Relaxed) == 1, format!("seen {} times", SEEN.load(Ordering::Relaxed)))
}

/// So do those of things that the app names by its clay.
pub(super) fn fault_of_an_app_with_like_names_goes_to_the_app() -> Result<(), Failed> {
    static SEEN: AtomicUsize = AtomicUsize::new(0);
    let mut app = app();
    app.insert_resource(RenderErrorHandler(|_, _, _| {
        SEEN.fetch_add(1, Ordering::Relaxed);
        RenderErrorPolicy::Ignore
    }));
    let clay = spawn(&mut app, EngineChoice::Gpu)?;
    run(&mut app, clay, 0.02)?;
    for (count, label) in [(1, "clay_pot"), (2, "clay:pot")] {
        commit_fault(&app, label);
        run(&mut app, clay, 0.02)?;
        let seen = SEEN.load(Ordering::Relaxed);
        check(seen == count, format!("the app heard of {seen} faults, not {count}, after that of `{label}`"))?;
    }
    check(status(app.world(), clay).engine.starts_with("GPU"), "the clay's engine was stopped for it")
}

/// The plugin stands before the app's own handler only while clay is on the device.
pub(super) fn handler_of_the_app_stands_while_clay_is_on_the_processor() -> Result<(), Failed> {
    fn own(_: &bevy::render::error_handler::RenderError, _: &mut World, _: &mut World) -> RenderErrorPolicy {
        RenderErrorPolicy::Ignore
    }
    const OWN: RenderErrorHandler = RenderErrorHandler(own);
    let mut app = app();
    app.insert_resource(OWN);
    let is_own = |world: &World| std::ptr::fn_addr_eq(world.resource::<RenderErrorHandler>().0, OWN.0);
    let clay = spawn(&mut app, EngineChoice::Native)?;
    run(&mut app, clay, 0.02)?;
    check(is_own(app.world()), "it is replaced for clay on the processor")?;
    for (engine, name, expected) in [(EngineChoice::Gpu, "GPU", false), (EngineChoice::Native, "native", true)] {
        app.world_mut().get_mut::<ClaySettings>(clay).ok_or("settings")?.engine = engine;
        settle(&mut app, name, |world| status(world, clay).engine.starts_with(name))?;
        (0..20).for_each(|_| app.update());
        check(is_own(app.world()) == expected, format!("the app's handler stands: {}, on the {name} engine", !expected))?;
    }
    Ok(())
}

/// Takes down the errors that are logged.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<String>>>);

impl Visit for Log {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        if field.name() == "message" {
            self.0.lock().expect("the log").push(format!("{value:?}"));
        }
    }
}

impl Subscriber for Log {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        *metadata.level() == Level::ERROR
    }
    fn new_span(&self, _: &span::Attributes<'_>) -> span::Id {
        span::Id::from_u64(1)
    }
    fn record(&self, _: &span::Id, _: &span::Record<'_>) {}
    fn record_follows_from(&self, _: &span::Id, _: &span::Id) {}
    fn event(&self, event: &Event<'_>) {
        event.record(&mut self.clone());
    }
    fn enter(&self, _: &span::Id) {}
    fn exit(&self, _: &span::Id) {}
}

/// A device that the app made by hand, as for OpenXR, is not made anew: the plugin says so once and leaves
/// the loss to the app. Faults of the clay's own it takes as anywhere.
pub(super) fn loss_of_a_device_made_by_hand_is_the_apps() -> Result<(), Failed> {
    let settings = WgpuSettings::default();
    let backends = settings.backends.ok_or("no backend")?;
    let resources = bevy::tasks::block_on(initialize_renderer(backends, None, &settings));
    let mut app = App::new();
    let render = RenderPlugin { render_creation: RenderCreation::Manual(resources), ..default() };
    app.add_plugins((plugins().set(render), ClayPlugins)).insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
    let clay = spawn(&mut app, EngineChoice::Gpu)?;
    commit_fault(&app, "bevy_clay:fault");
    settle(&mut app, "the native engine", |world| status(world, clay).engine.starts_with("native"))?;
    let other = app.world_mut().spawn((Clay::snapshot(cube()), ClaySettings { surface: SurfaceBackend::Gpu, ..default() })).id();
    settle(&mut app, "a surface on the device", |world| metrics(world, other).triangle_count > 0)?;
    let log = Log::default();
    let lines = log.0.clone();
    let device = app.world().resource::<RenderDevice>().wgpu_device().clone();
    subscriber::with_default(log, || {
        device.destroy();
        for _ in 0..100 {
            if app.should_exit().is_none() {
                app.update();
            }
        }
    });
    let lines = lines.lock().map_err(|e| e.to_string())?;
    let said = lines.iter().filter(|line| line.contains("is not made anew")).count();
    check(app.should_exit().is_some(), "the app did not hear of the loss")?;
    check(said == 1, format!("said {said} times: {lines:?}"))
}
