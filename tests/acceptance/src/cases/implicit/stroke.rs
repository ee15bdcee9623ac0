//! A strip or a ball that is pressed into clay, by the explicit step or the implicit one.
//!
//! A cell stands for 1 mm and a frame for 1/90 s: tools have the speeds that they have in clay of such cells,
//! and with them its inertia number `rho V^2 / k`; a frame lasts as long as the tool takes for its way.

use super::super::press::quarter;
use crate::lab::{DX, Lab, Mover, at_walls, block, place, room_with, snapshot};
use bevy_clay::sim::planner::{STEP_FRACTION, TOOL_TRAVEL_MAX, VOLUME_AVERAGING};
use bevy_clay::sim::prelude::*;
use cpu_time::ProcessTime;
use glam::{DQuat, DVec3, IVec3};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Cell width that the cases stand for \[m\].
const CELL: f64 = 1e-3;
/// Length of a frame of such cells \[s\].
const FRAME: f64 = 1.0 / 90.0;
/// Gap between tool and clay at first \[cells\]: of [`quarter`] too.
const GAP: f64 = 0.05;
/// Parts of the way \[cells\] for which the implicit step's force is taken: those of a frame at 20 mm/s.
pub const SAMPLE: f64 = 0.02 * FRAME / CELL;

/// Travel of a tool in a frame \[cells\] at `speed` [m/s].
pub fn frame_travel(speed: f64) -> f64 {
    speed * FRAME / CELL
}

/// Clay in whose cells rates bear as those of `material` do in cells of 1 mm.
pub(super) fn of_small_cells(material: ClayMaterial) -> ClayMaterial {
    ClayMaterial { viscosity: material.viscosity * (DX / CELL).powf(material.flow_index), ..material }
}

/// How fine the implicit step is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    /// Travel of the fastest tool in a step \[cells\], at most.
    pub travel: f64,
    /// Passes in a step.
    pub passes: u32,
}

impl Pace {
    /// Sets up a frame of `duration` \[s\] in which the fastest tool travels by `travel` \[cells\]; its
    /// steps.
    pub(super) fn plan(self, lab: &mut Lab, travel: f64, duration: f64) -> u32 {
        // A whole number of steps but for rounding is that number.
        let steps = (travel / self.travel - 1e-6).ceil().max(1.0);
        lab.plan.integrator = Integrator::Implicit { passes: self.passes };
        lab.plan.dt = duration / steps;
        steps as u32
    }
}

/// How a run is integrated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// Explicitly at the clay's own density, by this part of the planner's step.
    Explicit(f64),
    /// Explicitly at so many times the clay's density, by the planner's step.
    Scaled(f64),
    /// Implicitly.
    Implicit(Pace),
}

/// What is pressed in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Half of a strip of this width \[cells\], in plane strain.
    Strip(i32),
    /// A quarter of a ball of this radius \[cells\].
    Ball(f64),
    /// Half of a blade of this width \[cells\], in plane strain: it goes flat into the clay, which closes
    /// over its rims.
    Blade(i32),
}

/// A tool that goes straight into clay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// What goes in.
    pub shape: Shape,
    /// How it acts.
    pub contact: Contact,
    /// The clay.
    pub material: ClayMaterial,
    /// Speed of the tool [m/s].
    pub speed: f64,
    /// How deep it goes, to the next whole sample above \[cells\].
    pub depth: f64,
}

/// A mean force \[N\] over a part of the way: `[from, to, force]`, depths in cells.
pub type Sample = [f64; 3];

/// What came of a stroke.
#[derive(Clone, Debug)]
pub struct Pressed {
    /// The force, in order of depth. What an implicit step bears it bears at its end: its part of the way is
    /// the one with that in its middle.
    pub forces: Vec<Sample>,
    /// Ways of the particles \[cells\].
    pub ways: Vec<DVec3>,
    /// Passes over the particles in a frame.
    pub passes: f64,
    /// Time of the processor in a frame \[ms\], that of its report aside; of use where the process does
    /// nothing else meanwhile.
    pub time: f64,
    /// Greatest change of the clay's volume [-].
    pub swelling: f64,
    /// Whether every frame was sound, and run as planned.
    pub is_sound: bool,
}

impl Stroke {
    /// The clay, and the tool above it.
    fn scene(&self) -> (Snapshot, Mover) {
        let (clay, mover) = match self.shape {
            Shape::Strip(width) => strip(width),
            Shape::Ball(radius) => quarter(radius),
            Shape::Blade(width) => blade(width),
        };
        let tool = Tool { contact: self.contact, ..mover.tool };
        (Snapshot { material: self.material, ..clay }, Mover { tool, velocity: DVec3::NEG_Y * self.speed, ..mover })
    }

