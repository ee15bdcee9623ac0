//! The structs that host and device share.

use super::super::balls::Ball;
use super::super::closure::CLOSURE_CELLS;
use crate::sim::gpu::layout::twins;

/// Words of a vertex.
pub const VERTEX_WORDS: u32 = 7;

/// Most cuts with fields of their own.
pub(super) const SHEETS_MAX: usize = 64;
/// Most cuts, those of each body by themselves, with clay on one side or both.
pub(super) const PAIRS_MAX: u32 = 1024;
/// Most bodies near one block.
pub(super) const BODIES_MAX: u32 = 256;

/// Words of a block's cells, its 512 nodes' sections first: labels, own values, bodies of cells, bodies, k.
/// Then what stands at faces, by cells of 2^3 nodes; then the list of the bodies near.
pub(super) const CLOSURE_FIRST: u32 = 5 * 512;
pub(super) const LIST_FIRST: u32 = CLOSURE_FIRST + CLOSURE_CELLS as u32;

/// Words of a block's cells with room for so many bodies near it.
pub(super) fn cell_words(bodies: u32) -> u32 {
    LIST_FIRST + 2 + 2 * bodies
}

/// Bits of [`SurfaceStatus::flags`].
pub mod flag {
    /// More blocks of nodes than there is room for.
    pub const BLOCKS_FULL: u32 = 1;
    /// More cuts than there is room for.
    pub const SHEETS_FULL: u32 = 2;
    /// More vertices or indices than there is room for.
    pub const MESH_FULL: u32 = 4;
    /// More bodies near one block, or more values of bodies, than there is room for.
    pub const BODIES_FULL: u32 = 8;
}

twins! {
    /// What the passes know of one level's lattice, of the room and of the settings.
    pub(super) Params = "Params" {
        /// of 8^3 nodes along each axis, the first one at -1
        pub blocks: [i32; 3] = "vec3i",
        /// particles
        pub particle_count: u32 = "u32",
        /// greatest place of a particle \[cells\]
        pub usable: [f32; 3] = "vec3f",
        /// of visual nodes \[m\]
        pub spacing: f32 = "f32",
        /// of visual node 0 \[m\]
        pub origin: [f32; 3] = "vec3f",
        /// threshold
        pub iso: f32 = "f32",
        /// nodes per cell
        pub scale: f32 = "f32",
        /// of this level's lattice \[nodes\]
        pub shift: f32 = "f32",
        /// nodes in stored blocks before the first node of a stencil
        pub reach_low: i32 = "i32",
        /// and behind it
        pub reach_high: i32 = "i32",
        /// of Equation 9
        pub density_exponent: f32 = "f32",
        /// visual node i is sum_k taps[k] raw[i + first + k], along each axis
        pub first: i32 = "i32",
        /// taps
        pub tap_count: u32 = "u32",
        /// blocks that there is room for
        pub slot_capacity: u32 = "u32",
        /// of the filter
        pub taps: [f32; 8] = "array<vec4f, 2>",
        /// sheets with room for their fields
        pub sheet_capacity: u32 = "u32",
        /// where vertices begin in what is bound of their buffer \[words\]
        pub vertex_start: u32 = "u32",
        /// vertices that there is room for
        pub vertex_capacity: u32 = "u32",
        /// where indices begin in what is bound of their buffer \[words\]
        pub index_start: u32 = "u32",
        /// indices that there is room for
        pub index_capacity: u32 = "u32",
        /// whether to extract whatever has changed or not
        pub is_forced: u32 = "u32",
        /// 0 cell grid, 1 visual grid
        pub level: u32 = "u32",
        /// 0 two lips, 1 Equation 9
        pub method: u32 = "u32",
        /// whether particles that the surface does not show are drawn as balls
        pub has_grains: u32 = "u32",
        /// \[m\]
        pub cell_width: f32 = "f32",
        /// bodies near a block that there is room for
        pub body_capacity: u32 = "u32",
        /// blocks' values of single bodies that there is room for
        pub page_capacity: u32 = "u32",
    }
}

