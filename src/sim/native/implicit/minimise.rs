//! The least of the potential, as the oracle's file of this name has it: L-BFGS with two pairs about the
//! V-cycle, full steps, guarded by slopes.

use super::super::super::health::Health;
use super::super::super::implicit::{CURVATURE_MIN, CUT, PAIRS};
use super::System;
use super::vectors::{Block3, Vector, axpy, dot, scale};

/// What came of the iterations.
pub(super) struct Least {
    /// Evaluations of the slope.
    pub(super) passes: u32,
    /// Steps cut.
    pub(super) rejected: u32,
}

/// A pair s, y, and `s . y`.
struct Pair {
    step: Vector,
    change: Vector,
    product: f64,
}

impl System<'_> {
    /// Goes down from the guess in `u` with at most `passes` evaluations. A cell that is turned inside out
    /// even where the clay stands still is a step too long.
    pub(super) fn minimise(&mut self, passes: u32) -> Result<Least, Health> {
        let mut least = Least { passes: 1, rejected: 0 };
        if !self.evaluate(true) {
            self.hold_still();
            if !self.evaluate(true) {
                return Err(Health::SPEED);
            }
            least.passes = 2;
        }
        self.accept();
        let mut pairs: Vec<Pair> = vec![];
        while least.passes < passes {
            let mut step = self.direction(&pairs);
            if dot(&step, &self.accepted.residual) >= 0.0 {
                pairs.clear();
                step = self.direction(&pairs);
            }
            if !self.descend(&mut step, passes, &mut least) {
                break;
            }
            let mut change = self.slope.residual.clone();
            axpy(&mut change, -1.0, &self.accepted.residual);
            self.accept();
            let product = dot(&step, &change);
            if product > CURVATURE_MIN * (dot(&step, &step) * dot(&change, &change)).sqrt() {
                pairs.push(Pair { step, change, product });
                if pairs.len() > PAIRS {
                    pairs.remove(0);
                }
            }
        }
        Ok(least)
    }

    /// Adds `step` to `u`, cut until the potential falls; false, with `u` as it was, when the passes are used
    /// up.
    #[expect(clippy::cast_possible_truncation, reason = "vectors are f32")]
    fn descend(&mut self, step: &mut Vector, passes: u32, least: &mut Least) -> bool {
        let before = self.u.clone();
        while least.passes < passes {
            axpy(&mut self.u, 1.0, step);
            let is_sound = self.evaluate(false);
            least.passes += 1;
            let (old, new) = (dot(step, &self.accepted.residual), dot(step, &self.slope.residual));
            if is_sound && new <= -old {
                return true;
            }
            least.rejected += 1;
            let cut = if is_sound { (old / (old - new)).clamp(CUT[0], CUT[1]) } else { 0.5 * (CUT[0] + CUT[1]) };
            scale(step, cut as f32);
            self.u.clone_from(&before);
        }
        false
    }

    /// Minus the approximate inverse of the curvature, times the residual.
    #[expect(clippy::cast_possible_truncation, reason = "vectors are f32")]
    fn direction(&mut self, pairs: &[Pair]) -> Vector {
        let mut q = self.accepted.residual.clone();
        let mut shares = vec![];
        for pair in pairs.iter().rev() {
            let share = dot(&pair.step, &q) / pair.product;
            axpy(&mut q, -share as f32, &pair.change);
            shares.push(share);
        }
        let mut z = vec![Block3::ZERO; q.len()];
        self.multigrid.cycle(&q, &mut z);
        for (pair, share) in pairs.iter().zip(shares.iter().rev()) {
            let other = dot(&pair.change, &z) / pair.product;
            axpy(&mut z, (share - other) as f32, &pair.step);
        }
        scale(&mut z, -1.0);
        z
    }
}
