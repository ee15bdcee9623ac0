//! Node sums and grid update, block by block: tiles -> momentum and mass -> velocity.
//!
//! Blocks without walls, tools or cuts take the short way in f32; the others go through
//! [`meeting`](super::meeting) in f64.

use super::super::cut::ClassKey;
use super::super::facing::Between;
use super::grid_step::{GridReport, GridStep};
use super::joint::{joint, plain};
use super::kernel::Tile;
use super::meeting::{self, Faces, Meeting, Parting, Scratch};
use super::nodes::{ClassMasses, CutBlock, Ghosts, Nodes, Present, Source, bits, for_shared_nodes, node_masses};
use super::simd::Node;
use super::state::{ITSELF, NEIGHBOURS, State, Table};
use super::tagged::{self, TaggedTile};
use glam::IVec3;
use rayon::prelude::*;
use std::ops::Range;
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
    /// Which of them hold anything; the others are what they were before.
    pub has_untagged: Vec<bool>,
    /// Sums of the tagged ones, block by block, in the order of the classes' keys.
    pub tagged: Vec<TaggedTile>,
    /// Where each block's part of `tagged` starts, and where the last one ends.
    pub first_tagged: Vec<usize>,
}

impl Tiles {
    pub(super) fn new(table: Arc<Table>) -> Self {
        Self { table, sorts: 0, untagged: vec![], has_untagged: vec![], tagged: vec![], first_tagged: vec![] }
    }

    /// The tiles of the tagged particles of a block.
    pub(super) fn tagged_of(&self, slot: usize) -> &[TaggedTile] {
        &self.tagged[self.tagged_range(slot)]
    }

