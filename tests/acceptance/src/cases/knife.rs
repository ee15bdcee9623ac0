//! A knife that cuts into clay: the work of its edge is the clay's toughness R times the area that it cuts,
//! whatever its place and angle to the grid and the step, and where it cuts nothing new it does none.

use crate::lab::{DX, Lab, Mover, Size, at_walls, block, is_implicit, place, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Clay that is cut [cells]: across the knife, deep, along its edge.
const CLAY: IVec3 = IVec3::new(8, 11, 4);
/// How deep the edge goes [cells].
const DEPTH: f64 = 8.0;
/// From where it comes, above the clay [cells].
const ABOVE: f64 = 1.0;
/// Way of a frame [cells].
const FRAME: f64 = 0.1;
/// Speed of the knife [m/s]: `rho V^2 / k` is 0.015.
const SPEED: f64 = 0.2;
/// Force below which a frame's balance is not judged [R times the edge's length].
const FORCE_MIN: f64 = 1e-6;
/// How far beside an older cut a knife comes into it [cells].
const BESIDE: f64 = 0.1;
/// Damping of clay in which the knife is held [1/s]: its swings of some 200 Hz die within it.
const DAMPING: f64 = 300.0;

/// A way of the knife into the clay.
#[derive(Clone, Copy, Debug)]
struct Stroke {
    shape: ToolShape,
    contact: Contact,
    material: ClayMaterial,
    /// Of its plane about the vertical, and of its edge in the plane [rad].
    turn: [f64; 2],
    /// Of its plane beside the lattice [cells].
    offset: f64,
    /// Part of the planner's step.
    step: f64,
    /// Whether the clay stands between slip walls, which the knife reaches: plane strain.
    is_plane: bool,
    /// Whether an older cut parts the clay across.
    is_crossed: bool,
}

/// A knife in the clay.
struct Run {
    lab: Lab,
    mover: Mover,
    steps: u32,
    /// Work of the tool [R times a cell of the edge's way through the clay].
    work: f64,
    /// Force against the last frame's way [R times the edge's length].
    force: f64,
    /// Length of the cut in the clay [cells].
    chord: f64,
    is_sound: bool,
}

impl Stroke {
    /// A knife of a blade wider than the clay, without friction.
    fn new() -> Self {
        let shape = ToolShape::Blade { half_width: 9.0, half_height: 7.0 };
        let (contact, material) = (Contact::Slip, Preset::SoftClay.material());
        Self { shape, contact, material, turn: [0.0; 2], offset: 0.1, step: 1.0, is_plane: false, is_crossed: false }
    }

    /// The clay, and the knife above it.
    fn begin(&self) -> Run {
        let (side, gap) = if self.is_plane { (Wall::Slip, 0) } else { (Wall::Separate, 2) };
        let walls = Walls { low: [side, Wall::Stick, side], high: [side, Wall::Separate, side] };
        let domain = room_with([CLAY.x + 2 * gap, CLAY.y + 6, CLAY.z + 2 * gap], walls);
        let low = DVec3::new(f64::from(gap), 0.0, f64::from(gap));
        let mut clay = block(low, CLAY);
        at_walls(&domain, &mut clay);
        for p in clay.iter_mut().filter(|_| self.is_crossed) {
            let beyond = place(p).z - low.z - 0.4 * f64::from(CLAY.z);
            p.tags[0] = Tag { sheet: 7, side: if beyond < 0.0 { -1 } else { 1 } };
        }
        let mut lab = Lab::with_threads(&snapshot(domain, self.material, clay), self.step * stable_step(&self.material), 1);
        lab.plan.volume_averaging = VOLUME_AVERAGING;
        let [turn, tilt] = self.turn;
        let rotation = DQuat::from_rotation_y(FRAC_PI_2 + turn) * DQuat::from_rotation_z(tilt);
        let edge = match self.shape {
            ToolShape::Blade { half_height, .. } => half_height / tilt.cos(),
            _ => 0.0,
        };
        let at = low + CLAY.as_dvec3() * DVec3::new(0.5, 1.0, 0.5) + DVec3::new(self.offset, edge + ABOVE, 0.0);
        let mover = Mover::new(&domain, self.shape, self.contact, at, rotation);
        let steps = (FRAME * DX / SPEED / lab.plan.dt).ceil() as u32;
        let chord = f64::from(CLAY.z) / turn.cos();
        Run { lab, mover, steps, work: 0.0, force: 0.0, chord, is_sound: true }
    }

    /// The knife [`DEPTH`] into the clay.
    fn cut(&self) -> Run {
        let mut run = self.begin();
        run.go(ABOVE + DEPTH, DVec3::NEG_Y);
        run
    }
}

impl Run {
    /// The knife goes `way` [cells] along `direction`; the work of that.
    fn go(&mut self, way: f64, direction: DVec3) -> f64 {
        let before = self.work;
        let toughness = self.lab.plan.material.toughness;
        for _ in 0..(way / FRAME).round() as u32 {
            let duration = self.lab.plan.dt * f64::from(self.steps);
            self.mover.velocity = direction * FRAME * DX / duration;
            let report = self.lab.frame_moving(self.steps, &mut self.mover);
            let force = -report.tools[0].force / (toughness * self.chord * DX);
            // Where next to nothing acts on the clay, the balance is of rounding to rounding.
            let is_judged = !is_implicit() && force.length() > FORCE_MIN;
            let is_balanced = !is_judged || report.balance_error() < 1e-5;
            self.is_sound &= report.health.is_ok() && report.redone == 0 && is_balanced;
            // Held, against where it went.
            self.force = force.dot(if direction == DVec3::ZERO { DVec3::NEG_Y } else { direction });
            self.work += force.dot(direction) * FRAME;
        }
        self.work - before
    }

    /// NaN for a run that went wrong.
    fn judged(&self, value: f64) -> f64 {
        if self.is_sound { value } else { f64::NAN }
    }
}

/// By how much the work of a stroke is off R times the area cut.
fn off(stroke: &Stroke) -> f64 {
    let run = stroke.cut();
    run.judged(run.work / DEPTH - 1.0)
}

/// The greatest of these by amount, a NaN before all.
fn worst(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |worst: f64, value| if worst.is_nan() || value.abs() <= worst { worst } else { value.abs() })
}

