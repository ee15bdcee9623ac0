//! The potential's slope, particle by particle; and how a step ends.
//!
//! With `x_s = x + h v / 2` the particle's stencil for the whole step, `r = x_i - x_s`,
//! `H = 4 / dx^2 sum w u_i r^T`, `G = I - H / 2` and `A = G^-1 (I + H / 2)` (Cayley: a turn of the nodes
//! strains nothing, however far), the particle's energy is `V W(A)`: what the [law](super::super::law) makes
//! of `b = A (I + E) A^T`, elastic energy and what flow takes, the least of both. Its slope is
//! `-f_i = V 4 / dx^2 w K r`, `K = G^-T tau (I + H / 2)^-T`. Contact acts at `x + u`, `u = sum w u_i`:
//! its force reaches the nodes by the same weights.
//!
//! `R_i = m_i (u_i - h v_i*) / h^2 - f_i`; what was not iterated away remains of it.
//!
//! At the step's end `x += u`, `v = u / h`, `C = H / h`, and the strain is what the law made of it.

use super::super::super::frame::{FrameReport, ToolReport};
use super::super::super::implicit::{
    CONTACT_SHARE, DETERMINANT_MIN, GUESS_FALL_MIN, GUESS_WAY_MAX, IDLE_GRAVITY, SHARED_WITHIN, Work, Working, is_about,
};
use super::super::grid::Grid;
use super::super::law;
use super::super::particle::Particle;
use super::super::stencil::stencil;
use super::super::tools::{Moment, Surroundings};
use super::contact;
use super::multigrid::Finest;
use super::pairs::Pairs;
use super::unknowns::Unknowns;
use glam::{DMat3, DVec3, IVec3};
use std::collections::{BTreeMap, BTreeSet};

/// Nodes of a block, whose work is one tool's.
const BLOCK: IVec3 = IVec3::splat(4);

/// A particle's place on the grid for the step.
#[derive(Clone, Debug)]
struct Station {
    /// `x_s` \[cells\].
    at: DVec3,
    /// Seat, weight, and arm \[m\].
    touches: Vec<(usize, f64, DVec3)>,
    /// Yield stress for the step \[Pa\].
    yield_stress: f64,
    /// How much of its volume ratio is its cell's within the step [-].
    share: f64,
}

/// What the step's potential is made of.
pub(super) struct System<'a> {
    around: &'a Surroundings<'a>,
    particles: &'a [Particle],
    stations: Vec<Station>,
    /// The particles of each cell and class.
    cells: Vec<Vec<usize>>,
    pub(super) unknowns: Unknowns,
    /// The sides of kept cuts, as the iterations find them.
    pub(super) pairs: Pairs,
}

/// The slope at a place.
#[derive(Clone, Debug)]
pub(super) struct Slope {
    /// R of each unknown \[N\], 0 where it is not free.
    pub(super) residual: Vec<DVec3>,
    /// Force of stress and contact at each seat \[N\].
    forces: Vec<DVec3>,
    /// What the contact forces, inertia and weight come to: the norm that R is judged by \[N\].
    pub(super) scale: f64,
    /// Whether no cell was turned inside out.
    pub(super) is_sound: bool,
}

/// The displacement of a particle and of its surroundings.
struct Motion {
    /// u \[m\].
    moved: DVec3,
    /// H [-].
    gradient: DMat3,
    /// A, or none where a cell is turned inside out.
    cayley: Option<DMat3>,
}

impl Slope {
    /// Forces out of balance over those that clay bears [-].
    pub(super) fn quality(&self) -> f64 {
        dot(&self.residual, &self.residual).sqrt() / self.scale.max(f64::MIN_POSITIVE)
    }
}

