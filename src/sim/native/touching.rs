//! The clay at each node that touches a separating tool: what tells contact from a gap.

use super::super::params::BLOCK;
use super::super::tool::{particle_touch, spline};
use super::contact::ToolNow;
use super::kernel::Tile;
use super::nodes::for_shared_nodes;
use super::state::{Hot, NEIGHBOURS, Run, State, Table, unpack_cell};
use glam::{DVec3, IVec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Sums of `w m touch` over the particles of one block, at the nodes of its [`Tile`].
type TouchTile = [f32; Tile::LEN];

/// Touching clay near the separating tools.
#[derive(Debug, Default)]
pub(super) struct Touching {
    /// Where the blocks are; none if no tool separates.
    table: Option<Arc<Table>>,
    /// Index + 1 into `tiles` of each block with particles; 0 away from tools.
    slots: Vec<u32>,
    tiles: Vec<TouchTile>,
}

impl Touching {
    /// What of the particles as they are in `state` touches, with the tools at the substep's end.
    pub(super) fn new(state: &State, tools: &[ToolNow]) -> Self {
        let separating: Vec<&ToolNow> = tools.iter().filter(|t| t.separates()).collect();
        if separating.is_empty() {
            return Self::default();
        }
        let mut near = vec![];
        let mut start = 0;
        let mut slot = |(run, block): (&Run, &IVec3)| {
            let particles = &state.hot[start..start + run.len()];
            start += run.len();
            if !separating.iter().any(|t| t.is_near_block(*block)) {
                return 0;
            }
            near.push((*block, particles));
            near.len() as u32
        };
        let slots = state.runs.iter().zip(&state.blocks).map(&mut slot).collect();
        let tiles = near.into_par_iter().map(|(block, particles)| tile(block, particles, &separating)).collect();
        Self { table: Some(state.table.clone()), slots, tiles }
    }

    /// The sums at the 64 nodes of a block.
    pub(super) fn of_block(&self, block: IVec3) -> [f32; 64] {
        let mut nodes = [0.0; 64];
        let Some(table) = &self.table else { return nodes };
        for offset in NEIGHBOURS {
            let slot = table.slot(block + offset).and_then(|s| self.slots.get(s)?.checked_sub(1));
            let Some(slot) = slot else { continue };
            for_shared_nodes(offset, |node, at| nodes[node] += self.tiles[slot as usize][at]);
        }
        nodes
    }
}

/// The sums of one block's particles.
#[expect(clippy::cast_possible_truncation, reason = "tiles are f32")]
fn tile(block: IVec3, particles: &[Hot], tools: &[&ToolNow]) -> TouchTile {
    let mut out = [0.0; Tile::LEN];
    for p in particles {
        let cell = IVec3::from_array(unpack_cell(p.cell));
        let x = cell.as_dvec3() + DVec3::from_array(p.offset.map(f64::from));
        let distance = |t: &&ToolNow| t.shape.distance(t.motion.end.to_local(x));
        let distance = tools.iter().map(distance).fold(f64::INFINITY, f64::min);
        // A particle's mass is its rest volume over an eighth of a cell.
        let radius = 0.5 * (f64::from(p.mass) / 8.0).cbrt();
        let touch = particle_touch(distance, radius);
        if touch == 0.0 {
            continue;
        }
        let touching = p.mass * touch as f32;
        let base = (x - 0.5).floor();
        let first = base.as_ivec3() - block * BLOCK;
        let weights = [0.0, 1.0, 2.0].map(|node| (x - base - node).to_array().map(|d| spline(d) as f32));
        for (i, wx) in (0..).zip(weights) {
            for (j, wy) in (0..).zip(weights) {
                let row = Tile::at(first.x + i, first.y + j, first.z);
                for (to, wz) in out[row..row + 3].iter_mut().zip(weights) {
                    *to += touching * wx[0] * wy[1] * wz[2];
                }
            }
        }
    }
    out
}
