//! The clock of a clay: frames that come at a rate, late, off time, not at all.

use super::super::model::ContactModel;
use super::super::servo::ServoSample;
use super::bed::Random;
use super::clay::ReferenceClay;
use glam::DVec3;

/// Parts that the way of a tick is walked in: what yields within a tick yields in parts.
const PARTS: usize = 4;

/// Way of a tool in a frame below which clay at rest counts as left alone \[m\].
const STILL: f64 = 1e-9;

/// How frames come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames {
    /// Frames a second \[Hz\].
    pub rate: f64,
    /// From the end of a frame's way to the servo \[s\].
    pub latency: f64,
    /// How far a frame's time may be off, of its length [-].
    pub jitter: f64,
    /// Part of the frames that are lost on the way [-].
    pub lost: f64,
    /// When no frame ends, from and for how long \[s\].
    pub stall: Option<[f64; 2]>,
    /// Clay time that a second takes [-].
    pub clay_rate: f64,
    /// How the models err.
    pub errors: ModelErrors,
}

/// What is wrong with a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelErrors {
    /// Stiffness said over true stiffness [-].
    pub stiffness: f64,
    /// Slope of the yield force said over the true one [-].
    pub yield_slope: f64,
    /// Greatest error of force and yield force, of either by itself [-].
    pub noise: f64,
}

impl ModelErrors {
    /// None.
    pub const NONE: Self = Self { stiffness: 1.0, yield_slope: 1.0, noise: 0.0 };
}

impl Default for Frames {
    /// 90 Hz, a frame late.
    fn default() -> Self {
        Self { rate: 90.0, latency: 1.0 / 90.0, jitter: 0.0, lost: 0.0, stall: None, clay_rate: 1.0, errors: ModelErrors::NONE }
    }
}

/// A clay with its clock.
#[derive(Clone, Debug)]
pub struct ClockedClay {
    /// The clay.
    pub clay: ReferenceClay,
    frames: Frames,
    random: Random,
    next: f64,
    number: u64,
    pending: Vec<(f64, ContactModel)>,
    /// Of this frame: time, impulse \[N s\], integral of the place \[m s\], way \[m\].
    span: Option<[f64; 2]>,
    impulse: DVec3,
    moment: DVec3,
    way: f64,
    last: ServoSample,
    last_force: DVec3,
    /// Impulse on the tool from the start, by the hand's time \[N s\].
    pub total: DVec3,
    latest: ContactModel,
}

impl ClockedClay {
    /// A clay before its first frame.
    pub fn new(clay: ReferenceClay, frames: Frames) -> Self {
        Self {
            clay,
            frames,
            random: Random(88_172_645_463_325_252),
            next: 1.0 / frames.rate,
            number: 0,
            pending: vec![],
            span: None,
            impulse: DVec3::ZERO,
            moment: DVec3::ZERO,
            way: 0.0,
            last: ServoSample::default(),
            last_force: DVec3::ZERO,
            total: DVec3::ZERO,
            latest: ContactModel::NONE,
        }
    }

    /// The tool follows a tick of the servo; the force on it then \[N\].
    pub fn follow(&mut self, sample: &ServoSample) -> DVec3 {
        let Some(span) = &mut self.span else {
            self.span = Some([sample.time; 2]);
            self.last_force = self.clay.force(sample.tool);
            self.last = *sample;
            return self.last_force;
        };
        span[1] = sample.time;
        let (from, part) = (self.last, (sample.time - self.last.time) / PARTS as f64);
        for i in 1..=PARTS {
            let share = i as f64 / PARTS as f64;
            let force = self.clay.force(from.tool.lerp(sample.tool, share));
            let impulse = 0.5 * (force + self.last_force) * part;
            self.impulse += impulse;
            self.total += impulse;
            self.moment += part * from.tool.lerp(sample.tool, share - 0.5 / PARTS as f64);
            self.last_force = force;
        }
        self.way += from.tool.distance(sample.tool);
        self.last = *sample;
        self.last_force
    }

    /// The newest model that has come by a time, if one did.
    pub fn arrived(&mut self, time: f64) -> Option<ContactModel> {
        if time >= self.next {
            self.end_frame(time);
        }
        let count = self.pending.iter().take_while(|(at, _)| *at <= time).count();
        self.pending.drain(..count).next_back().map(|(_, model)| model)
    }

    fn end_frame(&mut self, time: f64) {
        let length = 1.0 / self.frames.rate;
        self.next += length * (1.0 + self.frames.jitter * (2.0 * self.random.unit() - 1.0));
        if let Some([from, duration]) = self.frames.stall
            && (from..from + duration).contains(&self.next)
        {
            self.next = from + duration;
        }
        let Some(span) = self.span.filter(|[from, to]| to > from) else { return };
        let duration = span[1] - span[0];
        let is_resting = self.way < STILL && self.number > 0;
        if is_resting {
            self.latest.span = [span[1]; 2];
        } else {
            self.number += 1;
            let model = self.clay.model(self.impulse / duration, self.moment / duration);
            self.latest = ContactModel { frame: self.number, span, ..model };
            self.err();
        }
        let model = ContactModel { stamp: time, rate: self.frames.clay_rate, is_resting, ..self.latest };
        self.span = Some([span[1]; 2]);
        (self.impulse, self.moment, self.way) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        if self.random.unit() >= self.frames.lost {
            self.pending.push((time + self.frames.latency, model));
        }
    }

    /// What the model says wrong.
    fn err(&mut self) {
        let ModelErrors { stiffness, yield_slope, noise } = self.frames.errors;
        let mut factor = || 1.0 + noise * (2.0 * self.random.unit() - 1.0);
        let model = &mut self.latest;
        model.force *= factor();
        model.yield_force *= factor();
        model.yield_slope *= yield_slope;
        model.stiffness *= stiffness;
    }
}
