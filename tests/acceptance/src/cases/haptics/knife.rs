//! A knife in the hand about an engine's clay: it goes in by its edge, is held, and comes out of its own cut,
//! felt through the servo against what the clay gave the blade.

use super::clay::{CELL, Felt, clay};
use crate::lab::Size;
use crate::report::Row;
use bevy_clay::haptics::device::simulated::HandPath;
use bevy_clay::haptics::reference::rig::{Run, Tick};
use bevy_clay::haptics::servo::ServoSample;
use bevy_clay::sim::prelude::*;
use glam::DVec3;
use rayon::prelude::*;

/// Size of the block of clay \[m\]: its top is at y = 0, about the axis of y.
const BLOCK: DVec3 = DVec3::new(10e-3, 10e-3, 8e-3);
/// Where the clay is beside the blade's middle \[cells\].
const OFFSET: DVec3 = DVec3::new(0.1, 0.0, 0.13);
/// Half the length of the edge, and half the height of the blade \[m\].
const HALF: [f64; 2] = [3e-3, 6e-3];
/// Height of the edge above the clay before its stroke \[m\].
const HEIGHT: f64 = 1e-3;
/// How deep the hand means to go \[m\]: the edge goes some millimetre less.
const DEPTH: f64 = 7e-3;
/// Time that a hand waits above, and below \[s\].
const WAIT: f64 = 0.1;
/// Way back \[m\] from where a blade was deepest after which its flanks slide: less is its clay's spring.
const TURN: f64 = 0.3e-3;

/// A hand's stroke with a knife.
#[derive(Clone, Copy, Debug)]
struct Stroke {
    /// Speed of the hand \[m/s\].
    speed: f64,
    contact: Contact,
}

impl Stroke {
    /// Down, there, and up the same way, through the servo.
    fn feel(&self) -> Run {
        let [above, below] = [DVec3::Y * (HALF[1] + HEIGHT), DVec3::Y * (HALF[1] - DEPTH)];
        let there = WAIT + (HEIGHT + DEPTH) / self.speed;
        let times = [WAIT, there, there + WAIT, 2.0 * there];
        let path = HandPath::new(times.into_iter().zip([above, below, below, above]));
        let tool = Tool { shape: ToolShape::Blade { half_width: HALF[0], half_height: HALF[1] }, contact: self.contact };
        run(&Felt::of(&clay(BLOCK, CELL, OFFSET), tool, path))
    }

    fn rows(&self, run: &Run) -> Vec<Row> {
        let sticks = self.contact == Contact::Stick;
        let name = format!("force, knife that {} at {} mm/s", if sticks { "sticks" } else { "slips" }, 1e3 * self.speed);
        let edge = |tick: &Tick| tick.sample.tool.y - HALF[1];
        let deepest = (0..run.ticks.len()).min_by(|a, b| edge(&run.ticks[*a]).total_cmp(&edge(&run.ticks[*b]))).unwrap_or(0);
        let turned = edge(&run.ticks[deepest]) + TURN;
        let into: Vec<&Tick> = run.ticks[..deepest].iter().filter(|t| edge(t) < 0.0).collect();
        let out: Vec<&Tick> = run.ticks[deepest..].iter().filter(|t| (turned..0.0).contains(&edge(t))).collect();
        let [felt, truth] = means(&into);
        let [felt_out, truth_out] = means(&out);
        // What slips is not pulled on.
        let back = match sticks {
            true => Row::at_most(format!("{name}: mean force out, off the clay's"), off(felt_out, truth_out), "%", 7.0),
            false => Row::at_most(format!("{name}: mean force out"), felt_out.abs(), "N", 0.01),
        };
        vec![
            Row::at_most(format!("{name}: mean force in, off the clay's"), off(felt, truth), "%", 7.0),
            back,
            Row::at_most(format!("{name}: energy from nowhere"), 1e3 * run.generated(), "mJ", 0.05),
            Row::at_most(format!("{name}: impulses of hand and clay apart"), 100.0 * run.imbalance(), "%", 1.0),
            Row::at_most(format!("{name}: slew"), run.slew(), "N/ms", 0.3),
        ]
    }
}

/// By how much a force is off another [%].
fn off(felt: f64, truth: f64) -> f64 {
    100.0 * (felt / truth - 1.0).abs()
}

/// The ticks with the clay's mean force over the frame about each, and the clay's impulse.
fn run(felt: &Felt) -> Run {
    let models: Vec<_> = felt.frames.iter().filter_map(|frame| frame.model).filter(|m| m.span[1] > m.span[0]).collect();
    let truth = |time: f64| models.iter().find(|m| time <= m.span[1]).map_or(DVec3::ZERO, |m| m.force);
    let tick = |s: &ServoSample| Tick { sample: *s, truth: truth(s.time), arm: s.hand };
    let clay_impulse = models.iter().map(|m| m.force * (m.span[1] - m.span[0])).sum();
    Run { ticks: felt.samples.iter().map(tick).collect(), clay_impulse, is_sound: true }
}

/// Mean forces upwards, felt and of the clay, over ticks \[N\].
fn means(ticks: &[&Tick]) -> [f64; 2] {
    let count = ticks.len() as f64;
    let mean = |of: fn(&Tick) -> f64| ticks.iter().map(|tick| of(tick)).sum::<f64>() / count;
    [mean(|tick| tick.sample.hand_force.y), mean(|tick| tick.truth.y)]
}

/// Strokes of a knife that sticks to the clay, and of one that slips: force on the way in and out, energy and
/// impulse against the clay's own.
pub fn knife(size: Size) -> Vec<Row> {
    let speeds: &[f64] = size.pick(&[0.05], &[0.05], &[0.005, 0.05]);
    let contacts = [Contact::Stick, Contact::Slip];
    let strokes = speeds.iter().flat_map(|speed| contacts.map(|contact| Stroke { speed: *speed, contact }));
    let strokes: Vec<Stroke> = strokes.collect();
    let runs: Vec<Run> = strokes.par_iter().map(Stroke::feel).collect();
    strokes.iter().zip(&runs).flat_map(|(stroke, run)| stroke.rows(run)).collect()
}
