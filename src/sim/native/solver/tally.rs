//! What a frame adds up over its substeps.

use super::super::super::ahead::ClayAhead;
use super::super::super::frame::Timings;
use super::super::grid_step::GridReport;
use super::super::passes::Gathered;
use super::super::tags::{TagReport, Tagged};
use glam::DVec3;

/// Sums over the substeps of a frame.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) grid: GridReport,
    pub(super) tags: Vec<Tagged>,
    /// What edges have ahead in the step that begins.
    pub(super) ahead: ClayAhead,
    pub(super) speed_max: f32,
    pub(super) clamped: u64,
    /// Tags of sides that grew together, and particles that did with another body.
    pub(super) welded: [u64; 2],
    /// Sides carried on.
    pub(super) carried: u64,
    pub(super) timings: Timings,
    /// Evaluations of forces, steps cut and the greatest residual of implicit steps, and their impulse that
    /// is out of balance.
    pub(super) passes: u32,
    pub(super) rejected: u32,
    pub(super) residual: f64,
    pub(super) unbalanced: DVec3,
    /// The way \[cells\] by which what is left out of balance would strain a cell, at most.
    pub(super) way_left: f64,
    /// Mass of the nodes in the last implicit step.
    pub(super) node_mass: f64,
    /// Whether the clay stands, and whether the frame has left it all as it was.
    pub(super) is_standing: bool,
    pub(super) is_unchanged: bool,
}

impl Tally {
    pub(super) fn add_grid(&mut self, report: &GridReport) {
        self.grid.wall_impulse += report.wall_impulse;
        self.grid.damping_impulse += report.damping_impulse;
        self.grid.body_impulse += report.body_impulse;
        self.grid.impulse_scale += report.impulse_scale;
        self.grid.tools.resize(report.tools.len(), Default::default());
        for (sum, t) in self.grid.tools.iter_mut().zip(&report.tools) {
            *sum = (sum.0 + t.0, sum.1 + t.1, sum.2 + t.2);
        }
        self.speed_max = self.speed_max.max(report.speed_max);
    }

    /// Adds what a gather did; returns the greatest distance that tagging moved a particle.
    pub(super) fn add_gathered(&mut self, gathered: &Gathered) -> f32 {
        self.clamped += gathered.clamped;
        if let Some(ghosts) = &gathered.ghosts {
            self.add_grid(ghosts);
        }
        self.add_tags(&gathered.tags)
    }

    /// Adds the blocks' reports; returns the greatest distance a particle was moved.
    pub(super) fn add_tags(&mut self, reports: &[TagReport]) -> f32 {
        for report in reports {
            self.ahead.add(&report.ahead);
            self.tags.resize(report.tools.len(), Default::default());
            for (sum, t) in self.tags.iter_mut().zip(&report.tools) {
                sum.add(t);
            }
        }
        reports.iter().map(|r| r.moved_max).fold(0.0, f32::max)
    }
}
