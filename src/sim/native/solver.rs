//! One frame on the CPU. [`Solver::attempt`] is the substep loop, top to bottom; `implicit_steps` has that of
//! implicit steps, `rest` what becomes of clay that takes none,
//! `tally` what a frame adds up.

mod implicit_steps;
mod rest;
mod tally;

use super::super::coefficients::Coefficients;
use super::super::cutting::CuttingMethod;
use super::super::frame::{FramePlan, FrameReport, ToolReport};
use super::super::health::Health;
use super::super::integrator::Integrator;
use super::super::limits::{REDO_MAX, TRAVEL_LIMIT};
use super::super::material::ClayMaterial;
use super::super::params::Domain;
use super::super::snapshot::Particle;
use super::super::sums::{ParticleSums, judge};
use super::super::support::{Support, bearing_walls};
use super::super::weld::WeldRule;
use super::averaging;
use super::carry;
use super::contact::{Moment, ToolNow, samples};
use super::ghost;
use super::grid::{Grid, Tiles};
use super::grid_step::{GridReport, GridStep};
use super::implicit::Implicit;
use super::particle_step::ParticleStep;
use super::passes;
use super::simd;
use super::state::{Cold, Hot, MARGIN, State, unpack_cell};
use super::stats::{self, sums};
use super::step::Step;
use super::tags::Tagged;
use super::touch::touches;
use super::walls::Arrivals;
use super::weld;
use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use tally::Tally;

/// The clay at the end of a frame: what `surface` and `save` read, and what a failed frame goes back to.
#[derive(Debug)]
pub(super) struct FrameState {
    pub hot: Vec<Hot>,
    pub cold: Vec<Cold>,
    pub time: f64,
    /// Of the plan that led here.
    pub material: ClayMaterial,
}

/// The native engine's clay and grids.
pub(super) struct Solver {
    domain: Domain,
    time: f64,
    state: State,
    tiles: Tiles,
    grid: Grid,
    /// Of the last scatter.
    arrivals: Arrivals,
    /// Bound on how far any particle has strayed from its cell since the last sort \[cells\].
    travel: f32,
    /// Whether nothing has happened to the particles since the last sort.
    is_sorted: bool,
    sums: ParticleSums,
    quarantined: Vec<u32>,
    start: Arc<FrameState>,
    fma: bool,
    implicit: Implicit,
}

/// What came of a frame.
struct Outcome {
    tally: Tally,
    sums: ParticleSums,
    health: Health,
    /// Halvings of the step.
    redone: u32,
    /// Substep used \[s\].
    dt: f64,
    /// Substeps run.
    steps: u32,
    began: Instant,
}

/// Why an attempt at a frame ended early.
enum Failure {
    Health(Health),
    /// A step is no answer after so many passes over the frame.
    Lost {
        passes: u32,
    },
    Stopped,
}

impl Solver {
    /// A solver for particles that are finite and inside the domain's room.
    pub(super) fn new(domain: Domain, material: ClayMaterial, time: f64, particles: &[Particle], quarantined: Vec<u32>) -> Self {
        let state = State::new(&domain, particles);
        let tiles = Tiles::new(state.table.clone());
        let sums = sums(&domain, &state.hot, &state.cold);
        let start = Arc::new(FrameState { hot: state.hot.clone(), cold: state.cold.clone(), time, material });
        let (grid, arrivals, fma) = (Grid::default(), Arrivals::new(&domain), simd::has_fma());
        Self {
            domain,
            time,
            state,
            tiles,
            grid,
            arrivals,
            travel: 0.0,
            is_sorted: true,
            sums,
            quarantined,
            start,
            fma,
            implicit: Implicit::default(),
        }
    }

    /// The clay at the end of the last frame.
    pub(super) fn frame_state(&self) -> Arc<FrameState> {
        self.start.clone()
    }

