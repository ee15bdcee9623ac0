//! The preconditioner: one V-cycle for three scalar operators on the nodes, as the text at the head of the
//! oracle's `implicit::multigrid` has it, without a matrix but on the coarsest level.
//!
//! Coarse levels are slots of 4^3 nodes as the finest is. A class has a slot on the next level wherever one
//! of its slots is interpolated from; where none of its clay moves there its nodes are tied to the untagged
//! ones. Outer nodes of walls are no unknowns, and held at 0 here.

mod cycle;
mod direct;
mod elements;
mod level;
#[cfg(all(test, feature = "reference"))]
mod tests;
mod transfer;

use super::super::super::implicit::{CYCLE_SCALE, DIRECT_MAX, LEVELS_MAX, smoothing};
use super::super::shares::for_each_in_shares;
use super::super::simd::in_lanes;
use super::layout::Index;
use super::vectors::{Block3, for_each};
use cycle::{Fields, cycle_component};
use direct::{Direct, Factor};
pub(super) use level::Finest;
use level::Level;

/// Slots from which on components go down and up apart from each other: 45 take 60 us for each, and another
/// thread starts 10 to 30 us later.
const APART_MIN: usize = 16;

/// The V-cycle of a step. What it is made of is kept from step to step.
#[derive(Debug, Default)]
pub(super) struct Multigrid {
    levels: Vec<Level>,
    /// How many of them are in use.
    count: usize,
    direct: Direct,
    components: [Component; 3],
    index: Index,
}

/// What a cycle is made of beside the levels, of one component.
#[derive(Debug, Default)]
struct Component {
    /// By level.
    fields: Vec<Fields>,
    factor: Factor,
}

impl Multigrid {
    /// Takes the operators of a step.
    pub(super) fn set_up(&mut self, finest: &Finest<'_>) {
        let (mu, lambda) = (f64::from(finest.mu), f64::from(finest.lambda));
        let weight = smoothing(mu, lambda) as f32;
        self.level(0).set_finest(finest, weight);
        let mut free = self.levels[0].free_count();
        self.count = 1;
        while free > DIRECT_MAX && self.count < LEVELS_MAX {
            self.level(self.count);
            let (fine, coarse) = self.levels.split_at_mut(self.count);
            let (fine, coarse) = (&mut fine[self.count - 1], &mut coarse[0]);
            coarse.set_slots(fine, &mut self.index);
            coarse.set_live(fine, &self.index);
            coarse.set_coarse(fine, (finest.mu, finest.lambda), 1 << self.count, weight);
            let coarser = coarse.free_count();
            if coarser == free {
                break;
            }
            (free, self.count) = (coarser, self.count + 1);
        }
        let width = f64::from(1 << (self.count - 1));
        let moduli = [0, 1, 2].map(|a| [0, 1, 2].map(|axis| width * if axis == a { lambda + 2.0 * mu } else { mu }));
        let levels = &self.levels[..self.count];
        let factors = self.components.each_mut().map(|component| &mut component.factor);
        self.direct.set_up(factors, &levels[self.count - 1], moduli);
        for Component { fields, .. } in &mut self.components {
            fields.resize_with(fields.len().max(self.count), Fields::default);
            fields.iter_mut().zip(levels).for_each(|(fields, level)| fields.set_up(level.layout.slots.len()));
        }
    }

    /// Level `l`, new if it was never in use.
    fn level(&mut self, l: usize) -> &mut Level {
        if self.levels.len() == l {
            self.levels.push(Level::default());
        }
        &mut self.levels[l]
    }

    /// Makes `z` an approximation of `A^-1 r`, 0 where nothing is free, by the operators last
    /// [taken](Self::set_up).
    pub(super) fn cycle(&mut self, r: &[Block3], z: &mut [Block3]) {
        let (levels, direct) = (&self.levels[..self.count], &self.direct);
        let act = |_: &mut (), (a, component): &mut (usize, &mut Component)| {
            let Component { fields, factor } = &mut **component;
            cycle_component(*a, levels, &mut fields[..levels.len()], (direct, factor), r);
        };
        let mut components: Vec<_> = self.components.iter_mut().enumerate().collect();
        if r.len() < APART_MIN {
            components.iter_mut().for_each(|component| act(&mut (), component));
        } else {
            for_each_in_shares(&mut components, |_| 1, || (), act);
        }
        let (finest, components) = (&levels[0], &self.components);
        for_each(z, |slot, z| {
            for (a, component) in components.iter().enumerate() {
                take(&mut z.0[a], &component.fields[0].z[slot].0, &finest.inverse[slot].0[a]);
            }
        });
    }
}

in_lanes! {
    /// What comes of a cycle, where something is free.
    fn take(z: &mut [f32; 64], from: &[f32; 64], inverse: &[f32; 64]) {
        for ((z, from), inverse) in z.iter_mut().zip(from).zip(inverse) {
            *z = if *inverse > 0.0 { CYCLE_SCALE as f32 * from } else { 0.0 };
        }
    }
}
