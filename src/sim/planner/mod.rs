//! What a clay does next: time owed, ways of tools, reports, cost and cuts -> the plan of the next frame.
//! Knows no engine, no clock and no thread; whoever runs clay (an app, a scene, a recording) asks it, so that
//! all of them plan alike.
//!
//! | file       | does                                                        |
//! |------------|-------------------------------------------------------------|
//! | `trail`    | timed poses of any clock -> the piece of them that a frame sweeps |
//! | `afford`   | what a frame took -> how long the next may be               |
//! | `choice`   | reports -> explicit or implicit steps, or none              |
//! | `stop`     | tools' ways -> whether one stops too sharply for implicit steps |
//! | `step`     | tools, speeds and material -> substeps of the explicit step |
//! | `implicit` | tools and speeds -> implicit steps                          |
//! | `sheets`   | a sheet for each visit of a blade                           |
//!
//! ```
//! use bevy_clay::sim::prelude::*;
//! # let (low, high) = (glam::DVec3::ZERO, glam::DVec3::splat(0.1));
//! # let domain = Domain::new(low, high, 0.005, Walls::default()).expect("a room");
//! # let place = domain.to_grid(glam::DVec3::splat(0.05));
//! # let clay = Snapshot::new(domain, Preset::SoftClay.material(), vec![Particle::at(place, 1e-8, 0)]);
//! let mut engine = NativeEngine::new();
//! engine.load(&clay).expect("sound clay");
//! let mut planner = Planner::new(&clay);
//! let ball = Tool { shape: ToolShape::Sphere { radius: 0.008 }, contact: Contact::default() };
//! for step in 0..3 {
//!     let position = glam::DVec3::new(0.05, 0.09 - 1e-4 * f64::from(step), 0.05);
//!     let pose = Pose { position, ..Pose::default() };
//!     planner.pass(1.0 / 60.0, &[ToolSamples::now(0, ball, pose)]);
//!     if let Decision::Run(plan) = planner.next(&clay.material) {
//!         engine.submit(plan).expect("a sound plan");
//!         planner.sent();
//!     }
//!     while engine.pending() > 0 {
//!         planner.note(&mut engine.wait().expect("an engine"));
//!     }
//! }
//! ```

mod afford;
mod choice;
mod implicit;
mod sheets;
mod step;
mod stop;
mod trail;

pub use afford::{FRAME_MAX, FRAME_WALL};
pub use choice::{IntegratorChoice, RESIDUAL_MAX};
pub use implicit::StepAccuracy;
pub use sheets::Sheets;
pub use step::{InertiaScaling, STEP_FRACTION, StepLimits, TOOL_MACH_MAX, TOOL_TRAVEL_MAX, TRAVEL_MAX, VOLUME_AVERAGING};
pub use trail::{Backlog, LAG_MAX, ToolSamples};

use super::frame::{FrameOutputs, FramePlan, FrameReport};
use super::health::Health;
use super::limits::PENDING_MAX;
use super::material::ClayMaterial;
use super::params::{Domain, Walls};
use super::snapshot::Snapshot;
use super::tool::{Pose, ToolPath};
use afford::Cost;
use choice::Course;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use stop::Ends;
use trail::{Piece, Trails};

/// What is to be done next.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "made once a frame and taken apart at once")]
pub enum Decision {
    /// Nothing: no time is owed, or reports have to come first.
    Idle,
    /// This frame.
    Run(FramePlan),
}

/// How frames are planned; may change at any time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Policy {
    /// Gravity [m/s^2].
    pub gravity: DVec3,
    /// Which integrator frames have.
    pub integrator: IntegratorChoice,
    /// How finely implicit steps follow a tool.
    pub accuracy: StepAccuracy,
    /// How far explicit steps may scale inertia while a tool engages supported clay.
    pub inertia: InertiaScaling,
    /// Greatest substep \[s\], however much longer one would be stable.
    pub time_step: Option<f64>,
    /// What frames hand out.
    pub outputs: FrameOutputs,
    /// Wall time \[s\] that a frame may take: frames are no longer than what the engine was seen to afford in
    /// it, within [`FRAME_WALL`]. Without it frames follow the clock alone.
    pub wall: Option<f64>,
    /// What becomes of the hand's way in slow motion.
    pub backlog: Backlog,
}

