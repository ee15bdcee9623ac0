//! Where the two sides of a cut grow together: once a frame, at its end (see the oracle's file of this name).

use super::super::carry::SidesAbout;
use super::super::frame::FramePlan;
use super::super::snapshot::Tag;
use super::super::spline::spline;
use super::super::weld::WeldRule;
use super::grid::Grid;
use super::law;
use super::passes::work;
use super::state::{Hot, State, Table, strains, unpack_cell};
use super::step::Step;
use glam::{DMat3, DVec3, IVec3};
use rayon::prelude::*;

/// Counts the frame for every tag at which both sides meet, by the frame's `rule`; returns how many have
/// grown together and are gone.
pub(super) fn grow_together(state: &mut State, grid: &Grid, step: &Step, plan: &FramePlan, rule: WeldRule) -> u64 {
    let table = state.table.clone();
    let mut tasks = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs);
    tasks.retain(|w| !w.run.tagged.is_empty());
    let welded = tasks.into_par_iter().map(|w| {
        let mut welded = 0;
        for (hot, cold) in w.hot[w.run.untagged..].iter().zip(&mut w.cold[w.run.untagged..]) {
            for tag in cold.tags.iter_mut().filter(|tag| tag.side != 0 && !WeldRule::spares(plan, tag.sheet)) {
                let Some(normal) = normal(hot, *tag, grid, &table) else { continue };
                let is_pressed = normal.dot(cauchy_stress(step, hot) * normal) * step.stress_unit < -rule.stress;
                welded += u64::from(rule.count(tag, is_pressed));
            }
        }
        welded
    });
    welded.sum()
}

/// Cauchy stress in the units of the step's law.
fn cauchy_stress(step: &Step, hot: &Hot) -> DMat3 {
    let strain = strains(std::slice::from_ref(hot));
    let [xx, yy, zz, xy, xz, yz] = law::stress(&step.law, &strain).map(|lanes| f64::from(lanes.0[0]));
    let ratio = f64::from(law::hencky_invariants(&strain).1.0[0]).exp();
    DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz)) * (1.0 / ratio)
}

/// Unit normal of the tag's cut at the particle; none where the two sides do not meet.
fn normal(hot: &Hot, tag: Tag, grid: &Grid, table: &Table) -> Option<DVec3> {
    let at = IVec3::from_array(unpack_cell(hot.cell)).as_dvec3() + DVec3::from_array(hot.offset.map(f64::from));
    let base = (at - 0.5).floor().as_ivec3();
    let mut about = SidesAbout::default();
    for i in 0..27 {
        let node = base + IVec3::new(i / 9, i / 3 % 3, i % 3);
        let arm = node.as_dvec3() - at;
        let weight = spline(arm.x) * spline(arm.y) * spline(arm.z);
        for (side, sign) in [1, -1].into_iter().enumerate() {
            let mass = weight * grid.mass_on(table, node, tag.sheet, sign);
            about.masses[side] += mass;
            about.moments[side] += mass * arm;
        }
    }
    about.normal()
}
