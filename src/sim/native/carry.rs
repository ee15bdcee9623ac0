//! Where the sides of a cut are carried on: once a frame, at its end (see the oracle's file of this name).

use super::super::carry::{self, SidesAbout};
use super::super::frame::FramePlan;
use super::super::params::BLOCK;
use super::super::spline::spline;
use super::grid::Grid;
use super::nodes::offset;
use super::passes::work;
use super::state::{Hot, NEIGHBOURS, State, Table, unpack_cell};
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// Nodes along an edge of what the particles of a block reach, from -2 on: a block's own and two about it,
/// and one more, as far as particles stray.
const REACHED: i32 = BLOCK + 5;

/// Gives particles the sides that they have come to need; returns how many.
pub(super) fn carry_on(state: &mut State, grid: &Grid, plan: &FramePlan) -> u64 {
    let table = state.table.clone();
    let tasks = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs);
    let carried = tasks.into_par_iter().map(|w| {
        let sheets = sheets_about(grid, &table, w.block);
        let mut carried = 0;
        for sheet in sheets.into_iter().filter(|sheet| carry::is_carried(plan, *sheet)) {
            let Some(masses) = Masses::new(grid, &table, w.block, sheet) else { continue };
            for (hot, cold) in w.hot.iter().zip(&mut *w.cold).filter(|(_, cold)| carry::is_open(&cold.tags, sheet)) {
                carried += u64::from(carry::take(&mut cold.tags, sheet, &masses.about(hot)));
            }
        }
        carried
    });
    carried.sum()
}

/// The sheets of the clay in a block and those about it, in order.
fn sheets_about(grid: &Grid, table: &Table, block: IVec3) -> Vec<u8> {
    let near = NEIGHBOURS.into_iter().filter_map(|o| grid.cut_at(table, block + o));
    let mut sheets: Vec<u8> = near.flat_map(|cut| &cut.keys).flat_map(|key| key.sides()).map(|side| side.0).collect();
    sheets.sort_unstable();
    sheets.dedup();
    sheets
}

/// Masses in front of a sheet and behind it at the nodes that the particles of a block reach, z fastest.
struct Masses {
    low: IVec3,
    sides: Vec<[f32; 2]>,
}

impl Masses {
    /// None where one side is missing.
    fn new(grid: &Grid, table: &Table, block: IVec3, sheet: u8) -> Option<Self> {
        let low = block * BLOCK - 2;
        let mut sides = vec![[0.0; 2]; (REACHED * REACHED * REACHED) as usize];
        for neighbour in NEIGHBOURS.map(|o| block + o) {
            let Some(cut) = grid.cut_at(table, neighbour) else { continue };
            for (key, nodes) in cut.keys.iter().zip(&cut.nodes).filter(|(key, _)| key.side(sheet) != 0) {
                let side = usize::from(key.side(sheet) < 0);
                for (k, node) in nodes.iter().enumerate() {
                    if let Some(at) = place(neighbour * BLOCK + offset(k) - low) {
                        sides[at][side] += node.0[3];
                    }
                }
            }
        }
        let has = |side: usize| sides.iter().any(|masses| masses[side] > 0.0);
        (has(0) && has(1)).then_some(Self { low, sides })
    }

    /// Those about a particle.
    fn about(&self, hot: &Hot) -> SidesAbout {
        let at = IVec3::from_array(unpack_cell(hot.cell)).as_dvec3() + DVec3::from_array(hot.offset.map(f64::from));
        let base = (at - 0.5).floor().as_ivec3();
        let mut sums = SidesAbout::default();
        for i in 0..27 {
            let node = base + IVec3::new(i / 9, i / 3 % 3, i % 3);
            let Some(masses) = place(node - self.low).map(|at| self.sides[at]) else { continue };
            if masses == [0.0; 2] {
                continue;
            }
            let arm = node.as_dvec3() - at;
            let weight = spline(arm.x) * spline(arm.y) * spline(arm.z);
            for (side, mass) in masses.into_iter().enumerate() {
                sums.masses[side] += weight * f64::from(mass);
                sums.moments[side] += weight * f64::from(mass) * arm;
            }
        }
        sums
    }
}

/// The place of a node among those reached, each coordinate from 0 on.
fn place(node: IVec3) -> Option<usize> {
    let is_reached = node.cmpge(IVec3::ZERO).all() && node.cmplt(IVec3::splat(REACHED)).all();
    is_reached.then(|| ((node.x * REACHED + node.y) * REACHED + node.z) as usize)
}
