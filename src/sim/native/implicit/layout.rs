//! Which slots the unknowns of a step stand in, and which nodes move as others do.
//!
//! A slot is a block of nodes as the clay of one class has them. Clay of a class sees, in the blocks about
//! its own, the slots of its class, and where there is none the untagged one. A class has a slot in every
//! block whose nodes its clay reaches, so that cells of a class have all their corners in slots of it.

use super::super::super::cut::ClassKey;
use super::super::state::NEIGHBOURS;
use super::vectors::{Block1, Block3, for_each};
use glam::IVec3;

/// Where a slot stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) block: IVec3,
    pub(super) key: ClassKey,
}

/// A node that is no unknown of its own: it moves as `image` of another, component by component -1, 0 or 1.
///
/// Within a slot: the outer node of a wall's column, image of the inner one. From slot to slot of one block:
/// a class that moves with another there, as itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Link {
    /// Slot and node.
    pub(super) from: (u32, u8),
    pub(super) to: (u32, u8),
    pub(super) image: [f32; 3],
}

/// The slots of a level and what ties their nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct Layout {
    pub(super) slots: Vec<Place>,
    /// Slot + 1 of the block at each offset of [`NEIGHBOURS`], as the clay of the slot's class sees it; 0 if
    /// there is none.
    pub(super) neighbours: Vec<[u32; 27]>,
    /// In the order of folding: what is folded onto a node comes before that node itself is folded.
    pub(super) links: Vec<Link>,
    /// Slots with a node that follows one, or that is followed.
    pub(super) is_linked: Vec<bool>,
}

impl Layout {
    /// Finds the neighbours of the slots anew.
    pub(super) fn find_neighbours(&mut self, index: &Index) {
        self.neighbours.clear();
        self.neighbours.resize(self.slots.len(), [0; 27]);
        let slots = &self.slots;
        for_each(&mut self.neighbours, |slot, neighbours| {
            let Place { block, key } = slots[slot];
            *neighbours = NEIGHBOURS.map(|offset| index.seen(block + offset, key).map_or(0, |found| found + 1));
        });
    }

    /// Notes which slots the links tie.
    pub(super) fn mark_links(&mut self) {
        self.is_linked.clear();
        self.is_linked.resize(self.slots.len(), false);
        for Link { from, to, .. } in &self.links {
            (self.is_linked[from.0 as usize], self.is_linked[to.0 as usize]) = (true, true);
        }
    }

    /// The nodes of each slot, a bit each, at which clay of whatever class hangs together from node to node
    /// with that of one of the `chosen` slots; `has` are those at which there is any.
    pub(super) fn hanging_together(&self, index: &Index, has: &[u64], chosen: &[bool]) -> Vec<u64> {
        let mut all: Vec<u64> = vec![0; has.len()];
        let mut reached = all.clone();
        for slots in index.by_block() {
            let of_block = slots.clone().fold(0, |of_block, slot| of_block | has[slot]);
            let is_chosen = slots.clone().any(|slot| chosen[slot]);
            for slot in slots {
                all[slot] = of_block;
                reached[slot] = if is_chosen { of_block } else { 0 };
            }
        }
        let mut waiting: Vec<usize> = (0..has.len()).filter(|slot| reached[*slot] != 0).collect();
        while let Some(slot) = waiting.pop() {
            for (n, offset) in NEIGHBOURS.iter().enumerate().filter(|(_, offset)| offset.length_squared() <= 1) {
                let Some(other) = self.neighbours[slot][n].checked_sub(1).map(|other| other as usize) else { continue };
                let new = beside(reached[slot], *offset) & all[other] & !reached[other];
                if new != 0 {
                    reached[other] |= new;
                    waiting.push(other);
                }
            }
            for other in index.of_same_block(self.slots[slot].block) {
                if reached[slot] & !reached[other] != 0 {
                    reached[other] |= reached[slot];
                    waiting.push(other);
                }
            }
        }
        reached
    }

    /// Brings what linked nodes got to the nodes that move in their place, and leaves 0 there.
    pub(super) fn fold(&self, vector: &mut [Block3]) {
        self.fold_by(vector, |image, d| image[d]);
    }

    /// Adds what linked nodes have of a diagonal to that of the nodes that move in their place.
    pub(super) fn fold_diagonal(&self, vector: &mut [Block3]) {
        self.fold_by(vector, |image, d| image[d].abs());
    }