    /// Runs a frame; redone with half the step where that can help, given up with the clay as it was where
    /// not. Returns nothing if `stop` was set.
    pub(super) fn run(&mut self, plan: &FramePlan, stop: &AtomicBool) -> Option<FrameReport> {
        let began = Instant::now();
        if self.rests(plan) {
            let outcome = self.rest(plan, began);
            return Some(self.report(plan, outcome));
        }
        let (mut health, mut passes_lost) = (Health::OK, 0);
        for redone in 0..=REDO_MAX {
            let (dt, steps) = (plan.dt / f64::from(1u32 << redone), plan.steps << redone);
            let tried = match plan.integrator {
                Integrator::Explicit { .. } => self.attempt(plan, dt, steps, stop),
                Integrator::Implicit { passes } => self.attempt_implicit(plan, dt, steps, (passes, redone == REDO_MAX), stop),
            };
            match tried {
                Ok(mut tally) => {
                    tally.passes += passes_lost;
                    let sums = sums(&self.domain, &self.state.hot, &self.state.cold);
                    if sums.is_finite() {
                        if plan.finds_bodies {
                            self.state.find_bodies(plan.dividers());
                            // The classes of the blocks follow.
                            self.resort();
                        }
                        return Some(self.report(plan, Outcome { tally, sums, health, redone, dt, steps, began }));
                    }
                    health.insert(Health::NON_FINITE);
                    self.restore();
                }
                Err(Failure::Stopped) => return None,
                Err(Failure::Lost { passes }) => {
                    passes_lost += passes;
                    self.restore();
                }
                Err(Failure::Health(h)) => {
                    health.insert(h);
                    self.restore();
                }
            }
        }
        health.insert(Health::GIVEN_UP);
        let outcome = Outcome { health, redone: REDO_MAX, ..self.nothing(plan, began) };
        Some(self.report(plan, outcome))
    }

    /// Gives a frame up without trying.
    pub(super) fn give_up(&mut self, plan: &FramePlan) -> FrameReport {
        let outcome = Outcome { health: Health::GIVEN_UP, ..self.nothing(plan, Instant::now()) };
        self.report(plan, outcome)
    }

    /// What comes of no substep.
    fn nothing(&self, plan: &FramePlan, began: Instant) -> Outcome {
        let (tally, sums) = (Tally::default(), self.sums.clone());
        Outcome { tally, sums, health: Health::OK, redone: 0, dt: plan.dt, steps: 0, began }
    }

    /// The substep loop.
    fn attempt(&mut self, plan: &FramePlan, dt: f64, steps: u32, stop: &AtomicBool) -> Result<Tally, Failure> {
        let mut tally = Tally::default();
        let domain = self.domain;
        let samples = samples(plan, &domain);
        let tools_at = |s: u32| -> Vec<ToolNow> {
            let t = f64::from(s) * dt;
            let now = |path| ToolNow::new(path, &domain, &plan.validation, t, t + dt);
            if plan.cutting.keeps_cuts() {
                return plan.tools.iter().map(now).collect();
            }
            plan.tools.iter().zip(&samples).map(|(path, samples)| now(path).sampled(plan.cutting, samples)).collect()
        };
        let coefficients = Coefficients::new(plan, &domain, dt);
        let (step, gravity, springs) = (Step::new(&coefficients, self.fma), coefficients.gravity, coefficients.contact);
        let (material, cutting, clamps_walls) = (&plan.material, plan.cutting, plan.validation.clamped_walls);
        let mut tools = tools_at(0);
        let averaging = |s: u32| plan.averages_before(s).then_some(plan.volume_averaging);
        let first = ParticleStep { step, domain: &domain, material, cutting, gravity, springs, clamps_walls, tools: &tools };
        self.is_sorted &= !self.state.drop_plates(plan);
        self.state.begin_frame(&step);
        self.begin(&first, None, &mut tally);
        let mut speed = 0.0;
        for s in 0..steps {
            if stop.load(Ordering::Relaxed) {
                return Err(Failure::Stopped);
            }
            if self.travel + 1.5 * speed > MARGIN {
                self.sort(&mut tally);
            }
            let particles =
                ParticleStep { step, domain: &domain, material, cutting, gravity, springs, clamps_walls, tools: &tools };
            let report = self.update_grid(&GridStep::new(&coefficients, plan, &domain, dt, s), &particles, &mut tally)?;
            speed = report.speed_max;
            tally.add_grid(&report);
            if s + 1 < steps {
                let next = tools_at(s + 1);
                self.advance(&particles, &next, averaging(s + 1), speed, &mut tally);
                tools = next;
            } else {
                self.end(&particles, speed, &mut tally);
                self.settle_sides(&step, plan, &mut tally);
                if plan.averages() {
                    self.sort(&mut tally);
                    averaging::average_volumes(&mut self.state, plan.volume_averaging);
                }
                self.state.end_frame(&step);
            }
        }
        Ok(tally)
    }

