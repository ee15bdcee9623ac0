//! Clay that stands takes no steps.

use super::super::super::frame::FramePlan;
use super::super::super::implicit::{STANDING_LEFT, STANDING_TIME, STANDING_TRAVEL, STANDING_WAYS};
use super::super::super::integrator::Integrator;
use super::super::super::tool::ToolPath;
use super::super::super::weld::WeldRule;
use super::super::contact::ToolNow;
use super::{FrameState, Outcome, Solver, Tally};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;

impl Solver {
    /// Whether the frame finds clay that stands, with no tool near it, and may leave it so.
    pub(super) fn rests(&self, plan: &FramePlan) -> bool {
        let is_implicit = matches!(plan.integrator, Integrator::Implicit { .. });
        let is_still = || self.state.hot.par_iter().all(|hot| hot.velocity == [0.0; 3] && hot.affine == [[0.0; 3]; 3]);
        is_implicit && plan.may_rest && !plan.finds_bodies && !self.welds(plan) && !self.is_any_near(plan) && is_still()
    }

    /// Whether sides of cuts, or bodies, may grow together in the frame: their time counts while they are
    /// pressed.
    fn welds(&self, plan: &FramePlan) -> bool {
        WeldRule::of(plan, self.time).is_some() && self.state.may_meet()
    }

    /// Whether a tool comes near the clay's blocks in the frame.
    fn is_any_near(&self, plan: &FramePlan) -> bool {
        let ways = |path: &ToolPath| -> Vec<ToolNow> {
            let turns = path.samples.iter().map(|s| s.time).filter(|t| *t > 0.0 && *t < plan.duration());
            let times: Vec<f64> = std::iter::once(0.0).chain(turns).chain([plan.duration()]).collect();
            times.windows(2).map(|t| ToolNow::new(path, &self.domain, &plan.validation, t[0], t[1])).collect()
        };
        let tools: Vec<ToolNow> = plan.tools.iter().flat_map(ways).collect();
        self.state.blocks.iter().any(|block| tools.iter().any(|tool| tool.is_near_block(*block)))
    }

    /// Lets the frame's time pass: worked clay stiffens, walls go on bearing the weight.
    pub(super) fn rest(&mut self, plan: &FramePlan, began: Instant) -> Outcome {
        let mut outcome = Outcome { steps: plan.steps, ..self.nothing(plan, began) };
        outcome.tally.is_standing = true;
        let unit = plan.inertial_density() * self.domain.cell_width.powi(4) / 8.0 / plan.dt;
        outcome.tally.grid.wall_impulse = -plan.gravity * (plan.material.density * self.sums.volume * plan.duration() / unit);
        let kept = plan.material.structure_after(1.0, 0.0, plan.duration());
        let stiffens = kept < 1.0 && self.state.cold.iter().any(|cold| cold.structure != 0.0);
        if stiffens {
            #[expect(clippy::cast_possible_truncation, reason = "particles are f32")]
            self.state.cold.par_iter_mut().for_each(|cold| cold.structure *= kept as f32);
        }
        outcome.tally.is_unchanged = !stiffens;
        outcome
    }

    /// Whether the clay stands after implicit steps of `dt` \[s\]; then what little it moves is taken from it,
    /// and counts as force out of balance.
    pub(super) fn settle(&mut self, plan: &FramePlan, dt: f64, tally: &mut Tally) {
        let speed = |hot: &super::Hot| Vec3::from_array(hot.velocity).length();
        let most = STANDING_TRAVEL.max(STANDING_WAYS * tally.way_left) * dt / STANDING_TIME;
        tally.is_standing = tally.way_left < STANDING_LEFT
            && self.state.hot.par_iter().all(|hot| f64::from(speed(hot)) < most)
            && !self.is_any_near(plan);
        if !tally.is_standing {
            return;
        }
        let momentum = |hot: &super::Hot| DVec3::from_array(hot.velocity.map(f64::from)) * f64::from(hot.mass);
        tally.unbalanced -= self.state.hot.iter().map(momentum).sum::<DVec3>();
        self.state.hot.par_iter_mut().for_each(|hot| {
            hot.velocity = [0.0; 3];
            hot.affine = [[0.0; 3]; 3];
        });
    }

