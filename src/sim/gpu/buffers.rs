//! Buffers by lifetime: of the clay (particles, table), and of the frame (nodes; grow-only).

use super::super::params::{BLOCK, Domain};
use super::device::{self, GpuError};
use super::label::label;
use super::layout::{FIELDS, Status, Total};
use super::params::Params;
use super::pass::Id;
use super::tool::GpuTool;
use super::wgsl::{SCAN_CHUNK, WORKGROUP, cut_words};
use crate::sim::frame::SurfaceParticle;
use crate::sim::snapshot::Particle;
use glam::IVec3;
use std::collections::HashSet;

/// Substeps in one submission: the tools' poses for them are uploaded at once.
pub(super) const SUBMISSION_STEPS: u32 = 1024;

const STORAGE: wgpu::BufferUsages =
    wgpu::BufferUsages::STORAGE.union(wgpu::BufferUsages::COPY_DST).union(wgpu::BufferUsages::COPY_SRC);

/// A prefix sum: what is summed, the sums before each, and those of its chunks.
#[derive(Debug)]
struct Scan {
    source: wgpu::Buffer,
    prefix: wgpu::Buffer,
    chunks: wgpu::Buffer,
}

/// Which of the doubled buffers a pass binds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Variant {
    /// The state that is read: 0 or 1.
    pub state: usize,
    /// The records that the frame started from: 0 or 1.
    pub source: usize,
    /// Whether `source` and `prefix` are those of cells, not of the table.
    pub cells: bool,
}

/// What the sizes depend on besides the clay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NodeSize {
    pub slots: u32,
    pub classes: u32,
    pub tools: u32,
}

/// All buffers of one clay.
#[derive(Debug)]
pub(super) struct Buffers {
    pub particle_count: u32,
    pub table_len: u32,
    pub size: NodeSize,
    pub params: wgpu::Buffer,
    pub status: wgpu::Buffer,
    pub records: [wgpu::Buffer; 2],
    pub totals: wgpu::Buffer,
    pub surface: wgpu::Buffer,
    pub table: wgpu::Buffer,
    pub counts: wgpu::Buffer,
    pub sums: wgpu::Buffer,
    pub velocities: wgpu::Buffer,
    pub impulses: wgpu::Buffer,
    pub masses: wgpu::Buffer,
    pub tools: wgpu::Buffer,
    state: [wgpu::Buffer; 2],
    keys: wgpu::Buffer,
    list: wgpu::Buffer,
    pub blocks: wgpu::Buffer,
    pub cuts: wgpu::Buffer,
    scans: [Scan; 2],
}

/// Words -> bytes.
fn words(count: u32) -> u64 {
    4 * u64::from(count)
}

/// Number of workgroups for `count` invocations.
pub(super) fn groups(count: u32) -> u32 {
    count.div_ceil(WORKGROUP)
}

fn record_bytes(particles: u32) -> u64 {
    u64::from(particles) * size_of::<Particle>() as u64
}

/// Bytes of the largest buffer of particles: their state.
fn state_bytes(particles: u32) -> u64 {
    u64::from(particles) * u64::from(FIELDS) * 16
}

const _: () = assert!(FIELDS as usize * 16 >= size_of::<Particle>(), "the state is larger than the records");

/// Two times 16 bytes for every node and class.
fn node_bytes(size: NodeSize) -> u64 {
    u64::from(size.slots) * u64::from(size.classes) * 64 * 32
}

/// Bytes of each block's classes, of their masses at its nodes, and of how they face each other there.
fn cut_bytes(size: NodeSize) -> u64 {
    u64::from(size.slots) * words(cut_words(size.classes))
}

/// Bytes of the tools' poses in one submission.
fn tool_bytes(tools: u32) -> u64 {
    u64::from(tools.max(1) * SUBMISSION_STEPS) * size_of::<GpuTool>() as u64
}