    /// First half of a substep from the stored velocities: a sort, averaging of volumes within a plastic
    /// strain, if one is given, tags and scatter. Sums run in the order of the sort: a frame that begins with
    /// one has the same bits whether its clay was loaded or was there.
    fn begin(&mut self, s: &ParticleStep<'_>, averaging: Option<f64>, tally: &mut Tally) {
        self.sort(tally);
        if let Some(strain) = averaging {
            averaging::average_volumes(&mut self.state, strain);
        }
        self.is_sorted = false;
        // The methods that keep no cuts clear what is left of any.
        let near = if s.cutting.keeps_cuts() { self.near_blades(s, s.tools) } else { vec![true; self.state.runs.len()] };
        let moved = tally.add_tags(&passes::tag(s, &mut self.state, false, &|i| near[i]));
        self.travel += moved;
        if self.travel > MARGIN {
            self.sort(tally);
        }
        self.scatter(s, s.tools, Moment::Start, &|_| true, tally);
    }

    /// Node sums and update; sorts the particles first if the speed found would carry one off its tile.
    fn update_grid(&mut self, step: &GridStep, particles: &ParticleStep<'_>, tally: &mut Tally) -> Result<GridReport, Failure> {
        let began = Instant::now();
        let mut report = self.grid.update(&self.state, &self.tiles, step, &particles.meeting(&self.arrivals));
        if report.speed_max.is_nan() {
            return Err(Failure::Health(Health::NON_FINITE));
        }
        let ghost_speed = self.ghost_speed(particles);
        report.speed_max = report.speed_max.max(ghost_speed);
        if report.speed_max > TRAVEL_LIMIT {
            return Err(Failure::Health(Health::SPEED));
        }
        if self.travel + report.speed_max > MARGIN {
            self.sort(tally);
            report = self.grid.update(&self.state, &self.tiles, step, &particles.meeting(&self.arrivals));
            report.speed_max = report.speed_max.max(ghost_speed);
        }
        tally.timings.grid += began.elapsed().as_secs_f64();
        Ok(report)
    }

    /// Gather of this substep and scatter of the next, fused but for the blocks near a blade, whose particles
    /// take sides in between. Not fused at all where volumes are averaged in between.
    fn advance(&mut self, s: &ParticleStep<'_>, next: &[ToolNow], averaging: Option<f64>, speed: f32, tally: &mut Tally) {
        let began = Instant::now();
        self.travel += speed;
        self.is_sorted = false;
        if averaging.is_some() {
            tally.add_gathered(&passes::gather(s, &mut self.state, &self.grid, &|_| true, None));
            self.begin(&ParticleStep { tools: next, ..*s }, averaging, tally);
            tally.timings.particles += began.elapsed().as_secs_f64();
            return;
        }
        let near = self.near_blades(s, next);
        if near.iter().any(|n| *n) {
            self.travel += tally.add_gathered(&passes::gather(s, &mut self.state, &self.grid, &|i| near[i], Some(next)));
        }
        if self.travel > MARGIN {
            // A particle was put back further than its tile reaches.
            tally.add_gathered(&passes::gather(s, &mut self.state, &self.grid, &|i| !near[i], None));
            self.sort(tally);
            self.scatter(s, next, Moment::End, &|_| true, tally);
        } else {
            self.scatter(s, next, Moment::End, &|i| near[i], tally);
        }
        tally.timings.particles += began.elapsed().as_secs_f64();
    }

