//! Plans a frame for each clay from its clock and the tools, and hands it to the engine. Never waits.

use super::clay::{Clay, ClaySettings};
use super::clock::{ClayClock, ClayGravity, Gap};
use super::engine::ClayEngine;
use super::feel::{HapticSession, drive};
use super::held::HeldTime;
use super::run::{ArmOrders, Orders, Run};
use super::schedule::{ClaySystems, schedule};
use super::space::ClaySpace;
use super::tool::{HeldTool, SculptTool, ToolStatus, ToolTrail, TouchesOnly};
use crate::haptics;
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
fn lift(clock: Option<Res<Time<Virtual>>>, clays: Query<&ClayEngine>) {
    if app_speed(clock.as_deref()) == 0.0 {
        clays.iter().for_each(|clay| clay.run.lock().stand());
    }
}

/// Seconds of the app's clock per second of wall time [-].
fn app_speed(clock: Option<&Time<Virtual>>) -> f64 {
    clock.map_or(1.0, |clock| if clock.is_paused() { 0.0 } else { clock.relative_speed_f64() })
}

/// What a frame of a clay is planned from.
type Planned<'a> = (Entity, &'a ClaySettings, &'a ClayClock, &'a ClayMaterial, &'a mut ClayEngine);

/// The tools of the app, and where it says how they are.
type Tools<'a> = (Entity, &'a SculptTool, &'a mut ToolStatus, Option<&'a mut ToolTrail>, Option<&'a TouchesOnly>);

/// What is wrong with tools.
type Faults = EntityHashMap<ParamsError>;

/// The clocks that clay goes by.
type Clocks<'w> = (Res<'w, Time>, Res<'w, Time<Real>>, Option<Res<'w, Time<Virtual>>>, Res<'w, ClayGravity>);

/// Says what each clay's frames are planned from, and plans one for each that runs; an arm's thread plans
/// those of the clay that it holds a tool to, by the clock on the wall.
fn step(
    (time, real, app_clock, gravity): Clocks,
    mut gap: Local<Gap>,
    mut clays: Query<Planned, With<Clay>>,
    mut tools: Query<Tools>,
    transforms: TransformHelper,
    session: Option<Res<HapticSession>>,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let (wall, is_gap) = gap.look(&time, &real);
    let mut faults = Faults::default();
    let hands = held_tools(&mut tools, &transforms, &mut faults);
    let look = Look {
        app_speed: app_speed(app_clock.as_deref()),
        in_hand: session.and_then(|session| session.tool()).map(Entity::to_bits),
        hands,
    };
    for (entity, settings, clock, material, mut clay) in &mut clays {
        let clay = clay.bypass_change_detection();
        let mut run = clay.run.lock();
        if clock.stands() || clay.stopped.is_some() {
            run.stand();
            continue;
        }
        if is_gap {
            run.plans.lift();
        }
        let space = clock.validate().and_then(|()| place("clay transform", entity, &transforms));
        match space {
            Ok(space) => {
                let gravity = space.vector_to_clay(settings.gravity.unwrap_or(gravity.0));
                let mut policy = policy(settings, gravity, settings.is_responsive.then_some(wall));
                if clay.bridge.is_some() {
                    policy.integrator = IntegratorChoice::Explicit;
                }
                look.order(entity, &mut run, (policy, *material, clock.speed), &space, &mut faults);
                if !run.is_driven {
                    run.advance(entity, time.delta_secs_f64(), 0.0, None);
                }
            }
            Err(error) => {
                run.orders.iter_mut().for_each(|orders| orders.stands = true);
                run.plans.refuse(entity, error);
            }
        }
        drop(run);
        clay.heed(entity);
    }
    for (entity, _, mut status, ..) in &mut tools {
        let error = faults.remove(&entity);
        if status.error != error {
            error.iter().for_each(|error| warn!("tool {entity} is left out: {error}"));
            status.error = error;
        }
    }
}

/// What an app's frame brings to all clay.
struct Look {
    /// Seconds of the app's clock per second of wall time [-].
    app_speed: f64,
    /// The tool in an arm's hand.
    in_hand: Option<u64>,
    hands: Vec<HeldTool>,
}

impl Look {
    /// Writes what a clay's plans come from, and where its tools were.
    fn order(
        &self,
        entity: Entity,
        run: &mut Run,
        (policy, material, speed): (Policy, ClayMaterial, f64),
        space: &ClaySpace,
        faults: &mut Faults,
    ) {
        let written = haptics::clock::now();
        let now = if run.is_driven { written } else { 0.0 };
        let mut ways = ways(entity, space, &self.hands, now, faults);
        let mut orders = Orders { policy, material, speed, stands: false, arm: None, written };
        if run.is_driven {
            drive::arm(&mut orders, self.app_speed);
            let arm = ways.iter().position(|tool| Some(tool.key) == self.in_hand).map(|i| ways.remove(i));
            orders.arm = arm.map(|arm| ArmOrders { key: arm.key, tool: arm.tool, space: *space });
        }
        run.orders = Some(orders);
        run.plans.offer(ways);
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
/// Its clock stands at `now` \[s\].
fn ways(clay: Entity, space: &ClaySpace, hands: &[HeldTool], now: f64, faults: &mut Faults) -> Vec<ToolSamples> {
    let mut seen = vec![];
    for hand in hands.iter().filter(|hand| hand.touches(clay)) {
        let tool = Tool { shape: hand.tool.shape.scaled(hand.scale / space.scale()), ..hand.tool };
        if let Err(fault) = tool.validate() {
            faults.insert(hand.entity, fault);
            continue;
        }
        let samples = hand.way.iter().map(|&(ago, pose)| PoseSample { time: now - ago, pose: space.pose_to_clay(pose) });
        seen.push(ToolSamples { key: hand.entity.to_bits(), tool, samples: samples.collect() });
    }
    seen
}
