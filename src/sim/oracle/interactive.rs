//! Interactive particles (Deng et al.), to compare with: the tool's own mass and momentum at the nodes take
//! the clay along.
//!
//! Every tool is points, a blade one layer of them and a solid a lattice with half a cell between them, of
//! `rho_s dx^3 / 8` each, where it is at `t`, moving to where it is at `t + h`. In place of all
//! [`contact`](super::contact), all tools at once: `v = (p + P_tool) / (m + M_tool)` at nodes that are no
//! folded outer ones, p and m the clay's of folded sums after [gravity](super::walls). A tool gives
//! `P_tool - M_tool v`. Its points are not folded at walls. It is an inelastic impact with a part of the
//! tool, without a surface, friction or a way to let go.

use super::super::frame::FrameReport;
use super::grid::Grid;
use super::tools::Surroundings;
use glam::DVec3;

/// The tools take the clay along at the nodes that their particles reach, all at once.
pub(super) fn take_along(grid: &mut Grid, around: &Surroundings, frame: &mut FrameReport) {
    for (coordinate, node) in grid.coordinates().zip(&mut grid.nodes) {
        let of_tool = |tool: &super::tools::MovingTool| tool.sampled.as_ref().map_or((0.0, DVec3::ZERO), |s| s.mass(coordinate));
        let shares: Vec<(f64, DVec3)> = around.tools.iter().map(of_tool).collect();
        let (mass, momentum) = shares.iter().fold((0.0, DVec3::ZERO), |sum, s| (sum.0 + s.0, sum.1 + s.1));
        if node.is_outer || mass == 0.0 {
            continue;
        }
        let world = around.domain.to_world(coordinate.as_dvec3());
        for field in node.fields.iter_mut().filter(|field| field.sum.mass > 0.0) {
            field.velocity = (field.sum.mass * field.velocity + momentum) / (field.sum.mass + mass);
            for ((tool, felt), (mass, momentum)) in around.tools.iter().zip(&mut frame.tools).zip(&shares) {
                let impulse = *momentum - *mass * field.velocity;
                felt.impulse -= impulse;
                felt.angular_impulse -= (world - tool.motion.end.position).cross(impulse);
                felt.contacts += u64::from(*mass > 0.0);
                field.contact_impulse += impulse;
            }
        }
    }
}