twins! {
    /// A block's part of the mesh, by slot; kept.
    pub(super) Region = "Region" {
        /// vertex and triangle
        pub first: [u32; 2] = "vec2u",
        /// vertices and triangles
        pub room: [u32; 2] = "vec2u",
        /// of them in use
        pub count: [u32; 2] = "vec2u",
        /// first and number of triangles where it was before, which are to be emptied
        pub left: [u32; 2] = "vec2u",
    }
}

twins! {
    /// A block to be extracted.
    pub(super) Work = "Work" {
        /// where its nodes are
        pub slot: u32 = "u32",
        /// in the table
        pub entry: u32 = "u32",
        /// whether it had zeros before, and whether it takes this run's values
        pub values: u32 = "u32",
    }
}

twins! {
    /// What the last run of the passes says. Counts are of that run, or, where they are marked kept, of the
    /// last extraction.
    pub SurfaceStatus = "Status" {
        /// What there was no room for, as bits: see [`flag`]. The mesh is then the one before.
        pub flags: u32 = "atomic<u32>",
        /// Blocks of 8^3 nodes in use, or needed: of the cell grid, of the visual grid.
        pub slot_counts: [u32; 2] = "array<u32, 2>",
        /// Cuts with clay on both sides.
        pub sheet_count: u32 = "u32",
        /// 1 if anything was extracted.
        pub is_changed: u32 = "atomic<u32>",
        /// Whether not all particles are of the first one's body.
        pub(super) has_others: u32 = "atomic<u32>",
        /// The same, once there is room for what follows from it.
        pub(super) has_bodies: u32 = "u32",
        /// Most bodies near a block that several are near.
        pub(super) body_most: u32 = "u32",
        /// Blocks' values of single bodies.
        pub(super) page_count: u32 = "u32",
        /// Bodies near a block for which room is wanted, where there was none.
        pub(super) bodies_wanted: u32 = "atomic<u32>",
        /// Whether other bodies are near a block than before, or their values stand elsewhere.
        pub(super) is_relisted: u32 = "u32",
        /// Vertices of the last extraction, with those between the regions of blocks. Kept.
        pub vertex_count: u32 = "u32",
        /// Indices of the last extraction, with those of triangles without size. Kept.
        pub index_count: u32 = "u32",
        /// Kept, of the extraction before.
        pub(super) index_count_before: u32 = "u32",
        /// Kept: slots up to the last one in use.
        pub(super) kept_slots: u32 = "u32",
        /// Kept: cuts.
        pub(super) kept_sheets: u32 = "u32",
        /// Kept: whether there were several bodies.
        pub(super) kept_bodies: u32 = "u32",
        /// Extractions so far. Kept.
        pub extraction_count: u32 = "u32",
        /// Particles that the surface does not show.
        pub(super) found_grains: u32 = "u32",
        /// The cuts with fields, in order: number of the body << 8 | number of the sheet.
        pub(super) sheets: [u32; SHEETS_MAX] = "array<u32, SHEETS_MAX>",
        /// Balls of the last extraction, for particles that the surface does not show; their vertices and
        /// indices are the last ones. Kept.
        pub grain_count: u32 = "u32",
        /// Slots up to the last one in use, by level.
        pub(super) slot_limits: [u32; 2] = "array<u32, 2>",
        /// Slots for new blocks, by level.
        pub(super) free_counts: [u32; 2] = "array<u32, 2>",
        /// Visual slots in use now or at the last extraction.
        pub(super) slot_span: u32 = "u32",
        /// Whether every block is extracted: 1, or ANEW where what stands in the mesh is not known.
        pub(super) is_all: u32 = "u32",
        /// Kept: whether the mesh is not the last run's, which found no room.
        pub(super) is_stale: u32 = "u32",
        /// Blocks that the last extraction went through: those with other values, those that see them, those
        /// that are gone. Kept.
        pub block_count: u32 = "u32",
        /// Kept: vertices and triangles up to the end of the blocks' regions.
        pub(super) mesh_end: [u32; 2] = "vec2u",
        /// Vertices and triangles for which the last extraction wants room: without so much, all blocks are
        /// written anew more often. Kept.
        pub wanted: [u32; 2] = "vec2u",
        /// Vertices and triangles that the last extraction has, and must have room for. Kept.
        pub least: [u32; 2] = "vec2u",
    }
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
