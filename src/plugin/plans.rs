//! What is planned for a clay, handed to its engine.

use crate::sim::engine::{Engine, EngineError};
use crate::sim::health::Health;
use crate::sim::material::ClayMaterial;
use crate::sim::params::ParamsError;
use crate::sim::planner::{Decision, Planner};
use crate::sim::snapshot::Snapshot;
use bevy::prelude::*;

/// What is planned for an engine, and what was said of it.
#[derive(Default)]
pub(super) struct Plans {
    pub(super) planner: Planner,
    /// Kinds of trouble that were logged.
    pub(super) logged: Health,
    /// Why the last plan was not taken.
    pub(super) refused: Option<ParamsError>,
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

    /// Submits a frame of the time owed, if there is any and the engine takes one.
    pub(super) fn step(&mut self, engine: &mut dyn Engine, material: &ClayMaterial) -> Result<(), EngineError> {
        let Decision::Run(plan) = self.planner.next(material) else { return Ok(()) };
        engine.submit(plan).inspect_err(|_| self.planner.refused())?;
        self.planner.sent();
        self.refused = None;
        Ok(())
    }

    /// Leaves the clay as it stands and says why, once for each reason.
    pub(super) fn refuse(&mut self, entity: Entity, error: ParamsError) {
        if self.refused.as_ref() != Some(&error) {
            error!("clay {entity} stands still: {error}");
            self.refused = Some(error);
        }
    }
}
