//! Undo and redo of many strokes.

use crate::lab::{Lab, Mover, Size, block, jitter, place, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::scene::history::History;
use bevy_clay::sim::prelude::*;
use cpu_time::ThreadTime;
use glam::{DQuat, DVec3, IVec3};

/// Radius of the ball that presses the clay [cells].
const TOOL: f64 = 4.0;
/// How deep it presses [cells].
const DEPTH: f64 = 2.0;
/// Frames in which it goes in; as many in which it comes out.
const FRAMES: u32 = 3;
/// Simulated time of a frame \[s\].
const FRAME: f64 = 1.0 / 60.0;
/// Cells of the room beside the clay, for the ball.
const MARGIN: f64 = 6.0;

/// A ball of clay on a floor, pressed all around, stroke by stroke.
struct Strokes {
    lab: Lab,
    domain: Domain,
    centre: DVec3,
    radius: f64,
    done: u32,
}

impl Strokes {
    /// A ball of `radius` cells, 8 particles per cell.
    fn new(radius: f64) -> Self {
        let half = radius.ceil();
        let centre = DVec3::new(half + MARGIN, radius, half + MARGIN);
        let edge = 2 * half as i32;
        let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], ..Walls::default() };
        let domain = room_with([edge + 2 * MARGIN as i32; 3], walls);
        let material = Preset::SoftClay.material();
        let mut particles = block(DVec3::new(MARGIN, 0.0, MARGIN), IVec3::splat(edge));
        jitter(&mut particles, 0.1, 3);
        particles.retain(|p| place(p).distance(centre) < radius && place(p).y > 0.0);
        let mut lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
        lab.plan.gravity = DVec3::new(0.0, -9.81, 0.0);
        lab.plan.outputs = FrameOutputs::NOTHING;
        Self { lab, domain, centre, radius, done: 0 }
    }

    fn state(&mut self) -> Snapshot {
        self.lab.engine.save().expect("clay is loaded")
    }

    /// Substeps of a frame.
    fn steps(&self) -> u32 {
        (FRAME / self.lab.plan.dt).round() as u32
    }

    /// Presses the ball into the clay, at another place each time, and draws it back.
    fn stroke(&mut self) {
        // Heights in even steps, turned by the golden angle: 64 places all over the ball but its foot.
        let turn = 2.399_963 * f64::from(self.done);
        let height = 0.95 - 1.25 * f64::from(self.done % 64) / 64.0;
        let ring = (1.0 - height * height).sqrt();
        let outward = DVec3::new(ring * turn.cos(), height, ring * turn.sin());
        let at = self.centre + outward * (self.radius + TOOL);
        let mut ball = Mover::new(&self.domain, ToolShape::Sphere { radius: TOOL }, Contact::default(), at, DQuat::IDENTITY);
        let steps = self.steps();
        let speed = DEPTH * self.domain.cell_width / (f64::from(FRAMES * steps) * self.lab.plan.dt);
        for way in [-1.0, 1.0] {
            ball.velocity = outward * (way * speed);
            for _ in 0..FRAMES {
                self.lab.frame_moving(steps, &mut ball);
            }
        }
        self.done += 1;
    }

    /// Lets the clay settle for a frame.
    fn settle(&mut self) {
        self.lab.frame(self.steps());
    }
}

/// What is left of a state: its particles by id, at rest; bit by bit, as a checksum.
fn canonical(mut state: Snapshot) -> u32 {
    state.particles.sort_by_key(|p| p.id);
    state.particles.iter_mut().for_each(|p| (p.velocity, p.affine) = Default::default());
    Snapshot { forecasts: None, ..state }.checksum()
}

/// CPU time of calls [ms].
#[derive(Default)]
struct Times(Vec<f64>);

impl Times {
    /// Takes the time of a call.
    fn of<T>(&mut self, call: impl FnOnce() -> T) -> T {
        let start = ThreadTime::now();
        let value = call();
        self.0.push(start.elapsed().as_secs_f64() * 1e3);
        value
    }

    fn mean(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len() as f64
    }
}

/// Every stroke is recorded, all are undone, what has settled since the last one with it, and redone: none is
/// evicted from the default budget, and every state has the bits that it had.
pub fn history(size: Size) -> Vec<Row> {
    let count = size.pick(4, 8, 64);
    let mut strokes = Strokes::new(size.pick(5.0, 7.0, 14.63));
    let start = strokes.state();
    let particles = start.particles.len();
    let mut states = vec![canonical(start.clone())];
    let mut history = History::new(History::BUDGET_DEFAULT);
    history.record(start);
    let [mut record, mut settled, mut undo, mut redo] = [const { Times(vec![]) }; 4];
    for _ in 0..count {
        strokes.stroke();
        let state = strokes.state();
        states.push(canonical(state.clone()));
        record.of(|| history.record(state));
    }
    let bytes = history.bytes();
    strokes.settle();
    let now = strokes.state();
    states[count] = canonical(now.clone());
    let mut wrong = 0;
    let mut judge = |state: Option<Snapshot>, at: usize| wrong += u32::from(state.map(canonical) != Some(states[at]));
    let undone = settled.of(|| {
        history.amend(now);
        history.undo()
    });
    judge(undone.expect("sound memory"), count - 1);
    for at in (0..count - 1).rev() {
        judge(undo.of(|| history.undo()).expect("sound memory"), at);
    }
    for at in 1..=count {
        judge(redo.of(|| history.redo()).expect("sound memory"), at);
    }
    let name = |what: &str| format!("{count} strokes, {particles} particles: {what}");
    let time = |what: &str, times: &Times| Row::figure(name(&format!("{what}, on one core")), times.mean(), "ms");
    vec![
        Row::at_most(name("states that come back otherwise"), f64::from(wrong), "states", 0.0),
        Row::at_most(name("evicted"), history.evicted() as f64, "strokes", 0.0),
        Row::at_most(name("kept"), bytes as f64 / f64::from(1 << 20), "MiB", (History::BUDGET_DEFAULT >> 20) as f64),
        Row::figure(name("a state"), bytes as f64 / (count + 1) as f64, "bytes"),
        time("a record", &record),
        time("an amendment and an undo", &settled),
        time("an undo", &undo),
        time("a redo", &redo),
    ]
}
