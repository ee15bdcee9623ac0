//! An arm in a hand, in virtual time: ticks of its servo, and clay frames that it gets when they would come.

use super::device::simulated::SimulatedArm;
use super::device::trace::TraceTick;
use super::device::{DeviceState, Servo};
use super::model::ContactModel;
use super::servo::{ClayServoEnds, ServoSample};
use glam::DVec3;
use std::collections::VecDeque;

/// Arm, hand and servo.
pub struct VirtualHand {
    /// Arm and hand.
    pub arm: SimulatedArm,
    servo: Box<dyn Servo>,
    ends: ClayServoEnds,
    /// Models on their way, and when they come \[s\].
    arriving: VecDeque<(f64, ContactModel)>,
}

/// What happened in a spell of time.
#[derive(Clone, Debug, Default)]
pub struct Spell {
    /// Samples of the servo.
    pub samples: Vec<ServoSample>,
    /// Ticks of the device: what it sensed, and the force that the servo asked for.
    pub ticks: Vec<TraceTick>,
}

impl VirtualHand {
    /// A hand whose arm runs `servo`, with the other ends of its channels; the ring of samples has to hold
    /// those between two steps of the arm.
    pub fn new(arm: SimulatedArm, mut servo: Box<dyn Servo>, ends: ClayServoEnds) -> Self {
        servo.begin(&arm.info());
        Self { arm, servo, ends, arriving: VecDeque::new() }
    }

    /// Runs the arm until `end` \[s\] of its time.
    pub fn feel(&mut self, end: f64) -> Spell {
        let mut spell = Spell::default();
        while self.arm.time() < end {
            while let Some((_, model)) = self.arriving.pop_front_if(|(at, _)| *at <= self.arm.time()) {
                self.ends.models.write(model);
            }
            let mut noted = Noted { servo: &mut *self.servo, ticks: &mut spell.ticks };
            self.arm.advance(&mut noted);
            while let Ok(sample) = self.ends.samples.pop() {
                spell.samples.push(sample);
            }
        }
        spell
    }

    /// A clay frame's model that comes at `time` \[s\], later than those before.
    pub fn send(&mut self, time: f64, model: ContactModel) {
        self.arriving.push_back((time, model));
    }
}

/// A servo whose ticks are noted.
struct Noted<'a> {
    servo: &'a mut dyn Servo,
    ticks: &'a mut Vec<TraceTick>,
}

impl Servo for Noted<'_> {
    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        let force = self.servo.tick(state, dt);
        self.ticks.push(TraceTick { state: *state, force });
        force
    }
}
