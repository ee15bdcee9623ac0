//! A cycle on one component. The operators of the three share nothing but where clay is, so that each goes
//! all the way down and up on a thread of its own: of some fifty slots, which is what a hand can hold,
//! threads that shared every sum waited for each other longer than they worked.

use super::super::super::simd::in_lanes;
use super::super::vectors::{Block1, Block3, for_each_pair_sharing, for_each_sharing};
use super::direct::{Direct, Factor};
use super::elements;
use super::level::Level;
use super::transfer::{self, Partial};

/// Slots of a component that a thread takes at least, where threads share what is done at each.
const COMPONENT_SHARE_MIN: usize = 32;

/// One component of a level's vectors.
#[derive(Debug, Default)]
pub(super) struct Fields {
    /// What is to be solved for; the finest level's is the caller's.
    residual: Vec<Block1>,
    pub(super) z: Vec<Block1>,
    left: Vec<Block1>,
    partials: Vec<Partial>,
}

impl Fields {
    /// Makes room for a level of so many slots: 0, which it stays in those that are not used.
    pub(super) fn set_up(&mut self, slots: usize) {
        for field in [&mut self.residual, &mut self.z, &mut self.left] {
            field.clear();
            field.resize(slots, Block1::ZERO);
        }
        self.partials.clear();
        self.partials.resize(slots, Partial::ZERO);
    }
}

/// Leaves in `fields` of the finest level an approximation of what component `a` of `r` asks for, where
/// something is free.
pub(super) fn cycle_component(a: usize, levels: &[Level], fields: &mut [Fields], direct: (&Direct, &mut Factor), r: &[Block3]) {
    let operator = |(l, level)| Operator { level, a, given: (l == 0).then_some(r) };
    let operators: Vec<Operator<'_>> = levels.iter().enumerate().map(operator).collect();
    let last = levels.len() - 1;
    for l in 0..last {
        let (fine, coarse) = fields.split_at_mut(l + 1);
        let (fine, coarse) = (&mut fine[l], &mut coarse[0]);
        operators[l].go_down(fine);
        operators[l + 1].collect(coarse, &fine.partials);
    }
    operators[last].solve(&mut fields[last], direct);
    for l in (0..last).rev() {
        let (fine, coarse) = fields.split_at_mut(l + 1);
        let (fine, coarse) = (&mut fine[l], &mut coarse[0]);
        operators[l + 1].level.layout.expand_component(a, &mut coarse.z);
        operators[l].correct(fine, &coarse.z);
        operators[l].go_up(fine);
    }
}

/// A level's operator on component `a`.
struct Operator<'a> {
    level: &'a Level,
    a: usize,
    /// What the finest level is solved for.
    given: Option<&'a [Block3]>,
}

