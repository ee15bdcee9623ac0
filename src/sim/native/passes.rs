//! The particle passes over all blocks: who gathers from which field and scatters to which tile.

use super::super::cut::ClassKey;
use super::super::cutting::CuttingMethod;
use super::contact::{Moment, ToolNow};
use super::ghost;
use super::grid::{Grid, Tiles};
use super::grid_step::GridReport;
use super::kernel::{self, Tile};
use super::nodes::{copy_rows, for_arena_nodes};
use super::particle_step::ParticleStep;
use super::penalty::Presses;
use super::state::{Cold, Hot, NEIGHBOURS, Run, State, Table, split};
use super::tagged::TaggedTile;
use super::tags::{self, TagReport};
use glam::IVec3;
use rayon::prelude::*;

/// One block's particles, for one task.
pub(super) struct Work<'a> {
    index: usize,
    pub block: IVec3,
    pub hot: &'a mut [Hot],
    pub cold: &'a mut [Cold],
    pub run: &'a mut Run,
}

/// Divides the state into one task a block.
pub(super) fn work<'a>(blocks: &[IVec3], hot: &'a mut [Hot], cold: &'a mut [Cold], runs: &'a mut [Run]) -> Vec<Work<'a>> {
    let lengths: Vec<usize> = runs.iter().map(Run::len).collect();
    let parts = split(hot, &lengths).into_iter().zip(split(cold, &lengths)).zip(runs);
    parts.enumerate().map(|(index, ((hot, cold), run))| Work { index, block: blocks[index], hot, cold, run }).collect()
}

/// Fills `out` with the 7^3 velocities about a block as a class sees them.
fn fill_arena(out: &mut Tile, grid: &Grid, table: &Table, (slot, block): (usize, IVec3), key: ClassKey) {
    if !key.is_first()
        && let Some(about) = grid.tagged_about(slot, key)
    {
        *out = Tile::ZERO;
        about.for_each(|(n, has, nodes)| copy_rows(out, nodes, has, NEIGHBOURS[n]));
        return;
    }
    let slots = NEIGHBOURS.map(|offset| table.slot(block + offset));
    // All nodes are written where no block about is missing.
    if slots.contains(&None) {
        *out = Tile::ZERO;
    }
    for (offset, slot) in NEIGHBOURS.into_iter().zip(slots) {
        let Some(slot) = slot else { continue };
        let nodes = grid.nodes_of(slot, key);
        for_arena_nodes(offset, |from, to| out.0[to] = nodes[from]);
    }
}

/// What a gather did.
#[derive(Default)]
pub(super) struct Gathered {
    /// Particles clamped.
    pub clamped: u64,
    /// What tagging did in each block.
    pub tags: Vec<TagReport>,
    /// What ghosts took from the tools; empty where there are none.
    pub ghosts: Option<GridReport>,
}

/// Gathers blocks for which `is_chosen`, storing velocities; then tags them if `tag` is given.
pub(super) fn gather(
    s: &ParticleStep<'_>,
    state: &mut State,
    grid: &Grid,
    is_chosen: &(dyn Fn(usize) -> bool + Sync),
    tag: Option<&[ToolNow]>,
) -> Gathered {
    let table = state.table.clone();
    let mut tasks = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs);
    tasks.retain(|w| is_chosen(w.index));
    let done: Vec<(u32, Option<TagReport>, Option<GridReport>)> = tasks
        .into_par_iter()
        .map_init(Tile::zero, |velocity, w| {
            let mut clamped = 0;
            let mut ghosts = s.cutting.has_ghosts().then(|| GridReport::of_tools(s.tools.len()));
            for (key, hot, cold) in w.run.classes(&mut *w.hot, &mut *w.cold) {
                if let Some(report) = ghosts.as_mut().filter(|_| !key.is_first()) {
                    let gathered = ghost::gather(s, (grid, &table), (w.block, key), hot, report);
                    clamped += s.at(w.block, Moment::End, |place| kernel::finish_gathered(&s.step, place, hot, cold, &gathered));
                } else if !hot.is_empty() {
                    fill_arena(velocity, grid, &table, (w.index, w.block), key);
                    clamped += s.at(w.block, Moment::End, |place| kernel::g2p(&s.step, place, hot, cold, velocity));
                }
            }
            (clamped, tag.map(|tools| tag_block((tools, false), s, w.hot, w.cold, w.run)), ghosts)
        })
        .collect();
    let mut gathered = Gathered::default();
    for (clamped, tags, ghosts) in done {
        gathered.clamped += u64::from(clamped);
        gathered.tags.extend(tags);
        if let Some(ghosts) = ghosts {
            gathered.ghosts.get_or_insert_with(|| GridReport::of_tools(s.tools.len())).add(&ghosts);
        }
    }
    gathered
}

