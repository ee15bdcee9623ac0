//! The loop of force about an engine's clay: a ball in a hand's stroke, felt through the servo, against the
//! same clay in cells of half the width that the same tool goes through.

use super::OPEN;
use crate::lab::{Size, engine};
use crate::report::Row;
use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath, Operator, SimulatedArm};
use bevy_clay::haptics::reference::rig::{Fidelity, Run, Tick};
use bevy_clay::haptics::servo::{ClayServo, ServoSample, ServoSettings};
use bevy_clay::haptics::virtual_hand::VirtualHand;
use bevy_clay::haptics::virtual_loop::{LoopClock, LoopFrame, VirtualLoop};
use bevy_clay::sim::planner::StepAccuracy;
use bevy_clay::sim::prelude::*;
use glam::DVec3;
use rayon::prelude::*;

/// Cell width \[m\] of the clay that is felt.
pub(super) const CELL: f64 = 1e-3;
/// Radius of the ball \[m\].
const RADIUS: f64 = 3e-3;
/// Size of the block of clay \[m\]: its top is at y = 0, about the axis of y.
const BLOCK: DVec3 = DVec3::new(16e-3, 9e-3, 16e-3);
/// Height of the ball above the clay before its stroke \[m\].
const HEIGHT: f64 = 1e-3;
/// Time that a hand waits there, and below unless it holds \[s\].
const WAIT: f64 = 0.1;

/// A stroke of a hand.
#[derive(Clone, Copy, Debug)]
struct HandStroke {
    /// Speed of the hand \[m/s\].
    speed: f64,
    /// How deep it means to go \[m\].
    depth: f64,
    /// How long it stays there \[s\].
    hold: f64,
    /// By how much the clay is off the ball's axis \[cells\].
    offset: DVec3,
}

/// What came of it.
pub(super) struct Felt {
    /// Ticks of the servo.
    pub(super) samples: Vec<ServoSample>,
    /// Frames of the clay.
    pub(super) frames: Vec<LoopFrame>,
}

/// A block of clay of this size \[m\] in cells of this width \[m\].
pub(super) fn clay(block: DVec3, cell: f64, offset: DVec3) -> Snapshot {
    let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] };
    let low = DVec3::new(-0.5 * block.x - 2e-3, -block.y, -0.5 * block.z - 2e-3);
    let high = DVec3::new(0.5 * block.x + 2e-3, 8e-3, 0.5 * block.z + 2e-3);
    let domain = Domain::new(low, high, cell, walls).expect("a room");
    let count = (block / (0.5 * cell)).round().as_ivec3();
    let mut particles = vec![];
    for i in 0..count.x * count.y * count.z {
        let at = DVec3::new(f64::from(i % count.x), f64::from(i / count.x % count.y), f64::from(i / (count.x * count.y))) + 0.5;
        let at = at * (0.5 * cell) - DVec3::new(0.5 * block.x, block.y, 0.5 * block.z) + offset * CELL;
        particles.push(Particle::at(domain.to_grid(at), (cell.powi(3) / 8.0) as f32, i as u32));
    }
    Snapshot::new(domain, Preset::SoftClay.material(), particles)
}

fn ball() -> Tool {
    Tool { shape: ToolShape::Sphere { radius: RADIUS }, contact: Contact::Separate { friction: 0.3 } }
}

pub(super) fn policy(touch: bool, accuracy: StepAccuracy) -> Policy {
    let outputs = FrameOutputs { touch, ..FrameOutputs::NOTHING };
    Policy { outputs, accuracy, integrator: IntegratorChoice::Implicit, ..Policy::default() }
}

impl HandStroke {
    /// Down, there, and up the same way.
    fn path(&self) -> HandPath {
        let above = DVec3::Y * (RADIUS + HEIGHT);
        let below = DVec3::Y * (RADIUS - self.depth);
        let (there, leaves) = self.hold_span();
        HandPath::new([WAIT, there, leaves, leaves + there - WAIT].into_iter().zip([above, below, below, above]))
    }

    /// When it is at its deepest, and when it leaves \[s\].
    fn hold_span(&self) -> (f64, f64) {
        let there = WAIT + (HEIGHT + self.depth) / self.speed;
        (there, there + self.hold)
    }

    /// Runs the stroke through the servo.
    fn feel(&self) -> Felt {
        self.feel_by(ArmSettings::default())
    }

    /// The same with this arm.
    fn feel_by(&self, arm: ArmSettings) -> Felt {
        Felt::by(arm, &clay(BLOCK, CELL, self.offset), ball(), self.path())
    }