    /// Scatters every block under `tools`, see [`passes::scatter`].
    fn scatter(
        &mut self,
        s: &ParticleStep<'_>,
        tools: &[ToolNow],
        stored_at: Moment,
        is_gathered: &(dyn Fn(usize) -> bool + Sync),
        tally: &mut Tally,
    ) {
        self.arrivals.clear();
        let ahead = std::mem::take(&mut tally.ahead);
        let presses = s.presses(tools, &ahead, &self.arrivals);
        let (clamped, felt) = passes::scatter(s, &mut self.state, &self.grid, &mut self.tiles, &presses, stored_at, is_gathered);
        tally.clamped += clamped;
        tally.add_grid(&felt);
    }

    /// Gather of the last substep: velocities are stored.
    fn end(&mut self, s: &ParticleStep<'_>, speed: f32, tally: &mut Tally) {
        let began = Instant::now();
        self.travel += speed;
        self.is_sorted = false;
        tally.add_gathered(&passes::gather(s, &mut self.state, &self.grid, &|_| true, None));
        tally.timings.particles += began.elapsed().as_secs_f64();
    }

    /// Lets the sides of cuts that are pressed on each other grow together, and carries on those that stay.
    fn settle_sides(&mut self, step: &Step, plan: &FramePlan, tally: &mut Tally) {
        if let Some(rule) = WeldRule::of(plan, self.time) {
            tally.welded = weld::grow_together(&mut self.state, &self.grid, step, plan, rule);
        }
        tally.carried = carry::carry_on(&mut self.state, &self.grid, plan);
        if tally.welded != [0; 2] || tally.carried > 0 {
            self.sort(tally);
        }
    }

    /// A bound on the velocities of ghosts [cells/substep].
    #[expect(clippy::cast_possible_truncation, reason = "speeds are f32")]
    fn ghost_speed(&self, s: &ParticleStep<'_>) -> f32 {
        if s.cutting.has_ghosts() { ghost::speed_bound(&self.state, s.tools, s.gravity) as f32 } else { 0.0 }
    }

    /// The blocks near a blade of `tools`, whose particles may take a side, and those with clay beside a
    /// plate, which loses it where the plate has gone, however far.
    fn near_blades(&self, s: &ParticleStep<'_>, tools: &[ToolNow]) -> Vec<bool> {
        let reach = if s.cutting.has_ghosts() { ghost::REACH } else { 0.0 };
        let has_sides = match s.cutting {
            CuttingMethod::TwoFields | CuttingMethod::Published | CuttingMethod::RigidParticles => true,
            CuttingMethod::InteractiveParticles => false,
        };
        let is_near = |b: &IVec3| {
            has_sides && tools.iter().any(|t| t.blade.is_some_and(|blade| t.is_near_block_by(*b, blade.band().max(reach))))
        };
        self.state.blocks.iter().zip(&self.state.runs).map(|(block, run)| is_near(block) || run.is_beside_plate()).collect()
    }

    fn sort(&mut self, tally: &mut Tally) {
        if self.is_sorted {
            return;
        }
        let began = Instant::now();
        self.resort();
        tally.timings.rebin += began.elapsed().as_secs_f64();
    }

    fn restore(&mut self) {
        self.state.hot.clone_from(&self.start.hot);
        self.state.cold.clone_from(&self.start.cold);
        self.resort();
    }

    fn resort(&mut self) {
        let old = self.state.sort();
        self.state.recycle(old);
        self.travel = 0.0;
        self.is_sorted = true;
    }

    /// Whether some clay hangs together with none that a wall bears.
    fn has_loose_clay(&self, plan: &FramePlan) -> bool {
        let bearing = bearing_walls(&self.domain.walls, plan.gravity);
        let chunks = self.state.hot.par_chunks(stats::CHUNK).zip(self.state.cold.par_chunks(stats::CHUNK));
        let parts = chunks.map(|(hot, cold)| {
            let mut support = Support::default();
            for (hot, cold) in hot.iter().zip(cold) {
                let offset = Vec3::from_array(hot.offset).floor().as_ivec3();
                support.add(IVec3::from_array(unpack_cell(hot.cell)) + offset, cold.walls & bearing != 0);
            }
            support
        });
        let mut support = Support::default();
        parts.collect::<Vec<_>>().into_iter().for_each(|part| support.add_all(part));
        support.has_loose()
    }

