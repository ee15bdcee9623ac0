//! A block that stands loose on a floor without friction, between two pads that come together: it hops as
//! they squeeze it, and gravity would take it some cells down in a step, were there no floor.

use super::board::{greater, off, rows};
use super::planned::Planned;
use crate::lab::{DX, Mover, Size, block, room_with, snapshot};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use rayon::prelude::*;

/// How fast each pad comes [m/s].
const SPEED: f64 = 0.0096;
/// Length of a frame \[s\]: a step of it takes falling clay 2.7 cells down.
const FRAME: f64 = 1.0 / 30.0;
/// How far off each pad begins \[cells\]: it decides how deep in a frame the first touch comes, and by that
/// how high the block hops. From .2 and .25 it hardly does.
const GAPS: [f64; 3] = [0.28, 0.3, 0.36];
/// How deep each pad goes, and from where on forces count \[cells\].
const DEPTHS: [f64; 2] = [0.6, 0.15];

/// Times \[s\] and forces \[N\] of slippery pads, from `gap` cells off a block of `edge` cells.
fn squeezed(edge: i32, gap: f64, integrator: IntegratorChoice) -> Vec<[f64; 2]> {
    let domain = room_with([edge + 12, 14, edge + 8], Walls { low: [Wall::Separate; 3], high: [Wall::Separate; 3] });
    let particles = block(DVec3::new(6.0, 0.0, 4.0), IVec3::new(edge, 5, edge));
    let clay = snapshot(domain, Preset::SoftClay.material(), particles);
    let half_edge = 0.5 * f64::from(edge);
    let half = DVec3::new(1.5, 4.0, half_edge + 1.0);
    let pad = |side: f64, id| {
        let middle = DVec3::new(6.0 + half_edge, 4.1, 4.0 + half_edge);
        let at = middle + DVec3::X * side * (half_edge + half.x + gap);
        let pad = Mover::new(&clay.domain, ToolShape::Box { half_size: half }, Contact::Slip, at, DQuat::IDENTITY);
        Mover { id, velocity: DVec3::X * -side * SPEED, ..pad }
    };
    let mut pads = [pad(1.0, 1), pad(-1.0, 2)];
    let mut run = Planned::new(&clay, Policy { integrator, ..Policy::default() }, 1);
    let (mut depth, mut time, mut found) = (-gap, 0.0, vec![]);
    while depth < DEPTHS[0] {
        let report = run.frame(FRAME, &pads.each_mut().map(|pad| pad.path(FRAME)));
        depth += SPEED * FRAME / DX;
        if depth > DEPTHS[1] {
            // What steps bear they bear at their ends.
            found.push([time + 0.5 * (FRAME + report.dt), 0.5 * (report.tools[0].force.x - report.tools[1].force.x)]);
        }
        time += FRAME;
    }
    found
}

/// The pads' force against that of explicit steps, at the worst of the gaps.
pub fn pads(size: Size) -> Vec<Row> {
    let edge = size.pick(4, 8, 12);
    let all: Vec<[f64; 2]> = GAPS.par_iter().map(|gap| off(|integrator| squeezed(edge, *gap, integrator))).collect();
    let worst = [0, 1].map(|i| all.iter().map(|off| off[i]).fold(0.0, greater));
    rows("slippery pads on a loose block", worst).to_vec()
}