impl<'a> System<'a> {
    /// The potential of a step.
    pub(super) fn new(particles: &'a [Particle], grid: &Grid, unknowns: Unknowns, around: &'a Surroundings<'a>) -> Self {
        let cell_width = around.domain.cell_width;
        let station = |p: &Particle| {
            let at = middle(p, around);
            let seat = |touch: &super::super::stencil::Touch| {
                let seat = unknowns.seat(grid, grid.index(touch.node)?, p.key())?;
                Some((seat, touch.weight, touch.arm * cell_width))
            };
            let moving = Particle { position: at, ..*p };
            Station {
                at,
                touches: stencil(at).iter().filter_map(seat).collect(),
                yield_stress: around.yield_stress(&moving, Moment::End),
                share: 0.0,
            }
        };
        let stations: Vec<Station> = particles.iter().map(station).collect();
        let mut cells: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for (i, (particle, station)) in particles.iter().zip(&stations).enumerate() {
            cells.entry((station.at.floor().as_ivec3().to_array(), particle.key())).or_default().push(i);
        }
        let pairs = Pairs::new(grid, &unknowns, around);
        Self { around, particles, stations, cells: cells.into_values().collect(), unknowns, pairs }
    }

    /// Shares volumes within the step by the flow that the displacements `u` \[m\] would make.
    pub(super) fn share_volumes(&mut self, u: &[DVec3]) {
        for i in 0..self.particles.len() {
            let flow = self.motion(&self.stations[i], u).cayley.map(|cayley| self.law(i, cayley).plastic_strain);
            self.stations[i].share = self.share_of(flow.unwrap_or(0.0));
        }
    }

    /// How much of a particle's volume ratio is its cell's [-] where it flows by so much.
    fn share_of(&self, flow: f64) -> f64 {
        let plan = self.around.plan;
        if plan.averages() { -(-flow / plan.volume_averaging).exp_m1() } else { 0.0 }
    }

    /// What the law makes of a particle.
    fn law(&self, i: usize, cayley: DMat3) -> law::Advanced {
        let (plan, particle) = (self.around.plan, &self.particles[i]);
        let increment = cayley - DMat3::IDENTITY;
        law::advance(&plan.material, self.stations[i].yield_stress, plan.dt, particle.elastic_strain, increment)
    }

    /// By how much each particle's ln J changes with its cell, and its mean stress \[Pa\], where so much of
    /// it is the cell's.
    fn shared(&self, updates: &[law::Advanced], shares: impl Fn(usize) -> f64) -> Vec<(f64, f64)> {
        let material = &self.around.plan.material;
        let bulk = material.lame_lambda() + 2.0 / 3.0 * material.lame_mu();
        let mut shared = vec![(0.0, 0.0); updates.len()];
        for members in &self.cells {
            let weight = |&i: &usize| shares(i) * self.particles[i].rest_volume;
            let sum: f64 = members.iter().map(weight).sum();
            let log = |i: usize| law::log_volume_ratio(updates[i].elastic_strain);
            if sum == 0.0 {
                continue;
            }
            let mean = members.iter().map(|i| weight(i) * log(*i)).sum::<f64>() / sum;
            for &i in members {
                shared[i].0 = shares(i) * (mean - log(i));
            }
            let mean = members.iter().map(|&i| weight(&i) * (log(i) + shared[i].0)).sum::<f64>() / sum;
            for &i in members {
                let share = shares(i);
                shared[i].1 = bulk * ((1.0 - share) * (log(i) + shared[i].0) + share * mean - log(i));
            }
        }
        shared
    }

    /// Where the unknowns start: as the clay moves already, without what walls and contact will stop. What
    /// falls, and hangs together with nothing that is touched, falls on.
    pub(super) fn guess(&self) -> Vec<DVec3> {
        let (dt, cell_width) = (self.around.plan.dt, self.around.domain.cell_width);
        let held_up = self.held_up();
        let guess = |unknown: &super::unknowns::Unknown| {
            let weight = self.around.gravity_step(unknown.node);
            let own = unknown.velocity - weight;
            let is_held_up = held_up.contains(&unknown.node.to_array());
            let falls = !is_held_up && own.dot(weight) > GUESS_FALL_MIN * weight.length_squared();
            let way = (if falls { unknown.velocity } else { own }) * dt;
            let held = unknown.free.cmpne(DVec3::ZERO);
            let way = way.clamp_length_max(GUESS_WAY_MAX * cell_width);
            // Too light to be found, but moved along by its own; walls keep their 0.
            if held == glam::BVec3::FALSE { way } else { DVec3::select(held, way, DVec3::ZERO) }
        };
        self.unknowns.all.iter().map(guess).collect()
    }

