//! A state in less memory: its columns, deflated.
//!
//! The low byte of all numbers of a column stands before the next byte of all, so that what particles have
//! in common, sign, exponent and first digits, stands together: 32 of 68 bytes a particle are left after
//! strokes of a ball. Taken against the same particle's numbers in the state before, they are as many:
//! strokes sway all of the clay by more than the last digits.

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

/// A packed state.
#[derive(Debug)]
pub(super) struct Packed {
    head: Snapshot,
    count: usize,
    /// Byte planes of the ids, then of each column, deflated.
    pub(super) planes: Vec<u8>,
}

impl Packed {
    /// Packs the state of `snapshot`, whose memory is given back.
    pub(super) fn of(snapshot: Snapshot) -> Self {
        let State { head, ids, words } = State::of(snapshot);
        let count = ids.len();
        let mut out = DeflateEncoder::new(vec![], LEVEL);
        let mut planes = vec![0; BYTES * count];
        let mut write = |column: &[u32]| {
            split(column, &mut planes);
            // Memory takes whatever is written; were it not so, it could not be unpacked, which is told.
            let _ = out.write_all(&planes);
        };
        let mut next = 0u32;
        let jumps: Vec<u32> = ids.iter().map(|id| id.wrapping_sub(std::mem::replace(&mut next, id.wrapping_add(1)))).collect();
        write(&jumps);
        // Clay without particles has no columns: no chunk may be empty.
        words.chunks_exact(count.max(1)).for_each(write);
        let mut planes = out.finish().unwrap_or_default();
        planes.shrink_to_fit();
        Self { head, count, planes }
    }

    /// The state again.
    ///
    /// # Errors
    /// Bytes that are not what [`Self::of`] made.
    pub(super) fn unpack(&self) -> io::Result<Snapshot> {
        let mut input = DeflateDecoder::new(&*self.planes);
        let mut planes = vec![0; BYTES * self.count];
        let mut read = |column: &mut [u32]| {
            input.read_exact(&mut planes)?;
            join(&planes, column);
            Ok::<_, io::Error>(())
        };
        let mut ids = vec![0; self.count];
        read(&mut ids)?;
        let mut next = 0u32;
        for id in &mut ids {
            *id = id.wrapping_add(next);
            next = id.wrapping_add(1);
        }
        let mut state = State::blank(&self.head, ids);
        state.words.chunks_exact_mut(self.count.max(1)).try_for_each(read)?;
        Ok(state.snapshot())
    }

    /// Memory it takes \[bytes\].
    pub(super) fn size(&self) -> usize {
        size_of::<Self>() + self.planes.len()
    }
}

/// Splits words into planes: the low byte of each, then the next of each.
fn split(words: &[u32], planes: &mut [u8]) {
    let count = words.len();
    for (i, word) in words.iter().enumerate() {
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
