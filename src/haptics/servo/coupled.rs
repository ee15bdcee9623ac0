//! The clay's contact at the hand's present pose: a spring that yields and slips (return mapping), in series
//! with the coupling between hand and tool.
//!
//! The clay presses on a tool at y with `f = k_n (x_p - y).n n + k_t (x_p - y)_t`, x_p its origin, as long as
//! that is admissible: `0 <= f_n <= F_y(y)`, `|f_t| <= mu f_n`. What is not is returned to the nearest that
//! is, and x_p follows: `F_y |dx_p|` is lost, so that nothing is ever given. The coupling has no mass: `f =
//! k' (y - z)` with `k' = K + B / dt` and z the hand, less what the damper remembers. Both springs are one:
//! `1 / k = 1 / k_clay + 1 / k'`.
//!
//! Frames are old. A frame's mean force is therefore compared with what the servo felt over the same span of
//! the hand's time, less what other frames have changed since: the difference, over the clay's stiffness,
//! is by how much x_p moves, over the time of a frame. Stiffness changes at once, with x_p moved so that
//! the force does not; yield force, friction and normal go over in the time of a frame.

use super::felt::{Felt, Hand};
use super::history::{History, Past, means};
use super::ledger::Ledger;
use super::settings::Coupling;
use crate::haptics::model::ContactModel;
use glam::DVec3;

/// Yield force of clay that never yields \[N\]: hundreds of times what any arm drives.
const YIELD_MAX: f64 = 1e3;

/// How fast frames may change the force \[N/s\]: a third of the slew that a safety chain lets through.
const CORRECTION_RATE: f64 = 100.0;

/// How much of what a frame shows to be missing is made good by it [-]. Clay can be stiffer than its patch
/// says (a block on a floor by half), and then answers by more than was missing: with all of it the force
/// on a ball that was held went up and down in every third frame.
const CORRECTION_SHARE: f64 = 0.8;

/// Part of the yield force from which on clay counts as yielding [-]: its force then says nothing of x_p.
const YIELDING: f64 = 0.98;

/// Stiffness below which clay counts as none \[N/m\]: 1 mm of it is a milligram's weight.
const STIFFNESS_MIN: f64 = 1e-2;

/// What is admissible: `f_n <= offset - slope n.y`, `|f_t| <= friction f_n`.
#[derive(Clone, Copy, Debug, Default)]
struct Limit {
    offset: f64,
    slope: f64,
    friction: f64,
}

impl Limit {
    fn lerp(self, to: Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        Self { offset: mix(self.offset, to.offset), slope: mix(self.slope, to.slope), friction: mix(self.friction, to.friction) }
    }

    /// The same limit at a place, about another normal.
    fn turned(self, at: DVec3, [from, to]: [DVec3; 2]) -> Self {
        Self { offset: self.offset + self.slope * at.dot(to - from), ..self }
    }
}

/// Contact of the clay at the hand's pose.
#[derive(Clone, Debug)]
pub(super) struct Coupled {
    /// Whether there is clay that it knows of.
    is_known: bool,
    /// Where the clay's spring is free, x_p \[m\].
    origin: DVec3,
    normal: DVec3,
    normal_next: DVec3,
    /// Along the normal and across it \[N/m\].
    stiffness: [f64; 2],
    limit: Limit,
    limit_next: Limit,
    /// Time that is left to go over to what comes next \[s\].
    blend: f64,
    /// By how much x_p is still to move, and by how much frames have moved it in all \[m\].
    shift: DVec3,
    moved: DVec3,
    /// The last tick: effective hand z and tool y \[m\], compliance of the coupling \[m/N\], force \[N\].
    hand: DVec3,
    tool: DVec3,
    compliance: f64,
    force: DVec3,
    history: History,
    ledger: Ledger,
}

/// A vector along a normal and across it.
fn split(vector: DVec3, normal: DVec3) -> (f64, DVec3) {
    let along = vector.dot(normal);
    (along, vector - along * normal)
}

/// Stiffness of the clay and the coupling in series \[N/m\].
fn series(stiffness: f64, compliance: f64) -> f64 {
    stiffness / (1.0 + stiffness * compliance)
}

/// A length under a force \[m\]; none where there is no spring.
fn stretch(force: DVec3, stiffness: f64) -> DVec3 {
    if stiffness > STIFFNESS_MIN { force / stiffness } else { DVec3::ZERO }
}

impl Coupled {
    /// Nothing is known of the clay.
    pub(super) fn new() -> Self {
        Self::blank(History::new())
    }

