//! What is charted: cases with an exact answer, run with any setting.
//!
//! Cell widths in the cases' own room are all the same, and the clay is scaled instead: a scene of twice the
//! cells is twice as large. Times are those of one and the same scene of real size by similarity, see
//! [`Run::simulated`].

use super::knobs::{Effort, Knob, Point, Setting, points};
use bevy_clay::sim::prelude::*;
use clay_acceptance::cases::elastic::Column;
use clay_acceptance::cases::prandtl::{PRANDTL, Punch};
use clay_acceptance::lab::{self, Lab};
use glam::{DVec3, IVec3};

/// Stretches of a run that are timed apart.
pub(crate) const REPEATS: usize = 5;

/// A figure of a scene.
pub(crate) struct Panel {
    /// What it is an error of.
    pub(crate) name: &'static str,
    /// The error, as on the axis.
    pub(crate) error: &'static str,
}

/// A case.
pub(crate) struct Scene {
    /// Its name.
    pub(crate) name: &'static str,
    /// What a run of it gives.
    pub(crate) panels: &'static [Panel],
    /// The points to run.
    pub(crate) points: fn(Effort) -> Vec<Point>,
    /// Runs one.
    pub(crate) run: fn(&Setting) -> Run,
}

/// What a run gave.
pub(crate) struct Run {
    /// Errors, one per panel [%].
    pub(crate) errors: Vec<f64>,
    /// Particles.
    pub(crate) particles: usize,
    /// Substeps.
    pub(crate) steps: u64,
    /// Wall time of each of [`REPEATS`] equal stretches [s].
    pub(crate) stretches: Vec<f64>,
    /// Time simulated in a stretch, of the scene of real size [s].
    pub(crate) simulated: f64,
}

impl Run {
    /// `simulated` is of the whole run, whose frames are alike.
    fn new(errors: Vec<f64>, particles: usize, reports: &[FrameReport], simulated: f64) -> Self {
        let length = reports.len() / REPEATS;
        let stretches = reports.chunks_exact(length).map(|frames| frames.iter().map(|f| f.timings.total).sum()).collect();
        let steps = reports.iter().map(|r| u64::from(r.steps)).sum();
        Self { errors, particles, steps, stretches, simulated: simulated * length as f64 / reports.len() as f64 }
    }
}

/// The scenes, in the order of the panels.
pub(crate) const SCENES: &[Scene] = &[
    Scene {
        name: "self weight",
        panels: &[
            Panel { name: "Self weight, displacement", error: "L2 error of the displacement [%]" },
            Panel { name: "Self weight, stress", error: "L2 error of the stress [%]" },
        ],
        points: column_points,
        run: run_column,
    },
    Scene {
        name: "Prandtl",
        panels: &[Panel { name: "Prandtl's punch", error: "error of the bearing factor [%]" }],
        points: punch_points,
        run: run_punch,
    },
];

/// Height of the column of real size [m].
const COLUMN_HEIGHT: f64 = 0.1;

fn column_points(effort: Effort) -> Vec<Point> {
    let default = 16;
    match effort {
        Effort::Smoke => points(8, &[8], &[], &[]).into_iter().filter(|p| p.knob != Knob::Step).collect(),
        Effort::Quick => points(default, &[8, 24, 32], &[8, 16, 32], &[5e-3]),
        Effort::Full => points(default, &[8, 24, 32, 48, 64], &[8, 16, 32, 48], &[5e-5, 5e-3]),
    }
}

/// A column half as wide as high comes to rest: reflected side walls make it the one-dimensional problem.
fn run_column(setting: &Setting) -> Run {
    let column = Column {
        cells: setting.cells,
        across: setting.cells / 2,
        per_axis: setting.per_axis,
        fraction: setting.fraction,
        clamped_walls: setting.clamped_walls,
        volume_averaging: setting.volume_averaging,
        settling: 40.0,
        frames: 50,
    };
    let settled = column.settle();
    // rho g H / M is the same at every height, so that time scales as H / c and c as the square root of H.
    let simulated: f64 = settled.reports.iter().map(|r| r.dt * f64::from(r.steps)).sum();
    let scale = (COLUMN_HEIGHT / (f64::from(setting.cells) * lab::DX)).sqrt();
    let errors = vec![100.0 * settled.displacement, 100.0 * settled.stress];
    Run::new(errors, settled.particles, &settled.reports, simulated * scale)
}

/// Width of the strip of real size [m].
const STRIP_WIDTH: f64 = 0.02;

fn punch_points(effort: Effort) -> Vec<Point> {
    let default = 8;
    match effort {
        Effort::Smoke => {
            points(4, &[], &[], &[]).into_iter().filter(|p| p.setting.per_axis < 3 && p.knob != Knob::Step).collect()
        }
        Effort::Quick => points(default, &[4, 12], &[8], &[0.0, 5e-5, 5e-3]),
        Effort::Full => points(default, &[4, 12, 16], &[4, 8, 12], &[0.0, 5e-5, 5e-3]),
    }
}

/// A strip pressed into clay where plain MPM begins to lock: six times as wide as the strip, twice as deep,
/// and as thick as it is wide.
fn punch(setting: &Setting) -> Punch {
    Punch {
        width: setting.cells,
        slab: setting.cells,
        per_axis: setting.per_axis,
        fraction: setting.fraction,
        clamped_walls: setting.clamped_walls,
        room: [3.0, 2.0],
        ..Punch::new(0.45, setting.volume_averaging)
    }
}

fn run_punch(setting: &Setting) -> Run {
    let bearing = punch(setting).press();
    // The clay is the same at every size, so that time scales as the width.
    let simulated: f64 = bearing.reports.iter().map(|r| r.dt * f64::from(r.steps)).sum();
    let scale = STRIP_WIDTH / (f64::from(setting.cells) * lab::DX);
    Run::new(vec![100.0 * (bearing.factor / PRANDTL - 1.0).abs()], bearing.particles, &bearing.reports, simulated * scale)
}

/// Why the engine does not take a setting, if it does not.
pub(crate) fn refusal(setting: &Setting) -> Option<String> {
    let clay = lab::snapshot(lab::room([4; 3], Wall::Slip), lab::elastic(0.0), lab::block(DVec3::ZERO, IVec3::ONE));
    let mut lab = Lab::new(&clay, lab::stable_step(&clay.material));
    lab.plan.volume_averaging = setting.volume_averaging;
    lab.plan.validation.clamped_walls = setting.clamped_walls;
    lab.engine.submit(lab.plan.clone()).err().map(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room is whole blocks of 4 cells: clay that is not would have a gap to its walls.
    #[test]
    fn clay_fills_its_room() {
        for effort in [Effort::Smoke, Effort::Quick, Effort::Full] {
            for point in column_points(effort) {
                assert_eq!(point.setting.cells / 2 % 4, 0, "{point:?}");
            }
            for point in punch_points(effort) {
                let size = punch(&point.setting).size();
                assert_eq!((size.x % 4, size.z % 4), (0, 0), "{point:?}");
            }
        }
    }
}
