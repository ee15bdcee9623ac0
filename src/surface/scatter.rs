//! Particles to node sums and back, with quadratic B-splines of one node spacing.
//!
//! Particles are sorted into the blocks of their stencils' first nodes, each block sums its own particles
//! into a tile that reaches two nodes beyond it, and each stored block adds up the at most eight tiles that
//! reach into it. Every sum has one order, whatever the number of threads.

use super::grid::{BLOCK, BLOCK_NODES, BlockGrid, NodeValues, block_of_entry, entry_of_block, neighbours};
use glam::{IVec3, Vec3};
use rayon::prelude::*;

/// Nodes along an edge of a tile: a block and the two nodes that stencils reach beyond it.
const TILE: i32 = BLOCK + 2;
const TILE_NODES: usize = (TILE * TILE * TILE) as usize;

/// Particles sorted by the block that holds the first node of their stencil.
pub(crate) struct Bins {
    /// Particle numbers, by block, within a block in the order given.
    order: Vec<u32>,
    /// Each block in use with its part of `order`, in the grid's order.
    occupied: Vec<(IVec3, std::ops::Range<usize>)>,
    /// Particle -> position in node spacings, relative to the node lattice.
    points: Vec<Vec3>,
    /// The blocks in use and those that `margin` reaches.
    pub(crate) grid: BlockGrid,
}

/// Some of the particles, sorted by block.
#[derive(Default)]
pub(crate) struct Part {
    order: Vec<u32>,
    /// Each block with particles of the part, by its number among those in use, and which they are.
    bins: Vec<(u32, std::ops::Range<usize>)>,
}

impl Part {
    /// Adds a particle of a block; blocks come in their order.
    pub(crate) fn push(&mut self, bin: u32, particle: u32) {
        let end = self.order.len();
        match self.bins.last_mut() {
            Some((last, range)) if *last == bin => range.end += 1,
            _ => self.bins.push((bin, end..end + 1)),
        }
        self.order.push(particle);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Its particles in each bin.
    pub(crate) fn bins(&self) -> impl Iterator<Item = (u32, &[u32])> {
        self.bins.iter().map(|(bin, range)| (*bin, &self.order[range.clone()]))
    }

    /// Those in bins for which `is_kept` holds.
    pub(crate) fn within(&self, is_kept: impl Fn(u32) -> bool) -> Self {
        let mut part = Self::default();
        for (bin, particles) in self.bins().filter(|(bin, _)| is_kept(*bin)) {
            particles.iter().for_each(|p| part.push(bin, *p));
        }
        part
    }
}

/// First node of the stencil of a particle: floor(point - 1/2), for points from -1/2 on. Truncation instead
/// of `floor`, which is a call on baseline x86-64 and took an eighth of the time.
fn stencil_base(point: Vec3) -> IVec3 {
    (point + 0.5).as_ivec3() - 1
}

/// Quadratic B-spline weights of the three nodes of the stencil, per axis.
fn stencil_weights(point: Vec3, base: IVec3) -> [Vec3; 3] {
    let f = point - base.as_vec3();
    [0.5 * (1.5 - f) * (1.5 - f), 0.75 - (f - 1.0) * (f - 1.0), 0.5 * (f - 0.5) * (f - 0.5)]
}

impl Bins {
    /// Sorts the particles at `points`, in units of the node spacing from node 0, all at -1/2 or more; points
    /// that are not finite are left out. Nodes from `margin.0` below a stencil's first node to `margin.1`
    /// above it are in blocks of the grid.
    pub(crate) fn new(points: Vec<Vec3>, margin: (i32, i32)) -> Self {
        let blocks: Vec<Option<IVec3>> =
            points.par_iter().map(|p| p.is_finite().then(|| stencil_base(*p).map(|i| i.div_euclid(BLOCK)))).collect();
        let mut bounds = blocks.iter().flatten().copied();
        let first = bounds.next().unwrap_or_default();
        let (low, high) = bounds.fold((first, first), |(low, high), b| (low.min(b), high.max(b)));
        let (low, extent) = (low - 1, high - low + 3);

        let entry = |b: &IVec3| entry_of_block(low, extent, *b).unwrap_or_default();
        let mut starts = vec![0u32; extent.as_usizevec3().element_product() + 1];
        blocks.iter().flatten().for_each(|b| starts[entry(b) + 1] += 1);
        let mut occupied = Vec::new();
        for e in 1..starts.len() {
            let (start, count) = (starts[e - 1], starts[e]);
            if count > 0 {
                occupied.push((block_of_entry(low, extent, e - 1), start as usize..(start + count) as usize));
            }
            starts[e] += start;
        }
        let mut order = vec![0u32; occupied.last().map_or(0, |o| o.1.end)];
        for (i, block) in blocks.iter().enumerate() {
            if let Some(b) = block {
                let next = &mut starts[entry(b)];
                order[*next as usize] = i as u32;
                *next += 1;
            }
        }
        let grid = grid_with_margin((low, extent), &occupied, &order, &points, margin);
        Self { order, occupied, points, grid }
    }

