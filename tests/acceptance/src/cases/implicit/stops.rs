//! A ball that stops at once deep in clay: inertia takes a part of its force, in frames that a planner plans.

use super::planned::Planned;
use crate::lab::{DX, Size, at_walls, block, room_with, snapshot, world};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// How fast the ball comes [m/s]: implicit steps alone keep 3 to 5 %, 13 and 40 % more of its force than
/// explicit ones.
const SPEEDS: [f64; 3] = [0.2, 0.4, 0.8];
/// Length of a frame \[s\]: stops fall into frames, not between them.
const FRAME: f64 = 1.0 / 90.0;
/// The ball's radius \[cells\].
const RADIUS: f64 = 2.5;
/// How far above the clay it begins, and how deep it stops \[cells\].
const ABOVE: f64 = 0.1;
const DEPTH: f64 = 2.0;
/// How long it is held \[s\].
const HELD: f64 = 0.08;

/// Force \[N\] of a ball that came at `speed` [m/s] and was held, with this `integrator`.
fn kept(edge: i32, speed: f64, integrator: IntegratorChoice) -> f64 {
    let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] };
    let domain = room_with([edge + 8, 20, edge + 8], walls);
    let mut particles = block(DVec3::new(4.0, 0.0, 4.0), IVec3::new(edge, 8, edge));
    at_walls(&domain, &mut particles);
    let clay = snapshot(domain, Preset::SoftClay.material(), particles);
    let middle = 4.0 + 0.5 * f64::from(edge);
    let stop = (ABOVE + DEPTH) * DX / speed;
    let pose_at = |time: f64| {
        let height = 8.0 + RADIUS + ABOVE - time.min(stop) * speed / DX;
        Pose { position: world(&domain, DVec3::new(middle, height, middle)), ..Pose::default() }
    };
    let tool = Tool { shape: ToolShape::Sphere { radius: RADIUS * DX }, contact: Contact::Separate { friction: 0.3 } };
    let mut run = Planned::new(&clay, Policy { integrator, ..Policy::default() }, 1);
    let frames = ((stop + HELD) / FRAME).ceil() as u32;
    let mut frame = |index: u32| {
        let [start, end] = [index, index + 1].map(|index| f64::from(index) * FRAME);
        let times = std::iter::once(start).chain((start < stop && stop < end).then_some(stop)).chain([end]);
        let samples = times.map(|time| PoseSample { time: time - start, pose: pose_at(time) }).collect();
        run.frame(FRAME, &[ToolPath { id: 1, tool, sheet: 0, samples }]).tools[0].force.y
    };
    (0..frames).map(&mut frame).last().unwrap_or(f64::NAN)
}

/// What a ball keeps against explicit steps, as it is planned and by implicit steps alone.
pub fn stops(size: Size) -> Vec<Row> {
    let edge = size.pick(8, 12, 16);
    let of_speed = |speed: &f64| {
        let ways = [IntegratorChoice::Explicit, IntegratorChoice::Auto, IntegratorChoice::Implicit];
        let forces: Vec<f64> = ways.par_iter().map(|way| kept(edge, *speed, *way)).collect();
        let off = |force: f64| 100.0 * (force / forces[0] - 1.0).abs();
        let name = format!("ball that stops from {} mm/s", 1e3 * speed);
        [
            Row::at_most(format!("as planned, {name}: held force off by"), off(forces[1]), "%", 3.0),
            Row::figure(format!("{name}, by implicit steps alone: held force off by"), off(forces[2]), "%"),
        ]
    };
    SPEEDS.par_iter().flat_map_iter(of_speed).collect()
}
