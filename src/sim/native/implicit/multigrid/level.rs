//! One level of the preconditioner: its operators.

use super::super::super::nodes::{local, offset};
use super::super::layout::{Index, Layout, Link, Place};
use super::super::vectors::{Block3, Vector, for_each, for_each_pair};
use super::elements::{Cells, Modes};
use super::transfer::{self, Partial};
use glam::IVec3;
use std::collections::BTreeMap;

/// What the finest level is made of. Vectors are folded.
pub(in super::super) struct Finest<'a> {
    pub(in super::super) layout: &'a Layout,
    /// How full each cell is of the slot's class; cells stand at their low corners.
    pub(in super::super) fill: &'a [[f32; 64]],
    /// The splines' diagonal.
    pub(in super::super) diagonal: &'a [Block3],
    /// Inertia and contact.
    pub(in super::super) extra: &'a [Block3],
    /// What the latter has beside that diagonal: yz, zx, xy.
    pub(in super::super) cross: &'a [Block3],
    /// 1 where clay moves, -1 where a wall holds it, 0 elsewhere.
    pub(in super::super) live: &'a [Block3],
    /// Moduli, in the units of the other two.
    pub(in super::super) mu: f32,
    pub(in super::super) lambda: f32,
}

/// One level. Clay moves where `inverse` is not 0.
#[derive(Debug, Default)]
pub(super) struct Level {
    /// With the links from slot to slot alone.
    pub(super) layout: Layout,
    pub(super) fill: Vec<[f32; 64]>,
    pub(super) cells: Vec<Cells>,
    pub(super) modes: Modes,
    /// The elements' diagonal, which the three components share.
    own: Vec<[f32; 64]>,
    /// A bit for each node with clay of the slot's own class in a cell about.
    reached: Vec<u64>,
    /// What the diagonal has beyond that.
    pub(super) added: Vector,
    /// Inertia and contact, of which that is made: their diagonal, and what is beside it.
    extra: Vector,
    cross: Vector,
    /// 1 where clay moves, -1 where a wall holds it, 0 elsewhere.
    live: Vector,
    /// The smoother's weight over the diagonal.
    pub(super) inverse: Vector,
    /// Whether a slot has anything that is free, or that is tied.
    pub(super) is_used: Vec<bool>,
    /// Slot + 1 of the next level at the parent and its upper neighbours, z fastest; 0 if there is none.
    pub(super) parents: Vec<[u32; 8]>,
    /// Slot + 1 of the level before at the blocks -1 ..= 1 about the first child, z fastest.
    pub(super) children: Vec<[u32; 27]>,
    /// What its slots give to coarse nodes of a vector, by component.
    restricted: [Vec<Partial>; 3],
}

impl Level {
    /// The finest level; `weight` is the smoother's.
    pub(super) fn set_finest(&mut self, finest: &Finest<'_>, weight: f32) {
        self.layout.slots.clone_from(&finest.layout.slots);
        self.layout.neighbours.clone_from(&finest.layout.neighbours);
        self.layout.links.clear();
        self.layout.links.extend(finest.layout.links.iter().filter(|link| link.from.0 != link.to.0));
        self.fill.clear();
        self.fill.extend_from_slice(finest.fill);
        self.set_cells(Modes::new(finest.mu, finest.lambda, 1.0));
        self.live.clear();
        self.live.extend_from_slice(finest.live);
        self.set_own((finest.lambda + 4.0 * finest.mu) / 9.0);
        self.extra.clear();
        self.extra.extend_from_slice(finest.extra);
        self.cross.clear();
        self.cross.extend_from_slice(finest.cross);
        self.mask_extra();
        self.added.clone_from(&self.extra);
        self.set_inverse(Some(finest.diagonal), weight);
    }

    /// The slots that `fine`'s are interpolated from.
    pub(super) fn set_slots(&mut self, fine: &mut Self, index: &mut Index) {
        let slots = &mut self.layout.slots;
        slots.clear();
        for Place { block, key } in &fine.layout.slots {
            slots.extend(transfer::parents_of(*block).map(|(_, block, _)| Place { block, key: *key }));
        }
        slots.sort_unstable_by_key(|place| (place.block.to_array(), place.key));
        slots.dedup();
        index.rebuild(slots);
        self.layout.find_neighbours(index);
        let slots = &self.layout.slots;
        self.children.clear();
        self.children.resize(slots.len(), [0; 27]);
        fine.parents.clear();
        for (Place { block, key }, slot) in fine.layout.slots.iter().zip(1..) {
            let mut parents = [0; 8];
            for (e, parent, child) in transfer::parents_of(*block) {
                let Some(found) = index.find(parent, *key) else { continue };
                parents[e] = found + 1;
                self.children[found as usize][(13 + child.x * 9 + child.y * 3 + child.z) as usize] = slot;
            }
            fine.parents.push(parents);
        }
    }