    /// Where these stand in all.
    fn tagged_range(&self, slot: usize) -> Range<usize> {
        let bound = |i: usize| self.first_tagged.get(i).copied().unwrap_or(self.tagged.len());
        bound(slot)..bound(slot + 1)
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
    /// Of each class of each of `cuts`, index + 1 among the classes of each neighbour; 0 where it is not.
    classes_about: Vec<Vec<[u32; 27]>>,
    /// What the clay of each of `cuts` weighs at its nodes, and how it was found to face each other there.
    masses: Vec<ClassMasses>,
    faces: Vec<Vec<Faces>>,
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
    /// The tagged classes about block `index`.
    pub(super) fn keys(&self, index: usize) -> &[ClassKey] {
        self.cut_slot[index].checked_sub(1).map_or(&[], |cut| &self.cuts[cut as usize].keys)
    }

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
                if cut_slot[i] != 0 {
                    return GridReport::default();
                }
                sum_untagged(nodes, tiles, block);
                if bits(&node_masses(nodes)) == 0 {
                    // Beside the clay, and most of the blocks at walls.
                    GridReport::default()
                } else if step.imposed.is_some() || meeting.concerns(block) {
                    meeting::update(nodes, None, block, (step, meeting), &|_| None)
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

    /// The nodes about a block that have clay of `key`, of tagged clay that is in the block: the number of
    /// the neighbour, at which of its nodes there may be any, and these. None if the block has no such clay.
    pub(super) fn tagged_about(&self, slot: usize, key: ClassKey) -> Option<impl Iterator<Item = (usize, u64, &Nodes)>> {
        let index = self.cut_slot.get(slot)?.checked_sub(1)? as usize;
        let cut = &self.cuts[index];
        let about = &self.classes_about[index][cut.keys.binary_search(&key).ok()?];
        let nodes = move |(n, class): (usize, &u32)| {
            let (cut, class) = (&self.cuts[cut.neighbour(n)?], class.checked_sub(1)? as usize);
            (cut.has[class] != 0).then(|| (n, cut.has[class], &cut.nodes[class]))
        };
        Some(about.iter().enumerate().filter_map(nodes))
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
        let keys = tiles.tagged.iter().map(|t| t.key);
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
            if self.cuts.len() == count {
                self.cuts.push(CutBlock::default());
            }
            if find_cut(&mut self.cuts[count], (i, block), tiles) {
                count += 1;
                self.cut_slot[i] = count as u32;
            }
        }
        self.cuts.truncate(count);
        let cut_slot = &self.cut_slot;
        for cut in &mut self.cuts {
            let block = state.blocks[cut.slot];
            cut.about = NEIGHBOURS.map(|o| state.table.slot(block + o).map_or(0, |slot| cut_slot[slot]));
        }
        let place = |cut: &CutBlock, n: usize, key: &ClassKey| self.cuts[cut.neighbour(n)?].keys.binary_search(key).ok();
        let about = |cut: &CutBlock, key: &ClassKey| std::array::from_fn(|n| place(cut, n, key).map_or(0, |at| at as u32 + 1));
        self.classes_about.clear();
        self.classes_about.extend(self.cuts.iter().map(|cut| cut.keys.iter().map(|key| about(cut, key)).collect()));
    }

    fn update_cuts(&mut self, state: &State, tiles: &Tiles, step: &GridStep, meeting: &Meeting<'_>) -> Vec<GridReport> {
        let Self { nodes, cuts, masses, faces, cut_slot, .. } = self;
        masses.resize_with(cuts.len(), ClassMasses::default);
        faces.resize_with(cuts.len(), Vec::new);
        let mut nodes: Vec<&mut Nodes> =
            nodes.iter_mut().enumerate().filter(|(i, _)| cut_slot[*i] != 0).map(|(_, n)| n).collect();
        let keeps = step.imposed.is_none() && !meeting.cutting.has_ghosts();
        let is_apart = |block: IVec3| keeps && !meeting.concerns(block);
        // What no two sides share is updated while it is at hand.
        let sum = |((nodes, cut), masses): ((&mut &mut Nodes, &mut CutBlock), &mut ClassMasses)| {
            let block = state.blocks[cut.slot];
            sum_untagged(nodes, tiles, block);
            tagged::sum(cut, &tiles.tagged);
            meeting::find_masses(masses, nodes, cut, block, step, meeting);
            cut.ghosts.clear();
            if masses.classes.is_empty() && !meeting.cutting.has_ghosts() {
                return Some(GridReport::default());
            }
            let is_joint = is_apart(block) && !meeting::may_meet(&masses.classes);
            is_joint.then(|| joint(&mut Present { untagged: nodes, tagged: &mut cut.nodes, classes: &masses.classes }, step, !0))
        };
        let done: Vec<Option<GridReport>> =
            nodes.par_iter_mut().zip(&mut *cuts).zip(&mut *masses).with_min_len(4).map(sum).collect();
        let find = |scratch: &mut Box<Scratch>, (faces, cut): (&mut Vec<Faces>, &CutBlock)| {
            meeting::find_faces(faces, cut, &|n| Some(&masses[cut.neighbour(n)?]), scratch);
        };
        faces.par_iter_mut().zip(&*cuts).with_min_len(4).for_each_init(Scratch::new, find);
        type Cut<'a, 'b> = (((&'a mut &'b mut Nodes, &'a mut CutBlock), &'a ClassMasses), Option<GridReport>);
        let update = |parting: &mut Parting, (((nodes, cut), masses), done): Cut<'_, '_>| {
            let (block, about) = (state.blocks[cut.slot], cut.about);
            let faces_of = |n: usize| Some(&faces[about[n].checked_sub(1)? as usize][..]);
            if done.is_none() && !is_apart(block) {
                cut.has.fill(!0);
                return meeting::update(nodes, Some(cut), block, (step, meeting), &faces_of);
            }
            done.unwrap_or_else(|| {
                let present = &mut Present { untagged: nodes, tagged: &mut cut.nodes, classes: &masses.classes };
                // The nodes that no two sides share have clay of one field.
                let shared = faces_of(ITSELF).map_or(0, meeting::shared);
                let mut report = joint(present, step, !shared);
                report.add(&parting.update(present, block, (step, meeting), (shared, &faces_of)));
                report
            })
        };
        let all = nodes.par_iter_mut().zip(cuts).zip(&*masses).zip(done);
        all.with_min_len(4).map_init(Parting::default, update).collect()
    }
}

/// Finds the classes of tagged clay that reach a block, and their tiles about it; returns whether there are
/// any.
fn find_cut(cut: &mut CutBlock, (slot, block): (usize, IVec3), tiles: &Tiles) -> bool {
    let about = NEIGHBOURS.map(|o| tiles.table.slot(block + o).map_or(0..0, |slot| tiles.tagged_range(slot)));
    cut.slot = slot;
    cut.keys.clear();
    cut.keys.extend(about.iter().flat_map(|range| &tiles.tagged[range.clone()]).map(|tile| tile.key));
    cut.keys.sort_unstable();
    cut.keys.dedup();
    cut.between = Between::all(std::iter::once(ClassKey::FIRST).chain(cut.keys.iter().copied()));
    cut.nodes.resize(cut.keys.len(), [Node::default(); 64]);
    cut.has.clear();
    cut.has.resize(cut.keys.len(), !0);
    cut.sources.clear();
    for (class, key) in (0..).zip(&cut.keys) {
        for (neighbour, range) in (0..).zip(&about) {
            let its = range.clone().filter(|tile| tiles.tagged[*tile].key == *key);
            cut.sources.extend(its.map(|tile| Source { class, tile: tile as u32, neighbour }));
        }
    }
    !cut.keys.is_empty()
}

/// Adds up, for each node of `block`, the untagged clay of the 27 blocks around it, in a fixed order.
#[inline]
pub(super) fn sum_untagged(nodes: &mut Nodes, tiles: &Tiles, block: IVec3) {
    *nodes = [Node::default(); 64];
    for offset in NEIGHBOURS {
        let slot = tiles.table.slot(block + offset);
        if let Some(slot) = slot.filter(|slot| tiles.has_untagged.get(*slot) == Some(&true)) {
            add_tile(nodes, offset, &tiles.untagged[slot]);
        }
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
