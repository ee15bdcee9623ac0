//! Where the sides of a cut are carried on into clay that has none: as the tagged layer thins or shears, clay
//! behind it comes to see the other side, and would share its nodes.
//!
//! After the frame's last substep and after [`weld`](super::weld), with the unfolded node masses of that
//! substep's [`p2g`](super::p2g): for each sheet of cuts that stay
//! ([`PLATE_SHEET`](super::super::cut::PLATE_SHEET)), but those of the plan's blades, in order, and each
//! particle at its new `x` that has room for a side, none of this sheet, and has not grown together there:
//! `M = sum w m` and `G = sum w m (x_i - x)` of the classes on either side. Where both sides meet, as
//! [`weld`](super::weld) has it, with its normal n, the particle takes the side a of the greater share if
//! that is more than [`CARRY_SHARE`] and `-a n . G_a / |G_a|` more than [`CARRY_COSINE`]: the clay of its
//! side lies between it and the cut.

use super::super::carry;
use super::super::cut;
use super::super::frame::{FramePlan, FrameReport};
use super::super::weld::MEETING_SHARE;
use super::grid::Grid;
use super::particle::Particle;
use super::stencil::stencil;
use carry::{CARRY_COSINE, CARRY_SHARE};
use glam::DVec3;

/// Gives particles the sides that they have come to need.
pub(super) fn carry_on(particles: &mut [Particle], grid: &Grid, plan: &FramePlan, frame: &mut FrameReport) {
    for particle in particles {
        for sheet in sheets_about(particle, grid) {
            if !carry::is_carried(plan, sheet) || !carry::is_open(&particle.tags, sheet) {
                continue;
            }
            if let Some(side) = side(particle, sheet, grid) {
                cut::take(&mut particle.tags, sheet, side);
                frame.carried += 1;
            }
        }
    }
}

/// The sheets of the clay about a particle, in order.
fn sheets_about(particle: &Particle, grid: &Grid) -> Vec<u8> {
    let nodes = stencil(particle.position).into_iter().filter_map(|touch| grid.get(touch.node));
    let mut sheets: Vec<u8> = nodes.flat_map(|node| node.classes.iter()).flat_map(|(key, _)| key.sides()).map(|s| s.0).collect();
    sheets.sort_unstable();
    sheets.dedup();
    sheets
}

/// The side that the clay about a particle carries on to it, if any.
fn side(particle: &Particle, sheet: u8, grid: &Grid) -> Option<i8> {
    let sums = |side: i8| {
        let of_node = |(mass, moment): (f64, DVec3), touch: super::stencil::Touch| {
            let here = grid
                .get(touch.node)
                .map_or(0.0, |node| touch.weight * node.classes.mass_of_side(particle.key().body(), sheet, side));
            (mass + here, moment + here * touch.arm)
        };
        stencil(particle.position).into_iter().fold((0.0, DVec3::ZERO), of_node)
    };
    let (front, back) = (sums(1), sums(-1));
    let front_share = front.0 / (front.0 + back.0);
    let least = front_share.min(1.0 - front_share);
    if !(least > MEETING_SHARE && least < 1.0 - CARRY_SHARE) {
        return None;
    }
    let normal = (front.1 / front.0 - back.1 / back.0).try_normalize()?;
    let (side, own) = if front_share > 0.5 { (1, front.1) } else { (-1, back.1) };
    let away = -own.try_normalize()?;
    (f64::from(side) * normal.dot(away) > CARRY_COSINE).then_some(side)
}
