//! The order of the passes, once: a submission of a frame, its re-bins and its substeps.

use super::super::frame::FramePlan;
use super::super::params::Domain;
use super::super::weld::WeldRule;
use super::buffers::{Buffers, SUBMISSION_STEPS, Variant};
use super::kernels::Kernels;
use super::label::label;
use super::params::{Params, bent_blades};
use super::pass::Id;
use super::stamps::{Stamps, Stretch};
use super::tool::GpuTool;
use std::collections::HashMap;

/// What of a frame is encoded in one submission.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// Substeps of the frame done before.
    pub first: u32,
    /// Substeps in this submission.
    pub steps: u32,
    /// Whether the frame starts here.
    pub starts: bool,
    /// Whether it ends here.
    pub ends: bool,
    /// Substeps between two re-bins.
    pub interval: u32,
}

impl Part {
    /// The next part, of up to `most` substeps, of a frame of `steps` substeps of which `done` are encoded.
    pub(super) fn next(done: u32, steps: u32, interval: u32, most: u32) -> Self {
        let count = most.clamp(1, SUBMISSION_STEPS).min(steps - done);
        Self { first: done, steps: count, starts: done == 0, ends: done + count == steps, interval }
    }

    /// Whether the particles are re-binned before substep `s` of the frame.
    fn rebins(&self, s: u32) -> bool {
        s.is_multiple_of(self.interval)
    }

    /// Re-bins before substep `s` of the frame: each swaps the two states.
    fn swaps(&self, s: u32) -> u32 {
        s.div_ceil(self.interval)
    }
}

/// What a submission reads.
pub(super) struct Work<'a> {
    pub device: &'a wgpu::Device,
    pub queue: &'a wgpu::Queue,
    pub kernels: &'a Kernels,
    pub buffers: &'a Buffers,
    pub domain: &'a Domain,
    pub plan: &'a FramePlan,
    /// Substep used \[s\].
    pub dt: f64,
    pub params: Params,
    /// The records that the frame starts from: 0 or 1.
    pub source: usize,
    /// Whether the flags of an earlier frame are to be cleared.
    pub clears_flags: bool,
}

/// Encodes one submission. Bind groups are made as they are needed and kept for the submission.
pub(super) struct Encoding<'a> {
    work: Work<'a>,
    groups: HashMap<(Id, Variant), wgpu::BindGroup>,
    stamps: Option<&'a Stamps>,
}

impl<'a> Encoding<'a> {
    pub(super) fn new(work: Work<'a>, stamps: Option<&'a Stamps>) -> Self {
        Self { work, groups: HashMap::new(), stamps }
    }

    /// The passes of `part`, top to bottom.
    pub(super) fn run(&mut self, encoder: &mut wgpu::CommandEncoder, part: &Part) {
        self.upload(part);
        let variant = |s: u32| Variant { state: part.swaps(s) as usize % 2, source: self.work.source, cells: false };
        let (mut v, cuts, divides) = (variant(part.first), self.work.kernels.classes > 1, self.work.plan.divides());
        if self.work.clears_flags {
            encoder.clear_buffer(&self.work.buffers.status, 0, None);
        }
        if part.starts {
            encoder.clear_buffer(&self.work.buffers.impulses, 0, None);
        }
        self.pass(encoder, None, &[(Id::Begin, v)]);
        if part.starts {
            self.pass(encoder, None, &[(Id::Load, v)]);
        }
        for s in part.first..part.first + part.steps {
            // One substep of a frame is measured: the first.
            let timed = |stretch| (s == 0).then_some(stretch);
            if part.rebins(s) {
                self.rebin(encoder, timed(Stretch::Rebin), v);
                v.state = 1 - v.state;
            }
            let mut passes = vec![(Id::Clear, v)];
            if self.work.plan.averages_before(s) {
                passes.push((Id::Averaging, v));
            }
            if divides {
                passes.push((Id::Tags, v));
            }
            if cuts {
                passes.push((Id::Classes, v));
            }
            passes.extend([(Id::Penalty, Variant { cells: true, ..v }), (Id::P2g, v)]);
            let scattered = passes.len();
            if cuts {
                passes.extend([(Id::Sides, v), (Id::Faces, v)]);
            }
            passes.extend([(Id::Grid, v), (Id::G2p, v)]);
            if s == 0 {
                let (scatter, rest) = passes.split_at(scattered);
                let (grid, gather) = rest.split_at(rest.len() - 1);
                self.pass(encoder, timed(Stretch::Scatter), scatter);
                self.pass(encoder, timed(Stretch::Grid), grid);
                self.pass(encoder, timed(Stretch::Gather), gather);
            } else {
                self.pass(encoder, None, &passes);
            }
        }
        if part.ends {
            // By the last substep's nodes, before the blocks are found anew.
            let mut passes = vec![(Id::Mass, v)];
            if cuts && WeldRule::of(self.work.plan, 0.0).is_some() {
                passes.push((Id::Weld, v));
            }
            if cuts {
                passes.push((Id::Carry, v));
            }
            if self.work.plan.outputs.support {
                passes.push((Id::Support, v));
            }
            if self.work.plan.averages() {
                self.pass(encoder, None, &passes);
                self.rebin(encoder, None, v);
                v.state = 1 - v.state;
                passes = vec![(Id::Averaging, v)];
            }
            passes.extend([(Id::Store, v), (Id::Total, v)]);
            self.pass(encoder, Some(Stretch::Report), &passes);
        }
    }

