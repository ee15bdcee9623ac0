//! The implicit step: backward Euler as the least of one potential. The oracle's
//! [`implicit`](super::super::oracle) has the method, to the last sign.
//!
//! | file        | does                                                                   |
//! |-------------|------------------------------------------------------------------------|
//! | `begin`     | the nodes that a step starts from, and which move together             |
//! | `kernel`    | particles of one class of a block, eight at a time                     |
//! | `slope`     | the same over all blocks                                               |
//! | `contact`   | solid tools and separating walls on particles                          |
//! | `layout`    | slots of nodes, and ties between nodes                                 |
//! | `vectors`   | vectors on the nodes                                                   |
//! | `multigrid` | the preconditioner                                                     |
//! | `minimise`  | L-BFGS about it                                                        |
//!
//! In cells, steps and eighths of a full cell's mass, so that forces are impulses of the step.

mod begin;
mod contact;
mod kernel;
mod layout;
mod minimise;
mod multigrid;
mod slope;
mod vectors;

use super::super::health::Health;
use super::super::implicit::CONTACT_SHARE;
use super::grid::{Grid, Tiles};
use super::grid_step::{GridReport, GridStep};
use super::particle_step::ParticleStep;
use super::state::State;
use super::walls::Arrivals;
use glam::DVec3;
use kernel::Seat;
use multigrid::{Finest, Multigrid};
use rayon::prelude::*;
use slope::Pass;
use vectors::{Block3, Vector, dot, for_each};

/// Greatest way of a node in a step \[cells\]: particles' stencils stand half of it away from their cells.
const WAY_MAX: f32 = 1.5;

/// Buffers that are kept from step to step.
#[derive(Default)]
pub(super) struct Implicit {
    multigrid: Multigrid,
    seats: Vec<Seat>,
}

/// What came of a step.
#[derive(Clone, Debug, Default)]
pub(super) struct StepReport {
    /// What tools and walls felt, and the greatest way of a node \[cells\].
    pub(super) grid: GridReport,
    /// Impulse of forces that are out of balance.
    pub(super) unbalanced: DVec3,
    /// Evaluations of the slope.
    pub(super) passes: u32,
    /// Steps cut.
    pub(super) rejected: u32,
    /// Forces out of balance over those that clay bears [-].
    pub(super) residual: f64,
    /// Particles clamped.
    pub(super) clamped: u64,
    /// Mass of the nodes.
    pub(super) mass: f64,
}

/// Forces at the nodes at a place.
#[derive(Clone, Debug, Default)]
struct Slope {
    /// Of the unknowns, 0 where nothing is free.
    residual: Vector,
    /// Of stress and contact at each node of each slot.
    forces: Vector,
    /// Of contact alone, of the first evaluation its stiffness.
    pressed: Vector,
}

/// The potential of a step and where the iterations are.
struct System<'a> {
    state: &'a mut State,
    tiles: &'a mut Tiles,
    seats: &'a mut Vec<Seat>,
    multigrid: &'a mut Multigrid,
    pass: Pass<'a, 'a>,
    gravity: DVec3,
    nodes: begin::Nodes,
    u: Vector,
    /// Of the last evaluation.
    slope: Slope,
    /// Of the last step that was taken.
    accepted: Slope,
}

