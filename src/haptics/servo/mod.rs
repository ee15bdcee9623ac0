//! The loop of force: a hand's pose in, force out, once a tick.
//!
//! A clay frame says what its contact was some frames ago ([`ContactModel`]); what the hand feels now comes
//! of that at the hand's present pose. Four ways are at hand, [`Mode`]; the clay's tool follows the way
//! that the mode makes of the hand's ([`ServoSample::tool`]). In [`Mode::Coupled`] the force felt is the
//! force that the clay gets back; the others are there to compare.
//!
//! **Clay in slow motion.** The clay walks the whole of the hand's way in each frame, however little clay
//! time that takes: its force is a function of the way, not of the clock. The servo therefore takes the mean
//! force of a frame as what it felt over the hand's time of that frame ([`ContactModel::span`]), and never
//! its impulse in clay time over the hand's time, which would be too little by [`ContactModel::rate`]. What
//! of the clay's law depends on speed (viscosity, inertia) is then that of the clay's own speed, 1 / rate
//! of the hand's. A paused clay (rate 0) walks nothing: its models are no news, they age, and the age gate
//! fades the force out.

mod blade;
mod coupled;
mod felt;
mod held;
mod history;
mod ledger;
mod reading;
mod scale;
mod settings;
mod spheres;

pub use scale::ForceScale;
pub use settings::{Coupling, Hold, Mode, Placement, ServoSettings};

use super::device::{DeviceState, Servo};
use super::model::ContactModel;
use coupled::Coupled;
use felt::Hand;
use glam::{DQuat, DVec3};
use held::HeldForce;
use reading::Reading;
use spheres::SphereForce;

/// Time over which the force of another mode takes over \[s\]: 1 N comes in at 0.01 N/ms.
const MODE_RAMP: f64 = 0.1;

/// Time constant of the hand's velocity \[s\]: a filter of 57 Hz, with which virtual damping of 1 N s/m raises
/// the greatest stable stiffness by 30 % and one of 3 N s/m by 63 %.
const VELOCITY_TIME: f64 = 2.8e-3;

/// What a tick came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoSample {
    /// The device's clock \[s\].
    pub time: f64,
    /// Where the hand is, in the world \[m\].
    pub hand: DVec3,
    /// Where the clay's tool is to be \[m\]: its way through these places is the proxy's.
    pub tool: DVec3,
    /// How both are turned, in the world.
    pub rotation: DQuat,
    /// Force of the clay on the tool, in the world \[N\].
    pub clay_force: DVec3,
    /// Force on the hand, in the world \[N\]: the clay's by [`ForceScale`].
    pub hand_force: DVec3,
    /// Clay frame that it is of.
    pub frame: u64,
    /// Time since that came, 0 for one that was renewed in this tick \[s\].
    pub age: f64,
    /// Whether the tool touches.
    pub is_touching: bool,
    /// Whether the proxy is caught inside clay.
    pub is_caught: bool,
    /// Least gap of the proxy's spheres to the clay, Eq. 7 \[m\]; infinite where no mode looks at them.
    pub gap: f64,
    /// Pivots or sweeps that placed the proxy.
    pub iterations: u32,
}

/// Force of clay on a hand, without the ends of the channels: [`step`](Self::step) is one tick.
#[derive(Clone, Debug)]
pub struct ForceLoop {
    settings: ServoSettings,
    coupled: Coupled,
    held: HeldForce,
    spheres: SphereForce,
    reading: Reading,
    /// The last hand, in the world.
    hand: Option<Hand>,
    /// When the last model came, and how long a frame takes \[s\].
    arrival: f64,
    frame_time: f64,
    frame: u64,
    /// Force that another mode left, and when \[N, s\].
    left: (DVec3, f64),
    last: DVec3,
}

/// Frames as long as the servo takes them to be \[s\]: 250 Hz, the first, 20 Hz.
const FRAME_TIMES: [f64; 3] = [4e-3, 1.0 / 90.0, 50e-3];

impl ForceLoop {
    /// Of a hand that has not moved and clay that was not seen.
    pub fn new(settings: ServoSettings) -> Self {
        Self {
            settings,
            coupled: Coupled::new(),
            held: HeldForce::default(),
            spheres: SphereForce::new(),
            reading: Reading::default(),
            hand: None,
            arrival: f64::NEG_INFINITY,
            frame_time: FRAME_TIMES[1],
            frame: 0,
            left: (DVec3::ZERO, f64::NEG_INFINITY),
            last: DVec3::ZERO,
        }
    }

    /// The settings.
    pub fn settings(&self) -> &ServoSettings {
        &self.settings
    }

    /// Other settings, from the next tick on. Another mode takes over from zero while the old one's force
    /// fades.
    pub fn set(&mut self, settings: ServoSettings) {
        if settings.mode != self.settings.mode {
            self.left = (self.last, self.hand.map_or(f64::NEG_INFINITY, |hand| hand.time));
            self.coupled.forget();
            self.spheres.forget();
        }
        self.settings = settings;
    }

    /// Forgets hand and clay: another hand, somewhere else. Settings stay.
    pub fn forget(&mut self) {
        self.coupled.forget();
        self.spheres.forget();
        (self.held, self.hand, self.last) = (HeldForce::default(), None, DVec3::ZERO);
        self.reading = Reading::default();
        (self.arrival, self.left) = (f64::NEG_INFINITY, (DVec3::ZERO, f64::NEG_INFINITY));
    }

