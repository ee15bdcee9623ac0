//! The nodes of a block that walls, tools or cuts meet: the fields of clay at each, and how they move.

use super::super::super::params::BLOCK;
use super::super::grid_step::{GridReport, GridStep};
use super::super::nodes::{CutBlock, Ghosts, Nodes, offset};
use super::bounds::Meeting;
use super::classes::{Classes, Sum};
use super::faces::{FacesAbout, FacesOf};
use super::sides::{Divisions, Fields, ghosts_of, is_incompatible};
use glam::{DVec3, IVec3};

/// The 64 nodes.
pub(super) struct Block<'a> {
    pub(super) classes: Classes,
    pub(super) divisions: [Divisions; 64],
    pub(super) fields: [Fields; 64],
    /// The first class of the field in which each class moves: fields stand in its place.
    pub(super) leader: Vec<[u8; 64]>,
    /// Folded sums of the fields.
    pub(super) field: Vec<[Sum; 64]>,
    pub(super) velocity: Vec<[DVec3; 64]>,
    /// Impulse of tools and of other fields on the node.
    pub(super) pushed: [DVec3; 64],
    pub(super) is_outer: [bool; 64],
    /// Where nodes are incompatible with each class, under the methods that know such; else none.
    pub(super) ghosts: Vec<Ghosts>,
    /// Gravity and other body forces at each node.
    pub(super) gravity: [DVec3; 64],
    /// How what divides one of its nodes in two was found to face each other about the block.
    pub(super) about: Vec<FacesAbout>,
    pub(super) faces_of: &'a FacesOf<'a>,
    pub(super) report: GridReport,
}

impl<'a> Block<'a> {
    /// Tells the sides apart and makes momentum velocity.
    pub(super) fn new(
        classes: Classes,
        block: IVec3,
        (step, meeting): (&GridStep, &Meeting<'_>),
        faces_of: &'a FacesOf<'a>,
    ) -> Self {
        let mut gravity = [step.gravity; 64];
        if step.imposed.is_some() {
            // A manufactured solution's body force is dear: none where there is no clay.
            let is_used = |k: usize| classes.own.iter().chain(&classes.folded).any(|class| class[k].mass != 0.0);
            gravity =
                std::array::from_fn(|k| if is_used(k) { step.acceleration_at(block * BLOCK + offset(k)) } else { DVec3::ZERO });
        }
        let (count, sheets) = (classes.keys.len(), classes.sheets(meeting.tools));
        let divisions = |k: usize| {
            let mass = |class: usize| classes.folded[class][k].mass;
            Divisions::new(block * BLOCK + offset(k), &classes.keys, &sheets, mass, meeting)
        };
        let divisions: [Divisions; 64] = std::array::from_fn(divisions);
        let mut fields = [Fields::default(); 64];
        let mut leader = vec![[0u8; 64]; count];
        let mut field = vec![[Sum::default(); 64]; count];
        let mut velocity = vec![[DVec3::ZERO; 64]; count];
        let ghosts = ghosts_of(&classes.keys, &divisions, block, meeting);
        for k in 0..64 {
            for c in 0..count {
                if is_incompatible(&ghosts, c, k) {
                    // In no field, and without a velocity.
                    leader[c][k] = c as u8;
                    continue;
                }
                leader[c][k] = fields[k].leader(divisions[k].place(classes.keys[c]), c as u8);
                let sum = &mut field[usize::from(leader[c][k])][k];
                *sum = sum.plus(classes.folded[c][k]);
            }
            for &(_, f) in fields[k].as_slice() {
                let sum = field[usize::from(f)][k];
                // A NaN mass must show.
                if sum.mass > 0.0 || sum.mass.is_nan() {
                    velocity[usize::from(f)][k] = (sum.momentum / sum.mass + gravity[k]) * step.damping;
                }
            }
        }
        let mut is_outer = [false; 64];
        classes.folds.iter().for_each(|c| is_outer[c.outer] = true);
        let mut report = GridReport::of_tools(meeting.tools.len());
        if step.damping != 1.0 || step.imposed.is_some() {
            let own = || (0..64).flat_map(|k| classes.own.iter().map(move |class| class[k]).zip(std::iter::repeat(gravity[k])));
            report.damping_impulse = own().map(|(s, g)| s.momentum + s.mass * g).sum::<DVec3>() * (step.damping - 1.0);
            report.body_impulse = own().map(|(s, g)| s.mass * (g - step.gravity)).sum();
        }
        let pushed = [DVec3::ZERO; 64];
        Self {
            classes,
            divisions,
            fields,
            leader,
            field,
            velocity,
            pushed,
            is_outer,
            ghosts,
            gravity,
            about: vec![],
            faces_of,
            report,
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
    pub(super) fn store(&mut self, nodes: &mut Nodes, mut cut: Option<&mut CutBlock>) {
        if let Some(cut) = &mut cut {
            cut.ghosts = self.ghosts.split_off(self.ghosts.len().min(1));
        }
        let tagged = cut.into_iter().flat_map(|cut| &mut cut.nodes);
        for (nodes, leader) in std::iter::once(nodes).chain(tagged).zip(&self.leader) {
            for k in 0..64 {
                let v = self.velocity[usize::from(leader[k])][k];
                let q = &mut nodes[k].0;
                // What the class came with is its own: no wall folds it, no field shares it.
                let inverse = if q[3] > 0.0 { 1.0 / q[3] } else { 0.0 };
                q[4..7].iter_mut().for_each(|before| *before *= inverse);
                q[..3].copy_from_slice(&v.as_vec3().to_array());
            }
        }
        let squares = || self.velocity.iter().flatten().map(|v| v.length_squared());
        let (greatest, all) = (squares().fold(0.0, f64::max), squares().sum::<f64>());
        self.report.speed_max = if all.is_finite() { greatest.sqrt() as f32 } else { f32::NAN };
    }
}
