//! Two-sided marching cubes: fields to a closed mesh in which a cut has two lips.
//!
//! 1. A node is owned by the side that holds more than half of the clay around it; inside is where the clay of its own side is above
//!    the threshold.
//! 2. A cell with owners of both sides is *cut*, or *rim* if untouched clay reaches into it: the crack front passes there. Cut cells are
//!    emitted twice, each time with the nodes of one owner inside; all others once.
//! 3. The copies of a cut have vertices of their own on edges from side to side, except where a rim cell touches the edge: so the lips
//!    meet at the front. Between cut and rim cells the contours differ by small cycles, which are capped.
//!
//! This is the virtual-node idea (Molino et al. 2004) on a grid, with one case table and no rule beside it. Blocks are meshed in
//! parallel; vertices are then merged by the number of their edge, so the mesh is the same for any number of threads.

use super::caps::cap_cycles;
use super::cells::{CellClass, CellTile, Copy, PLACES, VARIANTS, corner};
use super::field::{Field, SurfaceSettings};
use super::mc_table::{EDGES, edge_axis, table};
use super::mesh::Mesh;
use crate::sim::engine::SurfaceSource;
use glam::IVec3;
use rayon::prelude::*;

/// The surface of the clay: closed and oriented, one cut sheet.
///
/// Lips of a cut coincide until the clay opens; [`separate`](super::weld::separate) makes a manifold of it for export. Memory is at
/// most 6 KiB per block of 8^3 nodes near a particle.
pub fn extract(source: &SurfaceSource, settings: &SurfaceSettings) -> Mesh {
    let mut mesh = extract_field(&Field::of_particles(source, settings), settings.iso_threshold);
    if settings.normals {
        mesh.compute_normals();
    }
    mesh
}

/// The surface `f = iso` of given fields, `iso` >= 0, without normals.
pub fn extract_field(field: &Field, iso: f32) -> Mesh {
    let blocks = field.grid.blocks();
    let parts: Vec<BlockMesh> = blocks
        .par_iter()
        .map_init(
            || (CellTile::new(iso), vec![u16::MAX; PLACES]),
            |(tile, places), &block| mesh_block(field, block, tile, places),
        )
        .collect();
    let (mut mesh, at_cut) = merge(&parts);
    if at_cut.iter().any(|&c| c) {
        cap_cycles(&mut mesh, &at_cut);
    }
    mesh
}

/// The surface in one block.
#[derive(Default)]
struct BlockMesh {
    /// Number of the edge and copy, the same in every block, and position [m].
    vertices: Vec<(u64, [f32; 3])>,
    /// Indices into `vertices`.
    triangles: Vec<[u16; 3]>,
    /// Whether the triangle is of a cut or rim cell; empty if none is.
    at_cut: Vec<bool>,
}

fn mesh_block(field: &Field, block: IVec3, tile: &mut CellTile, places: &mut [u16]) -> BlockMesh {
    let mut mesh = BlockMesh::default();
    if !tile.load(field, block) {
        return mesh;
    }
    let mut used = Vec::new();
    let mut has_cut = false;
    for cell in CellTile::cells() {
        let class = tile.class(cell);
        let copies: &[Copy] = if class == CellClass::Cut { &[Copy::Front, Copy::Back] } else { &[Copy::Single] };
        has_cut |= class != CellClass::Whole;
        for &copy in copies {
            for triangle in table()[usize::from(tile.case(cell, copy))].triangles() {
                let vertices = triangle.map(|edge| {
                    let (low, axis) = (corner(cell, EDGES[usize::from(edge)].0), edge_axis(edge));
                    let variant = tile.variant(low, axis, copy);
                    let place = (low * 3 + axis) * VARIANTS + variant;
                    if places[place] == u16::MAX {
                        // A block has 3 * 9^3 edges with 2 vertices each at most: far below 2^16.
                        places[place] = mesh.vertices.len() as u16;
                        used.push(place);
                        let node = block * super::grid::BLOCK + CellTile::node_offset(low);
                        let number = (field.grid.node_number(node) * 3 + axis as u64) * VARIANTS as u64 + variant as u64;
                        let position = CellTile::position(field, node, axis, tile.crossing(low, axis, variant));
                        mesh.vertices.push((number, position));
                    }
                    places[place]
                });
                mesh.triangles.push(vertices);
                mesh.at_cut.push(class != CellClass::Whole);
            }
        }
    }
    used.into_iter().for_each(|place| places[place] = u16::MAX);
    if !has_cut {
        mesh.at_cut.clear();
    }
    mesh
}

/// One mesh of the blocks' meshes, vertices in the order of their numbers, and which of its triangles are at a cut.
fn merge(parts: &[BlockMesh]) -> (Mesh, Vec<bool>) {
    let starts: Vec<usize> = parts
        .iter()
        .scan(0, |sum, p| {
            *sum += p.vertices.len();
            Some(*sum - p.vertices.len())
        })
        .collect();
    let count = parts.iter().map(|p| p.vertices.len()).sum();
    let mut numbers: Vec<(u64, u32)> = Vec::with_capacity(count);
    parts.iter().flat_map(|p| &p.vertices).for_each(|v| numbers.push((v.0, numbers.len() as u32)));
    numbers.par_sort_unstable();

    let all: Vec<[f32; 3]> = parts.iter().flat_map(|p| p.vertices.iter().map(|v| v.1)).collect();
    let mut merged = vec![0u32; count];
    let mut positions = Vec::with_capacity(count);
    for run in numbers.chunk_by(|a, b| a.0 == b.0) {
        run.iter().for_each(|&(_, i)| merged[i as usize] = positions.len() as u32);
        positions.push(all[run[0].1 as usize]);
    }
    let (mut triangles, mut at_cut) = (Vec::new(), Vec::new());
    for (part, start) in parts.iter().zip(starts) {
        triangles.extend(part.triangles.iter().map(|t| t.map(|v| merged[start + usize::from(v)])));
        at_cut.extend(&part.at_cut);
        at_cut.resize(triangles.len(), false);
    }
    (Mesh::new(positions, triangles), at_cut)
}