    /// Where clay moves on this level: where it moves at more of the nodes of the level before than walls
    /// hold. Ties nodes as that at the same place is tied, and what no clay of their class reaches to the
    /// untagged ones.
    pub(super) fn set_live(&mut self, fine: &mut Self, index: &Index) {
        restrict(&fine.live, &mut fine.restricted, &self.children, &mut self.live);
        self.take_ties(fine);
        self.layout.fold(&mut self.live);
        self.tie_alone(index);
        for_each(&mut self.live, |_, live| {
            live.flat_mut().iter_mut().for_each(|live| *live = if *live == 0.0 { 0.0 } else { live.signum() });
        });
    }

    /// Ties nodes as clay at the same places is tied on the level before, to what is an unknown there.
    fn take_ties(&mut self, fine: &Self) {
        let on_coarse = |(slot, node): (u32, u8)| {
            let at = fine.layout.slots[slot as usize].block.rem_euclid(IVec3::splat(2)) * 4 + offset(node.into());
            let parent = fine.parents[slot as usize][0];
            (at % 2 == IVec3::ZERO && parent > 0).then(|| (parent - 1, local(at.x / 2, at.y / 2, at.z / 2) as u8))
        };
        let tied: BTreeMap<(u32, u8), (u32, u8)> = fine.layout.links.iter().map(|link| (link.from, link.to)).collect();
        let is_unknown = |(slot, node): &(u32, u8)| (0..3).any(|a| fine.live[*slot as usize].0[a][usize::from(*node)] != 0.0);
        let is_reached = |(slot, node): (u32, u8)| fine.reached[slot as usize] >> node & 1 == 1;
        let coarse = |link: &Link| {
            let mut root = link.to;
            while let Some(to) = tied.get(&root) {
                root = *to;
            }
            Some(Link { from: on_coarse(link.from)?, to: on_coarse(Some(root).filter(is_unknown)?)?, image: link.image })
        };
        self.layout.links.clear();
        self.layout.links.extend(fine.layout.links.iter().filter(|link| is_reached(link.from)).filter_map(coarse));
    }

    /// Ties nodes of classes that nothing of theirs reaches to what the untagged ones move with.
    fn tie_alone(&mut self, index: &Index) {
        let Layout { slots, links, .. } = &mut self.layout;
        let tied: BTreeMap<(u32, u8), (u32, u8)> = links.iter().map(|link| (link.from, link.to)).collect();
        for (slot, place) in slots.iter().enumerate().filter(|(_, place)| place.key != place.key.without_sides()) {
            let Some(untagged) = index.find(place.block, place.key.without_sides()) else { continue };
            for node in (0..64).filter(|node| (0..3).all(|a| self.live[slot].0[a][*node] == 0.0)) {
                let [from, untagged] = [slot as u32, untagged].map(|slot| (slot, node as u8));
                let to = tied.get(&untagged).copied().unwrap_or(untagged);
                if !tied.contains_key(&from) && to != from {
                    links.push(Link { from, to, image: [1.0; 3] });
                }
            }
        }
    }

    /// The operators on slots that are there already, of the level before.
    pub(super) fn set_coarse(&mut self, fine: &mut Self, (mu, lambda): (f32, f32), width: i32, weight: f32) {
        let count = self.layout.slots.len();
        let children = std::mem::take(&mut self.children);
        // The eight of it by the child that they are in, and the first of them there.
        let child = |slot: usize, n: IVec3| {
            let half = n / 2;
            let child = children[slot][(13 + half.x * 9 + half.y * 3 + half.z) as usize].checked_sub(1)?;
            Some((child as usize, (n % 2) * 2))
        };
        self.fill.resize(count, [0.0; 64]);
        for_each(&mut self.fill, |slot, fill| {
            *fill = std::array::from_fn(|cell| {
                let Some((child, first)) = child(slot, offset(cell)) else { return 0.0 };
                let of = |c: i32| fine.fill[child][local(first.x + (c >> 2), first.y + (c >> 1 & 1), first.z + (c & 1))];
                (0..8).map(of).sum::<f32>() / 8.0
            });
        });
        let width = width as f32;
        self.set_cells(Modes::new(mu, lambda, width));
        self.set_own(width * (lambda + 4.0 * mu) / 9.0);
        self.children = children;
        self.take_extra(fine);
        self.set_added();
        self.set_inverse(None, weight);
    }

    /// Restricts inertia and contact.
    fn take_extra(&mut self, fine: &mut Self) {
        for (own, of) in [(&mut self.extra, &fine.extra), (&mut self.cross, &fine.cross)] {
            restrict(of, &mut fine.restricted, &self.children, own);
        }
        self.layout.fold(&mut self.extra);
        self.layout.fold_cross(&mut self.cross);
        self.mask_extra();
    }

