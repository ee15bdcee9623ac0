//! The passes of the implicit step over all blocks: from particles to nodes and back.

use super::super::super::params::Domain;
use super::super::contact::Moment;
use super::super::grid::{Tiles, sum};
use super::super::grid_step::GridReport;
use super::super::kernel::{Place as Spot, Tile};
use super::super::nodes::{Nodes, for_arena_nodes};
use super::super::particle_step::ParticleStep;
use super::super::passes::{make_room, work};
use super::super::simd::{F8, Node};
use super::super::state::{Cold, Hot, NEIGHBOURS, Run, State, split, unpack_cell};
use super::super::walls::{Arrivals, NearWall};
use super::contact::Near;
use super::kernel::{self, Bent, Evaluation, Seat};
use super::layout::Layout;
use super::vectors::Block3;
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// The 7^3 nodes about a slot.
fn arena(layout: &Layout, slot: usize, u: &[Block3]) -> Tile {
    let mut out = Tile::ZERO;
    for (offset, neighbour) in NEIGHBOURS.iter().zip(&layout.neighbours[slot]) {
        let Some(neighbour) = neighbour.checked_sub(1) else { continue };
        let u = &u[neighbour as usize];
        for_arena_nodes(*offset, |from, to| {
            for d in 0..3 {
                out.0[to].0[d] = u.0[d][from];
            }
        });
    }
    out
}

/// What particles bring to the nodes when the step begins, in `tiles`: see [`kernel::found`]. Notes and marks
/// where clay has arrived at walls.
pub(super) fn found(s: &ParticleStep<'_>, state: &mut State, tiles: &mut Tiles, arrivals: &Arrivals) {
    make_room(state, tiles);
    let lengths: Vec<usize> = state.runs.iter().map(|run| run.tagged.len()).collect();
    let tasks: Vec<_> = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs)
        .into_iter()
        .zip(&mut tiles.untagged)
        .zip(split(&mut tiles.tagged, &lengths))
        .collect();
    tasks.into_par_iter().with_min_len(4).for_each(|((w, untagged), tagged)| {
        let tiles = std::iter::once(untagged).chain(tagged.iter_mut().map(|t| &mut t.1));
        s.at(w.block, Moment::End, |spot| {
            arrive(w.block, s.domain, spot, w.hot, w.cold, arrivals);
            for ((_, hot, _), tile) in w.run.classes(w.hot, w.cold).zip(tiles) {
                kernel::found(&s.step, spot, hot, tile);
            }
        });
    });
}

/// Notes at which walls that hold clay particles arrive by the step's middle, and marks the nodes there.
fn arrive(block: IVec3, domain: &Domain, spot: &Spot<'_>, hot: &[Hot], cold: &mut [Cold], arrivals: &Arrivals) {
    let walls: Vec<NearWall> = NearWall::of(block, domain).into_iter().filter(|wall| !wall.is_separating()).collect();
    if walls.is_empty() {
        return;
    }
    for (hot, cold) in hot.chunks(8).zip(cold.chunks_mut(8)) {
        let middles = kernel::middles(hot, spot);
        for ((hot, cold), at) in hot.iter().zip(cold).zip(middles) {
            let at = DVec3::from_array(at);
            for wall in &walls {
                let was_noted = cold.walls & wall.bit() != 0;
                if was_noted || wall.has_arrived(at, f64::from(hot.mass) / 8.0, was_noted) {
                    cold.walls |= wall.bit();
                    wall.mark(at, arrivals);
                }
            }
        }
    }
}

/// Notes at which walls that hold clay particles stand now.
fn settle(block: IVec3, domain: &Domain, hot: &[Hot], cold: &mut [Cold]) {
    let walls = NearWall::of(block, domain);
    for (hot, cold) in hot.iter().zip(cold) {
        let at = IVec3::from_array(unpack_cell(hot.cell)).as_dvec3() + DVec3::from_array(hot.offset.map(f64::from));
        let mut noted = 0;
        for wall in &walls {
            let was_noted = cold.walls & wall.bit() != 0;
            let is_noted =
                if wall.is_separating() { was_noted } else { wall.has_arrived(at, f64::from(hot.mass) / 8.0, was_noted) };
            noted |= if is_noted { wall.bit() } else { 0 };
        }
        cold.walls = noted;
    }
}

