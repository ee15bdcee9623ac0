//! The nodes of a block: their order, what each class of clay has there, and where they stand in the tiles of
//! the blocks about.

use super::super::cut::ClassKey;
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
    /// The classes, in the order of their keys.
    pub keys: Vec<ClassKey>,
    /// Velocity and mass of each class.
    pub nodes: Vec<Nodes>,
    /// Where the node is incompatible with each class, under the methods that know such; else none.
    pub ghosts: Vec<Ghosts>,
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

/// The mass of each class at the nodes of a block, with what walls folded: what the normals of cuts are made
/// of.
pub(super) type ClassMasses = Vec<(ClassKey, [f32; 64])>;

/// Calls `each` with the index of a node in the block at `offset` and in our tile, for every node of it that
/// our tile holds.
#[inline(always)]
pub(super) fn for_arena_nodes(offset: IVec3, mut each: impl FnMut(usize, usize)) {
    // From `low` to `high` of the neighbour's coordinates, at `shift` in our tile.
    let range = |o: i32| match o {
        -1 => (3, 4, -4),
        0 => (0, 4, 0),
        _ => (0, 2, 4),
    };
    let (x, y, z) = (range(offset.x), range(offset.y), range(offset.z));
    for i in x.0..x.1 {
        for j in y.0..y.1 {
            for k in z.0..z.1 {
                each(local(i, j, k), Tile::at(i + x.2, j + y.2, k + z.2));
            }
        }
    }
}

/// Calls `each` with a node of a block and its index in the tile of the neighbour at `offset`, for every node
/// that this tile holds.
#[inline(always)]
pub(super) fn for_shared_nodes(offset: IVec3, mut each: impl FnMut(usize, usize)) {
    // From `low` to `high` of our coordinates, at `shift` in the tile's own.
    let range = |o: i32| match o {
        -1 => (0, 2, 4),
        0 => (0, 4, 0),
        _ => (3, 4, -4),
    };
    let (x, y, z) = (range(offset.x), range(offset.y), range(offset.z));
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
