//! Clay whose frames a planner plans, as it does for apps and scenes.

use crate::lab::engine;
use bevy_clay::sim::prelude::*;

/// An engine with clay in it, and its planner.
pub(super) struct Planned {
    engine: Box<dyn Engine>,
    planner: Planner,
    material: ClayMaterial,
}

impl Planned {
    /// Loads `clay` into an engine on `threads` cores, 0 for all.
    pub(super) fn new(clay: &Snapshot, policy: Policy, threads: usize) -> Self {
        let mut engine = engine(threads);
        engine.load(clay).expect("the clay loads");
        let mut planner = Planner::new(clay);
        planner.policy = policy;
        Self { engine, planner, material: clay.material }
    }

    /// Runs a frame of `duration` \[s\] with `tools`.
    pub(super) fn frame(&mut self, duration: f64, tools: &[ToolPath]) -> FrameReport {
        let Decision::Run(plan) = self.planner.frame(&self.material, duration, tools) else {
            unreachable!("no frame is under way");
        };
        self.engine.submit(plan).expect("a sound plan");
        self.planner.sent();
        let mut report = self.engine.wait().expect("the engine runs");
        self.planner.note(&mut report);
        report
    }

    /// The clay now, in the engine's order.
    pub(super) fn particles(&self) -> Vec<Particle> {
        self.engine.state_deferred().expect("clay is loaded")().expect("a state").particles
    }
}
