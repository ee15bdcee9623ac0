//! Buffers of one clay's surface, by what they hold, and what is bound where.

use super::layout::{BODIES_MAX, PAIRS_MAX, Params, Region, SHEETS_MAX, SurfaceStatus, Work, cell_words};
use super::wgsl::{SCAN_CHUNK, case_words};
use crate::sim::gpu::label::label;
use crate::sim::gpu::{GpuError, check};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// How much there is room for. What a run says there was no room for is in its status; a surface with more
/// room is made then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceRoom {
    /// Blocks of 8^3 nodes of the cell grid, at most 65,535.
    pub cell_blocks: u32,
    /// Blocks of 8^3 nodes of the visual grid, at most 65,535.
    pub blocks: u32,
    /// Cuts with clay on both sides, at most 64; those of each body by themselves.
    pub sheets: u32,
    /// Bodies near one block of the visual grid, where there are several in all, at most 256.
    pub bodies: u32,
    /// Values of single bodies, by block: as many as bodies are near each block that several are near.
    pub pages: u32,
}

impl SurfaceRoom {
    /// Room for compact clay of so many particles, 8 per cell, with up to 4 cuts, and a few bodies.
    pub fn for_particles(count: usize) -> Self {
        // A block holds 512 cells' clay, or 64 on the visual grid; thrice that for the blocks that the
        // surface passes.
        let cells = count / 8;
        let blocks = |cells_per_block: usize| (3 * cells / cells_per_block + 256).min(65_535) as u32;
        Self { cell_blocks: blocks(512), blocks: blocks(64), sheets: 4, bodies: 4, pages: 64 }
    }

    /// More room, where `status` asks for it.
    #[must_use]
    pub fn grown(self, status: &SurfaceStatus) -> Self {
        let more = |room: u32, needed: u32| if needed > room { (needed + needed / 4).min(65_535) } else { room };
        Self {
            cell_blocks: more(self.cell_blocks, status.slot_counts[0]),
            blocks: more(self.blocks, status.slot_counts[1]),
            bodies: self.bodies.max(status.bodies_wanted.min(BODIES_MAX)),
            pages: more(self.pages, status.page_count),
            sheets: self.sheets.max(status.sheet_count.min(SHEETS_MAX as u32)),
        }
    }
}

/// Which level's buffers a pass binds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Level {
    /// The cell grid.
    Cells = 0,
    /// The visual grid.
    Visual = 1,
}

/// All buffers but those of the mesh.
#[derive(Debug)]
pub(super) struct Buffers {
    pub params: [wgpu::Buffer; 2],
    pub status: wgpu::Buffer,
    pub tables: [wgpu::Buffer; 2],
    pub blocks: [wgpu::Buffer; 2],
    pub sums: [wgpu::Buffer; 2],
    pub fields: wgpu::Buffer,
    /// Workgroups as the passes count them, and the copy that dispatches read: no dispatch may read what its
    /// pass writes.
    pub dispatch: wgpu::Buffer,
    pub arguments: wgpu::Buffer,
    weights: wgpu::Buffer,
    pub kept: wgpu::Buffer,
    pub kept_blocks: wgpu::Buffer,
    pub cells: wgpu::Buffer,
    pub regions: wgpu::Buffer,
    pub work: wgpu::Buffer,
    pub changes: wgpu::Buffer,
    free: [wgpu::Buffer; 2],
    chunks: [wgpu::Buffer; 2],
    pub pairs: wgpu::Buffer,
    cases: wgpu::Buffer,
    /// Particles by cell of the cell grid; without grains next to nothing.
    pub occupancy: wgpu::Buffer,
    grains: wgpu::Buffer,
    kept_grains: wgpu::Buffer,
    grain_counts: wgpu::Buffer,
}

/// Bytes of a block, by plane: 4 a node.
const BLOCK_BYTES: u64 = 512 * 4;

