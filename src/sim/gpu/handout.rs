//! What frames hand out beside their reports, and the state for those who ask while no frame is under way.

use super::super::engine::{EngineError, StatePromise};
use super::super::frame::FrameOutputs;
use super::handed::{self, Copy, Ended, Held};
use super::readback::{Progress, Readback};
use super::solver::{Solver, lost};
use std::collections::VecDeque;
use std::sync::Arc;

impl Solver {
    /// Takes a request for the state: answered by the end of a frame that has begun, or by a copy before the
    /// next one begins.
    pub(super) fn request(&mut self, promise: StatePromise) {
        if self.frames.is_empty() && self.handed.state.frame == self.reported {
            handed::answer(&self.handed.state, vec![promise]);
        } else {
            self.requests.push(promise);
        }
    }

    /// Encodes a copy of the state for those who asked: that at the end of the first `ahead` of the frames
    /// under way, which are encoded already. Returns whether anybody did.
    pub(super) fn encode_copy(&mut self, encoder: &mut wgpu::CommandEncoder, ahead: usize) -> bool {
        if self.requests.is_empty() {
            return false;
        }
        let readback = Readback::new(&self.device, &self.buffers, FrameOutputs { state: true, ..FrameOutputs::NOTHING });
        readback.copy_state(encoder, &self.buffers, (self.source + ahead) % 2);
        let time = self.frames.iter().take(ahead).fold(self.time, |time, frame| time + frame.plan.duration());
        let before = ahead.checked_sub(1).and_then(|i| self.frames.get(i));
        let material = before.map_or(self.material, |frame| frame.plan.material);
        let promises = std::mem::take(&mut self.requests);
        let (frame, forecasts) = (self.reported + ahead, self.next_forecasts());
        self.copies.push_back(Copy { material, time, frame, forecasts, readback, is_submitted: false, promises });
        true
    }

    /// A frame has been reported: copies of the state at its end learn what is known by then.
    pub(super) fn tell_copies(&mut self) {
        let forecasts = self.next_forecasts();
        for copy in self.copies.iter_mut().filter(|copy| copy.frame == self.reported) {
            copy.forecasts = forecasts;
        }
    }

    /// Maps the copies that were submitted.
    pub(super) fn map_copies(&mut self) {
        for copy in self.copies.iter_mut().filter(|copy| !copy.is_submitted) {
            copy.readback.map();
            copy.is_submitted = true;
        }
    }

    /// Forgets the copies that were made of frames that failed: they are asked for again.
    pub(super) fn drop_copies(&mut self) {
        let (kept, failed) = std::mem::take(&mut self.copies).into_iter().partition(|copy| copy.frame <= self.reported);
        self.copies = kept;
        let failed: VecDeque<Copy> = failed;
        self.requests.extend(failed.into_iter().flat_map(|copy| copy.promises));
    }

    /// Forgets who asked: the device hands out no more states.
    pub(super) fn drop_requests(&mut self) {
        self.requests.clear();
        self.frames.iter_mut().for_each(|frame| frame.promises.clear());
        self.copies.iter_mut().for_each(|copy| copy.promises.clear());
    }

    /// Answers those whose copy of the state has come back, when the frames that led to it are reported.
    pub(super) fn finish_copies(&mut self) -> Result<(), EngineError> {
        while let Some(copy) = self.copies.front().filter(|copy| copy.frame <= self.reported) {
            match copy.readback.progress() {
                Progress::Pending => break,
                Progress::Lost => return Err(lost()),
                Progress::Done => {
                    let Some(Copy { material, time, frame, forecasts, readback, promises, .. }) = self.copies.pop_front() else {
                        break;
                    };
                    let ended = Ended { domain: self.domain, material, time, frame, forecasts, held: Held::Device(readback) };
                    self.hand_out_state(Arc::new(ended), promises);
                }
            }
        }
        Ok(())
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
    pub(super) fn hand_out(&mut self, held: Held, outputs: FrameOutputs, promises: Vec<StatePromise>) {
        let gives_state = outputs.state || !promises.is_empty();
        if !outputs.surface && !gives_state {
            self.spare = held.recycled().or_else(|| self.spare.take());
            return;
        }
        let (domain, material, time, frame) = (self.domain, self.material, self.time, self.reported);
        let ended = Ended { domain, material, time, frame, forecasts: self.next_forecasts(), held };
        let ended = Arc::new(ended);
        if outputs.surface {
            let before = std::mem::replace(&mut self.handed.surface, ended.clone());
            self.spare = handed::spare(before).or_else(|| self.spare.take());
        }
        if gives_state {
            self.hand_out_state(ended, promises);
        }
    }
}