/// Force of a sticking knife beside its edge's, of what its flanks bear at the clay's shear strength: the
/// slope over its depth.
fn adhesion(stroke: &Stroke) -> f64 {
    let mut run = Stroke { contact: Contact::Stick, is_plane: true, ..*stroke }.begin();
    let (material, mut points) = (stroke.material, vec![]);
    let frames = ((ABOVE + DEPTH) / FRAME).round() as u32;
    for frame in 0..frames {
        run.go(FRAME, DVec3::NEG_Y);
        let depth = (f64::from(frame) + 0.5) * FRAME - ABOVE;
        points.extend((depth > 2.0).then_some([depth, run.force]));
    }
    let slope = super::slump::line(&points).1 * material.toughness / (2.0 * material.shear_strength() * DX);
    run.judged(slope - 1.0)
}

/// What a knife does where it cuts nothing new [of R times the area it has cut]: drawn back, out of the clay,
/// on in its own cut; what it bears when it is held in the clay and when it goes on [R times its length];
/// and the same of other knives that come into that cut, along it and [`BESIDE`] it, and of the last that
/// goes on.
fn again(stroke: &Stroke) -> [f64; 8] {
    let mut run = stroke.cut();
    let cut = DEPTH;
    // Clay that swings shakes off what the edge holds, by as much as it swings: it is braked, and damped.
    let steps = run.steps;
    run.lab.plan.validation.damping = DAMPING;
    for pace in [4, 16] {
        run.steps = pace * steps;
        run.go(2.0 * FRAME, DVec3::NEG_Y);
    }
    run.steps = steps;
    run.go(20.0 * FRAME, DVec3::ZERO);
    run.lab.plan.validation.damping = 0.0;
    let held = run.force;
    let out = run.go(DEPTH - 2.0, DVec3::Y) / cut;
    let back = run.go(DEPTH - 3.0, DVec3::NEG_Y) / cut;
    run.go(2.0, DVec3::NEG_Y);
    let on = run.force;
    run.go(DEPTH + 3.0, DVec3::Y);
    let air = run.go(1.0, DVec3::Y) / cut;
    let above = run.mover.pose.position - DVec3::Y * (2.0 * DX);
    let [along, beside] = [(2, 0.0), (3, BESIDE)].map(|(id, beside)| {
        run.mover.id = id;
        run.mover.pose.position = above + run.mover.pose.rotation * DVec3::Z * (beside * DX);
        run.go(DEPTH + 1.0, DVec3::NEG_Y) / cut
    });
    run.go(2.0, DVec3::NEG_Y);
    let beyond = run.force;
    [held, out, air, back, on, along, beside, beyond].map(|value| run.judged(value))
}

