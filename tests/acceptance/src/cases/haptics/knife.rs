//! A knife in the hand about an engine's clay: it goes in by its edge, is held, and comes out of its own cut,
//! felt through the servo against what the clay gave the blade.

use super::clay::{CELL, Felt, clay};
use crate::lab::Size;
use crate::report::Row;
use bevy_clay::haptics::device::simulated::HandPath;
use bevy_clay::haptics::reference::rig::{Run, Tick};
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3};
use rayon::prelude::*;

/// Size of the block of clay \[m\]: its top is at y = 0, about the axis of y.
const BLOCK: DVec3 = DVec3::new(10e-3, 10e-3, 8e-3);
/// Half the length of the edge, and half the height of the blade \[m\].
const HALF: [f64; 2] = [3e-3, 6e-3];
/// Height of the edge above the clay before its stroke \[m\].
const HEIGHT: f64 = 1e-3;
/// How deep the hand means to go \[m\]: the edge goes some millimetre less.
const DEPTH: f64 = 7e-3;
/// Time that a hand waits above, and below \[s\].
const WAIT: f64 = 0.1;

/// Down, there, and up the same way at `speed` \[m/s\].
fn felt(speed: f64, contact: Contact) -> Felt {
    let [above, below] = [DVec3::Y * (HALF[1] + HEIGHT), DVec3::Y * (HALF[1] - DEPTH)];
    let there = WAIT + (HEIGHT + DEPTH) / speed;
    let times = [WAIT, there, there + WAIT, 2.0 * there];
    let path = HandPath::new(times.into_iter().zip([above, below, below, above]));
    let shape = ToolShape::Blade { half_width: HALF[0], half_height: HALF[1] };
    Felt::of(&clay(BLOCK, CELL, DVec3::new(0.1, 0.0, 0.13)), Tool { shape, contact }, path)
}

/// The stroke as a run whose truth is the clay's mean force over the frame about each tick.
fn run(felt: &Felt) -> Run {
    let models: Vec<_> = felt.frames.iter().filter_map(|frame| frame.model).filter(|m| m.span[1] > m.span[0]).collect();
    let truth = |time: f64| models.iter().find(|m| time <= m.span[1]).map_or(DVec3::ZERO, |m| m.force);
    let ticks = felt.samples.iter().map(|s| Tick { sample: *s, truth: truth(s.time), arm: s.hand }).collect();
    let clay_impulse = models.iter().map(|m| m.force * (m.span[1] - m.span[0])).sum();
    Run { ticks, clay_impulse, is_sound: true }
}

/// Mean forces felt and of the clay \[N\], upwards, over ticks.
fn means<'a>(ticks: impl Iterator<Item = &'a Tick>) -> [f64; 2] {
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for tick in ticks {
        sum = [sum[0] + tick.sample.hand_force.y, sum[1] + tick.truth.y];
        count += 1.0;
    }
    sum.map(|force| force / count)
}

/// Strokes of a knife at two speeds: the mean force felt on the way in, and out, against the clay's own.
pub fn knife(size: Size) -> Vec<Row> {
    let speeds: &[f64] = size.pick(&[0.05], &[0.005, 0.05], &[0.005, 0.05]);
    let mut rows = vec![];
    for speed in speeds {
        for contact in [Contact::Stick, Contact::Slip] {
        let felt = felt(*speed, contact);
        let run = run(&felt);
        if std::env::var("DUMP").is_ok() {
            for (i, t) in run.ticks.iter().enumerate() { if i % 10 == 0 {
                println!("{:.3} hand {:.3} tool {:.3} felt {:.4} truth {:.4} | {:.4} {:.4}", t.sample.time, 1e3*(t.sample.hand.y-HALF[1]), 1e3*(t.sample.tool.y-HALF[1]), t.sample.hand_force.y, t.truth.y, t.sample.hand_force.x, t.sample.hand_force.z);
            } }
            for f in felt.frames.iter() { if let Some(m) = f.model { if let Some(b) = &m.blade {
                let t = &f.report.as_ref().unwrap().touches[0];
                println!("f {} {:.3} y {:.3} F {:.4} flank {:.4} g {:.1} bear {:.3} {:.3} K {:.0} {:.0} area {:.3} | {}", m.frame, m.span[1], 1e3*(m.position.y-HALF[1]), m.force.y, b.flank, b.flank_growth.y, b.bearing[0], b.bearing[1], m.stiffness.z_axis.z, m.stiffness.x_axis.x, 1e6*t.area,
                  b.edges.iter().map(|e| format!("({:.0} {:.0}) g {:.2} F {:.4};", e.outward.x, e.outward.y, 1e3*e.gap, e.force)).collect::<String>());
            } } }
        }
        let deepest = run.ticks.iter().position(|t| t.sample.hand.y < HALF[1] - DEPTH + 0.05e-3).unwrap_or(run.ticks.len() - 1);
        let in_ticks = run.ticks[..deepest].iter().filter(|t| t.sample.tool.y < HALF[1]);
        let [f, c] = means(in_ticks);
        let name = format!("force, knife {contact:?} at {} mm/s", 1e3 * speed);
        rows.push(Row::at_most(format!("{name}: mean force in, off the clay's by"), 100.0 * (f / c - 1.0).abs(), "%", 7.0));
        rows.push(Row::figure(format!("{name}: mean force in"), c, "N"));
        let [f, c] = means(run.ticks.iter().skip(deepest + 100).filter(|t| t.sample.tool.y < HALF[1]));
        rows.push(Row::figure(format!("{name}: mean felt out"), f, "N"));
        rows.push(Row::figure(format!("{name}: mean clay out"), c, "N"));
        rows.push(Row::at_most(format!("{name}: energy given"), 1e3 * run.generated(), "mJ", 0.05));
        rows.push(Row::at_most(format!("{name}: impulse"), 100.0 * run.imbalance(), "%", 1.0));
        rows.push(Row::at_most(format!("{name}: slew"), run.slew(), "N/ms", 0.3));
        }
    }
    rows
}