impl Default for Policy {
    fn default() -> Self {
        Self {
            gravity: StepLimits::default().gravity,
            integrator: IntegratorChoice::default(),
            accuracy: StepAccuracy::default(),
            inertia: InertiaScaling::Off,
            time_step: None,
            outputs: FrameOutputs::default(),
            wall: None,
            backlog: Backlog::default(),
        }
    }
}

/// What the plans of frames whose tools' ways are known ([`Planner::frame`]) come from, beside the clay and
/// the policy: data, to be kept with a snapshot. A run that is restarted with both ([`Planner::resume`]) has
/// the same plans as one that went on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlannerState {
    /// Greatest speed [m/s] at the end of frames n and n - 1, by the parity of their ids.
    speeds: [f64; 2],
    /// The same of what is heavy enough for implicit steps to follow it.
    #[serde(default)]
    followed: [f64; 2],
    /// Whether a tool engaged supported clay in these frames.
    engaged: [bool; 2],
    /// Scale of inertia in the last frame reported that ran; 0 before the first.
    #[serde(default)]
    density_scale: f64,
    /// Length of the frame before the next \[s\].
    last_duration: f64,
    /// How its tools moved at its end.
    #[serde(default)]
    ends: Ends,
    next_id: u64,
    sheets: Sheets,
    /// Of the integrator.
    #[serde(default)]
    course: Course,
}

/// What is planned for one engine's clay, and from what.
#[derive(Clone, Debug, Default)]
pub struct Planner {
    /// How frames are planned.
    pub policy: Policy,
    cell_width: f64,
    walls: Walls,
    state: PlannerState,
    under_way: usize,
    owed: f64,
    /// Of the last frame; none until one has ended.
    cost: Option<Cost>,
    /// Implicit steps per second that the last plan asked for [1/s].
    rate: f64,
    given_up: f64,
    trails: Trails,
    /// The plan that was handed out last, until it is sent or refused.
    drafted: Option<Draft>,
}

/// What is settled when an engine has taken a plan, or has not.
#[derive(Clone, Debug)]
struct Draft {
    duration: f64,
    /// Time \[s\] that the plan makes up for, of what was given up.
    regained: f64,
    ends: Ends,
    /// What the plan sweeps of the hand's way.
    piece: Option<Piece>,
}

impl Planner {
    /// For clay as it stands in `snapshot`.
    pub fn new(snapshot: &Snapshot) -> Self {
        let speed = snapshot.particles.iter().map(|p| DVec3::from_array(p.velocity.map(f64::from)).length()).fold(0.0, f64::max);
        let (sheets, course) = (Sheets::new(snapshot), Course::new(snapshot));
        let state = PlannerState { speeds: [speed; 2], followed: [speed; 2], sheets, course, ..PlannerState::default() };
        Self::resume(snapshot, state)
    }

    /// For the clay of `snapshot`, saved where no frame was under way, to go on where the planner stood then.
    pub fn resume(snapshot: &Snapshot, state: PlannerState) -> Self {
        let Domain { cell_width, walls, .. } = snapshot.domain;
        Self { cell_width, walls, state, ..Self::default() }
    }

    /// What the next plans come from: to be kept where no frame is under way.
    pub fn state(&self) -> &PlannerState {
        &self.state
    }

    /// Cell width \[m\].
    pub fn cell_width(&self) -> f64 {
        self.cell_width
    }

    /// Time of the clock \[s\] that the clay did not follow, because the engine did not afford it or would not.
    pub fn given_up(&self) -> f64 {
        self.given_up
    }

    /// Time \[s\] by which the tools lag behind the hand.
    pub fn lag(&self) -> f64 {
        self.trails.lag()
    }

    /// Where the clay has the tool of this key, at the end of the last frame reported; nothing if it was not
    /// in it.
    pub fn tool_pose(&self, key: u64) -> Option<Pose> {
        self.trails.seen(key)
    }

    /// The key of the tool that plans and reports call `id`, from when it was put down to the report after
    /// the last that has it.
    pub fn tool_key(&self, id: u32) -> Option<u64> {
        self.trails.key(id)
    }

