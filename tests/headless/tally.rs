//! What the frames add up to, of numbers that no healthy engine gives.

#[path = "../../examples/headless/tally.rs"]
mod sums;

use bevy_clay::prelude::*;
use sums::Tally;

fn healthy() -> FrameReport {
    but(FrameReport::default(), |report| {
        (report.grid_mass, report.particle_mass, report.volume_ratio) = (1.0, 1.0, (0.9, 1.1));
    })
}

fn but(mut report: FrameReport, change: impl FnOnce(&mut FrameReport)) -> FrameReport {
    change(&mut report);
    report
}

/// The faults of a run whose middle frame gave `report`.
fn faults(report: &FrameReport) -> Vec<String> {
    let mut tally = Tally::new();
    for report in [&healthy(), report, &healthy()] {
        tally.add(report, 0.001);
    }
    tally.faults()
}

/// One frame in which a number was none is a fault, whichever frames went well before and after.
#[test]
fn numbers_that_are_none_are_not_forgotten() {
    assert_eq!(faults(&healthy()), Vec::<String>::new());
    let nan = f64::NAN;
    for volume_ratio in [(nan, 1.1), (0.9, nan)] {
        let crushed = but(healthy(), |report| report.volume_ratio = volume_ratio);
        assert_eq!(faults(&crushed), ["a volume ratio is not finite"]);
    }
    assert_eq!(faults(&but(healthy(), |report| report.grid_mass = nan)), ["grid mass is off by NaN"]);
    let adrift = but(healthy(), |report| report.momentum = glam::DVec3::NAN);
    assert_eq!(faults(&adrift), ["momentum is off by NaN of what moved"]);
}
