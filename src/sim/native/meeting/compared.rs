//! What nodes do under the methods of others.

use super::super::super::params::BLOCK;
use super::super::contact::ToolNow;
use super::super::nodes::offset;
use super::block::Block;
use super::bounds::Meeting;
use glam::{DVec3, IVec3};

impl Block<'_> {
    /// Interactive particles: the mass of the tools takes the clay along, `v = (p + P_tool) / (m + M_tool)`.
    pub(super) fn take_along(&mut self, k: usize, node: IVec3, meeting: &Meeting<'_>) {
        let world = node.as_dvec3();
        let of_tool = |tool: &ToolNow| tool.sampled.as_ref().map_or((0.0, DVec3::ZERO), |s| s.mass(node));
        let shares: Vec<(f64, DVec3)> = meeting.tools.iter().map(of_tool).collect();
        let (mass, momentum) = shares.iter().fold((0.0, DVec3::ZERO), |sum, s| (sum.0 + s.0, sum.1 + s.1));
        for &(_, field) in self.fields[k].as_slice() {
            let (clay, velocity) = (self.field[usize::from(field)][k].mass, &mut self.velocity[usize::from(field)][k]);
            if mass == 0.0 || clay <= 0.0 {
                continue;
            }
            *velocity = (clay * *velocity + momentum) / (clay + mass);
            for ((index, tool), (mass, momentum)) in meeting.tools.iter().enumerate().zip(&shares) {
                let impulse = *momentum - *mass * *velocity;
                self.pushed[k] += impulse;
                self.report.give(index, tool, world, -impulse);
                self.report.tools[index].2 += u64::from(*mass > 0.0);
            }
        }
    }

    /// What a class brought to nodes that are incompatible with it goes to the tools.
    pub(super) fn book_withheld(&mut self, block: IVec3, meeting: &Meeting<'_>) {
        for (ghosts, own) in self.ghosts.iter().zip(&self.classes.own) {
            for (k, ghost) in ghosts.iter().enumerate() {
                let Some(ghost) = ghost.filter(|_| own[k].mass > 0.0) else { continue };
                let (index, world) = (usize::from(ghost.tool), (block * BLOCK + offset(k)).as_dvec3());
                self.report.give(index, &meeting.tools[index], world, own[k].momentum + own[k].mass * self.gravity[k]);
                self.report.tools[index].2 += 1;
            }
        }
    }
}
