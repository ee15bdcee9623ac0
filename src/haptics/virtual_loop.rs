//! Arm, hand, servo, planner and clay in virtual time: what a hand feels of an engine's clay, the same on
//! every machine.

use super::arm_tool::ArmTool;
use super::device::Servo;
use super::device::simulated::SimulatedArm;
use super::model::ContactModel;
use super::servo::{ClayServoEnds, ServoSample};
use crate::sim::engine::{Engine, EngineError};
use crate::sim::frame::FrameReport;
use crate::sim::material::ClayMaterial;
use crate::sim::planner::{Decision, Planner, ToolSamples};
use crate::sim::tool::{Pose, PoseSample, Tool};
use std::collections::VecDeque;

/// The arm's tool among those of the planner.
const KEY: u64 = 0;

/// When clay frames are and when they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopClock {
    /// Frames a second \[Hz\].
    pub rate: f64,
    /// From the end of a frame's way to the servo \[s\].
    pub latency: f64,
    /// Clay time that a second of the hand takes [-].
    pub speed: f64,
}

impl Default for LoopClock {
    /// 90 Hz; a frame takes the time of one.
    fn default() -> Self {
        Self { rate: 90.0, latency: 1.0 / 90.0, speed: 1.0 }
    }
}

/// The parts of a loop.
pub struct VirtualLoop {
    /// Arm and hand.
    pub arm: SimulatedArm,
    /// What the arm runs.
    pub servo: Box<dyn Servo>,
    /// The ends of its channels.
    pub ends: ClayServoEnds,
    /// What the clay's tool is.
    pub tool: Tool,
    /// Plans the frames; its policy has to ask for [touches](crate::sim::frame::FrameOutputs::touch).
    pub planner: Planner,
    /// Runs the clay; loaded.
    pub engine: Box<dyn Engine>,
    /// Of the clay.
    pub material: ClayMaterial,
    clock: LoopClock,
    arm_tool: ArmTool,
    frames: u64,
    arriving: VecDeque<(f64, ContactModel)>,
}

/// A frame of a loop.
#[derive(Clone, Debug)]
pub struct LoopFrame {
    /// Ticks of the servo.
    pub samples: Vec<ServoSample>,
    /// Of the clay; none where no time was owed.
    pub report: Option<FrameReport>,
    /// What the servo will know of it.
    pub model: Option<ContactModel>,
}

impl VirtualLoop {
    /// A loop before its first frame. The clay's frame is the world's.
    pub fn new(
        arm: SimulatedArm,
        (servo, ends): (Box<dyn Servo>, ClayServoEnds),
        tool: Tool,
        (planner, engine, material): (Planner, Box<dyn Engine>, ClayMaterial),
        clock: LoopClock,
    ) -> Self {
        let (arm_tool, arriving) = (ArmTool::default(), VecDeque::new());
        Self { arm, servo, ends, tool, planner, engine, material, clock, arm_tool, frames: 0, arriving }
    }

    /// Runs arm and servo for the time of a frame, then the clay for what they did.
    ///
    /// # Errors
    /// A plan that the engine refuses, or one that stopped.
    pub fn frame(&mut self) -> Result<LoopFrame, EngineError> {
        self.frames += 1;
        let end = self.frames as f64 / self.clock.rate;
        let samples = self.feel(end);
        let way = self.arm_tool.way();
        let tools = way.iter().map(|way| {
            let on_clock = |s: &PoseSample| PoseSample { time: s.time * self.clock.speed, ..*s };
            ToolSamples { key: KEY, tool: self.tool, samples: way.samples.iter().map(on_clock).collect() }
        });
        let tools: Vec<ToolSamples> = tools.collect();
        self.planner.pass(way.map_or(0.0, |way| way.elapsed) * self.clock.speed, &tools);
        let Decision::Run(plan) = self.planner.next(&self.material) else {
            return Ok(LoopFrame { samples, report: None, model: None });
        };
        let plan_id = plan.id;
        self.engine.submit(plan)?;
        self.planner.sent();
        self.arm_tool.sent(plan_id, self.planner.lag() / self.clock.speed);
        let mut report = self.engine.wait()?;
        let id = report.touches.iter().map(|touch| touch.id).find(|id| self.planner.tool_key(*id) == Some(KEY));
        self.planner.note(&mut report);
        let known = end + self.clock.latency;
        let model = id.and_then(|id| self.arm_tool.note(&report, id, known));
        self.arriving.extend(model.map(|model| (known, model)));
        Ok(LoopFrame { samples, report: Some(report), model })
    }

    /// Runs the arm until `end` \[s\] and hands the servo what comes meanwhile.
    fn feel(&mut self, end: f64) -> Vec<ServoSample> {
        let mut samples = vec![];
        while self.arm.time() < end {
            while let Some((_, model)) = self.arriving.pop_front_if(|(at, _)| *at <= self.arm.time()) {
                self.ends.models.write(model);
            }
            self.arm.advance(&mut *self.servo);
            while let Ok(sample) = self.ends.samples.pop() {
                self.arm_tool.push(sample.time, Pose { position: sample.tool, rotation: sample.rotation });
                samples.push(sample);
            }
        }
        samples
    }
}
