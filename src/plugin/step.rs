//! Plans a frame for each clay from the clock and the tools, and hands it to the engine. Never waits.

use super::clay::{Clay, ClaySettings};
use super::engine::ClayEngine;
use super::held::HeldTime;
use super::schedule::ClaySystems;
use super::tool::{Placement, SculptTool};
use crate::sim::engine::EngineError;
use crate::sim::frame::FrameOutputs;
use crate::sim::material::ClayMaterial;
use crate::sim::params::ParamsError;
use crate::sim::planner::{Policy, ToolSamples};
use crate::sim::tool::Tool;
use bevy::prelude::*;

/// Plans frames.
pub(super) struct StepPlugin;

impl Plugin for StepPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Update, step.in_set(ClaySystems::Step));
    }
}

/// Plans a frame for each clay that runs.
#[expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]
fn step(
    (time, real): (Res<Time>, Res<Time<Real>>),
    mut clays: Query<(Entity, &ClaySettings, &ClayMaterial, &mut ClayEngine), With<Clay>>,
    tools: Query<(Entity, &SculptTool)>,
    transforms: TransformHelper,
    mut held: ResMut<HeldTime>,
) {
    let _watch = held.watch();
    for (entity, settings, material, mut clay) in &mut clays {
        let clay = clay.bypass_change_detection();
        let (is_stopped, is_leaving) = (clay.stopped.is_some(), clay.is_leaving);
        let (engine, plans) = clay.parts();
        if settings.is_paused || is_stopped {
            plans.planner.lift();
            continue;
        }
        let placed = placed(entity, &tools, &transforms).inspect_err(|_| plans.planner.lift());
        let result = placed.map_err(EngineError::Params).and_then(|tools| {
            let wall = settings.is_responsive.then(|| real.delta_secs_f64());
            plans.planner.policy = policy(settings, wall);
            plans.planner.pass(time.delta_secs_f64(), &tools);
            // The next engine goes on with what the tools did meanwhile.
            if is_leaving { Ok(()) } else { plans.step(engine, material) }
        });
        match result {
            Ok(()) => {}
            Err(EngineError::Params(error)) => plans.refuse(entity, error),
            Err(error) => {
                error!("clay {entity} lost its engine: {error}");
                clay.stopped = Some(error);
            }
        }
    }
}

/// How the frames of a clay are planned.
fn policy(settings: &ClaySettings, wall: Option<f64>) -> Policy {
    let &ClaySettings { gravity, inertia, backlog, .. } = settings;
    // The surface, for the plugin or an app that draws it itself; the state is asked for when it is wanted.
    Policy { gravity, inertia, backlog, wall, outputs: FrameOutputs::default(), ..Policy::default() }
}

/// The active tools as the clay sees them.
fn placed(
    clay: Entity,
    tools: &Query<(Entity, &SculptTool)>,
    transforms: &TransformHelper,
) -> Result<Vec<ToolSamples>, ParamsError> {
    let place = |name, entity| {
        let transform = transforms.compute_global_transform(entity);
        Placement::new(name, &transform.map_err(|e| ParamsError::new(name, entity, e.to_string()))?)
    };
    let clay = place("clay transform", clay)?;
    let active = tools.iter().filter(|(_, tool)| tool.is_active);
    let seen = |(entity, tool): (Entity, &SculptTool)| {
        let Placement { pose, scale } = clay.seen(&place("tool transform", entity)?);
        let shape = Tool { shape: tool.tool.shape.scaled(scale), ..tool.tool };
        Ok(ToolSamples::now(entity.to_bits(), tool.id, shape, pose))
    };
    active.map(seen).collect()
}
