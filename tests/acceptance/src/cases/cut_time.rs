//! What cuts cost: a substep of a block that two crossing planes have cut, over one of the same block whole.

use crate::lab::{Lab, Size, block, elastic, is_gpu, jitter, place, room, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::cut::SheetSet;
use bevy_clay::sim::prelude::*;
use cpu_time::{ProcessTime, ThreadTime};
use glam::{DVec3, IVec3};
use std::time::Instant;

/// Cells of the room on each side of the block.
const MARGIN: i32 = 6;
/// Substeps of a frame, and frames of which the cheapest counts.
const STEPS: u32 = 40;
const FRAMES: u32 = 7;
/// How far from a plane particles are tagged [cells].
const LAYER: f64 = 2.0;
/// The planes' normals: off the grid's axes, across each other.
const NORMALS: [DVec3; 2] = [DVec3::new(1.0, 0.17, 0.0), DVec3::new(-0.1, 0.05, 1.0)];

/// How the block's parts came to be.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Parts {
    Whole,
    /// Sides of two cuts, which a blade may carry on at any time.
    Cut,
    /// Bodies, as finished cuts leave them.
    Bodies,
}

/// A block of `edge` cells, jittered, at rest.
fn clay(edge: i32, parts: Parts) -> Snapshot {
    let corner = f64::from(MARGIN);
    let middle = DVec3::splat(corner + 0.5 * f64::from(edge)) + DVec3::new(0.23, 0.1, 0.41);
    let mut particles = block(DVec3::splat(corner), IVec3::splat(edge));
    jitter(&mut particles, 0.1, 11);
    if parts != Parts::Whole {
        for p in &mut particles {
            for (slot, normal) in NORMALS.iter().enumerate() {
                let distance = (place(p) - middle).dot(normal.normalize());
                if distance.abs() < LAYER {
                    p.tags[slot] = Tag { sheet: slot as u8 + 1, side: if distance < 0.0 { -1 } else { 1 } };
                }
            }
            p.tags.sort_by_key(|tag| (tag.sheet == 0, tag.sheet));
        }
    }
    let clay = snapshot(room([edge + 2 * MARGIN; 3], Wall::Separate), elastic(0.3), particles);
    if parts == Parts::Bodies { found(clay).0 } else { clay }
}

/// The clay with its bodies, and how long it took to find them [ms].
fn found(mut clay: Snapshot) -> (Snapshot, f64) {
    let began = ThreadTime::now();
    clay.find_bodies(SheetSet::default());
    (clay, 1e3 * began.elapsed().as_secs_f64())
}

/// Time of a frame [s]: of the processor, whose second thread would wait for the first; of a device as the
/// wall has it.
fn time(lab: &mut Lab) -> f64 {
    let (wall, cpu) = (Instant::now(), ProcessTime::now());
    lab.frame(STEPS);
    if is_gpu() { wall.elapsed().as_secs_f64() } else { cpu.elapsed().as_secs_f64() }
}

/// A substep of cut clay over one of whole clay, the least of frames that take turns.
pub(super) fn substeps(size: Size) -> Vec<Row> {
    let edge = size.pick(8, 16, 24);
    let dt = stable_step(&elastic(0.3));
    let mut labs = [Parts::Whole, Parts::Cut, Parts::Bodies].map(|parts| Lab::with_threads(&clay(edge, parts), dt, 1));
    for lab in &mut labs {
        lab.plan.outputs = FrameOutputs::NOTHING;
        lab.frame(2);
    }
    let mut least = [f64::INFINITY; 3];
    for _ in 0..FRAMES {
        for (least, lab) in least.iter_mut().zip(&mut labs) {
            *least = least.min(time(lab));
        }
    }
    let count = clay(edge, Parts::Whole).particles.len();
    let name = |what: &str| format!("{count} particles, two planes that cross: {what}");
    let unit = if is_gpu() { "ns" } else { "core-ns" };
    vec![
        Row::figure(name("substep of the whole block, by particle"), 1e9 * least[0] / f64::from(STEPS) / count as f64, unit),
        Row::at_most(name("substep of cuts, of that"), least[1] / least[0], "-", 1.3),
        Row::at_most(name("substep of bodies, of that"), least[2] / least[0], "-", 1.3),
        Row::figure(name("finding the bodies"), found(clay(edge, Parts::Cut)).1, "ms"),
    ]
}
