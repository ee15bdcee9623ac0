//! The modes that keep the tool's spheres off the clay's: the published one, and the god-object.
//!
//! Particles jump from frame to frame, so that two tools are kept, among the particles of the last two
//! frames: the force goes over from the one to the other in the time of a frame, both at the present pose.

use super::felt::{Felt, Hand};
use super::settings::{Mode, ServoSettings};
use crate::haptics::model::ContactModel;
use crate::haptics::proxy::{CAUGHT, Proxy, Solver, Surroundings};
use glam::DVec3;

/// Greatest change of the force at the end of a cut \[N/s\].
const RELEASE_RATE: f64 = 100.0;

/// Part of a difference of forces that a frame makes good [-]: frames that are three late do not add up.
const SINKING: f64 = 0.25;

/// The tool among the particles of one frame.
#[derive(Clone, Debug)]
struct Among {
    model: ContactModel,
    proxy: Proxy,
}

/// What a tool among the particles came to.
#[derive(Clone, Copy, Debug)]
struct Placed {
    position: DVec3,
    is_held: bool,
    gap: f64,
    iterations: u32,
}

/// Forces of spheres on spheres.
#[derive(Clone, Debug)]
pub(super) struct SphereForce {
    /// The last frame but one, and the last.
    frames: [Box<Among>; 2],
    is_known: bool,
    arrival: f64,
    frame_time: f64,
    /// x_rg of Eq. 8, while a cut lasts.
    anchor: Option<DVec3>,
    /// Force on the way to zero after a cut \[N\].
    release: DVec3,
    /// How far the clay's tool is within the proxy's place, towards the hand \[m\]; the force felt \[N\].
    sunk: f64,
    felt: DVec3,
}

impl Among {
    /// The tool goes as near to the hand as the clay lets it. With friction it stays where it was as far as
    /// the cone lets it: `|f_t| <= mu |f_n|`.
    fn advance(&mut self, hand: &Hand, settings: &ServoSettings, is_paper: bool) -> Placed {
        let model = &self.model;
        let about =
            Surroundings { tool: &settings.tool, rotation: hand.rotation, near: model.near(), outwards: -model.density_gradient };
        let stiffness = DVec3::splat(1.0);
        let solver = if is_paper { Solver::Projected } else { Solver::ActiveSet };
        let before = self.proxy.position;
        let mut step = self.proxy.advance(hand.position, stiffness, &about, solver);
        let pressed = self.proxy.position - hand.position;
        if !is_paper && step.is_held && model.friction > 0.0 && pressed != DVec3::ZERO {
            let normal = pressed.normalize();
            let back = before - self.proxy.position;
            let back = (back - back.dot(normal) * normal).clamp_length_max(model.friction * pressed.length());
            let target = hand.position + back;
            if !self.proxy.slide(target, stiffness, &mut step, solver) {
                // From where it was: without friction it may have gone over a ridge that friction holds it
                // before.
                self.proxy.position = before;
                step = self.proxy.advance(target, stiffness, &about, solver);
            }
        }
        Placed { position: self.proxy.position, is_held: step.is_held, gap: step.gap, iterations: step.iterations }
    }

    /// `omega(rho)`, the fill of the clay about a place as far as it is one [-].
    fn weight(&self, at: DVec3) -> f64 {
        (self.model.density + self.model.density_gradient.dot(at - self.model.position)).clamp(0.0, 1.0)
    }
}

impl SphereForce {
    pub(super) fn new() -> Self {
        let among = || Box::new(Among { model: ContactModel::NONE, proxy: Proxy::default() });
        Self {
            frames: [among(), among()],
            is_known: false,
            arrival: f64::NEG_INFINITY,
            frame_time: 1.0,
            anchor: None,
            release: DVec3::ZERO,
            sunk: 0.0,
            felt: DVec3::ZERO,
        }
    }

