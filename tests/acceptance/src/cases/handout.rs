//! What comes back from the device at a frame's end.

use crate::lab::{Lab, Size, block, room, stable_step};
use crate::report::Row;
use bevy_clay::sim::params::Wall;
use bevy_clay::sim::prelude::*;
use glam::{DVec3, IVec3};

/// Bytes that a frame of 105,000 particles reads back: for its report alone, with the surface, with the state
/// too. None on the processor.
pub fn bytes(_: Size) -> Vec<Row> {
    let particles = block(DVec3::new(4.0, 0.0, 4.0), IVec3::new(25, 21, 25));
    let count = particles.len();
    let material = Preset::SoftClay.material();
    let snapshot = Snapshot::new(room([33, 29, 33], Wall::Slip), material, particles);
    let mut lab = Lab::new(&snapshot, stable_step(&material));
    let asked = [
        ("report", FrameOutputs::NOTHING),
        ("report and surface", FrameOutputs { surface: true, ..FrameOutputs::NOTHING }),
        ("report, surface and state", FrameOutputs::ALL),
    ];
    let row = |(what, outputs)| {
        lab.plan.outputs = outputs;
        let bytes = lab.frame(1).bytes_read_back;
        Row::figure(format!("{count} particles: {what}, read back a frame"), bytes as f64, "bytes")
    };
    asked.map(row).into()
}