fn tag_block(
    (tools, clings): (&[ToolNow], bool),
    s: &ParticleStep<'_>,
    hot: &mut [Hot],
    cold: &mut [Cold],
    run: &mut Run,
) -> TagReport {
    let report = match s.cutting {
        CuttingMethod::TwoFields => tags::tag(tools, s.domain, hot, cold, clings),
        method @ (CuttingMethod::Published | CuttingMethod::RigidParticles | CuttingMethod::InteractiveParticles) => {
            ghost::tag(method, tools, hot, cold)
        }
    };
    if report.is_changed {
        *run = tags::regroup(hot, cold);
    }
    report
}

/// Tags the blocks for which `is_chosen` for the substep of `s`; `clings` in an implicit step.
pub(super) fn tag(
    s: &ParticleStep<'_>,
    state: &mut State,
    clings: bool,
    is_chosen: &(dyn Fn(usize) -> bool + Sync),
) -> Vec<TagReport> {
    let mut tasks = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs);
    tasks.retain(|w| is_chosen(w.index));
    tasks.into_par_iter().map(|w| tag_block((s.tools, clings), s, w.hot, w.cold, w.run)).collect()
}

/// Scatters every block: those for which `is_gathered` from their stored velocities, which are of the instant
/// `stored_at`, the others fused with their gather. The tools and walls of the substep that begins press on
/// the particles; at a frame's start those away from all tools and walls touch nothing any more. Returns
/// particles clamped and what tools and walls felt.
pub(super) fn scatter(
    s: &ParticleStep<'_>,
    state: &mut State,
    grid: &Grid,
    tiles: &mut Tiles,
    presses: &Presses<'_>,
    stored_at: Moment,
    is_gathered: &(dyn Fn(usize) -> bool + Sync),
) -> (u64, GridReport) {
    make_room(state, tiles);
    let table = state.table.clone();
    let lengths: Vec<usize> = state.runs.iter().map(|run| run.tagged.len()).collect();
    let tasks: Vec<_> = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs)
        .into_iter()
        .zip(&mut tiles.untagged)
        .zip(split(&mut tiles.tagged, &lengths))
        .collect();
    let scratch_tiles = || [Tile::zero(), Tile::zero()];
    let done: Vec<(u32, Option<GridReport>)> = tasks
        .into_par_iter()
        .with_min_len(4)
        .map_init(scratch_tiles, |[velocity, scratch], ((w, untagged), tagged)| {
            let mut clamped = 0;
            let mut press = presses.near(w.block);
            if press.is_none() && matches!(stored_at, Moment::Start) {
                w.cold.iter_mut().for_each(|p| (p.anchors, p.walls) = Default::default());
            }
            let is_gathered = is_gathered(w.index);
            let mut tagged = tagged.iter_mut();
            for (key, hot, cold) in w.run.classes(w.hot, w.cold) {
                if hot.is_empty() {
                    continue;
                }
                let tile = if key.is_first() { &mut *untagged } else { &mut **scratch };
                if is_gathered {
                    s.at(w.block, stored_at, |place| kernel::p2g(&s.step, place, hot, cold, press.as_mut(), tile));
                } else {
                    fill_arena(velocity, grid, &table, (w.index, w.block), key);
                    clamped += s.at(w.block, Moment::End, |place| {
                        kernel::g2p2g(&s.step, place, hot, cold, velocity, press.as_mut(), tile)
                    });
                }
                if !key.is_first()
                    && let Some(kept) = tagged.next()
                {
                    kept.fill(scratch);
                }
            }
            (clamped, press.map(|press| press.report))
        })
        .collect();
    let mut felt = GridReport::of_tools(presses.tools.len());
    done.iter().filter_map(|(_, report)| report.as_ref()).for_each(|report| felt.add(report));
    (done.iter().map(|(clamped, _)| u64::from(*clamped)).sum(), felt)
}

/// Sizes the tiles for the state's blocks: one each, and one for each class of tagged particles.
pub(super) fn make_room(state: &mut State, tiles: &mut Tiles) {
    let old = std::mem::replace(&mut tiles.table, state.table.clone());
    state.recycle(old);
    tiles.sorts = state.sorts;
    tiles.untagged.resize(state.runs.len(), Tile::ZERO);
    tiles.has_untagged.clear();
    tiles.has_untagged.extend(state.runs.iter().map(|run| run.untagged > 0));
    tiles.tagged.resize(state.runs.iter().map(|run| run.tagged.len()).sum(), TaggedTile::EMPTY);
    tiles.first_tagged.clear();
    tiles.first_tagged.push(0);
    for run in &state.runs {
        let first = *tiles.first_tagged.last().unwrap_or(&0);
        for (tile, class) in tiles.tagged[first..].iter_mut().zip(&run.tagged) {
            tile.key = class.0;
        }
        tiles.first_tagged.push(first + run.tagged.len());
    }
}