    /// What the stroke is compared with: of a blade, which explicit steps have wrong where it lies flat,
    /// that of a strip of its width.
    pub fn solid(&self) -> Self {
        let shape = if let Shape::Blade(width) = self.shape { Shape::Strip(width) } else { self.shape };
        Self { shape, ..*self }
    }

    /// The stroke before its start.
    pub(super) fn begin(&self) -> Run {
        let (clay, mover) = self.scene();
        let mut lab = Lab::with_threads(&clay, 1.0, 1);
        lab.plan.volume_averaging = VOLUME_AVERAGING;
        Run { stroke: *self, clay, lab, mover, depth: -GAP, pressed: Pressed::empty() }
    }

    /// Runs the stroke.
    pub fn press(&self, way: Way) -> Pressed {
        let mut run = self.begin();
        run.go(way);
        run.pressed.ways = ways(&run.clay, &run.lab);
        let frames = (run.depth + GAP) / frame_travel(self.speed);
        let (passes, time) = (run.pressed.passes / frames, run.pressed.time / frames);
        if let Way::Explicit(_) = way {
            // What is looked for beyond the end is known too.
            run.on(way, 2);
        }
        (run.pressed.passes, run.pressed.time) = (passes, time);
        run.pressed
    }

    /// Plans the next part of the way: its steps, and by how much the middle of what their forces are of is
    /// behind its own \[cells\].
    fn plan(&self, way: Way, lab: &mut Lab, travel: f64) -> (u32, f64) {
        let duration = travel * DX / self.speed;
        let most = TOOL_TRAVEL_MAX * DX / self.speed;
        match way {
            Way::Explicit(part) => (plan_explicit(lab, &self.material, duration, [part, 1.0], most), 0.0),
            Way::Scaled(density) => (plan_explicit(lab, &self.material, duration, [1.0, density], most), 0.0),
            Way::Implicit(pace) => {
                let steps = pace.plan(lab, travel, duration);
                (steps, 0.5 * travel / f64::from(steps))
            }
        }
    }

    /// The parts of the way from its start to its end, [`SAMPLE`] each: depths of their ends \[cells\].
    pub fn parts(&self) -> Vec<[f64; 2]> {
        let count = ((self.depth + GAP) / SAMPLE - 1e-6).ceil() as u32;
        (0..count).map(|i| [i, i + 1].map(|i| f64::from(i) * SAMPLE - GAP)).collect()
    }
}

/// Sets up a frame of `duration` \[s\] in explicit steps: by this part of the planner's step, at so many
/// times the clay's density, in steps of `most` \[s\] over the part; their number.
pub(super) fn plan_explicit(
    lab: &mut Lab,
    material: &ClayMaterial,
    duration: f64,
    [part, density_scale]: [f64; 2],
    most: f64,
) -> u32 {
    let limit = material.time_step_limit(DX, material.density * density_scale);
    let steps = (duration / (part * (STEP_FRACTION * limit).min(most))).ceil();
    lab.plan.integrator = Integrator::Explicit { density_scale };
    lab.plan.dt = duration / steps;
    steps as u32
}

/// Thickness of clay in plane strain \[cells\].
const SLAB: i32 = 4;
/// Half the height of a strip \[cells\].
const STRIP_HALF: f64 = 2.0;

/// A blade in the place of a [`strip`], flat above the clay.
fn blade(width: i32) -> (Snapshot, Mover) {
    let (clay, mover) = strip(width);
    let shape = ToolShape::Blade { half_width: 0.5 * f64::from(width) * DX, half_height: f64::from(SLAB) * DX };
    let position = mover.pose.position - DVec3::Y * STRIP_HALF * DX;
    let pose = Pose { position, rotation: DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2) };
    (clay, Mover { tool: Tool { shape, ..mover.tool }, pose, ..mover })
}

/// Half a strip of `width` \[cells\] above a block in plane strain, on a floor that it sticks to.
fn strip(width: i32) -> (Snapshot, Mover) {
    let size = IVec3::new(5 * width / 2, 2 * width, SLAB);
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], high: [Wall::Slip; 3] };
    let domain = room_with([size.x, size.y + 4, size.z], walls);
    let mut particles = block(DVec3::ZERO, size);
    at_walls(&domain, &mut particles);
    let shape = ToolShape::Box { half_size: DVec3::new(0.5 * f64::from(width), STRIP_HALF, f64::from(SLAB)) };
    let at = DVec3::new(0.0, f64::from(size.y) + STRIP_HALF + GAP, 0.5 * f64::from(SLAB));
    let mover = Mover::new(&domain, shape, Contact::default(), at, DQuat::IDENTITY);
    (snapshot(domain, Preset::SoftClay.material(), particles), mover)
}

