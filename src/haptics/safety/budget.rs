//! How much force motors bear for long.

use glam::DVec3;

/// Time over which the square of the force is averaged \[s\]: motors of this size warm within tens of seconds;
/// ten are on the safe side.
const TIME: f64 = 10.0;
/// Share of the limit from which the force is lowered \[-\].
const EASE: f64 = 0.8;
/// Temperature, of its limit 1, from which the force is lowered \[-\]; it is zero at the limit.
const WARM: f64 = 0.8;

/// Leaky mean of the force's square, as motors warm by it.
///
/// `q' = (|f|^2 - q) / TIME`. From `EASE` of the limit on the greatest force goes down to the continuous one,
/// which it has at the limit; there `q'` is zero, so q does not pass it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    /// Mean of the square of the force \[N^2\].
    mean_square: f64,
    /// Force that is borne for ever \[N\].
    limit: f64,
}

impl Budget {
    pub(crate) fn new(continuous_force: f64) -> Self {
        Self { mean_square: 0.0, limit: continuous_force }
    }

    /// Share of the limit that is used \[-\].
    pub(crate) fn load(&self) -> f64 {
        if self.limit > 0.0 { self.mean_square / (self.limit * self.limit) } else { 1.0 }
    }

    /// Greatest force now \[N\], of `force_max` with cold motors.
    pub(crate) fn force_max(&self, force_max: f64, temperature: f64) -> f64 {
        let ease = ((self.load() - EASE) / (1.0 - EASE)).clamp(0.0, 1.0);
        let by_load = force_max + ease * (self.limit.min(force_max) - force_max);
        // A temperature that is no number is one of a device that does not know it.
        let warmth = ((temperature - WARM) / (1.0 - WARM)).clamp(0.0, 1.0);
        let share = if warmth.is_nan() { 1.0 } else { 1.0 - warmth };
        by_load * share
    }

    /// Takes in what the hand gets for `dt` \[s\].
    pub(crate) fn take(&mut self, force: DVec3, dt: f64) {
        self.mean_square += (force.length_squared() - self.mean_square) * (dt / TIME).min(1.0);
    }
}
