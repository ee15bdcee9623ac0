//! What L-BFGS keeps while it searches: the step that is tried, and pairs of steps and of what they changed.

use super::super::super::implicit::{CURVATURE_MIN, PAIRS};
use super::vectors::{Block3, Vector, add, dot, dot_of, for_each, sum_over};

/// A pair s, y, and `s . y`.
#[derive(Debug, Default)]
pub(super) struct Pair {
    pub(super) step: Vector,
    pub(super) change: Vector,
    pub(super) product: f64,
}

/// The vectors of the search.
#[derive(Debug, Default)]
pub(super) struct Search {
    /// Where the step starts.
    pub(super) before: Vector,
    pub(super) step: Vector,
    /// How the residual changes along it.
    pub(super) change: Vector,
    /// What the cycle is given, and what it makes of it.
    pub(super) q: Vector,
    pub(super) z: Vector,
    /// The oldest first.
    pub(super) pairs: Vec<Pair>,
    /// The step where only a part of it was possible.
    whole: Vector,
    /// Out of use.
    spare: Vec<Pair>,
}

/// Sums along a step that was tried.
pub(super) struct Tried {
    /// Of the step with the residual at its end.
    pub(super) slope: f64,
    /// Of the step with the change, of each with itself.
    pub(super) product: f64,
    pub(super) squares: [f64; 2],
}

impl Search {
    /// Makes room, and knows no pairs.
    pub(super) fn begin(&mut self, slots: usize) {
        self.forget();
        for vector in [&mut self.before, &mut self.step, &mut self.change, &mut self.q, &mut self.z, &mut self.whole] {
            vector.resize(slots, Block3::ZERO);
        }
    }

    /// Knows no pairs any more.
    pub(super) fn forget(&mut self) {
        self.spare.append(&mut self.pairs);
    }

    /// Makes the way to `u` the step, and sets the step itself aside.
    pub(super) fn take_way(&mut self, u: &Vector) {
        std::mem::swap(&mut self.step, &mut self.whole);
        self.step.clone_from(u);
        let before = &self.before;
        for_each(&mut self.step, |slot, step| add(step, -1.0, &before[slot]));
    }

    /// Takes the step again that was set aside.
    pub(super) fn take_step_again(&mut self) {
        std::mem::swap(&mut self.step, &mut self.whole);
    }

    /// The sums of the step and its change.
    pub(super) fn sums(&self) -> Tried {
        let (step, change) = (&self.step, &self.change);
        Tried { slope: 0.0, product: dot(step, change), squares: [dot(step, step), dot(change, change)] }
    }

    /// Keeps the step and the change, if they tell of the curvature, in place of the oldest pair.
    pub(super) fn keep(&mut self, tried: &Tried) {
        if tried.product <= CURVATURE_MIN * (tried.squares[0] * tried.squares[1]).sqrt() {
            return;
        }
        if self.pairs.len() == PAIRS {
            self.spare.push(self.pairs.remove(0));
        }
        let mut pair = self.spare.pop().unwrap_or_default();
        let slots = self.step.len();
        for (kept, new) in [(&mut pair.step, &mut self.step), (&mut pair.change, &mut self.change)] {
            kept.resize(slots, Block3::ZERO);
            std::mem::swap(kept, new);
        }
        pair.product = tried.product;
        self.pairs.push(pair);
    }

    /// Of the pairs `s_i . r`, then `s_i . y_j` of those after it.
    pub(super) fn products(&self, residual: &[Block3]) -> ([f64; PAIRS], [[f64; PAIRS]; PAIRS]) {
        let pairs = &self.pairs;
        let sums: [f64; PAIRS + PAIRS * PAIRS] = sum_over(residual.len(), |slot| {
            let mut sums = [0.0; PAIRS + PAIRS * PAIRS];
            for (i, pair) in pairs.iter().enumerate() {
                sums[i] = dot_of(&pair.step[slot], &residual[slot]);
                for (j, later) in pairs.iter().enumerate().skip(i + 1) {
                    sums[PAIRS + i * PAIRS + j] = dot_of(&pair.step[slot], &later.change[slot]);
                }
            }
            sums
        });
        (std::array::from_fn(|i| sums[i]), std::array::from_fn(|i| std::array::from_fn(|j| sums[PAIRS + i * PAIRS + j])))
    }
}
