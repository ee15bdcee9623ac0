//! The solution of Eq. 6 in tangent planes as Yu et al. find it: Gauss-Seidel on the multipliers, each kept
//! from pulling.

use super::pairs::{PAIR_MAX, Pairs};
use super::solution::Solution;
use glam::DVec3;

/// Sweeps before the search ends without an answer.
pub const SWEEP_MAX: u32 = 2000;

/// Change of place in a sweep at which it ends \[m\].
const CONVERGED: f64 = 1e-6;

/// Multipliers by the names of their pairs \[N\]: where the next search begins.
#[derive(Clone, Debug)]
pub struct Multipliers {
    ids: [u64; PAIR_MAX],
    values: [f64; PAIR_MAX],
    count: usize,
}

impl Default for Multipliers {
    fn default() -> Self {
        Self { ids: [0; PAIR_MAX], values: [0.0; PAIR_MAX], count: 0 }
    }
}

impl Multipliers {
    /// The place nearest to `target` by the stiffness that is outside all planes, within a micrometre.
    pub fn solve(&mut self, pairs: &Pairs, stiffness: DVec3, target: DVec3) -> Solution {
        let (planes, weight) = (pairs.constraints(), stiffness.recip());
        let mut values = self.warm(pairs);
        let mut inverse = [0.0; PAIR_MAX];
        let mut x = target;
        for (i, plane) in planes.iter().enumerate() {
            inverse[i] = 1.0 / (weight * plane.normal).dot(plane.normal);
            x += weight * plane.normal * values[i];
        }
        let (mut iterations, mut is_feasible) = (0, false);
        while !is_feasible && iterations < SWEEP_MAX {
            iterations += 1;
            let mut greatest = 0.0f64;
            for (i, plane) in planes.iter().enumerate() {
                let value = (values[i] - plane.gap(x) * inverse[i]).max(0.0);
                let change = value - values[i];
                if change != 0.0 {
                    values[i] = value;
                    x += weight * plane.normal * change;
                    greatest = greatest.max(change.abs() / inverse[i]);
                }
            }
            is_feasible = greatest < CONVERGED;
        }
        self.count = planes.len();
        self.ids[..planes.len()].copy_from_slice(pairs.ids());
        self.values[..planes.len()].copy_from_slice(&values[..planes.len()]);
        Solution { position: x, iterations, is_feasible }
    }

    /// The multipliers of the pairs that were there before, 0 for the others.
    fn warm(&self, pairs: &Pairs) -> [f64; PAIR_MAX] {
        let mut values = [0.0; PAIR_MAX];
        let mut next = 0;
        for (id, value) in self.ids[..self.count].iter().zip(&self.values) {
            // Most pairs stay, in their order.
            if *value > 0.0
                && let Some(at) = pairs.find(*id, next)
            {
                values[at] = *value;
                next = at + 1;
            }
        }
        values
    }
}