    /// A clay frame that has come. One of a paused clay is no news, and one that only renews what is known of
    /// clay at rest changes nothing but its age.
    pub fn receive(&mut self, model: &ContactModel) {
        let is_news = model.rate > 0.0 || model.is_resting;
        let now = self.hand.map_or(0.0, |hand| hand.time);
        if !is_news {
            return;
        }
        let is_renewed = model.is_resting && model.frame == self.frame;
        if !is_renewed {
            let [least, first, most] = FRAME_TIMES;
            let since = now - self.arrival;
            self.frame_time = if since.is_finite() { since.clamp(least, most) } else { first };
            self.frame = model.frame;
            match self.settings.mode {
                Mode::Coupled => self.coupled.receive(model, self.frame_time),
                Mode::ContactImpulse => self.held.receive(model, now, self.frame_time),
                Mode::GodObject | Mode::PaperAnchor { .. } => self.spheres.receive(model, now, self.frame_time),
            }
        }
        self.arrival = now;
    }

    /// The force at a pose of the device, `dt` \[s\] after the last.
    pub fn step(&mut self, state: &DeviceState, dt: f64) -> ServoSample {
        let hand = self.hand(state, dt);
        self.hand = Some(hand);
        let settings = &self.settings;
        let felt = match settings.mode {
            Mode::Coupled => self.coupled.step(&hand, settings.coupling_in_world()),
            Mode::ContactImpulse => self.held.step(&hand, settings.hold),
            Mode::GodObject | Mode::PaperAnchor { .. } => self.spheres.step(&hand, settings),
        };
        let share = ((hand.time - self.left.1) / MODE_RAMP).clamp(0.0, 1.0);
        let clay_force = felt.force * share + self.left.0 * (1.0 - share);
        self.last = clay_force;
        ServoSample {
            time: hand.time,
            hand: hand.position,
            tool: felt.tool,
            rotation: hand.rotation,
            clay_force,
            hand_force: settings.force.of(clay_force),
            frame: self.frame,
            age: hand.time - self.arrival,
            is_touching: felt.is_touching,
            is_caught: felt.is_caught,
            gap: felt.gap,
            iterations: felt.iterations,
        }
    }

    /// The hand in the world. Its velocity is that of its places: a driver's own filter is not known here.
    fn hand(&mut self, state: &DeviceState, dt: f64) -> Hand {
        let position = self.settings.placement.point(self.reading.place(state.position));
        let rotation = self.settings.placement.rotation * state.rotation;
        let velocity = self.hand.map_or(DVec3::ZERO, |last| {
            let share = 1.0 - (-dt / VELOCITY_TIME).exp();
            let raw = if dt > 0.0 { (position - last.position) / dt } else { last.velocity };
            last.velocity + share * (raw - last.velocity)
        });
        Hand { time: state.time, dt, position, rotation, velocity }
    }
}

/// [`ForceLoop`] with the ends of its channels: models and settings come in without waiting, samples leave
/// by a ring, and what the ring has no room for is counted.
pub struct ClayServo {
    force: ForceLoop,
    models: triple_buffer::Output<ContactModel>,
    settings: triple_buffer::Output<ServoSettings>,
    samples: rtrb::Producer<ServoSample>,
    /// Samples that found no room.
    lost: u64,
}

/// The other ends of a [`ClayServo`]'s channels.
pub struct ClayServoEnds {
    /// Clay frames.
    pub models: triple_buffer::Input<ContactModel>,
    /// Settings.
    pub settings: triple_buffer::Input<ServoSettings>,
    /// Ticks, in order.
    pub samples: rtrb::Consumer<ServoSample>,
}

impl ClayServo {
    /// A servo whose ring holds `capacity` samples: 2000 are two seconds.
    pub fn new(settings: ServoSettings, capacity: usize) -> (Self, ClayServoEnds) {
        let (models_in, models) = triple_buffer::triple_buffer(&ContactModel::NONE);
        let (settings_in, settings_out) = triple_buffer::triple_buffer(&settings);
        let (samples, samples_out) = rtrb::RingBuffer::new(capacity);
        let servo = Self { force: ForceLoop::new(settings), models, settings: settings_out, samples, lost: 0 };
        (servo, ClayServoEnds { models: models_in, settings: settings_in, samples: samples_out })
    }

    /// Takes in what has come, and makes the tick's sample: what a chain of safety stages goes on with.
    pub fn step(&mut self, state: &DeviceState, dt: f64) -> ServoSample {
        if self.settings.update() {
            self.force.set(*self.settings.output_buffer());
        }
        if self.models.update() {
            self.force.receive(self.models.output_buffer());
        }
        self.force.step(state, dt)
    }

    /// Hands a sample out; counts it if there is no room.
    pub fn push(&mut self, sample: ServoSample) {
        self.lost += u64::from(self.samples.push(sample).is_err());
    }

    /// Samples that found no room so far.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Forgets hand and clay: see [`ForceLoop::forget`].
    pub fn forget(&mut self) {
        self.force.forget();
    }

    /// A force in the device's frame, in the world.
    pub fn to_world(&self, force: DVec3) -> DVec3 {
        self.force.settings.placement.rotation * force
    }

    /// A force in the world, in the device's frame.
    pub fn to_device(&self, force: DVec3) -> DVec3 {
        self.force.settings.placement.rotation.conjugate() * force
    }
}

impl Servo for ClayServo {
    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        let sample = self.step(state, dt);
        self.push(sample);
        self.to_device(sample.hand_force)
    }
}

#[cfg(test)]
mod tests;
