//! Undo and redo of an app's clay: a state for each stroke, kept away from the main thread.

use crate::scene::history::History;
use crate::sim::snapshot::Snapshot;
use bevy::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A stroke is over when no tool has touched the clay for this long \[s\]: a tool that slides along the surface
/// leaves it for less.
const STROKE_GAP: f64 = 0.15;

/// Keeps the clay as it stands after each stroke and change, for [`UndoClay`](super::events::UndoClay) and
/// [`RedoClay`](super::events::RedoClay): put beside a [`Clay`](super::clay::Clay), it remembers from then
/// on.
///
/// A stroke goes from the first touch of a tool to where no tool has touched the clay for 0.15 s. States are
/// exact but for velocities, which are zero in clay that comes back: see [`History`].
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(Component, Default)]
pub struct ClayHistory {
    /// Memory that the states may take \[bytes\], 256 MiB if nothing else is said; the oldest go beyond.
    pub budget: usize,
    /// What was said of it last.
    #[reflect(ignore)]
    pub(super) extent: Extent,
    #[reflect(ignore, default = "empty")]
    history: Arc<Mutex<History>>,
    /// When a tool last touched the clay in the stroke under way \[s\].
    #[reflect(ignore)]
    touched: Option<f64>,
}

/// How far a history reaches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Extent {
    undo_count: usize,
    redo_count: usize,
    bytes: usize,
    evicted: u64,
}

fn empty() -> Arc<Mutex<History>> {
    Arc::new(Mutex::new(History::new(History::BUDGET_DEFAULT)))
}

impl Default for ClayHistory {
    fn default() -> Self {
        Self { budget: History::BUDGET_DEFAULT, extent: Extent::default(), history: empty(), touched: None }
    }
}

impl ClayHistory {
    /// A history within so much memory \[bytes\].
    pub fn with_budget(budget: usize) -> Self {
        Self { budget, ..Self::default() }
    }

    /// Strokes and changes that can be undone.
    pub fn undo_count(&self) -> usize {
        self.extent.undo_count
    }

    /// Strokes and changes that can be redone.
    pub fn redo_count(&self) -> usize {
        self.extent.redo_count
    }

    /// Memory that the states take \[bytes\].
    pub fn bytes(&self) -> usize {
        self.extent.bytes
    }

    /// States that went because the budget was spent.
    pub fn evicted(&self) -> u64 {
        self.extent.evicted
    }

    /// The states, for another thread.
    pub(super) fn shared(&self) -> Kept {
        Kept { budget: self.budget, history: self.history.clone() }
    }

    /// Says whether a tool touches the clay at `now` \[s\]; whether a stroke is over with that.
    pub(super) fn touch(&mut self, is_touched: bool, now: f64) -> bool {
        if is_touched {
            self.touched = Some(now);
        }
        self.touched.take_if(|at| now - *at >= STROKE_GAP).is_some()
    }

    /// Whether a stroke is under way; it is over with that.
    pub(super) fn end_stroke(&mut self) -> bool {
        self.touched.take().is_some()
    }
}

/// A history on another thread.
pub(super) struct Kept {
    budget: usize,
    history: Arc<Mutex<History>>,
}

impl Kept {
    /// Begins anew with this state.
    pub(super) fn begin(&self, state: Snapshot) {
        let mut states = self.states();
        *states = History::new(self.budget);
        states.record(state);
    }

    /// The states, within the budget.
    pub(super) fn states(&self) -> MutexGuard<'_, History> {
        // A panic midway is of one that was not recorded.
        let mut history = self.history.lock().unwrap_or_else(PoisonError::into_inner);
        if history.budget() != self.budget {
            history.set_budget(self.budget);
        }
        history
    }

    /// How far it reaches now.
    pub(super) fn extent(&self) -> Extent {
        let history = self.states();
        Extent {
            undo_count: history.undo_count(),
            redo_count: history.redo_count(),
            bytes: history.bytes(),
            evicted: history.evicted(),
        }
    }
}