/// Yield norms for the step, by the particles' places in its middle and the tools at its end.
pub(super) fn seats(s: &ParticleStep<'_>, state: &mut State, seats: &mut Vec<Seat>) {
    seats.clear();
    seats.resize(state.hot.len(), Seat { yield_norm: s.step.yield_norm, share: 0.0 });
    if s.step.yield_norm.is_infinite() || (!s.step.has_history() && !state.blocks.iter().any(|block| s.softens(*block))) {
        return;
    }
    let lengths: Vec<usize> = state.runs.iter().map(Run::len).collect();
    let tasks: Vec<_> =
        work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs).into_iter().zip(split(seats, &lengths)).collect();
    tasks.into_par_iter().with_min_len(4).for_each(|(w, seats)| {
        s.at(w.block, Moment::End, |spot| {
            for ((hot, cold), seats) in w.hot.chunks(8).zip(w.cold.chunks(8)).zip(seats.chunks_mut(8)) {
                let middles = kernel::middles(hot, spot);
                for (k, seat) in seats.iter_mut().enumerate() {
                    let softened = spot.softening.map_or(s.step.yield_norm, |softening| softening(middles[k]));
                    seat.yield_norm = s.step.yield_norm_of(softened, hot[k].hardening, cold[k].structure);
                }
            }
        });
    });
}

/// The buffers of a pass.
pub(super) struct Pass<'a, 'b> {
    pub(super) s: &'a ParticleStep<'b>,
    /// Plastic strain within which volumes are shared [-]; 0 for none.
    pub(super) averaging: f32,
    pub(super) layout: &'a Layout,
    /// The slot of each tagged class of each block with particles, block by block.
    pub(super) tagged_slots: &'a [Vec<u32>],
}

impl Pass<'_, '_> {
    /// Scatters the slope's particle part at `u` to `tiles`. Whether no cell was turned inside out comes
    /// back.
    pub(super) fn slope(&self, state: &mut State, seats: &mut [Seat], u: &[Block3], is_first: bool, tiles: &mut Tiles) -> bool {
        let s = self.s;
        let evaluation = Evaluation { step: s.step, averaging: self.averaging, is_first };
        let classes: Vec<usize> = state.runs.iter().map(|run| run.tagged.len()).collect();
        let lengths: Vec<usize> = state.runs.iter().map(Run::len).collect();
        let tasks: Vec<_> = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs)
            .into_iter()
            .zip(split(seats, &lengths))
            .zip(&mut tiles.untagged)
            .zip(split(&mut tiles.tagged, &classes))
            .enumerate()
            .collect();
        let sound: Vec<bool> = tasks
            .into_par_iter()
            .with_min_len(4)
            .map_init(Vec::new, |bent: &mut Vec<Bent>, (index, (((w, mut seats), untagged), tagged))| {
                let near = Near::of(w.block, s.tools, s.domain, s.springs);
                let slots = std::iter::once(index).chain(self.tagged_slots[index].iter().map(|slot| *slot as usize));
                let tiles = std::iter::once(untagged).chain(tagged.iter_mut().map(|t| &mut t.1));
                s.at(w.block, Moment::End, |spot| {
                    let mut is_sound = true;
                    for (((_, hot, cold), tile), slot) in w.run.classes(w.hot, w.cold).zip(tiles).zip(slots) {
                        let (own, rest) = std::mem::take(&mut seats).split_at_mut(hot.len());
                        seats = rest;
                        if hot.is_empty() {
                            *tile = Tile::ZERO;
                            continue;
                        }
                        let u = arena(self.layout, slot, u);
                        let clay = (&*hot, &*cold, own);
                        is_sound &= slope(&evaluation, spot, clay, near.as_ref(), &u, bent, tile);
                    }
                    is_sound
                })
            })
            .collect();
        sound.iter().all(|sound| *sound)
    }

    /// Ends the step at `u`. Returns particles clamped and what tools and separating walls felt.
    pub(super) fn end(&self, state: &mut State, seats: &mut [Seat], u: &[Block3]) -> (u64, GridReport) {
        let s = self.s;
        let evaluation = Evaluation { step: s.step, averaging: self.averaging, is_first: false };
        let lengths: Vec<usize> = state.runs.iter().map(Run::len).collect();
        let tasks: Vec<_> = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs)
            .into_iter()
            .zip(split(seats, &lengths))
            .enumerate()
            .collect();
        let done: Vec<(u32, GridReport)> = tasks
            .into_par_iter()
            .with_min_len(4)
            .map_init(Vec::new, |bent: &mut Vec<Bent>, (index, (w, mut seats))| {
                let near = Near::of(w.block, s.tools, s.domain, s.springs);
                let mut report = GridReport::of_tools(s.tools.len());
                let slots = std::iter::once(index).chain(self.tagged_slots[index].iter().map(|slot| *slot as usize));
                let clamped = s.at(w.block, Moment::End, |spot| {
                    let mut clamped = 0;
                    for ((_, hot, cold), slot) in w.run.classes(&mut *w.hot, &mut *w.cold).zip(slots) {
                        let (own, rest) = std::mem::take(&mut seats).split_at_mut(hot.len());
                        seats = rest;
                        let u = arena(self.layout, slot, u);
                        let felt = near.as_ref().map(|near| (near, &mut report));
                        clamped += end(&evaluation, spot, (hot, cold, own), felt, &u, bent);
                    }
                    clamped
                });
                settle(w.block, s.domain, w.hot, w.cold);
                (clamped, report)
            })
            .collect();
        let mut felt = GridReport::of_tools(s.tools.len());
        done.iter().for_each(|(_, report)| felt.add(report));
        (done.iter().map(|(clamped, _)| u64::from(*clamped)).sum(), felt)
    }
}

