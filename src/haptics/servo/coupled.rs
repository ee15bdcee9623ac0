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
//! the hand's time (at the ends of its steps, where those are implicit), less what other frames have changed
//! since: the difference, over the clay's stiffness, is by how much x_p moves, over the time of a frame.
//! Stiffness changes at once, with x_p moved so that the force does not; yield force, friction and normal go
//! over in the time of a frame.
//!
//! What is admissible of the force on a flat blade is a matter of its edges and flanks: [`BladeLimit`].

use super::blade::{BladeLimit, Held};
use super::felt::{Felt, Hand};
use super::history::{History, Past};
use super::ledger::Ledger;
use super::settings::Coupling;
use crate::haptics::model::ContactModel;
use glam::{DQuat, DVec3};

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
    /// In place of the limit, of a blade: now, and what comes next.
    blade: Option<[BladeLimit; 2]>,
    /// How the tool is turned, and how far a blade has slid in its plane, in all \[m\].
    rotation: DQuat,
    slid: f64,
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
            blade: None,
            rotation: DQuat::IDENTITY,
            slid: 0.0,
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
        *self = Self { tool: self.tool, hand: self.hand, rotation: self.rotation, ..Self::blank(history) };
    }

    /// Takes in a frame, of frames that come `frame_time` \[s\] after each other.
    pub(super) fn receive(&mut self, model: &ContactModel, frame_time: f64) {
        self.blend = frame_time;
        let Some(normal) = model.normal.try_normalize() else {
            // No clay is near: what is felt fades, and what was known with it.
            self.limit_next = Limit { offset: 0.0, slope: 0.0, ..self.limit };
            self.blade = self.blade.map(|[now, _]| [now, now.without_clay()]);
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
        let at_end = self.limit_blade(model);
        // Of clay that was not run no force belongs to what was felt since.
        let past = self.history.ends(model.span).filter(|[first, last]| self.is_known && last.time > first.time);
        let goal = match at_end {
            Some(limit) => self.blade_correction(model, &limit, normal, past.as_ref()),
            None => self.correction(model, normal, past.as_ref()),
        };
        let goal = goal.filter(|_| !model.is_poor);
        if let Some(past) = past {
            self.balance(model, &past);
        }
        self.is_known = true;
        self.shift = DVec3::ZERO;
        if let Some(goal) = goal {
            self.correct(goal);
        }
    }

    /// What clay bears of a blade, by a frame, as that ended; moved on to where the tool is it comes next.
    fn limit_blade(&mut self, model: &ContactModel) -> Option<BladeLimit> {
        let Some(blade) = &model.blade else {
            self.blade = None;
            return None;
        };
        let stiffness = self.stiffness[1].max(STIFFNESS_MIN);
        let place = self.history.look(model.span[1]).map_or(model.position, |past| past.tool);
        let at_end = BladeLimit::new(blade, model, place, stiffness);
        let mut next = at_end;
        // Way by way: an edge that has gone on and come back has cut.
        self.history.after(model.span[1]).for_each(|past| next.go(past.tool, self.rotation, stiffness));
        next.go(self.tool, self.rotation, stiffness);
        let now = self.blade.filter(|_| self.is_known).map_or(next, |[now, _]| now);
        self.blade = Some([now, next]);
        Some(at_end)
    }

    /// By how much x_p is to move for what a frame says of a blade to be true \[m\]. Clay that gives way, in
    /// the frame or in what was felt meanwhile, says nothing of that.
    fn blade_correction(
        &self,
        model: &ContactModel,
        limit: &BladeLimit,
        normal: DVec3,
        past: Option<&[Past; 2]>,
    ) -> Option<DVec3> {
        let Some(past) = past else {
            let (along, across) = split(model.force, normal);
            let free = self.hand + stretch(along * normal, self.stiffness[0]) + stretch(across, self.stiffness[1]);
            return (!self.is_known).then(|| free - self.origin);
        };
        let [mean, moved] = self.history.means(past, model.parts);
        let [slides, gives] = limit.yields(model.force, model.rotation, YIELDING);
        let (missing, missing_across) = split(model.force - mean, normal);
        let (since, since_across) = split(self.moved - moved, normal);
        let way = if gives { DVec3::ZERO } else { stretch(missing * normal, self.stiffness[0]) - since * normal };
        let slides = slides || past[1].slid > past[0].slid;
        let slip = if slides { DVec3::ZERO } else { stretch(missing_across, self.stiffness[1]) - since_across };
        Some((way + slip) * CORRECTION_SHARE)
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
        let [mean, moved] = self.history.means(past, model.parts);
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
        let [mean, _] = self.history.means(past, model.parts);
        let felt = mean * (last.time - first.time) + last.paid - first.paid;
        self.ledger.enter(model.force * (last.time - first.time) - felt, [first.paid, last.paid]);
    }

    /// Moves x_p: at once as far as nothing is felt of it, the rest in the time of a frame.
    fn correct(&mut self, goal: DVec3) {
        if self.force != DVec3::ZERO || self.blade.is_some() {
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
        let turn = hand.rotation * std::mem::replace(&mut self.rotation, hand.rotation).conjugate();
        self.couple(hand, coupling);
        if !self.is_known {
            (self.tool, self.force, self.origin) = (self.hand, DVec3::ZERO, self.hand);
            self.remember(hand.time);
            return Felt::new(DVec3::ZERO, hand.position);
        }
        if self.blade.is_some() {
            // Clay's spring and all that is known of it turn with the blade.
            self.origin = before + turn * (self.origin - before);
            self.normal = self.rotation * DVec3::Z;
            self.normal_next = self.normal;
        }
        self.go_over(before, hand.dt);
        self.map_back();
        self.tool = self.hand + self.force * self.compliance;
        if let Some(limits) = &mut self.blade {
            let stiffness = self.stiffness[1].max(STIFFNESS_MIN);
            limits.iter_mut().for_each(|limit| limit.go(self.tool, self.rotation, stiffness));
        }
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
        self.blade = self.blade.map(|[now, next]| [now.lerp(&next, share), next]);
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
        if let Some([blade, _]) = &self.blade {
            let held = Held { hand: self.hand, rotation: self.rotation, compliance };
            let trial = along * kn * normal + across * kt;
            self.force = blade.admit(trial, self.force, &held, self.stiffness[1].max(STIFFNESS_MIN));
            let (pressed, rubbed) = split(self.force, normal);
            let origin = self.hand + stretch(pressed * normal, kn) + stretch(rubbed, kt);
            if self.force != DVec3::ZERO {
                self.slid += split(self.origin - origin, normal).1.length();
            }
            self.origin = origin;
            return;
        }
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
        self.history.push(Past { time, force, origin, moved, paid, tool: self.tool, slid: self.slid, ..Past::default() });
    }
}
