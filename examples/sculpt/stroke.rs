//! From the pointer to the tool: over the clay it hovers, pressed it goes in, and it never moves faster than
//! a hand that sculpts, or than the clay can follow.

mod knife;

use crate::hand::{Hand, ToolKind};
use crate::pace::Pace;
use crate::pointer::{Aim, Hit, Pointer, cast};
use crate::tools::InHand;
use bevy::prelude::*;
use bevy_clay::prelude::*;

/// Speed of pressing in \[units of the tools per second\].
const PRESS_SPEED: f32 = 1.2;
/// How far above the clay the tool hovers \[units of the tools\].
const HOVER: f32 = 0.02;

/// Moves the tool in hand.
pub(crate) struct StrokePlugin;

impl Plugin for StrokePlugin {
    fn build(&self, app: &mut App) {
        let systems = (hover.run_if(not(resource_exists::<Stroke>)), work.run_if(resource_exists::<Stroke>));
        app.add_systems(Update, systems.chain().in_set(ClaySystems::Tool));
    }
}

/// A stroke under way.
#[derive(Resource, Debug)]
pub(crate) struct Stroke {
    /// The surface it began with: the tool's depth is measured from there, for the clay yields under it.
    pub(crate) before: ClaySurface,
    /// Where the pointer is on that surface.
    pub(crate) hit: Hit,
    /// How deep the tool is to go now \[m\].
    pub(crate) depth: f32,
    aim: Aim,
    line: knife::Line,
    is_let_go: bool,
}

/// The tool in hand, as it is moved.
type Held<'a> = (&'a mut SculptTool, &'a mut Transform, &'a mut Visibility);

/// Shows the tool where the pointer meets the clay; pressed there, a stroke begins. A cut may begin beside
/// the clay.
pub(crate) fn hover(
    (pointer, hand): (Res<Pointer>, Res<Hand>),
    surface: Query<&ClaySurface>,
    tool: Single<Held, With<InHand>>,
    mut commands: Commands,
) {
    let (mut tool, mut place, mut visibility) = tool.into_inner();
    let is_knife = hand.kind == ToolKind::Knife;
    let met = surface.single().ok().zip(pointer.aim).and_then(|(surface, aim)| {
        let is_cut = is_knife && pointer.is_down;
        let hit = cast(surface, aim.ray).or_else(|| knife::beside(surface, aim).filter(|_| is_cut))?;
        Some((surface, aim, hit))
    });
    visibility.set_if_neq(if met.is_some() { Visibility::Inherited } else { Visibility::Hidden });
    let Some((surface, aim, hit)) = met else { return };
    let depth = -HOVER * hand.unit;
    place.set_if_neq(if is_knife { knife::ready(surface, aim, hit.distance, &hand) } else { hand.pose(&hit, aim.right, depth) });
    if pointer.is_down {
        // The knife is put down when it knows its direction; each stroke is a cut of its own.
        tool.is_active = !is_knife;
        let line = knife::Line::new(surface, aim);
        commands.insert_resource(Stroke { before: surface.clone(), hit, depth, aim, line, is_let_go: false });
    }
}

/// Moves the tool through the clay, until it is let go of.
pub(crate) fn work(
    (pointer, hand, pace): (Res<Pointer>, Res<Hand>, Res<Pace>),
    time: Res<Time>,
    tool: Single<Held, With<InHand>>,
    mut stroke: ResMut<Stroke>,
    mut commands: Commands,
) {
    let (mut tool, mut place, _) = tool.into_inner();
    // Let go, the knife ends its line; every other tool is lifted.
    stroke.is_let_go |= !pointer.is_down;
    if stroke.is_let_go && stroke.line.ahead.is_empty() {
        tool.is_active = false;
        commands.remove_resource::<Stroke>();
        return;
    }
    let delta = time.delta_secs();
    if let Some(aim) = pointer.aim.filter(|_| !stroke.is_let_go) {
        stroke.follow(aim, delta, &hand);
        if hand.kind == ToolKind::Knife
            && let Some(start) = stroke.cut(&hand)
        {
            *place = start;
            tool.is_active = true;
        }
    }
    stroke.advance(&mut place, tool.shape.bounding_radius() as f32, pace.tool_speed as f32 * delta, &hand);
}

impl Stroke {
    /// Takes in where the pointer is now.
    fn follow(&mut self, aim: Aim, delta: f32, hand: &Hand) {
        self.aim = aim;
        self.depth = (self.depth + PRESS_SPEED * hand.unit * delta).min(hand.depth_max());
        if let Some(hit) = cast(&self.before, aim.ray) {
            self.hit = hit;
        } else if let Some(point) = knife::on_plane(aim, self.hit.point) {
            // Beside the clay the tool goes on at the depth at which it left.
            self.hit.point = point;
        }
    }

    /// Draws the knife's line on; handed back is where the knife is put down, once it is.
    fn cut(&mut self, hand: &Hand) -> Option<Transform> {
        self.line.follow(&self.before, self.aim, self.hit.distance, hand)
    }

    /// Where the tool is to be, if it is no knife.
    pub(crate) fn target(&self, hand: &Hand) -> Transform {
        hand.pose(&self.hit, self.aim.right, self.depth)
    }

    /// Moves a tool of `reach` \[m\] towards where it should be; no point of it goes farther than `way` \[m\].
    fn advance(&mut self, place: &mut Transform, reach: f32, mut way: f32, hand: &Hand) {
        if hand.kind != ToolKind::Knife {
            approach(place, self.target(hand), reach, way);
        }
        while let Some(next) = self.line.ahead.front().filter(|_| way > 0.0) {
            way = approach(place, *next, reach, way);
            if way > 0.0 {
                self.line.ahead.pop_front();
            }
        }
    }
}

/// Moves `place` towards `target`; no point of a tool of `reach` goes farther than `way`. What is left of the
/// way is handed back.
fn approach(place: &mut Transform, target: Transform, reach: f32, way: f32) -> f32 {
    // A tool that waits stands: a rotation rounded anew would be a way to go for the clay.
    if way <= 0.0 {
        return 0.0;
    }
    let step = target.translation - place.translation;
    let total = step.length() + place.rotation.angle_between(target.rotation) * reach;
    let part = if total > way { way / total } else { 1.0 };
    place.translation += step * part;
    place.rotation = place.rotation.slerp(target.rotation, part).normalize();
    (way - total).max(0.0)
}
