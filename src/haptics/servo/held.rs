//! The clay's own force, as its frames say it.

use super::felt::{Felt, Hand};
use super::settings::Hold;
use crate::haptics::model::ContactModel;
use glam::DVec3;

/// The last two forces of the clay.
#[derive(Clone, Debug)]
pub(super) struct HeldForce {
    forces: [DVec3; 2],
    arrival: f64,
    frame_time: f64,
    felt: DVec3,
}

impl Default for HeldForce {
    fn default() -> Self {
        Self { forces: [DVec3::ZERO; 2], arrival: f64::NEG_INFINITY, frame_time: 1.0, felt: DVec3::ZERO }
    }
}

impl HeldForce {
    pub(super) fn receive(&mut self, model: &ContactModel, now: f64, frame_time: f64) {
        *self = Self { forces: [self.felt, model.force], arrival: now, frame_time, felt: self.felt };
    }

    /// The tool is where the hand is.
    pub(super) fn step(&mut self, hand: &Hand, hold: Hold) -> Felt {
        let share = match hold {
            Hold::Held => 1.0,
            Hold::Blended => ((hand.time - self.arrival) / self.frame_time).clamp(0.0, 1.0),
        };
        self.felt = self.forces[0].lerp(self.forces[1], share);
        Felt::new(self.felt, hand.position)
    }
}
