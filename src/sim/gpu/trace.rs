//! Nodes read back after one substep, waiting for the device: for tests of single passes.

use super::super::cut::ClassKey;
use super::super::engine::{Engine, EngineError};
use super::super::frame::FramePlan;
use super::super::snapshot::{Snapshot, Tag};
use super::super::trace::TracedNode;
use super::wgsl::cut_words;
use super::{GpuDevice, GpuEngine, lock};
use bytemuck::{Pod, pod_collect_to_vec};
use glam::{DVec3, IVec3};

impl GpuEngine {
    /// Loads `snapshot`, runs `plan`, and hands out what its last substep left at the nodes. Blocks.
    ///
    /// # Errors
    /// As loading and running.
    pub fn trace(&mut self, snapshot: &Snapshot, plan: FramePlan) -> Result<Vec<TracedNode>, EngineError> {
        self.load(snapshot)?;
        let (dt, density) = (plan.dt, plan.inertial_density());
        // Averaging, which does nothing to the nodes, finds the blocks anew at the frame's end.
        self.submit(FramePlan { volume_averaging: 0.0, ..plan })?;
        self.wait()?;
        let device = &self.link.shared.device;
        let guard = lock(&self.link.shared.solver);
        let solver = guard.as_ref().ok_or(EngineError::NotLoaded)?;
        let (buffers, scales) = (solver.buffers(), solver.last_scales());
        let status: Vec<super::layout::Status> = read(device, &buffers.status)?;
        let sums: Vec<[i32; 4]> = read(device, &buffers.sums)?;
        let velocities: Vec<[f32; 4]> = read(device, &buffers.velocities)?;
        let blocks: Vec<u32> = read(device, &buffers.blocks)?;
        let classes = buffers.size.classes as usize;
        let stride = cut_words(buffers.size.classes) as usize;
        let cuts: Vec<u32> = if classes > 1 { read(device, &buffers.cuts)? } else { vec![] };
        let mass_unit = density * solver.mass_unit();
        let speed_unit = snapshot.domain.cell_width / dt;
        let mut nodes = vec![];
        for (slot, block) in blocks.iter().enumerate().take(status[0].slot_count as usize) {
            let low = IVec3::new((block & 1023) as i32, (block >> 10 & 1023) as i32, (block >> 20) as i32) * 4;
            for class in 0..classes {
                let packed = if class == 0 { 0 } else { cuts[slot * stride + class - 1] };
                if class > 0 && packed == 0 {
                    continue;
                }
                for k in 0..64usize {
                    let at = (slot * classes + class) * 64 + k;
                    let ([x, y, z, m], own) = (sums[2 * at].map(f64::from), sums[2 * at + 1].map(f64::from));
                    let v = velocities[2 * at].map(f64::from);
                    nodes.push(TracedNode {
                        node: low + IVec3::new(k as i32 / 16, k as i32 / 4 % 4, k as i32 % 4),
                        key: key_of(packed),
                        mass: m / f64::from(scales.mass) * mass_unit,
                        momentum: DVec3::new(x + own[0], y + own[1], z + own[2])
                            * (mass_unit * speed_unit / f64::from(scales.momentum)),
                        velocity: DVec3::new(v[0], v[1], v[2]) * speed_unit,
                    });
                }
            }
        }
        Ok(nodes)
    }
}

/// The key that a block's list holds packed: the body, and a code of sheet and front for each of two sides.
fn key_of(packed: u32) -> ClassKey {
    let tag = |code: u32| Tag { sheet: (code >> 1) as u8, side: if code == 0 { 0 } else { 2 * (code & 1) as i8 - 1 } };
    ClassKey::new(packed >> 18, [tag(packed >> 9 & 0x1ff), tag(packed & 0x1ff)])
}

/// A buffer's content.
fn read<T: Pod>(device: &GpuDevice, from: &wgpu::Buffer) -> Result<Vec<T>, EngineError> {
    let GpuDevice { device, queue, .. } = device;
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("bevy_clay:trace"),
        size: from.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("bevy_clay:trace") });
    encoder.copy_buffer_to_buffer(from, 0, &staging, 0, from.size());
    queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |_| {});
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| EngineError::Stopped(e.to_string()))?;
    Ok(pod_collect_to_vec(&staging.get_mapped_range(..)))
}
