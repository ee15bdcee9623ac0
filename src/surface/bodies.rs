//! The clay of each body apart, where others are near.
//!
//! A body is *near* a block if its clay may have a value there, or one node below. Where one body is near,
//! its clay is all clay, f; only blocks that several are near hold values of each.

use super::grid::{BlockGrid, NodeValues};
use super::scatter::{Bins, Part};
use crate::sim::frame::SurfaceParticle;
use glam::IVec3;
use std::collections::BTreeMap;

/// The clay of one of several bodies.
#[derive(Clone, Debug)]
pub(crate) struct BodyField {
    /// Its number.
    pub(crate) body: u32,
    /// By slot: whether it is the only body near.
    pub(crate) is_alone: Vec<bool>,
    /// In blocks that others are near too.
    pub(crate) values: NodeValues,
}

impl BodyField {
    /// Its clay at a slot's nodes, if it is near; `total` is all clay.
    pub(crate) fn block<'a>(&'a self, total: &'a NodeValues, slot: usize) -> Option<&'a [f32]> {
        if self.is_alone[slot] { total.block(slot) } else { self.values.block(slot) }
    }

    /// Whether the same body is near the same blocks as the only one.
    pub(crate) fn is_where(&self, other: &Self) -> bool {
        (self.body, &self.is_alone) == (other.body, &other.is_alone)
    }
}

/// The fields of the bodies, by number; none of clay of one body.
/// `values_of` are those of a part in the slots that are stored, `reach` is the nodes' before and behind a
/// particle's stencil.
pub(super) fn body_fields(
    particles: &[SurfaceParticle],
    bins: &Bins,
    reach: (i32, i32),
    values_of: impl Fn(&Part, &(dyn Fn(usize) -> bool + Sync)) -> NodeValues,
) -> Vec<BodyField> {
    let parts = parts(particles, bins);
    let grid = &bins.grid;
    let near: Vec<Vec<bool>> = parts.values().map(|part| slots_near(part, bins, reach)).collect();
    let is_shared: Vec<bool> = (0..grid.blocks().len()).map(|slot| near.iter().filter(|n| n[slot]).count() > 1).collect();
    // Values of a block come from the particles of the blocks within two of it.
    let is_of_use = |bin: u32| {
        let around = (0..125).map(|i| bins.block_of_bin(bin) + IVec3::new(i % 5, i / 5 % 5, i / 25) - 2);
        around.filter_map(|block| grid.slot(block)).any(|slot| is_shared[slot])
    };
    let field = |((body, part), near): ((u32, Part), Vec<bool>)| {
        let part = part.within(is_of_use);
        let is_alone = near.iter().zip(&is_shared).map(|(near, shared)| *near && !shared).collect();
        let is_stored = |slot: usize| near[slot] && is_shared[slot];
        let values = match part.is_empty() {
            true => NodeValues::default(),
            false => values_of(&part, &is_stored),
        };
        BodyField { body, is_alone, values }
    };
    parts.into_iter().zip(near).map(field).collect()
}

/// The particles of each body; nothing if there is but one.
fn parts(particles: &[SurfaceParticle], bins: &Bins) -> BTreeMap<u32, Part> {
    let mut parts: BTreeMap<u32, Part> = BTreeMap::new();
    if particles.windows(2).all(|two| two[0].body == two[1].body) {
        return parts;
    }
    for (bin, &p) in bins.particles_by_bin() {
        parts.entry(particles[p as usize].body).or_default().push(bin, p);
    }
    if parts.len() > 1 { parts } else { BTreeMap::new() }
}

/// By slot, whether a part is near.
fn slots_near(part: &Part, bins: &Bins, reach: (i32, i32)) -> Vec<bool> {
    let grid: &BlockGrid = &bins.grid;
    let mut is_near = vec![false; grid.blocks().len()];
    for (_, particles) in part.bins() {
        let (first, last) = bins.reach(particles, reach);
        let size = last - first + 1;
        for i in 0..size.element_product() {
            let block = first + IVec3::new(i % size.x, i / size.x % size.y, i / size.x / size.y);
            if let Some(slot) = grid.slot(block) {
                is_near[slot] = true;
            }
        }
    }
    is_near
}
