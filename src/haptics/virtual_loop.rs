//! Arm, hand, servo, planner and clay in virtual time: what a hand feels of an engine's clay, the same on
//! every machine.

use super::arm_tool::ArmTool;
use super::model::ContactModel;
use super::servo::ServoSample;
use super::virtual_hand::VirtualHand;
use crate::sim::engine::{Engine, EngineError};
use crate::sim::frame::FrameReport;
use crate::sim::material::ClayMaterial;
use crate::sim::planner::{Decision, Planner, ToolSamples};
use crate::sim::tool::{Pose, PoseSample, Tool};

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
    /// Arm, hand and servo.
    pub hand: VirtualHand,
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
        hand: VirtualHand,
        tool: Tool,
        (planner, engine, material): (Planner, Box<dyn Engine>, ClayMaterial),
        clock: LoopClock,
    ) -> Self {
        Self { hand, tool, planner, engine, material, clock, arm_tool: ArmTool::default(), frames: 0 }
    }

    /// Runs arm and servo for the time of a frame, then the clay for what they did.
    ///
    /// # Errors
    /// A plan that the engine refuses, or one that stopped.
    pub fn frame(&mut self) -> Result<LoopFrame, EngineError> {
        self.frames += 1;
        let end = self.frames as f64 / self.clock.rate;
        let samples = self.hand.feel(end).samples;
        samples.iter().for_each(|s| self.arm_tool.push(s.time, Pose { position: s.tool, rotation: s.rotation }));
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
        if let Some(model) = model {
            self.hand.send(known, model);
        }
        Ok(LoopFrame { samples, report: Some(report), model })
    }
}