/// One step of the particles, which are sorted and have taken their sides.
pub(super) fn step(
    kept: &mut Implicit,
    (state, grid, tiles): (&mut State, &mut Grid, &mut Tiles),
    (particles, nodes): (&ParticleStep<'_>, &GridStep),
    arrivals: &mut Arrivals,
    averaging: f32,
    passes: u32,
) -> Result<StepReport, Health> {
    arrivals.clear();
    slope::found(particles, state, tiles, arrivals);
    let begun = begin::Begun::new(state, grid, tiles, nodes, &particles.meeting(arrivals));
    slope::seats(particles, state, &mut kept.seats);
    let u = begun.nodes.guess(nodes.gravity);
    let pass = Pass { s: particles, averaging, layout: &begun.layout, tagged_slots: &begun.tagged_slots };
    let (seats, multigrid) = (&mut kept.seats, &mut kept.multigrid);
    let (slope, accepted) = (Slope::default(), Slope::default());
    let gravity = nodes.gravity;
    let mut system = System { state, tiles, seats, multigrid, pass, gravity, nodes: begun.nodes, u, slope, accepted };
    let least = system.minimise(passes)?;
    let mut report = system.end()?;
    (report.passes, report.rejected) = (least.passes, least.rejected);
    Ok(report)
}

impl System<'_> {
    /// The slope at u; in the first evaluation also the preconditioner, by the contacts there. False if a
    /// cell is turned inside out.
    fn evaluate(&mut self, is_first: bool) -> bool {
        let layout = self.pass.layout;
        layout.expand(&mut self.u);
        let is_sound = self.pass.slope(self.state, self.seats, &self.u, is_first, self.tiles);
        let tiles = &*self.tiles;
        let sums = (0..layout.slots.len()).into_par_iter().with_min_len(8).map(|slot| {
            let nodes = slope::nodes_of(layout, tiles, slot);
            let (mut forces, mut pressed) = (Block3::ZERO, Block3::ZERO);
            for (k, node) in nodes.iter().enumerate() {
                for d in 0..3 {
                    forces.0[d][k] = node.0[d];
                    pressed.0[d][k] = node.0[4 + d];
                }
            }
            (forces, pressed)
        });
        (self.slope.forces, self.slope.pressed) = sums.unzip();
        self.slope.residual.clone_from(&self.slope.forces);
        layout.fold(&mut self.slope.residual);
        let (nodes, u) = (&self.nodes, &self.u);
        for_each(&mut self.slope.residual, |i, r| {
            for d in 0..3 {
                for k in 0..64 {
                    let inertia = nodes.mass[i][k] * (u[i].0[d][k] - nodes.velocity[i].0[d][k]);
                    r.0[d][k] = nodes.free[i].0[d][k] * (inertia - r.0[d][k]);
                }
            }
        });
        if is_first {
            self.precondition();
        }
        is_sound
    }

    fn precondition(&mut self) {
        let layout = self.pass.layout;
        let mut extra = self.slope.pressed.clone();
        layout.fold_diagonal(&mut extra);
        for (extra, mass) in extra.iter_mut().zip(&self.nodes.mass) {
            for component in &mut extra.0 {
                for k in 0..64 {
                    component[k] = CONTACT_SHARE as f32 * component[k] + mass[k];
                }
            }
        }
        let law = &self.pass.s.step.law;
        self.multigrid.set_up(&Finest {
            layout,
            fill: &self.nodes.fill,
            diagonal: &self.nodes.diagonal,
            extra: &extra,
            free: &self.nodes.free,
            mu: law.mu2,
            lambda: 2.0 * law.lambda,
        });
    }

    /// Starts from clay that stands still where it is free to.
    fn hold_still(&mut self) {
        for (u, free) in self.u.iter_mut().zip(&self.nodes.free) {
            for d in 0..3 {
                for k in 0..64 {
                    u.0[d][k] *= 1.0 - free.0[d][k];
                }
            }
        }
    }

    fn accept(&mut self) {
        std::mem::swap(&mut self.slope, &mut self.accepted);
    }

    /// The particles one step on, and what came of it.
    fn end(&mut self) -> Result<StepReport, Health> {
        let residual = dot(&self.accepted.residual, &self.accepted.residual);
        if !residual.is_finite() {
            return Err(Health::NON_FINITE);
        }
        let layout = self.pass.layout;
        layout.expand(&mut self.u);
        let mut report = StepReport { residual: residual.sqrt() / self.scale().max(f64::MIN_POSITIVE), ..StepReport::default() };
        self.book(&mut report);
        if report.grid.speed_max > WAY_MAX {
            return Err(Health::SPEED);
        }
        let (clamped, felt) = self.pass.end(self.state, self.seats, &self.u);
        report.grid.tools = vec![Default::default(); felt.tools.len()];
        report.grid.add(&felt);
        report.clamped = clamped;
        Ok(report)
    }

    /// The forces that R is judged by: inertia and contact together, or weight.
    fn scale(&self) -> f64 {
        let nodes = &self.nodes;
        let mut outer = self.accepted.pressed.clone();
        self.pass.layout.fold(&mut outer);
        let (mut all, mut weights) = (0.0, 0.0);
        for (i, outer) in outer.iter().enumerate() {
            for d in 0..3 {
                for k in 0..64 {
                    let inertia = nodes.mass[i][k] * (self.u[i].0[d][k] - nodes.velocity[i].0[d][k]);
                    all += f64::from(nodes.free[i].0[d][k] * (inertia - outer.0[d][k])).powi(2);
                    weights += (f64::from(nodes.free[i].0[d][k] * nodes.mass[i][k]) * self.gravity[d]).powi(2);
                }
            }
        }
        all.max(weights).sqrt()
    }

    /// What the nodes got of walls, and of nobody.
    fn book(&self, report: &mut StepReport) {
        let nodes = &self.nodes;
        for (i, own) in nodes.own.iter().enumerate() {
            for (k, own) in own.iter().enumerate() {
                let mass = f64::from(own[3]);
                report.mass += mass;
                if mass == 0.0 {
                    continue;
                }
                let vector = |v: &Vector| DVec3::new(v[i].0[0][k].into(), v[i].0[1][k].into(), v[i].0[2][k].into());
                let momentum = DVec3::new(own[0].into(), own[1].into(), own[2].into());
                let way = vector(&self.u);
                let left = mass * (way - self.gravity) - momentum - vector(&self.accepted.forces);
                if nodes.is_at_wall[i] >> k & 1 == 1 {
                    report.grid.push_by_wall(left);
                } else {
                    report.unbalanced += left;
                }
                #[expect(clippy::cast_possible_truncation, reason = "speeds are f32")]
                let speed = way.length() as f32;
                report.grid.speed_max = report.grid.speed_max.max(speed);
            }
        }
    }
}
