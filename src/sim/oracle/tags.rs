//! Tags: which side of a cut a particle is on. Eq. 1, taken once, kept, and decided by the swept blade.
//!
//! For each blade of the plan in order, with its motion from `t` to `t + h`: a particle at `x`, come from
//! `x - h v+ / dx` by the [`g2p`](super::g2p) before (in a frame's first substep by `h v / dx`,
//! [`TRAVEL_LIMIT`](super::super::limits::TRAVEL_LIMIT) at most), for which
//! [`Near::takes`](super::super::tool::Near::takes) names a side gets the tag (sheet, side): in the slot that
//! has the sheet already, else in slot 0, whose tag moves to slot 1; what stood there is given up, and
//! counted if it was a side of a third cut. Then a particle with a tag of this sheet that
//! [`Near::is_behind`](super::super::tool::Near::is_behind) is put back along the normal to `side * 1e-3`
//! cells from the plane, and counted: the sweep counts, because a blade at 3 cells per substep leaves its
//! band behind it.
//!
//! A plate's middle does the same to the particles beside it, but for as long as they are there: a side is
//! dropped where the plate neither is near nor swept over the particle, and at the start of a frame without
//! the plate; a particle that has sides of two other sheets takes none.
//!
//! In an implicit step the side is the one where the particle stands before the blade as that is at `t`, and
//! what a plate puts back lets go of it, to come out as what is found in a tool: its springs, as deep as the
//! middle is, would fling it off.

use super::super::cut::{self, PLATE_SHEET};
use super::super::frame::{FramePlan, FrameReport};
use super::super::integrator::Integrator;
use super::super::tool::SET_BACK;
use super::particle::Particle;
use super::tools::Surroundings;
use glam::DVec3;

/// Lets each blade of the plan, in order, tag the particles and put back those on the wrong side of it.
pub(super) fn take_sides(particles: &mut [Particle], around: &Surroundings, frame: &mut FrameReport) {
    let is_implicit = matches!(around.plan.integrator, Integrator::Implicit { .. });
    for (tool, seen) in around.tools.iter().zip(&mut frame.tools) {
        let Some(blade) = tool.blade else { continue };
        let sheet = tool.path.sheet_id();
        for particle in particles.iter_mut() {
            let point = around.domain.to_world(particle.position);
            let previous = point - particle.way * around.domain.cell_width;
            let near = if is_implicit { blade.near_implicitly(previous, point) } else { blade.near(previous, point) };
            let takes = near.takes(cut::place(&particle.tags, sheet).is_some());
            if tool.is_solid() {
                seen.tagged += u64::from(cut::beside_plate(&mut particle.tags, sheet, near.is_held, takes));
            } else if let Some(side) = takes {
                seen.displaced += u64::from(cut::take(&mut particle.tags, sheet, side));
                seen.tagged += 1;
            }
            let side = particle.key().side(sheet);
            if near.is_behind(side) {
                let distance = near.distance / around.domain.cell_width;
                let put_back = f64::from(side) * SET_BACK - distance;
                particle.position = around.in_room(particle.position + near.normal * put_back);
                seen.pushed_back += 1;
                seen.depth_max = seen.depth_max.max(distance.abs());
                if is_implicit && tool.is_solid() {
                    let is_its = |kept: &&mut Option<(u32, DVec3)>| kept.is_some_and(|kept| kept.0 == tool.path.id);
                    particle.anchors.iter_mut().filter(is_its).for_each(|kept| *kept = None);
                }
            }
        }
    }
}

