//! The grid update of a block where walls, tools or the two sides of a cut meet. In f64, one node after the
//! other.
//!
//! The order is that of the substep's definition: fold, sides, velocity, two sides, walls.

mod block;
mod bounds;
mod classes;
mod compared;
mod faces;
mod parting;
mod sides;
mod terms;
mod walls;

pub(super) use bounds::Meeting;
pub(super) use classes::find_masses;
pub(super) use faces::{Faces, find_faces, may_meet, shared};
pub(super) use parting::Parting;
pub(super) use terms::Scratch;

use super::super::cutting::CuttingMethod;
use super::super::facing::{Between, Facing};
use super::super::params::BLOCK;
use super::super::tool::{self, CONTACT_OFFSET};
use super::contact::ToolNow;
use super::grid_step::{GridReport, GridStep};
use super::nodes::{CutBlock, Nodes, offset};
use block::Block;
use classes::{Classes, Sum};
use faces::{FacesAbout, FacesOf};
use glam::{DVec3, IVec3};
use parting::exchange;
use sides::is_incompatible;

/// Updates `nodes` (untagged, or all clay) and those of the tagged classes from sums to velocities; masses
/// stay as they were summed.
pub(super) fn update<'a>(
    nodes: &mut Nodes,
    cut: Option<&mut CutBlock>,
    block: IVec3,
    (step, meeting): (&GridStep, &Meeting<'_>),
    faces_of: &'a FacesOf<'a>,
) -> GridReport {
    let classes = Classes::new(nodes, cut.as_deref(), block, step, meeting);
    let mut b = Block::new(classes, block, (step, meeting), faces_of);
    for k in (0..64).filter(|k| !b.is_outer[*k]).collect::<Vec<_>>() {
        b.meet(k, block * BLOCK + offset(k), step, meeting);
    }
    b.unfold(block, step);
    b.book_withheld(block, meeting);
    b.store(nodes, cut);
    b.report
}

impl Block<'_> {
    /// One node: blades, then the fields that kept cuts divide.
    fn meet(&mut self, k: usize, node: IVec3, step: &GridStep, meeting: &Meeting<'_>) {
        match meeting.cutting {
            CuttingMethod::TwoFields => self.between_sides(k, node, step, meeting),
            CuttingMethod::Published | CuttingMethod::RigidParticles => {}
            CuttingMethod::InteractiveParticles => self.take_along(k, node, meeting),
        }
    }

    /// Blades, then the fields that kept cuts divide.
    fn between_sides(&mut self, k: usize, node: IVec3, step: &GridStep, meeting: &Meeting<'_>) {
        let (world, divisions, fields) = (node.as_dvec3(), self.divisions[k], self.fields[k]);
        for (index, tool) in meeting.tools.iter().enumerate().filter(|(_, t)| !t.is_solid()) {
            let Some(i) = divisions.of_blade(index) else { continue };
            let Some((distance, front)) = tool.blade.and_then(|blade| blade.within_band(world)) else { continue };
            // Each field is bounded by the blade where it reaches beyond it; a sticking blade takes it along.
            for &(place, f) in fields.as_slice() {
                let sign = f64::from(divisions.side(place.beyond, i));
                let (field, normal, distance) = (usize::from(f), front * sign, distance * sign);
                if tool.contact.sticks() {
                    let surface = tool.motion.velocity_at(world);
                    let after = tool::stick(
                        self.velocity[field][k],
                        surface,
                        normal,
                        distance,
                        step.adhesion.weakened(self.strength_lost(k, field)),
                    );
                    self.push(k, field, (index, tool), world, after);
                } else if distance <= CONTACT_OFFSET {
                    let after = tool.apply(self.velocity[field][k], world, normal);
                    self.push(k, field, (index, tool), world, after);
                }
            }
        }
        for b in 1..fields.as_slice().len() {
            for a in 0..b {
                let [from, to] = [a, b].map(|i| fields.as_slice()[i]);
                if let Some(facing) = divisions.pair_facing(from.0, to.0, |between| self.facing(k, between)) {
                    self.exchange(k, from.1.into(), to.1.into(), facing);
                }
            }
        }
    }

    /// What the clay of a field has lost of its strength at tools, in the mean [-].
    fn strength_lost(&self, k: usize, field: usize) -> f64 {
        let (mut mass, mut lost) = (0.0, 0.0);
        for (own, leader) in self.classes.own.iter().zip(&self.leader) {
            if usize::from(leader[k]) == field {
                (mass, lost) = (mass + own[k].mass, lost + own[k].lost);
            }
        }
        if mass > 0.0 { lost / mass } else { 0.0 }
    }

    /// How the sides of a kept cut, or two bodies, face each other at a node.
    fn facing(&mut self, k: usize, between: Between) -> Option<Facing> {
        let at = self.about.iter().position(|about| about.between == between).unwrap_or_else(|| {
            self.about.push(FacesAbout::new(between, self.faces_of, !0));
            self.about.len() - 1
        });
        self.about[at].mean(k)
    }

    /// A tool brings one field to the velocity `after`, and feels the opposite impulse.
    fn push(&mut self, k: usize, field: usize, (index, tool): (usize, &ToolNow), world: DVec3, after: DVec3) {
        let mass = self.field[field][k].mass;
        if mass <= 0.0 {
            return;
        }
        let before = self.velocity[field][k];
        let impulse = mass * (after - before);
        self.velocity[field][k] = after;
        self.pushed[k] += impulse;
        self.report.impulse_scale += impulse.length();
        let sum = &mut self.report.tools[index];
        sum.0 -= impulse;
        sum.1 -= (world - tool.motion.end.position).cross(impulse);
        sum.2 += u64::from(after != before);
    }

    /// Two fields exchange momentum, from a to b.
    fn exchange(&mut self, k: usize, a: usize, b: usize, facing: Facing) {
        let velocities = exchange([a, b].map(|f| (self.field[f][k].mass, self.velocity[f][k])), facing);
        [self.velocity[a][k], self.velocity[b][k]] = velocities;
    }

    /// Wall nodes stand still across the wall, outer nodes move as images, the last fold first; nodes of
    /// validation cases do as they are told. Books the walls' impulse, and that of whatever drives nodes.
    fn unfold(&mut self, block: IVec3, step: &GridStep) {
        let mut is_at_wall = [false; 64];
        for c in self.classes.folds.iter().rev() {
            self.leader.iter_mut().for_each(|leader| leader[c.outer] = leader[c.inner]);
            self.ghosts.iter_mut().for_each(|ghosts| ghosts[c.outer] = ghosts[c.inner]);
            for velocity in &mut self.velocity {
                velocity[c.outer] = c.reflect(velocity[c.inner]);
                velocity[c.wall] = 0.5 * (velocity[c.wall] + c.reflect(velocity[c.wall]));
            }
            [c.outer, c.wall, c.inner].into_iter().for_each(|k| is_at_wall[k] = true);
        }
        for c in &self.classes.clamps {
            for k in [c.outer, c.wall] {
                self.velocity.iter_mut().for_each(|velocity| velocity[k] = c.clamp(velocity[k]));
                is_at_wall[k] = true;
            }
        }
        for k in (0..64).filter(|k| self.classes.own.iter().any(|class| class[*k].mass > 0.0)) {
            if let Some(v) = step.imposed.and_then(|imposed| imposed.driven_velocity(block * BLOCK + offset(k))) {
                self.velocity.iter_mut().for_each(|velocity| velocity[k] = v);
                is_at_wall[k] = true;
            }
        }
        for k in (0..64).filter(|k| is_at_wall[*k]) {
            let mut impulse = -self.pushed[k];
            for (class, (own, leader)) in self.classes.own.iter().zip(&self.leader).enumerate() {
                if is_incompatible(&self.ghosts, class, k) {
                    continue;
                }
                let Sum { mass, momentum, .. } = own[k];
                let free = step.damping * (momentum + mass * self.gravity[k]);
                impulse += mass * self.velocity[usize::from(leader[k])][k] - free;
            }
            self.report.wall_impulse += impulse;
            self.report.impulse_scale += impulse.length();
        }
    }
}