    /// Ends the frame: statistics, the published state, the report.
    fn report(&mut self, plan: &FramePlan, outcome: Outcome) -> FrameReport {
        let Outcome { tally, sums, health, redone, dt, steps, began } = outcome;
        let ended = Instant::now();
        self.time += dt * f64::from(steps);
        let before = std::mem::replace(&mut self.sums, sums);
        // Where no substep ran the clay stands as before the frame, and is of what it was.
        if steps > 0 {
            self.publish(plan, tally.is_unchanged);
        }
        let density = plan.inertial_density();
        let node_mass = density * self.domain.cell_width.powi(3) / 8.0;
        let unit = node_mass * self.domain.cell_width / dt;
        let mut report = FrameReport { plan_id: plan.id, redone, dt, steps, time: self.time, ..FrameReport::default() };
        self.sums.write(&mut report, plan);
        report.momentum_before = before.momentum * density;
        report.grid_mass = match plan.integrator {
            _ if steps == 0 => report.particle_mass,
            Integrator::Implicit { .. } if tally.passes == 0 => report.particle_mass,
            Integrator::Explicit { .. } => self.grid.mass() * node_mass,
            Integrator::Implicit { .. } => tally.node_mass * node_mass,
        };
        report.gravity_impulse = plan.gravity * plan.material.density * self.sums.volume * dt * f64::from(steps);
        report.gravity_impulse += tally.grid.body_impulse * unit;
        report.wall_impulse = tally.grid.wall_impulse * unit;
        report.damping_impulse = tally.grid.damping_impulse * unit;
        report.impulse_scale = tally.grid.impulse_scale * unit;
        report.speed_max = f64::from(tally.speed_max);
        report.clamped = tally.clamped;
        (report.welded, report.joined, report.carried) = (tally.welded.iter().sum(), tally.welded[1], tally.carried);
        report.passes = tally.passes;
        (report.rejected, report.residual, report.is_standing) = (tally.rejected, tally.residual, tally.is_standing);
        report.unbalanced_impulse = tally.unbalanced * unit;
        report.sheets = self.state.sheets();
        report.body_max = self.state.body_max();
        report.has_loose_clay = (plan.outputs.support && steps > 0).then(|| self.has_loose_clay(plan));
        report.tools = tool_reports(plan, &tally, unit, self.domain.cell_width, dt * f64::from(steps));
        if plan.outputs.touch && steps > 0 {
            // Its steps may be shorter than was planned.
            let ran = FramePlan { dt, steps, ..plan.clone() };
            report.touches = touches(&ran, &self.domain, &self.state, &report.tools);
        }
        report.health = health;
        judge(&mut report, &self.quarantined);
        report.timings = tally.timings;
        report.timings.report = ended.elapsed().as_secs_f64();
        report.timings.total = began.elapsed().as_secs_f64();
        report
    }
}

fn tool_reports(plan: &FramePlan, tally: &Tally, unit: f64, cell_width: f64, duration: f64) -> Vec<ToolReport> {
    let per_time = if duration > 0.0 { 1.0 / duration } else { 0.0 };
    let report = |(i, path): (usize, &super::super::tool::ToolPath)| {
        let (impulse, angular, contacts) = tally.grid.tools.get(i).copied().unwrap_or((DVec3::ZERO, DVec3::ZERO, 0));
        let Tagged { taken: tagged, displaced, pushed_back, depth_max } = tally.tags.get(i).copied().unwrap_or_default();
        let (impulse, angular_impulse) = (impulse * unit, angular * unit * cell_width);
        let (force, torque) = (impulse * per_time, angular_impulse * per_time);
        ToolReport { id: path.id, impulse, angular_impulse, force, torque, contacts, tagged, displaced, pushed_back, depth_max }
    };
    plan.tools.iter().enumerate().map(report).collect()
}
