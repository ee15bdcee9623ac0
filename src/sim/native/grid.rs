//! Node sums and grid update, block by block: tiles -> momentum and mass -> velocity.
//!
//! Blocks without walls, tools or cuts take the short way in f32; the others go through
//! [`meeting`](super::meeting) in f64.

use super::super::cut::ClassKey;
use super::grid_step::{GridReport, GridStep};
use super::kernel::Tile;
use super::meeting::{self, Faces, Meeting};
use super::nodes::{ClassMasses, CutBlock, Ghosts, Nodes, for_shared_nodes};
use super::simd::Node;
use super::state::{NEIGHBOURS, State, Table};
use glam::{DVec3, IVec3};
use rayon::prelude::*;
use std::sync::Arc;

/// What one scatter left: a tile per block with particles, and one for each class of tagged particles in it.
#[derive(Debug)]
pub(super) struct Tiles {
    /// The table that was in force at the scatter.
    pub table: Arc<Table>,
    /// Sorts of the state before it.
    pub sorts: u64,
    /// Sums of the particles of each block that are of the first body and near no cut.
    pub untagged: Vec<Tile>,
    /// Which of them hold anything.
    pub has_untagged: Vec<bool>,
    /// Sums of the tagged ones, block by block, in the order of the classes' keys.
    pub tagged: Vec<(ClassKey, Tile)>,
    /// Where each block's part of `tagged` starts, and where the last one ends.
    pub first_tagged: Vec<usize>,
}

impl Tiles {
    pub(super) fn new(table: Arc<Table>) -> Self {
        Self { table, sorts: 0, untagged: vec![], has_untagged: vec![], tagged: vec![], first_tagged: vec![] }
    }

    /// The tiles of the tagged particles of a block.
    pub(super) fn tagged_of(&self, slot: usize) -> &[(ClassKey, Tile)] {
        let bound = |i: usize| self.first_tagged.get(i).copied().unwrap_or(self.tagged.len());
        &self.tagged[bound(slot)..bound(slot + 1)]
    }
}

/// The nodes of all blocks.
#[derive(Debug, Default)]
pub(super) struct Grid {
    /// Velocity [cells/substep] of untagged clay and its mass; all clay where there is no cut.
    pub nodes: Vec<Nodes>,
    /// Index + 1 into `cuts` of each block; 0 where no tagged particle is near.
    pub cut_slot: Vec<u32>,
    pub cuts: Vec<CutBlock>,
    /// What `cut_slot` and the keys of `cuts` were found for.
    found_for: FoundFor,
}

/// Where tagged clay was when the blocks that it reaches were found: sorts of the state at the scatter and
/// now, classes of each block.
#[derive(Clone, Debug, Default, PartialEq)]
struct FoundFor {
    sorts: (u64, u64),
    keys: Vec<ClassKey>,
    first_tagged: Vec<usize>,
}

impl Grid {
    /// Sums the tiles into the nodes of the state's blocks and updates them; the meeting says what walls and
    /// tools there are.
    pub(super) fn update(&mut self, state: &State, tiles: &Tiles, step: &GridStep, meeting: &Meeting<'_>) -> GridReport {
        self.find_cuts(state, tiles);
        self.nodes.resize(state.blocks.len(), [Node::default(); 64]);
        let cut_slot = &self.cut_slot;
        let plain: Vec<GridReport> = self
            .nodes
            .par_iter_mut()
            .enumerate()
            .with_min_len(8)
            .map(|(i, nodes)| {
                let block = state.blocks[i];
                sum(nodes, tiles, block, |slot| tiles.has_untagged[slot].then(|| &tiles.untagged[slot]));
                if cut_slot[i] != 0 {
                    GridReport::default()
                } else if step.imposed.is_some() || meeting.concerns(block) {
                    meeting::update(nodes, None, block, (step, meeting), (!0, &|_| None))
                } else {
                    plain(nodes, step)
                }
            })
            .collect();
        let cut = self.update_cuts(state, tiles, step, meeting);
        let mut total = GridReport { tools: vec![Default::default(); meeting.tools.len()], ..GridReport::default() };
        plain.iter().chain(&cut).for_each(|r| total.add(r));
        total
    }

    /// The nodes of a block as the clay of `key` sees them.
    pub(super) fn nodes_of(&self, slot: usize, key: ClassKey) -> &Nodes {
        let cut = self.cut_slot.get(slot).and_then(|s| s.checked_sub(1)).filter(|_| !key.is_first());
        let of_class = |s: u32| {
            let cut = &self.cuts[s as usize];
            Some(&cut.nodes[cut.keys.binary_search(&key).ok()?])
        };
        cut.and_then(of_class).unwrap_or(&self.nodes[slot])
    }

    /// Where the nodes of a block are incompatible with the clay of `key`, if some may be.
    pub(super) fn ghosts_of(&self, slot: usize, key: ClassKey) -> Option<&Ghosts> {
        let cut = &self.cuts[self.cut_slot.get(slot)?.checked_sub(1)? as usize];
        cut.ghosts.get(cut.keys.binary_search(&key).ok()?)
    }

