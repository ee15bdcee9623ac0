//! A state packed beside its neighbour: what differs, deflated.
//!
//! Of a stroke most particles move a little and few move far. A number's bits are taken against those of the
//! same particle in the neighbour (exclusive or), so that what they agree in is 0: sign, exponent and the
//! first digits; the first bytes of all, the second bytes of all, ... stand together. What is left are the
//! digits that did change. After strokes that sway all of the clay these are as many as a state by itself has
//! (30 of 68 bytes a particle, either way); where clay moves by less than its digits reach, they are fewer.

use super::state::State;
use crate::sim::snapshot::Snapshot;
use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;
use std::io::{self, Read, Write};

/// Bytes of a word.
const BYTES: usize = 4;
/// How hard to look for what repeats. A level less takes 9 % more bytes and three quarters of the time, a
/// level more 1 % fewer bytes and a tenth more time: there is hardly anything but digits.
const LEVEL: Compression = Compression::new(2);

/// A state that can be unpacked beside the state that it was packed beside, and no other.
#[derive(Debug)]
pub(super) struct Packed {
    head: Snapshot,
    count: usize,
    /// Byte planes of the ids, then of each column, deflated.
    pub(super) planes: Vec<u8>,
}

impl Packed {
    /// Packs `state` beside `neighbour`.
    pub(super) fn beside(neighbour: &State, state: &State) -> Self {
        let count = state.ids.len();
        let mut out = DeflateEncoder::new(vec![], LEVEL);
        let mut planes = vec![0; BYTES * count];
        let mut write = |words: &mut dyn Iterator<Item = u32>| {
            split(words, &mut planes);
            // Memory takes whatever is written; were it not so, it could not be unpacked, which is told.
            let _ = out.write_all(&planes);
        };
        let mut next = 0u32;
        write(&mut state.ids.iter().map(|id| id.wrapping_sub(std::mem::replace(&mut next, id.wrapping_add(1)))));
        let partners = partners(neighbour, &state.head, &state.ids);
        for (column, beside) in state.columns().zip(columns_of(neighbour)) {
            write(&mut column.iter().zip(&partners).map(|(word, partner)| word ^ partner.map_or(0, |i| beside[i as usize])));
        }
        let mut planes = out.finish().unwrap_or_default();
        planes.shrink_to_fit();
        Self { head: Snapshot { particles: vec![], ..state.head }, count, planes }
    }

    /// The state again, beside the same neighbour.
    ///
    /// # Errors
    /// Bytes that are not what [`Self::beside`] made.
    pub(super) fn unpack(&self, neighbour: &State) -> io::Result<State> {
        let mut input = DeflateDecoder::new(&*self.planes);
        let mut planes = vec![0; BYTES * self.count];
        let mut ids = vec![0; self.count];
        input.read_exact(&mut planes)?;
        join(&planes, &mut ids);
        let mut next = 0u32;
        for id in &mut ids {
            *id = id.wrapping_add(next);
            next = id.wrapping_add(1);
        }
        let mut state = State::with(Snapshot { particles: vec![], ..self.head }, ids);
        let partners = partners(neighbour, &state.head, &state.ids);
        for (column, beside) in state.columns_mut().zip(columns_of(neighbour)) {
            input.read_exact(&mut planes)?;
            join(&planes, column);
            for (word, partner) in column.iter_mut().zip(&partners) {
                *word ^= partner.map_or(0, |i| beside[i as usize]);
            }
        }
        Ok(state)
    }

    /// Of two neighbours, `here` and `there`, of which `there` is packed in this one: `here` in its stead.
    /// What differs is the same seen from either side, as long as the particles are the same.
    pub(super) fn turned(self, here: &State, there: &State) -> Self {
        if here.head.domain != there.head.domain || here.ids != there.ids {
            return Self::beside(there, here);
        }
        Self { head: Snapshot { particles: vec![], ..here.head }, ..self }
    }

    /// Memory it takes \[bytes\].
    pub(super) fn size(&self) -> usize {
        size_of::<Self>() + self.planes.len()
    }
}

/// The neighbour's columns, empty ones where it has no particles.
fn columns_of(neighbour: &State) -> impl Iterator<Item = &[u32]> {
    neighbour.columns().chain(std::iter::repeat(&[][..]))
}

/// Where in `neighbour` the particle of each id is; nowhere on another grid, where it has another cell and
/// most likely no more than its id in common.
fn partners(neighbour: &State, head: &Snapshot, ids: &[u32]) -> Vec<Option<u32>> {
    if neighbour.head.domain != head.domain {
        return vec![None; ids.len()];
    }
    let mut others = (0..).zip(&neighbour.ids).peekable();
    let partner = |id: &u32| {
        while others.next_if(|(_, other)| *other < id).is_some() {}
        others.next_if(|(_, other)| *other == id).map(|(i, _)| i)
    };
    ids.iter().map(partner).collect()
}

/// Splits words into planes: the low byte of each, then the next of each.
fn split(words: &mut dyn Iterator<Item = u32>, planes: &mut [u8]) {
    let count = planes.len() / BYTES;
    for (i, word) in words.enumerate() {
        word.to_le_bytes().iter().enumerate().for_each(|(plane, byte)| planes[plane * count + i] = *byte);
    }
}

/// Joins what [`split`] has split.
fn join(planes: &[u8], words: &mut [u32]) {
    let count = words.len();
    for (i, word) in words.iter_mut().enumerate() {
        *word = u32::from_le_bytes(std::array::from_fn(|plane| planes[plane * count + i]));
    }
}
