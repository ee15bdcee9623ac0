//! The order of the passes, once.

use super::buffers::Level;
use super::layout::{SurfaceStatus, VERTEX_WORDS};
use super::surface::GpuSurface;
use super::wgsl::{Id, SCAN_CHUNK};
use crate::sim::gpu::label::label;
use std::mem::offset_of;
use std::num::NonZeroU64;

/// Where the mesh goes: parts of buffers with usage `STORAGE`. Only these parts are bound, so that buffers
/// may be larger than a binding; what a part may have is a binding's size less 256 bytes.
#[derive(Clone, Copy, Debug)]
pub struct MeshTarget<'a> {
    /// Vertices of 7 words.
    pub vertices: &'a wgpu::Buffer,
    /// The first one \[vertices\].
    pub vertex_first: u32,
    /// Most vertices.
    pub vertex_capacity: u32,
    /// Indices, from 0 for the first vertex.
    pub indices: &'a wgpu::Buffer,
    /// The first one \[indices\].
    pub index_first: u32,
    /// Most indices.
    pub index_capacity: u32,
}

/// A part of a buffer as it is bound: bindings begin at multiples of the device's alignment.
#[derive(Clone)]
struct Part<'a> {
    bound: wgpu::BufferBinding<'a>,
    /// Where it begins in what is bound \[words\].
    start: u32,
}

impl<'a> Part<'a> {
    /// `count` words from word `first` on.
    fn new(device: &wgpu::Device, buffer: &'a wgpu::Buffer, first: u64, count: u64) -> Self {
        let alignment = u64::from(device.limits().min_storage_buffer_offset_alignment);
        let offset = 4 * first / alignment * alignment;
        let start = 4 * first - offset;
        let bound = wgpu::BufferBinding { buffer, offset, size: NonZeroU64::new(start + 4 * count) };
        Self { bound, start: (start / 4) as u32 }
    }
}

impl<'a> MeshTarget<'a> {
    fn vertex_part(&self, device: &wgpu::Device) -> Part<'a> {
        let [first, count] = [self.vertex_first, self.vertex_capacity].map(|n| u64::from(VERTEX_WORDS) * u64::from(n));
        Part::new(device, self.vertices, first, count)
    }

    fn index_part(&self, device: &wgpu::Device) -> Part<'a> {
        Part::new(device, self.indices, u64::from(self.index_first), u64::from(self.index_capacity))
    }
}

/// Workgroups of a pass.
#[derive(Clone, Copy)]
enum Groups {
    /// So many.
    Count(u32),
    /// As the device says, at this word of the dispatch buffer.
    Indirect(u64),
}

impl GpuSurface {
    /// Records the passes for `count` particles of 28 bytes
    /// ([`SurfaceParticle`](crate::sim::frame::SurfaceParticle)). To be submitted before the next call.
    /// Unless `is_forced`, nothing is written to `target` while the clay is at rest; force it for another
    /// target. Where a mesh is forced, the first of this surface, of another number of particles, or follows
    /// one that found no room, the target's indices are written to the end of their capacity.
    pub fn encode(
        &mut self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        (particles, count): (&wgpu::Buffer, u32),
        target: &MeshTarget<'_>,
        is_forced: bool,
    ) {
        self.upload(queue, count, target, is_forced);
        encoder.clear_buffer(&self.buffers.status, 0, Some(offset_of!(SurfaceStatus, vertex_count) as u64));
        encoder.clear_buffer(&self.buffers.pairs, 0, None);
        encoder.clear_buffer(&self.buffers.changes, 0, None);
        if self.has_grains {
            encoder.clear_buffer(&self.buffers.occupancy, 0, None);
        }
        self.buffers.sums.iter().for_each(|sums| encoder.clear_buffer(sums, 0, None));
        let by_particle = Groups::Count(count.div_ceil(64));
        let (cells, visual) = (Level::Cells, Level::Visual);
        let mut passes = vec![];
        for level in [cells, visual] {
            let entries = self.params[level as usize].blocks.iter().product::<i32>().cast_unsigned();
            let by_chunk = Groups::Count(entries.div_ceil(SCAN_CHUNK));
            passes.extend([
                (Id::Mark, level, by_particle),
                (Id::ScanSums, level, by_chunk),
                (Id::ScanChunks, level, Groups::Count(1)),
                (Id::ScanWrite, level, by_chunk),
            ]);
        }
        passes.extend([
            (Id::Survey, visual, by_particle),
            (Id::FindBodies, visual, by_particle),
            (Id::DealPages, visual, Groups::Count(1)),
            (Id::Assign, visual, Groups::Count(1)),
        ]);
        self.run(encoder, &passes, Some(particles), target);
        let mut fields = vec![
            (Id::ScatterDensity, cells, by_particle),
            (Id::Weigh, cells, by_particle),
            (Id::Scatter, visual, by_particle),
            (Id::Filter, visual, Groups::Indirect(0)),
        ];
        if self.has_grains {
            fields.extend([(Id::FindGrains, visual, by_particle), (Id::GrainOffsets, visual, Groups::Count(1))]);
        }
        fields.extend([(Id::Compare, visual, Groups::Indirect(0)), (Id::Decide, visual, Groups::Count(1))]);
        self.run(encoder, &fields, Some(particles), target);
        self.run(encoder, &[(Id::Collect, visual, Groups::Indirect(4))], None, target);
        self.encode_from_fields(encoder, Some(particles), target);
    }