    /// The tagged classes of a block, if there are any.
    pub(super) fn cut_at(&self, table: &Table, block: IVec3) -> Option<&CutBlock> {
        let slot = table.slot(block).and_then(|s| self.cut_slot.get(s)?.checked_sub(1))?;
        Some(&self.cuts[slot as usize])
    }

    /// The classes of a block that have clay there or near it, with their nodes.
    pub(super) fn classes_at(&self, table: &Table, block: IVec3) -> impl Iterator<Item = (ClassKey, &Nodes)> {
        let first = table.slot(block).and_then(|slot| self.nodes.get(slot)).filter(|nodes| nodes.iter().any(|n| n.0[3] > 0.0));
        let others = self.cut_at(table, block).into_iter().flat_map(|cut| cut.keys.iter().copied().zip(&cut.nodes));
        first.map(|nodes| (ClassKey::FIRST, nodes)).into_iter().chain(others)
    }

    /// Sum of node masses.
    pub(super) fn mass(&self) -> f64 {
        let mass = |nodes: &Nodes| nodes.iter().map(|n| f64::from(n.0[3])).sum::<f64>();
        self.nodes.iter().chain(self.cuts.iter().flat_map(|cut| &cut.nodes)).map(mass).sum()
    }

    /// Finds the blocks that tagged particles reach, and their classes there.
    pub(super) fn find_cuts(&mut self, state: &State, tiles: &Tiles) {
        let keys = tiles.tagged.iter().map(|t| t.0);
        let found = &self.found_for;
        if found.sorts == (tiles.sorts, state.sorts)
            && found.first_tagged == tiles.first_tagged
            && keys.clone().eq(found.keys.iter().copied())
        {
            return;
        }
        let first_tagged = tiles.first_tagged.clone();
        self.found_for = FoundFor { sorts: (tiles.sorts, state.sorts), keys: keys.collect(), first_tagged };
        self.cut_slot.clear();
        self.cut_slot.resize(state.blocks.len(), 0);
        let mut count = 0;
        let blocks: &[IVec3] = if tiles.tagged.is_empty() { &[] } else { &state.blocks };
        for (i, &block) in blocks.iter().enumerate() {
            let reaching = NEIGHBOURS.into_iter().filter_map(|o| tiles.table.slot(block + o));
            let mut keys: Vec<ClassKey> = reaching.flat_map(|slot| tiles.tagged_of(slot)).map(|t| t.0).collect();
            if keys.is_empty() {
                continue;
            }
            keys.sort_unstable();
            keys.dedup();
            if self.cuts.len() == count {
                self.cuts.push(CutBlock::default());
            }
            let cut = &mut self.cuts[count];
            cut.nodes.resize(keys.len(), [Node::default(); 64]);
            cut.keys = keys;
            count += 1;
            self.cut_slot[i] = count as u32;
        }
        self.cuts.truncate(count);
    }

    fn update_cuts(&mut self, state: &State, tiles: &Tiles, step: &GridStep, meeting: &Meeting<'_>) -> Vec<GridReport> {
        let blocks: Vec<usize> = (0..state.blocks.len()).filter(|i| self.cut_slot[*i] != 0).collect();
        let nodes = &self.nodes;
        let sum_classes = |(cut, &i): (&mut CutBlock, &usize)| -> ClassMasses {
            sum_tagged(cut, tiles, state.blocks[i]);
            meeting::folded_masses(&nodes[i], cut, state.blocks[i], step, meeting)
        };
        let masses: Vec<ClassMasses> = self.cuts.par_iter_mut().zip(&blocks).map(sum_classes).collect();
        let cut_slot = &self.cut_slot;
        let cut_of = |block: IVec3| state.table.slot(block).and_then(|s| Some(cut_slot[s].checked_sub(1)? as usize));
        let masses_of = |block: IVec3| Some(&masses[cut_of(block)?]);
        let faces: Vec<Vec<Faces>> = blocks.par_iter().map(|i| meeting::faces(state.blocks[*i], &masses_of)).collect();
        let faces_of = |block: IVec3| Some(&faces[cut_of(block)?][..]);
        let mut nodes: Vec<&mut Nodes> =
            self.nodes.iter_mut().enumerate().filter(|(i, _)| cut_slot[*i] != 0).map(|(_, n)| n).collect();
        let keeps = step.imposed.is_none() && !meeting.cutting.has_ghosts();
        let is_plain = |block: IVec3| keeps && !meeting.concerns(block);
        let update = |((nodes, cut), i): ((&mut &mut Nodes, &mut CutBlock), &usize)| {
            let block = state.blocks[*i];
            cut.ghosts.clear();
            if !is_plain(block) {
                return meeting::update(nodes, Some(cut), block, (step, meeting), (!0, &faces_of));
            }
            // Elsewhere all clay is of one field.
            let shared = faces_of(block).map_or(0, meeting::shared);
            let mut report = joint(std::iter::once(&mut **nodes).chain(&mut cut.nodes).collect(), step, !shared);
            if shared != 0 {
                report.add(&meeting::update(nodes, Some(cut), block, (step, meeting), (shared, &faces_of)));
            }
            report
        };
        nodes.par_iter_mut().zip(&mut self.cuts).zip(&blocks).map(update).collect()
    }
}