impl Buffers {
    /// Those for so many particles and table entries of the two levels; for grains 20 bytes a particle more.
    ///
    /// # Errors
    /// A limit of the device.
    pub(super) fn new(
        device: &wgpu::Device,
        particles: u32,
        entries: [u32; 2],
        room: SurfaceRoom,
        has_grains: bool,
    ) -> Result<Self, GpuError> {
        let planes = u64::from(1 + 2 * room.sheets);
        let field_bytes = (u64::from(room.blocks) * planes + u64::from(room.pages)) * BLOCK_BYTES;
        let cell_bytes = 4 * u64::from(room.blocks) * u64::from(cell_words(room.bodies));
        let limits = device.limits();
        let most = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
        let fits = Some(format!("{} blocks of 8^3 nodes with {} cuts", most / (planes * BLOCK_BYTES), room.sheets));
        check("max_storage_buffer_binding_size", most, field_bytes.max(cell_bytes).max(4 * u64::from(entries[1])), fits)?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let make = |name: &str, bytes: u64, usage: wgpu::BufferUsages| {
            let label = label(&format!("surface {name}"));
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(&label),
                // No larger than asked for: passes go by the length of what is bound.
                size: bytes.max(4),
                usage,
                mapped_at_creation: false,
            })
        };
        let storage = |name: &str, bytes: u64| make(name, bytes, usage);
        let words = |count: u32| 4 * u64::from(count);
        let for_grains = |name: &str, bytes: u64| storage(name, if has_grains { bytes } else { 0 });
        // No slot has a block.
        let empty = |name: &str, slots: u32| {
            let (label, contents) = (label(&format!("surface {name}")), vec![u8::MAX; words(slots.max(1)) as usize]);
            device.create_buffer_init(&BufferInitDescriptor { label: Some(&label), contents: &contents, usage })
        };
        let slots = [room.cell_blocks, room.blocks];
        let uniform = || make("params", size_of::<Params>() as u64, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        Ok(Self {
            params: [uniform(), uniform()],
            status: storage("status", size_of::<SurfaceStatus>() as u64),
            tables: entries.map(|n| storage("table", words(n))),
            blocks: slots.map(|n| empty("blocks", n)),
            sums: [storage("densities", u64::from(room.cell_blocks) * BLOCK_BYTES), storage("sums", field_bytes)],
            fields: storage("fields", field_bytes),
            kept: storage("kept fields", field_bytes),
            kept_blocks: empty("kept blocks", room.blocks),
            dispatch: storage("dispatch", 96),
            arguments: make("arguments", 96, wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_DST),
            weights: storage("weights", words(particles)),
            cells: storage("cells", cell_bytes),
            regions: storage("regions", size_of::<Region>() as u64 * u64::from(room.blocks)),
            work: storage("work", size_of::<Work>() as u64 * u64::from(room.blocks)),
            changes: storage("changes", words(entries[1])),
            free: slots.map(|n| storage("free slots", words(n))),
            chunks: entries.map(|n| storage("chunk sums", words(n.div_ceil(SCAN_CHUNK)))),
            pairs: storage("pairs", words(2 * PAIRS_MAX)),
            occupancy: for_grains("occupancy", u64::from(room.cell_blocks) * BLOCK_BYTES),
            grains: for_grains("grains", words(particles)),
            kept_grains: for_grains("kept grains", 4 * words(particles.max(1))),
            grain_counts: for_grains("grain counts", words(particles.div_ceil(64))),
            cases: device.create_buffer_init(&BufferInitDescriptor {
                label: Some("bevy_clay:surface cases"),
                contents: bytemuck::cast_slice(&case_words()),
                usage: wgpu::BufferUsages::UNIFORM,
            }),
        })
    }

    /// The buffer of a binding; `None` for those of the particles and the mesh.
    pub(super) fn bound(&self, binding: u32, level: Level) -> Option<&wgpu::Buffer> {
        let level = level as usize;
        Some(match binding {
            0 => &self.params[level],
            1 => &self.status,
            3 => &self.tables[level],
            4 => &self.blocks[level],
            5 => &self.free[level],
            6 => &self.weights,
            7 => &self.sums[level],
            8 => &self.fields,
            9 => &self.cells,
            10 => &self.kept,
            11 => &self.kept_blocks,
            12 => &self.regions,
            15 => &self.cases,
            16 => &self.chunks[level],
            17 => &self.dispatch,
            18 => &self.pairs,
            19 => &self.grains,
            20 => &self.kept_grains,
            21 => &self.grain_counts,
            22 => &self.occupancy,
            23 => &self.work,
            24 => &self.changes,
            _ => return None,
        })
    }
}
