//! The least of the potential, as the oracle's file of this name has it: L-BFGS with a few pairs about the
//! V-cycle, full steps, guarded by slopes.

use super::super::super::health::Health;
use super::super::super::implicit::{CUT, OVERTIME, PAIRS, RESIDUAL_LOST, longer};
use super::System;
use super::kernel::Purpose;
use super::search::{Search, Tried};
use super::vectors::{Block3, Vector, add, dot, dot_of, for_each, set_sum, sum_each, sum_over};
use std::time::Instant;

/// What came of the iterations.
pub(super) struct Least {
    /// Evaluations of the slope.
    pub(super) passes: u32,
    /// Steps cut.
    pub(super) rejected: u32,
}

impl System<'_> {
    /// Goes down from the guess in `u` with at most `passes` evaluations, [`OVERTIME`] times as many where
    /// they leave it lost. A cell that is turned inside out even where the clay stands still is a step too
    /// long.
    pub(super) fn minimise(&mut self, passes: u32) -> Result<Least, Health> {
        let mut least = Least { passes: 1, rejected: 0 };
        self.search.begin(self.u.len());
        self.sides.begin(&mut self.u);
        if !self.evaluate(Purpose::Begin) {
            self.hold_still();
            self.sides.begin(&mut self.u);
            if !self.evaluate(Purpose::Begin) {
                return Err(Health::SPEED);
            }
            least.passes = 2;
        }
        self.accept();
        self.sides.settle(&self.u, &self.accepted.residual);
        if least.passes == 1 && passes > 1 {
            self.try_still(passes, &mut least);
        }
        self.go_down(passes, &mut least);
        let searched = self.searched();
        let residual = searched.as_ref().unwrap_or(&self.accepted.residual);
        if dot(residual, residual).sqrt() > RESIDUAL_LOST * self.scale {
            self.go_down(OVERTIME * passes, &mut least);
        }
        Ok(least)
    }

    /// Steps until there were `passes` evaluations.
    fn go_down(&mut self, passes: u32, least: &mut Least) {
        while least.passes < passes {
            let mut slope = self.find_direction();
            if slope >= 0.0 {
                self.search.forget();
                slope = self.find_direction();
            }
            let Some(tried) = self.descend(slope, passes, least) else {
                self.search.forget();
                continue;
            };
            self.accept();
            self.sides.settle(&self.u, &self.accepted.residual);
            self.keep(tried);
        }
    }

    /// The slope at u: of `passes` evaluations the next. Where `is_anew` the preconditioner is set up there,
    /// unless it is the last.
    fn evaluate_next(&mut self, is_anew: bool, passes: u32, least: &mut Least) -> bool {
        least.passes += 1;
        self.evaluate(match () {
            () if least.passes == passes => Purpose::Judge,
            () if is_anew => Purpose::Anew,
            () => Purpose::Search,
        })
    }

    /// Keeps the step and the change of the slope, of what is searched.
    fn keep(&mut self, mut tried: Tried) {
        if !self.sides.is_empty() {
            self.sides.take_ways(&mut self.search.step);
            self.sides.take_reactions(&mut self.search.change);
            tried = self.search.sums();
        }
        self.search.keep(&tried);
    }

    /// Goes back to where the clay stands still, if it is lower there: tried where motion as it was leads up
    /// by more than its inertia, which is all that drives clay that was in balance. Either way that tells of
    /// the curvature.
    fn try_still(&mut self, passes: u32, least: &mut Least) {
        let (u, nodes, residual) = (&self.u, &self.nodes, &self.accepted.residual);
        let [back, inertia] = sum_each(&mut self.search.step, |slot, step| {
            let (mut inertia, free) = (0.0, &nodes.free[slot]);
            for d in 0..3 {
                for k in 0..64 {
                    step.0[d][k] = -free.0[d][k] * u[slot].0[d][k];
                    inertia += f64::from(nodes.mass[slot][k] * step.0[d][k] * step.0[d][k]);
                }
            }
            [dot_of(step, &residual[slot]), inertia]
        });
        if -back <= inertia {
            return;
        }
        std::mem::swap(&mut self.search.before, &mut self.u);
        self.go();
        let is_sound = self.evaluate_next(false, passes, least);
        let tried = self.judge();
        if is_sound && tried.slope <= -back {
            self.accept();
            self.sides.settle(&self.u, &self.accepted.residual);
        } else {
            std::mem::swap(&mut self.search.before, &mut self.u);
        }
        if is_sound {
            self.keep(tried);
        }
    }

    /// Goes the step, which goes down by `slope`, on while that hardly changes, or cut until the potential
    /// falls, and short of where sides of cuts would pass through each other; none, with `u` where it is
    /// lowest, when the passes are used up, or where pairs have led too far. Where the preconditioner has, it
    /// did not know what is met there, and is set up anew.
    fn descend(&mut self, mut slope: f64, passes: u32, least: &mut Least) -> Option<Tried> {
        std::mem::swap(&mut self.search.before, &mut self.u);
        // How many times as far as the step the last led that was rejected.
        let (mut is_anew, mut beyond) = (false, f64::INFINITY);
        while least.passes < passes {
            self.go();
            let is_bounded = self.sides.close(&mut self.u);
            if is_bounded {
                self.search.take_way(&self.u);
            }
            let is_sound = self.evaluate_next(is_anew, passes, least);
            let tried = self.judge();
            let rubbed = self.sides.work(&self.search.step);
            let old = if is_bounded { dot(&self.search.step, &self.accepted.residual) + rubbed } else { slope };
            let new = tried.slope + rubbed;
            if is_sound && new <= -old {
                let by = longer([old, new], beyond).filter(|_| self.sides.is_empty() && least.passes < passes);
                let Some(by) = by else { return Some(tried) };
                self.accept();
                std::mem::swap(&mut self.search.before, &mut self.u);
                (slope, is_anew, beyond) = (self.scale_step(by), false, (beyond - 1.0) / by);
                continue;
            }
            least.rejected += 1;
            let short = if is_sound { old / (old - new) } else { 0.5 * (CUT[0] + CUT[1]) };
            if is_bounded {
                self.search.take_step_again();
            }
            let is_lost = short < CUT[0] && self.sides.is_empty();
            if is_lost && (is_anew || !self.search.pairs.is_empty()) {
                break;
            }
            is_anew = is_lost;
            let cut = short.clamp(CUT[0], CUT[1]);
            (slope, beyond) = (self.scale_step(cut) + self.sides.work(&self.search.step), 1.0 / cut);
        }
        std::mem::swap(&mut self.search.before, &mut self.u);
        None
    }

    /// Makes the step so many times as long. Returns its product with the residual.
    #[expect(clippy::cast_possible_truncation, reason = "vectors are f32")]
    fn scale_step(&mut self, by: f64) -> f64 {
        let accepted = &self.accepted.residual;
        let [slope] = sum_each(&mut self.search.step, |slot, step| {
            step.flat_mut().iter_mut().for_each(|s| *s *= by as f32);
            [dot_of(step, &accepted[slot])]
        });
        slope
    }

    /// The change of the residual along the step, and its sums.
    fn judge(&mut self) -> Tried {
        let (step, new, old) = (&self.search.step, &self.slope.residual, &self.accepted.residual);
        let [slope, product, s2, y2] = sum_each(&mut self.search.change, |slot, change| {
            let (step, new) = (&step[slot], &new[slot]);
            set_sum(change, new, -1.0, &old[slot]);
            [dot_of(step, new), dot_of(step, change), dot_of(step, step), dot_of(change, change)]
        });
        Tried { slope, product, squares: [s2, y2] }
    }

    /// The step: minus the approximate inverse of the curvature, times the residual. Returns its product with
    /// the residual. All sums that the pairs need are taken before the cycle and after it, in one go each.
    #[expect(clippy::cast_possible_truncation, reason = "vectors are f32")]
    fn find_direction(&mut self) -> f64 {
        let began = Instant::now();
        let searched = self.searched();
        let residual = searched.as_ref().unwrap_or(&self.accepted.residual);
        let (along, between) = self.search.products(residual);
        let Search { step, q, z, pairs, .. } = &mut *self.search;
        let mut shares = [0.0; PAIRS];
        for (i, pair) in pairs.iter().enumerate().rev() {
            let later: f64 = (i + 1..pairs.len()).map(|j| shares[j] * between[i][j]).sum();
            shares[i] = (along[i] - later) / pair.product;
        }
        for_each(q, |slot, q| {
            *q = residual[slot];
            for (pair, share) in pairs.iter().zip(&shares) {
                add(q, -*share as f32, &pair.change[slot]);
            }
        });
        self.sides.take_reactions(q);
        self.multigrid.cycle(q, z);
        self.sides.take_ways(z);
        let others: [f64; PAIRS] = sum_over(z.len(), |slot| {
            let mut sums = [0.0; PAIRS];
            pairs.iter().zip(&mut sums).for_each(|(pair, sum)| *sum = dot_of(&pair.change[slot], &z[slot]));
            sums
        });
        let mut factors = [0.0; PAIRS];
        for (i, pair) in pairs.iter().enumerate() {
            let before: f64 = (0..i).map(|j| factors[j] * between[j][i]).sum();
            factors[i] = shares[i] - (others[i] + before) / pair.product;
        }
        let accepted = &self.accepted.residual;
        let [mut slope] = sum_each(step, |slot, step| {
            set_sum(step, &Block3::ZERO, -1.0, &z[slot]);
            for (pair, factor) in pairs.iter().zip(&factors) {
                add(step, -*factor as f32, &pair.step[slot]);
            }
            [dot_of(step, &accepted[slot])]
        });
        if !self.sides.is_empty() {
            self.sides.take_ways(step);
            slope = dot(step, accepted) + self.sides.work(step);
        }
        self.seconds += began.elapsed().as_secs_f64();
        slope
    }

    /// The residual with the friction of cuts, along what is searched; none where that is the residual.
    pub(super) fn searched(&self) -> Option<Vector> {
        if self.sides.is_empty() {
            return None;
        }
        let mut searched = self.accepted.residual.clone();
        self.sides.rub(&mut searched);
        self.sides.take_reactions(&mut searched);
        Some(searched)
    }

    /// Adds the step to where it starts.
    fn go(&mut self) {
        let (before, step) = (&self.search.before, &self.search.step);
        self.u.resize(before.len(), Block3::ZERO);
        for_each(&mut self.u, |slot, u| set_sum(u, &before[slot], 1.0, &step[slot]));
    }
}