/// Checks the device's limits for a clay.
///
/// # Errors
/// The limit, and the largest clay that fits.
pub(super) fn check_limits(limits: &wgpu::Limits, particles: u32, domain: &Domain, size: NodeSize) -> Result<(), GpuError> {
    let buffers = limits.max_storage_buffers_per_shader_stage;
    device::check("max_storage_buffers_per_shader_stage", buffers.into(), device::STORAGE_BUFFERS.into(), None)?;
    let groups = u64::from(limits.max_compute_workgroups_per_dimension).pow(2);
    let (name, room) = if limits.max_buffer_size < limits.max_storage_buffer_binding_size {
        ("max_buffer_size", limits.max_buffer_size)
    } else {
        ("max_storage_buffer_binding_size", limits.max_storage_buffer_binding_size)
    };
    let fits = Some(format!("{} particles", room / state_bytes(1)));
    device::check(name, room, state_bytes(particles), fits)?;
    let blocks = domain.blocks().as_i64vec3();
    let table = (blocks.x * blocks.y * blocks.z).unsigned_abs();
    device::check(name, room, 4 * table, Some(format!("{} blocks of 4 cells cubed in the room", room / 4)))?;
    let slots = room / node_bytes(NodeSize { slots: 1, ..size });
    device::check(name, room, node_bytes(size), Some(format!("{slots} blocks of 4 cells cubed with clay")))?;
    let tools = room / tool_bytes(1);
    device::check(name, room, tool_bytes(size.tools), Some(format!("{tools} tools")))?;
    device::check("max_compute_workgroups_per_dimension squared", groups, u64::from(size.slots), None)
}

impl Buffers {
    /// Buffers for `particles` in `domain`.
    pub(super) fn new(device: &wgpu::Device, particles: u32, domain: &Domain, size: NodeSize) -> Self {
        let make = |name: &str, bytes: u64, usage| buffer(device, name, bytes, usage);
        // A binding holds one element at least.
        let (particle_count, particles) = (particles, particles.max(1));
        let blocks = domain.blocks();
        let table_len = (blocks.x * blocks.y * blocks.z).unsigned_abs();
        let table = make("table", words(table_len), STORAGE);
        let nodes = Nodes::new(device, size);
        Self {
            particle_count,
            table_len,
            size,
            params: make("params", size_of::<Params>() as u64, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST),
            status: make("status", size_of::<Status>() as u64, STORAGE),
            records: [0, 1].map(|_| make("records", record_bytes(particles), STORAGE)),
            totals: make("totals", u64::from(groups(particles)) * size_of::<Total>() as u64, STORAGE),
            surface: make("surface", u64::from(particles) * size_of::<SurfaceParticle>() as u64, STORAGE),
            state: [0, 1].map(|_| make("state", state_bytes(particles), STORAGE)),
            keys: make("keys", 2 * words(particles), STORAGE),
            list: make("list", words(particles), STORAGE),
            scans: [scan(device, &table, table_len), nodes.scan],
            table,
            counts: nodes.counts,
            sums: nodes.sums,
            velocities: nodes.velocities,
            impulses: nodes.impulses,
            masses: nodes.masses,
            tools: nodes.tools,
            blocks: nodes.blocks,
            cuts: nodes.cuts,
        }
    }

    /// Makes the buffers of nodes anew, in another size. Commands under way keep the old ones.
    pub(super) fn resize(&mut self, device: &wgpu::Device, size: NodeSize) {
        let nodes = Nodes::new(device, size);
        self.size = size;
        self.counts = nodes.counts;
        self.sums = nodes.sums;
        self.velocities = nodes.velocities;
        self.impulses = nodes.impulses;
        self.masses = nodes.masses;
        self.tools = nodes.tools;
        self.blocks = nodes.blocks;
        self.cuts = nodes.cuts;
        self.scans[1] = nodes.scan;
    }

    /// The buffer bound at `index`: the numbers in the WGSL.
    pub(super) fn bound(&self, index: u32, v: Variant) -> Option<&wgpu::Buffer> {
        let scan = &self.scans[usize::from(v.cells)];
        Some(match index {
            0 => &self.params,
            1 => &self.status,
            2 => &self.state[v.state],
            3 => &self.state[1 - v.state],
            4 => &self.records[v.source],
            5 => &self.records[1 - v.source],
            6 => &self.table,
            7 => &self.blocks,
            8 => &self.sums,
            9 => &self.velocities,
            10 => &self.tools,
            11 => &scan.source,
            12 => &scan.prefix,
            13 => &scan.chunks,
            14 => &self.keys,
            15 => &self.list,
            16 => &self.cuts,
            17 => &self.impulses,
            18 => &self.totals,
            19 => &self.masses,
            20 => &self.surface,
            _ => return None,
        })
    }