    /// A diagonal that is no softer than inertia and contact in any direction: the sum of each row's
    /// magnitudes. The rows' own diagonal is soft along axes that a face is nearly along, and what it pushed
    /// went off along them.
    fn set_added(&mut self) {
        self.added.clone_from(&self.extra);
        let cross = &self.cross;
        for_each(&mut self.added, |slot, added| {
            for n in 0..64 {
                let [yz, zx, xy] = [0, 1, 2].map(|d| cross[slot].0[d][n].abs());
                let beside = [xy + zx, yz + xy, zx + yz];
                (0..3).for_each(|d| added.0[d][n] += beside[d]);
            }
        });
    }

    fn set_cells(&mut self, modes: Modes) {
        self.modes = modes;
        self.cells.resize(self.fill.len(), Cells::EMPTY);
        let (slots, neighbours, fill) = (&self.layout.slots, &self.layout.neighbours, &self.fill);
        for_each(&mut self.cells, |slot, cells| {
            *cells = Cells::new(|i| {
                let seen = neighbours[slot][i].checked_sub(1)? as usize;
                (slots[seen].key == slots[slot].key).then(|| &fill[seen])
            });
        });
    }

    /// The elements' diagonal: `share` of the fill of the cells about.
    fn set_own(&mut self, share: f32) {
        self.own.resize(self.cells.len(), [0.0; 64]);
        let cells = &self.cells;
        for_each(&mut self.own, |slot, own| *own = cells[slot].about_nodes().map(|fill| share * fill));
        let bits = |own: &[f32; 64]| (0..64).filter(|k| own[*k] > 0.0).fold(0, |bits, k| bits | 1 << k);
        self.reached.clear();
        self.reached.extend(self.own.iter().map(bits));
        for Link { from, to, .. } in &self.layout.links {
            let got = std::mem::take(&mut self.own[from.0 as usize][usize::from(from.1)]);
            self.own[to.0 as usize][usize::from(to.1)] += got;
        }
        let own = &self.own;
        for_each(&mut self.live, |slot, live| {
            let empty = live.flat_mut().iter_mut().enumerate().filter(|(i, _)| own[slot][i % 64] == 0.0);
            empty.for_each(|(_, live)| *live = live.min(0.0));
        });
    }

    /// Leaves of inertia and contact what is where clay moves.
    fn mask_extra(&mut self) {
        let live = &self.live;
        let is_live = |slot: usize, d: usize, n: usize| live[slot].0[d % 3][n] > 0.0;
        for_each_pair(&mut self.extra, &mut self.cross, |slot, extra, cross| {
            for d in 0..3 {
                for n in 0..64 {
                    extra.0[d][n] = if is_live(slot, d, n) { extra.0[d][n] } else { 0.0 };
                    let is_both = is_live(slot, d + 1, n) && is_live(slot, d + 2, n);
                    cross.0[d][n] = if is_both { cross.0[d][n] } else { 0.0 };
                }
            }
        });
    }

    /// The smoother, by the splines' diagonal where that is more than the elements'.
    fn set_inverse(&mut self, splines: Option<&[Block3]>, weight: f32) {
        let count = self.layout.slots.len();
        self.inverse.resize(count, Block3::ZERO);
        let (own, added, live) = (&self.own, &self.added, &self.live);
        for_each(&mut self.inverse, |slot, inverse| {
            let (live, added) = (live[slot].flat(), added[slot].flat());
            for (i, inverse) in inverse.flat_mut().iter_mut().enumerate() {
                let own = own[slot][i % 64];
                let diagonal = splines.map_or(own, |splines| splines[slot].flat()[i].max(own)) + added[i];
                *inverse = if live[i] > 0.0 { weight / diagonal } else { 0.0 };
            }
        });
        self.is_used.clear();
        self.is_used.extend(self.inverse.iter().map(|inverse| *inverse != Block3::ZERO));
        self.layout.links.iter().for_each(|tie| self.is_used[tie.from.0 as usize] = true);
        self.layout.links.iter().for_each(|tie| self.is_used[tie.to.0 as usize] = true);
        self.layout.mark_links();
    }

    /// Unknowns that are free along some axis.
    pub(super) fn free_count(&self) -> usize {
        let of = |inverse: &Block3| (0..64).filter(|n| (0..3).any(|a| inverse.0[a][*n] > 0.0)).count();
        self.inverse.iter().map(of).sum()
    }
}

/// Makes `coarse` what slots with these `children` get of `fine`, whether anything is free there or not.
fn restrict(fine: &[Block3], restricted: &mut [Vec<Partial>; 3], children: &[[u32; 27]], coarse: &mut Vector) {
    coarse.resize(children.len(), Block3::ZERO);
    for (a, restricted) in restricted.iter_mut().enumerate() {
        restricted.resize(fine.len(), Partial::ZERO);
        for_each(restricted, |slot, partial| transfer::restrict(&fine[slot].0[a], &[1.0; 64], partial));
    }
    for_each(coarse, |slot, coarse| {
        for (a, restricted) in restricted.iter().enumerate() {
            transfer::collect(&children[slot], restricted, &mut coarse.0[a]);
        }
    });
}
