//! Undo and redo, stroke by stroke, exact to the bit.
//!
//! A history keeps the clay as it stood at the end of each stroke, within a budget of bytes: the present
//! state plain, each other one packed beside its neighbour towards the present, of which it needs about half
//! the bits.
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
use state::State;
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
    present: Option<State>,
    /// States before the present one, the oldest first, each packed beside the one after it.
    past: VecDeque<Packed>,
    /// States after it, the newest first, each packed beside the one before it.
    future: VecDeque<Packed>,
    evicted: u64,
}

impl History {
    /// A budget for 64 strokes of 105,000 particles, and some \[bytes\].
    pub const BUDGET_DEFAULT: usize = 256 << 20;

    /// A history without states, which takes no more than `budget` bytes.
    pub fn new(budget: usize) -> Self {
        Self { budget, present: None, past: VecDeque::new(), future: VecDeque::new(), evicted: 0 }
    }

    /// Takes in the clay as it stands now that a stroke has ended, and where it becomes another otherwise:
    /// as loaded, on another grid, without offcuts. It is the present state; those that were undone are
    /// forgotten.
    pub fn record(&mut self, state: Snapshot) {
        let state = State::of(state);
        self.future.clear();
        if let Some(before) = self.present.take() {
            self.past.push_back(Packed::beside(&state, &before));
        }
        self.present = Some(state);
        self.evict();
    }

    /// Takes the clay as it stands in place of the present state, from which it has come: it may have settled
    /// since. Before an undo, redo then leads back to it. Without a present state there is nothing to amend.
    ///
    /// # Errors
    /// A state beside it that cannot be unpacked.
    pub fn amend(&mut self, now: Snapshot) -> Result<(), HistoryError> {
        let Some(present) = &self.present else { return Ok(()) };
        let now = State::of(now);
        // One after the other, so that no more than one more state is there plain; nothing is changed before
        // both are known to be sound.
        let beside_now = |neighbour: Option<&Packed>| {
            neighbour.map(|packed| packed.unpack(present).map(|state| Packed::beside(&now, &state))).transpose()
        };
        let before = beside_now(self.past.back()).map_err(HistoryError)?;
        let after = beside_now(self.future.back()).map_err(HistoryError)?;
        for (side, packed) in [(&mut self.past, before), (&mut self.future, after)] {
            side.iter_mut().next_back().zip(packed).into_iter().for_each(|(old, packed)| *old = packed);
        }
        self.present = Some(now);
        self.evict();
        Ok(())
    }

    /// Goes back to the state before the present one, if there is one.
    ///
    /// # Errors
    /// A state that cannot be unpacked.
    pub fn undo(&mut self) -> Result<Option<Snapshot>, HistoryError> {
        self.step(Way::Back)
    }

    /// Goes on to the state after the present one, if it was undone.
    ///
    /// # Errors
    /// A state that cannot be unpacked.
    pub fn redo(&mut self) -> Result<Option<Snapshot>, HistoryError> {
        self.step(Way::On)
    }

    fn step(&mut self, way: Way) -> Result<Option<Snapshot>, HistoryError> {
        let (from, to) = match way {
            Way::Back => (&mut self.past, &mut self.future),
            Way::On => (&mut self.future, &mut self.past),
        };
        let (Some(here), Some(packed)) = (&self.present, from.pop_back()) else { return Ok(None) };
        let there = match packed.unpack(here) {
            Ok(there) => there,
            Err(error) => {
                from.push_back(packed);
                return Err(HistoryError(error));
            }
        };
        to.push_back(packed.turned(here, &there));
        let snapshot = there.snapshot();
        self.present = Some(there);
        self.evict();
        Ok(Some(snapshot))
    }

    /// How many states can be undone.
    pub fn undo_count(&self) -> usize {
        self.past.len()
    }

    /// How many states can be redone.
    pub fn redo_count(&self) -> usize {
        self.future.len()
    }

    /// Memory that the states take \[bytes\].
    pub fn bytes(&self) -> usize {
        let packed: usize = self.past.iter().chain(&self.future).map(Packed::size).sum();
        self.present.as_ref().map_or(0, State::size) + packed
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
        while bytes > self.budget {
            let Some(packed) = self.past.pop_front().or_else(|| self.future.pop_front()) else { break };
            bytes -= packed.size();
            self.evicted += 1;
        }
    }
}

/// Where a step leads.
#[derive(Clone, Copy)]
enum Way {
    Back,
    On,
}

#[cfg(test)]
mod tests;
