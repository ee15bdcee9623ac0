//! Anti-locking: the volume ratios of particles that have flowed come to the mean of their cell (see the
//! oracle's file of this name for why).
//!
//! The particles have just been sorted: those of a cell and class follow each other.

use super::law;
use super::passes::work;
use super::state::{Cold, Hot, State, strains};
use rayon::prelude::*;

/// What a particle brings to its cell's mean.
#[derive(Clone, Copy, Default)]
struct Term {
    /// Of the difference to the mean, that it takes [-].
    share: f64,
    log: f64,
}

/// Averages volumes within the plastic strain `strain` [-], and begins to count it anew.
pub(super) fn average_volumes(state: &mut State, strain: f64) {
    work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs).into_par_iter().for_each(|w| {
        for (_, hot, cold) in w.run.classes(w.hot, w.cold) {
            let terms = terms(hot, cold, strain);
            let mut first = 0;
            for cell in hot.chunk_by_mut(|a, b| a.cell == b.cell) {
                average_cell(cell, &terms[first..first + cell.len()]);
                first += cell.len();
            }
        }
    });
}

/// Shares and ln J of particles, whose strain counts from now on.
fn terms(hot: &[Hot], cold: &mut [Cold], strain: f64) -> Vec<Term> {
    let mut terms = Vec::with_capacity(hot.len());
    for (hot, cold) in hot.chunks(8).zip(cold.chunks_mut(8)) {
        if hot.iter().zip(&*cold).all(|(h, c)| h.hardening == c.averaged_at) {
            terms.extend(hot.iter().map(|_| Term::default()));
            continue;
        }
        let (_, trace) = law::hencky_invariants(&strains(hot));
        terms.extend(hot.iter().zip(cold).enumerate().map(|(k, (h, c))| {
            let flowed = h.hardening - std::mem::replace(&mut c.averaged_at, h.hardening);
            Term { share: -(-f64::from(flowed) / strain).exp_m1(), log: f64::from(trace.0[k]) }
        }));
    }
    terms
}

/// One cell's particles of one class.
#[expect(clippy::cast_possible_truncation, reason = "state is f32")]
fn average_cell(cell: &mut [Hot], terms: &[Term]) {
    let weighted = cell.iter().zip(terms).map(|(h, t)| (f64::from(h.mass) * t.share, t.log));
    let (weight, sum) = weighted.fold((0.0, 0.0), |(weight, sum), (w, log)| (weight + w, sum + w * log));
    for (hot, term) in cell.iter_mut().zip(terms).filter(|(_, term)| term.share > 0.0) {
        // The deviator stays: b *= exp(2 change / 3).
        let grown = (2.0 / 3.0 * term.share * (sum / weight - term.log)).exp_m1() as f32;
        for (i, e) in hot.strain.iter_mut().enumerate() {
            *e += (*e + if i < 3 { 1.0 } else { 0.0 }) * grown;
        }
    }
}
