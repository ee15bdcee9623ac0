//! The implicit step: backward Euler as the least of one potential. The oracle's
//! [`implicit`](super::super::oracle) has the method, to the last sign.
//!
//! | file        | does                                                                   |
//! |-------------|------------------------------------------------------------------------|
//! | `begin`     | the nodes that a step starts from, and which move together             |
//! | `eights`    | particles as the evaluations see them, and what they start from        |
//! | `tile`      | nodes about a block, gathered from and scattered to                    |
//! | `kernel`    | particles of one class of a block, eight at a time                     |
//! | `slope`     | the same over all blocks                                               |
//! | `contact`   | tools and separating walls on particles                                |
//! | `layout`    | slots of nodes, and ties between nodes                                 |
//! | `vectors`   | vectors on the nodes                                                   |
//! | `multigrid` | the preconditioner                                                     |
//! | `pairs`     | the sides of kept cuts, which do not go through each other             |
//! | `search`    | what L-BFGS keeps                                                      |
//! | `minimise`  | L-BFGS about it                                                        |
//!
//! In cells, steps and eighths of a full cell's mass, so that forces are impulses of the step.

mod begin;
mod contact;
mod eights;
mod kernel;
mod layout;
mod minimise;
mod multigrid;
mod pairs;
mod search;
mod slope;
mod tile;
mod vectors;

use super::super::ahead::ClayAhead;
use super::super::health::Health;
use super::super::implicit::{CONTACT_SHARE, DRAGGING_MASS, Work, Working, is_about};
use super::super::params::BLOCK;
use super::grid::{Grid, Tiles};
use super::grid_step::{GridReport, GridStep};
use super::particle_step::ParticleStep;
use super::state::State;
use super::walls::Arrivals;
use eights::Class;
use glam::DVec3;
use kernel::Purpose;
use multigrid::{Finest, Multigrid};
use pairs::Pairs;
use search::Search;
use slope::Pass;
use std::time::Instant;
use tile::Rows;
use vectors::{Block3, Vector, dot, dot_of, for_each, for_each_pair, sum_over};

/// Greatest way of a particle in a step \[cells\]: its stencil stands half of it away from its cell. Nodes may
/// go further: about a ball of 4 cells that sticks, those with a hundredth of a cell's mass went 1.5 cells in
/// steps of 0.22, with 60 passes, and particles as far as the ball.
const WAY_MAX: f32 = 1.5;

/// Buffers that are kept from step to step.
#[derive(Default)]
pub(super) struct Implicit {
    multigrid: Multigrid,
    classes: Vec<Class>,
    /// The displacements node by node.
    rows: Vec<Rows>,
    slopes: [Slope; 2],
    search: Search,
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
    /// Forces out of balance.
    pub(super) left: f64,
    /// What they would give the nodes [cells/step^2], in the mean of squares.
    pub(super) acceleration_left: f64,
    /// Particles clamped.
    pub(super) clamped: u64,
    /// Mass of the nodes.
    pub(super) mass: f64,
    /// What the preconditioner and L-BFGS took \[s\].
    pub(super) seconds: f64,
}

/// Forces at the nodes at a place.
#[derive(Clone, Debug, Default)]
struct Slope {
    /// Of the unknowns, 0 where nothing is free.
    residual: Vector,
    /// Of stress and contact at each node of each slot.
    forces: Vector,
}

/// The potential of a step and where the iterations are.
struct System<'a> {
    state: &'a mut State,
    classes: &'a mut Vec<Class>,
    rows: &'a mut Vec<Rows>,
    multigrid: &'a mut Multigrid,
    pass: Pass<'a, 'a>,
    gravity: DVec3,
    idle: f64,
    nodes: begin::Nodes,
    sides: Pairs,
    u: Vector,
    /// Of the last evaluation.
    slope: &'a mut Slope,
    /// Of the last step that was taken.
    accepted: &'a mut Slope,
    search: &'a mut Search,
    /// The forces that R is judged by, where the last evaluation to [judge](Purpose::Judge) was.
    scale: f64,
    /// What the preconditioner and L-BFGS took \[s\].
    seconds: f64,
}

