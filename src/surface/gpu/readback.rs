//! The status back on the host, without waiting.

use super::layout::SurfaceStatus;
use super::surface::GpuSurface;
use crate::sim::gpu::read_mapped;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Nothing was asked for.
const IDLE: u8 = 0;
/// A copy is recorded, not yet asked for.
const RECORDED: u8 = 1;
/// The device has been asked.
const PENDING: u8 = 2;
/// It has answered.
const DONE: u8 = 3;

/// A status on its way: one at a time.
#[derive(Debug)]
pub struct StatusReadback {
    staging: wgpu::Buffer,
    state: Arc<AtomicU8>,
}

impl StatusReadback {
    /// A readback for surfaces on `device`.
    pub fn new(device: &wgpu::Device) -> Self {
        let staging = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("bevy_clay:surface status readback"),
            size: size_of::<SurfaceStatus>() as u64,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { staging, state: Arc::default() }
    }

    /// Records a copy of the status behind the passes; nothing while another is on its way.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder, surface: &GpuSurface) {
        if self.state.compare_exchange(IDLE, RECORDED, Ordering::AcqRel, Ordering::Acquire).is_ok() {
            encoder.copy_buffer_to_buffer(surface.status_buffer(), 0, &self.staging, 0, self.staging.size());
        }
    }

    /// To be called after the encoder's commands were submitted.
    pub fn submitted(&self) {
        if self.state.compare_exchange(RECORDED, PENDING, Ordering::AcqRel, Ordering::Acquire).is_ok() {
            let state = self.state.clone();
            self.staging.slice(..).map_async(wgpu::MapMode::Read, move |result| {
                // A device that is lost answers with an error: then nothing comes, and nothing is awaited.
                state.store(if result.is_ok() { DONE } else { IDLE }, Ordering::Release);
            });
        }
    }

    /// The status, once, when it is there. The device has to be polled by someone.
    pub fn take(&self) -> Option<SurfaceStatus> {
        if self.state.load(Ordering::Acquire) != DONE {
            return None;
        }
        // What goes with its device is not there to be unmapped.
        let status = read_mapped(&self.staging, 0..self.staging.size()).ok().and_then(|status| {
            self.staging.unmap();
            status.first().copied()
        });
        self.state.store(IDLE, Ordering::Release);
        status
    }
}
