//! Frames on the device: what waits, what is under way, what came back; and what is done about trouble.

use super::super::engine::{EngineError, StateLost, StatePromise};
use super::super::frame::{FramePlan, FrameReport};
use super::super::health::Health;
use super::super::limits::REDO_MAX;
use super::super::material::ClayMaterial;
use super::super::params::Domain;
use super::super::snapshot::{Forecast, Particle, Snapshot};
use super::super::sums::{ParticleSums, judge};
use super::buffers::{self, Buffers, NodeSize};
use super::device::{GpuError, guarded};
use super::encode::{Encoding, Part, Work};
use super::handed::{Copy, Ended, Handed, Held};
use super::kernels::KernelSets;
use super::layout::{Status, flag};
use super::params::{Params, ParamsInput};
use super::readback::{Progress, Readback};
use super::report::{start_sums, sums};
use super::scales::{Scales, interval};
use super::stamps::Stamps;
use super::wgsl::CLASSES;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

/// How often a frame is redone for more room or finer bookkeeping before that counts as trouble of the clay.
/// Each doubles a bound, and from the least on speed to a cell a substep are 12: see docs/EVIDENCE.md.
const RETRY_MAX: u32 = 16;

/// Time on the device that clay takes of one frame of an app [s]: most of a sixtieth of a second; the rest is
/// for drawing. Clay that needs more takes several frames, and the app stays smooth.
const FRAME_SECONDS: f64 = 0.01;
/// Substeps in an app's frame before anything is known of the device.
const FIRST_STEPS: u32 = 16;

/// How much of the device's time a submission may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Share {
    /// As much as it wants: nothing else runs there.
    All,
    /// What leaves an app room to draw.
    Frame,
}

/// A plan on its way.
#[derive(Debug)]
pub(super) struct Frame {
    pub(super) plan: FramePlan,
    /// Halvings of the step.
    redone: u32,
    /// Redone for more room, more headroom or more re-bins.
    retries: u32,
    forecast: Forecast,
    scales: Scales,
    interval: u32,
    /// Substeps encoded.
    done: u32,
    health: Health,
    /// Failures among the reports handed out when it was submitted.
    failures: u64,
    readback: Option<Readback>,
    /// Who gets the state at its end.
    pub(super) promises: Vec<StatePromise>,
    began: Instant,
}

impl Frame {
    fn dt(&self) -> f64 {
        self.plan.dt / f64::from(1u32 << self.redone)
    }

    fn steps(&self) -> u32 {
        self.plan.steps << self.redone
    }

    /// Chooses scales and re-bins for the present step.
    fn fit(&mut self, domain: &Domain, mass_max: f64) {
        self.scales = Scales::new(&self.plan, domain, self.dt(), &self.forecast, mass_max);
        self.interval = interval(&self.plan, domain, self.dt(), &self.forecast);
    }

    fn is_encoded(&self) -> bool {
        self.done == self.steps()
    }
}

/// The device is gone.
pub(super) fn lost() -> EngineError {
    EngineError::Stopped("the graphics device was lost".into())
}

/// One clay on a device.
pub(super) struct Solver {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) domain: Domain,
    pub(super) buffers: Buffers,
    pub(super) kernels: Arc<KernelSets>,
    pub(super) stamps: Option<Stamps>,
    pub(super) frames: VecDeque<Frame>,
    /// The records that hold the end of the last reported frame.
    pub(super) source: usize,
    pub(super) clears_flags: bool,
    /// Classes of clay that may meet in one place: 1 until a particle can have a side or be of another body.
    pub(super) classes: u32,
    pub(super) mass_unit: f64,
    /// Greatest mass of a particle, in mass units.
    pub(super) mass_max: f64,
    /// What is known at the ends of the frames before the next, by the parity of their number.
    pub(super) forecasts: [Forecast; 2],
    pub(super) reported: usize,
    pub(super) sums: ParticleSums,
    pub(super) quarantined: Vec<u32>,
    pub(super) time: f64,
    pub(super) handed: Handed,
    /// The material of the last reported frame.
    pub(super) material: ClayMaterial,
    /// Requests for a state that nothing on its way to the device answers.
    pub(super) requests: Vec<StatePromise>,
    pub(super) copies: VecDeque<Copy>,
    /// Frames that failed.
    pub(super) failures: u64,
    #[cfg(feature = "reference")]
    pub(super) last_scales: Scales,
    pub(super) reruns: u64,
    /// Time of a substep on the device, in the last frame \[s\].
    pub(super) substep_seconds: Option<f64>,
    /// A readback nobody reads any more.
    pub(super) spare: Option<Readback>,
    /// The frame whose readback the submission now being made fills.
    pub(super) unsubmitted: Option<usize>,
}

