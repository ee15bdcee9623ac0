//! Where the sides of a cut are carried on: once a frame, at its end (see the oracle's file of this name).

use super::super::carry;
use super::super::frame::FramePlan;
use super::about::{MassesAbout, bodies, classes_about, sheets};
use super::grid::Grid;
use super::passes::work;
use super::state::{Cold, State};
use rayon::prelude::*;

/// Gives particles the sides that they have come to need; returns how many.
pub(super) fn carry_on(state: &mut State, grid: &Grid, plan: &FramePlan) -> u64 {
    if grid.cuts.is_empty() {
        return 0;
    }
    let table = state.table.clone();
    let tasks = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs);
    let carried = tasks.into_par_iter().map(|w| {
        let classes = classes_about(grid, &table, w.block);
        let mut carried = 0;
        for body in bodies(&classes) {
            for sheet in sheets(&classes, body).into_iter().filter(|sheet| carry::is_carried(plan, *sheet)) {
                let Some(masses) = MassesAbout::new(grid, &table, w.block, |key| key.is_front(body, sheet)) else { continue };
                let is_open = |cold: &Cold| cold.body == u32::from(body) && carry::is_open(&cold.tags, sheet);
                for (hot, cold) in w.hot.iter().zip(&mut *w.cold).filter(|(_, cold)| is_open(cold)) {
                    carried += u64::from(carry::take(&mut cold.tags, sheet, &masses.about(hot)));
                }
            }
        }
        carried
    });
    carried.sum()
}