impl Operator<'_> {
    /// What is to be solved for at a slot: a level's own, on the finest what is given.
    fn residual<'b>(&'b self, own: &'b [Block1], slot: usize) -> &'b [f32; 64] {
        self.given.map_or_else(|| &own[slot].0, |r| &r[slot].0[self.a])
    }

    fn inverse(&self, slot: usize) -> &[f32; 64] {
        &self.level.inverse[slot].0[self.a]
    }

    /// On the way down: `z = w r / diagonal`, and what that leaves of `r` for the coarse nodes.
    fn go_down(&self, fields: &mut Fields) {
        let Fields { residual, z, left, partials } = fields;
        for_each_sharing(COMPONENT_SHARE_MIN, z, |slot, z| {
            if self.level.is_used[slot] {
                set_product(&mut z.0, self.inverse(slot), self.residual(residual, slot));
            }
        });
        self.level.layout.expand_component(self.a, z);
        for_each_pair_sharing(COMPONENT_SHARE_MIN, left, partials, |slot, left, partial| {
            if self.level.is_used[slot] {
                self.find_left(slot, z, self.residual(residual, slot), &mut left.0);
                transfer::restrict(&left.0, self.inverse(slot), partial);
            }
        });
        self.level.layout.fold_component(self.a, left);
        for slot in self.tied_slots() {
            transfer::restrict(&left[slot].0, self.inverse(slot), &mut partials[slot]);
        }
    }

    /// Takes the level before's partial sums as what is to be solved for.
    fn collect(&self, fields: &mut Fields, partials: &[Partial]) {
        for_each_sharing(COMPONENT_SHARE_MIN, &mut fields.residual, |slot, sum| {
            if self.level.is_used[slot] {
                transfer::collect(&self.level.children[slot], partials, &mut sum.0);
            }
        });
        self.level.layout.fold_component(self.a, &mut fields.residual);
    }

    /// Solves the last level.
    fn solve(&self, fields: &mut Fields, (direct, factor): (&Direct, &mut Factor)) {
        let Fields { residual, z, .. } = fields;
        let is_free = |slot: usize, node: usize| self.inverse(slot)[node] > 0.0;
        direct.solve(factor, |slot, node| if is_free(slot, node) { self.residual(residual, slot)[node] } else { 0.0 }, z);
    }

    /// Adds the next level's solution.
    fn correct(&self, fields: &mut Fields, coarse: &[Block1]) {
        let Level { layout, parents, is_used, .. } = self.level;
        for_each_sharing(COMPONENT_SHARE_MIN, &mut fields.z, |slot, z| {
            if is_used[slot] {
                transfer::interpolate(layout.slots[slot].block, &parents[slot], coarse, self.inverse(slot), &mut z.0);
            }
        });
        layout.expand_component(self.a, &mut fields.z);
    }

    /// On the way up, with the next level's solution in z: smooths once more.
    fn go_up(&self, fields: &mut Fields) {
        let Fields { residual, z, left: next, .. } = fields;
        let smooth = |slot: usize, left: &mut Block1| add_to_product(&mut left.0, self.inverse(slot), &z[slot].0);
        for_each_sharing(COMPONENT_SHARE_MIN, next, |slot, next| {
            if self.level.is_used[slot] {
                self.find_left(slot, z, self.residual(residual, slot), &mut next.0);
                if !self.level.layout.is_linked[slot] {
                    smooth(slot, next);
                }
            }
        });
        self.level.layout.fold_component(self.a, next);
        self.tied_slots().for_each(|slot| smooth(slot, &mut next[slot]));
        std::mem::swap(z, next);
    }

    /// The slots whose sums are whole only when they are folded.
    fn tied_slots(&self) -> impl Iterator<Item = usize> {
        self.level.layout.is_linked.iter().enumerate().filter(|(_, is_linked)| **is_linked).map(|(slot, _)| slot)
    }

    /// `left = r - A z` of a slot before it is folded; where nothing is free it means nothing.
    fn find_left(&self, slot: usize, z: &[Block1], residual: &[f32; 64], left: &mut [f32; 64]) {
        let (Level { cells, modes, layout, added, .. }, a) = (self.level, self.a);
        *left = [0.0; 64];
        if !cells[slot].is_empty() {
            elements::add_product((modes, a), &cells[slot], z, &layout.neighbours[slot], left);
        }
        leave(left, residual, &added[slot].0[a], &z[slot].0);
    }
}

in_lanes! {
    fn set_product(product: &mut [f32; 64], a: &[f32; 64], b: &[f32; 64]) {
        for ((product, a), b) in product.iter_mut().zip(a).zip(b) {
            *product = a * b;
        }
    }
}

in_lanes! {
    /// `value = value a + b`.
    fn add_to_product(value: &mut [f32; 64], a: &[f32; 64], b: &[f32; 64]) {
        for ((value, a), b) in value.iter_mut().zip(a).zip(b) {
            *value = b + a * *value;
        }
    }
}

in_lanes! {
    /// Makes of the elements' product what is left of the residual.
    fn leave(product: &mut [f32; 64], residual: &[f32; 64], added: &[f32; 64], z: &[f32; 64]) {
        let others = residual.iter().zip(added).zip(z);
        for (left, ((residual, added), z)) in product.iter_mut().zip(others) {
            *left = residual - *left - added * z;
        }
    }
}
