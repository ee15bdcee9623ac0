//! Vectors on the nodes of all slots, and what L-BFGS does with them. Sums are taken slot by slot and then in
//! the order of the slots: the same bits at any number of threads.

use super::super::simd::in_lanes;
use rayon::prelude::*;

/// Three components of the 64 nodes of a slot, in the order of [`local`](super::super::nodes::local).
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Block3(pub [[f32; 64]; 3]);

/// One component of the nodes of a slot.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Block1(pub [f32; 64]);

/// A vector: one block for each slot.
pub(super) type Vector = Vec<Block3>;

/// Slots that a thread takes at least, where threads share what is done at each: of fewer than four times as
/// many they would wait for each other longer than they worked.
const SHARE_MIN: usize = 16;

impl Block1 {
    pub(super) const ZERO: Self = Self([0.0; 64]);
}

impl Block3 {
    pub(super) const ZERO: Self = Self([[0.0; 64]; 3]);

    /// The numbers one after another, component by component.
    #[inline(always)]
    pub(super) fn flat(&self) -> &[f32] {
        self.0.as_flattened()
    }

    /// The same to write to.
    #[inline(always)]
    pub(super) fn flat_mut(&mut self) -> &mut [f32] {
        self.0.as_flattened_mut()
    }
}

in_lanes! {
    /// Adds `factor` times `other`.
    pub(super) fn add(own: &mut Block3, factor: f32, other: &Block3) {
        own.flat_mut().iter_mut().zip(other.flat()).for_each(|(own, other)| *own += factor * other);
    }
}

in_lanes! {
    /// Sets `sum` to `a` and `factor` times `b`.
    pub(super) fn set_sum(sum: &mut Block3, a: &Block3, factor: f32, b: &Block3) {
        for ((sum, a), b) in sum.flat_mut().iter_mut().zip(a.flat()).zip(b.flat()) {
            *sum = a + factor * b;
        }
    }
}

/// Calls `act` with each item and its index, on several threads where there are many.
pub(super) fn for_each<T: Send>(items: &mut [T], act: impl Fn(usize, &mut T) + Sync + Send) {
    for_each_sharing(SHARE_MIN, items, act);
}

/// The same with the items of two slices, which are as many.
pub(super) fn for_each_pair<T: Send, U: Send>(
    items: &mut [T],
    others: &mut [U],
    act: impl Fn(usize, &mut T, &mut U) + Sync + Send,
) {
    for_each_pair_sharing(SHARE_MIN, items, others, act);
}

/// As [`for_each`], of which a thread takes `share_min` items at least.
pub(super) fn for_each_sharing<T: Send>(share_min: usize, items: &mut [T], act: impl Fn(usize, &mut T) + Sync + Send) {
    if items.len() < 4 * share_min {
        items.iter_mut().enumerate().for_each(|(i, item)| act(i, item));
    } else {
        items.par_iter_mut().enumerate().with_min_len(share_min).for_each(|(i, item)| act(i, item));
    }
}

/// As [`for_each_pair`], of which a thread takes `share_min` items at least.
pub(super) fn for_each_pair_sharing<T: Send, U: Send>(
    share_min: usize,
    items: &mut [T],
    others: &mut [U],
    act: impl Fn(usize, &mut T, &mut U) + Sync + Send,
) {
    if items.len() < 4 * share_min {
        items.iter_mut().zip(others).enumerate().for_each(|(i, (item, other))| act(i, item, other));
    } else {
        let both = items.par_iter_mut().zip(others).enumerate();
        both.with_min_len(share_min).for_each(|(i, (item, other))| act(i, item, other));
    }
}

/// Calls `act` as [`for_each`] does and adds up, in the order of the items, what comes back.
pub(super) fn sum_each<T: Send, const N: usize>(
    items: &mut [T],
    act: impl Fn(usize, &mut T) -> [f64; N] + Sync + Send,
) -> [f64; N] {
    let add = |sum: [f64; N], more: &[f64; N]| std::array::from_fn(|i| sum[i] + more[i]);
    if items.len() < 4 * SHARE_MIN {
        items.iter_mut().enumerate().fold([0.0; N], |sum, (i, item)| add(sum, &act(i, item)))
    } else {
        let each = items.par_iter_mut().enumerate().with_min_len(SHARE_MIN).map(|(i, item)| act(i, item));
        each.collect::<Vec<_>>().iter().fold([0.0; N], add)
    }
}

/// Adds up, in the order of the slots, what `of` makes of each.
pub(super) fn sum_over<const N: usize>(slots: usize, of: impl Fn(usize) -> [f64; N] + Sync + Send) -> [f64; N] {
    // Items without a size take no room.
    sum_each(&mut vec![(); slots], |slot, ()| of(slot))
}

/// Scalar product.
pub(super) fn dot(a: &[Block3], b: &[Block3]) -> f64 {
    sum_over(a.len(), |slot| [dot_of(&a[slot], &b[slot])])[0]
}

in_lanes! {
    /// Scalar product of two blocks: 24 products in each of eight sums, and these in f64.
    pub(super) fn dot_of(a: &Block3, b: &Block3) -> f64 {
        let mut sums = [0.0f32; 8];
        for (a, b) in a.flat().as_chunks::<8>().0.iter().zip(b.flat().as_chunks::<8>().0) {
            for k in 0..8 {
                sums[k] += a[k] * b[k];
            }
        }
        sums.iter().copied().map(f64::from).sum()
    }
}
