//! What steps are made of.

use super::Step;
use super::remote::Remote;
use crate::hand::ToolKind;
use crate::headset::InHand;
use bevy::prelude::*;
use bevy_clay::prelude::*;
use glam::DVec3;
use std::collections::HashMap;

impl Step {
    /// Something that is done, and takes so long \[s\].
    pub(super) fn new(name: &'static str, seconds: f64, begin: impl FnMut(&mut World) + Send + Sync + 'static) -> Self {
        Self {
            name,
            begin: Box::new(begin),
            is_over: Box::new(move |_, now| now >= seconds),
            end: Box::new(|_| Ok(String::new())),
        }
    }

    /// Something that is waited for.
    pub(super) fn wait(name: &'static str, mut until: impl FnMut(&mut World) -> bool + Send + Sync + 'static) -> Self {
        Self { is_over: Box::new(move |world, _| until(world)), ..Self::new(name, 0.0, |_| ()) }
    }

    /// Something that is looked at.
    pub(super) fn check(
        name: &'static str,
        end: impl FnMut(&mut World) -> Result<String, String> + Send + Sync + 'static,
    ) -> Self {
        Self { end: Box::new(end), ..Self::new(name, 0.0, |_| ()) }
    }

    /// The same, not over before that is so.
    pub(super) fn until(self, mut until: impl FnMut(&mut World) -> bool + Send + Sync + 'static) -> Self {
        let mut is_over = self.is_over;
        Self { is_over: Box::new(move |world, now| is_over(world, now) && until(world)), ..self }
    }
}

/// The clay.
pub(super) fn clay(world: &mut World) -> Entity {
    world.query_filtered::<Entity, With<Clay>>().single(world).expect("one piece of clay")
}

/// Where the clay is.
pub(super) fn space(world: &mut World) -> ClaySpace {
    let clay = clay(world);
    ClaySpace::new(world.get::<GlobalTransform>(clay).expect("placed")).expect("upright")
}

/// The cell width of the clay \[m\].
pub(super) fn cell_width(world: &mut World) -> f64 {
    let clay = clay(world);
    world.get::<ClayStatus>(clay).expect("its status").cell_width
}

/// The surface that is shown.
pub(super) fn surface(world: &mut World) -> ClaySurface {
    let clay = clay(world);
    world.get::<ClaySurface>(clay).expect("a surface").clone()
}

/// The tool of a hand.
pub(super) fn tool(world: &mut World, hand: XrHand) -> Entity {
    let mut tools = world.query::<(Entity, &HeldBy)>();
    tools.iter(world).find(|(_, held)| held.hand == hand).expect("a tool").0
}

/// Takes another tool into a hand.
pub(super) fn take(world: &mut World, in_hand: XrHand, kind: ToolKind, size: f32) {
    let entity = tool(world, in_hand);
    let mut hand = world.get_mut::<InHand>(entity).expect("a hand's tool");
    (hand.kind, hand.size) = (kind, size);
    world.get_mut::<HeldBy>(entity).expect("held").is_away = false;
}

/// Half the extents of a hand's tool as the clay sees it \[m\].
pub(super) fn half(world: &mut World, in_hand: XrHand) -> DVec3 {
    let (entity, space) = (tool(world, in_hand), space(world));
    world.get::<InHand>(entity).expect("a hand's tool").half().as_dvec3() / space.scale()
}

/// Brings a hand, within `seconds`, to where its fully pressed tool has `pose` in the clay's frame.
pub(super) fn bring(world: &mut World, in_hand: XrHand, pose: Pose, seconds: f64) {
    let (entity, space) = (tool(world, in_hand), space(world));
    let at = space.pose_to_world(pose);
    let wanted = Isometry3d::new(at.position.as_vec3(), at.rotation.as_quat());
    let offset = world.get::<HeldBy>(entity).expect("held").offset;
    let side = world.resource::<XrHands>().side(in_hand);
    send(world, side, wanted * offset.inverse(), seconds);
}

/// Presses or leaves a hand's trigger.
pub(super) fn press(world: &mut World, in_hand: XrHand, trigger: f32) {
    let side = world.resource::<XrHands>().side(in_hand);
    world.resource::<Remote>().lock().hand(side).trigger = trigger;
}

/// Whether the clay has done what its tools did.
pub(super) fn is_settled(world: &mut World) -> bool {
    let is_held = world.query::<&SculptTool>().iter(world).any(|tool| tool.is_active);
    !is_held && is_followed(world)
}

/// Whether the clay has its tools where the hands have them: on a slow machine it comes after.
pub(super) fn is_followed(world: &mut World) -> bool {
    let clay = clay(world);
    world.get::<ClayMetrics>(clay).expect("its metrics").lag < 1e-3
}

/// Brings the hand of a side, within `seconds`, to where its tip has `pose` in the world.
pub(super) fn send(world: &mut World, side: Side, pose: Isometry3d, seconds: f64) {
    let controller = world.resource::<XrControllers>().get(side);
    // What a runtime has between the hand that it is told and the tip.
    let tip = controller.grip.zip(controller.tool).map_or(Isometry3d::IDENTITY, |(grip, tool)| grip.inverse() * tool);
    world.resource::<Remote>().lock().hand(side).go(pose * tip.inverse(), seconds);
}

/// A state that was asked for.
#[derive(Resource, Default)]
struct Asked(Option<bevy_clay::sim::engine::StateTicket>);

/// The clay as it stands, for whoever asks until it is there.
pub(super) fn state(world: &mut World) -> Option<Snapshot> {
    let clay = clay(world);
    world.init_resource::<Asked>();
    if let Some(ticket) = &mut world.resource_mut::<Asked>().0 {
        let taken = ticket.take();
        if matches!(taken, Ok(None)) {
            return None;
        }
        world.resource_mut::<Asked>().0 = None;
        return taken.ok().flatten()?().ok();
    }
    let ticket = world.get::<ClayEngine>(clay).and_then(|engine| engine.request_state().ok());
    world.resource_mut::<Asked>().0 = ticket;
    None
}

/// How far particles went between two states, at most [cells]; none if they are not the same ones.
pub(super) fn way(before: &Snapshot, after: &Snapshot) -> Option<f64> {
    let places = |clay: &Snapshot| clay.particles.iter().map(|p| (p.id, p.grid())).collect::<HashMap<_, _>>();
    let (before, after) = (places(before), places(after));
    if before.len() != after.len() {
        return None;
    }
    before.iter().map(|(id, at)| after.get(id).map(|now| now.distance(*at))).try_fold(0.0, |most, way| Some(way?.max(most)))
}

/// Clay that no tool touches still creeps by so much in some seconds [cells].
const CREEP: f64 = 0.1;

/// Whether the clay is what it was, and by how much not.
pub(super) fn is_intact(before: &Snapshot, after: &Snapshot) -> Result<String, String> {
    let way = way(before, after).ok_or("there are other particles")?;
    let said = format!("no particle went further than {way:.4} cells");
    if way < CREEP { Ok(said) } else { Err(said) }
}
