//! What the particle passes need of a substep: its numbers, and the tools about each particle.

use super::super::ahead::ClayAhead;
use super::super::coefficients::ContactCoefficients;
use super::super::cutting::CuttingMethod;
use super::super::material::{ClayMaterial, SOFTENING_REACH};
use super::super::params::{BLOCK, Domain};
use super::contact::{Moment, ToolNow};
use super::kernel::Place;
use super::meeting::Meeting;
use super::penalty::Presses;
use super::step::Step;
use super::walls::Arrivals;
use glam::{DVec3, IVec3};

/// What the particle passes need of a substep.
pub(super) struct ParticleStep<'a> {
    pub step: Step,
    pub domain: &'a Domain,
    pub material: &'a ClayMaterial,
    /// How tools act on the clay.
    pub cutting: CuttingMethod,
    /// Gravity over inertia scaling [cells/substep^2].
    pub gravity: DVec3,
    /// Of contact with solid tools.
    pub springs: ContactCoefficients,
    /// Whether walls clamp their nodes, in validation cases.
    pub clamps_walls: bool,
    /// Tools at the substep that the gather ends.
    pub tools: &'a [ToolNow],
}

impl ParticleStep<'_> {
    /// How `tools`, whose edges have that ahead, and walls press in a substep of these numbers.
    pub(super) fn presses<'a>(&'a self, tools: &'a [ToolNow], ahead: &'a ClayAhead, arrivals: &'a Arrivals) -> Presses<'a> {
        let arrivals = (!self.clamps_walls).then_some(arrivals);
        Presses { tools, cutting: self.cutting, springs: self.springs, domain: self.domain, arrivals, ahead }
    }

    /// What bounds the clay at the nodes of the substep, where clay has arrived so.
    pub(super) fn meeting<'a>(&'a self, arrivals: &'a Arrivals) -> Meeting<'a> {
        Meeting { domain: self.domain, tools: self.tools, cutting: self.cutting, arrivals }
    }

    /// Distance \[m\] from a grid coordinate to the nearest tool.
    fn tool_distance(&self, x: [f64; 3], at: Moment) -> f64 {
        let x = DVec3::from_array(x);
        let distance = |t: &ToolNow| t.shape.distance(t.pose(at).to_local(x)).abs();
        self.tools.iter().map(distance).fold(f64::INFINITY, f64::min) * self.domain.cell_width
    }

    /// The yield norm of fresh clay at a grid coordinate: Eq. 5 with the nearest tool.
    #[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
    fn softened(&self, x: [f64; 3], at: Moment) -> f32 {
        let dx = self.domain.cell_width;
        let ratio = self.material.yield_stress_at(self.tool_distance(x, at), dx) / self.material.yield_stress;
        (f64::from(self.step.yield_norm) * ratio) as f32
    }

    /// Whether a tool softens clay in the block: beyond 12 softening lengths zeta is below 1e-5.
    pub(super) fn softens(&self, block: IVec3) -> bool {
        let centre = (block * BLOCK).as_dvec3() + f64::from(BLOCK) / 2.0;
        let length = self.material.softening_length_or_default(self.domain.cell_width) / self.domain.cell_width;
        // Half the diagonal of a block with a particle's margin about it is less than 5 cells.
        let reach = 12.0 * length + SOFTENING_REACH + 5.0;
        self.material.softening > 0.0
            && self.step.yield_norm.is_finite()
            && self.tools.iter().any(|t| t.shape.distance(t.motion.end.to_local(centre)) < reach)
    }

    fn room(&self, block: IVec3) -> Option<([f32; 3], [f32; 3])> {
        let (low, high) = self.domain.wall_nodes();
        let is_at_wall = (low / BLOCK).cmpeq(block).any() || (high / BLOCK).cmpeq(block).any();
        let relative = |w: IVec3| (w - block * BLOCK).as_vec3().to_array();
        is_at_wall.then(|| (relative(low), relative(high)))
    }

    /// Calls `kernel` with the block's place; the tools stand as they do at `at`.
    #[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
    pub(super) fn at<R>(&self, block: IVec3, at: Moment, kernel: impl FnOnce(&Place<'_>) -> R) -> R {
        let softened = |x| self.softened(x, at);
        let factor = |x| self.material.stress_factor_at(self.tool_distance(x, at), self.domain.cell_width) as f32;
        kernel(&Place {
            origin: (block * BLOCK).to_array(),
            room: self.room(block),
            softening: if self.softens(block) { Some(&softened) } else { None },
            stress_factor: if self.material.law.is_as_published() { Some(&factor) } else { None },
        })
    }
}