/// How far the particles have gone since `start` \[cells\], by their ids.
pub(super) fn ways(start: &Snapshot, lab: &Lab) -> Vec<DVec3> {
    let mut before: Vec<&Particle> = start.particles.iter().collect();
    before.sort_by_key(|p| p.id);
    lab.particles().iter().zip(before).map(|(now, before)| place(now) - place(before)).collect()
}

/// A stroke under way.
pub(super) struct Run {
    stroke: Stroke,
    /// The clay at first.
    pub(super) clay: Snapshot,
    /// The clay now.
    pub(super) lab: Lab,
    mover: Mover,
    /// Depth of the tool \[cells\].
    depth: f64,
    /// What came of it so far; passes and time of all of it.
    pub(super) pressed: Pressed,
}

impl Run {
    /// Goes to the end of the stroke.
    pub(super) fn go(&mut self, way: Way) {
        let samples = ((self.stroke.depth - self.depth).abs() / SAMPLE - 1e-6).ceil();
        self.on(way, (samples * (SAMPLE / travel(way)).round()) as u32);
    }

    /// From here on the tool goes back by `travel` \[cells\] at `speed` [m/s].
    pub(super) fn turn(&mut self, speed: f64, travel: f64) {
        self.stroke = Stroke { speed, depth: self.depth - travel, ..self.stroke };
        self.mover.velocity = DVec3::Y * speed;
    }

    /// Goes on by so many parts of the way.
    fn on(&mut self, way: Way, parts: u32) {
        let travel = travel(way);
        let volume: f64 = self.clay.particles.iter().map(|p| f64::from(p.rest_volume)).sum();
        // A stroke goes on beyond its end: the tool says which way.
        let sign = -self.mover.velocity.y.signum();
        for _ in 0..parts {
            let (steps, lag) = self.stroke.plan(way, &mut self.lab, travel);
            let began = ProcessTime::now();
            let report = self.lab.frame_moving(steps, &mut self.mover);
            let taken = began.elapsed();
            let [from, to] = [lag, lag + travel].map(|way| self.depth + sign * way);
            self.pressed.forces.push([from.min(to), from.max(to), report.tools[0].force.y]);
            self.pressed.note(&report, volume, taken);
            self.depth += sign * travel;
        }
    }

    /// Force \[N\] on the tool while it is held for a frame.
    pub(super) fn hold(&mut self, pace: Pace) -> f64 {
        self.mover.velocity = DVec3::ZERO;
        let steps = pace.plan(&mut self.lab, 0.0, FRAME * DX / CELL);
        self.lab.frame_moving(steps, &mut self.mover).tools[0].force.y
    }
}

/// Parts of the way for which a force is taken \[cells\]: of what others are compared with finer ones, for
/// means over any.
fn travel(way: Way) -> f64 {
    if let Way::Explicit(_) = way { 0.25 * SAMPLE } else { SAMPLE }
}

impl Pressed {
    /// Of no way at all.
    pub(super) fn empty() -> Self {
        Self { forces: vec![], ways: vec![], passes: 0.0, time: 0.0, swelling: 0.0, is_sound: true }
    }

    fn note(&mut self, report: &FrameReport, volume: f64, taken: Duration) {
        self.passes += f64::from(if report.passes > 0 { report.passes } else { report.steps });
        self.time += 1e3 * taken.as_secs_f64() * (1.0 - report.timings.report / report.timings.total);
        self.swelling = self.swelling.max((report.volume / volume - 1.0).abs());
        // Implicit frames that lose a step are redone at a price in passes, which is counted.
        let is_whole = report.redone == 0 || report.passes > 0;
        self.is_sound &= report.health.is_ok() && is_whole && report.clamped == 0;
    }

    /// The mean forces over other parts of the way \[cells\].
    pub fn over(&self, parts: &[[f64; 2]]) -> Vec<Sample> {
        parts.iter().map(|[from, to]| [*from, *to, self.mean(*from, *to)]).collect()
    }

    /// Mean force \[N\] over a part of the way \[cells\]; NaN where it is not known of all of it.
    pub fn mean(&self, from: f64, to: f64) -> f64 {
        let (mut way, mut sum) = (0.0, 0.0);
        for [start, end, force] in &self.forces {
            let shared = (to.min(*end) - from.max(*start)).max(0.0);
            way += shared;
            sum += shared * force;
        }
        if way > 0.999 * (to - from) { sum / way } else { f64::NAN }
    }
}
