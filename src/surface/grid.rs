//! Sparse storage of node values: blocks of 8^3 nodes behind a dense table over the bounding box of the
//! blocks in use.

use glam::IVec3;
use rayon::prelude::*;

/// Nodes along an edge of a block.
pub(crate) const BLOCK: i32 = 8;
/// Nodes of a block.
pub(crate) const BLOCK_NODES: usize = 512;
/// Table entry of a block that is not stored.
pub(crate) const ABSENT: u32 = u32::MAX;

/// Which blocks are stored, and where.
#[derive(Clone, Debug, Default)]
pub(crate) struct BlockGrid {
    /// Block of the table's first entry.
    low: IVec3,
    /// Entries of the table along each axis.
    extent: IVec3,
    /// Entry of a block (x fastest) -> its slot.
    table: Vec<u32>,
    /// Slot -> block, in the table's order.
    blocks: Vec<IVec3>,
}

impl BlockGrid {
    /// The grid of the blocks `low..low + extent` for which `is_stored` holds.
    pub(crate) fn new(low: IVec3, extent: IVec3, is_stored: impl Fn(usize) -> bool) -> Self {
        let mut grid = Self { low, extent, table: Vec::new(), blocks: Vec::new() };
        grid.table = vec![ABSENT; extent.as_usizevec3().element_product()];
        for entry in 0..grid.table.len() {
            if is_stored(entry) {
                grid.table[entry] = grid.blocks.len() as u32;
                grid.blocks.push(block_of_entry(low, extent, entry));
            }
        }
        grid
    }

    pub(crate) fn blocks(&self) -> &[IVec3] {
        &self.blocks
    }

    /// The blocks of the table: the first, and the one behind the last.
    pub(crate) fn bounds(&self) -> (IVec3, IVec3) {
        (self.low, self.low + self.extent)
    }

    /// The slot of a block, if it is stored.
    pub(crate) fn slot(&self, block: IVec3) -> Option<usize> {
        let entry = entry_of_block(self.low, self.extent, block)?;
        let slot = self.table[entry];
        (slot != ABSENT).then_some(slot as usize)
    }

    /// The value at a node; 0 where none is stored.
    pub(crate) fn value(&self, values: &NodeValues, node: IVec3) -> f32 {
        self.value_from(|slot| values.block(slot), node)
    }

    /// [`Self::value`] of values that stand in `blocks`, by slot.
    pub(crate) fn value_from<'a>(&self, blocks: impl Fn(usize) -> Option<&'a [f32]>, node: IVec3) -> f32 {
        let block = node.map(|i| i.div_euclid(BLOCK));
        let at = node - block * BLOCK;
        let stored = self.slot(block).and_then(blocks);
        stored.map_or(0.0, |v| v[(at.x + BLOCK * (at.y + BLOCK * at.z)) as usize])
    }

    /// A number that orders nodes: z, then y, then x, over the table's box.
    pub(crate) fn node_number(&self, node: IVec3) -> u64 {
        let at = (node - self.low * BLOCK).as_u64vec3();
        let extent = (self.extent * BLOCK).as_u64vec3();
        at.x + extent.x * (at.y + extent.y * at.z)
    }

    /// Copies the nodes `first..first + size` around `block`'s low corner into `tile` (x fastest); nodes not
    /// stored are 0. The range must stay within the block and its neighbours.
    pub(crate) fn load(&self, values: &NodeValues, block: IVec3, first: IVec3, size: i32, tile: &mut [f32]) {
        self.load_from(|slot| values.block(slot), block, first, size, tile);
    }

    /// [`Self::load`] of values that stand in `blocks`, by slot.
    pub(crate) fn load_from<'a>(
        &self,
        blocks: impl Fn(usize) -> Option<&'a [f32]>,
        block: IVec3,
        first: IVec3,
        size: i32,
        tile: &mut [f32],
    ) {
        tile.fill(0.0);
        let reach = |first: i32, d: i32| (first.max(BLOCK * d), (first + size).min(BLOCK * (d + 1)));
        for d in neighbours() {
            let ((x0, x1), (y0, y1), (z0, z1)) = (reach(first.x, d.x), reach(first.y, d.y), reach(first.z, d.z));
            if x0 >= x1 || y0 >= y1 || z0 >= z1 {
                continue;
            }
            let Some(source) = self.slot(block + d).and_then(&blocks) else { continue };
            for z in z0..z1 {
                for y in y0..y1 {
                    let from = ((x0 & 7) + BLOCK * ((y & 7) + BLOCK * (z & 7))) as usize;
                    let to = (x0 - first.x + size * (y - first.y + size * (z - first.z))) as usize;
                    let count = (x1 - x0) as usize;
                    tile[to..to + count].copy_from_slice(&source[from..from + count]);
                }
            }
        }
    }
}