    /// The particles of one block.
    fn particles(&self, index: usize) -> &[u32] {
        &self.order[self.occupied[index].1.clone()]
    }

    /// Every particle with the number of its block among those in use.
    pub(crate) fn particles_by_bin(&self) -> impl Iterator<Item = (u32, &u32)> {
        (0..self.occupied.len()).flat_map(|bin| self.particles(bin).iter().map(move |p| (bin as u32, p)))
    }

    /// The block of a bin.
    pub(crate) fn block_of_bin(&self, bin: u32) -> IVec3 {
        self.occupied[bin as usize].0
    }

    /// The blocks, first and last, that `margin` reaches about some particles of a bin.
    pub(crate) fn reach(&self, particles: &[u32], margin: (i32, i32)) -> (IVec3, IVec3) {
        reach(particles, &self.points, margin)
    }

    /// All particles.
    pub(crate) fn whole(&self) -> Part {
        Part { order: self.order.clone(), bins: self.occupied.iter().enumerate().map(|(i, o)| (i as u32, o.1.clone())).collect() }
    }

    /// Sums the particles' weights times their B-splines, at the nodes of the grid.
    pub(crate) fn scatter(&self, part: &Part, weights: &[f32]) -> NodeValues {
        let in_use = &part.bins;
        let mut tiles = vec![0.0f32; in_use.len() * TILE_NODES];
        tiles.par_chunks_mut(TILE_NODES).zip(in_use).for_each(|(tile, (bin, range))| {
            let origin = self.occupied[*bin as usize].0 * BLOCK;
            for &p in &part.order[range.clone()] {
                add_particle(tile, self.points[p as usize], origin, weights[p as usize]);
            }
        });
        let mut tile_of = vec![None; self.grid.blocks().len()];
        for (tile, (bin, _)) in tiles.chunks(TILE_NODES).zip(in_use) {
            if let Some(slot) = self.grid.slot(self.occupied[*bin as usize].0) {
                tile_of[slot] = Some(tile);
            }
        }
        // A tile reaches into its own block and into those above it.
        let sources = |slot: usize| {
            let block = self.grid.blocks()[slot];
            let below = neighbours().filter(|d| d.max_element() <= 0);
            below.filter_map(move |d| Some((d, self.grid.slot(block + d)?)))
        };
        NodeValues::new(
            tile_of.len(),
            |slot| sources(slot).any(|(_, s)| tile_of[s].is_some()),
            |slot, out| {
                for (d, source) in sources(slot) {
                    if let Some(tile) = tile_of[source] {
                        add_tile(out, tile, d);
                    }
                }
            },
        )
    }

