//! A hand in a scene: it leads a tool by a simulated arm and feels the clay, a thousand times a second.

use super::build::BuiltScene;
use super::track::{Grip, Keyframe};
use crate::haptics::device::simulated::{ArmSettings, HandPath, Operator, SimulatedArm};
use crate::haptics::device::trace::{TraceTick, TraceWriter};
use crate::haptics::guarded::{GuardedServo, HandOrders};
use crate::haptics::servo::{Placement, ServoSample, ServoSettings};
use crate::haptics::touch::{ContactModels, FrameClock};
use crate::haptics::virtual_hand::VirtualHand;
use crate::sim::frame::FrameReport;
use crate::sim::planner::{Decision, Planner};
use crate::sim::tool::{Pose, PoseSample};
use std::io::{self, Write};

/// Samples between two steps of an arm, at most.
const SAMPLES: usize = 16;

fn operator(grip: Grip) -> Operator {
    match grip {
        Grip::Pinch => Operator::PINCH,
        Grip::Stylus => Operator::STYLUS,
        Grip::Firm => Operator::FIRM,
    }
}

/// The hand of a scene, at work.
pub struct SceneHand {
    hand: VirtualHand,
    /// Index of its tool.
    tool: usize,
    /// Where the tool was last.
    last: Option<Pose>,
    /// Its way through the frame under way.
    path: Vec<PoseSample>,
    models: ContactModels,
    /// Time of the frame under way \[s\].
    span: [f64; 2],
    ticks: Vec<TraceTick>,
}

impl SceneHand {
    /// The hand of the scene, before its first frame; none where no tool has one.
    pub fn of(built: &BuiltScene) -> Option<Self> {
        let (tool, track, grip) = built.scene.hand()?;
        let first = &track.keyframes[0];
        let rotation = first.rotation.quaternion();
        let placement = Placement { position: first.position, rotation, ..Placement::default() };
        let on_device = |frame: &Keyframe| (frame.time, rotation.conjugate() * (frame.position - first.position));
        let path = HandPath::new(track.keyframes.iter().map(on_device));
        let arm = SimulatedArm::new(ArmSettings { operator: operator(grip), ..ArmSettings::default() }, path);
        let settings = ServoSettings { placement, ..ServoSettings::default() };
        let (servo, ends) = GuardedServo::new(settings, HandOrders::default(), SAMPLES);
        let hand = VirtualHand::new(arm, Box::new(servo), ends.clay);
        Some(Self { hand, tool, last: None, path: vec![], models: ContactModels::default(), span: [0.0; 2], ticks: vec![] })
    }

    /// The next step of frame `index`, from 0, as [`BuiltScene::next`] has it, with the tool where the hand
    /// leads it.
    pub fn next(&mut self, built: &BuiltScene, index: u64, planner: &mut Planner) -> Decision {
        let [start, end] = built.frame_span(index);
        let id = self.tool as u32 + 1;
        if self.span != [start, end] {
            self.span = [start, end];
            self.path = self.lead();
        }
        let mut paths = built.tool_paths(start, end);
        // The keyframes say when it is there, the arm where.
        if let Some(path) = paths.iter_mut().find(|path| path.id == id) {
            path.samples.clone_from(&self.path);
        }
        planner.frame(&built.snapshot.material, built.scene.frame_time, &paths)
    }

    /// Takes what a report says: the hand knows it a frame later.
    pub fn note(&mut self, report: &FrameReport) {
        let id = self.tool as u32 + 1;
        let [start, end] = self.span;
        let known = end + (end - start);
        let (span, parts, is_resting) = (self.span, report.implicit_steps(), report.is_resting());
        let clock = FrameClock { frame: report.plan_id + 1, stamp: known, rate: 1.0, span, parts, is_resting };
        if let Some(touch) = report.touches.iter().find(|touch| touch.id == id) {
            self.hand.send(known, self.models.model(touch, report.residual, &clock));
        }
    }

    /// Runs the arm through the frame; the way of its tool, with times from the frame's start.
    fn lead(&mut self) -> Vec<PoseSample> {
        let [start, end] = self.span;
        let spell = self.hand.feel(end);
        self.ticks.extend(&spell.ticks);
        let pose = |s: &ServoSample| Pose { position: s.tool, rotation: s.rotation };
        let ticks = spell.samples.iter().filter(|s| s.time > start && s.time < end);
        let first = self.last.or_else(|| spell.samples.first().map(pose));
        self.last = spell.samples.last().map(pose).or(self.last);
        let at = |time: f64| move |pose: Pose| PoseSample { time, pose };
        let within = ticks.map(|s| PoseSample { time: s.time - start, pose: pose(s) });
        first.map(at(0.0)).into_iter().chain(within).chain(self.last.map(at(end - start))).collect()
    }

    /// What it felt, tick by tick, as a trace that an arm can play again
    /// ([`trace`](crate::haptics::device::trace)).
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write_trace(&self, to: impl Write) -> io::Result<()> {
        let mut writer = TraceWriter::new(to, &self.hand.arm.info())?;
        self.ticks.iter().try_for_each(|tick| writer.write(tick))?;
        writer.finish()
    }

    /// Greatest force on the hand so far \[N\].
    pub fn force_max(&self) -> f64 {
        self.ticks.iter().map(|tick| tick.force.length()).fold(0.0, f64::max)
    }
}
