//! The tiles of tagged clay and their sums: of those about a cut a part alone holds anything.

use super::super::cut::ClassKey;
use super::kernel::{TILE, Tile};
use super::nodes::{CutBlock, Nodes, bits, local, node_masses, shared_range};
use super::simd::{Node, in_lanes};
use super::state::NEIGHBOURS;
use glam::IVec3;

/// Sums of the particles of one class in a block, as a [`Tile`] has them: of it, those rows along z that hold
/// anything, from the first layer across them that does to the last, one row after the other. A side of a cut
/// has some half of the nodes, and most of the time of a sum is that which its numbers take to come.
#[derive(Clone, Debug)]
pub(super) struct TaggedTile {
    pub key: ClassKey,
    reach: Reach,
    nodes: Vec<Node>,
}

/// Which rows along z hold anything, a bit each, and from which layer across them to before which.
#[derive(Clone, Copy, Debug)]
struct Reach {
    rows: u64,
    layers: (usize, usize),
}

impl TaggedTile {
    pub(super) const EMPTY: Self = Self { key: ClassKey::FIRST, reach: Reach { rows: 0, layers: (0, 0) }, nodes: vec![] };

    /// Takes what the tile `all` holds.
    pub(super) fn fill(&mut self, all: &Tile) {
        find_reach(&mut self.reach, all);
        let (first, end) = self.reach.layers;
        self.nodes.resize(self.reach.rows.count_ones() as usize * (end - first), Node::default());
        take_rows(&mut self.nodes, all, self.reach);
    }

    /// Adds what it has of the nodes of a block whose neighbour of this number it belongs to. Returns whether
    /// there was anything.
    pub(super) fn add_to(&self, nodes: &mut Nodes, neighbour: usize) -> bool {
        let Shared { rows, layers } = SHARED[neighbour];
        let (first, end) = (self.reach.layers.0.max(layers.0), self.reach.layers.1.min(layers.1));
        let is_any = self.reach.rows & rows != 0 && first < end;
        if is_any {
            add_rows(nodes, &self.nodes, self.reach, neighbour);
        }
        is_any
    }
}

in_lanes! {
    /// Where a tile has mass.
    fn find_reach(reach: &mut Reach, tile: &Tile) {
        let (mut rows, mut layers) = (0u64, [0u32; 8]);
        for row in 0..TILE * TILE {
            let mut any = 0;
            for z in 0..TILE {
                let mass = tile.0[8 * row + z].0[3].to_bits();
                any |= mass;
                layers[z] |= mass;
            }
            rows |= u64::from(any != 0) << row;
        }
        let (mut first, mut end) = (0, 0);
        for z in 0..TILE {
            if layers[z] != 0 {
                first = if end == 0 { z } else { first };
                end = z + 1;
            }
        }
        *reach = Reach { rows, layers: (first, end) };
    }
}

in_lanes! {
    /// Takes those rows of a tile that hold anything.
    fn take_rows(nodes: &mut [Node], all: &Tile, reach: Reach) {
        let ((first, end), mut rows) = (reach.layers, reach.rows);
        for nodes in nodes.chunks_exact_mut((end - first).max(1)) {
            let row = 8 * rows.trailing_zeros() as usize;
            rows &= rows.wrapping_sub(1);
            for (to, from) in nodes.iter_mut().zip(&all.0[row + first..row + end]) {
                for d in 0..8 {
                    to.0[d] = from.0[d];
                }
            }
        }
    }
}

/// Which of a tile's rows a block's neighbour of some number shares with it, and from which layer to before
/// which.
#[derive(Clone, Copy)]
struct Shared {
    rows: u64,
    layers: (usize, usize),
}

const SHARED: [Shared; 27] = {
    let mut all = [Shared { rows: 0, layers: (0, 0) }; 27];
    let mut n = 0;
    while n < 27 {
        let IVec3 { x, y, z } = NEIGHBOURS[n];
        let (x, y, z) = (shared_range(x), shared_range(y), shared_range(z));
        let mut k = 0;
        while k < 16 {
            let (i, j) = (k / 4, k % 4);
            if x.0 <= i && i < x.1 && y.0 <= j && j < y.1 {
                all[n].rows |= 1 << (Tile::at(i + x.2, j + y.2, 0) / 8);
            }
            k += 1;
        }
        all[n].layers = ((z.0 + z.2 + 1) as usize, (z.1 + z.2 + 1) as usize);
        n += 1;
    }
    all
};

/// Adds up, for each class of tagged clay in a block, the tiles of the 27 blocks around it, in their order.
pub(super) fn sum(cut: &mut CutBlock, tiles: &[TaggedTile]) {
    let sources = cut.sources.chunk_by(|a, b| a.class == b.class);
    for ((nodes, has), sources) in cut.nodes.iter_mut().zip(&mut cut.has).zip(sources) {
        if *has != 0 {
            *nodes = [Node::default(); 64];
        }
        let mut is_any = false;
        for source in sources {
            is_any |= tiles[source.tile as usize].add_to(nodes, source.neighbour.into());
        }
        *has = if is_any { bits(&node_masses(nodes)) } else { 0 };
        if is_any && *has == 0 {
            *nodes = [Node::default(); 64];
        }
    }
}

in_lanes! {
    /// Adds those rows of a tile that a block shares with the tile of this neighbour.
    fn add_rows(nodes: &mut Nodes, from: &[Node], reach: Reach, neighbour: usize) {
        let Shared { mut rows, layers } = SHARED[neighbour];
        rows &= reach.rows;
        let offset = NEIGHBOURS[neighbour];
        let [x, y, z] = [shared_range(offset.x).2, shared_range(offset.y).2, shared_range(offset.z).2];
        let (width, first) = (reach.layers.1 - reach.layers.0, reach.layers.0.max(layers.0));
        let count = reach.layers.1.min(layers.1) - first;
        while rows != 0 {
            let row = rows.trailing_zeros();
            rows &= rows - 1;
            let before = (reach.rows & ((1 << row) - 1)).count_ones() as usize;
            let at = before * width + first - reach.layers.0;
            let (i, j, k) = ((row / 7) as i32 - 1 - x, (row % 7) as i32 - 1 - y, first as i32 - 1 - z);
            let to = local(i, j, k);
            for (to, from) in nodes[to..to + count].iter_mut().zip(&from[at..at + count]) {
                for d in 0..8 {
                    to.0[d] += from.0[d];
                }
            }
        }
    }
}