/// A block and its 26 neighbours, as offsets, x fastest.
pub(crate) fn neighbours() -> impl Iterator<Item = IVec3> {
    (0..27).map(|i| IVec3::new(i % 3, i / 3 % 3, i / 9) - 1)
}

/// The entry of a block in a table of `extent` from `low`, if it is in there.
pub(crate) fn entry_of_block(low: IVec3, extent: IVec3, block: IVec3) -> Option<usize> {
    let at = block - low;
    if at.cmplt(IVec3::ZERO).any() || at.cmpge(extent).any() {
        return None;
    }
    let (at, extent) = (at.as_usizevec3(), extent.as_usizevec3());
    Some(at.x + extent.x * (at.y + extent.y * at.z))
}

/// The block of an entry.
pub(crate) fn block_of_entry(low: IVec3, extent: IVec3, entry: usize) -> IVec3 {
    let n = extent.as_usizevec3();
    low + IVec3::new((entry % n.x) as i32, (entry / n.x % n.y) as i32, (entry / (n.x * n.y)) as i32)
}

/// Values on the nodes of some of a grid's blocks; 0 elsewhere.
#[derive(Clone, Debug, Default)]
pub(crate) struct NodeValues {
    /// Slot of the grid -> chunk of `values`, or [`ABSENT`].
    chunks: Vec<u32>,
    /// Chunks of [`BLOCK_NODES`] values, x fastest.
    values: Vec<f32>,
}

impl NodeValues {
    /// Values for the slots for which `is_stored` holds, each block filled by `fill(slot, values)`; blocks
    /// are filled in parallel.
    pub(crate) fn new(
        slot_count: usize,
        is_stored: impl Fn(usize) -> bool + Sync,
        fill: impl Fn(usize, &mut [f32]) + Sync,
    ) -> Self {
        let stored: Vec<usize> = (0..slot_count).into_par_iter().filter(|&s| is_stored(s)).collect();
        let mut chunks = vec![ABSENT; slot_count];
        stored.iter().enumerate().for_each(|(chunk, &slot)| chunks[slot] = chunk as u32);
        let mut values = vec![0.0; stored.len() * BLOCK_NODES];
        values.par_chunks_mut(BLOCK_NODES).zip(&stored).for_each(|(out, &slot)| fill(slot, out));
        Self { chunks, values }
    }

    /// The values of a slot's block, if it has any.
    pub(crate) fn block(&self, slot: usize) -> Option<&[f32]> {
        let chunk = *self.chunks.get(slot)?;
        (chunk != ABSENT).then(|| &self.values[chunk as usize * BLOCK_NODES..][..BLOCK_NODES])
    }

    /// Whether the same blocks are stored, and no value is further than `by` from the other's.
    pub(crate) fn is_within(&self, other: &Self, by: f32) -> bool {
        let blocks = || self.values.par_chunks(BLOCK_NODES).zip(other.values.par_chunks(BLOCK_NODES));
        self.chunks == other.chunks && blocks().all(|(a, b)| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by))
    }

    /// Bytes of the values.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&self.values[..])
    }

    /// Whether no block has values.
    pub(crate) fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}