    /// The nodes whose clay hangs together, from node to node, with that of a block in which a tool or a wall
    /// touches some.
    fn held_up(&self) -> BTreeSet<[i32; 3]> {
        let block = |node: IVec3| node.div_euclid(BLOCK);
        let with_clay: Vec<_> = self.unknowns.all.iter().filter(|unknown| unknown.mass > 0.0).collect();
        let is_touched = |p: &&Particle| contact::stiffness_still(p, self.around) != DMat3::ZERO;
        let touched = self.particles.iter().filter(is_touched).map(|p| block(p.position.floor().as_ivec3()).to_array());
        let at_walls = with_clay.iter().filter(|unknown| unknown.live.min_element() < 0.0);
        let touched: BTreeSet<[i32; 3]> = touched.chain(at_walls.map(|unknown| block(unknown.node).to_array())).collect();
        let mut apart: BTreeSet<[i32; 3]> = with_clay.iter().map(|unknown| unknown.node.to_array()).collect();
        let is_first = |node: &[i32; 3]| touched.contains(&block(IVec3::from_array(*node)).to_array());
        let mut reached: Vec<[i32; 3]> = apart.iter().copied().filter(is_first).collect();
        let mut held_up: BTreeSet<[i32; 3]> = reached.iter().copied().collect();
        apart.retain(|node| !held_up.contains(node));
        while let Some(from) = reached.pop() {
            for (axis, step) in (0..3).flat_map(|axis| [(axis, -1), (axis, 1)]) {
                let mut next = from;
                next[axis] += step;
                if apart.remove(&next) {
                    held_up.insert(next);
                    reached.push(next);
                }
            }
        }
        held_up
    }

    /// Twice the energy of the motion `way` \[m\] over the step \[J\].
    pub(super) fn inertia(&self, way: &[DVec3]) -> f64 {
        let twice = way.iter().zip(&self.unknowns.all).map(|(way, unknown)| unknown.mass * way.length_squared());
        twice.sum::<f64>() / self.around.plan.dt.powi(2)
    }

    fn motion(&self, station: &Station, u: &[DVec3]) -> Motion {
        let per_arm = 4.0 / self.around.domain.cell_width.powi(2);
        let (mut moved, mut gradient) = (DVec3::ZERO, DMat3::ZERO);
        for (seat, weight, arm) in &station.touches {
            let seat = self.unknowns.seats[*seat];
            let way = *weight * seat.image * u[seat.unknown];
            moved += way;
            gradient += DMat3::from_cols(way * arm.x, way * arm.y, way * arm.z) * per_arm;
        }
        let (forward, back) = (DMat3::IDENTITY + gradient * 0.5, DMat3::IDENTITY - gradient * 0.5);
        let is_sound = back.determinant() > DETERMINANT_MIN && forward.determinant() > DETERMINANT_MIN * back.determinant();
        Motion { moved, gradient, cayley: is_sound.then(|| back.inverse() * forward) }
    }