    fn blank(history: History) -> Self {
        Self {
            is_known: false,
            origin: DVec3::ZERO,
            normal: DVec3::ZERO,
            normal_next: DVec3::ZERO,
            stiffness: [0.0; 2],
            limit: Limit::default(),
            limit_next: Limit::default(),
            blend: 0.0,
            shift: DVec3::ZERO,
            moved: DVec3::ZERO,
            hand: DVec3::ZERO,
            tool: DVec3::ZERO,
            compliance: 0.0,
            force: DVec3::ZERO,
            history,
            ledger: Ledger::default(),
        }
    }

    /// Forgets the clay. Called in a tick: the room of its history is kept.
    pub(super) fn forget(&mut self) {
        let mut history = std::mem::replace(&mut self.history, History::none());
        history.clear();
        *self = Self { tool: self.tool, hand: self.hand, ..Self::blank(history) };
    }

    /// Takes in a frame, of frames that come `frame_time` \[s\] after each other.
    pub(super) fn receive(&mut self, model: &ContactModel, frame_time: f64) {
        self.blend = frame_time;
        let Some(normal) = model.normal.try_normalize() else {
            // No clay is near: what is felt fades, and what was known with it.
            self.limit_next = Limit { offset: 0.0, slope: 0.0, ..self.limit };
            self.is_known &= self.force != DVec3::ZERO;
            return;
        };
        self.turn_stiffness(model, normal);
        let touch = normal.dot(model.position) - model.gap;
        let offset = model.yield_force.min(YIELD_MAX) + model.yield_slope * touch;
        self.limit_next = Limit { offset, slope: model.yield_slope, friction: model.friction };
        if !self.is_known {
            (self.normal, self.limit) = (normal, self.limit_next);
        }
        self.normal_next = normal;
        // Of clay that was not run no force belongs to what was felt since.
        let past = self.history.ends(model.span).filter(|[first, last]| self.is_known && last.time > first.time);
        let goal = self.correction(model, normal, past.as_ref()).filter(|_| !model.is_poor);
        if let Some(past) = past {
            self.balance(model, &past);
        }
        self.is_known = true;
        self.shift = DVec3::ZERO;
        if let Some(goal) = goal {
            self.correct(goal);
        }
    }

    /// The stiffness of a frame, with x_p moved so that the force stays.
    fn turn_stiffness(&mut self, model: &ContactModel, normal: DVec3) {
        let along = normal.dot(model.stiffness * normal).max(0.0);
        let trace = model.stiffness.x_axis.x + model.stiffness.y_axis.y + model.stiffness.z_axis.z;
        self.stiffness = [along, (0.5 * (trace - along)).max(0.0)];
        if self.force != DVec3::ZERO {
            let (along, across) = split(self.force, self.normal);
            let [kn, kt] = self.stiffness.map(|k| series(k, self.compliance));
            self.origin = self.hand + stretch(along * self.normal, kn) + stretch(across, kt);
        }
    }

    /// By how much x_p is to move for what a frame says to be true \[m\]; none if it says nothing of that.
    fn correction(&self, model: &ContactModel, normal: DVec3, past: Option<&[Past; 2]>) -> Option<DVec3> {
        let (along, across) = split(model.force, normal);
        let is_touching = along > 0.0;
        let free = model.position - model.gap * normal + stretch(along * normal, self.stiffness[0]);
        let Some(past) = past else {
            return (!self.is_known).then(|| normal * (free - self.origin).dot(normal));
        };
        if !is_touching {
            return Some(normal * (free - past[1].origin - (self.moved - past[1].moved)).dot(normal));
        }
        let [mean, moved] = means(past);
        let since = self.moved - moved;
        let (missing, missing_across) = split(model.force - mean, normal);
        let way = (missing * normal / self.stiffness[0].max(STIFFNESS_MIN) - normal * since.dot(normal)) * CORRECTION_SHARE;
        // Clay that yields presses with its yield force wherever x_p is: x_p can only be too deep.
        let is_yielding = along > YIELDING * model.yield_force;
        let way = if is_yielding && way.dot(normal) < 0.0 { DVec3::ZERO } else { way };
        let is_slipping = across.length() > YIELDING * model.friction * along;
        let slip = if is_slipping { DVec3::ZERO } else { stretch(missing_across, self.stiffness[1]) - split(since, normal).1 };
        Some(way + slip)
    }

