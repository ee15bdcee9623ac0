//! Tools as the grid meets them: in cells and substeps, at the pose of the substep's end.

use super::super::cutting::CuttingMethod;
use super::super::frame::FramePlan;
use super::super::params::{BLOCK, Domain};
use super::super::tool::{self, BAND, Blade, Contact, Motion, Pose, SPACING, Sample, Sampled, ToolPath, ToolShape};
use super::super::validation::Validation;
use glam::{DVec3, IVec3};
use std::sync::Arc;

/// One of the two ends of a substep.
#[derive(Clone, Copy, Debug)]
pub(super) enum Moment {
    Start,
    End,
}

/// One tool during one substep; lengths in cells, times in substeps.
#[derive(Clone, Debug)]
pub(super) struct ToolNow {
    pub id: u32,
    pub shape: ToolShape,
    pub contact: Contact,
    pub motion: Motion,
    /// What divides the clay: the tool, if it is a blade or a wire, or a plate's middle.
    pub blade: Option<Blade>,
    /// The tool as particles, under the methods of others that have such.
    pub sampled: Option<Arc<Sampled>>,
    /// The sheet that a blade or a plate cuts.
    pub sheet: u8,
}

impl ToolNow {
    pub(super) fn new(path: &ToolPath, domain: &Domain, validation: &Validation, start: f64, end: f64) -> Self {
        let in_cells = |p: Pose| Pose { position: domain.to_grid(p.position), ..p };
        let motion = path.motion(start, end);
        let motion = Motion { start: in_cells(motion.start), end: in_cells(motion.end), duration: 1.0 };
        let shape = validation.grown(path.tool.shape, end).scaled(1.0 / domain.cell_width);
        let blade = path.outline(shape).map(|outline| Blade::new(outline, motion, 1.0));
        Self { id: path.id, shape, contact: path.tool.contact, motion, blade, sampled: None, sheet: path.sheet_id() }
    }

    /// The same under `method`, with its points.
    pub(super) fn sampled(self, method: CuttingMethod, samples: &[Sample]) -> Self {
        // An eighth of a cell, of the clay's density, weighs 1.
        let sampled = Sampled::new(method, samples, &self.motion, 8.0 * SPACING.powi(3), |x| x);
        // The methods of others know no plates.
        let blade = self.blade.filter(|_| self.shape.is_blade());
        Self { sampled: sampled.map(Arc::new), blade, ..self }
    }

    /// Whether the tool presses on particles.
    pub(super) fn is_solid(&self) -> bool {
        !self.shape.is_blade()
    }

    /// Signed distance \[cells\] of a node from the blade and the unit normal of the blade's front, if the node
    /// is near it.
    pub(super) fn side(&self, node: IVec3) -> Option<(f64, DVec3)> {
        match &self.sampled {
            Some(sampled) => sampled.side(node),
            None => self.blade?.within_band(node.as_dvec3()),
        }
    }

    /// A bound on the speed of its points [cells/substep].
    pub(super) fn speed_max(&self) -> f64 {
        let [a, b] = [self.motion.start, self.motion.end];
        let turn = a.rotation.inverse() * b.rotation;
        a.position.distance(b.position) + 2.0 * turn.xyz().length().atan2(turn.w.abs()) * self.shape.bounding_radius()
    }

    /// Where the tool is then.
    pub(super) fn pose(&self, at: Moment) -> Pose {
        match at {
            Moment::Start => self.motion.start,
            Moment::End => self.motion.end,
        }
    }

    /// Whether the tool can touch nodes or particles of the block at `block`, with a particle's margin and a
    /// blade's band about it.
    pub(super) fn is_near_block(&self, block: IVec3) -> bool {
        self.is_near_block_by(block, self.blade.map_or(BAND, |blade| blade.band()))
    }

    /// The same with `band` \[cells\] in place of a blade's.
    pub(super) fn is_near_block_by(&self, block: IVec3, band: f64) -> bool {
        let half = f64::from(BLOCK) / 2.0;
        let centre = (block * BLOCK).as_dvec3() + half;
        // Half diagonal of the block with its margin and one node, and the band.
        let reach = (half + 1.0) * 3f64.sqrt() + band;
        // The tool may turn within a substep: its distance changes by less than the greater of both ends'
        // plus the travel of its rim.
        let [a, b] = [self.motion.start, self.motion.end].map(|p| self.shape.distance(p.to_local(centre)));
        let travel = self.motion.start.position.distance(self.motion.end.position);
        a.min(b) <= reach + travel
    }

    /// Velocity [cells/substep] after contact of clay that moves at `v` at `world` \[cells\], with the surface
    /// normal `n` towards the clay.
    pub(super) fn apply(&self, v: DVec3, world: DVec3, n: DVec3) -> DVec3 {
        let tool = self.motion.velocity_at(world);
        let relative = v - tool;
        let normal = relative.dot(n);
        match self.contact {
            Contact::Stick => tool,
            Contact::Slip => v - normal * n,
            Contact::Separate { .. } if normal >= 0.0 => v,
            Contact::Separate { friction } => {
                let slide = relative - normal * n;
                let speed = slide.length();
                let kept = if speed > 0.0 { (1.0 + friction * normal / speed).max(0.0) } else { 0.0 };
                tool + slide * kept
            }
        }
    }
}

/// The points of the tools of a plan, for the methods that have such.
pub(super) fn samples(plan: &FramePlan, domain: &Domain) -> Vec<Vec<Sample>> {
    let of = |path: &ToolPath| tool::samples(&path.tool.shape.scaled(1.0 / domain.cell_width), SPACING);
    if plan.cutting.keeps_cuts() { vec![] } else { plan.tools.iter().map(of).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tool(contact: Contact) -> ToolNow {
        let at = |x| Pose { position: DVec3::X * x, ..Pose::default() };
        let motion = Motion { start: at(0.0), end: at(0.1), duration: 1.0 };
        ToolNow { id: 1, shape: ToolShape::Sphere { radius: 2.0 }, contact, motion, blade: None, sampled: None, sheet: 1 }
    }

    /// A separating tool takes the approach away, brakes sliding by friction times that, and lets receding
    /// clay go.
    #[test]
    fn separating_contact_is_coulomb() {
        let t = tool(Contact::Separate { friction: 0.5 });
        let v = t.apply(DVec3::new(-0.1, 0.3, 0.0), DVec3::X * 2.0, DVec3::X);
        assert!((v - DVec3::new(0.1, 0.2, 0.0)).length() < 1e-15, "{v}");
        let free = DVec3::new(0.2, 0.3, 0.0);
        assert_eq!(t.apply(free, DVec3::X * 2.0, DVec3::X), free);
    }

    #[test]
    fn sticking_contact_moves_with_the_tool() {
        assert!((tool(Contact::Stick).apply(DVec3::Y, DVec3::X * 2.0, DVec3::X) - DVec3::X * 0.1).length() < 1e-15);
    }
}
