//! Clay of the graphics device that an arm touches.

use super::{DX, app, check, cube, height, metrics, run, settle, spawn, state, status};
use bevy::ecs::schedule::SingleThreadedExecutor;
use bevy::log::tracing::subscriber;
use bevy::log::tracing_subscriber::fmt;
use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use bevy_clay::prelude::*;
use glam::DVec3;
use libtest_mimic::Failed;
use std::io::Write;
use std::sync::{Arc, Mutex, PoisonError};

/// So weak that the cube is in the air for more than a second, by the clock on the wall while an arm is there
/// [m/s^2].
const GRAVITY: f64 = 0.05;

/// What is logged.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<u8>>>);

impl Write for Log {
    fn write(&mut self, words: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(words);
        Ok(words.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Clay that is to run on the graphics device moves to the processor when an arm comes to it, with its shape
/// and its time, and says why in one line and in its status; when the arm goes it is back.
pub(super) fn arm_takes_clay_from_the_gpu_engine() -> Result<(), Failed> {
    let log = Log::default();
    let writer = log.clone();
    subscriber::with_default(fmt().with_writer(move || writer.clone()).finish(), bind_and_part)?;
    let text = String::from_utf8_lossy(&log.0.lock().unwrap_or_else(PoisonError::into_inner)).into_owned();
    let count = text.matches("a haptic arm touches the clay: it runs on the CPU engine").count();
    check(count == 1, format!("{count} lines say why: {text}"))
}

fn bind_and_part() -> Result<(), Failed> {
    let mut app = app();
    // On this thread, whose log is read.
    app.edit_schedule(Update, |schedule| {
        schedule.set_executor(SingleThreadedExecutor::new());
    });
    let clay = spawn(&mut app, EngineChoice::Gpu)?;
    // In steps that are exact for a fall.
    let mut settings = app.world_mut().get_mut::<ClaySettings>(clay).expect("settings");
    (settings.gravity, settings.integrator) = (Some(DVec3::NEG_Y * GRAVITY), IntegratorChoice::Explicit);
    run(&mut app, clay, 0.02)?;
    check(status(app.world(), clay).engine.starts_with("GPU"), status(app.world(), clay).engine.clone())?;
    let before = metrics(app.world(), clay).time;
    // Hands are looked at by the clock on the wall.
    app.insert_resource(TimeUpdateStrategy::Automatic);
    let tool = app.world_mut().spawn((SculptTool::ball(0.005), HapticSettings::simulated(SimulatedHand::default()))).id();
    settle(&mut app, "the native engine", |world| status(world, clay).engine.starts_with("native"))?;
    check(metrics(app.world(), clay).time >= before, "the clay went back")?;
    settle(&mut app, "the hand at the clay", |world| world.resource::<HapticSession>().clay() == Some(clay))?;
    settle(&mut app, "clay that goes on", |world| metrics(world, clay).time > before + 0.02)?;
    let error = status(app.world(), clay).error.as_ref().map(ToString::to_string).unwrap_or_default();
    check(error.contains("a haptic arm touches the clay"), format!("status: {error}"))?;
    app.world_mut().despawn(tool);
    settle(&mut app, "the GPU engine", |world| status(world, clay).engine.starts_with("GPU"))?;
    settle(&mut app, "no error", |world| status(world, clay).error.is_none())?;
    let after = state(&mut app, clay);
    // Where all that took long, it lies on the floor.
    let (fallen, expected) = (height(&cube()) - height(&after), (GRAVITY * after.time.powi(2) / 2.0).min(8.0 * DX));
    check((fallen / expected - 1.0).abs() < 0.05, format!("{fallen} m instead of {expected} m: not where it left off"))
}
