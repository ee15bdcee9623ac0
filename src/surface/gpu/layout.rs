//! Rust twins of the WGSL structs.

use super::super::balls::Ball;
use bytemuck::{Pod, Zeroable};

/// Words of a vertex.
pub const VERTEX_WORDS: u32 = 7;

/// Most cuts with fields of their own.
pub(super) const SHEETS_MAX: usize = 64;

/// Bits of [`SurfaceStatus::flags`].
pub mod flag {
    /// More blocks of nodes than there is room for.
    pub const BLOCKS_FULL: u32 = 1;
    /// More cuts than there is room for.
    pub const SHEETS_FULL: u32 = 2;
    /// More vertices or indices than there is room for.
    pub const MESH_FULL: u32 = 4;
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Params {
    pub blocks: [i32; 3],
    pub particle_count: u32,
    pub usable: [f32; 3],
    pub spacing: f32,
    pub origin: [f32; 3],
    pub iso: f32,
    pub scale: f32,
    pub shift: f32,
    pub reach_low: i32,
    pub reach_high: i32,
    pub density_exponent: f32,
    pub first: i32,
    pub tap_count: u32,
    pub slot_capacity: u32,
    pub taps: [f32; 8],
    pub sheet_capacity: u32,
    pub vertex_first: u32,
    pub vertex_capacity: u32,
    pub index_first: u32,
    pub index_capacity: u32,
    pub is_forced: u32,
    pub level: u32,
    pub method: u32,
    pub has_grains: u32,
    pub cell_width: f32,
    pub spare: [u32; 2],
}

/// A block's part of the mesh.
pub(super) const REGION_BYTES: u64 = 32;
/// A block to be extracted.
pub(super) const WORK_BYTES: u64 = 12;

/// What the last run of the passes says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceStatus {
    /// What there was no room for, as bits: see [`flag`]. The mesh is then the one before.
    pub flags: u32,
    /// Blocks of 8^3 nodes in use: of the cell grid, of the visual grid.
    pub slot_counts: [u32; 2],
    /// Cuts with clay on both sides.
    pub sheet_count: u32,
    /// 1 if anything was extracted.
    pub is_changed: u32,
    /// Vertices of the last extraction, with those between the regions of blocks.
    pub vertex_count: u32,
    /// Indices of the last extraction, with those of triangles without size.
    pub index_count: u32,
    pub(super) index_count_before: u32,
    pub(super) kept_slots: u32,
    pub(super) kept_sheets: u32,
    /// Extractions so far.
    pub extraction_count: u32,
    pub(super) found_grains: u32,
    pub(super) sides: [u32; 16],
    pub(super) sheets: [u32; SHEETS_MAX],
    /// Balls of the last extraction, for particles that the surface does not show; their vertices and indices
    /// are the last ones.
    pub grain_count: u32,
    pub(super) slot_limits: [u32; 2],
    pub(super) free_counts: [u32; 2],
    pub(super) slot_span: u32,
    pub(super) is_all: u32,
    pub(super) is_stale: u32,
    pub(super) mesh_end: [u32; 2],
    /// Vertices and triangles for which the last extraction wants room: without so much, all blocks are
    /// written anew more often.
    pub wanted: [u32; 2],
    /// Vertices and triangles that the last extraction has, and must have room for.
    pub least: [u32; 2],
    /// Blocks that the last extraction went through: those with other values, those that see them, those that
    /// are gone.
    pub block_count: u32,
    pub(super) spare: u32,
}

impl SurfaceStatus {
    /// The status in the bytes of [`super::GpuSurface::status_buffer`].
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        bytes.get(..size_of::<Self>()).map(bytemuck::pod_read_unaligned)
    }

    /// Vertices and indices of the balls, which are the last ones of the mesh.
    pub fn ball_counts(&self) -> (u32, u32) {
        let (vertices, triangles) = Ball::for_count(self.grain_count as usize).counts();
        (self.grain_count * vertices as u32, 3 * self.grain_count * triangles as u32)
    }
}