    /// The potential's slope at the displacements `u` \[m\].
    pub(super) fn slope(&self, u: &[DVec3]) -> Slope {
        let mut forces = vec![DVec3::ZERO; self.unknowns.seats.len()];
        let mut pressed = forces.clone();
        let motions: Vec<Motion> = self.stations.iter().map(|station| self.motion(station, u)).collect();
        let is_sound = motions.iter().all(|motion| motion.cayley.is_some());
        let cayley = |motion: &Motion| motion.cayley.unwrap_or(DMat3::IDENTITY);
        let updates: Vec<law::Advanced> = motions.iter().enumerate().map(|(i, motion)| self.law(i, cayley(motion))).collect();
        let shared = self.shared(&updates, |i| SHARED_WITHIN * self.stations[i].share);
        for (i, (particle, station)) in self.particles.iter().zip(&self.stations).enumerate() {
            let motion = &motions[i];
            let stress = updates[i].stress + DMat3::IDENTITY * shared[i].1;
            let half = motion.gradient * 0.5;
            let [back, forward] = [-1.0, 1.0].map(|sign| (DMat3::IDENTITY + half * sign).inverse().transpose());
            let moment = back * stress * forward * (particle.rest_volume * 4.0 / self.around.domain.cell_width.powi(2));
            let press = contact::press(particle, motion.moved, self.around);
            for (seat, weight, arm) in &station.touches {
                forces[*seat] += *weight * (press.force - moment * *arm);
                pressed[*seat] += *weight * press.force;
            }
        }
        self.collect(u, forces, &pressed, is_sound)
    }

    /// What becomes of each particle at the displacements `u` \[m\]: the law's update, the change of ln J by
    /// its cell, and its own displacement \[m\].
    #[cfg(test)]
    pub(super) fn after(&self, u: &[DVec3]) -> Vec<(law::Advanced, f64, DVec3)> {
        let motions: Vec<Motion> = self.stations.iter().map(|station| self.motion(station, u)).collect();
        let cayley = |motion: &Motion| motion.cayley.expect("no cell is turned inside out");
        let updates: Vec<law::Advanced> = motions.iter().enumerate().map(|(i, motion)| self.law(i, cayley(motion))).collect();
        let shared = self.shared(&updates, |i| SHARED_WITHIN * self.stations[i].share);
        motions.iter().zip(updates).zip(shared).map(|((motion, update), shared)| (update, shared.0, motion.moved)).collect()
    }

    /// R of the unknowns from the forces at the seats.
    fn collect(&self, u: &[DVec3], forces: Vec<DVec3>, pressed: &[DVec3], is_sound: bool) -> Slope {
        let dt = self.around.plan.dt;
        let inertia = |(unknown, u): (&super::unknowns::Unknown, &DVec3)| unknown.mass * (*u / dt - unknown.velocity) / dt;
        let mut residual: Vec<DVec3> = self.unknowns.all.iter().zip(u).map(inertia).collect();
        let mut outer = residual.clone();
        for ((seat, force), pressed) in self.unknowns.seats.iter().zip(&forces).zip(pressed) {
            residual[seat.unknown] -= seat.image * *force;
            outer[seat.unknown] -= seat.image * *pressed;
        }
        // Inertia, weight and contact together are what stress has to bear.
        let weight = |u: &super::unknowns::Unknown| u.mass * self.around.gravity_step(u.node) / dt;
        let weights: Vec<DVec3> = self.unknowns.masked(self.unknowns.all.iter().map(weight).collect());
        let idle = |u: &super::unknowns::Unknown| DVec3::splat(u.mass * IDLE_GRAVITY / 3f64.sqrt());
        let idle: Vec<DVec3> = self.unknowns.masked(self.unknowns.all.iter().map(idle).collect());
        let outer = self.unknowns.masked(outer);
        let scale = [outer, weights, idle].map(|forces| dot(&forces, &forces)).into_iter().fold(0.0, f64::max).sqrt();
        Slope { residual: self.unknowns.masked(residual), forces, scale, is_sound }
    }

