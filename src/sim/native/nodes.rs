//! The nodes of a block: their order, what each class of clay has there, and where they stand in the tiles of
//! the blocks about.

use super::super::cut::ClassKey;
use super::super::facing::Between;
use super::super::params::BLOCK;
use super::kernel::Tile;
use super::simd::Node;
use super::state::Table;
use glam::{DVec3, IVec3};

/// The 64 nodes of a block, z fastest.
pub(super) type Nodes = [Node; 64];

/// Index of a node in its block, each coordinate in 0 .. 4.
#[inline(always)]
pub(super) const fn local(x: i32, y: i32, z: i32) -> usize {
    ((x * 4 + y) * 4 + z) as usize
}

/// Position in the block of node `k`.
pub(super) fn offset(k: usize) -> IVec3 {
    let k = k as i32;
    IVec3::new(k / 16, k / 4 % 4, k % 4)
}

/// The nodes of the tagged classes in a block.
#[derive(Debug, Default)]
pub(super) struct CutBlock {
    /// The block's slot.
    pub slot: usize,
    /// Index + 1 of each of its neighbours among such blocks; 0 for others.
    pub about: [u32; 27],
    /// The classes, in the order of their keys.
    pub keys: Vec<ClassKey>,
    /// Velocity and mass of each class.
    pub nodes: Vec<Nodes>,
    /// All that clay of these classes may stand on either side of.
    pub between: Vec<Between>,
    /// At which nodes of each class there may be anything but 0: a bit each.
    pub has: Vec<u64>,
    /// The tiles that may hold something of each class, class by class.
    pub sources: Vec<Source>,
    /// Where the node is incompatible with each class, under the methods that know such; else none.
    pub ghosts: Vec<Ghosts>,
}

/// A tile that may hold something of the nodes of a class in a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// The class, by its place among the block's.
    pub class: u32,
    /// Index of the tile among all tagged ones.
    pub tile: u32,
    /// Number of the neighbour whose it is.
    pub neighbour: u8,
}

impl CutBlock {
    /// Index of the block's neighbour of this number among blocks with tagged clay, if it is one.
    pub(super) fn neighbour(&self, number: usize) -> Option<usize> {
        Some(self.about[number].checked_sub(1)? as usize)
    }
}

/// The masses of nodes.
pub(super) fn node_masses(nodes: &Nodes) -> [f32; 64] {
    let mut masses = [0.0; 64];
    masses.iter_mut().zip(nodes).for_each(|(mass, node)| *mass = node.0[3]);
    masses
}

/// Which masses are not 0, or are no numbers: a bit each.
pub(super) fn bits(masses: &[f32; 64]) -> u64 {
    let mut bits = 0;
    for (eight, masses) in masses.as_chunks::<8>().0.iter().enumerate() {
        let mut its = 0;
        for k in 0..8 {
            its |= u32::from(masses[k] != 0.0) << k;
        }
        bits |= u64::from(its) << (8 * eight);
    }
    bits
}

/// Why a node is incompatible with a class.
#[derive(Clone, Copy, Debug)]
pub(super) struct Incompatible {
    /// Index of the blade between them.
    pub tool: u8,
    /// The blade's normal towards the class.
    pub normal: DVec3,
}

/// A value for each node of a block.
pub(super) type Ghosts = [Option<Incompatible>; 64];

/// The classes that have clay at the nodes of a block, in the order of their keys, and their masses there,
/// with what walls folded: what the normals of cuts are made of.
#[derive(Clone, Debug, Default)]
pub(super) struct ClassMasses {
    pub classes: Vec<ClassHere>,
    pub masses: Vec<[f32; 64]>,
}

/// A class that has clay at nodes of a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClassHere {
    pub key: ClassKey,
    /// 0 for untagged clay, else 1 + the class's place among the block's.
    pub class: u32,
    /// At which nodes there is any: a bit each.
    pub has: u64,
}

/// The classes that have clay at the nodes of a block, and what they have there.
pub(super) struct Present<'a> {
    pub untagged: &'a mut Nodes,
    pub tagged: &'a mut [Nodes],
    pub classes: &'a [ClassHere],
}

impl Present<'_> {
    /// The nodes of one of the classes, by its place among them.
    pub(super) fn nodes(&mut self, place: usize) -> &mut Nodes {
        match self.classes[place].class {
            0 => self.untagged,
            class => &mut self.tagged[class as usize - 1],
        }
    }
}

/// From the first to before the last of a neighbour's nodes along an axis that our tile holds, and what takes
/// them to the tile's coordinates.
#[inline(always)]
const fn arena_range(offset: i32) -> (i32, i32, i32) {
    match offset {
        -1 => (3, 4, -4),
        0 => (0, 4, 0),
        _ => (0, 2, 4),
    }
}

/// Copies to our tile those nodes of a block at `offset` that it holds, of rows along z with any of these
/// bits.
pub(super) fn copy_rows(to: &mut Tile, from: &Nodes, has: u64, offset: IVec3) {
    match offset.z {
        -1 => copy_rows_of::<1>(to, from, has, offset),
        0 => copy_rows_of::<4>(to, from, has, offset),
        _ => copy_rows_of::<2>(to, from, has, offset),
    }
}

/// The same, `N` nodes of each row.
#[inline(always)]
fn copy_rows_of<const N: usize>(to: &mut Tile, from: &Nodes, has: u64, offset: IVec3) {
    let [x, y, z] = offset.to_array().map(arena_range);
    for i in x.0..x.1 {
        for j in y.0..y.1 {
            let (k, at) = (local(i, j, z.0), Tile::at(i + x.2, j + y.2, z.0 + z.2));
            if has >> k & ((1 << N) - 1) != 0 {
                to.0[at..at + N].copy_from_slice(&from[k..k + N]);
            }
        }
    }
}

/// Calls `each` with the index of a node in the block at `offset` and in our tile, for every node of it that
/// our tile holds.
#[inline(always)]
pub(super) fn for_arena_nodes(offset: IVec3, mut each: impl FnMut(usize, usize)) {
    let (x, y, z) = (arena_range(offset.x), arena_range(offset.y), arena_range(offset.z));
    for i in x.0..x.1 {
        for j in y.0..y.1 {
            for k in z.0..z.1 {
                each(local(i, j, k), Tile::at(i + x.2, j + y.2, k + z.2));
            }
        }
    }
}

/// From the first to before the last of a block's nodes along an axis that the tile of the neighbour at
/// `offset` holds, and what takes them to that tile's own coordinates.
#[inline(always)]
pub(super) const fn shared_range(offset: i32) -> (i32, i32, i32) {
    match offset {
        -1 => (0, 2, 4),
        0 => (0, 4, 0),
        _ => (3, 4, -4),
    }
}

/// Calls `each` with a node of a block and its index in the tile of the neighbour at `offset`, for every node
/// that this tile holds.
#[inline(always)]
pub(super) fn for_shared_nodes(offset: IVec3, mut each: impl FnMut(usize, usize)) {
    let [x, y, z] = offset.to_array().map(shared_range);
    for i in x.0..x.1 {
        for j in y.0..y.1 {
            for k in z.0..z.1 {
                each(local(i, j, k), Tile::at(i + x.2, j + y.2, k + z.2));
            }
        }
    }
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
