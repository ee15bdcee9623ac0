//! The panel in the support hand: sliders drawn, the clay's among them, rows scrolled, buttons pressed by the
//! tool hand's ray, whose tool is mute meanwhile.

use super::Step;
use super::act::{clay, send, tool};
use super::remote::Remote;
use crate::headset::{BarPlaces, InHand};
use bevy::prelude::*;
use bevy_clay::prelude::*;
use bevy_clay::xr::panel::{POINT, SIZE, XrPanel};
use bevy_egui::{EguiContext, egui};
use std::path::PathBuf;

/// What was before the ray: size of the tool, the clay.
#[derive(Resource)]
struct Before {
    size: f32,
    material: ClayMaterial,
}

/// Width of the sliders of the clay's window [points].
const SLIDER: f32 = 110.0;

/// Whether a tool touched in any frame since.
#[derive(Resource, Default)]
struct Touched(bool);

fn set(world: &mut World, side: Side, f: impl FnOnce(&mut super::remote::ScriptedHand)) {
    f(world.resource::<Remote>().lock().hand(side));
}

/// Points the tool hand at a part of what is called `name` on the panel, from the left (0) to the right (1).
fn aim(world: &mut World, name: &str, part: f32, seconds: f64) {
    let place = world.resource::<BarPlaces>().0.get(name).copied();
    aim_at(world, place, part, seconds);
}

fn aim_at(world: &mut World, place: Option<egui::Rect>, part: f32, seconds: f64) {
    let Some(place) = place else { return };
    let at = Vec2::new(place.left() + part * place.width(), place.center().y);
    let panel = *world.resource::<XrPanel>();
    let plate = world.get::<Transform>(panel.plate).expect("a plate").to_isometry();
    let target = plate * ((at - SIZE.as_vec2() / 2.0) * Vec2::new(1.0, -1.0) * POINT).extend(0.0);
    let from = plate * Vec3::new(0.1, -0.05, 0.4);
    let wanted = Transform::from_translation(from).looking_at(target, Vec3::Y).to_isometry();
    let side = world.resource::<XrHands>().side(XrHand::Tool);
    send(world, side, wanted, seconds);
}

/// The sliders of the clay's window, as many as are shown whole, from the top: the yield stress is the first
/// of a window that is not scrolled.
fn sliders(world: &mut World) -> Vec<egui::Rect> {
    let context = world.resource::<XrPanel>().context;
    let Some(mut context) = world.get_mut::<EguiContext>(context) else { return vec![] };
    let layer = egui::LayerId::new(egui::Order::Middle, egui::Id::new("Clay"));
    let is_slider = |widget: &&egui::WidgetRect| {
        widget.sense.senses_drag() && (widget.rect.width() - SLIDER).abs() < 1.0 && widget.interact_rect == widget.rect
    };
    let mut places: Vec<egui::Rect> = context
        .get_mut()
        .viewport(|viewport| viewport.prev_pass.widgets.get_layer(layer).filter(is_slider).map(|widget| widget.rect).collect());
    places.sort_by(|a, b| a.top().total_cmp(&b.top()));
    places
}

fn material(world: &mut World) -> ClayMaterial {
    let clay = clay(world);
    *world.get::<ClayMaterial>(clay).expect("a material")
}

/// The clay's own slider, by the ray.
fn draw_yield_stress() -> Vec<Step> {
    let at = |part: f32| {
        move |world: &mut World| {
            let slider = sliders(world).first().copied();
            aim_at(world, slider, part, 0.2);
        }
    };
    vec![
        mute("at the yield stress", 0.5, at(0.5)),
        mute("pressed", 0.4, |world| press(world, 1.0)),
        mute("drawn", 0.6, at(0.8)),
        mute("let go", 0.4, |world| press(world, 0.0)),
        Step::check("a slider of the clay is drawn", |world| {
            let (was, is) = (world.resource::<Before>().material, material(world));
            let said = format!("its yield stress goes from {:.1} to {:.1} kPa", was.yield_stress * 1e-3, is.yield_stress * 1e-3);
            let is_alone = ClayMaterial { yield_stress: was.yield_stress, ..is } == was;
            if is.yield_stress > 2.0 * was.yield_stress && is_alone { Ok(said) } else { Err(format!("{said}: {is:?}")) }
        }),
    ]
}

/// Where the sliders were, from the top [points].
#[derive(Resource)]
struct Rows(Vec<i32>);

fn rows(world: &mut World) -> Vec<i32> {
    sliders(world).iter().map(|place| place.top().round() as i32).collect()
}

