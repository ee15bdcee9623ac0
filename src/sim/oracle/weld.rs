//! Where the two sides of a cut, pressed on each other, grow together.
//!
//! Once a frame, at its end. At a particle the two sides of a sheet have masses `M = sum w m` of the last substep's nodes and gradients `G = sum w m (x_i - x_p)`; the
//! cut's normal is that of the front's share, `M_B G_F - M_F G_B`. The sides are pressed where the particle's own Cauchy stress across it is a
//! compression of more than the rule asks for.

use super::super::cut::{MEETING_SHARE, WeldRule};
use super::super::frame::{FramePlan, FrameReport};
use super::super::snapshot::Tag;
use super::grid::Grid;
use super::stencil::stencil;
use super::{Particle, law};
use glam::DVec3;

/// Counts the frame, which began at `start` [s], for every tag at which both sides meet; those that have grown together are gone.
pub(super) fn grow_together(particles: &mut [Particle], grid: &Grid, plan: &FramePlan, start: f64, frame: &mut FrameReport) {
    let Some(rule) = WeldRule::of(plan, start) else { return };
    for particle in particles {
        for i in 0..2 {
            let tag = particle.tags[i];
            if tag.side == 0 || WeldRule::spares(plan, tag.sheet) {
                continue;
            }
            let Some(normal) = normal(particle, tag, grid) else { continue };
            let ratio = law::volume_ratio(particle.elastic_strain);
            let stress = law::kirchhoff_stress(&plan.material, particle.elastic_strain) * (1.0 / ratio);
            let is_pressed = normal.dot(stress * normal) < -rule.stress;
            frame.welded += u64::from(rule.count(&mut particle.tags[i], is_pressed));
        }
    }
}

/// Unit normal of the tag's cut at the particle; none where the two sides do not meet.
fn normal(particle: &Particle, tag: Tag, grid: &Grid) -> Option<DVec3> {
    let (mut masses, mut gradients) = ([0.0; 2], [DVec3::ZERO; 2]);
    for touch in stencil(particle.position) {
        let Some(node) = grid.get(touch.node) else { continue };
        for (side, sign) in [1, -1].into_iter().enumerate() {
            let mass = touch.weight * node.classes.mass_on(tag.sheet, sign);
            masses[side] += mass;
            gradients[side] += mass * touch.arm;
        }
    }
    let total = masses[0] + masses[1];
    let shares = masses.map(|mass| mass / total);
    let meet = shares[0].min(shares[1]) > MEETING_SHARE;
    if meet { (shares[1] * gradients[0] - shares[0] * gradients[1]).try_normalize() } else { None }
}
