//! A board wider than the clay beneath it: all of the clay's face meets it at once and goes as fast as it
//! does, under gravity, in frames that a planner plans.

use super::planned::Planned;
use crate::lab::{DX, Mover, Size, at_walls, block, room_with, snapshot};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use rayon::prelude::*;

/// How fast the board comes down [m/s]; clay that falls gains 82 mm/s in half a frame.
const SPEEDS: [f64; 2] = [0.03, 0.05];
/// Length of a frame \[s\].
const FRAME: f64 = 1.0 / 60.0;
/// How deep the board goes, and from where on it is a tenth as fast \[cells\].
const DEPTHS: [f64; 2] = [1.0, 0.8];
/// From what depth on forces count \[cells\]: by then the face has met it everywhere.
const PRESSED: f64 = 0.3;

/// A block on a floor that holds it, with room about it.
fn clay(edge: i32) -> Snapshot {
    let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] };
    let domain = room_with([edge + 8, 14, edge + 8], walls);
    let mut particles = block(DVec3::new(4.0, 0.0, 4.0), IVec3::new(edge, 5, edge));
    at_walls(&domain, &mut particles);
    snapshot(domain, Preset::SoftClay.material(), particles)
}

/// Times \[s\] and forces \[N\] of a board that comes down at `speed` [m/s], with this `integrator`.
fn pressed(clay: &Snapshot, edge: i32, speed: f64, integrator: IntegratorChoice) -> Vec<[f64; 2]> {
    let half = 0.5 * f64::from(edge);
    let shape = ToolShape::Box { half_size: DVec3::new(half + 2.0, 2.0, half + 2.0) };
    let contact = Contact::Separate { friction: 0.3 };
    let mut board = Mover::new(&clay.domain, shape, contact, DVec3::new(half + 4.0, 7.1, half + 4.0), DQuat::IDENTITY);
    let mut run = Planned::new(clay, Policy { integrator, ..Policy::default() }, 1);
    let (mut depth, mut time, mut found) = (-0.1, 0.0, vec![]);
    while depth < DEPTHS[0] {
        let speed = if depth < DEPTHS[1] { speed } else { 0.1 * speed };
        board.velocity = DVec3::NEG_Y * speed;
        let report = run.frame(FRAME, &[board.path(FRAME)]);
        depth += speed * FRAME / DX;
        if depth > PRESSED {
            // What steps bear they bear at their ends.
            found.push([time + 0.5 * (FRAME + report.dt), report.tools[0].force.y]);
        }
        time += FRAME;
    }
    found
}

/// By how much a hand tells forces apart [%] (Pang, Tan and Durlach 1991).
const FELT: f64 = 7.0;

/// By how much forces are off those of explicit steps [%], in the mean over the stroke and at most: of what
/// makes times \[s\] and forces \[N\] with an integrator.
pub(super) fn off(of: impl Fn(IntegratorChoice) -> Vec<[f64; 2]> + Sync) -> [f64; 2] {
    let (exact, found) = rayon::join(|| of(IntegratorChoice::Explicit), || of(IntegratorChoice::Implicit));
    let at = |time: f64| {
        let next = exact.partition_point(|e| e[0] < time).clamp(1, exact.len() - 1);
        let [a, b] = [exact[next - 1], exact[next]];
        a[1] + (b[1] - a[1]) * ((time - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0)
    };
    let off: Vec<f64> = found.iter().map(|[time, force]| 100.0 * (force / at(*time) - 1.0).abs()).collect();
    let rms = (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
    [rms, off.into_iter().fold(0.0, greater)]
}

/// The greater; what is no number is greater than all.
pub(super) fn greater(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

/// The rows of what is so far off.
pub(super) fn rows(name: &str, [rms, most]: [f64; 2]) -> [Row; 2] {
    [
        Row::at_most(format!("implicit, {name}: force off by"), rms, "%", 3.0),
        Row::at_most(format!("implicit, {name}: force of any frame off by"), most, "%", FELT),
    ]
}

/// The board's force against that of explicit steps.
pub fn boards(size: Size) -> Vec<Row> {
    let edge = size.pick(6, 12, 16);
    let clay = clay(edge);
    let of_speed = |speed: &f64| {
        let off = off(|integrator| pressed(&clay, edge, *speed, integrator));
        rows(&format!("board at {} mm/s", 1e3 * speed), off)
    };
    SPEEDS.par_iter().flat_map_iter(of_speed).collect()
}
