//! What the frames add up to, of numbers that no healthy engine gives.

#[path = "../../examples/headless/tally.rs"]
mod sums;

use bevy_clay::prelude::*;
use sums::Tally;

fn healthy() -> FrameReport {
    FrameReport { grid_mass: 1.0, particle_mass: 1.0, volume_ratio: (0.9, 1.1), ..FrameReport::default() }
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
    for report in [FrameReport { volume_ratio: (nan, 1.1), ..healthy() }, FrameReport { volume_ratio: (0.9, nan), ..healthy() }] {
        assert_eq!(faults(&report), ["a volume ratio is not finite"]);
    }
    assert_eq!(faults(&FrameReport { grid_mass: nan, ..healthy() }), ["grid mass is off by NaN"]);
    let adrift = FrameReport { momentum: glam::DVec3::NAN, ..healthy() };
    assert_eq!(faults(&adrift), ["momentum is off by NaN of what moved"]);
}
