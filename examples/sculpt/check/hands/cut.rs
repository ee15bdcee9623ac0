//! Cuts, by blades that stand elsewhere between layers of particles: each particle is on the side of the
//! blade that it was on.

use super::act::{bring, cell_width, clay, half, is_followed, is_settled, press, state, surface, take};
use super::work::stick;
use super::{Step, measure};
use crate::hand::ToolKind;
use bevy::prelude::*;
use bevy_clay::prelude::*;
use bevy_clay::sim::cut::ClassKey;
use bevy_clay::sim::snapshot::Particle;
use glam::{DMat3, DQuat, DVec3};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Where the plane of the cut is looked for, in the clay's x \[m\].
const ABOUT: f64 = 0.004;
/// Where blades stand between two layers of particles, of their distance. The last one's cut stays.
const BLADES: [f64; 3] = [0.3, 0.7, 0.5];
/// How far from the blade a particle may be on its other side \[cells\].
const WITHIN: f64 = 0.1;

/// The clay before a cut, and the plane of the blade in its x \[m\].
#[derive(Resource)]
struct Before {
    clay: Snapshot,
    plane: f64,
    /// How far the surface can be from the blade, as it lies half-way between layers \[cells\].
    between: f64,
    undo_count: usize,
}

fn undo_count(world: &mut World) -> usize {
    let clay = clay(world);
    world.get::<ClayHistory>(clay).map_or(0, ClayHistory::undo_count)
}

/// A plane between two layers of particles that are `spacing` \[m\] apart, at a part of the way from the one
/// to the other.
fn plane(clay: &Snapshot, spacing: f64, part: f64) -> f64 {
    let turn = |x: f64| x / spacing * TAU;
    let places = clay.particles.iter().map(|p| clay.domain.to_world(p.grid()).x);
    let (cos, sin) = places.fold((0.0, 0.0), |(c, s), x| (c + turn(x).cos(), s + turn(x).sin()));
    let layer = sin.atan2(cos) / TAU * spacing;
    layer + (((ABOUT - layer) / spacing).floor() + part) * spacing
}

/// A blade's pose: long axis along z, edge down.
fn blade(world: &World, y: f64) -> Pose {
    let axes = DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X);
    Pose { position: DVec3::new(world.resource::<Before>().plane, y, 0.0), rotation: DQuat::from_mat3(&axes) }
}

/// Which side of the cut each particle is on, against where it was before the blade.
fn sides(before: &Before, after: &Snapshot, cell: f64) -> Result<String, String> {
    let place = |p: &Particle| before.clay.domain.to_world(p.grid()).x - before.plane;
    let places: HashMap<u32, f64> = before.clay.particles.iter().map(|p| (p.id, place(p) / cell)).collect();
    // A cut that has gone through leaves two bodies, and no sides.
    let last = after.particles.iter().map(|p| p.body).max().unwrap_or(0);
    let of_body = |p: &Particle| (last > 0).then_some(if p.body == last { 1 } else { -1 });
    let side = |p: &Particle| ClassKey::new(p.body, p.tags).sides().next().map(|(_, side)| side).or(of_body(p));
    let mut beside: Vec<(i8, f64)> = after.particles.iter().filter_map(|p| Some((side(p)?, *places.get(&p.id)?))).collect();
    // Which side is which: the blade has a front.
    let front: f64 = beside.iter().map(|(side, x)| f64::from(*side) * x).sum();
    beside.iter_mut().for_each(|(side, _)| *side *= front.signum() as i8);
    let nearest = |of: i8| beside.iter().filter(|(side, _)| *side == of).map(|(_, x)| x.abs()).fold(f64::INFINITY, f64::min);
    let wrong = beside.iter().map(|(side, x)| -f64::from(*side) * x).fold(0.0, f64::max);
    let said = format!(
        "{} particles on either side of the blade, the nearest {:.3} and {:.3} cells from it, none on its wrong side by more than {wrong:.3}",
        beside.len(),
        nearest(-1),
        nearest(1)
    );
    if wrong <= WITHIN && nearest(1).is_finite() && nearest(-1).is_finite() { Ok(said) } else { Err(said) }
}

/// Down through the clay to the board, by each blade.
pub(super) fn steps() -> Vec<Step> {
    let last = BLADES.len() - 1;
    let each = |(i, part): (usize, &f64)| {
        let mut steps = cut(*part);
        if i < last {
            steps.extend(undo());
        }
        steps
    };
    BLADES.iter().enumerate().flat_map(each).collect()
}

fn cut(part: f64) -> Vec<Step> {
    vec![
        Step::wait("where the layers are", move |world| {
            let Some(clay) = state(world) else { return false };
            let (plane, between) = (plane(&clay, cell_width(world) / 2.0, part), (part - 0.5).abs() / 2.0);
            let undo_count = undo_count(world);
            world.insert_resource(Before { clay, plane, between, undo_count });
            true
        }),
        Step::new("a knife is taken", 0.3, |world| take(world, XrHand::Tool, ToolKind::Knife, 1.0)),
        Step::new("over the clay", 0.8, |world| {
            let above = blade(world, 0.045);
            bring(world, XrHand::Tool, above, 0.5);
        }),
        Step::new("pressed", 0.3, |world| press(world, XrHand::Tool, 1.0)),
        Step::new("down", 1.7, |world| {
            let low = half(world, XrHand::Tool).x;
            let down = blade(world, low);
            bring(world, XrHand::Tool, down, 1.5);
        })
        .until(is_followed),
        Step::new("let go", 1.0, |world| press(world, XrHand::Tool, 0.0)).until(is_settled),
        Step::wait("the clay after", |world| {
            let Some(clay) = state(world) else { return false };
            world.insert_resource(After(clay));
            true
        }),
        Step::check("cut", |world| {
            let (cell, surface) = (cell_width(world), surface(world));
            let before = world.resource::<Before>();
            let cut = measure::cut(&surface, before.plane, 1.5 * cell).ok_or("there is none")?;
            let off = (cut.x - before.plane).abs() / cell;
            let said = format!(
                "the blade at {:.3} mm: {}; {} bodies, between them {:.3} mm: {off:.3} cells off, {:.3} half-way between layers; sides {:.3} mm apart",
                before.plane * 1e3,
                sides(before, &world.resource::<After>().0, cell)?,
                cut.bodies,
                cut.x * 1e3,
                before.between,
                cut.gap * 1e3
            );
            if (off - before.between).abs() <= WITHIN && cut.bodies == 2 { Ok(said) } else { Err(said) }
        }),
    ]
}

/// The clay after a cut.
#[derive(Resource)]
struct After(Snapshot);

/// The clay as it was before the blade.
fn undo() -> Vec<Step> {
    let mut steps = Vec::from(stick("stick to the left", -1.0));
    steps.push(Step::wait("the cut is taken back", |world| undo_count(world) == world.resource::<Before>().undo_count));
    steps
}
