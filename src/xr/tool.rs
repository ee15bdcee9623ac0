//! Tools in hands: where they are, how hard they are pressed.

use super::hand::{Controller, XrControllers, XrHand, XrHands};
use crate::plugin::tool::{SculptTool, ToolTrail};
use bevy::prelude::*;

/// A [`SculptTool`] in a hand: the plugin writes its pose, and whether it touches clay.
///
/// The tool comes out as the trigger is pressed: a little pressure puts it down `reach` behind its place, all
/// of it puts it there. So the hand chooses how deep it works, as a finger does.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
#[require(SculptTool, ToolTrail, ToolMute)]
pub struct HeldBy {
    /// The hand.
    pub hand: XrHand,
    /// The tool's place before the controller's tip, which looks along -z.
    pub offset: Isometry3d,
    /// How far a tool that is hardly pressed stays behind \[m\].
    pub reach: f32,
    /// Whether the hand has put it away: it follows, and touches nothing.
    pub is_away: bool,
}

impl Default for HeldBy {
    /// 6 cm before the tool hand, pressed by up to 5 mm.
    fn default() -> Self {
        Self { hand: XrHand::Tool, offset: Isometry3d::from_translation(Vec3::NEG_Z * 0.06), reach: 0.005, is_away: false }
    }
}

impl HeldBy {
    /// In this hand, else as the default.
    pub fn new(hand: XrHand) -> Self {
        Self { hand, ..Self::default() }
    }

    /// The tool's pose in the world, of a controller whose tip is at `tip` and whose trigger is pressed by
    /// `strength` (0 to 1).
    pub fn pose(&self, tip: Isometry3d, strength: f32) -> Isometry3d {
        let behind = Vec3::Z * self.reach * (1.0 - strength.clamp(0.0, 1.0));
        tip * Isometry3d::from_translation(behind) * self.offset
    }
}

/// Whether a tool in a hand touches no clay, however hard it is pressed: its ray is on a panel.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
pub struct ToolMute(pub bool);

/// Less of the trigger puts no tool down.
const TOUCH: f32 = 0.08;

/// The strength of a trigger that is pressed by `trigger`, none if it is not.
fn strength(trigger: f32) -> Option<f32> {
    (trigger > TOUCH).then(|| ((trigger - TOUCH) / (1.0 - TOUCH)).min(1.0))
}

/// Moves the tools in hands to where they are now.
pub(super) fn hold(
    controllers: Res<XrControllers>,
    hands: Res<XrHands>,
    mut tools: Query<(&HeldBy, &ToolMute, &mut SculptTool, &mut Transform, &mut ToolTrail)>,
) {
    for (held, mute, mut tool, mut transform, mut trail) in &mut tools {
        let Controller { tool: tip, trigger, .. } = controllers.get(hands.side(held.hand));
        let pressed = strength(*trigger).filter(|_| !mute.0 && !held.is_away);
        let is_active = tip.is_some() && pressed.is_some();
        if tool.is_active != is_active {
            tool.is_active = is_active;
        }
        // What is not seen stays where it was last.
        let Some(tip) = tip else { continue };
        let pose = held.pose(*tip, pressed.unwrap_or(0.0));
        trail.push(controllers.time, pose);
        transform.set_if_neq(Transform { scale: transform.scale, ..Transform::from_isometry(pose) });
    }
}

#[cfg(test)]
mod tests {
    use super::super::hand::Side;
    use super::*;

    fn world(controllers: XrControllers) -> World {
        let mut world = World::new();
        world.insert_resource(controllers);
        world.init_resource::<XrHands>();
        world
    }

    /// A controller of this trigger at `x`.
    fn controller(x: f32, trigger: f32) -> Controller {
        Controller { tool: Some(Isometry3d::from_xyz(x, 1.0, 0.0)), trigger, ..default() }
    }

    #[test]
    fn tools_follow_their_hands_wherever_these_are() {
        let mut controllers = XrControllers { time: 1.0, ..default() };
        *controllers.get_mut(Side::Left) = controller(-0.2, 1.0);
        *controllers.get_mut(Side::Right) = controller(0.2, 1.0);
        let mut world = world(controllers);
        let tools = [XrHand::Tool, XrHand::Support].map(|hand| world.spawn(HeldBy::new(hand)).id());
        let at = |world: &World, i: usize| world.get::<Transform>(tools[i]).expect("a tool").translation;
        world.run_system_cached(hold).expect("runs");
        assert_eq!([at(&world, 0), at(&world, 1)], [Vec3::new(0.2, 1.0, -0.06), Vec3::new(-0.2, 1.0, -0.06)]);
        world.resource_mut::<XrHands>().tool = Side::Left;
        world.resource_mut::<XrControllers>().time = 2.0;
        world.run_system_cached(hold).expect("runs");
        assert_eq!(at(&world, 0).x, -0.2);
        assert!(world.get::<SculptTool>(tools[0]).expect("a tool").is_active);
    }

    /// The harder the trigger, the further the tool is out, from not at all to its place.
    #[test]
    fn triggers_press_by_degrees() {
        let mut depths = vec![];
        for trigger in [0.0, 0.05, 0.1, 0.5, 1.0] {
            let mut controllers = XrControllers { time: 1.0, ..default() };
            *controllers.get_mut(Side::Right) = controller(0.0, trigger);
            let mut world = world(controllers);
            let tool = world.spawn(HeldBy::default()).id();
            world.run_system_cached(hold).expect("runs");
            let is_active = world.get::<SculptTool>(tool).expect("a tool").is_active;
            assert_eq!(is_active, trigger > TOUCH);
            depths.push(-world.get::<Transform>(tool).expect("a tool").translation.z);
        }
        assert!(depths.is_sorted() && depths[2] < depths[3] && depths[3] < depths[4], "{depths:?}");
        assert!((depths[4] - 0.06).abs() < 1e-6 && (depths[0] - 0.055).abs() < 1e-6, "{depths:?}");
    }

    /// Over a panel and out of sight nothing is pressed.
    #[test]
    fn mute_and_unseen_tools_touch_nothing() {
        let mut controllers = XrControllers { time: 1.0, ..default() };
        *controllers.get_mut(Side::Right) = controller(0.0, 1.0);
        let mut world = world(controllers);
        let tool = world.spawn((HeldBy::default(), ToolMute(true))).id();
        world.run_system_cached(hold).expect("runs");
        assert!(!world.get::<SculptTool>(tool).expect("a tool").is_active);
        world.get_mut::<ToolMute>(tool).expect("mute").0 = false;
        world.resource_mut::<XrControllers>().get_mut(Side::Right).tool = None;
        let before = *world.get::<Transform>(tool).expect("a tool");
        world.run_system_cached(hold).expect("runs");
        assert!(!world.get::<SculptTool>(tool).expect("a tool").is_active);
        assert_eq!(*world.get::<Transform>(tool).expect("a tool"), before);
    }
}
