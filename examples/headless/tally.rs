//! What the frames of a run add up to.

use bevy_clay::prelude::*;
use std::fmt::Write as _;

const HEADER: &str = "frame,time_s,kinetic_J,elastic_J,J_min,J_max,tool_force_max_N,pushed_back,steps,passes,residual,dt_s,density_scale,speed_max_m_s,kinetic_ratio,real_time_factor,\
    total_ms,rebin_ms,grid_ms,particles_ms,report_ms,balance_error,mass_error,health\n";

/// Greatest difference of grid mass and particle mass over the latter [-]: sums of fixed point keep 1e-7.
const MASS_ERROR_MAX: f64 = 1e-7;
/// Greatest error of the momentum balance over what moved [-].
const BALANCE_ERROR_MAX: f64 = 1e-5;

/// The greater of two numbers; unlike [`f64::max`], NaN if one of them is.
fn most(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// A line per frame, and what the frames had in common.
pub(crate) struct Tally {
    /// The text of `metrics.csv`.
    pub(crate) metrics: String,
    pub(crate) health: Health,
    /// Frames run; one that was given up is none.
    pub(crate) frames: u64,
    pub(crate) steps: u64,
    pub(crate) redone: u64,
    pub(crate) balance_max: f64,
    pub(crate) mass_error_max: f64,
    /// Least and greatest volume ratio J.
    pub(crate) ratio: (f64, f64),
    /// Greatest force on each tool \[N\].
    pub(crate) force_max: Vec<f64>,
    /// Wall time in the engine \[s\].
    pub(crate) engine_seconds: f64,
}

impl Tally {
    pub(crate) fn new() -> Self {
        Self {
            metrics: HEADER.into(),
            health: Health::OK,
            frames: 0,
            steps: 0,
            redone: 0,
            balance_max: 0.0,
            mass_error_max: 0.0,
            ratio: (f64::INFINITY, 0.0),
            force_max: vec![],
            engine_seconds: 0.0,
        }
    }

    /// Adds a frame on cells of `cell_width` \[m\].
    pub(crate) fn add(&mut self, report: &FrameReport, cell_width: f64) {
        let mass_error = (report.grid_mass / report.particle_mass - 1.0).abs();
        self.add_line(report, cell_width, mass_error);
        self.health.insert(report.health);
        self.frames += u64::from(!report.health.contains(Health::GIVEN_UP));
        self.steps += u64::from(report.steps);
        self.redone += u64::from(report.redone);
        self.balance_max = most(self.balance_max, report.balance_error());
        self.mass_error_max = most(self.mass_error_max, mass_error);
        self.ratio = (-most(-self.ratio.0, -report.volume_ratio.0), most(self.ratio.1, report.volume_ratio.1));
        for tool in &report.tools {
            let index = tool.id as usize - 1;
            if self.force_max.len() <= index {
                self.force_max.resize(index + 1, 0.0);
            }
            self.force_max[index] = self.force_max[index].max(tool.force.length());
        }
        self.engine_seconds += report.timings.total;
    }

    fn add_line(&mut self, report: &FrameReport, cell_width: f64, mass_error: f64) {
        let strongest = report.tools.iter().map(|t| t.force.length()).fold(0.0, f64::max);
        let pushed: u64 = report.tools.iter().map(|t| t.pushed_back).sum();
        let ms = |s: f64| s * 1e3;
        let t = &report.timings;
        // Writing to a String cannot fail.
        let _ = writeln!(
            self.metrics,
            "{},{:.6},{:.6e},{:.6e},{:.5},{:.5},{:.6e},{pushed},{},{},{:.3e},{:.4e},{:.4},{:.5},{:.3e},{:.3e},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3e},{:.3e},\"{}\"",
            report.plan_id,
            report.time,
            report.energies.kinetic,
            report.energies.elastic,
            report.volume_ratio.0,
            report.volume_ratio.1,
            strongest,
            report.steps,
            report.passes,
            report.residual,
            report.dt,
            report.density_scale,
            report.speed(cell_width),
            report.kinetic_ratio(),
            report.real_time_factor(),
            ms(t.total),
            ms(t.rebin),
            ms(t.grid),
            ms(t.particles),
            ms(t.report),
            report.balance_error(),
            mass_error,
            report.health
        );
    }

    /// What is wrong with the frames that were run, one line each.
    pub(crate) fn faults(&self) -> Vec<String> {
        if self.frames == 0 {
            return vec![];
        }
        let checks = [
            (self.ratio.0.is_finite() && self.ratio.1.is_finite(), "a volume ratio is not finite".to_string()),
            (!self.health.contains(Health::STRAIN), Health::STRAIN.to_string()),
            (self.mass_error_max <= MASS_ERROR_MAX, format!("grid mass is off by {:.1e}", self.mass_error_max)),
            (self.balance_max <= BALANCE_ERROR_MAX, format!("momentum is off by {:.1e} of what moved", self.balance_max)),
        ];
        checks.into_iter().filter(|(holds, _)| !holds).map(|(_, fault)| fault).collect()
    }
}