    /// Sorts the particles by block, cell and record and gives slots to the blocks they may reach.
    fn rebin(&mut self, encoder: &mut wgpu::CommandEncoder, stretch: Option<Stretch>, v: Variant) {
        let cells = Variant { cells: true, ..v };
        encoder.clear_buffer(&self.work.buffers.table, 0, None);
        encoder.clear_buffer(&self.work.buffers.counts, 0, None);
        let scan = |v| [(Id::ScanSums, v), (Id::ScanChunks, v), (Id::ScanWrite, v)];
        let mut passes = vec![(Id::Mark, v)];
        passes.extend(scan(v));
        passes.extend([(Id::Slots, v), (Id::Count, cells)]);
        passes.extend(scan(cells));
        passes.extend([(Id::Place, cells), (Id::Order, cells)]);
        self.pass(encoder, stretch, &passes);
    }

    /// Parameters and the tools' poses of each substep.
    fn upload(&self, part: &Part) {
        let w = &self.work;
        w.queue.write_buffer(&w.buffers.params, 0, bytemuck::bytes_of(&w.params));
        let substep = |s: u32| {
            let start = f64::from(s) * w.dt;
            let profile = |i: usize| bent_blades(&w.plan.tools).position(|(tool, _)| tool == i).unwrap_or(0) as u32;
            let tools = w.plan.tools.iter().enumerate();
            tools.map(move |(i, path)| GpuTool::new(path, w.domain, start, start + w.dt, profile(i)))
        };
        let tools: Vec<GpuTool> = (part.first..part.first + part.steps).flat_map(substep).collect();
        w.queue.write_buffer(&w.buffers.tools, 0, bytemuck::cast_slice(&tools));
    }

    /// One compute pass of several dispatches; each sees what those before it wrote.
    fn pass(&mut self, encoder: &mut wgpu::CommandEncoder, stretch: Option<Stretch>, dispatches: &[(Id, Variant)]) {
        for (id, v) in dispatches {
            self.bind(*id, *v);
        }
        let stamps = self.stamps.zip(stretch).map(|(stamps, stretch)| stamps.writes(stretch));
        let descriptor = wgpu::ComputePassDescriptor { label: Some("bevy_clay:frame"), timestamp_writes: stamps };
        let mut pass = encoder.begin_compute_pass(&descriptor);
        for key in dispatches {
            let (Some(kernel), Some(group)) = (self.work.kernels.get(key.0), self.groups.get(key)) else { continue };
            let count = self.work.buffers.groups(key.0, key.1.cells);
            let across = count.min(self.work.device.limits().max_compute_workgroups_per_dimension);
            pass.set_pipeline(&kernel.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(across, count.div_ceil(across.max(1)), 1);
        }
    }

    fn bind(&mut self, id: Id, v: Variant) {
        let w = &self.work;
        let Some(kernel) = w.kernels.get(id) else { return };
        self.groups.entry((id, v)).or_insert_with(|| {
            let entry = |b: &super::kernel::Binding| {
                let buffer = w.buffers.bound(b.index, v)?;
                Some(wgpu::BindGroupEntry { binding: b.index, resource: buffer.as_entire_binding() })
            };
            let entries: Vec<_> = kernel.bindings.iter().filter_map(entry).collect();
            w.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(&label(id.pass().name)),
                layout: &kernel.layout,
                entries: &entries,
            })
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts cover a frame without gap, and the state they start from is the one the part before left.
    #[test]
    fn parts_cover_frame() {
        for (steps, interval, most) in [(1, 1, 9), (7, 3, 2), (1024, 32, u32::MAX), (1025, 8, 0), (5000, 7, 1024)] {
            let (mut done, mut swapped) = (0, 0);
            while done < steps {
                let part = Part::next(done, steps, interval, most);
                assert_eq!(part.swaps(done), swapped);
                assert_eq!((part.starts, part.ends), (done == 0, done + part.steps == steps));
                swapped += (done..done + part.steps).filter(|s| part.rebins(*s)).count() as u32;
                done += part.steps;
            }
            assert_eq!(done, steps);
        }
    }
}