/// Adds up the tiles about a slot.
pub(super) fn nodes_of(layout: &Layout, tiles: &Tiles, slot: usize) -> Nodes {
    let mut nodes: Nodes = [Node::default(); 64];
    let place = layout.slots[slot];
    sum(&mut nodes, tiles, place.block, |at| {
        if place.key.is_untagged() {
            return Some(&tiles.untagged[at]);
        }
        let tiles = tiles.tagged_of(at);
        tiles.binary_search_by_key(&place.key, |t| t.0).ok().map(|i| &tiles[i].1)
    });
    nodes
}

/// Instantiates a kernel for AVX2 + FMA beside the plain one, and the function that chooses between them.
macro_rules! dispatch {
    ($name:ident = $kernel:ident / $fast:ident, ($($arg:ident: $type:ty),*) -> $ret:ty) => {
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,fma")]
        fn $fast(evaluation: &Evaluation, $($arg: $type),*) -> $ret {
            kernel::$kernel::<super::super::simd::Wide>(evaluation, $($arg),*)
        }

        #[inline]
        fn $name(evaluation: &Evaluation, $($arg: $type),*) -> $ret {
            #[cfg(target_arch = "x86_64")]
            if evaluation.step.fma {
                // SAFETY: `fma` is set only after AVX2 and FMA were detected.
                return unsafe { $fast(evaluation, $($arg),*) };
            }
            kernel::$kernel::<F8>(evaluation, $($arg),*)
        }
    };
}
dispatch!(slope = slope_with / slope_avx2, (spot: &Spot<'_>, clay: (&[Hot], &[Cold], &mut [Seat]), near: Option<&Near<'_>>, u: &Tile, bent: &mut Vec<Bent>, out: &mut Tile) -> bool);
dispatch!(end = end_with / end_avx2, (spot: &Spot<'_>, clay: (&mut [Hot], &mut [Cold], &[Seat]), near: Option<(&Near<'_>, &mut GridReport)>, u: &Tile, bent: &mut Vec<Bent>) -> u32);
