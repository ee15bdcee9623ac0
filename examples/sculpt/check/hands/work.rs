//! The work in hands: carried, stretched, brought back; strokes taken back; hands that change sides, and one
//! that goes and comes back.

use super::Step;
use super::act::{clay, is_intact, send, state, surface, tool};
use super::measure;
use super::remote::Remote;
use super::sculpt::DENT;
use bevy::prelude::*;
use bevy_clay::prelude::*;

/// How exactly work follows hands, in metres and parts of its scale.
const WITHIN: f32 = 2e-3;

/// What was before.
#[derive(Resource, Clone, Default)]
struct Noted {
    work: Transform,
    undo_count: usize,
    height: f64,
    clay: Option<Snapshot>,
}

pub(super) fn work(world: &mut World) -> Transform {
    *world.query_filtered::<&Transform, With<WorkRoot>>().single(world).expect("the work")
}

fn note(world: &mut World) {
    let work = work(world);
    let clay = clay(world);
    let undo_count = world.get::<ClayHistory>(clay).map_or(0, ClayHistory::undo_count);
    let height = measure::height(surface(world).field(), DENT).unwrap_or_default();
    world.insert_resource(Noted { work, undo_count, height, clay: None });
}

/// Sets a hand's buttons.
pub(super) fn with_hand(world: &mut World, side: Side, set: impl FnOnce(&mut super::remote::ScriptedHand)) {
    set(world.resource::<Remote>().lock().hand(side));
}

/// Both hands apart by `span` \[m\] about a place, within `seconds`.
fn spread(world: &mut World, span: f32, seconds: f64) {
    for (side, x) in [(Side::Left, -span / 2.0), (Side::Right, span / 2.0)] {
        send(world, side, Isometry3d::from_xyz(x, 1.0, -0.1), seconds);
    }
}

pub(super) fn squeeze(world: &mut World, left: f32, right: f32) {
    with_hand(world, Side::Left, |hand| hand.squeeze = left);
    with_hand(world, Side::Right, |hand| hand.squeeze = right);
}

/// The steps.
pub(super) fn steps() -> Vec<Step> {
    let mut steps = carry();
    steps.extend(undo());
    steps.extend(change_sides());
    steps.extend(lose_a_hand());
    steps
}

fn carry() -> Vec<Step> {
    vec![
        Step::new("hands before the chest", 0.8, |world| spread(world, 0.3, 0.5)),
        Step::new("the support hand closes", 0.5, |world| {
            note(world);
            squeeze(world, 1.0, 0.0);
        }),
        Step::new("carries", 0.8, |world| send(world, Side::Left, Isometry3d::from_xyz(-0.05, 1.05, -0.2), 0.4)),
        Step::new("opens", 0.4, |world| squeeze(world, 0.0, 0.0)),
        Step::check("one hand carries the work", |world| {
            let (was, is) = (world.resource::<Noted>().work, work(world));
            let way = is.translation - was.translation;
            let off = way.distance(Vec3::new(0.1, 0.05, -0.1));
            let said =
                format!("by ({:.3}, {:.3}, {:.3}) m, {:.2} mm off, at {:.2} x", way.x, way.y, way.z, off * 1e3, is.scale.x);
            if off < WITHIN && is.scale == was.scale { Ok(said) } else { Err(said) }
        }),
        Step::new("hands before the chest", 0.8, |world| spread(world, 0.3, 0.5)),
        Step::new("both close", 0.5, |world| {
            note(world);
            squeeze(world, 1.0, 1.0);
        }),
        Step::new("spread", 0.8, |world| spread(world, 0.45, 0.4)),
        Step::check("two hands scale it", |world| {
            let (was, is) = (world.resource::<Noted>().work.scale, work(world).scale);
            let said = format!("from {:.3} to {:.3}, hands half as far apart again", was.x, is.x);
            let is_upright = (work(world).rotation * Vec3::Y).distance(Vec3::Y) < 1e-4;
            if (is.x / was.x - 1.5).abs() < 10.0 * WITHIN && is_upright { Ok(said) } else { Err(said) }
        }),
        Step::new("spread wide", 0.8, |world| spread(world, 1.8, 0.4)),
        Step::check("no more than tenfold", |world| {
            let scale = work(world).scale.x;
            if (scale - 10.0).abs() < 1e-3 { Ok(format!("{scale:.3}")) } else { Err(format!("{scale:.3}")) }
        }),
        Step::new("back", 0.8, |world| spread(world, 0.3, 0.4)),
        Step::new("open", 0.4, |world| squeeze(world, 0.0, 0.0)),
        Step::new("the head turns", 0.3, |world| {
            let head = Isometry3d::new(Vec3::new(-0.2, 1.3, 0.1), Quat::from_rotation_y(-0.6));
            world.resource::<Remote>().lock().set_head(head);
        }),
        Step::new("both sticks pressed", 0.4, |world| {
            Side::ALL.iter().for_each(|side| with_hand(world, *side, |hand| hand.stick_click = true));
        }),
        Step::new("let go", 0.3, |world| {
            Side::ALL.iter().for_each(|side| with_hand(world, *side, |hand| hand.stick_click = false));
        }),
        Step::check("the work comes before the eyes", |world| {
            let head = world.resource::<Remote>().lock().head();
            let ahead = (head.rotation * Vec3::NEG_Z).with_y(0.0).normalize();
            let wanted = Vec3::from(head.translation) + ahead * 0.5 - Vec3::Y * 0.35;
            let off = work(world).translation.distance(wanted);
            let said = format!("{:.2} mm off", off * 1e3);
            // Eyes are before the head's own origin or behind it, as the runtime has them.
            if off < 0.01 { Ok(said) } else { Err(said) }
        }),
    ]
}

