//! Undo and redo, stroke by stroke, exact to the bit.
//!
//! A history keeps the clay as it stood at the end of each stroke, each state packed to about half of its
//! bytes, within a budget.
//!
//! A state is all that the clay goes on from: grid, walls, material, time, and the particles with their
//! places, strains, plastic strain, structure, volumes, ids and sides of cuts. It comes back with the same
//! bits, -0 and NaN too, and its particles in the order of their ids, whatever order an engine had them in.
//! Not part of it are
//!
//! - velocities, and affine velocities: at a stroke's end the clay is at rest but for what dies away, and
//!   undone clay is, so that nothing of a stroke that is undone goes on in it: they are 0;
//! - [`Snapshot::forecasts`]: what the GPU engine expects of the frames that would have followed; other
//!   frames will, and the engine bounds the same by the particles.
//!
//! ```
//! use bevy_clay::scene::history::History;
//! # use bevy_clay::sim::prelude::*;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let domain = Domain::new(glam::DVec3::ZERO, glam::DVec3::splat(0.1), 0.005, Walls::default())?;
//! # let place = domain.to_grid(glam::DVec3::splat(0.05));
//! # let clay = Snapshot::new(domain, Preset::SoftClay.material(), vec![Particle::at(place, 1e-8, 0)]);
//! # let pressed = Snapshot { time: 1.0, ..clay.clone() };
//! let mut history = History::new(History::BUDGET_DEFAULT);
//! history.record(clay.clone());
//! history.record(pressed.clone()); // a stroke later
//! assert_eq!(history.undo()?, Some(clay));
//! assert_eq!(history.redo()?, Some(pressed));
//! assert_eq!(history.redo()?, None);
//! # Ok(())
//! # }
//! ```

mod pack;
mod state;

use crate::sim::snapshot::Snapshot;
use pack::Packed;
use std::collections::VecDeque;
use std::io;

/// Why a state that was kept does not come back: the history's memory is not what it wrote. The history
/// stays as it was.
#[derive(Debug, thiserror::Error)]
#[error("a state kept for undo cannot be unpacked: {0}")]
pub struct HistoryError(#[source] io::Error);

/// The states of the clay, stroke by stroke, with a present one among them. It takes work, of the order of
/// 0.1 s for 100,000 particles: better done beside a frame loop.
#[derive(Debug)]
pub struct History {
    budget: usize,
    /// The oldest first.
    states: VecDeque<Packed>,
    /// Which of them is the present one, if there are any.
    present: usize,
    evicted: u64,
}

impl History {
    /// A budget for 64 strokes of 105,000 particles, and some \[bytes\].
    pub const BUDGET_DEFAULT: usize = 256 << 20;

    /// A history without states, which takes no more than `budget` bytes.
    pub fn new(budget: usize) -> Self {
        Self { budget, states: VecDeque::new(), present: 0, evicted: 0 }
    }

    /// Takes in the clay as it stands now that a stroke has ended, and where it becomes another otherwise:
    /// as loaded, on another grid, without offcuts. It is the present state; those that were undone are
    /// forgotten.
    pub fn record(&mut self, state: Snapshot) {
        self.states.truncate(self.present + 1);
        self.states.push_back(Packed::of(state));
        self.present = self.states.len() - 1;
        self.evict();
    }

    /// Takes the clay as it stands in place of the present state, from which it has come: it may have settled
    /// since. Before an undo, redo then leads back to it. Without a present state there is nothing to amend.
    pub fn amend(&mut self, now: Snapshot) {
        let Some(present) = self.states.get_mut(self.present) else { return };
        *present = Packed::of(now);
        self.evict();
    }

    /// Goes back to the state before the present one, if there is one.
    ///
    /// # Errors
    /// A state that cannot be unpacked.
    pub fn undo(&mut self) -> Result<Option<Snapshot>, HistoryError> {
        self.present.checked_sub(1).map_or(Ok(None), |before| self.go(before))
    }

    /// Goes on to the state after the present one, if it was undone.
    ///
    /// # Errors
    /// A state that cannot be unpacked.
    pub fn redo(&mut self) -> Result<Option<Snapshot>, HistoryError> {
        self.go(self.present + 1)
    }

    fn go(&mut self, to: usize) -> Result<Option<Snapshot>, HistoryError> {
        let Some(packed) = self.states.get(to) else { return Ok(None) };
        let state = packed.unpack().map_err(HistoryError)?;
        self.present = to;
        Ok(Some(state))
    }

    /// How many states can be undone.
    pub fn undo_count(&self) -> usize {
        self.present
    }

    /// How many states can be redone.
    pub fn redo_count(&self) -> usize {
        self.states.len().saturating_sub(self.present + 1)
    }

    /// Memory that the states take \[bytes\].
    pub fn bytes(&self) -> usize {
        self.states.iter().map(Packed::size).sum()
    }

    /// Memory that they may take \[bytes\].
    pub fn budget(&self) -> usize {
        self.budget
    }

    /// Gives the states another budget \[bytes\].
    pub fn set_budget(&mut self, budget: usize) {
        self.budget = budget;
        self.evict();
    }

    /// How many states went because the budget was spent.
    pub fn evicted(&self) -> u64 {
        self.evicted
    }

    /// Lets go what is beyond the budget: the oldest states, then the newest of those that can be redone. The
    /// present one stays, though it alone were beyond the budget: then there is no undo.
    fn evict(&mut self) {
        let mut bytes = self.bytes();
        while bytes > self.budget && self.states.len() > 1 {
            let gone = if self.present > 0 { self.states.pop_front() } else { self.states.pop_back() };
            self.present = self.present.saturating_sub(1);
            self.evicted += 1;
            bytes -= gone.as_ref().map_or(0, Packed::size);
        }
    }
}

#[cfg(test)]
mod tests;
