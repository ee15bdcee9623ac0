//! Interactive particles (Deng et al.), to compare with: the tool's own mass and momentum at the nodes take the clay along.
//!
//! `v_i = (p_i + P_tool) / (m_i + M_tool)`: an inelastic impact with a part of the tool, without a surface, friction or a way to let go. The tool's particles have the
//! clay's inertial density, their places of the substep's start, and know no walls. What the clay gains is what the tool gave.

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
