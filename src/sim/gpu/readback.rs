//! What comes back from the device at a frame's end, in one mapped buffer, without waiting.

use super::super::engine::StateLost;
use super::super::frame::FrameOutputs;
use super::buffers::Buffers;
use super::device::read_mapped;
use super::layout::{Status, Total};
use super::stamps::{STAMP_BYTES, Stamps};
use bytemuck::Pod;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

const PENDING: u8 = 0;
const DONE: u8 = 1;
const LOST: u8 = 2;

/// A staging buffer and where in it each part lies.
#[derive(Debug)]
pub(super) struct Readback {
    buffer: wgpu::Buffer,
    progress: Arc<AtomicU8>,
    status: Range<u64>,
    totals: Range<u64>,
    masses: Range<u64>,
    impulses: Range<u64>,
    stamps: Range<u64>,
    surface: Range<u64>,
    records: Range<u64>,
    blocks: Range<u64>,
}

/// Bytes of the particles' partial sums, of their surface, of their records and of what bears them. No buffer
/// is empty, but clay can be.
fn of_clay(buffers: &Buffers, outputs: FrameOutputs) -> [u64; 4] {
    let parts = [
        (true, buffers.totals.size()),
        (outputs.surface, buffers.surface.size()),
        (outputs.state, buffers.records[0].size()),
        (outputs.support, buffers.blocks.size()),
    ];
    parts.map(|(is_wanted, size)| if is_wanted && buffers.particle_count > 0 { size } else { 0 })
}

/// How far the copy is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    Pending,
    Done,
    /// The device is gone.
    Lost,
}

impl Readback {
    /// Staging for a frame's sums and for `outputs`.
    pub(super) fn new(device: &wgpu::Device, buffers: &Buffers, outputs: FrameOutputs) -> Self {
        let mut end = 0;
        let mut next = |size: u64| {
            let start = end;
            // Offsets of resolves and copies are multiples of 8.
            end += size.next_multiple_of(8);
            start..start + size
        };
        let status = next(buffers.status.size());
        let masses = next(buffers.masses.size());
        let impulses = next(buffers.impulses.size());
        let stamps = next(STAMP_BYTES);
        let [totals, surface, records, blocks] = of_clay(buffers, outputs).map(&mut next);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("bevy_clay:readback"),
            size: end,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { buffer, progress: Arc::default(), status, totals, masses, impulses, stamps, surface, records, blocks }
    }

    /// Bytes that are copied.
    pub(super) fn bytes(&self) -> u64 {
        self.buffer.size()
    }

    /// Encodes the copy of the state alone, the records `ended`, where no frame runs.
    pub(super) fn copy_state(&self, encoder: &mut wgpu::CommandEncoder, buffers: &Buffers, ended: usize) {
        let to = &self.records;
        if !to.is_empty() {
            encoder.copy_buffer_to_buffer(&buffers.records[ended], 0, &self.buffer, to.start, to.end - to.start);
        }
    }

    /// Encodes the copies; `ended` are the records that the frame wrote.
    pub(super) fn copy(&self, encoder: &mut wgpu::CommandEncoder, buffers: &Buffers, ended: usize, stamps: Option<&Stamps>) {
        let parts = [
            (&buffers.status, &self.status),
            (&buffers.totals, &self.totals),
            (&buffers.masses, &self.masses),
            (&buffers.impulses, &self.impulses),
            (&buffers.surface, &self.surface),
            (&buffers.records[ended], &self.records),
            (&buffers.blocks, &self.blocks),
        ];
        for (from, to) in parts.into_iter().filter(|(_, to)| !to.is_empty()) {
            encoder.copy_buffer_to_buffer(from, 0, &self.buffer, to.start, to.end - to.start);
        }
        if let Some(stamps) = stamps {
            stamps.resolve(encoder, &self.buffer, self.stamps.start);
        }
    }

    /// Asks for the mapping; after the copies were submitted.
    pub(super) fn map(&self) {
        let progress = self.progress.clone();
        self.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            progress.store(if result.is_ok() { DONE } else { LOST }, Ordering::Release);
        });
    }

    /// The staging for another frame: unmapped, nothing under way.
    pub(super) fn recycle(mut self) -> Self {
        self.buffer.unmap();
        self.progress = Arc::default();
        self
    }

    /// Whether this staging is laid out for `buffers` and `outputs`.
    pub(super) fn fits(&self, buffers: &Buffers, outputs: FrameOutputs) -> bool {
        let size = |r: &Range<u64>| r.end - r.start;
        size(&self.masses) == buffers.masses.size()
            && size(&self.impulses) == buffers.impulses.size()
            && [&self.totals, &self.surface, &self.records, &self.blocks].map(size) == of_clay(buffers, outputs)
    }

    pub(super) fn progress(&self) -> Progress {
        match self.progress.load(Ordering::Acquire) {
            PENDING => Progress::Pending,
            DONE => Progress::Done,
            _ => Progress::Lost,
        }
    }

    fn read<T: Pod>(&self, range: &Range<u64>) -> Result<Vec<T>, StateLost> {
        if range.is_empty() { Ok(vec![]) } else { read_mapped(&self.buffer, range.clone()) }
    }

    /// The status word and counters.
    pub(super) fn status(&self) -> Result<Status, StateLost> {
        Ok(self.read(&self.status)?.first().copied().unwrap_or_default())
    }

    pub(super) fn totals(&self) -> Result<Vec<Total>, StateLost> {
        self.read(&self.totals)
    }

    /// Node masses by block, high and low part.
    pub(super) fn masses(&self) -> Result<Vec<[u32; 2]>, StateLost> {
        self.read(&self.masses)
    }

    pub(super) fn impulses(&self) -> Result<Vec<[f32; 4]>, StateLost> {
        self.read(&self.impulses)
    }

    /// Blocks by slot: their coordinates, twice as many words, and what is in them that walls bear.
    pub(super) fn blocks(&self) -> Result<Vec<u32>, StateLost> {
        self.read(&self.blocks)
    }

    pub(super) fn stamps(&self) -> Result<Vec<u64>, StateLost> {
        self.read(&self.stamps)
    }

    pub(super) fn surface<T: Pod>(&self) -> Result<Vec<T>, StateLost> {
        self.read(&self.surface)
    }

    pub(super) fn records<T: Pod>(&self) -> Result<Vec<T>, StateLost> {
        self.read(&self.records)
    }
}