/// Momentum -> velocity where nothing but gravity acts.
fn plain(nodes: &mut Nodes, step: &GridStep) -> GridReport {
    let damping_impulse = damping_impulse(nodes, step, !0);
    GridReport { speed_max: update_plain(nodes, step), damping_impulse, ..GridReport::default() }
}

/// The same at those nodes, a bit each, at which all classes move as one.
fn joint(mut classes: Vec<&mut Nodes>, step: &GridStep, chosen: u64) -> GridReport {
    classes.retain(|nodes| nodes.iter().any(|node| node.0[3] != 0.0));
    if let ([nodes], u64::MAX) = (&mut classes[..], chosen) {
        return plain(nodes, step);
    }
    let damping_impulse = classes.iter().map(|nodes| damping_impulse(nodes, step, chosen)).sum();
    let mut all = [Node::default(); 64];
    for nodes in &classes {
        all.iter_mut().zip(nodes.iter()).for_each(|(sum, node)| (0..4).for_each(|d| sum.0[d] += node.0[d]));
    }
    (0..64).filter(|k| chosen >> k & 1 == 0).for_each(|k| all[k] = Node::default());
    let speed_max = update_plain(&mut all, step);
    for nodes in classes {
        for k in (0..64).filter(|k| chosen >> k & 1 == 1) {
            let q = &mut nodes[k].0;
            let inverse = if q[3] > 0.0 { 1.0 / q[3] } else { 0.0 };
            q[..3].copy_from_slice(&all[k].0[..3]);
            q[4..7].iter_mut().for_each(|before| *before *= inverse);
        }
    }
    GridReport { speed_max, damping_impulse, ..GridReport::default() }
}

/// Adds up, for each class of tagged clay in `block`, the tiles of the 27 blocks around it, in the order of
/// [`sum`].
fn sum_tagged(cut: &mut CutBlock, tiles: &Tiles, block: IVec3) {
    cut.nodes.iter_mut().for_each(|nodes| *nodes = [Node::default(); 64]);
    for offset in NEIGHBOURS {
        let Some(slot) = tiles.table.slot(block + offset).filter(|s| *s < tiles.untagged.len()) else { continue };
        for (key, tile) in tiles.tagged_of(slot) {
            if let Ok(class) = cut.keys.binary_search(key) {
                add_tile(&mut cut.nodes[class], offset, tile);
            }
        }
    }
}

/// Adds up, for each node of `block`, the tiles of the 27 blocks around it, in a fixed order.
#[inline]
pub(super) fn sum<'a>(nodes: &mut Nodes, tiles: &Tiles, block: IVec3, tile: impl Fn(usize) -> Option<&'a Tile>) {
    *nodes = [Node::default(); 64];
    for offset in NEIGHBOURS {
        let Some(tile) = tiles.table.slot(block + offset).filter(|s| *s < tiles.untagged.len()).and_then(&tile) else { continue };
        add_tile(nodes, offset, tile);
    }
}

/// Adds what the tile of the neighbour at `offset` holds of a block's nodes.
#[inline]
fn add_tile(nodes: &mut Nodes, offset: IVec3, tile: &Tile) {
    for_shared_nodes(offset, |node, at| {
        for d in 0..8 {
            nodes[node].0[d] += tile.0[at].0[d];
        }
    });
}

/// What validation damping takes from the sums at some nodes, a bit each.
fn damping_impulse(nodes: &Nodes, step: &GridStep, chosen: u64) -> DVec3 {
    if step.damping == 1.0 {
        return DVec3::ZERO;
    }
    let free = |q: [f64; 8]| DVec3::new(q[0], q[1], q[2]) + q[3] * step.gravity;
    (0..64).filter(|k| chosen >> k & 1 == 1).map(|k| free(nodes[k].0.map(f64::from)) * (step.damping - 1.0)).sum()
}

/// Momentum -> velocity where nothing but gravity acts. Returns the greatest speed, NaN if any is not finite.
#[inline]
fn update_plain(nodes: &mut Nodes, step: &GridStep) -> f32 {
    let gravity = step.gravity.as_vec3().to_array();
    let damping = step.damping as f32;
    let (mut greatest, mut all) = (0.0f32, 0.0f32);
    for node in nodes {
        let q = &mut node.0;
        let inverse = if q[3] > 0.0 { 1.0 / q[3] } else { 0.0 };
        let mut speed2 = 0.0;
        for d in 0..3 {
            let v = if q[3] > 0.0 { (q[d] * inverse + gravity[d]) * damping } else { q[d] * 0.0 };
            speed2 += v * v;
            q[d] = v;
            q[4 + d] *= inverse;
        }
        greatest = greatest.max(speed2);
        all += speed2 + q[3] * 0.0;
    }
    if all.is_finite() { greatest.sqrt() } else { f32::NAN }
}