/// Drops what is left of plates that are not in the plan.
pub(super) fn drop_plates(particles: &mut [Particle], plan: &FramePlan) {
    for particle in particles {
        for sheet in particle.tags.map(|tag| tag.sheet) {
            if sheet >= PLATE_SHEET && !plan.tools.iter().any(|path| path.sheet == sheet) {
                cut::drop(&mut particle.tags, sheet);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::frame::ToolReport;
    use super::super::super::material::ClayMaterial;
    use super::super::super::params::{Domain, Walls};
    use super::super::super::snapshot::Tag;
    use super::super::super::tool::{Contact, Pose, PoseSample, Tool, ToolPath, ToolShape};
    use super::*;

    /// A particle at `height` \[cells\] with `tag`, after a level blade of sheet 1 (front up) rose from -0.2 to
    /// 0.2 cells.
    fn after_blade(height: f64, tag: Tag) -> (f64, Tag, ToolReport) {
        let domain = Domain::new(DVec3::splat(-8.0), DVec3::splat(8.0), 1.0, Walls::default()).expect("domain");
        let tool = Tool { shape: ToolShape::Blade { half_width: 4.0, half_height: 4.0 }, contact: Contact::Slip };
        let sample = |time, z| PoseSample { time, pose: Pose { position: DVec3::Z * z, ..Pose::default() } };
        let tools = vec![ToolPath { id: 1, tool, sheet: 0, samples: vec![sample(0.0, -0.2), sample(1.0, 0.2)] }];
        let plan = FramePlan { tools, ..FramePlan::new(ClayMaterial::default(), 1.0, 1) };
        let mut particle = Particle::at(domain.to_grid(DVec3::Z * height), 1.0, 0);
        particle.tags[0] = tag;
        let mut frame = FrameReport { tools: vec![ToolReport::default()], ..FrameReport::default() };
        take_sides(std::slice::from_mut(&mut particle), &Surroundings::new(&domain, &plan, 0.0), &mut frame);
        (domain.to_world(particle.position).z, particle.tags[0], frame.tools[0])
    }

    #[test]
    fn particle_passed_by_its_blade_is_put_back_before_it() {
        let tag = Tag { sheet: 1, side: 1 };
        let (height, kept, seen) = after_blade(0.1, tag);
        assert!((height - 0.201).abs() < 1e-12 && kept == tag, "{height} {kept:?}");
        assert!((seen.depth_max - 0.1).abs() < 1e-12 && (seen.pushed_back, seen.tagged) == (1, 0), "{seen:?}");
    }

    #[test]
    fn untagged_particle_takes_the_side_it_was_on() {
        let (height, taken, seen) = after_blade(0.1, Tag::default());
        assert!((height - 0.201).abs() < 1e-12 && taken == Tag { sheet: 1, side: 1 }, "{height} {taken:?}");
        assert_eq!((seen.pushed_back, seen.tagged), (1, 1));
        assert_eq!(after_blade(-0.9, Tag::default()).1, Tag { sheet: 1, side: -1 });
        assert_eq!(after_blade(2.0, Tag::default()).1, Tag::default());
    }

    /// What a plate's middle puts back lets go of the plate in an implicit step, and else holds on to it.
    #[test]
    fn put_back_clay_lets_go_of_a_plate_in_implicit_steps() {
        let domain = Domain::new(DVec3::splat(-8.0), DVec3::splat(8.0), 1.0, Walls::default()).expect("domain");
        let shape = ToolShape::Box { half_size: DVec3::new(4.0, 4.0, 0.4) };
        let path = ToolPath::still(7, Tool { shape, contact: Contact::Stick }, Pose::default());
        let after = |integrator| {
            let tools = vec![ToolPath { sheet: 240, ..path.clone() }];
            let plan = FramePlan { tools, integrator, ..FramePlan::new(ClayMaterial::default(), 1.0, 1) };
            let mut particle = Particle::at(domain.to_grid(DVec3::Z * -0.1), 1.0, 0);
            particle.tags[0] = Tag { sheet: 240, side: 1 };
            particle.anchors = [Some((7, DVec3::ZERO)), Some((8, DVec3::ONE))];
            let mut frame = FrameReport { tools: vec![ToolReport::default()], ..FrameReport::default() };
            take_sides(std::slice::from_mut(&mut particle), &Surroundings::new(&domain, &plan, 0.0), &mut frame);
            assert_eq!(frame.tools[0].pushed_back, 1);
            particle.anchors
        };
        let [other, both] = [[None, Some((8, DVec3::ONE))], [Some((7, DVec3::ZERO)), Some((8, DVec3::ONE))]];
        assert_eq!(after(Integrator::Implicit { passes: 15 }), other);
        assert_eq!(after(Integrator::default()), both);
    }

    /// The side of another cut is kept beside this blade's, and says nothing about it.
    #[test]
    fn particle_of_another_sheet_takes_a_second_side() {
        let other = Tag { sheet: 9, side: -1 };
        let (height, taken, seen) = after_blade(0.6, other);
        assert!((height - 0.6).abs() < 1e-12 && taken == Tag { sheet: 1, side: 1 }, "{height} {taken:?}");
        assert_eq!((seen.pushed_back, seen.tagged, seen.displaced), (0, 1, 0));
    }
}
