//! Clay that no tool drives, integrated in whichever way: it comes to bear its own weight, springs back when
//! a tool is taken away at once, and flies.

use super::compare::distance;
use super::stroke::{Pace, SAMPLE, Shape, Stroke, Way, plan_explicit, ways};
use crate::lab::{DX, Lab, Size, at_walls, block, place, room_with, set_velocity, snapshot};
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use cpu_time::ProcessTime;
use glam::{DVec3, IVec3};

/// Length of a frame \[s\].
pub(super) const FRAME: f64 = 1.0 / 90.0;
/// The same of clay in whose cells rates bear as in those of 1 mm \[s\].
const SMALL_FRAME: f64 = FRAME * DX / 1e-3;
/// Gravity [m/s^2].
pub(super) const GRAVITY: DVec3 = DVec3::new(0.0, -9.81, 0.0);
/// Frames in which clay comes to bear its weight, and to rest after a tool.
pub(super) const FRAMES: [u32; 2] = [3, 9];
/// Frames of a flight.
pub(super) const FLIGHT: u32 = 8;
/// Time in which damped clay comes to rest \[s\]: under its weight, after a tool.
const SETTLING: [f64; 2] = [0.2, 0.1];

/// What happens to the clay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Free {
    /// A block comes to bear its own weight at once.
    Weight,
    /// A ball is taken away at once that was pressed in by explicit steps of the same kind, or by implicit
    /// ones as the planner has them for fine work.
    Release,
    /// A block that turns goes through the air.
    Flight,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Loose {
    /// Ways of the particles \[cells\].
    pub ways: Vec<DVec3>,
    /// What else counts, [by name](Free::measure): the floor's force in the last frame over the weight; the
    /// ways since the tool was taken away \[cells\]; angular momentum about the centre of mass after each
    /// frame, over that at the start.
    pub other: Vec<DVec3>,
    /// Passes over the particles in a frame.
    pub passes: f64,
    /// Time of the processor in a frame \[ms\], as in [`Pressed`](super::Pressed).
    pub time: f64,
    /// Whether every frame was sound, and run as planned.
    pub is_sound: bool,
}

impl Free {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Weight, Self::Release, Self::Flight];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Weight => "own weight",
            Self::Release => "release",
            Self::Flight => "toss",
        }
    }

    /// What [`Loose::other`] is.
    pub fn measure(self) -> &'static str {
        match self {
            Self::Weight => "floor's force",
            Self::Release => "way back",
            Self::Flight => "angular momentum",
        }
    }

    /// Where the clay comes to in explicit steps at its own density, by those of the planner and by half as
    /// long ones: what lies is damped critically until it rests.
    pub fn reference(self, size: Size) -> [Loose; 2] {
        let run = |part: f64| match self {
            Self::Weight => weight(size, |lab, material, height| settle(lab, material, part, height, SETTLING[0])),
            Self::Release => release(size, Way::Explicit(part), |lab, stroke| {
                settle(lab, &stroke.material, part, 5.0 * stroke.depth, SETTLING[1])
            }),
            Self::Flight => flight(Way::Explicit(part)),
        };
        let (coarse, fine) = rayon::join(|| run(1.0), || run(0.5));
        [coarse, fine]
    }

    /// What comes of it in frames integrated in this way; an implicit frame has as many steps as its
    /// [`Pace::travel`] goes into one.
    pub fn run(self, way: Way, size: Size) -> Loose {
        match self {
            Self::Weight => weight(size, |lab, material, _| frames(lab, way, material, FRAME, FRAMES[0])),
            Self::Release => release(size, way, |lab, stroke| frames(lab, way, &stroke.material, SMALL_FRAME, FRAMES[1])),
            Self::Flight => flight(way),
        }
    }
}

impl Loose {
    /// Errors of the [other measure](Loose::other) and of the particles' ways, in L2, over the reference's
    /// own \[-\]: against the two runs of [`Free::reference`] as steps go to nothing.
    pub fn errors(&self, reference: &[Self; 2]) -> [f64; 2] {
        let exact = |of: fn(&Self) -> &Vec<DVec3>| -> Vec<DVec3> {
            of(&reference[1]).iter().zip(of(&reference[0])).map(|(fine, coarse)| 2.0 * *fine - *coarse).collect()
        };
        [distance(&self.other, &exact(|run| &run.other)), distance(&self.ways, &exact(|run| &run.ways))]
    }
}

/// A ball of 2 or 4 cells in soft clay, at half its radius of depth.
pub(super) fn stroke(size: Size) -> Stroke {
    let radius = size.pick(2.0, 2.0, 4.0);
    let material = Preset::SoftClay.material();
    Stroke { shape: Shape::Ball(radius), contact: Contact::default(), material, speed: 0.02, depth: 0.5 * radius }
}

/// Steps of a tool in contact that is to be left.
pub(super) const PRESS: Pace = Pace { travel: 0.5 * SAMPLE, passes: 12 };

/// What frames took, and the last of them.
struct Taken {
    passes: f64,
    time: f64,
    is_sound: bool,
    last: FrameReport,
}

