//! Times on the device, of one substep and of the frame's ends, where it can tell them.

use super::super::frame::Timings;

/// What is measured apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stretch {
    /// One re-bin.
    Rebin,
    /// Clear, tags and p2g of one substep.
    Scatter,
    /// Sides and grid of one substep.
    Grid,
    /// g2p of one substep.
    Gather,
    /// The frame's end.
    Report,
}

/// Two stamps for each stretch.
const COUNT: u32 = 10;
/// Bytes of all stamps.
pub(super) const STAMP_BYTES: u64 = COUNT as u64 * 8;

/// The stamps of one frame.
#[derive(Debug)]
pub(super) struct Stamps {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    /// Seconds per tick.
    period: f64,
}

impl Stamps {
    /// Stamps, if the device has them.
    pub(super) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Self> {
        device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Self {
            set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("bevy_clay:stamps"),
                ty: wgpu::QueryType::Timestamp,
                count: COUNT,
            }),
            resolved: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("bevy_clay:stamps"),
                size: STAMP_BYTES,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            period: f64::from(queue.get_timestamp_period()) * 1e-9,
        })
    }

    /// Where a pass writes its beginning and end.
    pub(super) fn writes(&self, stretch: Stretch) -> wgpu::ComputePassTimestampWrites<'_> {
        let first = 2 * stretch as u32;
        wgpu::ComputePassTimestampWrites {
            query_set: &self.set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        }
    }

    /// Copies the stamps to `to`.
    pub(super) fn resolve(&self, encoder: &mut wgpu::CommandEncoder, to: &wgpu::Buffer, offset: u64) {
        encoder.resolve_query_set(&self.set, 0..COUNT, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, to, offset, STAMP_BYTES);
    }

    /// Times of a frame \[s\] of `steps` substeps and `rebins` re-bins, from those measured once.
    pub(super) fn timings(&self, stamps: &[u64], steps: u32, rebins: u32) -> Timings {
        let of = |stretch: Stretch| {
            let i = 2 * stretch as usize;
            stamps[i + 1].saturating_sub(stamps[i]) as f64 * self.period
        };
        let rebin = of(Stretch::Rebin) * f64::from(rebins);
        let grid = of(Stretch::Grid) * f64::from(steps);
        let particles = (of(Stretch::Scatter) + of(Stretch::Gather)) * f64::from(steps);
        let total = stamps[2 * Stretch::Report as usize + 1].saturating_sub(stamps[0]) as f64 * self.period;
        Timings { total, rebin, grid, particles, report: of(Stretch::Report) }
    }
}
