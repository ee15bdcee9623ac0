//! The clay at each node that touches a separating tool: what tells contact from a gap.

use super::super::tool::particle_touch;
use super::contact::ToolNow;
use super::grid::local;
use super::kernel::TILE;
use super::state::{Hot, NEIGHBOURS, State, Table, unpack_cell};
use glam::{DVec3, IVec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Sums of `w m touch` over the particles of one block at the nodes -1 .. 5 about it.
type TouchTile = [f32; TILE * TILE * TILE];

/// Index of the node at `(x, y, z)` relative to the block's low corner, each in -1 ..= 5.
fn at(x: i32, y: i32, z: i32) -> usize {
    ((x + 1) as usize * TILE + (y + 1) as usize) * TILE + (z + 1) as usize
}

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
        let mut slot = |(run, block): (&super::state::Run, &IVec3)| {
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
            // As the tiles of mass and touchingum are summed.
            let range = |o: i32| match o {
                -1 => (0, 2, 4),
                0 => (0, 4, 0),
                _ => (3, 4, -4),
            };
            let (x, y, z) = (range(offset.x), range(offset.y), range(offset.z));
            for i in x.0..x.1 {
                for j in y.0..y.1 {
                    for k in z.0..z.1 {
                        nodes[local(i, j, k)] += self.tiles[slot as usize][at(i + x.2, j + y.2, k + z.2)];
                    }
                }
            }
        }
        nodes
    }
}

/// The sums of one block's particles.
#[expect(clippy::cast_possible_truncation, reason = "tiles are f32")]
fn tile(block: IVec3, particles: &[Hot], tools: &[&ToolNow]) -> TouchTile {
    let mut out = [0.0; TILE * TILE * TILE];
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
        let mut weights = [[0.0f32; 3]; 3];
        let mut first = cell - block * 4;
        for d in 0..3 {
            let low = p.offset[d] < 0.5;
            let f = p.offset[d] + if low { 1.0 } else { 0.0 };
            first[d] -= i32::from(low);
            weights[d] = [0.5 * (1.5 - f) * (1.5 - f), 0.75 - (f - 1.0) * (f - 1.0), 0.5 * (f - 0.5) * (f - 0.5)];
        }
        for (i, wx) in (0..).zip(weights[0]) {
            for (j, wy) in (0..).zip(weights[1]) {
                let row = at(first.x + i, first.y + j, first.z);
                for (to, wz) in out[row..row + 3].iter_mut().zip(weights[2]) {
                    *to += touching * wx * wy * wz;
                }
            }
        }
    }
    out
}