/// One step of the particles, which are sorted and have taken their sides.
pub(super) fn step(
    kept: &mut Implicit,
    (state, grid, tiles): (&mut State, &mut Grid, &mut Tiles),
    (particles, nodes, ahead): (&ParticleStep<'_>, &GridStep, &ClayAhead),
    arrivals: &mut Arrivals,
    averaging: f32,
    passes: u32,
) -> Result<StepReport, Health> {
    arrivals.clear();
    let Implicit { multigrid, classes, rows, slopes, search } = kept;
    let near = slope::found((particles, ahead), state, tiles, classes, arrivals);
    let modulus = 2.0 * f64::from(particles.step.law.lambda + particles.step.law.mu2);
    let mut begun = begin::Begun::new(state, grid, tiles, nodes, &particles.meeting(arrivals), modulus);
    let sources = slope::find_sources(&begun.layout, &begun.class_slots, classes);
    begun.find_held_up(classes);
    let u = begun.nodes.guess(nodes.gravity);
    let pass = Pass { s: particles, averaging, layout: &begun.layout, near, sources };
    let [slope, accepted] = slopes;
    let (gravity, idle, nodes, sides) = (nodes.gravity, nodes.idle, begun.nodes, begun.sides);
    let mut system = System {
        state,
        classes,
        rows,
        multigrid,
        pass,
        gravity,
        idle,
        nodes,
        sides,
        u,
        slope,
        accepted,
        search,
        scale: f64::INFINITY,
        seconds: 0.0,
    };
    let least = system.minimise(passes)?;
    let mut report = system.end()?;
    (report.passes, report.rejected, report.seconds) = (least.passes, least.rejected, system.seconds);
    Ok(report)
}

impl System<'_> {
    /// The slope at u; in the first evaluation, and anew, also the preconditioner, by the contacts there, in
    /// the last that is planned what R is judged by. False if a cell is turned inside out.
    fn evaluate(&mut self, purpose: Purpose) -> bool {
        self.set_rows();
        let (pass, layout) = (&self.pass, self.pass.layout);
        let is_sound = pass.slope(self.state, self.classes, self.rows, purpose);
        let Slope { residual, forces } = &mut *self.slope;
        residual.resize(layout.slots.len(), Block3::ZERO);
        forces.resize(layout.slots.len(), Block3::ZERO);
        let (nodes, u, classes) = (&self.nodes, &self.u, &*self.classes);
        for_each_pair(forces, residual, |slot, forces, residual| {
            if pass.sources[slot] == [0; 27] {
                (*forces, *residual) = (Block3::ZERO, Block3::ZERO);
                return;
            }
            pass.sum(slot, classes, |class| Some(&class.forces), forces);
            *residual = *forces;
            if !layout.is_linked[slot] {
                nodes.subtract_from_inertia(slot, &u[slot], residual);
            }
        });
        layout.fold(residual);
        for (slot, residual) in residual.iter_mut().enumerate().filter(|(slot, _)| layout.is_linked[*slot]) {
            nodes.subtract_from_inertia(slot, &u[slot], residual);
        }
        match purpose {
            Purpose::Begin | Purpose::Anew => self.precondition(),
            Purpose::Search => {}
            Purpose::Judge => self.scale = self.find_scale()[0],
        }
        is_sound
    }

    /// The displacements node by node, where others follow them too.
    fn set_rows(&mut self) {
        self.pass.layout.expand(&mut self.u);
        self.rows.resize(self.u.len(), Rows::ZERO);
        let u = &self.u;
        for_each(self.rows, |slot, rows| rows.set(&u[slot]));
    }

    /// What contact brought last: in the first evaluation its stiffness, later its forces.
    fn contact(&self, part: usize) -> Vector {
        let mut contact = vec![Block3::ZERO; self.pass.layout.slots.len()];
        for_each(&mut contact, |slot, contact| {
            self.pass.sum(slot, self.classes, |class| class.contact.as_deref().map(|contact| &contact[part]), contact);
        });
        contact
    }

    fn precondition(&mut self) {
        let began = Instant::now();
        let layout = self.pass.layout;
        let [mut extra, mut cross] = [0, 1].map(|part| self.contact(part));
        layout.fold_diagonal(&mut extra);
        layout.fold_cross(&mut cross);
        for cross in &mut cross {
            cross.flat_mut().iter_mut().for_each(|cross| *cross *= CONTACT_SHARE as f32);
        }
        for_each(&mut extra, |slot, extra| {
            for component in &mut extra.0 {
                for k in 0..64 {
                    component[k] = CONTACT_SHARE as f32 * component[k] + self.nodes.mass[slot][k];
                }
            }
        });
        let law = &self.pass.s.step.law;
        self.multigrid.set_up(&Finest {
            layout,
            fill: &self.nodes.fill,
            diagonal: &self.nodes.diagonal,
            extra: &extra,
            cross: &cross,
            live: &self.nodes.live,
            mu: law.mu2,
            lambda: 2.0 * law.lambda,
        });
        self.seconds += began.elapsed().as_secs_f64();
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
        std::mem::swap(self.slope, self.accepted);
    }

    /// The particles one step on, and what came of it.
    fn end(&mut self) -> Result<StepReport, Health> {
        if let Some(searched) = self.searched() {
            self.accepted.residual = searched;
        }
        let residual = dot(&self.accepted.residual, &self.accepted.residual);
        if !residual.is_finite() {
            return Err(Health::NON_FINITE);
        }
        self.set_rows();
        let mut report = StepReport::default();
        self.book(&mut report);
        let (clamped, way, mut felt) = self.pass.end(self.state, self.classes, self.rows);
        if way > WAY_MAX {
            return Err(Health::SPEED);
        }
        report.unbalanced += self.balance_work(&mut felt);
        report.left = residual.sqrt();
        let [scale, mass] = self.find_scale();
        report.residual = report.left / scale.max(f64::MIN_POSITIVE);
        report.acceleration_left = report.left / mass.max(f64::MIN_POSITIVE);
        report.grid.tools = vec![Default::default(); felt.tools.len()];
        report.grid.add(&felt);
        report.clamped = clamped;
        Ok(report)
    }

    /// Gives each tool what it is owed for the work of what is left out of balance about it: blocks belong to
    /// the tool that is nearest. Returns the impulse that clay did not get of the tools.
    fn balance_work(&self, felt: &mut GridReport) -> DVec3 {
        let tools = self.pass.s.tools;
        if felt.tools.iter().all(|tool| tool.2 == 0) {
            return DVec3::ZERO;
        }
        let came = self.nodes.guess(self.gravity);
        let mut works: Vec<Work> = felt.given.iter().map(|given| Work { given: *given, ..Work::default() }).collect();
        for (slot, (residual, u)) in self.accepted.residual.iter().zip(&self.u).enumerate() {
            let centre = (self.pass.layout.slots[slot].block * BLOCK).as_dvec3() + 0.5 * f64::from(BLOCK);
            let near = tools.iter().enumerate().filter(|(index, _)| felt.tools[*index].2 > 0).filter_map(|(index, tool)| {
                let distance = tool.shape.distance(tool.motion.end.to_local(centre));
                is_about(distance, tool.shape.bounding_radius()).then_some((distance, index))
            });
            if let Some((_, index)) = near.min_by(|a, b| a.0.total_cmp(&b.0)) {
                let work = &mut works[index];
                work.left += dot_of(residual, u);
                work.left_as_it_came += dot_of(residual, &came[slot]);
            }
        }
        let mut all = DVec3::ZERO;
        for ((tool, felt), work) in tools.iter().zip(&mut felt.tools).zip(works) {
            let working = Working { motion: &tool.motion, impulse: felt.0, angular_impulse: felt.1 };
            let [impulse, angular_impulse] = working.owed(work, 1.0);
            (felt.0, felt.1) = (felt.0 + impulse, felt.1 + angular_impulse);
            all += impulse;
        }
        all
    }

    /// The forces that R is judged by, inertia and contact together, or weight, or what clay at rest may
    /// bear; and the mass of what is free, in the same norm.
    fn find_scale(&self) -> [f64; 2] {
        let nodes = &self.nodes;
        let mut outer = self.contact(0);
        self.pass.layout.fold(&mut outer);
        let [all, weights, masses] = sum_over(outer.len(), |i| {
            let (mut all, mut weights, mut masses) = (0.0, 0.0, 0.0);
            for d in 0..3 {
                for k in 0..64 {
                    let inertia = nodes.mass[i][k] * (self.u[i].0[d][k] - nodes.velocity[i].0[d][k]);
                    all += f64::from(nodes.free[i].0[d][k] * (inertia - outer[i].0[d][k])).powi(2);
                    let mass = f64::from(nodes.free[i].0[d][k] * nodes.mass[i][k]);
                    weights += (mass * self.gravity[d]).powi(2);
                    masses += mass.powi(2);
                }
            }
            [all, weights, masses]
        });
        [all.max(weights).max(masses * self.idle.powi(2) / 3.0).sqrt(), masses.sqrt()]
    }

    /// What the nodes got of walls, and of nobody.
    fn book(&self, report: &mut StepReport) {
        let mut each = vec![Booked::default(); self.nodes.own.len()];
        for_each(&mut each, |slot, booked| *booked = self.booked(slot));
        for booked in each {
            report.mass += booked.mass;
            report.unbalanced += booked.unbalanced;
            report.grid.add(&booked.grid);
        }
    }

    /// What the nodes of a slot got.
    fn booked(&self, slot: usize) -> Booked {
        let nodes = &self.nodes;
        let mut booked = Booked::default();
        for (k, own) in nodes.own[slot].iter().enumerate() {
            let mass = f64::from(own[3]);
            booked.mass += mass;
            if mass == 0.0 {
                continue;
            }
            let vector = |v: &Vector| DVec3::new(v[slot].0[0][k].into(), v[slot].0[1][k].into(), v[slot].0[2][k].into());
            let momentum = DVec3::new(own[0].into(), own[1].into(), own[2].into());
            let way = vector(&self.u);
            let left = mass * (way - self.gravity) - momentum - vector(&self.accepted.forces);
            if nodes.is_at_wall[slot] >> k & 1 == 1 {
                booked.grid.push_by_wall(left);
            } else {
                booked.unbalanced += left;
            }
            // What is light drags no particle along.
            if f64::from(nodes.mass[slot][k]) > 8.0 * DRAGGING_MASS {
                #[expect(clippy::cast_possible_truncation, reason = "speeds are f32")]
                let speed = way.length() as f32;
                booked.grid.speed_max = booked.grid.speed_max.max(speed);
            }
        }
        booked
    }
}

/// What the nodes of a slot got in a step.
#[derive(Clone, Debug, Default)]
struct Booked {
    mass: f64,
    grid: GridReport,
    /// Of nobody.
    unbalanced: DVec3,
}
