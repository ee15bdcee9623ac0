//! Bodies of clay told apart at a frame's end, on the host by what was read back. The frame behind it waits,
//! and starts from what was found.

use super::super::cut::ClassKey;
use super::super::engine::StateLost;
use super::super::frame::{FrameOutputs, FramePlan, FrameReport, SurfaceParticle};
use super::super::snapshot::Snapshot;
use super::handed::Held;
use super::readback::Readback;
use super::report::{classes_of, packed_tags};
use super::solver::{Frame, Solver};

impl Frame {
    /// What is read back at its end.
    pub(super) fn read_back(&self) -> FrameOutputs {
        let (outputs, finds) = (self.plan.outputs, self.plan.finds_bodies);
        let state = outputs.state || finds || !self.promises.is_empty();
        FrameOutputs { state, surface: outputs.surface || finds, ..outputs }
    }
}

impl Solver {
    /// Frames that may be encoded at a time: one alone whose bodies are still to be found.
    pub(super) fn frames_ahead(&self) -> usize {
        if self.frames.front().is_some_and(|frame| frame.plan.finds_bodies) { 1 } else { 2 }
    }

    /// What the frame that has just ended well hands out: its particles, of the bodies that are found if its
    /// plan asks for them. Then those are the device's from now on, and the report's.
    pub(super) fn find_bodies(
        &mut self,
        readback: Readback,
        plan: &FramePlan,
        report: &mut FrameReport,
    ) -> Result<Held, StateLost> {
        if !plan.finds_bodies {
            return Ok(Held::Device(readback));
        }
        let mut clay = Snapshot::new(self.domain, plan.material, readback.records()?);
        clay.find_bodies(plan.dividers());
        let (records, mut surface) = (clay.particles, readback.surface::<SurfaceParticle>()?);
        let mut has_changed = false;
        for (particle, found) in surface.iter_mut().zip(&records) {
            let (tags, body) = (packed_tags(found.tags), found.body);
            has_changed |= (particle.tags, particle.body) != (tags, body);
            (particle.tags, particle.body) = (tags, body);
        }
        if !has_changed {
            return Ok(Held::Device(readback));
        }
        self.queue.write_buffer(&self.buffers.records[self.source], 0, bytemuck::cast_slice(&records));
        self.queue.write_buffer(&self.buffers.surface, 0, bytemuck::cast_slice(&surface));
        self.classes = self.classes.max(classes_of(&records));
        report.sheets = records
            .iter()
            .map(|p| ClassKey::new(p.body, p.tags))
            .flat_map(|key| key.sides().collect::<Vec<_>>())
            .map(|s| s.0)
            .collect();
        report.body_max = records.iter().map(|p| p.body).max().unwrap_or(0);
        self.spare = Some(readback.recycle());
        Ok(Held::Found { records, surface })
    }
}