/// The support hand's stick, once to a side.
pub(super) fn stick(name: &'static str, x: f32) -> [Step; 2] {
    let push = |x: f32| move |world: &mut World| with_hand(world, Side::Left, |hand| hand.stick = Vec2::new(x, 0.0));
    [Step::new(name, 0.3, push(x)), Step::new("let go", 0.3, push(0.0))]
}

fn undo() -> Vec<Step> {
    let count = |world: &mut World| {
        let clay = clay(world);
        world.get::<ClayHistory>(clay).map_or(0, ClayHistory::undo_count)
    };
    let mut steps = vec![Step::check("strokes", move |world| {
        note(world);
        Ok(format!("{} can be taken back", count(world)))
    })];
    steps.extend(stick("stick to the left", -1.0));
    steps.push(Step::wait("a stroke is taken back", move |world| count(world) + 1 == world.resource::<Noted>().undo_count));
    steps.extend(stick("stick to the left", -1.0));
    steps.push(Step::wait("another is", move |world| count(world) + 2 == world.resource::<Noted>().undo_count));
    steps.push(Step::wait("the dent is gone", |world| {
        let was = world.resource::<Noted>().height;
        measure::height(surface(world).field(), DENT).is_some_and(|height| height > was + 1e-3)
    }));
    steps.extend(stick("stick to the right", 1.0));
    steps.extend(stick("stick to the right", 1.0));
    steps.push(Step::wait("both are done again", move |world| count(world) == world.resource::<Noted>().undo_count));
    steps.push(Step::wait("the dent is back", |world| {
        let was = world.resource::<Noted>().height;
        measure::height(surface(world).field(), DENT).is_some_and(|height| (height - was).abs() < 1e-4)
    }));
    steps.push(Step::check("undo and redo by the stick", |_| Ok("two strokes taken back and done again".into())));
    steps
}

fn change_sides() -> Vec<Step> {
    let menu = |side: Side| {
        let set = move |is_pressed| move |world: &mut World| with_hand(world, side, |hand| hand.menu = is_pressed);
        [Step::new("menu", 0.3, set(true)), Step::new("let go", 0.3, set(false))]
    };
    let is_with = |world: &mut World, side: Side| {
        let tool = tool(world, XrHand::Tool);
        let offset = world.get::<HeldBy>(tool).expect("held").clone();
        let tip = world.resource::<XrControllers>().get(side).tool.expect("seen");
        let wanted = Vec3::from(offset.pose(tip, 0.0).translation);
        world.get::<Transform>(tool).expect("placed").translation.distance(wanted) < 1e-3
    };
    let mut steps = vec![];
    steps.extend(menu(Side::Right));
    steps.push(Step::check("the tool goes to the other hand", move |world| {
        let tool = world.resource::<XrHands>().tool;
        if tool == Side::Left && is_with(world, Side::Left) { Ok(format!("{tool:?}")) } else { Err(format!("{tool:?}")) }
    }));
    steps.extend(menu(Side::Left));
    steps.push(Step::check("and back", move |world| {
        let tool = world.resource::<XrHands>().tool;
        if tool == Side::Right && is_with(world, Side::Right) { Ok(format!("{tool:?}")) } else { Err(format!("{tool:?}")) }
    }));
    // The panel is in the support hand now: closed.
    steps.extend(menu(Side::Left));
    steps
}

fn lose_a_hand() -> Vec<Step> {
    let is_seen = |world: &World| world.resource::<XrControllers>().get(Side::Right).tool.is_some();
    vec![
        Step::new("the clay before", 0.0, note).until(|world| {
            let clay = state(world);
            world.resource_mut::<Noted>().clay = clay;
            world.resource::<Noted>().clay.is_some()
        }),
        Step::new("beside the clay, pressed, and lost", 0.5, |world| {
            send(world, Side::Right, Isometry3d::from_xyz(0.5, 1.0, -0.3), 0.0);
            with_hand(world, Side::Right, |hand| hand.trigger = 1.0);
        }),
        Step::new("lost", 0.3, |world| with_hand(world, Side::Right, |hand| hand.is_on = false))
            .until(move |world| !is_seen(world)),
        Step::check("a lost hand's tool", |world| {
            let tool = tool(world, XrHand::Tool);
            let is_active = world.get::<SculptTool>(tool).is_some_and(|tool| tool.is_active);
            if is_active { Err("it touches".into()) } else { Ok("touches nothing".into()) }
        }),
        Step::new("comes back on the other side", 0.5, |world| {
            send(world, Side::Right, Isometry3d::from_xyz(-0.9, 1.0, -0.3), 0.0);
            with_hand(world, Side::Right, |hand| hand.is_on = true);
        })
        .until(move |world| is_seen(world)),
        Step::new("let go", 0.5, |world| with_hand(world, Side::Right, |hand| hand.trigger = 0.0)),
        Step::new("the clay after", 0.0, |_| ()).until(|world| {
            let Some(clay) = state(world) else { return false };
            world.insert_resource(After(clay));
            true
        }),
        Step::check("a hand that went comes back on the other side", |world| {
            let before = world.resource::<Noted>().clay.as_ref().ok_or("no clay")?;
            is_intact(before, &world.resource::<After>().0)
        }),
    ]
}

/// The clay when the hand is back.
#[derive(Resource)]
struct After(Snapshot);
