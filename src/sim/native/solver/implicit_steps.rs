//! The loop of implicit steps.

use super::super::super::coefficients::Coefficients;
use super::super::super::frame::FramePlan;
use super::super::super::implicit::RESIDUAL_LOST;
use super::super::averaging;
use super::super::contact::ToolNow;
use super::super::grid_step::GridStep;
use super::super::implicit;
use super::super::particle_step::ParticleStep;
use super::super::passes;
use super::super::state::Run;
use super::super::step::Step;
use super::{Failure, Solver, Tally};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Forces out of balance over what a cell's face bears in shear [-] beyond which a step that is
/// [lost](RESIDUAL_LOST) is taken back. Halves of a block cut through, of which one was pushed, had 8 to
/// 117 of it where they got a thousand times the elastic energy of explicit steps; 0.3 to 1.8 is left of
/// clay that a tool has left, and is met by more steps in the next frame.
const LOST_STRESS: f64 = 4.0;

/// What 1 Pa on a face of a cell gives that [cells/step^2].
fn per_stress(plan: &FramePlan, cell_width: f64, dt: f64) -> f64 {
    (dt / cell_width).powi(2) / plan.inertial_density()
}

impl Solver {
    /// The loop of implicit steps; ends with the first that is lost, unless steps `may_be_lost`.
    pub(super) fn attempt_implicit(
        &mut self,
        plan: &FramePlan,
        dt: f64,
        steps: u32,
        (passes, may_be_lost): (u32, bool),
        stop: &AtomicBool,
    ) -> Result<Tally, Failure> {
        let mut tally = Tally::default();
        let domain = self.domain;
        let coefficients = Coefficients::new(plan, &domain, dt);
        let (step, gravity, springs) = (Step::new(&coefficients, self.fma), coefficients.gravity, coefficients.contact);
        let (material, cutting) = (&plan.material, plan.cutting);
        #[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
        let averaging = if plan.averages() { plan.volume_averaging as f32 } else { 0.0 };
        let per_stress = per_stress(plan, domain.cell_width, dt);
        // What a cell's face bears in shear, as forces are counted: a full cell's mass is eight.
        let strength = 8.0 * material.shear_strength() * per_stress;
        // Of a cell that is sheared by a cell.
        let shear_acceleration = material.lame_mu() * per_stress;
        self.is_sorted &= !self.state.drop_plates(plan);
        self.state.begin_frame(&step);
        for s in 0..steps {
            if stop.load(Ordering::Relaxed) {
                return Err(Failure::Stopped);
            }
            let t = f64::from(s) * dt;
            let tools: Vec<ToolNow> =
                plan.tools.iter().map(|path| ToolNow::new(path, &domain, &plan.validation, t, t + dt)).collect();
            let tools = &tools;
            let particles =
                ParticleStep { step, domain: &domain, material, cutting, gravity, springs, clamps_walls: false, tools };
            self.take_sides(&particles, &mut tally);
            self.sort_by_middles(&mut tally);
            let began = Instant::now();
            let nodes = GridStep::new(&coefficients, plan, &domain, dt, s);
            let clay = (&mut self.state, &mut self.grid, &mut self.tiles);
            let ahead = std::mem::take(&mut tally.ahead);
            let report =
                implicit::step(&mut self.implicit, clay, (&particles, &nodes, &ahead), &mut self.arrivals, averaging, passes)
                    .map_err(Failure::Health)?;
            self.is_sorted = false;
            tally.timings.grid += report.seconds;
            tally.timings.particles += began.elapsed().as_secs_f64() - report.seconds;
            tally.add_grid(&report.grid);
            tally.clamped += report.clamped;
            tally.passes += report.passes;
            if !may_be_lost && report.residual > RESIDUAL_LOST && report.left > LOST_STRESS * strength {
                return Err(Failure::Lost { passes: tally.passes });
            }
            tally.rejected += report.rejected;
            tally.residual = tally.residual.max(report.residual);
            tally.way_left = tally.way_left.max(report.acceleration_left / shear_acceleration);
            tally.unbalanced += report.unbalanced;
            tally.node_mass = report.mass;
        }
        // By the nodes of the last step, whose blocks the next sort lists anew.
        self.settle_sides(&step, plan, &mut tally);
        self.sort(&mut tally);
        if plan.averages() {
            averaging::average_volumes(&mut self.state, plan.volume_averaging);
        }
        self.settle(plan, dt, &mut tally);
        self.state.end_frame(&step);
        Ok(tally)
    }

    /// Gives the particles near blades and plates their sides; then they have to be sorted again.
    fn take_sides(&mut self, s: &ParticleStep<'_>, tally: &mut Tally) {
        if !s.tools.iter().any(|tool| tool.blade.is_some()) && !self.state.runs.iter().any(Run::is_beside_plate) {
            return;
        }
        self.sort(tally);
        self.is_sorted = false;
        let near = self.near_blades(s, s.tools);
        tally.add_tags(&passes::tag(s, &mut self.state, true, &|i| near[i]));
    }

    /// Sorts by where the particles' stencils stand in the implicit step that begins.
    fn sort_by_middles(&mut self, tally: &mut Tally) {
        self.state.step_ahead(0.5);
        self.is_sorted = false;
        self.sort(tally);
        self.state.step_ahead(-0.5);
    }
}