    /// Enters a frame's impulse in the ledger.
    fn balance(&mut self, model: &ContactModel, past: &[Past; 2]) {
        let [first, last] = past;
        if model.force == DVec3::ZERO && self.force == DVec3::ZERO {
            self.ledger.close();
            return;
        }
        let felt = last.impulse - first.impulse + last.paid - first.paid;
        self.ledger.enter(model.force * (last.time - first.time) - felt, [first.paid, last.paid]);
    }

    /// Moves x_p: at once as far as nothing is felt of it, the rest in the time of a frame.
    fn correct(&mut self, goal: DVec3) {
        if self.force != DVec3::ZERO {
            self.shift = goal;
            return;
        }
        let depth = (self.origin + goal - self.hand).dot(self.normal).max(0.0);
        let felt = depth * self.normal;
        self.origin += goal - felt;
        self.moved += goal - felt;
        self.shift = felt;
    }

    /// The force at the hand's pose.
    pub(super) fn step(&mut self, hand: &Hand, coupling: Coupling) -> Felt {
        let before = self.hand;
        self.couple(hand, coupling);
        if !self.is_known {
            (self.tool, self.force, self.origin) = (self.hand, DVec3::ZERO, self.hand);
            self.remember(hand.time);
            return Felt::new(DVec3::ZERO, hand.position);
        }
        self.go_over(before, hand.dt);
        self.map_back();
        self.tool = self.hand + self.force * self.compliance;
        let paid = self.ledger.pay(self.force, hand.dt);
        self.remember(hand.time);
        let tool = if self.force == DVec3::ZERO { hand.position } else { self.tool };
        Felt::new(self.force + paid, tool)
    }

    /// The coupling of this tick: `k' = K + B / dt`, `z = (K x_h + B (y / dt + v)) / k'`.
    fn couple(&mut self, hand: &Hand, coupling: Coupling) {
        let damping = if hand.dt > 0.0 { coupling.damping / hand.dt } else { 0.0 };
        self.compliance = 1.0 / (coupling.stiffness + damping);
        let is_touching = self.force != DVec3::ZERO;
        self.hand = hand.position;
        if is_touching && self.compliance > 0.0 {
            let ahead = self.tool + hand.velocity * hand.dt - hand.position;
            self.hand += damping * self.compliance * ahead;
        }
    }

    /// Goes over to what the last frame said, by a tick.
    fn go_over(&mut self, before: DVec3, dt: f64) {
        let share = if self.blend > dt { dt / self.blend } else { 1.0 };
        self.blend = (self.blend - dt).max(0.0);
        // The force turns with the normal: what is stretched along it stays along it.
        let normal = self.normal.lerp(self.normal_next, share).normalize_or(self.normal_next);
        let (along, across) = split(self.origin - before, self.normal);
        let across_turned = split(across, normal).1;
        self.origin = before + along * normal + across_turned;
        self.limit = self.limit.turned(self.tool, [self.normal, normal]);
        let next = self.limit_next.turned(self.tool, [self.normal_next, normal]);
        self.limit = self.limit.lerp(next, share);
        self.normal = normal;
        let stiffness = self.stiffness.map(|k| series(k, self.compliance));
        let force = self.shift * share * stiffness[0].max(stiffness[1]);
        let slowed = (CORRECTION_RATE * dt / force.length().max(f64::MIN_POSITIVE)).min(1.0);
        let part = self.shift * (share * slowed);
        self.origin += part;
        self.moved += part;
        self.shift -= part;
    }

    /// Return mapping: the force, and where x_p is then.
    fn map_back(&mut self) {
        let (normal, compliance) = (self.normal, self.compliance);
        let [kn, kt] = self.stiffness.map(|k| series(k, compliance));
        let (along, across) = split(self.origin - self.hand, normal);
        if along * kn <= 0.0 {
            // Open: the gap stays, and nothing sticks.
            self.origin = self.hand + along * normal;
            self.force = DVec3::ZERO;
            return;
        }
        // F_y is that of the tool's place, z + f / k'.
        let limit = self.limit;
        let bound = (limit.offset - limit.slope * normal.dot(self.hand)) / (1.0 + limit.slope * compliance);
        let pressed = (along * kn).min(bound.max(0.0));
        let rubbed = (across * kt).clamp_length_max(limit.friction * pressed);
        self.force = pressed * normal + rubbed;
        self.origin = self.hand + normal * (pressed / kn) + stretch(rubbed, kt);
    }

    fn remember(&mut self, time: f64) {
        let (force, origin, moved, paid) = (self.force, self.origin, self.moved, self.ledger.paid());
        self.history.push(Past { time, force, origin, moved, paid, ..Past::default() });
    }
}