    /// The same of what is beside the diagonal: by components yz, zx and xy.
    pub(super) fn fold_cross(&self, vector: &mut [Block3]) {
        self.fold_by(vector, |image, d| image[(d + 1) % 3] * image[(d + 2) % 3]);
    }

    /// Folds with so much of each component, by the link's image.
    fn fold_by(&self, vector: &mut [Block3], share: impl Fn(&[f32; 3], usize) -> f32) {
        for Link { from, to, image } in &self.links {
            for d in 0..3 {
                let got = std::mem::take(&mut vector[from.0 as usize].0[d][usize::from(from.1)]);
                vector[to.0 as usize].0[d][usize::from(to.1)] += share(image, d) * got;
            }
        }
    }

    /// Folds component `d` of a vector, which stands alone.
    pub(super) fn fold_component(&self, d: usize, field: &mut [Block1]) {
        for Link { from, to, image } in &self.links {
            let got = std::mem::take(&mut field[from.0 as usize].0[usize::from(from.1)]);
            field[to.0 as usize].0[usize::from(to.1)] += image[d] * got;
        }
    }

    /// Gives linked nodes the image of what the nodes have that move in their place.
    pub(super) fn expand(&self, vector: &mut [Block3]) {
        for Link { from, to, image } in self.links.iter().rev() {
            for d in 0..3 {
                vector[from.0 as usize].0[d][usize::from(from.1)] = image[d] * vector[to.0 as usize].0[d][usize::from(to.1)];
            }
        }
    }

    /// Expands component `d` of a vector, which stands alone.
    pub(super) fn expand_component(&self, d: usize, field: &mut [Block1]) {
        for Link { from, to, image } in self.links.iter().rev() {
            field[from.0 as usize].0[usize::from(from.1)] = image[d] * field[to.0 as usize].0[usize::from(to.1)];
        }
    }
}

/// The nodes next to those of these bits, along an axis, that stand in the block at `offset`: with none those
/// in the same one.
fn beside(nodes: u64, offset: IVec3) -> u64 {
    // The last nodes along z, y and x.
    const LAST: [u64; 3] = [0x8888_8888_8888_8888, 0xf000_f000_f000_f000, 0xffff_0000_0000_0000];
    let axes = [(offset.z, 1), (offset.y, 4), (offset.x, 16)];
    let mut next = 0;
    for ((to, stride), last) in axes.into_iter().zip(LAST) {
        next |= match to {
            1 => (nodes & last) >> (3 * stride),
            -1 => nodes << (3 * stride) & last,
            _ if offset == IVec3::ZERO => (nodes & !last) << stride | nodes >> stride & !last,
            _ => 0,
        };
    }
    next
}

/// A block's coordinates in one number.
fn packed(block: IVec3) -> u64 {
    let [x, y, z] = block.to_array().map(|c| u64::from((c + (1 << 20)).cast_unsigned()));
    x << 42 | y << 21 | z
}

/// Finds slots by block and class.
#[derive(Clone, Debug, Default)]
pub(super) struct Index(Vec<(u64, ClassKey, u32)>);

impl Index {
    /// Takes other slots.
    pub(super) fn rebuild(&mut self, slots: &[Place]) {
        self.0.clear();
        self.0.extend(slots.iter().zip(0..).map(|(place, slot)| (packed(place.block), place.key, slot)));
        self.0.sort_unstable();
    }

    /// The slots of each block.
    fn by_block(&self) -> impl Iterator<Item = impl Iterator<Item = usize> + Clone> {
        self.0.chunk_by(|a, b| a.0 == b.0).map(|of_block| of_block.iter().map(|entry| entry.2 as usize))
    }

    /// The slots of a block.
    fn of_same_block(&self, block: IVec3) -> impl Iterator<Item = usize> {
        let first = self.0.partition_point(|entry| entry.0 < packed(block));
        self.0[first..].iter().take_while(move |entry| entry.0 == packed(block)).map(|entry| entry.2 as usize)
    }

    /// The slot of a class in a block.
    pub(super) fn find(&self, block: IVec3, key: ClassKey) -> Option<u32> {
        let at = self.0.binary_search_by_key(&(packed(block), key), |entry| (entry.0, entry.1)).ok()?;
        Some(self.0[at].2)
    }