impl Solver {
    /// Puts `particles`, finite and inside the domain's room, on the device.
    ///
    /// # Errors
    /// A limit of the device, or memory it does not have.
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        kernels: Arc<KernelSets>,
        snapshot: &Snapshot,
        particles: Vec<Particle>,
        quarantined: Vec<u32>,
    ) -> Result<Self, GpuError> {
        let domain = snapshot.domain;
        let count = u32::try_from(particles.len()).unwrap_or(u32::MAX);
        let classes = super::report::classes_of(&particles);
        let size = NodeSize { slots: buffers::slot_capacity(buffers::block_count(&particles)), classes, tools: 1 };
        buffers::check_limits(&device.limits(), count, &domain, size)?;
        let made = guarded(device, "the clay's buffers", || Buffers::new(device, count, &domain, size))?;
        queue.write_buffer(&made.records[0], 0, bytemuck::cast_slice(&particles));
        let surface: Vec<_> = particles.iter().map(|p| super::report::surface_particle(p, domain.cell_width)).collect();
        queue.write_buffer(&made.surface, 0, bytemuck::cast_slice(&surface));
        let mass_unit = super::report::mass_unit(&domain);
        let mass_max = super::report::mass_max(&particles, mass_unit);
        let forecasts =
            snapshot.forecasts.unwrap_or_else(|| [super::report::forecast(&snapshot.material, &domain, &particles, mass_max); 2]);
        Ok(Self {
            device: device.clone(),
            queue: queue.clone(),
            domain,
            buffers: made,
            kernels,
            stamps: Stamps::new(device, queue),
            frames: VecDeque::new(),
            source: 0,
            clears_flags: true,
            classes,
            mass_unit,
            mass_max,
            forecasts,
            reported: 0,
            sums: start_sums(&domain, &particles),
            quarantined,
            time: snapshot.time,
            handed: Handed::new(Ended {
                domain,
                material: snapshot.material,
                time: snapshot.time,
                frame: 0,
                forecasts,
                held: Held::Loaded(particles),
            }),
            material: snapshot.material,
            requests: vec![],
            copies: VecDeque::new(),
            #[cfg(feature = "reference")]
            last_scales: Scales::default(),
            failures: 0,
            reruns: 0,
            substep_seconds: None,
            spare: None,
            unsubmitted: None,
        })
    }

    /// What frames have handed out.
    pub(super) fn handed(&self) -> Handed {
        self.handed.clone()
    }

    /// The clay's buffers.
    pub(super) fn buffers(&self) -> &Buffers {
        &self.buffers
    }

    /// The scales of the last frame.
    #[cfg(feature = "reference")]
    pub(super) fn last_scales(&self) -> Scales {
        self.last_scales
    }

    /// The rest volume of mass 1 [m^3].
    #[cfg(feature = "reference")]
    pub(super) fn mass_unit(&self) -> f64 {
        self.mass_unit
    }

    /// Frames that failed; those given up with them are not counted.
    pub(super) fn failures(&self) -> u64 {
        self.failures
    }

    /// How often frames were run again, for whatever reason.
    pub(super) fn reruns(&self) -> u64 {
        self.reruns
    }

    /// Takes a plan. It is made from what is known of the frame two before it, so that a run depends on its
    /// plans alone. `failures` counts the frames given up of whose reports the plan's maker knew.
    pub(super) fn push(&mut self, plan: FramePlan, failures: u64) {
        let forecast = self.forecasts[(self.reported + self.frames.len()) % 2];
        let mut frame = Frame {
            scales: Scales::default(),
            interval: 1,
            forecast,
            plan,
            redone: 0,
            retries: 0,
            done: 0,
            health: Health::OK,
            failures,
            readback: None,
            promises: vec![],
            began: Instant::now(),
        };
        frame.fit(&self.domain, self.mass_max);
        self.frames.push_back(frame);
    }

    /// Encodes the next submission, if there is anything to run. At most two frames are encoded at a
    /// time.
    ///
    /// # Errors
    /// A plan that asks for more than the device has.
    pub(super) fn encode(&mut self, encoder: &mut wgpu::CommandEncoder, share: Share) -> Result<bool, GpuError> {
        if self.is_doomed() {
            return Ok(false);
        }
        let Some(index) = self.frames.iter().take(self.frames_ahead()).position(|f| !f.is_encoded()) else {
            return Ok(self.frames.is_empty() && self.encode_copy(encoder, 0));
        };
        self.make_room(index)?;
        if self.frames[index].done == 0 {
            // Who asked before this frame was begun does not want to see it.
            self.encode_copy(encoder, index);
        }
        let source = (self.source + index) % 2;
        // Halved or not, a frame lasts as long as it was planned to.
        let start = self.frames.iter().take(index).fold(self.time, |time, frame| time + frame.plan.duration());
        let frame = &mut self.frames[index];
        let most = match (share, self.substep_seconds) {
            (Share::All, _) => u32::MAX,
            (Share::Frame, None) => FIRST_STEPS,
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates, as it should")]
            (Share::Frame, Some(seconds)) => (FRAME_SECONDS / seconds) as u32,
        };
        let part = Part::next(frame.done, frame.steps(), frame.interval, most);
        let dt = frame.dt();
        let params = Params::new(&ParamsInput {
            domain: &self.domain,
            plan: &frame.plan,
            dt,
            start,
            scales: frame.scales,
            particle_count: self.buffers.particle_count,
            slot_capacity: self.buffers.size.slots,
            mass_unit: self.mass_unit,
            starts_frame: part.starts,
        });
        let kernels = self.kernels.get(self.buffers.size.classes)?;
        let (device, queue, buffers) = (&self.device, &self.queue, &self.buffers);
        let clears_flags = std::mem::take(&mut self.clears_flags);
        let (domain, plan) = (&self.domain, &frame.plan);
        let work = Work { device, queue, kernels, buffers, domain, plan, dt, params, source, clears_flags };
        Encoding::new(work, self.stamps.as_ref()).run(encoder, &part);
        frame.done += part.steps;
        if part.ends {
            frame.promises.append(&mut self.requests);
            let outputs = frame.read_back();
            let spare = self.spare.take().filter(|r| r.fits(&self.buffers, outputs));
            let readback = spare.unwrap_or_else(|| Readback::new(&self.device, &self.buffers, outputs));
            readback.copy(encoder, &self.buffers, 1 - source, self.stamps.as_ref());
            frame.readback = Some(readback);
            self.unsubmitted = Some(index);
        }
        Ok(true)
    }

    /// To be called after what was encoded was submitted.
    pub(super) fn submitted(&mut self) {
        let readback = self.unsubmitted.take().and_then(|i| self.frames.get(i)?.readback.as_ref());
        if let Some(readback) = readback {
            readback.map();
        }
        self.map_copies();
    }

    /// Makes the buffers of nodes fit the frame: classes for a cut, poses for its tools.
    fn make_room(&mut self, index: usize) -> Result<(), GpuError> {
        let plan = &self.frames[index].plan;
        if plan.divides() {
            self.classes = self.classes.max(CLASSES[1]);
        }
        let tools = self.buffers.size.tools.max(plan.tools.len() as u32);
        let size = NodeSize { classes: self.classes, tools, ..self.buffers.size };
        // Only between frames: a frame's impulses are summed up in one buffer.
        if size == self.buffers.size || self.frames[index].done > 0 { Ok(()) } else { self.resize(size) }
    }

    fn resize(&mut self, size: NodeSize) -> Result<(), GpuError> {
        buffers::check_limits(&self.device.limits(), self.buffers.particle_count, &self.domain, size)?;
        let (device, buffers) = (&self.device, &mut self.buffers);
        guarded(device, "the nodes' buffers", || buffers.resize(device, size))
    }

    /// The next report, if the device has ended a frame; redoes frames that failed.
    ///
    /// # Errors
    /// The device is lost, or has not the room that the clay needs by now.
    pub(super) fn poll(&mut self) -> Result<Option<FrameReport>, EngineError> {
        self.finish_copies()?;
        if self.is_doomed() {
            return Ok(self.give_up());
        }
        let Some(readback) = self.frames.front().and_then(|f| f.readback.as_ref()) else { return Ok(None) };
        match readback.progress() {
            Progress::Pending => return Ok(None),
            Progress::Lost => return Err(lost()),
            Progress::Done => {}
        }
        let gone = |StateLost| lost();
        let status = readback.status().map_err(gone)?;
        let whole = (self.sums.count, self.sums.volume);
        let totals = readback.totals().map_err(gone)?;
        let (sums, reach) = sums(&self.domain, self.mass_unit, &totals, self.frames[0].dt(), whole);
        if status.flags == 0 && sums.is_finite() && reach.is_finite() {
            return self.finish(&status, sums, reach).map_err(gone);
        }
        if status.flags == 0 {
            // Where `total` finds such a sum it raises a flag, which keeps the frame's start for another try.
            return Err(EngineError::Stopped("the graphics device added up finite numbers to others".into()));
        }
        self.recover(&status).map_err(EngineError::from)
    }

    /// Takes out the first frame. The one behind it may be encoded and not submitted yet: an app's poll comes
    /// at any time.
    fn pop(&mut self) -> Option<Frame> {
        self.unsubmitted = self.unsubmitted.and_then(|index| index.checked_sub(1));
        self.frames.pop_front()
    }

    /// A frame has ended well.
    fn finish(&mut self, status: &Status, sums: ParticleSums, reach: f64) -> Result<Option<FrameReport>, StateLost> {
        let Some(mut frame) = self.pop() else { return Ok(None) };
        let Some(readback) = frame.readback.take() else { return Ok(None) };
        let (dt, steps) = (frame.dt(), frame.steps());
        self.time += dt * f64::from(steps);
        let mut report = FrameReport { redone: frame.redone, dt, steps, time: self.time, ..FrameReport::new(&frame.plan) };
        sums.write(&mut report, &frame.plan);
        report.momentum_before = self.sums.momentum * frame.plan.inertial_density();
        super::report::add_status(&mut report, &frame.plan, status);
        let tools = self.buffers.size.tools.min(frame.plan.tools.len() as u32) as usize;
        super::report::add_impulses(&mut report, &frame.plan, &self.domain, self.mass_unit, &readback.impulses()?, tools);
        super::report::add_grid_mass(&mut report, &frame.plan, self.mass_unit, frame.scales.mass, &readback.masses()?);
        report.has_loose_clay = super::report::has_loose_clay(&frame.plan, &readback.blocks()?, status);
        report.health.insert(frame.health);
        judge(&mut report, &self.quarantined);
        if let Some(stamps) = &self.stamps {
            report.timings = stamps.timings(&readback.stamps()?, steps, steps.div_ceil(frame.interval));
            let t = &report.timings;
            self.substep_seconds = Some((t.rebin + t.grid + t.particles) / f64::from(steps));
        } else {
            report.timings.total = frame.began.elapsed().as_secs_f64();
        }
        let unit = self.domain.cell_width / dt;
        #[cfg(feature = "reference")]
        {
            self.last_scales = frame.scales;
        }
        self.forecasts[self.reported % 2] = Forecast {
            reach: reach * unit,
            speed: f64::from(status.speed) * unit,
            cell_count: status.cell_count,
            node_mass: f64::from(status.node_mass) / f64::from(frame.scales.mass),
        };
        self.reported += 1;
        self.tell_copies();
        self.source = 1 - self.source;
        self.sums = sums;
        self.material = frame.plan.material;
        report.bytes_read_back = readback.bytes();
        let held = self.find_bodies(readback, &frame.plan, &mut report)?;
        self.hand_out(held, frame.plan.outputs, frame.promises);
        Ok(Some(report))
    }

    /// The first frame failed, and what was encoded after it did nothing: mends what can be mended and runs
    /// them again.
    fn recover(&mut self, status: &Status) -> Result<Option<FrameReport>, GpuError> {
        self.clears_flags = true;
        self.reruns += 1;
        self.drop_copies();
        for frame in &mut self.frames {
            (frame.done, frame.readback) = (0, None);
            self.requests.append(&mut frame.promises);
        }
        let Some(frame) = self.frames.front_mut() else { return Ok(None) };
        let has = |bit| status.flags & bit != 0;
        let mut is_retry = frame.retries < RETRY_MAX && !has(flag::SPEED | flag::NON_FINITE);
        is_retry &= !has(flag::MARGIN) || frame.interval > 1;
        if is_retry {
            frame.retries += 1;
            if has(flag::MARGIN) {
                frame.interval /= 2;
            }
            if has(flag::OVERFLOW) {
                frame.scales = frame.scales.relaxed(status, self.mass_max);
            }
            let mut size = self.buffers.size;
            if has(flag::CAPACITY) {
                size.slots = buffers::slot_capacity(status.slot_count as usize);
            }
            if has(flag::CROWDED) {
                self.classes = CLASSES.into_iter().find(|c| *c > size.classes).unwrap_or(size.classes);
                size.classes = self.classes;
            }
            if size != self.buffers.size {
                return self.resize(size).map(|()| None);
            }
            return Ok(None);
        }
        frame.health.insert(super::report::trouble(status.flags));
        if frame.redone < REDO_MAX {
            (frame.redone, frame.retries) = (frame.redone + 1, 0);
            frame.fit(&self.domain, self.mass_max);
            return Ok(None);
        }
        self.failures += 1;
        Ok(self.give_up())
    }

    /// What is known to the next frame and to the one after it.
    pub(super) fn next_forecasts(&self) -> [Forecast; 2] {
        [0, 1].map(|after| self.forecasts[(self.reported + after) % 2])
    }

    /// Whether the first frame was planned for a state that never came.
    fn is_doomed(&self) -> bool {
        self.frames.front().is_some_and(|frame| frame.failures < self.failures)
    }

    /// The first frame is given up: the clay stands as before it.
    fn give_up(&mut self) -> Option<FrameReport> {
        let mut frame = self.pop()?;
        self.requests.append(&mut frame.promises);
        let mut report = FrameReport { redone: frame.redone, time: self.time, ..FrameReport::new(&frame.plan) };
        self.sums.write(&mut report, &frame.plan);
        report.momentum_before = report.momentum;
        report.grid_mass = report.particle_mass;
        super::report::add_status(&mut report, &frame.plan, &Status::default());
        report.health = frame.health;
        report.health.insert(Health::GIVEN_UP);
        judge(&mut report, &self.quarantined);
        report.timings.total = frame.began.elapsed().as_secs_f64();
        self.forecasts[self.reported % 2] = self.forecasts[(self.reported + 1) % 2];
        self.reported += 1;
        self.tell_copies();
        Some(report)
    }
}
