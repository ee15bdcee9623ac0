//! Tags: which side of a cut a particle is on. Eq. 1, taken once, kept, and decided by the swept blade.
//!
//! A particle takes a blade's side where it comes near or is swept over, and keeps it when the blade leaves: the cut persists. A
//! particle that ends a substep on the wrong side of the blade it is tagged by is put back on the blade's surface.

use super::super::engine::FrameReport;
use super::super::snapshot::Tag;
use super::super::tool::Blade;
use super::Particle;
use super::tools::Surroundings;
use glam::DVec3;

/// Where a particle is put back: this far from the blade's plane, on its own side [cells].
const PUT_BACK_DISTANCE: f64 = 1e-3;

/// Lets each blade of the plan, in order, tag the particles and put back those on the wrong side of it.
pub(super) fn take_sides(particles: &mut [Particle], around: &Surroundings, frame: &mut FrameReport) {
    for (tool, seen) in around.tools.iter().zip(&mut frame.tools) {
        let Some(blade) = tool.blade else { continue };
        let sheet = tool.path.id.to_le_bytes()[0];
        for particle in particles.iter_mut() {
            let world = around.domain.to_world(particle.position);
            let near = blade.near(world);
            let is_swept = is_swept(&blade, world);
            let has_side = particle.tags[0].side != 0;
            let taken = near.takes(has_side).or((is_swept && !has_side).then_some(near.side_before));
            if let Some(side) = taken {
                particle.tags[0] = Tag { sheet, side };
                seen.tagged += 1;
            }
            let Tag { sheet: own_sheet, side } = particle.tags[0];
            let distance = near.distance / around.domain.cell_width;
            let side = f64::from(side);
            if own_sheet == sheet && (near.is_near || is_swept) && distance * side < 0.0 {
                particle.position = around.in_room(particle.position + blade.normal() * (side * PUT_BACK_DISTANCE - distance));
                seen.pushed_back += 1;
                seen.depth_max = seen.depth_max.max(distance.abs());
            }
        }
    }
}

/// Whether the blade's rectangle passed over the point `world` [m] in the substep, however far beyond it ends.
fn is_swept(blade: &Blade, world: DVec3) -> bool {
    let before = blade.motion.start.to_local(world);
    let after = blade.motion.end.to_local(world);
    // Local coordinates are linear in time up to the substep's small turn.
    let foot = before.lerp(after, before.z / (before.z - after.z));
    (before.z < 0.0) != (after.z < 0.0) && foot.x.abs() <= blade.half_width && foot.y.abs() <= blade.half_height
}
