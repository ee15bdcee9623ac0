//! What is planned for a clay, handed to its engine.

use crate::sim::engine::{Engine, EngineError};
use crate::sim::frame::{FrameReport, ToolReport};
use crate::sim::health::Health;
use crate::sim::material::ClayMaterial;
use crate::sim::params::ParamsError;
use crate::sim::planner::{Decision, Planner, ToolSamples};
use crate::sim::snapshot::Snapshot;
use crate::sim::tool::PoseSample;
use bevy::prelude::*;

/// What is planned for an engine, and what was said of it.
#[derive(Default)]
pub(super) struct Plans {
    pub(super) planner: Planner,
    /// Kinds of trouble that were logged.
    pub(super) logged: Health,
    /// Why the last plan was not taken.
    pub(super) refused: Option<ParamsError>,
    /// What the tools felt in the last frame.
    pub(super) felt: Vec<(Entity, ToolReport)>,
    /// The tools in hand, by the clock of whoever drives the clay.
    hands: Vec<Hand>,
    /// Time of the clay's clock so far \[s\].
    clock: f64,
    /// Whether the tools are off the clay: what frames under way still feel is over.
    is_lifted: bool,
}

/// A tool in hand.
struct Hand {
    tool: ToolSamples,
    /// Whether the planner has its samples: what comes next takes their place.
    is_passed: bool,
}

impl Plans {
    pub(super) fn new(snapshot: &Snapshot) -> Self {
        Self { planner: Planner::new(snapshot), ..Self::default() }
    }

    /// Goes on where `old`, the plans of the same clay on another engine, stand.
    pub(super) fn take_over(&mut self, old: Self) {
        let mut planner = std::mem::take(&mut self.planner);
        planner.take_over(old.planner);
        *self = Self { planner, ..old };
    }

    /// Takes in where the tools were, by the clock of [`Self::pass`]; those not among them have been let go
    /// of.
    pub(super) fn offer(&mut self, tools: Vec<ToolSamples>) {
        let mut before = std::mem::take(&mut self.hands);
        let joined = |mut tool: ToolSamples| {
            let waiting = before.iter_mut().find(|hand| hand.tool.key == tool.key && !hand.is_passed);
            if let Some(hand) = waiting {
                let mut samples = std::mem::take(&mut hand.tool.samples);
                let last = samples.last().map_or(f64::NEG_INFINITY, |s| s.time);
                samples.extend(tool.samples.into_iter().filter(|s| s.time > last));
                tool.samples = samples;
            }
            Hand { tool, is_passed: false }
        };
        self.hands = tools.into_iter().map(joined).collect();
    }

    /// Lets `time` \[s\] of a clock pass that stands at `now` \[s\], at `speed`, in which the tools in hand went
    /// the ways that they were offered with, and `also` went its own.
    pub(super) fn pass(&mut self, time: f64, speed: f64, now: f64, also: Option<ToolSamples>) {
        self.clock += time * speed;
        let on_clock = |s: &PoseSample| PoseSample { time: self.clock + (s.time - now) * speed, pose: s.pose };
        let ours = |tool: &ToolSamples| ToolSamples { samples: tool.samples.iter().map(on_clock).collect(), ..*tool };
        let tools: Vec<_> = self.hands.iter().map(|hand| ours(&hand.tool)).chain(also.as_ref().map(ours)).collect();
        self.hands.iter_mut().for_each(|hand| hand.is_passed = true);
        self.is_lifted = false;
        self.planner.pass(time * speed, &tools);
    }

    /// Takes the tools off the clay: they are put down anew when time goes on.
    pub(super) fn lift(&mut self) {
        self.planner.lift();
        self.hands.clear();
        self.felt.clear();
        self.is_lifted = true;
    }

    /// Takes in what came of a frame. Returns the entities of its tools, in their order.
    pub(super) fn note(&mut self, report: &mut FrameReport) -> Vec<Entity> {
        let key = |tool: &ToolReport| self.planner.tool_key(tool.id).and_then(Entity::try_from_bits);
        let tools: Vec<Entity> = report.tools.iter().map(|tool| key(tool).unwrap_or(Entity::PLACEHOLDER)).collect();
        self.planner.note(report);
        self.felt.clear();
        if !self.is_lifted {
            self.felt.extend(tools.iter().copied().zip(report.tools.iter().copied()));
        }
        tools
    }

    /// Submits a frame of the time owed, if there is any and the engine takes one: its id.
    pub(super) fn step(&mut self, engine: &mut dyn Engine, material: &ClayMaterial) -> Result<Option<u64>, EngineError> {
        let Decision::Run(plan) = self.planner.next(material) else { return Ok(None) };
        let id = plan.id;
        engine.submit(plan).inspect_err(|_| self.planner.refused())?;
        self.planner.sent();
        self.refused = None;
        Ok(Some(id))
    }

    /// Leaves the clay as it stands and says why, once for each reason.
    pub(super) fn refuse(&mut self, entity: Entity, error: ParamsError) {
        if self.refused.as_ref() != Some(&error) {
            error!("clay {entity} stands still: {error}");
            self.refused = Some(error);
        }
    }
}