/// Rows of the clay's window by the tool hand's stick, down and back.
fn scroll() -> Vec<Step> {
    let push = |y: f32| move |world: &mut World| set(world, Side::Right, |hand| hand.stick = Vec2::new(0.0, y));
    vec![
        mute("at the clay's window", 0.4, |world| {
            let slider = sliders(world).get(2).copied();
            aim_at(world, slider, 0.5, 0.2);
        }),
        Step::new("where its rows are", 0.0, |world| {
            let rows = Rows(rows(world));
            world.insert_resource(rows);
        }),
        mute("stick down", 0.2, push(-1.0)),
        mute("let go", 0.5, push(0.0)),
        Step::check("rows are scrolled", |world| {
            let is = rows(world);
            let was = &world.resource::<Rows>().0;
            let said = format!("sliders at {was:?}, then at {is:?} points");
            if is != *was { Ok(said) } else { Err(said) }
        }),
        mute("stick up", 0.8, push(1.0)),
        mute("let go", 0.5, push(0.0)),
        Step::check("and back", |world| {
            let is = rows(world);
            if is == world.resource::<Rows>().0 { Ok(format!("to {is:?}")) } else { Err(format!("to {is:?}")) }
        }),
    ]
}

fn press(world: &mut World, trigger: f32) {
    set(world, Side::Right, |hand| hand.trigger = trigger);
}

/// Notes a tool that is not mute, as long as the ray is used.
fn watch(world: &mut World) {
    let tool = tool(world, XrHand::Tool);
    let is_active = world.get::<SculptTool>(tool).is_some_and(|tool| tool.is_active);
    world.resource_mut::<Touched>().0 |= is_active;
}

/// A step in which the tool has to be mute.
fn mute(name: &'static str, seconds: f64, begin: impl FnMut(&mut World) + Send + Sync + 'static) -> Step {
    let step = Step::new(name, seconds, begin);
    let mut is_over = step.is_over;
    Step {
        is_over: Box::new(move |world, now| {
            watch(world);
            is_over(world, now)
        }),
        ..step
    }
}

/// The steps.
pub(super) fn steps(pictures: Option<PathBuf>) -> Vec<Step> {
    let away = |world: &mut World| {
        let tool = tool(world, XrHand::Support);
        world.get::<HeldBy>(tool).is_some_and(|held| held.is_away)
    };
    let mut steps = open();
    if let Some(folder) = pictures {
        steps.extend(super::eyes::pictures(folder, "panel"));
    }
    steps.extend([
        mute("at the slider", 0.5, |world| aim(world, "Tool hand: size", 0.2, 0.2)),
        mute("pressed", 0.4, |world| press(world, 1.0)),
        mute("drawn", 0.8, |world| aim(world, "Tool hand: size", 0.8, 0.4)),
        mute("let go", 0.4, |world| press(world, 0.0)),
        Step::check("a slider is drawn", |world| {
            let (tool, was) = (tool(world, XrHand::Tool), world.resource::<Before>().size);
            let size = world.get::<InHand>(tool).expect("a tool").size;
            let said = format!("the tool's size goes from {was:.2} to {size:.2}");
            if size > 1.2 * was { Ok(said) } else { Err(said) }
        }),
    ]);
    steps.extend(draw_yield_stress());
    steps.extend(scroll());
    steps.extend([
        mute("at a button", 0.5, |world| aim(world, "Support hand: nothing", 0.5, 0.2)),
        mute("pressed", 0.3, |world| press(world, 1.0)),
        mute("let go", 0.4, |world| press(world, 0.0)),
        Step::check("a button is pressed", move |world| {
            if away(world) { Ok("the support hand puts its tool away".into()) } else { Err("it does nothing".into()) }
        }),
        Step::check("the tool before the panel", |world| {
            if world.resource::<Touched>().0 { Err("it touches".into()) } else { Ok("mute in every frame".into()) }
        }),
        Step::new("menu", 0.3, |world| set(world, Side::Left, |hand| hand.menu = true)),
        Step::new("closed", 0.3, |world| set(world, Side::Left, |hand| hand.menu = false))
            .until(|world| !world.resource::<XrPanel>().is_open),
    ]);
    steps
}

fn open() -> Vec<Step> {
    vec![
        Step::new("the support hand comes up", 0.8, |world| {
            send(world, Side::Left, Isometry3d::from_xyz(-0.25, 0.9, -0.3), 0.4);
            send(world, Side::Right, Isometry3d::from_xyz(0.4, 1.1, 0.0), 0.4);
        }),
        Step::new("menu", 0.3, |world| set(world, Side::Left, |hand| hand.menu = true)),
        Step::new("the panel opens", 0.5, |world| set(world, Side::Left, |hand| hand.menu = false))
            .until(|world| world.resource::<XrPanel>().is_open && world.resource::<BarPlaces>().0.len() > 4),
        Step::new("a small tool", 0.3, |world| {
            let tool = tool(world, XrHand::Tool);
            let mut hand = world.get_mut::<InHand>(tool).expect("a tool");
            hand.size = 0.6;
            let size = hand.size;
            let material = material(world);
            world.insert_resource(Before { size, material });
            world.insert_resource(Touched(false));
        }),
    ]
}
