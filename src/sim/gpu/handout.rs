//! What frames hand out beside their reports, and the state for those who ask while no frame is under way.

use super::super::engine::{EngineError, StatePromise};
use super::super::frame::FrameOutputs;
use super::handed::{self, Copy, Ended, Held};
use super::readback::{Progress, Readback};
use super::solver::{Solver, lost};
use std::sync::Arc;

impl Solver {
    /// Takes a request for the state: answered by the next frame whose end is encoded, or by a copy where
    /// there is none.
    pub(super) fn request(&mut self, promise: StatePromise) {
        if self.frames.is_empty() && self.handed.state.frame == self.reported {
            handed::answer(&self.handed.state, vec![promise]);
        } else {
            self.requests.push(promise);
        }
    }

    /// Encodes a copy of the state for those who asked while no frame is under way.
    pub(super) fn encode_copy(&mut self, encoder: &mut wgpu::CommandEncoder) -> bool {
        if self.requests.is_empty() || self.copy.is_some() {
            return false;
        }
        let readback = Readback::new(&self.device, &self.buffers, FrameOutputs { surface: false, state: true });
        readback.copy_state(encoder, &self.buffers, self.source);
        let (material, time, frame) = (self.material, self.time, self.reported);
        self.copy = Some(Copy { material, time, frame, readback, promises: std::mem::take(&mut self.requests) });
        self.is_copy_unsubmitted = true;
        true
    }

    /// Answers those whose copy of the state has come back.
    pub(super) fn finish_copy(&mut self) -> Result<(), EngineError> {
        let progress = self.copy.as_ref().map_or(Progress::Pending, |copy| copy.readback.progress());
        match progress {
            Progress::Pending => Ok(()),
            Progress::Lost => Err(lost()),
            Progress::Done => {
                let Some(Copy { material, time, frame, readback, promises }) = self.copy.take() else { return Ok(()) };
                let ended = Ended { domain: self.domain, material, time, frame, held: Held::Device(readback) };
                self.hand_out_state(Arc::new(ended), promises);
                Ok(())
            }
        }
    }

    /// Keeps a state as the newest, unless a newer one has come meanwhile, and answers those who asked for
    /// it.
    pub(super) fn hand_out_state(&mut self, ended: Arc<Ended>, promises: Vec<StatePromise>) {
        handed::answer(&ended, promises);
        if ended.frame >= self.handed.state.frame {
            let before = std::mem::replace(&mut self.handed.state, ended);
            self.spare = handed::spare(before).or_else(|| self.spare.take());
        }
    }

    /// Keeps what came back of the frame that has just been reported, as far as it was asked for.
    pub(super) fn hand_out(&mut self, readback: Readback, outputs: FrameOutputs, promises: Vec<StatePromise>) {
        let gives_state = outputs.state || !promises.is_empty();
        if !outputs.surface && !gives_state {
            self.spare = Some(readback.recycle());
            return;
        }
        let (domain, material, time, frame) = (self.domain, self.material, self.time, self.reported);
        let ended = Arc::new(Ended { domain, material, time, frame, held: Held::Device(readback) });
        if outputs.surface {
            let before = std::mem::replace(&mut self.handed.surface, ended.clone());
            self.spare = handed::spare(before).or_else(|| self.spare.take());
        }
        if gives_state {
            self.hand_out_state(ended, promises);
        }
    }
}