    /// Makes the clay as it is that of the frame's end; of one that is unchanged but for the time nothing is
    /// copied, unless somebody still looks at it.
    pub(super) fn publish(&mut self, plan: &FramePlan, is_unchanged: bool) {
        match Arc::get_mut(&mut self.start) {
            Some(start) if is_unchanged => (start.time, start.material) = (self.time, plan.material),
            _ => {
                let (hot, cold) = (self.state.hot.clone(), self.state.cold.clone());
                self.start = Arc::new(FrameState { hot, cold, time: self.time, material: plan.material });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::super::engine::Engine;
    use super::super::super::super::frame::FrameReport;
    use super::super::super::super::material::{ClayLaw, ClayMaterial, Preset};
    use super::super::super::super::params::{Domain, WALL_NODE, Wall, Walls};
    use super::super::super::super::planner::{Decision, IntegratorChoice, Planner, Policy};
    use super::super::super::super::snapshot::{Particle, Snapshot};
    use super::super::super::super::tool::{Contact, Pose, Tool, ToolPath, ToolShape};
    use super::super::super::NativeEngine;
    use glam::DVec3;

    const CELL: f64 = 0.004;
    const FRAME: f64 = 1.0 / 60.0;
    const REST_TIME: f64 = 2.0;

    /// Worked clay, 4 cells wide and 3 high, on a floor that it sticks to.
    fn clay() -> Snapshot {
        let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] };
        let domain = Domain::new(DVec3::ZERO, DVec3::splat(12.0 * CELL), CELL, walls).expect("a room");
        let law = ClayLaw::Worked { loss: 0.3, rate: 2.0, rest_time: REST_TIME };
        let material = ClayMaterial { law, ..Preset::SoftClay.material() };
        let particle = |i: u32| {
            let at = DVec3::new(f64::from(i % 8), f64::from(i / 8 % 6), f64::from(i / 64)) * 0.5 + DVec3::new(4.25, 0.25, 4.25);
            let clay = Particle::at(at + f64::from(WALL_NODE), (CELL.powi(3) / 8.0) as f32, i);
            Particle { structure: 0.5, ..clay }
        };
        Snapshot::new(domain, material, (0..8 * 64).filter(|i| i / 8 % 8 < 6).map(particle).collect())
    }

    /// Runs the next frame.
    fn run(engine: &mut NativeEngine, planner: &mut Planner, clay: &Snapshot, tools: &[ToolPath]) -> FrameReport {
        let Decision::Run(plan) = planner.frame(&clay.material, FRAME, tools) else { panic!("a frame is owed") };
        engine.submit(plan).expect("a sound plan");
        planner.sent();
        let mut report = engine.wait().expect("a report");
        planner.note(&mut report);
        report
    }

    /// Clay that has settled takes no steps: but for its time, and worked clay's stiffening, every bit stays,
    /// walls bear its weight, and it goes on where a tool comes near or gravity is another.
    #[test]
    fn settled_clay_rests() {
        let clay = clay();
        let mut engine = NativeEngine::new();
        engine.load(&clay).expect("sound clay");
        let mut planner = Planner::new(&clay);
        planner.policy = Policy { integrator: IntegratorChoice::Implicit, ..Policy::default() };
        let settled = (0..80).position(|_| run(&mut engine, &mut planner, &clay, &[]).is_resting());
        assert!(settled.is_some_and(|frames| frames > 2), "{settled:?}");
        let before = engine.save().expect("a state");
        for _ in 0..6 {
            let report = run(&mut engine, &mut planner, &clay, &[]);
            assert!(report.is_resting() && report.health.is_ok() && report.balance_error() < 1e-6, "{report:?}");
            assert!((report.wall_impulse.y - 9.81 * report.particle_mass * FRAME).abs() < 1e-9, "{report:?}");
        }
        let after = engine.save().expect("a state");
        assert!((after.time - before.time - 6.0 * FRAME).abs() < 1e-9);
        let kept = (-6.0 * FRAME / REST_TIME).exp();
        for (a, b) in before.particles.iter().zip(&after.particles) {
            assert!((f64::from(b.structure) / f64::from(a.structure) - kept).abs() < 1e-5, "{a:?} {b:?}");
            assert_eq!(Particle { structure: 0.0, ..*a }, Particle { structure: 0.0, ..*b });
        }

        let ball = Tool { shape: ToolShape::Sphere { radius: 2.0 * CELL }, contact: Contact::Slip };
        let at = |height: f64| Pose { position: DVec3::new(6.0, height, 6.0) * CELL, ..Pose::default() };
        let far = [ToolPath::still(1, ball, at(30.0))];
        assert!(run(&mut engine, &mut planner, &clay, &far).is_resting());
        let near = [ToolPath::still(1, ball, at(4.5))];
        let report = run(&mut engine, &mut planner, &clay, &near);
        assert!(!report.is_resting() && report.passes > 0 && report.tools[0].impulse.y > 0.0, "{report:?}");

        assert!((0..80).any(|_| run(&mut engine, &mut planner, &clay, &[]).is_resting()));
        planner.policy.gravity = DVec3::new(4.0, -9.0, 0.0);
        let report = run(&mut engine, &mut planner, &clay, &[]);
        assert!(!report.is_resting() && report.momentum.x > 0.0, "{report:?}");
    }

    /// So does clay that a ball was pressed into, though what the iterations leave sways it for good; with
    /// and without gravity, and without it clay that hangs in the room.
    #[test]
    fn pressed_and_hanging_clay_rests() {
        let mut hanging = clay();
        hanging.particles.iter_mut().for_each(|particle| particle.cell[1] += 4);
        let ball = Tool { shape: ToolShape::Sphere { radius: 2.0 * CELL }, contact: Contact::Slip };
        let weight = Policy::default().gravity;
        for (clay, gravity, presses) in [(hanging, DVec3::ZERO, false), (clay(), DVec3::ZERO, true), (clay(), weight, true)] {
            let mut engine = NativeEngine::new();
            engine.load(&clay).expect("sound clay");
            let mut planner = Planner::new(&clay);
            planner.policy.gravity = gravity;
            let mut run = |height: f64| {
                let position = DVec3::new(6.0, height, 6.0) * CELL;
                let tool = ToolPath::still(1, ball, Pose { position, ..Pose::default() });
                run(&mut engine, &mut planner, &clay, &[tool])
            };
            if presses {
                let force = (0..10).map(|frame| run(4.95 - 0.1 * f64::from(frame)).tools[0].force.y).fold(0.0, f64::max);
                assert!(force > 0.5, "{force} N");
            }
            let frames: Vec<FrameReport> = (0..60).map(|_| run(20.0)).collect();
            let residuals: Vec<f64> = frames.iter().map(|frame| frame.residual).collect();
            assert!(frames.iter().all(|frame| frame.is_resting() || frame.passes > 0), "{gravity}: explicit");
            assert!(frames.iter().any(FrameReport::is_resting), "{gravity} {presses}: {residuals:?}");
        }
    }
}