    /// Fields -> mesh; with balls, if there are particles to be shown by them.
    fn encode_from_fields(&self, encoder: &mut wgpu::CommandEncoder, particles: Option<&wgpu::Buffer>, target: &MeshTarget<'_>) {
        let (visual, by_block, once) = (Level::Visual, Groups::Indirect(8), Groups::Indirect(12));
        let counts = [
            (Id::Take, visual, by_block),
            (Id::Closure, visual, by_block),
            (Id::Label, visual, by_block),
            (Id::Bodies, visual, by_block),
            (Id::Count, visual, by_block),
            (Id::Offsets, visual, once),
        ];
        self.run(encoder, &counts, None, target);
        let balls = (self.has_grains && particles.is_some()).then_some((Id::Balls, visual, Groups::Indirect(20)));
        let mesh = [Some((Id::Emit, visual, Groups::Indirect(16))), balls, Some((Id::Tail, visual, once))];
        self.run(encoder, &mesh.into_iter().flatten().collect::<Vec<_>>(), particles, target);
    }

    /// Records the passes from fields to mesh alone, for fields that
    /// [`Self::load_field`](GpuSurface::load_field) put there.
    #[doc(hidden)]
    pub fn encode_mesh(&mut self, queue: &wgpu::Queue, encoder: &mut wgpu::CommandEncoder, target: &MeshTarget<'_>) {
        self.upload(queue, 0, target, true);
        self.encode_from_fields(encoder, None, target);
    }

    fn upload(&mut self, queue: &wgpu::Queue, count: u32, target: &MeshTarget<'_>, is_forced: bool) {
        // Particles that are gone may have been grains, which are no part of the fields.
        let is_forced = is_forced || self.count_before != Some(count);
        let (vertices, indices) = (target.vertex_part(&self.kernels.device), target.index_part(&self.kernels.device));
        for (params, buffer) in self.params.iter_mut().zip(&self.buffers.params) {
            params.particle_count = count;
            (params.vertex_start, params.vertex_capacity) = (vertices.start, target.vertex_capacity);
            (params.index_start, params.index_capacity) = (indices.start, target.index_capacity);
            params.is_forced = u32::from(is_forced);
            queue.write_buffer(buffer, 0, bytemuck::bytes_of(params));
        }
        self.count_before = Some(count);
    }

    /// One compute pass of several dispatches; each sees what those before it wrote, and dispatches go by
    /// what the pass before left.
    fn run(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &[(Id, Level, Groups)],
        particles: Option<&wgpu::Buffer>,
        target: &MeshTarget<'_>,
    ) {
        let device = &self.kernels.device;
        encoder.copy_buffer_to_buffer(&self.buffers.dispatch, 0, &self.buffers.arguments, 0, self.buffers.dispatch.size());
        let (vertices, indices) = (target.vertex_part(device).bound, target.index_part(device).bound);
        let bind = |&(id, level, _): &(Id, Level, Groups)| {
            let kernel = self.kernels.get(id);
            let resource = |binding: u32| match binding {
                2 => particles.map(wgpu::Buffer::as_entire_binding),
                13 => Some(wgpu::BindingResource::Buffer(vertices.clone())),
                14 => Some(wgpu::BindingResource::Buffer(indices.clone())),
                _ => self.buffers.bound(binding, level).map(wgpu::Buffer::as_entire_binding),
            };
            let entry = |b: &crate::sim::gpu::kernel::Binding| {
                Some(wgpu::BindGroupEntry { binding: b.index, resource: resource(b.index)? })
            };
            let entries: Vec<_> = kernel.bindings.iter().filter_map(entry).collect();
            let label = label(id.pass().name);
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(&label),
                layout: &kernel.layout,
                entries: &entries,
            })
        };
        let groups: Vec<wgpu::BindGroup> = passes.iter().map(bind).collect();
        let most = device.limits().max_compute_workgroups_per_dimension;
        let mut pass =
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("bevy_clay:surface"), timestamp_writes: None });
        for ((id, _, count), group) in passes.iter().zip(&groups) {
            pass.set_pipeline(&self.kernels.get(*id).pipeline);
            pass.set_bind_group(0, group, &[]);
            match count {
                Groups::Count(count) => pass.dispatch_workgroups((*count).min(most), count.div_ceil(most), 1),
                Groups::Indirect(word) => pass.dispatch_workgroups_indirect(&self.buffers.arguments, 4 * word),
            }
        }
    }
}