/// How the clay of the classes of a block moves at its nodes.
pub(super) struct Ties {
    /// In which class's field that of each class moves: the first class of the field, 0 for untagged clay.
    pub leaders: Vec<[u8; 64]>,
    /// The columns that walls fold.
    pub folds: Vec<Fold>,
    /// The fields that kept cuts divide: a node, the first classes of both, and how the second faces
    /// the first.
    pub divided: Vec<(usize, [u8; 2], Facing)>,
}

/// The ties of a block.
pub(super) fn ties<'a>(
    nodes: &Nodes,
    cut: Option<&CutBlock>,
    block: IVec3,
    step: &GridStep,
    meeting: &Meeting<'_>,
    faces_of: &'a FacesOf<'a>,
) -> Ties {
    let classes = Classes::new(nodes, cut, block, step, meeting);
    let fold = |c: &walls::Column| Fold { outer: c.outer, wall: c.wall, inner: c.inner, image: c.reflect(DVec3::ONE) };
    let folds: Vec<Fold> = classes.folds.iter().map(fold).collect();
    let mut nodes = Block::new(classes, block, (step, meeting), faces_of);
    let mut divided = vec![];
    for k in (0..64).filter(|k| !nodes.is_outer[*k]).collect::<Vec<_>>() {
        let (divisions, fields) = (nodes.divisions[k], nodes.fields[k]);
        for b in 1..fields.as_slice().len() {
            for a in 0..b {
                let [from, to] = [a, b].map(|i| fields.as_slice()[i]);
                let facing = divisions.pair_facing(from.0, to.0, |between| nodes.facing(k, between));
                divided.extend(facing.map(|facing| (k, [from.1, to.1], facing)));
            }
        }
    }
    let mut leaders = nodes.leader;
    for fold in &folds {
        leaders.iter_mut().for_each(|leader: &mut [u8; 64]| leader[fold.outer] = leader[fold.inner]);
    }
    Ties { leaders, folds, divided }
}

/// A column of nodes that a wall folds, by their places in the block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fold {
    pub outer: usize,
    pub wall: usize,
    pub inner: usize,
    /// What becomes of each velocity component in the image: -1 or 1.
    pub image: DVec3,
}
