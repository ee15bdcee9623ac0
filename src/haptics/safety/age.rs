//! The age of what is known of the clay, and what it does to the force.

use crate::haptics::model::ContactModel;
use glam::DVec3;

/// Up to this age a model is young \[s\]: three frames of 90 Hz.
pub const YOUNG: f64 = 0.033;
/// From here on it is gone \[s\]: a tenth of a second after it is no longer young, which a hand feels as
/// letting go.
pub const GONE: f64 = YOUNG + 0.1;
/// A tool that feels less than this \[N\] is free of the clay: a tenth of the least force that a hand notices
/// on a Touch, whose own friction is .1 N and more.
const FREE: f64 = 0.01;

/// Tells how old the model of the clay is. A frame of clay that moves, or that is known to rest, is as old
/// as its stamp; paused clay, which neither moves nor rests, is as old as the last frame before the pause,
/// however often it is published.
#[derive(Clone, Copy, Debug)]
pub struct ModelClock {
    /// Stamp of the last frame that was true \[s\].
    stamp: f64,
}

impl Default for ModelClock {
    fn default() -> Self {
        Self { stamp: f64::NEG_INFINITY }
    }
}

impl ModelClock {
    /// Age \[s\] of what is known of the clay at `now` \[s\], by the clock of the model's stamps; infinite
    /// before the first model, and where a stamp is no number.
    pub fn age(&mut self, model: &ContactModel, now: f64) -> f64 {
        if model.rate > 0.0 || model.is_resting {
            self.stamp = model.stamp;
        }
        let age = now - self.stamp;
        if age.is_nan() { f64::INFINITY } else { age.max(0.0) }
    }
}

/// Lets the force of a young model through, fades that of an old one, and once it is gone lets nothing
/// through until the tool is free of the clay: a hand that moved on through clay that stood still does not
/// find itself deep in it. (Before the first model there was no such clay: a hand that starts within it is
/// let in by the ramp.)
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AgeGate {
    has_begun: bool,
    is_latched: bool,
    is_closing: bool,
}

impl AgeGate {
    /// What comes through of a force \[N\] of a model of that age \[s\].
    pub(crate) fn pass(&mut self, force: DVec3, age: f64) -> DVec3 {
        // An age that is no number is past all ages.
        let is_young = age <= YOUNG;
        self.has_begun |= is_young;
        self.is_latched |= self.has_begun && (age >= GONE || age.is_nan());
        self.is_latched &= !(is_young && force.length() < FREE);
        self.is_closing = self.is_latched || !is_young;
        match (self.is_shut(), is_young) {
            (true, _) => DVec3::ZERO,
            (false, true) => force,
            (false, false) => force * (1.0 - (age - YOUNG) / (GONE - YOUNG)),
        }
    }

    /// Whether it lets less than all through.
    pub(crate) fn is_closing(&self) -> bool {
        self.is_closing
    }

    /// Whether it lets nothing through: until the tool is free, or before the first model.
    pub(crate) fn is_shut(&self) -> bool {
        self.is_latched || !self.has_begun
    }
}
