//! A dent, and both hands at once: each lies where the hands were.

use super::act::{bring, cell_width, clay, half, is_followed, is_settled, press, space, state, surface, take, tool};
use super::reference::{self, Ball};
use super::{Step, cut, is_ready, measure};
use crate::hand::ToolKind;
use bevy::prelude::*;
use bevy_clay::prelude::*;
use bevy_clay::xr::vibration::VibrationCount;
use glam::{DQuat, DVec2, DVec3};

/// Where the ball presses, in x and z \[m\].
pub(super) const DENT: DVec2 = DVec2::new(-0.011, 0.003);
/// Where both hands press at once.
const BOTH: [DVec2; 2] = [DVec2::new(-0.013, -0.010), DVec2::new(0.015, 0.004)];
/// How deep \[m\].
pub(super) const DEPTH: f64 = 0.004;
/// How far above the clay they begin \[m\].
pub(super) const GAP: f64 = 0.01;
/// Size of the ball over what a hand begins with.
const BALL: f32 = 1.4;
/// How far from where a hand was its mark may lie [cells].
const WITHIN: f64 = 0.1;

/// The surface before what is measured.
#[derive(Resource)]
struct Before(ClaySurface);

fn remember(world: &mut World) {
    let surface = surface(world);
    world.insert_resource(Before(surface));
}

/// The steps.
pub(super) fn steps() -> Vec<Step> {
    let mut steps = vec![Step::wait("the session is focused, both hands are seen, the clay is shown", is_ready)];
    steps.push(Step::check("session", |world| {
        let (space, cell) = (space(world), cell_width(world));
        let at = space.point_to_world(DVec3::ZERO);
        Ok(format!(
            "focused; the clay at ({:.3}, {:.3}, {:.3}) m, {} x, cells of {:.2} mm",
            at.x,
            at.y,
            at.z,
            space.scale(),
            cell * 1e3
        ))
    }));
    steps.extend(cut::steps());
    steps.extend(dents("dent", |_| vec![(XrHand::Tool, DENT)]));
    steps.extend(dents("both hands", |_| vec![(XrHand::Support, BOTH[0]), (XrHand::Tool, BOTH[1])]));
    steps.push(Step::check("vibration", |world| {
        let count = world.resource::<VibrationCount>().get();
        if count > 0 { Ok(format!("{count} taken by the runtime")) } else { Err("none was taken".into()) }
    }));
    steps
}

/// Presses balls at places on top, each with its hand, all at once.
fn dents(name: &'static str, places: fn(&mut World) -> Vec<(XrHand, DVec2)>) -> Vec<Step> {
    let above = |world: &mut World, hand: XrHand, at: DVec2, gap: f64| {
        let radius = half(world, hand).x;
        let top = measure::height(world.resource::<Before>().0.field(), at).unwrap_or_default();
        Pose { position: DVec3::new(at.x, top + radius + gap, at.y), rotation: DQuat::from_rotation_x(-0.9) }
    };
    let each = move |world: &mut World, gap: f64, seconds: f64| {
        for (hand, at) in places(world) {
            let pose = above(world, hand, at, gap);
            bring(world, hand, pose, seconds);
        }
    };
    vec![
        Step::new("balls are taken", 0.3, move |world| {
            remember(world);
            places(world).into_iter().for_each(|(hand, _)| take(world, hand, ToolKind::Ball, BALL));
        }),
        Step::wait("the clay before", |world| {
            let Some(clay) = state(world) else { return false };
            world.insert_resource(Clear(clay));
            true
        }),
        Step::new("over the clay", 1.0, move |world| each(world, GAP, 0.5)),
        Step::new("pressed", 0.3, move |world| places(world).into_iter().for_each(|(hand, _)| press(world, hand, 1.0))),
        Step::new("down", 2.0, move |world| each(world, -DEPTH, 1.0)).until(is_followed),
        Step::check(name, move |world| {
            let places = places(world);
            held(world, &places)
        }),
        Step::new("up", 1.5, move |world| each(world, GAP, 0.7)).until(is_followed),
        Step::new("let go", 1.5, move |world| places(world).into_iter().for_each(|(hand, _)| press(world, hand, 0.0)))
            .until(is_settled),
        Step::check(name, move |world| {
            let places = places(world);
            left(world, &places)
        }),
    ]
}

/// Where the clay has the tools that are held in it, against where the hands hold them.
fn held(world: &mut World, places: &[(XrHand, DVec2)]) -> Result<String, String> {
    let (clay, cell) = (clay(world), cell_width(world));
    let mut said = vec![];
    for (hand, at) in places {
        let (tool, radius) = (tool(world, *hand), half(world, *hand).x);
        let top = measure::height(world.resource::<Before>().0.field(), *at).unwrap_or_default();
        let wanted = DVec3::new(at.x, top + radius - DEPTH, at.y);
        let pose = world.get::<ClayEngine>(clay).and_then(|engine| engine.tool_pose(tool)).ok_or("the clay has no such tool")?;
        let off = pose.position.distance(wanted) / cell;
        let is_felt = world.get::<ToolForce>(tool).is_some_and(|force| force.contacts > 0);
        said.push(format!("{hand:?} hand's ball {:.4} cells from where it is held", off));
        if off > WITHIN || !is_felt {
            return Err(format!("{}; it touches: {is_felt}", said.join(", ")));
        }
    }
    Ok(said.join(", "))
}

/// The clay before the balls.
#[derive(Resource)]
struct Clear(Snapshot);

/// Where the dents are that balls left, against where the hands were, and how deep, against what such balls
/// leave without a headset.
fn left(world: &mut World, places: &[(XrHand, DVec2)]) -> Result<String, String> {
    let (cell, after) = (cell_width(world), surface(world));
    let ball = |(hand, at): &(XrHand, DVec2)| {
        let radius = half(world, *hand).x;
        let top = measure::height(world.resource::<Before>().0.field(), *at).unwrap_or_default();
        Ball { radius, touch: DVec3::new(at.x, top + radius, at.y) }
    };
    let balls: Vec<Ball> = places.iter().map(ball).collect();
    let reference = reference::pressed(&world.resource::<Clear>().0, &balls).map_err(|error| error.to_string())?;
    let before = &world.resource::<Before>().0;
    let (mut said, mut is_well) = (vec![], true);
    for ((hand, at), ball) in places.iter().zip(&balls) {
        let dent = |after| measure::dent(before.field(), after, *at, ball.radius).ok_or("there is none");
        let (dent, wanted) = (dent(after.field())?, dent(&reference)?);
        let (off, depth_off) = (dent.middle.distance(*at) / cell, (dent.depth - wanted.depth) / cell);
        said.push(format!(
            "({:.2}, {:.2}) mm, the {hand:?} hand at ({:.2}, {:.2}): {off:.3} cells off; {:.2} mm deep, {:.2} without a headset: {depth_off:+.3} cells",
            dent.middle.x * 1e3,
            dent.middle.y * 1e3,
            at.x * 1e3,
            at.y * 1e3,
            dent.depth * 1e3,
            wanted.depth * 1e3,
        ));
        is_well &= off <= WITHIN && depth_off.abs() <= WITHIN;
    }
    let said = said.join("; ");
    if is_well { Ok(said) } else { Err(said) }
}