/// Runs frames of `duration` \[s\].
fn frames(lab: &mut Lab, way: Way, material: &ClayMaterial, duration: f64, count: u32) -> Taken {
    let steps = match way {
        Way::Explicit(part) => plan_explicit(lab, material, duration, [part, 1.0], f64::INFINITY),
        Way::Scaled(density) => plan_explicit(lab, material, duration, [1.0, density], f64::INFINITY),
        Way::Implicit(pace) => pace.plan(lab, 1.0, duration),
    };
    let (mut passes, mut time, mut is_sound) = (0.0, 0.0, true);
    let mut last = None;
    for _ in 0..count {
        let began = ProcessTime::now();
        let report = lab.frame(steps);
        let taken = 1e3 * began.elapsed().as_secs_f64();
        time += taken * (1.0 - report.timings.report / report.timings.total);
        passes += f64::from(if report.passes > 0 { report.passes } else { report.steps });
        is_sound &= report.health.is_ok() && report.redone == 0 && report.clamped == 0;
        last = Some(report);
    }
    let frames = f64::from(count);
    Taken { passes: passes / frames, time: time / frames, is_sound, last: last.expect("frames") }
}

/// Lets explicit clay come to rest, damped critically for waves through its `height` \[cells\]; frames of it.
fn settle(lab: &mut Lab, material: &ClayMaterial, part: f64, height: f64, time: f64) -> Taken {
    let wave = (material.lame_mu() / material.density).sqrt();
    lab.plan.validation.damping = std::f64::consts::PI * wave / (height * DX);
    let count = (time / FRAME).ceil() as u32;
    frames(lab, Way::Explicit(part), material, FRAME, count)
}

/// Clay that bears its own weight after `go`.
fn weight(size: Size, go: impl Fn(&mut Lab, &ClayMaterial, f64) -> Taken) -> Loose {
    let high = size.pick(6, 8, 16);
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], ..Walls::default() };
    let domain = room_with([16, high + 4, 16], walls);
    let mut particles = block(DVec3::ZERO, IVec3::new(6, high, 6));
    at_walls(&domain, &mut particles);
    let material = Preset::SoftClay.material();
    let clay = snapshot(domain, material, particles);
    let mut lab = Lab::with_threads(&clay, 1.0, 1);
    (lab.plan.volume_averaging, lab.plan.gravity) = (VOLUME_AVERAGING, GRAVITY);
    let taken = go(&mut lab, &material, f64::from(high));
    let Taken { passes, time, is_sound, last } = taken;
    let floor = last.wall_impulse / -last.gravity_impulse.y;
    Loose { ways: ways(&clay, &lab), other: vec![floor], passes, time, is_sound }
}

/// Clay that a tool has left, after `go`.
fn release(size: Size, way: Way, go: impl Fn(&mut Lab, &Stroke) -> Taken) -> Loose {
    let stroke = stroke(size);
    let mut run = stroke.begin();
    run.go(if let Way::Implicit(_) = way { Way::Implicit(PRESS) } else { way });
    let pressed = ways(&run.clay, &run.lab);
    let Taken { passes, time, is_sound, .. } = go(&mut run.lab, &stroke);
    let ways = ways(&run.clay, &run.lab);
    let other = ways.iter().zip(&pressed).map(|(now, before)| *now - *before).collect();
    Loose { ways, other, passes, time, is_sound: is_sound && run.pressed.is_sound }
}

/// A block in the air that turns.
pub(super) fn tossed() -> Snapshot {
    let domain = room_with([40, 32, 16], Walls::default());
    let spin = DVec3::new(2.0, 4.0, 9.0);
    let mut particles = block(DVec3::new(4.0, 10.0, 4.0), IVec3::splat(8));
    for p in &mut particles {
        set_velocity(p, DVec3::new(0.8, 0.3, 0.0) + spin.cross((place(p) - DVec3::new(8.0, 14.0, 8.0)) * DX));
        p.affine = DVec3::AXES.map(|axis| spin.cross(axis).as_vec3().to_array());
    }
    snapshot(domain, Preset::SoftClay.material(), particles)
}

/// Angular momentum about the centre of mass, as a report and the particles have it.
pub(super) fn turning(report: &FrameReport, particles: &[Particle], clay: &Snapshot) -> DVec3 {
    let at = particles.iter().map(|p| clay.domain.to_world(p.grid()));
    let centre = at.sum::<DVec3>() / particles.len() as f64;
    report.angular_momentum - centre.cross(report.momentum)
}

/// The flight of that block.
fn flight(way: Way) -> Loose {
    let clay = tossed();
    let mut lab = Lab::with_threads(&clay, 1.0, 1);
    lab.plan.gravity = GRAVITY;
    let mut other = vec![];
    let (mut passes, mut time, mut is_sound) = (0.0, 0.0, true);
    for _ in 0..FLIGHT {
        let taken = frames(&mut lab, way, &clay.material, FRAME, 1);
        passes += taken.passes / f64::from(FLIGHT);
        time += taken.time / f64::from(FLIGHT);
        is_sound &= taken.is_sound;
        other.push(turning(&taken.last, &lab.particles(), &clay));
    }
    Loose { ways: ways(&clay, &lab), other, passes, time, is_sound }
}