    /// Sums of the node values at each particle's stencil; 0 for particles left out.
    pub(crate) fn gather(&self, values: &NodeValues) -> Vec<f32> {
        let sums: Vec<Vec<f32>> = (0..self.occupied.len())
            .into_par_iter()
            .map(|i| {
                let block = self.occupied[i].0;
                let mut tile = [0.0; TILE_NODES];
                self.grid.load(values, block, IVec3::ZERO, TILE, &mut tile);
                let sum = |&p: &u32| gather_particle(&tile, self.points[p as usize], block * BLOCK);
                self.particles(i).iter().map(sum).collect()
            })
            .collect();
        let mut out = vec![0.0; self.points.len()];
        for (i, sums) in sums.iter().enumerate() {
            self.particles(i).iter().zip(sums).for_each(|(&p, &s)| out[p as usize] = s);
        }
        out
    }
}

/// The blocks, first and last, that `margin` reaches about the stencils' first nodes.
fn reach(particles: &[u32], points: &[Vec3], margin: (i32, i32)) -> (IVec3, IVec3) {
    let bases = particles.iter().map(|&p| stencil_base(points[p as usize]));
    let (first, last) = bases.fold((IVec3::MAX, IVec3::MIN), |(a, b), n| (a.min(n), b.max(n)));
    ((first - margin.0).map(|i| i.div_euclid(BLOCK)), (last + margin.1).map(|i| i.div_euclid(BLOCK)))
}

/// The blocks within `margin` of the stencils' first nodes.
fn grid_with_margin(
    (low, extent): (IVec3, IVec3),
    occupied: &[(IVec3, std::ops::Range<usize>)],
    order: &[u32],
    points: &[Vec3],
    margin: (i32, i32),
) -> BlockGrid {
    let reaches: Vec<(IVec3, IVec3)> =
        occupied.par_iter().map(|(_, range)| reach(&order[range.clone()], points, margin)).collect();
    let mut is_stored = vec![false; extent.as_usizevec3().element_product()];
    for (first, last) in reaches {
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                for x in first.x..=last.x {
                    if let Some(entry) = entry_of_block(low, extent, IVec3::new(x, y, z)) {
                        is_stored[entry] = true;
                    }
                }
            }
        }
    }
    BlockGrid::new(low, extent, |entry| is_stored[entry])
}

fn tile_index(node: IVec3) -> usize {
    (node.x + TILE * (node.y + TILE * node.z)) as usize
}

fn add_particle(tile: &mut [f32], point: Vec3, origin: IVec3, weight: f32) {
    let base = stencil_base(point);
    let w = stencil_weights(point, base);
    let first = tile_index(base - origin);
    for (z, wz) in w.iter().enumerate() {
        for (y, wy) in w.iter().enumerate() {
            let wyz = weight * wz.z * wy.y;
            let row = first + TILE as usize * (y + TILE as usize * z);
            for (node, wx) in tile[row..row + 3].iter_mut().zip(&w) {
                *node += wyz * wx.x;
            }
        }
    }
}

fn gather_particle(tile: &[f32], point: Vec3, origin: IVec3) -> f32 {
    let base = stencil_base(point);
    let w = stencil_weights(point, base);
    let first = tile_index(base - origin);
    let mut sum = 0.0;
    for (z, wz) in w.iter().enumerate() {
        for (y, wy) in w.iter().enumerate() {
            let row = first + TILE as usize * (y + TILE as usize * z);
            let along_x: f32 = tile[row..row + 3].iter().zip(&w).map(|(node, wx)| node * wx.x).sum();
            sum += wz.z * wy.y * along_x;
        }
    }
    sum
}

/// Adds the part of the tile of the block at offset `d` (-1 or 0 per axis) that lies in this block.
fn add_tile(out: &mut [f32], tile: &[f32], d: IVec3) {
    debug_assert_eq!(out.len(), BLOCK_NODES);
    let count = d.map(|i| if i < 0 { TILE - BLOCK } else { BLOCK });
    for z in 0..count.z {
        for y in 0..count.y {
            let from = tile_index(IVec3::new(0, y, z) - d * BLOCK);
            let to = (BLOCK * (y + BLOCK * z)) as usize;
            let n = count.x as usize;
            out[to..to + n].iter_mut().zip(&tile[from..from + n]).for_each(|(o, t)| *o += t);
        }
    }
}
