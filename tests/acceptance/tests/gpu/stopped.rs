//! Engines that have stopped: who waits for a state learns that it will not come, and other clay runs.

use bevy_clay::prelude::*;
use bevy_clay::sim::engine::StateTicket;
use bevy_clay::sim::prelude::*;
use clay_acceptance::agreement::{self, Case};
use glam::IVec3;
use libtest_mimic::Failed;

fn case(steps: u32) -> Case {
    let s = agreement::block(IVec3::new(8, 8, 8), 1.0, Walls::default(), agreement::soft());
    let plan = FramePlan { outputs: FrameOutputs::NOTHING, ..agreement::plan(&s, 0.25, steps, vec![]) };
    Case { snapshot: s, plan }
}

/// An engine as an app has it, on a device of its own.
struct App {
    device: GpuDevice,
    engine: GpuEngine,
    link: GpuLink,
}

impl App {
    /// With the clay loaded.
    fn new(case: &Case) -> Result<Self, Failed> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let options = wgpu::RequestAdapterOptions::default();
        let adapter = pollster::block_on(instance.request_adapter(&options)).map_err(|e| e.to_string())?;
        let descriptor = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| e.to_string())?;
        let device = GpuDevice { device, queue, info: adapter.get_info() };
        let (mut engine, link) = GpuEngine::linked(device.clone()).map_err(|e| e.to_string())?;
        engine.load(&case.snapshot).map_err(|e| e.to_string())?;
        Ok(Self { device, engine, link })
    }

    /// Records and submits, as an app does once a frame; whether there was anything.
    fn record(&self) -> bool {
        let GpuDevice { device, queue, .. } = &self.device;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let is_recorded = self.link.encode(&mut encoder);
        if is_recorded {
            queue.submit([encoder.finish()]);
            self.link.submitted();
        }
        is_recorded
    }

    fn submit(&mut self, case: &Case) -> Result<(), Failed> {
        self.engine.submit(case.plan.clone()).map_err(|e| e.to_string().into())
    }

    fn ask(&mut self) -> Result<StateTicket, Failed> {
        self.engine.request_state().map_err(|e| e.to_string().into())
    }

    /// Why the engine has stopped: the same at every call. Who asks for its state only now is answered too.
    fn reason(&mut self, case: &Case) -> Result<String, Failed> {
        let reason = self.engine.poll().expect_err("a reason").to_string();
        assert_eq!(self.engine.poll().expect_err("a reason").to_string(), reason);
        assert_eq!(self.engine.submit(case.plan.clone()).expect_err("a reason").to_string(), reason);
        assert!(!self.record(), "it goes on");
        assert_lost([("asked for when it had stopped", self.ask()?)]);
        Ok(reason)
    }
}

#[track_caller]
fn assert_lost<const N: usize>(tickets: [(&str, StateTicket); N]) {
    for (name, mut ticket) in tickets {
        assert!(ticket.take().is_err(), "{name}: still waits for a state");
    }
}

/// The device is lost while states are waited for, wherever the requests stand: in a copy on its way, at the
/// end of a frame that has begun, behind frames, not taken up yet.
pub(crate) fn lost_device_answers_requests() -> Result<(), Failed> {
    let case = case(20);
    let mut app = App::new(&case)?;
    let mut encoder = app.device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    app.submit(&case)?;
    let copied = app.ask()?;
    assert!(app.link.encode(&mut encoder), "the first substeps");
    let at_the_end = app.ask()?;
    assert!(app.link.encode(&mut encoder), "the last substeps");
    let behind = app.ask()?;
    assert!(!app.link.encode(&mut encoder), "nothing");
    let untaken = app.ask()?;
    app.device.device.destroy();
    app.link.submitted();
    let reason = app.reason(&case)?;
    assert!(reason.contains("lost"), "{reason}");
    assert_lost([("copied", copied), ("at the end", at_the_end), ("behind", behind), ("not taken up", untaken)]);
    Ok(())
}

/// An app that finds the engine's commands faulty stops it, and who waits for its state is answered.
pub(crate) fn failed_link_answers_requests() -> Result<(), Failed> {
    let case = case(2);
    let mut app = App::new(&case)?;
    app.submit(&case)?;
    let ticket = app.ask()?;
    app.link.fail(EngineError::Stopped("commands refused".into()));
    assert_lost([("asked for before", ticket)]);
    assert!(app.reason(&case)?.contains("commands refused"));
    Ok(())
}
