//! The particle passes over all blocks: who gathers from which field and scatters to which tile.

use super::super::cut::CutKey;
use super::super::cutting::CuttingMethod;
use super::super::material::{ClayMaterial, SOFTENING_REACH};
use super::super::params::{BLOCK, Domain};
use super::contact::{Moment, ToolNow};
use super::ghost;
use super::grid::{Grid, GridReport, Tiles, local};
use super::kernel::{self, Place, Tile};
use super::state::{Cold, Hot, NEIGHBOURS, Run, State, Table, split, unpack_cell};
use super::step::Step;
use super::tags::{self, TagReport};
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// One block's particles, for one task.
pub(super) struct Work<'a> {
    index: usize,
    pub block: IVec3,
    pub hot: &'a mut [Hot],
    pub cold: &'a mut [Cold],
    pub run: &'a mut Run,
}

/// What the particle passes need of a substep.
pub(super) struct ParticleStep<'a> {
    pub step: Step,
    pub domain: &'a Domain,
    pub material: &'a ClayMaterial,
    /// How tools act on the clay.
    pub cutting: CuttingMethod,
    /// Gravity over inertia scaling [cells/substep^2].
    pub gravity: DVec3,
    /// Tools at the substep that the gather ends.
    pub tools: &'a [ToolNow],
}

impl ParticleStep<'_> {
    /// Distance [m] from a grid coordinate to the nearest tool.
    fn tool_distance(&self, x: [f64; 3], at: Moment) -> f64 {
        let x = DVec3::from_array(x);
        let distance = |t: &ToolNow| t.shape.distance(t.pose(at).to_local(x)).abs();
        self.tools.iter().map(distance).fold(f64::INFINITY, f64::min) * self.domain.cell_width
    }

    /// The yield norm of fresh clay at a grid coordinate: Eq. 5 with the nearest tool.
    #[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
    fn softened(&self, x: [f64; 3], at: Moment) -> f32 {
        let dx = self.domain.cell_width;
        let ratio = self.material.yield_stress_at(self.tool_distance(x, at), dx) / self.material.yield_stress;
        (f64::from(self.step.yield_norm) * ratio) as f32
    }

    /// Whether a tool softens clay in the block: beyond 12 softening lengths zeta is below 1e-5.
    pub(super) fn softens(&self, block: IVec3) -> bool {
        let centre = (block * BLOCK).as_dvec3() + f64::from(BLOCK) / 2.0;
        let length = self.material.softening_length_or_default(self.domain.cell_width) / self.domain.cell_width;
        // Half the diagonal of a block with a particle's margin about it is less than 5 cells.
        let reach = 12.0 * length + SOFTENING_REACH + 5.0;
        self.material.softening > 0.0
            && self.step.yield_norm.is_finite()
            && self.tools.iter().any(|t| t.shape.distance(t.motion.end.to_local(centre)) < reach)
    }

    /// The yield norm of a particle now.
    pub(super) fn yield_norm(&self, hot: &Hot, cold: &Cold, is_softened: bool, at: Moment) -> f32 {
        let cell = unpack_cell(hot.cell);
        let x = std::array::from_fn(|d| f64::from(cell[d]) + f64::from(hot.offset[d]));
        let fresh = if is_softened { self.softened(x, at) } else { self.step.yield_norm };
        self.step.yield_norm_of(fresh, hot.hardening, cold.structure)
    }

    fn room(&self, block: IVec3) -> Option<([f32; 3], [f32; 3])> {
        let (low, high) = self.domain.wall_nodes();
        let is_at_wall = (low / BLOCK).cmpeq(block).any() || (high / BLOCK).cmpeq(block).any();
        let relative = |w: IVec3| (w - block * BLOCK).as_vec3().to_array();
        is_at_wall.then(|| (relative(low), relative(high)))
    }

    /// Calls `kernel` with the block's place; the tools stand as they do at `at`.
    #[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
    fn at<R>(&self, block: IVec3, at: Moment, kernel: impl FnOnce(&Place<'_>) -> R) -> R {
        let softened = |x| self.softened(x, at);
        let factor = |x| self.material.stress_factor_at(self.tool_distance(x, at), self.domain.cell_width) as f32;
        kernel(&Place {
            origin: (block * BLOCK).to_array(),
            room: self.room(block),
            softening: if self.softens(block) { Some(&softened) } else { None },
            stress_factor: if self.material.law.is_as_published() { Some(&factor) } else { None },
        })
    }
}

/// Divides the state into one task a block.
pub(super) fn work<'a>(blocks: &[IVec3], hot: &'a mut [Hot], cold: &'a mut [Cold], runs: &'a mut [Run]) -> Vec<Work<'a>> {
    let lengths: Vec<usize> = runs.iter().map(Run::len).collect();
    let parts = split(hot, &lengths).into_iter().zip(split(cold, &lengths)).zip(runs);
    parts.enumerate().map(|(index, ((hot, cold), run))| Work { index, block: blocks[index], hot, cold, run }).collect()
}

/// The 7^3 velocities about a block as a class sees them.
fn arena(grid: &Grid, table: &Table, block: IVec3, key: CutKey) -> Tile {
    let mut out = Tile::ZERO;
    for offset in NEIGHBOURS {
        let Some(slot) = table.slot(block + offset) else { continue };
        let nodes = grid.nodes_of(slot, key);
        let range = |o: i32| match o {
            -1 => (3, 4, -4),
            0 => (0, 4, 0),
            _ => (0, 2, 4),
        };
        let (x, y, z) = (range(offset.x), range(offset.y), range(offset.z));
        for i in x.0..x.1 {
            for j in y.0..y.1 {
                for k in z.0..z.1 {
                    out.0[Tile::at(i + x.2, j + y.2, k + z.2)] = nodes[local(i, j, k)];
                }
            }
        }
    }
    out
}