    /// The clay's force on the way of `felt`, in cells of `cell` \[m\] and fine steps: in the middle of windows
    /// of time.
    fn truth(&self, felt: &Felt, cell: f64) -> Vec<(f64, DVec3)> {
        let clay = clay(BLOCK, cell, self.offset);
        let mut engine = engine(1);
        engine.load(&clay).expect("the clay loads");
        let mut planner = Planner::new(&clay);
        planner.policy = policy(false, StepAccuracy::Fine);
        let mut found = vec![];
        for window in self.windows(felt) {
            let start = window[0].time;
            let pose = |s: &ServoSample| Pose { position: s.tool, rotation: s.rotation };
            let samples = window.iter().map(|s| PoseSample { time: s.time - start, pose: pose(s) }).collect();
            let duration = window[window.len() - 1].time - start;
            let path = ToolPath { id: 1, tool: ball(), sheet: 0, samples };
            let Decision::Run(plan) = planner.frame(&clay.material, duration, &[path]) else {
                unreachable!("no frame is under way");
            };
            engine.submit(plan).expect("a sound plan");
            planner.sent();
            let mut report = engine.wait().expect("the engine runs");
            planner.note(&mut report);
            // What steps bear they bear at their ends.
            found.push((start + 0.5 * (duration + report.dt), report.tools[0].force));
        }
        found
    }

    /// The ticks in windows that share their ends: as long as a frame where nothing is felt.
    fn windows<'a>(&self, felt: &'a Felt) -> Vec<&'a [ServoSample]> {
        let length = (WINDOW_WAY / self.speed).clamp(WINDOW[0], WINDOW[1]);
        let (mut windows, mut from) = (vec![], 0);
        for to in 1..felt.samples.len() {
            let window = &felt.samples[from..=to];
            let is_free = window.iter().all(|s| s.clay_force == DVec3::ZERO);
            let length = if is_free { FREE } else { length };
            if window[window.len() - 1].time - window[0].time >= length || to + 1 == felt.samples.len() {
                windows.push(window);
                from = to;
            }
        }
        windows
    }
}

/// Way of a hand in a window \[m\], and how long windows are at least and at most \[s\].
const WINDOW_WAY: f64 = 1.5e-4;
const WINDOW: [f64; 2] = [2e-3, 8e-3];
/// Length of a window in which nothing is felt \[s\]: that of a frame.
const FREE: f64 = 1.0 / 90.0;

impl Felt {
    /// A hand that takes a tool along a path of its own, and on for a moment, through the servo.
    pub(super) fn of(clay: &Snapshot, tool: Tool, path: HandPath) -> Self {
        Self::by(ArmSettings::default(), clay, tool, path)
    }

    fn by(arm: ArmSettings, clay: &Snapshot, tool: Tool, path: HandPath) -> Self {
        let end = path.duration() + WAIT;
        let arm = SimulatedArm::new(ArmSettings { operator: Operator::STYLUS, ..arm }, path);
        let (servo, ends) = ClayServo::new(ServoSettings { force: OPEN, ..ServoSettings::default() }, 64);
        let mut engine = engine(1);
        engine.load(clay).expect("the clay loads");
        let mut planner = Planner::new(clay);
        planner.policy = policy(true, StepAccuracy::Interactive);
        let parts = (planner, engine, clay.material);
        let mut felt = Self { samples: vec![], frames: vec![] };
        let mut run = VirtualLoop::new(VirtualHand::new(arm, Box::new(servo), ends), tool, parts, LoopClock::default());
        while run.hand.arm.time() < end {
            let frame = run.frame().expect("the engine runs");
            felt.samples.extend(&frame.samples);
            felt.frames.push(frame);
        }
        felt
    }

    /// The ticks with the true force at their times, and the impulse that the clay of the loop gave its tool.
    fn against(&self, truth: &[(f64, DVec3)]) -> Run {
        let at = |time: f64| {
            let next = truth.partition_point(|t| t.0 <= time).clamp(1, truth.len() - 1);
            let [a, b] = [truth[next - 1], truth[next]];
            a.1.lerp(b.1, ((time - a.0) / (b.0 - a.0)).clamp(0.0, 1.0))
        };
        let tick = |s: &ServoSample| Tick { sample: *s, truth: at(s.time), arm: s.hand };
        let impulse = |f: &LoopFrame| f.model.map_or(DVec3::ZERO, |m| m.force * (m.span[1] - m.span[0]));
        let clay_impulse = self.frames.iter().map(impulse).sum();
        Run { ticks: self.samples.iter().map(tick).collect(), clay_impulse, is_sound: true }
    }
}

