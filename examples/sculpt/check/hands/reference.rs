//! The same balls on the same clay, without app, headset and clock on the wall: what they should leave.

use super::sculpt::{DEPTH, GAP};
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::field::{Field, SurfaceSettings};
use glam::{DQuat, DVec3};

/// Length of a frame \[s\].
const FRAME: f64 = 0.05;

/// A ball that presses.
pub(super) struct Ball {
    pub(super) radius: f64,
    /// Where its middle is when it touches the top \[m\].
    pub(super) touch: DVec3,
}

/// How far above where it touches the ball is at `time` \[s\], as hands bring it: down, there, up, away.
fn gap(time: f64) -> f64 {
    let (down, stay, up) = (1.0, 2.0, 0.7);
    let part = if time < down { time / down } else { 1.0 - ((time - stay) / up).clamp(0.0, 1.0) };
    GAP + (-DEPTH - GAP) * part
}

/// The surface of `clay` after the balls.
///
/// # Errors
/// What the engine refuses.
pub(super) fn pressed(clay: &Snapshot, balls: &[Ball]) -> Result<Field, EngineError> {
    let mut engine = NativeEngine::new();
    engine.load(clay)?;
    let mut planner = Planner::new(clay);
    for frame in 0..(3.2 / FRAME) as u32 {
        let start = f64::from(frame) * FRAME;
        let path = |(id, ball): (u32, &Ball)| {
            let sample = |time: f64| PoseSample {
                time,
                pose: Pose { position: ball.touch + DVec3::Y * gap(start + time), rotation: DQuat::IDENTITY },
            };
            let tool = Tool { shape: ToolShape::Sphere { radius: ball.radius }, contact: Contact::default() };
            ToolPath { id, tool, sheet: 0, samples: vec![sample(0.0), sample(FRAME)] }
        };
        let paths: Vec<_> = (1..).zip(balls).map(path).collect();
        let Decision::Run(plan) = planner.frame(&clay.material, FRAME, &paths) else { continue };
        engine.submit(plan)?;
        planner.sent();
        let mut report = engine.wait()?;
        planner.note(&mut report);
    }
    let source = engine.surface().ok_or(EngineError::NotLoaded)?;
    Ok(Field::of_particles(&source, &SurfaceSettings::default()))
}
