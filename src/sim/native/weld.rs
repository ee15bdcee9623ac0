//! Where the two sides of a cut, or two bodies, grow together: once a frame, at its end (see the oracle's
//! file of this name).

use super::super::cut::{ClassKey, JOINT_SHEET};
use super::super::frame::FramePlan;
use super::super::weld::WeldRule;
use super::about::{MassesAbout, bodies, classes_about, sheets};
use super::grid::Grid;
use super::law;
use super::passes::{Work, work};
use super::state::{Cold, Hot, State, Table, strains};
use super::step::Step;
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Counts the frame for every tag at which both sides meet, and every particle that meets another body, by
/// the frame's `rule`; returns how many sides, and how many such particles, have grown together.
pub(super) fn grow_together(state: &mut State, grid: &Grid, step: &Step, plan: &FramePlan, rule: WeldRule) -> [u64; 2] {
    if grid.cuts.is_empty() {
        return [0; 2];
    }
    let table = state.table.clone();
    let pressing = Pressing { grid, table: &table, step, plan, rule };
    let mut tasks = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs);
    let counts = |cold: &Cold| cold.tags.iter().any(|tag| tag.sheet == JOINT_SHEET);
    tasks.retain(|w| grid.cut_at(&table, w.block).is_some() || w.cold.iter().any(counts));
    let welded = tasks.into_par_iter().map(|w| pressing.in_block(w));
    welded.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
}

/// What the sides of cuts and bodies are pressed by.
struct Pressing<'a> {
    grid: &'a Grid,
    table: &'a Table,
    step: &'a Step,
    plan: &'a FramePlan,
    rule: WeldRule,
}

impl Pressing<'_> {
    fn in_block(&self, w: Work<'_>) -> [u64; 2] {
        let (hot, cold) = (w.hot, w.cold);
        let (mut welded, mut joined) = (0, 0);
        let classes = classes_about(self.grid, self.table, w.block);
        let masses_of = |is_front: &dyn Fn(ClassKey) -> Option<bool>| MassesAbout::new(self.grid, self.table, w.block, is_front);
        for body in bodies(&classes) {
            let own = |cold: &Cold| cold.body == u32::from(body);
            for sheet in sheets(&classes, body) {
                let Some(masses) = masses_of(&|key| key.is_front(body, sheet)) else { continue };
                let its = hot.iter().zip(&mut *cold).filter(|(_, cold)| own(cold));
                welded += its.map(|(hot, cold)| self.count(&masses, sheet, hot, cold)).sum::<u64>();
            }
            let masses = masses_of(&|key| Some(key.body() == body));
            let its = hot.iter().zip(&mut *cold).filter(|(_, cold)| own(cold));
            joined += its.map(|(hot, cold)| self.count_joint(masses.as_ref(), hot, cold)).sum::<u64>();
        }
        [welded, joined]
    }

    /// Counts the tags of a sheet, or marks them where its blade is there.
    fn count(&self, masses: &MassesAbout, sheet: u8, hot: &Hot, cold: &mut Cold) -> u64 {
        let mut welded = 0;
        for tag in cold.tags.iter_mut().filter(|tag| tag.side != 0 && tag.sheet == sheet) {
            let Some(normal) = masses.about(hot).normal() else { continue };
            let is_pressed = self.is_pressed(hot, normal, self.rule.stress_at(self.plan, *tag));
            if WeldRule::spares(self.plan, sheet) {
                WeldRule::mark(tag, is_pressed);
            } else {
                welded += u64::from(self.rule.count(tag, is_pressed));
            }
        }
        welded
    }

    /// Counts a particle that meets another body.
    fn count_joint(&self, masses: Option<&MassesAbout>, hot: &Hot, cold: &mut Cold) -> u64 {
        let normal = masses.and_then(|masses| masses.about(hot).normal());
        let is_counting = cold.tags.iter().any(|tag| tag.sheet == JOINT_SHEET);
        if normal.is_none() && !is_counting {
            return 0;
        }
        let is_pressed =
            normal.is_some_and(|normal| self.is_pressed(hot, normal, self.rule.joint_stress_at(self.plan, &cold.tags)));
        u64::from(self.rule.count_joint(&mut cold.tags, is_pressed, |sheet| WeldRule::spares(self.plan, sheet)))
    }

    fn is_pressed(&self, hot: &Hot, normal: DVec3, stress: f64) -> bool {
        normal.dot(cauchy_stress(self.step, hot) * normal) * self.step.stress_unit < -stress
    }
}

/// Cauchy stress in the units of the step's law.
fn cauchy_stress(step: &Step, hot: &Hot) -> DMat3 {
    let strain = strains(std::slice::from_ref(hot));
    let [xx, yy, zz, xy, xz, yz] = law::stress(&step.law, &strain).map(|lanes| f64::from(lanes.0[0]));
    let ratio = f64::from(law::hencky_invariants(&strain).1.0[0]).exp();
    DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz)) * (1.0 / ratio)
}
