//! Two-sided marching cubes: fields to a closed mesh in which every cut has two lips.
//!
//! The rules stand in [`super::labels`]: which cuts own a node, which bodies a cell has, which vertices an
//! edge. This is the virtual-node idea (Molino et al. 2004) on a grid, for any number of cuts, with one case
//! table and no rule beside it. Blocks are meshed in parallel; vertices on their common faces are then merged
//! by the number of their edge, so the mesh is the same for any number of threads.

use super::caps::FaceView;
use super::cells::{BlockTile, CellTile, Near, VARIANTS, position};
use super::field::{Field, SurfaceSettings};
use super::grid::BLOCK;
use super::labels::{CutMethod, Rules};
use super::mc_table::{EDGES, edge_axis, edge_between, face_corners, table};
use super::mesh::Mesh;
use crate::sim::frame::SurfaceSource;
use glam::IVec3;
use rayon::prelude::*;

/// The surface of the clay: closed and oriented, each body by itself, with two lips at each cut.
///
/// Lips of a cut coincide until the clay opens; [`separate`](super::stitch::separate) makes a manifold of it
/// for export. Memory is at most 6 KiB per block of 8^3 nodes near a particle, and twice as much again for
/// each cut that passes it, as much for each of several bodies near it.
pub fn extract(source: &SurfaceSource, settings: &SurfaceSettings) -> Mesh {
    let field = Field::of_particles(source, settings);
    extract_by(&field, settings.iso_threshold, &Rules::new(settings.method), settings.normals)
}

/// The surface `f = iso` of given fields, `iso` >= 0, without normals.
pub fn extract_field(field: &Field, iso: f32) -> Mesh {
    extract_by(field, iso, &Rules::new(CutMethod::TwoSided), false)
}

/// [`extract_field`] by any rules.
#[doc(hidden)]
pub fn extract_by(field: &Field, iso: f32, rules: &Rules, normals: bool) -> Mesh {
    let blocks = field.grid.blocks();
    let new = || (BlockTile::new(*rules, iso), vec![u16::MAX; BlockTile::PLACES]);
    let parts: Vec<BlockMesh> = blocks
        .par_iter()
        .map_init(new, |(tile, places), &block| {
            let mut mesh = BlockMesh::default();
            if tile.load(field, (block, IVec3::ZERO), &Near::new(field, block)) {
                Block { field, block, tile, places, normals, mesh: &mut mesh }.run();
            }
            mesh
        })
        .collect();
    merge(&parts, normals)
}

/// The surface in one block.
#[derive(Default)]
struct BlockMesh {
    /// Vertex positions \[m\].
    positions: Vec<[f32; 3]>,
    /// Outward unit normals, if asked for.
    normals: Vec<[f32; 3]>,
    /// Vertices that other blocks may have too: number of the edge and variant, the same in every block, and
    /// index.
    shared: Vec<(u64, u16)>,
    /// Indices into `positions`.
    triangles: Vec<[u16; 3]>,
    /// The places of the tile that have a vertex.
    used: Vec<usize>,
}

/// A block at work.
struct Block<'a> {
    field: &'a Field,
    block: IVec3,
    tile: &'a BlockTile,
    /// Vertex of each edge and variant of the tile, or `u16::MAX`. A block has 3 * 9^3 edges with 3 vertices
    /// each at most: far below 2^16.
    places: &'a mut [u16],
    normals: bool,
    mesh: &'a mut BlockMesh,
}

impl Block<'_> {
    fn run(mut self) {
        for cell in BlockTile::cells() {
            triangles(self.tile, cell, |corners| {
                let vertices = corners.map(|v| self.vertex(v));
                self.mesh.triangles.push(vertices);
            });
        }
        self.mesh.used.drain(..).for_each(|place| self.places[place] = u16::MAX);
    }

    fn vertex(&mut self, EdgeEnd { low, axis, keeps_low }: EdgeEnd) -> u16 {
        let variant = self.tile.variant(low, axis, keeps_low);
        let place = (low * 3 + axis) * VARIANTS + variant;
        if self.places[place] == u16::MAX {
            let index = self.mesh.positions.len() as u16;
            self.places[place] = index;
            self.mesh.used.push(place);
            let offset = BlockTile::node_offset(low);
            let node = self.block * BLOCK + offset;
            let is_on_face = |d: usize| d != axis && (offset[d] == 0 || offset[d] == BLOCK);
            if (0..3).any(is_on_face) {
                let number = (self.field.grid.node_number(node) * 3 + axis as u64) * VARIANTS as u64 + variant as u64;
                self.mesh.shared.push((number, index));
            }
            let t = self.tile.crossing(low, axis);
            self.mesh.positions.push(position(self.field, node, self.tile.point(low, axis, t)));
            if self.normals {
                let normal = self.tile.normal(low, axis, variant, t);
                self.mesh.normals.push(normal.try_normalize().unwrap_or(glam::Vec3::Y).to_array());
            }
        }
        self.places[place]
    }
}