    /// The slot that clay of a class sees in a block.
    pub(super) fn seen(&self, block: IVec3, key: ClassKey) -> Option<u32> {
        self.find(block, key).or_else(|| self.find(block, key.without_sides()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::super::snapshot::Tag;
    use super::*;
    use std::collections::BTreeSet;

    /// The node of these coordinates in its block.
    fn node(at: IVec3) -> u32 {
        at.rem_euclid(IVec3::splat(4)).dot(IVec3::new(16, 4, 1)).cast_unsigned()
    }

    /// Coordinates of the nodes that stand next to these along an axis.
    fn next_to(all: &BTreeSet<[i32; 3]>) -> BTreeSet<[i32; 3]> {
        let ways = [IVec3::X, IVec3::Y, IVec3::Z].into_iter().flat_map(|way| [way, -way]);
        all.iter().flat_map(|at| ways.clone().map(|way| (IVec3::from_array(*at) + way).to_array())).collect()
    }

    /// Whatever node it is, those beside it in its block and in the six about it are its six neighbours.
    #[test]
    fn six_nodes_are_beside_one() {
        for k in 0..64 {
            let at = IVec3::new(k >> 4, k >> 2 & 3, k & 3);
            let expected = next_to(&[at.to_array()].into());
            let mut found = BTreeSet::new();
            for offset in NEIGHBOURS.into_iter().filter(|offset| offset.length_squared() <= 1) {
                let nodes = beside(1 << k, offset);
                let of_block =
                    (0..64).filter(|k| nodes >> k & 1 == 1).map(|k| 4 * offset + IVec3::new(k >> 4, k >> 2 & 3, k & 3));
                found.extend(of_block.map(|at| at.to_array()));
            }
            assert_eq!(found, expected, "node {k}");
        }
    }

    /// What hangs together does so from node to node, over blocks, and over classes that share a node; what
    /// only shares a block with it, or touches it corner to corner, does not.
    #[test]
    fn clay_hangs_together_from_node_to_node() {
        let key = |side| ClassKey::new(0, [Tag { sheet: 1, side }, Tag::default()]);
        let places = [(0, ClassKey::FIRST), (1, ClassKey::FIRST), (1, key(1)), (1, key(-1)), (2, ClassKey::FIRST), (2, key(-1))];
        let slots: Vec<Place> = places.map(|(x, key)| Place { block: IVec3::X * x, key }).to_vec();
        // By slot. From the first block clay goes on into the second, where a class at the node with x = 5
        // takes over; x = 7 and the third block are beyond a gap but for the other class at y = 3.
        let nodes: [&[[i32; 3]]; 6] =
            [&[[2, 0, 0], [3, 0, 0]], &[[4, 0, 0], [7, 0, 0]], &[[4, 0, 0], [5, 0, 0]], &[[6, 1, 0]], &[[8, 0, 0]], &[[8, 3, 3]]];
        let has = nodes.map(|nodes| nodes.iter().fold(0, |has, at| has | 1 << node(IVec3::from_array(*at))));
        let mut index = Index::default();
        index.rebuild(&slots);
        let mut layout = Layout { slots, ..Layout::default() };
        layout.find_neighbours(&index);
        let reached = |chosen: usize| {
            let chosen: Vec<bool> = (0..6).map(|slot| slot == chosen).collect();
            let found = layout.hanging_together(&index, &has, &chosen);
            let all = found.into_iter().zip(places).flat_map(|(nodes, (x, _))| {
                let at = move |k: u32| (k >> 4) as i32 + 4 * x;
                (0..64).filter(move |k| nodes >> k & 1 == 1).map(move |k| [at(k), (k >> 2 & 3) as i32, (k & 3) as i32])
            });
            all.collect::<BTreeSet<_>>()
        };
        let together = [[2, 0, 0], [3, 0, 0], [4, 0, 0], [5, 0, 0]];
        assert_eq!(reached(0), together.into());
        // Of a block that is touched all of its clay is, and what hangs together with any.
        let touched = [[6, 1, 0], [7, 0, 0], [8, 0, 0]];
        assert_eq!(reached(3), together.into_iter().chain(touched).collect());
        assert_eq!(reached(5), [[7, 0, 0], [8, 0, 0], [8, 3, 3]].into());
    }
}