    /// What the preconditioner is made of, with the contacts at the displacements `u`.
    pub(super) fn finest<'g>(&'g self, grid: &'g Grid, u: &[DVec3]) -> Finest<'g> {
        let (plan, cell_width) = (self.around.plan, self.around.domain.cell_width);
        let (mu, lambda) = (plan.material.lame_mu(), plan.material.lame_lambda());
        let (diagonal, springs) = self.diagonals(u);
        let extra = |(unknown, springs): (&super::unknowns::Unknown, &DMat3)| {
            DMat3::from_diagonal(DVec3::splat(unknown.mass / plan.dt.powi(2))) + *springs * CONTACT_SHARE
        };
        let extra = self.unknowns.all.iter().zip(&springs).map(extra).collect();
        let mut fill = BTreeMap::new();
        for (particle, station) in self.particles.iter().zip(&self.stations) {
            let first = (station.at - 0.5).floor();
            for c in 0..8 {
                let near = [0, 1, 2].map(|axis| c >> axis & 1 == 1);
                let share = |axis: usize| {
                    let beyond = station.at[axis] - 0.5 - first[axis];
                    if near[axis] { beyond } else { 1.0 - beyond }
                };
                let cell = (first.as_ivec3() + IVec3::from_array(near.map(i32::from))).to_array();
                let volume = particle.rest_volume / cell_width.powi(3);
                *fill.entry((cell, particle.key())).or_default() += volume * share(0) * share(1) * share(2);
            }
        }
        let unknowns = &self.unknowns;
        unknowns.fold_cells(&mut fill);
        Finest {
            places: unknowns.all.iter().map(|u| (u.node, u.key)).collect(),
            live: unknowns.all.iter().map(|u| u.live).collect(),
            outer: unknowns.outer(grid),
            find: Box::new(|node, key| unknowns.of_field(grid, grid.index(node)?, key)),
            fill,
            diagonal,
            extra,
            mu,
            lambda,
            cell_width,
        }
    }

    /// The splines' own diagonal, and the stiffness of contact with the displacements `u` [N/m].
    fn diagonals(&self, u: &[DVec3]) -> (Vec<DVec3>, Vec<DMat3>) {
        let (material, cell_width) = (&self.around.plan.material, self.around.domain.cell_width);
        let (mu, lambda) = (material.lame_mu(), material.lame_lambda());
        let mut splines = vec![DVec3::ZERO; self.unknowns.all.len()];
        let mut springs = vec![DMat3::ZERO; self.unknowns.all.len()];
        for (particle, station) in self.particles.iter().zip(&self.stations) {
            let mut stiffness = contact::press(particle, self.motion(station, u).moved, self.around).stiffness;
            if stiffness == DMat3::ZERO {
                // What motion as it was leads away from a tool may well meet it, as stiffly as where it
                // stands.
                stiffness = contact::stiffness_still(particle, self.around);
            }
            for (seat, weight, arm) in &station.touches {
                let seat = self.unknowns.seats[*seat];
                let arms = *arm * *arm;
                let own = DVec3::splat(mu * arms.element_sum()) + (lambda + mu) * arms;
                splines[seat.unknown] += particle.rest_volume * (4.0 * weight / cell_width.powi(2)).powi(2) * own;
                let image = DMat3::from_diagonal(seat.image);
                springs[seat.unknown] += image * stiffness * image * *weight;
            }
        }
        (splines, springs)
    }

    /// Ends the step at the displacements `u` \[m\]: the particles one step on; books it in the frame's report.
    pub(super) fn end(&self, u: &[DVec3], slope: &Slope, frame: &mut FrameReport) -> Vec<Particle> {
        let mut moved = self.particles.to_vec();
        let motions: Vec<Motion> = self.stations.iter().map(|station| self.motion(station, u)).collect();
        let increment = |motion: &Motion| motion.cayley.unwrap_or(DMat3::IDENTITY + motion.gradient);
        let updates: Vec<law::Advanced> = motions.iter().enumerate().map(|(i, motion)| self.law(i, increment(motion))).collect();
        let shared = self.shared(&updates, |i| self.share_of(updates[i].plastic_strain));
        let before = frame.tools.clone();
        let mut works = vec![Work::default(); before.len()];
        for (i, particle) in moved.iter_mut().enumerate() {
            let press = contact::press(particle, motions[i].moved, self.around);
            press.book_work(particle.velocity * self.around.plan.dt, &mut works);
            self.advance(particle, &motions[i], &updates[i], frame);
            particle.elastic_strain = law::dilated(particle.elastic_strain, shared[i].0);
            press.settle(particle, self.around);
            press.book(self.around.domain.to_world(particle.position), self.around, frame);
        }
        self.balance_work(u, slope, (&before, works), frame);
        self.book(u, slope, frame);
        moved
    }

