//! The clay on both sides of each cut, apart.

use super::grid::NodeValues;
use super::scatter::{Bins, Part};
use crate::sim::cut::JOINT_SHEET;
use crate::sim::frame::SurfaceParticle;
use std::collections::BTreeMap;

/// The clay at one cut.
#[derive(Clone, Debug)]
pub(crate) struct SheetField {
    /// The body that it cuts.
    pub(crate) body: u32,
    /// Sheet number, from 1.
    pub(crate) sheet: u8,
    /// P: clay in front.
    pub(crate) front: NodeValues,
    /// M: clay behind.
    pub(crate) back: NodeValues,
}

/// The cuts at which a particle stands, and its side of each (1 front, -1 back).
pub(crate) fn tags(particle: &SurfaceParticle) -> impl Iterator<Item = (u8, i8)> {
    let [a, b, c, d] = particle.tags.to_le_bytes();
    // The size of a side is a counter of the engine's.
    let tags = [(a, b.cast_signed().signum()), (c, d.cast_signed().signum())];
    let is_side = move |k: usize| tags[k].0 != 0 && tags[k].0 != JOINT_SHEET && tags[k].1 != 0;
    let is_tag = move |k: &usize| is_side(*k) && (*k == 0 || tags[1].0 != tags[0].0 || tags[0].1 == 0);
    (0..2).filter(is_tag).map(move |k| tags[k])
}

/// The particles in front of and behind each cut that has both, by the body that it cuts and sheet number.
pub(super) fn parts_at_cuts(particles: &[SurfaceParticle], bins: &Bins) -> BTreeMap<(u32, u8), [Part; 2]> {
    let mut parts: BTreeMap<(u32, u8), [Part; 2]> = BTreeMap::new();
    if particles.iter().all(|p| p.tags == 0) {
        return parts;
    }
    for (bin, &p) in bins.particles_by_bin() {
        let particle = &particles[p as usize];
        if particle.tags != 0 {
            let mut add = |(sheet, side)| parts.entry((particle.body, sheet)).or_default()[usize::from(side < 0)].push(bin, p);
            tags(particle).for_each(&mut add);
        }
    }
    parts.retain(|_, [front, back]| !front.is_empty() && !back.is_empty());
    parts
}