/// The vertex on an edge that a body uses which keeps one end of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct EdgeEnd {
    /// The edge's low node in the tile.
    pub(super) low: usize,
    /// Along which axis the edge runs.
    pub(super) axis: usize,
    /// Whether the body keeps the low end.
    pub(super) keeps_low: bool,
}

/// The triangles of a cell: those of each of its bodies, and the caps between it and the next cells.
pub(super) fn triangles<const NODES: usize>(tile: &CellTile<NODES>, cell: usize, mut emit: impl FnMut([EdgeEnd; 3])) {
    if tile.is_plain() {
        body::<NODES>(cell, tile.case(cell), &mut emit);
    } else {
        tile.bodies(cell).for_each(|case| body::<NODES>(cell, case, &mut emit));
        (0..3).for_each(|axis| caps(tile, cell, axis, &mut emit));
    }
}

/// The triangles of one body of a cell.
fn body<const NODES: usize>(cell: usize, case: u8, emit: &mut impl FnMut([EdgeEnd; 3])) {
    for triangle in table()[usize::from(case)].triangles() {
        emit(triangle.map(|edge| {
            let end = EDGES[usize::from(edge)].0;
            EdgeEnd { low: CellTile::<NODES>::corner(cell, end), axis: edge_axis(edge), keeps_low: case >> end & 1 == 1 }
        }));
    }
}

/// The caps between a cell and the next one along an axis.
fn caps<const NODES: usize>(tile: &CellTile<NODES>, cell: usize, axis: usize, emit: &mut impl FnMut([EdgeEnd; 3])) {
    let across = cell + CellTile::<NODES>::STEPS[axis];
    if tile.is_whole(cell) && tile.is_whole(across) {
        return;
    }
    let corners = face_corners(axis, 1);
    let node = corners.map(|c| CellTile::<NODES>::corner(cell, c));
    // Low node and axis of the edge from corner i to the next.
    let edge = |i: usize| {
        let edge = edge_between(corners[i], corners[(i + 1) % 4]);
        (CellTile::<NODES>::corner(cell, EDGES[usize::from(edge)].0), edge_axis(edge))
    };
    // The same corners as the next cell has them.
    let behind = corners.map(|c| c & !(1 << axis));
    let parted = |c: usize, at: [u8; 4]| std::array::from_fn(|i| tile.are_parted(c, at[i], at[(i + 1) % 4]));
    let view = FaceView {
        inside: node.map(|n| tile.is_inside(n)),
        split: std::array::from_fn(|i| tile.is_split(edge(i).0, edge(i).1)),
        parted: [parted(cell, corners), parted(across, behind)],
    };
    for triangle in view.caps() {
        emit(triangle.map(|(i, keeps)| {
            let (low, axis) = edge(usize::from(i));
            EdgeEnd { low, axis, keeps_low: node[usize::from(keeps)] == low }
        }));
    }
}

/// One mesh of the blocks' meshes, vertices in the order of blocks.
fn merge(parts: &[BlockMesh], normals: bool) -> Mesh {
    let starts: Vec<usize> = parts
        .iter()
        .scan(0, |sum, p| {
            *sum += p.positions.len();
            Some(*sum - p.positions.len())
        })
        .collect();
    let count: usize = parts.iter().map(|p| p.positions.len()).sum();
    let mut shared: Vec<(u64, u32)> = Vec::with_capacity(parts.iter().map(|p| p.shared.len()).sum());
    for (part, start) in parts.iter().zip(&starts) {
        shared.extend(part.shared.iter().map(|&(number, i)| (number, (start + usize::from(i)) as u32)));
    }
    shared.par_sort_unstable();

    // Vertex -> the first one of the same number, which comes before it; then -> its index in the mesh.
    let mut merged: Vec<u32> = (0..count as u32).collect();
    for run in shared.chunk_by(|a, b| a.0 == b.0) {
        run.iter().for_each(|&(_, i)| merged[i as usize] = run[0].1);
    }
    let mut mesh = Mesh { normals: normals.then(Vec::new), ..Mesh::default() };
    for (part, &start) in parts.iter().zip(&starts) {
        for (i, position) in part.positions.iter().enumerate() {
            let first = merged[start + i] as usize;
            if first < start + i {
                merged[start + i] = merged[first];
                continue;
            }
            merged[start + i] = mesh.positions.len() as u32;
            mesh.positions.push(*position);
            if let Some(all) = &mut mesh.normals {
                all.push(part.normals[i]);
            }
        }
    }
    mesh.triangles.reserve(parts.iter().map(|p| p.triangles.len()).sum());
    for (part, start) in parts.iter().zip(starts) {
        mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| merged[start + usize::from(v)])));
    }
    mesh
}
