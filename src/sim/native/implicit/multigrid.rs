//! The preconditioner: one V-cycle for three scalar operators on the nodes, as the text at the head of the
//! oracle's `implicit::multigrid` has it, without a matrix but on the coarsest level.
//!
//! Coarse levels are slots of 4^3 nodes as the finest is. A class has a slot on the next level wherever one
//! of its slots is interpolated from; where none of its clay moves there its nodes are tied to the untagged
//! ones. Outer nodes of walls are no unknowns, and held at 0 here.

mod direct;
mod elements;
mod level;
#[cfg(all(test, feature = "reference"))]
mod tests;
mod transfer;

use super::super::super::implicit::{CYCLE_SCALE, DIRECT_MAX, LEVELS_MAX, smoothing};
use super::super::simd::in_lanes;
use super::layout::Index;
use super::vectors::{Block3, for_each};
use direct::Direct;
pub(super) use level::Finest;
use level::Level;

/// The V-cycle of a step. What it is made of is kept from step to step.
#[derive(Debug, Default)]
pub(super) struct Multigrid {
    levels: Vec<Level>,
    /// How many of them are in use.
    count: usize,
    direct: Direct,
    index: Index,
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
        self.direct.set_up(&self.levels[self.count - 1], moduli);
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
        let last = self.count - 1;
        for l in 0..last {
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let (fine, coarse) = (&mut fine[l], &mut coarse[0]);
            let residual = std::mem::take(&mut fine.residual);
            let of_level = if l == 0 { r } else { &residual };
            fine.go_down(of_level);
            fine.residual = residual;
            coarse.collect(&fine.partials);
        }
        self.solve_last(if last == 0 { Some(r) } else { None });
        for l in (0..last).rev() {
            let (fine, coarse) = self.levels.split_at_mut(l + 1);
            let (fine, coarse) = (&mut fine[l], &mut coarse[0]);
            fine.correct(coarse);
            let residual = std::mem::take(&mut fine.residual);
            fine.go_up(if l == 0 { r } else { &residual });
            fine.residual = residual;
        }
        let finest = &self.levels[0];
        for_each(z, |slot, z| {
            if !finest.is_used[slot] {
                *z = Block3::ZERO;
                return;
            }
            take(z, &finest.z[slot], &finest.inverse[slot]);
        });
    }

    /// Solves the last level; if that is the finest, for `r`.
    fn solve_last(&mut self, r: Option<&[Block3]>) {
        let last = &mut self.levels[self.count - 1];
        let mut solution = std::mem::take(&mut last.z);
        self.direct.solve(last, r.unwrap_or(&last.residual), &mut solution);
        last.z = solution;
    }
}

in_lanes! {
    /// What comes of a cycle, where something is free.
    fn take(z: &mut Block3, from: &Block3, inverse: &Block3) {
        for ((z, from), inverse) in z.flat_mut().iter_mut().zip(from.flat()).zip(inverse.flat()) {
            *z = if *inverse > 0.0 { CYCLE_SCALE as f32 * from } else { 0.0 };
        }
    }
}
