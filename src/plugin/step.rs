//! Plans a frame for each clay from its clock and the tools, and hands it to the engine. Never waits.

use super::clay::{Clay, ClaySettings};
use super::clock::{ClayClock, ClayGravity, Gap};
use super::engine::ClayEngine;
use super::held::HeldTime;
use super::schedule::{ClaySystems, schedule};
use super::space::ClaySpace;
use super::tool::{HeldTool, SculptTool, ToolStatus, ToolTrail, TouchesOnly};
use crate::sim::engine::EngineError;
use crate::sim::frame::FrameOutputs;
use crate::sim::material::ClayMaterial;
use crate::sim::params::ParamsError;
use crate::sim::planner::{IntegratorChoice, Policy, ToolSamples};
use crate::sim::tool::{PoseSample, Tool};
use bevy::ecs::entity::EntityHashMap;
use bevy::prelude::*;
use bevy::time::TimeSystems;
use glam::DVec3;

/// Plans frames. Without it clay stands still; it is shown, and its state may be asked for.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepPlugin;

impl Plugin for StepPlugin {
    fn build(&self, app: &mut App) {
        let schedule = schedule(app);
        app.init_resource::<ClayGravity>()
            .add_systems(First, lift.after(TimeSystems))
            .add_systems(schedule, step.in_set(ClaySystems::Step));
    }
}

/// Lifts the tools while the app's clock is paused, whatever schedule the clay is in.
fn lift(clock: Option<Res<Time<Virtual>>>, mut clays: Query<&mut ClayEngine>) {
    if clock.is_some_and(|clock| clock.is_paused() || clock.relative_speed_f64() == 0.0) {
        clays.iter_mut().for_each(|mut clay| clay.bypass_change_detection().plans.lift());
    }
}

/// What a frame of a clay is planned from.
type Planned<'a> = (Entity, &'a ClaySettings, &'a ClayClock, &'a ClayMaterial, &'a mut ClayEngine);

/// The tools of the app, and where it says how they are.
type Tools<'a> = (Entity, &'a SculptTool, &'a mut ToolStatus, Option<&'a mut ToolTrail>, Option<&'a TouchesOnly>);

/// What is wrong with tools.
type Faults = EntityHashMap<ParamsError>;

/// Plans a frame for each clay that runs.
fn step(
    (time, real, gravity): (Res<Time>, Res<Time<Real>>, Res<ClayGravity>),
    mut gap: Local<Gap>,
    mut clays: Query<Planned, With<Clay>>,
    mut tools: Query<Tools>,
    transforms: TransformHelper,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let (wall, is_gap) = gap.look(&time, &real);
    let mut faults = Faults::default();
    let hands = held_tools(&mut tools, &transforms, &mut faults);
    for (entity, settings, clock, material, mut clay) in &mut clays {
        let clay = clay.bypass_change_detection();
        if is_gap || clock.stands() || clay.stopped.is_some() {
            clay.plans.lift();
        }
        if clock.stands() || clay.stopped.is_some() {
            continue;
        }
        let space = clock.validate().and_then(|()| place("clay transform", entity, &transforms));
        let result = space.map_err(EngineError::Params).and_then(|space| {
            let gravity = space.vector_to_clay(settings.gravity.unwrap_or(gravity.0));
            let (is_leaving, runs_on_device) = (clay.is_leaving, clay.runs_on_device());
            let (engine, plans) = clay.parts();
            plans.planner.policy = policy(settings, gravity, settings.is_responsive.then_some(wall));
            if runs_on_device {
                plans.planner.policy.integrator = IntegratorChoice::Explicit;
            }
            plans.pass(time.delta_secs_f64(), clock.speed, &ways(entity, &space, &hands, &mut faults));
            // The next engine goes on with what the tools did meanwhile.
            if is_leaving { Ok(()) } else { plans.step(engine, material) }
        });
        match result {
            Ok(()) => {}
            Err(EngineError::Params(error)) => clay.plans.refuse(entity, error),
            Err(error) => {
                error!("clay {entity} lost its engine: {error}");
                clay.stopped = Some(error);
            }
        }
    }
    for (entity, _, mut status, ..) in &mut tools {
        let error = faults.remove(&entity);
        if status.error != error {
            error.iter().for_each(|error| warn!("tool {entity} is left out: {error}"));
            status.error = error;
        }
    }
}

/// How the frames of a clay are planned, with gravity in its own frame.
fn policy(settings: &ClaySettings, gravity: DVec3, wall: Option<f64>) -> Policy {
    let &ClaySettings { integrator, accuracy, inertia, backlog, .. } = settings;
    // The surface, for the plugin or an app that draws it itself; the state is asked for when it is wanted.
    Policy { gravity, integrator, accuracy, inertia, backlog, wall, outputs: FrameOutputs::default(), ..Policy::default() }
}

/// Where an entity of kind `name` is in the world.
fn place(name: &'static str, entity: Entity, transforms: &TransformHelper) -> Result<ClaySpace, ParamsError> {
    let transform = transforms.compute_global_transform(entity);
    ClaySpace::named(name, &transform.map_err(|e| ParamsError::new(name, entity, e.to_string()))?)
}

/// The active tools in the world, in the order of their entities, without those that are nowhere.
fn held_tools(tools: &mut Query<Tools>, transforms: &TransformHelper, faults: &mut Faults) -> Vec<HeldTool> {
    let mut held = vec![];
    for (entity, tool, _, mut trail, only) in tools {
        let way = trail.as_mut().map_or_else(Vec::new, |trail| trail.drain());
        if !tool.is_active {
            continue;
        }
        let place = match place("tool transform", entity, transforms) {
            Ok(place) => place,
            Err(fault) => {
                faults.insert(entity, fault);
                continue;
            }
        };
        let way = if way.is_empty() { vec![(0.0, place.pose)] } else { way };
        let tool = Tool { shape: tool.shape, contact: tool.contact };
        held.push(HeldTool { entity, tool, scale: place.scale, way, only: only.cloned() });
    }
    held.sort_by_key(|tool| tool.entity);
    held
}

/// What the tools did since the last look as that clay sees it, without those that cannot be.
fn ways(clay: Entity, space: &ClaySpace, hands: &[HeldTool], faults: &mut Faults) -> Vec<ToolSamples> {
    let mut seen = vec![];
    for hand in hands.iter().filter(|hand| hand.touches(clay)) {
        let tool = Tool { shape: hand.tool.shape.scaled(hand.scale / space.scale()), ..hand.tool };
        if let Err(fault) = tool.validate() {
            faults.insert(hand.entity, fault);
            continue;
        }
        let samples = hand.way.iter().map(|&(ago, pose)| PoseSample { time: -ago, pose: space.pose_to_clay(pose) });
        seen.push(ToolSamples { key: hand.entity.to_bits(), tool, samples: samples.collect() });
    }
    seen
}