    /// Goes on where `old`, the planner of the same clay on another engine, stands.
    pub fn take_over(&mut self, old: Self) {
        let PlannerState { speeds, followed, .. } = self.state;
        let state = PlannerState { speeds, followed, engaged: [false; 2], ..old.state };
        // What another engine affords tells nothing.
        *self = Self { cell_width: self.cell_width, walls: self.walls, state, under_way: 0, cost: None, drafted: None, ..old };
        // What was under way there is lost.
        self.given_up += self.trails.lose_all();
    }

    /// Lets `time` \[s\] of the clock pass, in which the tools went these ways; those not among them have been
    /// let go of.
    pub fn pass(&mut self, time: f64, tools: &[ToolSamples]) {
        self.trails.pass(time, tools);
        self.owed += time;
        let most = self.frame_max();
        self.given_up += (self.owed - most).max(0.0);
        self.owed = self.owed.min(most);
    }

    /// Forgets the ways of the tools: the clay stands, and they are put down anew when it goes on.
    pub fn lift(&mut self) {
        self.trails.lift();
    }

    /// The longest frame that the engine affords \[s\].
    fn frame_max(&self) -> f64 {
        self.policy.wall.map_or(FRAME_MAX, |wall| Cost::frame_max(self.cost, wall, self.rate))
    }

    /// The next frame of clay made of `material`: of the time owed, if there is any and fewer than
    /// [`PENDING_MAX`] are under way; longer by what it can make up for while tools lag behind the hand. Then
    /// the plan was [`Self::sent`] or [`Self::refused`]: what the tools did in one that no engine took is
    /// swept by the next.
    pub fn next(&mut self, material: &ClayMaterial) -> Decision {
        if self.owed <= 0.0 || self.under_way >= PENDING_MAX || self.trails.is_mending() {
            return Decision::Idle;
        }
        let owed = std::mem::take(&mut self.owed);
        let most = self.frame_max().min(owed + self.given_up);
        let piece = self.trails.piece(owed, most, self.policy.backlog);
        self.owed = (owed - piece.duration).max(0.0);
        piece.put_down.iter().for_each(|id| self.state.sheets.lift(*id));
        let plan = self.draft(material, piece.duration, &piece.paths);
        let regained = (piece.duration - owed).max(0.0);
        let ends = Ends::of(&self.state.ends, material, piece.duration, &piece.paths);
        self.drafted = Some(Draft { duration: piece.duration, regained, ends, piece: Some(piece) });
        Decision::Run(plan)
    }

    /// The next frame of clay made of `material`, `duration` \[s\] long, with tools whose ways are known: those
    /// of a scene. Nothing if a report has to come first.
    pub fn frame(&mut self, material: &ClayMaterial, duration: f64, paths: &[ToolPath]) -> Decision {
        if self.under_way >= PENDING_MAX {
            return Decision::Idle;
        }
        let ends = Ends::of(&self.state.ends, material, duration, paths);
        self.drafted = Some(Draft { duration, regained: 0.0, ends, piece: None });
        Decision::Run(self.draft(material, duration, paths))
    }

    /// A plan from the report of the frame two before.
    fn draft(&mut self, material: &ClayMaterial, duration: f64, paths: &[ToolPath]) -> FramePlan {
        let Policy { gravity, inertia, time_step, outputs, integrator, .. } = self.policy;
        let slot = parity(self.state.next_id);
        let inertia = if self.state.engaged[slot] { inertia } else { InertiaScaling::Off };
        // The frame between that report and this plan adds what gravity does in it.
        let speed = self.state.speeds[slot] + gravity.length() * self.state.last_duration;
        let limits = StepLimits { speed, inertia, gravity, time_step, ..StepLimits::default() };
        let explicit = limits.frame(material, self.cell_width, duration, paths);
        let mut plan = match integrator {
            IntegratorChoice::Explicit => explicit,
            IntegratorChoice::Auto if self.state.course.flies(slot, &self.walls, gravity) => explicit,
            IntegratorChoice::Auto if self.stops_sharply(&explicit) => explicit,
            IntegratorChoice::Auto | IntegratorChoice::Implicit => self.implicit(&limits, slot, explicit),
        };
        let is_asked = self.policy.inertia != InertiaScaling::Off || integrator != IntegratorChoice::Explicit;
        let support = outputs.support || is_asked;
        (plan.id, plan.outputs) = (self.state.next_id, FrameOutputs { support, ..outputs });
        self.state.sheets.deal(&mut plan);
        plan.may_rest = self.state.course.may_rest(slot, &plan);
        plan
    }