    /// Workgroups of a pass.
    pub(super) fn groups(&self, id: Id, cells: bool) -> u32 {
        let slots = self.size.slots;
        match id {
            Id::Begin | Id::ScanChunks => 1,
            Id::ScanSums | Id::ScanWrite => (if cells { slots * 64 } else { self.table_len }).div_ceil(SCAN_CHUNK),
            Id::Slots => groups(self.table_len),
            Id::Clear => slots * self.size.classes,
            Id::Penalty | Id::Sides | Id::Faces | Id::Grid => slots,
            Id::Mass => groups(slots),
            Id::Load
            | Id::Mark
            | Id::Count
            | Id::Place
            | Id::Order
            | Id::Averaging
            | Id::Tags
            | Id::Classes
            | Id::P2g
            | Id::G2p
            | Id::Weld
            | Id::Carry
            | Id::Support
            | Id::Store
            | Id::Total => groups(self.particle_count),
        }
    }
}

/// The buffers whose size depends on the blocks with clay, on cuts and on tools.
struct Nodes {
    counts: wgpu::Buffer,
    sums: wgpu::Buffer,
    velocities: wgpu::Buffer,
    impulses: wgpu::Buffer,
    masses: wgpu::Buffer,
    tools: wgpu::Buffer,
    blocks: wgpu::Buffer,
    cuts: wgpu::Buffer,
    scan: Scan,
}

impl Nodes {
    fn new(device: &wgpu::Device, size: NodeSize) -> Self {
        let make = |name: &str, bytes: u64| buffer(device, name, bytes, STORAGE);
        let counts = make("cell counts", words(size.slots * 64));
        Self {
            sums: make("sums", node_bytes(size)),
            velocities: make("velocities", node_bytes(size)),
            impulses: make("impulses", u64::from(size.slots) * u64::from(2 + 2 * size.tools) * 16),
            masses: make("masses", 2 * words(size.slots)),
            tools: make("tools", tool_bytes(size.tools)),
            // Coordinates, then two words of which columns walls hold, then what they bear.
            blocks: make("blocks", words(4 * size.slots)),
            cuts: make("cuts", cut_bytes(size)),
            scan: scan(device, &counts, size.slots * 64),
            counts,
        }
    }
}

fn scan(device: &wgpu::Device, source: &wgpu::Buffer, len: u32) -> Scan {
    Scan {
        source: source.clone(),
        prefix: buffer(device, "prefix", words(len), STORAGE),
        chunks: buffer(device, "chunk sums", words(len.div_ceil(SCAN_CHUNK)), STORAGE),
    }
}

fn buffer(device: &wgpu::Device, name: &str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let label = label(name);
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(&label), size: bytes.max(4), usage, mapped_at_creation: false })
}

/// Room for blocks beyond those there are: clay spreads.
const SLOT_HEADROOM: f64 = 1.3;

/// Number of blocks that the particles' margins reach, as `mark` has it.
pub(super) fn block_count(particles: &[Particle]) -> usize {
    let mut blocks = HashSet::new();
    for p in particles {
        let base = (p.grid() - 0.5).floor().as_ivec3();
        let block = |node: IVec3| node.div_euclid(IVec3::splat(BLOCK));
        let (low, high) = (block(base - 1), block(base + 3));
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                blocks.extend((low.z..=high.z).map(|z| (x, y, z)));
            }
        }
    }
    blocks.len()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a count of blocks, checked against limits before use"
)]
pub(super) fn slot_capacity(blocks: usize) -> u32 {
    (SLOT_HEADROOM * blocks as f64).min(f64::from(u32::MAX / 64)) as u32 + 64
}
