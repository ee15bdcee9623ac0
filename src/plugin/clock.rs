//! The clay's own clock and weight.

use crate::sim::params::ParamsError;
use bevy::prelude::*;
use glam::DVec3;

/// The clock of a piece of clay: how its time goes against that of its schedule, which is the app's virtual
/// clock in [`Update`].
///
/// Clay whose time stands is not touched: tools are lifted from it and put down anew, where they are then,
/// when it goes on. The same holds when the app's own clock is paused, when the clay's systems did not run
/// for a while, and when the app slept for more than five seconds.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
pub struct ClayClock {
    /// Whether the clay's time stands.
    pub paused: bool,
    /// Seconds of clay per second of the app: 0.1 is slow motion. The tools stay where the hand is, so that
    /// to slow clay they are fast. Finite and not negative; 0 is a pause.
    pub speed: f64,
}

impl Default for ClayClock {
    fn default() -> Self {
        Self { paused: false, speed: 1.0 }
    }
}

impl ClayClock {
    /// Whether time stands.
    pub fn stands(&self) -> bool {
        self.paused || self.speed == 0.0
    }

    /// # Errors
    /// A speed that no time can have.
    pub(super) fn validate(&self) -> Result<(), ParamsError> {
        let is_sound = self.speed.is_finite() && self.speed >= 0.0;
        is_sound.then_some(()).ok_or_else(|| ParamsError::new("clock speed", self.speed, "must be finite and not negative"))
    }
}

/// Gravity \[m/s^2\] of all clay, in the frame of the world: clay that turns is pulled down all the same.
/// [`ClaySettings::gravity`](super::clay::ClaySettings::gravity) overrides it for one.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Resource, Clone, Debug, Default, PartialEq)]
pub struct ClayGravity(pub DVec3);

impl Default for ClayGravity {
    /// That of the earth, along -Y.
    fn default() -> Self {
        Self(DVec3::NEG_Y * 9.81)
    }
}

/// An app that was away for longer than this \[s\] was asleep: its tools have been somewhere in between, and
/// nobody knows where. A frame drawn by software takes less, on a busy machine too: each time a knife is put
/// down anew it begins a cut of its own, and the more cuts cross, the longer steps take.
pub(super) const SLEPT: f64 = 5.0;

/// Tells time that went by without the clay.
#[derive(Debug, Default)]
pub(super) struct Gap {
    /// The schedule's clock and the real one when the clay last looked \[s\].
    last: Option<(f64, f64)>,
}

impl Gap {
    /// Real time \[s\] since the last look, and whether the schedule left some of its own out meanwhile, or the
    /// app slept.
    pub(super) fn look(&mut self, time: &Time, real: &Time<Real>) -> (f64, bool) {
        /// Clocks are sums of floating point numbers.
        const ROUNDING: f64 = 1e-6;
        let (now, real_now) = (time.elapsed_secs_f64(), real.elapsed_secs_f64());
        let Some((last, real_last)) = self.last.replace((now, real_now)) else { return (0.0, false) };
        let is_skipped = now - time.delta_secs_f64() > last + ROUNDING;
        (real_now - real_last, is_skipped || real.delta_secs_f64() > SLEPT)
    }
}