/// The work of the edge at several places and angles and at a quarter of the step, adhesion beside it, and
/// what is done where nothing new is cut.
pub fn forces(size: Size) -> Vec<Row> {
    let knife = Stroke::new();
    let offsets = size.pick(&[0.1][..], &[0.37], &[0.0, 0.1, 0.25, 0.37]);
    let turns = size.pick(&[[0.3, 0.2]][..], &[[FRAC_PI_4, 0.2]], &[[0.35, 0.0], [FRAC_PI_4, 0.0], [0.2, 0.3], [FRAC_PI_4, 0.2]]);
    let tough = Stroke { material: ClayMaterial { toughness: 45.0, ..knife.material }, ..knife };
    let wire = Stroke { shape: ToolShape::Wire { half_length: 9.0 }, ..knife };
    let crossing = Stroke { is_crossed: true, ..knife };
    let places = offsets.iter().map(|offset| Stroke { offset: *offset, ..knife });
    let angles = turns.iter().map(|turn| Stroke { turn: *turn, ..knife });
    let strokes: Vec<Stroke> =
        places.chain(angles).chain([tough, wire, crossing, Stroke { step: 0.25, ..knife }, knife]).collect();
    let rest = || rayon::join(|| again(&knife), || adhesion(&knife));
    let (off, (again, adhesion)) = rayon::join(|| strokes.par_iter().map(off).collect::<Vec<f64>>(), rest);
    let (at_places, rest) = off.split_at(offsets.len());
    let (at_angles, rest) = rest.split_at(turns.len());
    let [of_tough, of_wire, crossed, fine, coarse] = rest else { return vec![] };
    let [held, out, air, back, on, along, beside, beyond] = again;
    vec![
        Row::at_most("knife: work off toughness times area, worst place", worst(at_places.iter().copied()), "relative", 0.05),
        Row::at_most("knife: the same, worst angle to the grid", worst(at_angles.iter().copied()), "relative", 0.05),
        Row::at_most("knife: the same, three times the toughness", of_tough.abs(), "relative", 0.05),
        Row::at_most("knife: the same, a wire", of_wire.abs(), "relative", 0.05),
        Row::at_most("knife: the same, across an older cut", crossed.abs(), "relative", 0.05),
        Row::at_most(
            "knife: work at a quarter of the step, off that at the step",
            ((1.0 + fine) / (1.0 + coarse) - 1.0).abs(),
            "relative",
            0.03,
        ),
        Row::at_most("knife: flanks that stick, off 2 k L h by", adhesion.abs(), "relative", 0.1),
        Row::at_least("knife: force held still", held, "R L", 0.9),
        Row::at_most("knife: work when drawn back", out, "of R A", 0.01),
        Row::at_most("knife: work in air", air.abs(), "of R A", 1e-9),
        Row::at_most("knife: work in its own cut", back.abs(), "of R A", 0.01),
        Row::at_most("knife: force beyond its own cut, off R L", (on - 1.0).abs(), "relative", 0.1),
        Row::at_most("knife: work of another in that cut", along.abs(), "of R A", 0.01),
        Row::at_most("knife: the same, a tenth of a cell beside it", beside.abs(), "of R A", 0.01),
        Row::at_most("knife: force of another beyond that cut, off R L", (beyond - 1.0).abs(), "relative", 0.1),
    ]
}