    /// Forgets the clay. Called in a tick: nothing is allocated anew.
    pub(super) fn forget(&mut self) {
        self.frames.iter_mut().for_each(|among| among.model = ContactModel::NONE);
        (self.is_known, self.anchor, self.sunk) = (false, None, 0.0);
        (self.release, self.felt) = (DVec3::ZERO, DVec3::ZERO);
    }

    pub(super) fn receive(&mut self, model: &ContactModel, now: f64, frame_time: f64) {
        self.frames.swap(0, 1);
        // The newest tool goes on from where the last one is, among particles that may have come nearer.
        let at = self.frames[0].proxy.position;
        self.frames[1].model = *model;
        self.frames[1].proxy.position = at;
        (self.arrival, self.frame_time) = (now, frame_time);
        let clay = model.normal.dot(model.stiffness * model.normal);
        if clay > 0.0 {
            self.sunk += SINKING * (self.felt - model.force).dot(model.normal) / clay;
        }
    }

    pub(super) fn step(&mut self, hand: &Hand, settings: &ServoSettings) -> Felt {
        if !self.is_known {
            self.frames.iter_mut().for_each(|among| among.proxy.position = hand.position);
            self.is_known = true;
        }
        let is_paper = matches!(settings.mode, Mode::PaperAnchor { .. });
        let share = ((hand.time - self.arrival) / self.frame_time).clamp(0.0, 1.0);
        let new = self.frames[1].advance(hand, settings, is_paper);
        let (mut place, mut weight) = (new.position, self.frames[1].weight(new.position));
        let mut is_held = new.is_held;
        if share < 1.0 {
            let old = self.frames[0].advance(hand, settings, is_paper);
            place = old.position.lerp(place, share);
            weight = (1.0 - share) * self.frames[0].weight(old.position) + share * weight;
            is_held |= old.is_held;
        }
        let stiffness = weight * settings.coupling_in_world().stiffness;
        let felt = match settings.mode {
            Mode::PaperAnchor { relaxes } => self.anchored(hand, place, stiffness, [is_held, relaxes]),
            _ => self.pressed(hand, place, is_held, stiffness),
        };
        Felt { gap: new.gap, iterations: new.iterations, is_caught: new.gap < -CAUGHT, ..felt }
    }

    /// The god-object's spring. The clay's particles lie where its tool has pressed them to: the tool goes
    /// on as much farther, towards the hand, as the clay's own force of each frame is too little.
    fn pressed(&mut self, hand: &Hand, place: DVec3, is_held: bool, stiffness: f64) -> Felt {
        if !is_held {
            (self.sunk, self.felt) = (0.0, DVec3::ZERO);
            return Felt::new(DVec3::ZERO, hand.position);
        }
        let stretched = place - hand.position;
        self.felt = stiffness * stretched;
        self.sunk = self.sunk.clamp(0.0, stretched.length());
        Felt::new(self.felt, place - stretched.normalize_or_zero() * self.sunk)
    }

    /// Eq. 8, until the tool is out of the clay: where omega(rho) is nothing, or on the outer side of the
    /// anchor. The tool is the hand's: "we align the graphic tool and the haptic tool".
    fn anchored(&mut self, hand: &Hand, place: DVec3, stiffness: f64, [is_held, relaxes]: [bool; 2]) -> Felt {
        if is_held && self.anchor.is_none() {
            self.anchor = Some(place);
        }
        let Some(anchor) = self.anchor else {
            self.release = self.release.clamp_length_max((self.release.length() - RELEASE_RATE * hand.dt).max(0.0));
            return Felt { is_touching: false, ..Felt::new(self.release, hand.position) };
        };
        let mut force = stiffness * (anchor - place);
        let model = &self.frames[1].model;
        if relaxes && force.length() > model.yield_force {
            force = force.clamp_length_max(model.yield_force);
            self.anchor = Some(place + force / stiffness);
        }
        if !is_held && (stiffness == 0.0 || (anchor - place).dot(model.normal) <= 0.0) {
            self.anchor = None;
        }
        self.release = force;
        Felt::new(force, hand.position)
    }
}
