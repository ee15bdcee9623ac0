//! Tags: which side of a cut a particle is on. Eq. 1, taken once, kept, and decided by the swept blade.
//!
//! A particle takes a blade's side where it comes near or is swept over, and keeps it when the blade leaves: the cut persists. A
//! particle that ends a substep on the wrong side of the blade it is tagged by is put back on the blade's surface.

use super::super::engine::FrameReport;
use super::super::snapshot::Tag;
use super::Particle;
use super::tools::Surroundings;

/// Where a particle is put back: this far from the blade's plane, on its own side [cells].
const PUT_BACK_DISTANCE: f64 = 1e-3;

/// Lets each blade of the plan, in order, tag the particles and put back those on the wrong side of it.
pub(super) fn take_sides(particles: &mut [Particle], around: &Surroundings, frame: &mut FrameReport) {
    for (tool, seen) in around.tools.iter().zip(&mut frame.tools) {
        let Some(blade) = tool.blade else { continue };
        let sheet = tool.path.sheet();
        for particle in particles.iter_mut() {
            let near = blade.near(around.domain.to_world(particle.position));
            if let Some(side) = near.takes(particle.tags[0].side != 0) {
                particle.tags[0] = Tag { sheet, side };
                seen.tagged += 1;
            }
            let tag = particle.tags[0];
            if tag.sheet == sheet && near.is_behind(tag.side) {
                let distance = near.distance / around.domain.cell_width;
                let put_back = f64::from(tag.side) * PUT_BACK_DISTANCE - distance;
                particle.position = around.in_room(particle.position + blade.normal() * put_back);
                seen.pushed_back += 1;
                seen.depth_max = seen.depth_max.max(distance.abs());
            }
        }
    }
}
