//! Anti-locking: the volume ratios of flowing particles relax to the mean of their cell (see the oracle's
//! file of this name for why).
//!
//! The particles have just been sorted: those of a cell and class follow each other.

use super::super::limits::FLOWING;
use super::contact::Moment;
use super::law;
use super::particle_step::ParticleStep;
use super::passes::work;
use super::state::{Cold, Hot, State, strains};
use rayon::prelude::*;

/// Takes `share` of the difference to the cell's mean ln J from every flowing particle; tools as they stand
/// at the start of the substep of `s`.
pub(super) fn average_volumes(s: &ParticleStep<'_>, state: &mut State, share: f64) {
    work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs).into_par_iter().for_each(|w| {
        let is_softened = s.softens(w.block);
        for (_, hot, cold) in w.run.classes(w.hot, w.cold).filter(|(_, hot, _)| hot.len() > 1) {
            let logs = flowing_logs(s, hot, cold, is_softened);
            let mut first = 0;
            for cell in hot.chunk_by_mut(|a, b| a.cell == b.cell) {
                average_cell(cell, &logs[first..first + cell.len()], share);
                first += cell.len();
            }
        }
    });
}

/// ln J of the particles that flow.
#[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
fn flowing_logs(s: &ParticleStep<'_>, hot: &[Hot], cold: &[Cold], is_softened: bool) -> Vec<Option<f64>> {
    let mut logs = Vec::with_capacity(hot.len());
    for (hot, cold) in hot.chunks(8).zip(cold.chunks(8)) {
        let (norm2, trace) = law::hencky_invariants(&strains(hot));
        logs.extend(hot.iter().zip(cold).enumerate().map(|(k, (h, c))| {
            let deviator = (norm2.0[k] - trace.0[k] * trace.0[k] / 3.0).max(0.0).sqrt();
            let flows = deviator >= FLOWING as f32 * s.yield_norm(h, c, is_softened, Moment::Start);
            flows.then_some(f64::from(trace.0[k]))
        }));
    }
    logs
}

/// One cell's particles of one class.
#[expect(clippy::cast_possible_truncation, reason = "state is f32")]
fn average_cell(cell: &mut [Hot], logs: &[Option<f64>], share: f64) {
    let flowing = cell.iter().zip(logs).filter_map(|(h, log)| Some((f64::from(h.mass), (*log)?)));
    let (mass, sum) = flowing.fold((0.0, 0.0), |(mass, sum), (m, log)| (mass + m, sum + m * log));
    for (hot, log) in cell.iter_mut().zip(logs) {
        let Some(log) = log else { continue };
        // The deviator stays: b *= exp(2 change / 3).
        let grown = (2.0 / 3.0 * share * (sum / mass - log)).exp_m1() as f32;
        for (i, e) in hot.strain.iter_mut().enumerate() {
            *e += (*e + if i < 3 { 1.0 } else { 0.0 }) * grown;
        }
    }
}