    /// Whether a tool stops sharply in clay: where nobody waits, in the frame in which it comes to it too.
    fn stops_sharply(&self, plan: &FramePlan) -> bool {
        let may_touch = self.policy.wall.is_none() || self.state.engaged != [false; 2];
        may_touch && self.state.ends.are_unsettled(&plan.material, &plan.tools)
    }

    /// The implicit frame in the place of the `explicit` one, unless that is no dearer and may be chosen.
    fn implicit(&mut self, limits: &StepLimits, slot: usize, explicit: FramePlan) -> FramePlan {
        // Clay that rests does not fall, nor does what a tool leads.
        let (speed, fall) = (self.state.followed[slot], limits.gravity.length() * self.state.last_duration);
        let falls = speed > 0.5 * fall && !self.state.course.is_led(slot);
        let limits = StepLimits { speed: if falls { speed + fall } else { speed }, ..*limits };
        let accuracy = self.policy.accuracy;
        let refinement = self.state.course.refinement(slot);
        self.rate = limits.implicit_rate(accuracy, self.cell_width, &explicit.tools) * f64::from(refinement);
        let clay = (&explicit.material, self.cell_width);
        let plan = limits.implicit_frame(accuracy, refinement, clay, explicit.duration(), &explicit.tools);
        // Where frames are as short as the engine affords, implicit ones may be as long as their steps: by
        // the frame alone, explicit steps that take too long would look the cheaper the longer they take.
        let steps = if self.policy.wall.is_some() { self.rate * explicit.duration() } else { f64::from(plan.steps) };
        let is_cheaper = f64::from(explicit.steps) <= steps * f64::from(accuracy.passes());
        if is_cheaper && self.policy.integrator == IntegratorChoice::Auto { explicit } else { plan }
    }

    /// The engine has taken the last plan.
    pub fn sent(&mut self) {
        if let Some(Draft { duration, regained, ends, piece }) = self.drafted.take() {
            (self.state.last_duration, self.state.ends) = (duration, ends);
            self.given_up -= regained;
            piece.into_iter().for_each(|piece| self.trails.send(piece));
        }
        self.state.next_id += 1;
        self.under_way += 1;
    }

    /// The engine has not taken the last plan, for something that is wrong in it. Its time is given up; its
    /// tools are planned for as long as they are held.
    pub fn refused(&mut self) {
        if let Some(Draft { duration, regained, .. }) = self.drafted.take() {
            self.given_up += duration - regained;
        }
        self.trails.refuse();
    }

    /// Takes what a report says about the speed of the clay, of its cuts, and whether the tools' ways were
    /// swept; adds what only the planner knows of the cuts and of the frame before.
    pub fn note(&mut self, report: &mut FrameReport) {
        self.under_way = self.under_way.saturating_sub(1);
        let slot = parity(report.plan_id);
        let is_given_up = report.health.contains(Health::GIVEN_UP);
        let speed = report.speed(self.cell_width);
        // A frame given up says nothing of the speed; the clay stands as before it.
        let followed = speed.min(self.state.course.speed_followed(report, self.cell_width));
        for (kept, speed) in [(&mut self.state.speeds, speed), (&mut self.state.followed, followed)] {
            kept[slot] = if is_given_up { kept[slot].max(speed) } else { speed };
        }
        self.state.engaged[slot] = report.is_engaged();
        if report.steps > 0 {
            report.rescaled_momentum = report.momentum_before * (1.0 - self.scale_before() / report.density_scale);
            self.state.density_scale = report.density_scale;
        }
        self.state.sheets.note(report);
        self.state.course.note(slot, report, self.cell_width);
        self.cost = Cost::of(report).or(self.cost);
        self.given_up += self.trails.end(is_given_up);
    }

    /// Scale of inertia in the frame before the one that is reported: before the first it is the clay's own.
    fn scale_before(&self) -> f64 {
        self.state.density_scale.max(1.0)
    }
}

fn parity(id: u64) -> usize {
    usize::from(id % 2 == 1)
}

#[cfg(test)]
mod tests;