    /// Gives each tool what it is owed for the work of what is left out of balance about it: blocks of nodes
    /// belong to the tool that is nearest. `before` is what the tools had felt before the step, `works` what
    /// they have given.
    fn balance_work(&self, u: &[DVec3], slope: &Slope, (before, mut works): (&[ToolReport], Vec<Work>), frame: &mut FrameReport) {
        let (domain, tools) = (self.around.domain, &self.around.tools);
        let is_touched = |index: usize| frame.tools[index].contacts > before[index].contacts;
        let came = self.guess();
        for (i, (unknown, u)) in self.unknowns.all.iter().zip(u).enumerate() {
            let centre = domain.to_world((unknown.node.div_euclid(BLOCK) * BLOCK).as_dvec3() + 0.5 * BLOCK.as_dvec3());
            let near = tools.iter().enumerate().filter(|(index, _)| is_touched(*index)).filter_map(|(index, tool)| {
                let distance = tool.distance(centre, Moment::End) / domain.cell_width;
                is_about(distance, tool.path.tool.shape.bounding_radius() / domain.cell_width).then_some((distance, index))
            });
            if let Some((_, index)) = near.min_by(|a, b| a.0.total_cmp(&b.0)) {
                works[index].left += slope.residual[i].dot(*u);
                works[index].left_as_it_came += slope.residual[i].dot(came[i]);
            }
        }
        for (index, (tool, felt)) in tools.iter().zip(&mut frame.tools).enumerate() {
            let impulse = felt.impulse - before[index].impulse;
            let angular_impulse = felt.angular_impulse - before[index].angular_impulse;
            let working = Working { motion: &tool.motion, impulse, angular_impulse };
            let [impulse, angular_impulse] = working.owed(works[index], domain.cell_width);
            felt.impulse += impulse;
            felt.angular_impulse += angular_impulse;
            frame.unbalanced_impulse += impulse;
        }
    }

    fn advance(&self, particle: &mut Particle, motion: &Motion, update: &law::Advanced, frame: &mut FrameReport) {
        let (plan, cell_width) = (self.around.plan, self.around.domain.cell_width);
        particle.way = motion.moved / cell_width;
        particle.position = self.around.in_room(particle.position + particle.way);
        particle.velocity = motion.moved / plan.dt;
        particle.affine = motion.gradient * (1.0 / plan.dt);
        particle.elastic_strain = update.elastic_strain;
        particle.hardening += update.plastic_strain;
        particle.flowed += update.plastic_strain;
        particle.structure = plan.material.structure_after(particle.structure, update.plastic_strain, plan.dt);
        frame.clamped += u64::from(update.is_clamped);
    }

    /// Books what the nodes got: of walls, of gravity, and of nobody, where R remains.
    fn book(&self, u: &[DVec3], slope: &Slope, frame: &mut FrameReport) {
        let dt = self.around.plan.dt;
        frame.grid_mass = self.unknowns.seats.iter().map(|seat| seat.mass).sum();
        for (seat, force) in self.unknowns.seats.iter().zip(&slope.forces) {
            let way = seat.image * u[seat.unknown];
            let left = seat.mass * way / dt - seat.momentum - *force * dt;
            if seat.is_at_wall {
                frame.wall_impulse += left;
                frame.impulse_scale += left.length();
            } else {
                frame.unbalanced_impulse += left;
            }
            frame.gravity_impulse += seat.mass * self.around.plan.gravity * dt / self.around.plan.density_scale();
            frame.speed_max = frame.speed_max.max(way.length() / self.around.domain.cell_width);
        }
    }
}

/// Where a particle's stencil stands for the step \[cells\].
pub(super) fn middle(particle: &Particle, around: &Surroundings) -> DVec3 {
    let half = 0.5 * around.plan.dt / around.domain.cell_width;
    around.in_room(particle.position + particle.velocity * half)
}

/// Scalar product.
pub(super) fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
