//! Vectors on the nodes of all slots, and what L-BFGS does with them. Sums are taken slot by slot and then in
//! the order of the slots: the same bits at any number of threads.

use rayon::prelude::*;

/// Three components of the 64 nodes of a slot, in the order of [`local`](super::super::nodes::local).
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Block3(pub [[f32; 64]; 3]);

/// A vector: one block for each slot.
pub(super) type Vector = Vec<Block3>;

/// Slots from which on threads share the work, and what one of them takes at least.
const PARALLEL_MIN: usize = 32;
const SHARE_MIN: usize = 8;

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

/// Calls `act` with each item and its index, on several threads where there are many.
pub(super) fn for_each<T: Send>(items: &mut [T], act: impl Fn(usize, &mut T) + Sync + Send) {
    if items.len() < PARALLEL_MIN {
        items.iter_mut().enumerate().for_each(|(i, item)| act(i, item));
    } else {
        items.par_iter_mut().enumerate().with_min_len(SHARE_MIN).for_each(|(i, item)| act(i, item));
    }
}

/// Scalar product.
pub(super) fn dot(a: &[Block3], b: &[Block3]) -> f64 {
    let of = |(a, b): (&Block3, &Block3)| of_block(a, b);
    if a.len() < PARALLEL_MIN {
        a.iter().zip(b).map(of).sum()
    } else {
        let sums: Vec<f64> = a.par_iter().zip(b).with_min_len(SHARE_MIN).map(of).collect();
        sums.iter().sum()
    }
}

/// Scalar product of two blocks, in eight sums: one alone would wait for itself.
fn of_block(a: &Block3, b: &Block3) -> f64 {
    let mut sums = [0.0; 8];
    for (a, b) in a.flat().as_chunks::<8>().0.iter().zip(b.flat().as_chunks::<8>().0) {
        for k in 0..8 {
            sums[k] += f64::from(a[k]) * f64::from(b[k]);
        }
    }
    sums.iter().sum()
}

/// `y += factor x`.
pub(super) fn axpy(y: &mut [Block3], factor: f32, x: &[Block3]) {
    for_each(y, |slot, y| y.flat_mut().iter_mut().zip(x[slot].flat()).for_each(|(y, x)| *y += factor * x));
}

/// `y *= factor`.
pub(super) fn scale(y: &mut [Block3], factor: f32) {
    for_each(y, |_, y| y.flat_mut().iter_mut().for_each(|y| *y *= factor));
}