/// Strokes in an engine's clay at three speeds and several places of the grid: the force felt against that of
/// the same cells in fine steps, in full size also of cells of half the width.
pub fn clay_strokes(size: Size) -> Vec<Row> {
    let offsets = [DVec3::new(0.1, 0.0, 0.03), DVec3::ZERO, DVec3::new(0.25, 0.0, 0.4)];
    let speeds: &[f64] = size.pick(&[0.05], &[0.05], &[0.005, 0.05, 0.2]);
    let offsets = size.pick(&offsets[..1], &offsets[..1], &offsets);
    let strokes: Vec<HandStroke> = speeds
        .iter()
        .flat_map(|speed| offsets.iter().map(|offset| HandStroke { speed: *speed, depth: DEPTH, hold: WAIT, offset: *offset }))
        .collect();
    let felt: Vec<Felt> = strokes.par_iter().map(HandStroke::feel).collect();
    let places = offsets.len();
    // Clay of half the cells is eight times as dear: one place of the grid, in full size.
    let against = |cell: f64, every: usize| -> Vec<Run> {
        let chosen = strokes.par_iter().zip(&felt).step_by(every);
        chosen.map(|(stroke, felt)| felt.against(&stroke.truth(felt, cell))).collect()
    };
    let mut rows = vec![];
    for (speed, runs) in speeds.iter().zip(against(CELL, 1).chunks(places)) {
        rows.extend(rows_of(*speed, OWN, runs));
    }
    if size == Size::Full {
        for (speed, run) in speeds.iter().zip(against(0.5 * CELL, places)) {
            rows.extend(rows_of(*speed, "that of half the cells", &[run]));
        }
    }
    rows
}

/// A hand that holds still for 5 s in an engine's clay, which comes to rest: its models are renewed, and the
/// force stays. An encoder's step of 55 um is worth 4 % of it; by encoders a soft hand that holds between two
/// steps goes from one to the other and back.
pub fn clay_held(size: Size) -> Vec<Row> {
    let offsets = [DVec3::new(0.1, 0.0, 0.03), DVec3::new(0.25, 0.0, 0.4)];
    let offsets = &offsets[..size.pick(1, 1, 2)];
    let arms = [ArmSettings { resolution: 0.0, ..ArmSettings::default() }, ArmSettings::default()];
    let felt = |(arm, offset): &(ArmSettings, DVec3)| {
        let stroke = HandStroke { speed: 0.05, depth: DEPTH, hold: SETTLING + 5.0, offset: *offset };
        let ((there, leaves), felt) = (stroke.hold_span(), stroke.feel_by(*arm));
        let held = felt.samples.iter().filter(|s| (there + SETTLING..leaves).contains(&s.time));
        let least = |of: fn(&ServoSample) -> f64| held.clone().map(of).fold(f64::INFINITY, f64::min);
        let most = |of: fn(&ServoSample) -> f64| held.clone().map(of).fold(0.0, f64::max);
        let force = |s: &ServoSample| s.hand_force.length();
        [100.0 * (most(force) - least(force)) / most(force), 1e3 * most(|s| s.age)]
    };
    let runs: Vec<_> = arms.iter().flat_map(|arm| offsets.iter().map(|offset| (*arm, *offset))).collect();
    let found: Vec<[f64; 2]> = runs.par_iter().map(felt).collect();
    let most = |found: &[[f64; 2]], i: usize| found.iter().map(|f| f[i]).fold(0.0, f64::max);
    let (fine, stepped) = found.split_at(offsets.len());
    let age = most(&found, 1);
    vec![
        Row::at_most("force, clay held for 5 s: change", most(fine, 0), "%", 2.0),
        Row::at_most("force, clay held for 5 s by encoders: change", most(stepped, 0), "%", 2.0),
        Row::at_most("force, clay held for 5 s: greatest age of a model", age, "ms", 33.0),
    ]
}

/// Time that clay and hand take to come to rest \[s\].
const SETTLING: f64 = 0.5;

/// The clay that is felt.
const OWN: &str = "its own";

/// Depth that hands mean to go to \[m\]: the ball goes 1.3 mm deep.
const DEPTH: f64 = 4e-3;

fn rows_of(speed: f64, of: &str, runs: &[Run]) -> Vec<Row> {
    let fidelity: Vec<Fidelity> = runs.iter().map(Run::fidelity).collect();
    let found = super::strokes::worst(&fidelity);
    let most = |of: fn(&Run) -> f64| runs.iter().map(of).fold(0.0, f64::max);
    let name = format!("force, clay at {} mm/s against {of}", 1e3 * speed);
    let mut rows = vec![
        Row::at_least(format!("{name}: correlation"), found.correlation, "-", 0.983),
        Row::at_most(format!("{name}: error"), 100.0 * found.error, "% of its range", 7.0),
        Row::at_most(format!("{name}: slope, off 1 by"), 100.0 * found.slope, "%", 7.0),
        Row::at_most(format!("{name}: energy returned, off by"), found.returned, "of that put in", 0.05),
    ];
    if of == OWN {
        rows.push(Row::at_most(format!("{name}: impulses of hand and clay apart"), 100.0 * most(Run::imbalance), "%", 1.0));
        rows.push(Row::at_most(format!("{name}: slew"), most(Run::slew), "N/ms", 0.3));
    }
    rows
}
