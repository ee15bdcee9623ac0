//! Where the two sides of a cut, or two bodies, pressed on each other grow together.
//!
//! After the frame's last substep, unless [`weld`](super::super::material::ClayMaterial::weld) is off: for
//! each tag of a particle at its new `x`, with the unfolded node masses of the last substep's
//! [`p2g`](super::p2g): `M = sum w m`, `G = sum w m (x_i - x)` of the classes of the particle's body with
//! either side of the sheet. Both sides meet if each has more than
//! `MEETING_SHARE = 1e-3` of `M_F + M_B`; else, and where the cut's normal, the slope of the front's share,
//! `n = (M_B G_F - M_F G_B) / |..|` vanishes, the tag is left alone. The sides are pressed if
//! `n . sigma n < -c k` with the particle's Cauchy stress `sigma = tau / J` and k the fresh clay's shear
//! strength.
//!
//! A tag counts, in the magnitude of its side from 1 on: pressed,
//! `floor(100 (t0 + T) / t_w) - floor(100 t0 / t_w)`, 100 at most, is added (t0 the clay's time when the
//! frame starts, T its length), and above 100 the side is 0 and counted; not pressed, it is 1 again. c and
//! t_w are 0.5 and 0.3 s, sticky 0.05 and 0.05 s.
//!
//! Of a sheet whose blade is in the plan, a tag pressed is `LEFT_PRESSED = 127`, else 1. With the blade gone
//! 127 stays while pressed, and is 1 when not: what cutting leaves clay under is no press. For both, half of
//! c k is pressed.
//!
//! Where there is clay of other bodies at the particle's nodes, its own body's is taken for the front and
//! theirs for the back. There a tag of [`JOINT_SHEET`] counts as above, given to particles that are pressed
//! and have room for one; the first frame counts from 1. It is taken away where nothing presses any more.
//! Beside a blade of the plan there is none; a particle pressed has 127 at that blade's cut, which goes on to
//! such a tag when the [cut is finished](super::super::body).
//! One that has counted to the end stays, without a side, until [bodies](super::super::body) are found.

use super::super::cut::JOINT_SHEET;
use super::super::frame::{FramePlan, FrameReport};
use super::super::weld::{MEETING_SHARE, WeldRule};
use super::grid::{Grid, Node};
use super::law;
use super::particle::Particle;
use super::stencil::stencil;
use glam::DVec3;

/// Counts the frame, which began at `start` \[s\], for every tag at which both sides meet and for every
/// particle that meets another body; sides that have grown together are gone.
pub(super) fn grow_together(particles: &mut [Particle], grid: &Grid, plan: &FramePlan, start: f64, frame: &mut FrameReport) {
    let Some(rule) = WeldRule::of(plan, start) else { return };
    for particle in particles {
        let body = particle.key().body();
        let is_pressed = |particle: &Particle, normal: DVec3, least: f64| {
            let ratio = law::volume_ratio(particle.elastic_strain);
            let stress = law::kirchhoff_stress(&plan.material, particle.elastic_strain) * (1.0 / ratio);
            normal.dot(stress * normal) < -least
        };
        for i in 0..2 {
            let tag = particle.tags[i];
            if tag.side == 0 || tag.sheet == JOINT_SHEET {
                continue;
            }
            let on = |side: i8| move |node: &Node| node.classes.mass_of_side(body, tag.sheet, side);
            let Some(normal) = normal(particle, grid, [&on(1), &on(-1)]) else { continue };
            let is_pressed = is_pressed(particle, normal, rule.stress_at(plan, tag));
            if WeldRule::spares(plan, tag.sheet) {
                WeldRule::mark(&mut particle.tags[i], is_pressed);
            } else {
                frame.welded += u64::from(rule.count(&mut particle.tags[i], is_pressed));
            }
        }
        let own = |node: &Node| node.classes.mass_of(body);
        let others = |node: &Node| node.classes.mass_beside(body);
        let is_pressed = normal(particle, grid, [&own, &others])
            .is_some_and(|normal| is_pressed(particle, normal, rule.joint_stress_at(plan, &particle.tags)));
        let spares = |sheet| WeldRule::spares(plan, sheet);
        frame.joined += u64::from(rule.count_joint(&mut particle.tags, is_pressed, spares));
    }
    frame.welded += frame.joined;
}

/// Unit normal at the particle between clay in front and behind, each by its masses at nodes; none where the
/// two do not meet.
fn normal(particle: &Particle, grid: &Grid, sides: [&dyn Fn(&Node) -> f64; 2]) -> Option<DVec3> {
    let (mut masses, mut gradients) = ([0.0; 2], [DVec3::ZERO; 2]);
    for touch in stencil(particle.position) {
        let Some(node) = grid.get(touch.node) else { continue };
        for (side, mass_at) in sides.iter().enumerate() {
            let mass = touch.weight * mass_at(node);
            masses[side] += mass;
            gradients[side] += mass * touch.arm;
        }
    }
    let total = masses[0] + masses[1];
    let shares = masses.map(|mass| mass / total);
    let meet = shares[0].min(shares[1]) > MEETING_SHARE;
    if meet { (shares[1] * gradients[0] - shares[0] * gradients[1]).try_normalize() } else { None }
}
