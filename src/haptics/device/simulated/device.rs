//! The simulated arm as a device among others: what stands in for one that is away.

use super::super::fault::DeviceEvent;
use super::super::{DeviceInfo, DevicePhase, DeviceState, HapticDevice, NotStarted, RunningDevice, Servo};
use super::arm::SimulatedArm;
use super::running::RunningArm;
use crate::haptics::clock;
use glam::DVec3;
use std::sync::mpsc;

/// A simulated arm, ready to run in real time.
#[derive(Clone, Debug)]
pub struct SimulatedDevice {
    arm: SimulatedArm,
    info: DeviceInfo,
}

impl SimulatedDevice {
    /// The arm as it stands.
    pub fn new(arm: SimulatedArm) -> Self {
        let info = arm.info();
        Self { arm, info }
    }
}

/// The servo on the arm's thread: it sees the host's clock, leaves its states behind and comes back when the
/// thread ends.
struct Tap {
    servo: Option<Box<dyn Servo>>,
    /// The host's time at the arm's zero \[s\].
    origin: f64,
    states: triple_buffer::Input<Option<DeviceState>>,
    back: mpsc::Sender<Box<dyn Servo>>,
}

impl Servo for Tap {
    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        let state = DeviceState { time: self.origin + state.time, ..*state };
        self.states.write(Some(state));
        self.servo.as_mut().map_or(DVec3::ZERO, |servo| servo.tick(&state, dt))
    }
}

impl Drop for Tap {
    fn drop(&mut self) {
        // A servo that panicked is not used again. Where nobody waits for it, it goes.
        if !std::thread::panicking() {
            _ = self.servo.take().map(|servo| self.back.send(servo));
        }
    }
}

impl HapticDevice for SimulatedDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn run(self: Box<Self>, mut servo: Box<dyn Servo>) -> Result<Box<dyn RunningDevice>, NotStarted> {
        servo.begin(&self.info);
        let (states_in, states) = triple_buffer::triple_buffer(&None);
        let (back, servo_back) = mpsc::channel();
        let origin = clock::now() - self.arm.time();
        let tap = Tap { servo: Some(servo), origin, states: states_in, back };
        match self.arm.start(Box::new(tap)) {
            Ok(arm) => Ok(Box::new(RunningSimulated { info: self.info, arm, states, servo_back })),
            Err(error) => Err(NotStarted { error: error.into(), servo: servo_back.try_recv().ok() }),
        }
    }
}

struct RunningSimulated {
    info: DeviceInfo,
    arm: RunningArm,
    states: triple_buffer::Output<Option<DeviceState>>,
    servo_back: mpsc::Receiver<Box<dyn Servo>>,
}

impl RunningDevice for RunningSimulated {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn phase(&self) -> DevicePhase {
        if self.arm.is_over() { DevicePhase::Lost } else { DevicePhase::Running }
    }

    fn state(&mut self) -> Option<DeviceState> {
        *self.states.read()
    }

    fn event(&mut self) -> Option<DeviceEvent> {
        None
    }

    fn stop(self: Box<Self>) -> Option<Box<dyn Servo>> {
        let Self { arm, servo_back, .. } = *self;
        arm.stop()?;
        servo_back.try_recv().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::super::arm::{ArmSettings, Operator};
    use super::super::path::HandPath;
    use super::*;

    struct Count(u64);

    impl Servo for Count {
        fn begin(&mut self, info: &DeviceInfo) {
            assert!(info.force_max > 0.0);
        }

        fn tick(&mut self, state: &DeviceState, _dt: f64) -> DVec3 {
            assert!(self.0 < 1000, "a fault by plan");
            self.0 += 1;
            assert!((state.time - clock::now()).abs() < 60.0);
            DVec3::ZERO
        }
    }

    fn device() -> Box<SimulatedDevice> {
        let path = HandPath::new([(0.0, DVec3::ZERO)]);
        let settings = ArmSettings { operator: Operator::PINCH, ..ArmSettings::default() };
        Box::new(SimulatedDevice::new(SimulatedArm::new(settings, path)))
    }

    #[test]
    fn an_arm_hands_its_servo_back_and_tells_the_hosts_time() {
        let mut running = device().run(Box::new(Count(0))).map_err(|not| not.error).unwrap();
        while running.state().is_none() {
            std::thread::yield_now();
        }
        let state = running.state().unwrap();
        assert!(state.time > 0.0 && !state.is_muted && running.phase() == DevicePhase::Running);
        assert!(running.stop().is_some());
    }

    #[test]
    fn an_arm_whose_servo_panics_is_lost_and_gives_none_back() {
        let running = device().run(Box::new(Count(1000))).map_err(|not| not.error).unwrap();
        while running.phase() == DevicePhase::Running {
            std::thread::yield_now();
        }
        assert!(running.stop().is_none());
    }
}