/// Calls `each` with a slot, a node of it and the node's index in the arena for the 7^3 nodes about a block.
pub(super) fn for_arena(table: &Table, block: IVec3, mut each: impl FnMut(usize, usize, usize)) {
    for i in 0..343 {
        let n = IVec3::new(i / 49, i / 7 % 7, i % 7) - 1;
        let offset = n.div_euclid(IVec3::splat(BLOCK));
        let (Some(slot), at) = (table.slot(block + offset), n - offset * BLOCK) else { continue };
        each(slot, local(at.x, at.y, at.z), Tile::at(n.x, n.y, n.z));
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
        .map(|w| {
            let mut clamped = 0;
            let mut ghosts = s.cutting.has_ghosts().then(|| GridReport::of_tools(s.tools.len()));
            for (key, hot, cold) in w.run.classes(&mut *w.hot, &mut *w.cold) {
                if let Some(report) = ghosts.as_mut().filter(|_| !key.is_untagged()) {
                    let gathered = ghost::gather(s, (grid, &table), (w.block, key), (hot, cold), report);
                    clamped += s.at(w.block, Moment::End, |place| kernel::finish_gathered(&s.step, place, hot, cold, &gathered));
                } else if !hot.is_empty() {
                    let velocity = arena(grid, &table, w.block, key);
                    clamped += s.at(w.block, Moment::End, |place| kernel::g2p(&s.step, place, hot, cold, &velocity));
                }
            }
            (clamped, tag.map(|tools| tag_block(tools, s, w.hot, w.cold, w.run)), ghosts)
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

fn tag_block(tools: &[ToolNow], s: &ParticleStep<'_>, hot: &mut [Hot], cold: &mut [Cold], run: &mut Run) -> TagReport {
    let report = match s.cutting {
        CuttingMethod::TwoFields => tags::tag(tools, s.domain, f64::from(s.step.velocity_unit), hot, cold),
        method @ (CuttingMethod::Published | CuttingMethod::RigidParticles | CuttingMethod::InteractiveParticles) => {
            ghost::tag(method, tools, hot, cold)
        }
    };
    if report.is_changed {
        *run = tags::regroup(hot, cold);
    }
    report
}

/// Tags the blocks for which `is_chosen` for the substep of `s`.
pub(super) fn tag(s: &ParticleStep<'_>, state: &mut State, is_chosen: &(dyn Fn(usize) -> bool + Sync)) -> Vec<TagReport> {
    let mut tasks = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs);
    tasks.retain(|w| is_chosen(w.index));
    tasks.into_par_iter().map(|w| tag_block(s.tools, s, w.hot, w.cold, w.run)).collect()
}

/// Scatters every block: those for which `is_gathered` from their stored velocities, which are of the instant
/// `stored_at`, the others fused with their gather. Returns particles clamped.
pub(super) fn scatter(
    s: &ParticleStep<'_>,
    state: &mut State,
    grid: &Grid,
    tiles: &mut Tiles,
    stored_at: Moment,
    is_gathered: &(dyn Fn(usize) -> bool + Sync),
) -> u64 {
    make_room(state, tiles);
    let table = state.table.clone();
    let lengths: Vec<usize> = state.runs.iter().map(|run| run.tagged.len()).collect();
    let tasks: Vec<_> = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs)
        .into_iter()
        .zip(&mut tiles.untagged)
        .zip(split(&mut tiles.tagged, &lengths))
        .collect();
    let clamped: Vec<u32> = tasks
        .into_par_iter()
        .with_min_len(4)
        .map(|((w, untagged), tagged)| {
            let mut clamped = 0;
            let is_gathered = is_gathered(w.index);
            let tiles = std::iter::once(untagged).chain(tagged.iter_mut().map(|t| &mut t.1));
            for ((key, hot, cold), tile) in w.run.classes(w.hot, w.cold).zip(tiles) {
                if hot.is_empty() {
                    *tile = Tile::ZERO;
                } else if is_gathered {
                    s.at(w.block, stored_at, |place| kernel::p2g(&s.step, place, hot, cold, tile));
                } else {
                    let velocity = arena(grid, &table, w.block, key);
                    clamped += s.at(w.block, Moment::End, |place| kernel::g2p2g(&s.step, place, hot, cold, &velocity, tile));
                }
            }
            clamped
        })
        .collect();
    clamped.into_iter().map(u64::from).sum()
}

/// Sizes the tiles for the state's blocks: one each, and one for each class of tagged particles.
fn make_room(state: &mut State, tiles: &mut Tiles) {
    let old = std::mem::replace(&mut tiles.table, state.table.clone());
    state.recycle(old);
    tiles.sorts = state.sorts;
    tiles.untagged.resize(state.runs.len(), Tile::ZERO);
    tiles.tagged.resize(state.runs.iter().map(|run| run.tagged.len()).sum(), (CutKey::UNTAGGED, Tile::ZERO));
    tiles.first_tagged.clear();
    tiles.first_tagged.push(0);
    for run in &state.runs {
        let first = *tiles.first_tagged.last().unwrap_or(&0);
        for (tile, class) in tiles.tagged[first..].iter_mut().zip(&run.tagged) {
            tile.0 = class.0;
        }
        tiles.first_tagged.push(first + run.tagged.len());
    }
}
