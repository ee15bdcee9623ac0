//! A device that may come and go, and a stand-in for the time without it.
//!
//! The servo is handed to and fro; whoever has it ticks it. Opening a device, starting and stopping one may
//! take a driver seconds: that is done aside, and [`Failover::poll`] never waits.

use super::fault::{DeviceError, DeviceEvent};
use super::{DevicePhase, HapticDevice, RunningDevice, Servo};
use std::sync::Arc;
use std::thread::JoinHandle;

/// Opens a device. Called from threads of its own.
pub type Open = dyn Fn() -> Result<Box<dyn HapticDevice>, DeviceError> + Send + Sync;

/// When a device that is away is tried again: after `first`, each time `growth` times later, up to `most`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Retry {
    /// \[s\]
    pub first: f64,
    /// \[-\]
    pub growth: f64,
    /// \[s\]
    pub most: f64,
}

impl Default for Retry {
    /// Two seconds: a plug that was pulled is in again and its driver ready. Half a minute at last: to try
    /// keeps a driver busy, and who plugs one in waits so long.
    fn default() -> Self {
        Self { first: 2.0, growth: 1.5, most: 30.0 }
    }
}

/// What [`Failover::poll`] tells.
#[derive(Debug)]
pub enum FailoverEvent {
    /// The device, or its stand-in, tells something.
    Device(DeviceEvent),
    /// The device has the servo.
    Here,
    /// The stand-in has it.
    StandIn,
    /// The device cannot be had; told once for each reason.
    Away(DeviceError),
    /// Nothing has the servo: it failed, or the stand-in did.
    Ended,
}

/// Who has the servo, after a change.
struct Moved {
    running: Option<Box<dyn RunningDevice>>,
    is_device: bool,
    error: Option<DeviceError>,
}

/// What is done aside.
enum Aside {
    Open(JoinHandle<Result<Box<dyn HapticDevice>, DeviceError>>),
    Move(JoinHandle<Moved>),
}

/// See the [module](self).
pub struct Failover {
    /// None where the stand-in is all there is.
    open: Option<Arc<Open>>,
    stand_in: Arc<Open>,
    retry: Retry,
    running: Option<Box<dyn RunningDevice>>,
    is_device: bool,
    aside: Option<Aside>,
    /// When the device is tried next \[s\], and how long after that \[s\].
    next: f64,
    pause: f64,
    /// The latest reason that was told.
    told: Option<String>,
}

impl Failover {
    /// Starts with the stand-in, and looks for the device at once.
    ///
    /// # Errors
    /// No thread is to be had.
    pub fn start(open: Arc<Open>, stand_in: Arc<Open>, retry: Retry, servo: Box<dyn Servo>) -> Result<Self, DeviceError> {
        Self::begin(Some(open), stand_in, retry, servo)
    }

    /// Starts with the stand-in, which is all there is: it is started anew when it is lost.
    ///
    /// # Errors
    /// No thread is to be had.
    pub fn alone(stand_in: Arc<Open>, servo: Box<dyn Servo>) -> Result<Self, DeviceError> {
        Self::begin(None, stand_in, Retry::default(), servo)
    }

    fn begin(open: Option<Arc<Open>>, stand_in: Arc<Open>, retry: Retry, servo: Box<dyn Servo>) -> Result<Self, DeviceError> {
        let mut failover = Self {
            open,
            stand_in: stand_in.clone(),
            retry,
            running: None,
            is_device: false,
            aside: None,
            next: f64::NEG_INFINITY,
            pause: retry.first,
            told: None,
        };
        failover.move_to(move || to_stand_in(&stand_in, Some(servo), None))?;
        Ok(failover)
    }

    /// What runs now; nothing while the servo changes hands.
    pub fn running(&mut self) -> Option<&mut dyn RunningDevice> {
        match &mut self.running {
            Some(running) => Some(running.as_mut()),
            None => None,
        }
    }

    /// Whether the device itself runs.
    pub fn is_here(&self) -> bool {
        self.is_device && self.running.is_some()
    }

    /// Ends all; the servo, if it did not fail. Waits for what is under way.
    pub fn stop(mut self) -> Option<Box<dyn Servo>> {
        match self.aside.take() {
            Some(Aside::Move(moving)) => self.running = moving.join().ok().and_then(|moved| moved.running),
            Some(Aside::Open(opening)) => drop(opening.join()),
            None => {}
        }
        self.running.take().and_then(|running| running.stop())
    }

    /// What happened next, at `now` \[s\] of any clock; nothing, most of the time. Ask until there is nothing.
    pub fn poll(&mut self, now: f64) -> Option<FailoverEvent> {
        // What the device said before it was lost comes before that.
        if let Some(event) = self.running.as_mut().and_then(|running| running.event()) {
            return Some(FailoverEvent::Device(event));
        }
        match self.aside.take() {
            Some(Aside::Open(opening)) if opening.is_finished() => self.opened(opening, now),
            Some(Aside::Move(moving)) if moving.is_finished() => self.moved(moving, now),
            Some(under_way) => {
                self.aside = Some(under_way);
                None
            }
            None => self.look(now),
        }
    }

    /// Starts what is due.
    fn look(&mut self, now: f64) -> Option<FailoverEvent> {
        let is_over = self.running.as_ref().is_some_and(|running| running.phase() != DevicePhase::Running);
        let begun = if is_over {
            let (stand_in, old) = (self.stand_in.clone(), self.running.take()?);
            (self.next, self.pause) = (now + self.retry.first, self.retry.first);
            self.move_to(move || to_stand_in(&stand_in, old.stop(), None))
        } else if !self.is_device
            && self.running.is_some()
            && now >= self.next
            && let Some(open) = self.open.clone()
        {
            self.aside("haptic device: open", move || open()).map(|opening| self.aside = Some(Aside::Open(opening)))
        } else {
            return None;
        };
        begun.err().and_then(|error| self.away(error, now))
    }

    /// A try has ended.
    fn opened(&mut self, opening: JoinHandle<Result<Box<dyn HapticDevice>, DeviceError>>, now: f64) -> Option<FailoverEvent> {
        let device = match opening.join() {
            Ok(Ok(device)) => device,
            Ok(Err(error)) => return self.away(error, now),
            Err(_) => return self.away(DeviceError::Thread(std::io::Error::other("the driver's opening panicked")), now),
        };
        // A stand-in that ended meanwhile has the servo all the same.
        let (stand_in, old) = (self.stand_in.clone(), self.running.take()?);
        let begun = self.move_to(move || match device_run(device, old.stop()) {
            Ok(running) => Moved { running: Some(running), is_device: true, error: None },
            Err((servo, error)) => to_stand_in(&stand_in, servo, error),
        });
        begun.err().and_then(|error| self.away(error, now))
    }

    /// The servo has changed hands.
    fn moved(&mut self, moving: JoinHandle<Moved>, now: f64) -> Option<FailoverEvent> {
        let Ok(Moved { running, is_device, error }) = moving.join() else { return Some(FailoverEvent::Ended) };
        (self.running, self.is_device) = (running, is_device);
        if is_device {
            (self.pause, self.told) = (self.retry.first, None);
            return Some(FailoverEvent::Here);
        }
        if self.running.is_none() {
            return Some(FailoverEvent::Ended);
        }
        match error {
            Some(error) => self.away(error, now),
            None => Some(FailoverEvent::StandIn),
        }
    }

    /// The device cannot be had; it is tried again later.
    fn away(&mut self, error: DeviceError, now: f64) -> Option<FailoverEvent> {
        self.next = now + self.pause;
        self.pause = (self.pause * self.retry.growth).min(self.retry.most);
        let text = error.to_string();
        let is_news = self.told.as_ref() != Some(&text);
        self.told = Some(text);
        is_news.then_some(FailoverEvent::Away(error))
    }

    fn move_to(&mut self, change: impl FnOnce() -> Moved + Send + 'static) -> Result<(), DeviceError> {
        self.aside = Some(Aside::Move(self.aside("haptic device: change", change)?));
        Ok(())
    }

    fn aside<T: Send + 'static>(
        &self,
        name: &str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<JoinHandle<T>, DeviceError> {
        Ok(std::thread::Builder::new().name(name.into()).spawn(work)?)
    }
}

/// Gives the stand-in the servo; `error` is why the device does not have it.
fn to_stand_in(stand_in: &Arc<Open>, servo: Option<Box<dyn Servo>>, error: Option<DeviceError>) -> Moved {
    let opened = stand_in();
    let (running, own_error) = match opened {
        Ok(device) => match device_run(device, servo) {
            Ok(running) => (Some(running), None),
            Err((_, own_error)) => (None, own_error),
        },
        Err(own_error) => (None, Some(own_error)),
    };
    Moved { running, is_device: false, error: own_error.or(error) }
}

type Unrun = (Option<Box<dyn Servo>>, Option<DeviceError>);

fn device_run(device: Box<dyn HapticDevice>, servo: Option<Box<dyn Servo>>) -> Result<Box<dyn RunningDevice>, Unrun> {
    let servo = servo.ok_or((None, None))?;
    device.run(servo).map_err(|not| (not.servo, Some(not.error)))
}

#[cfg(test)]
mod tests {
    use super::super::{DeviceInfo, DeviceState, NotStarted};
    use super::*;
    use glam::DVec3;
    use std::sync::atomic::{AtomicU32, Ordering};

    struct Nothing;

    impl Servo for Nothing {
        fn tick(&mut self, _state: &DeviceState, _dt: f64) -> DVec3 {
            DVec3::ZERO
        }
    }

    /// A device that starts or does not, is lost at once or runs on, and gives the servo back or breaks it.
    #[derive(Clone)]
    struct Mock {
        info: DeviceInfo,
        starts: bool,
        is_lost: bool,
        breaks: bool,
    }

    struct RunningMock(Mock, Box<dyn Servo>);

    impl HapticDevice for Mock {
        fn info(&self) -> &DeviceInfo {
            &self.info
        }

        fn run(self: Box<Self>, servo: Box<dyn Servo>) -> Result<Box<dyn RunningDevice>, NotStarted> {
            if self.starts {
                return Ok(Box::new(RunningMock(*self, servo)));
            }
            Err(NotStarted { error: DeviceError::Busy, servo: Some(servo) })
        }
    }

    impl RunningDevice for RunningMock {
        fn info(&self) -> &DeviceInfo {
            &self.0.info
        }

        fn phase(&self) -> DevicePhase {
            if self.0.is_lost { DevicePhase::Lost } else { DevicePhase::Running }
        }

        fn state(&mut self) -> Option<DeviceState> {
            None
        }

        fn event(&mut self) -> Option<DeviceEvent> {
            None
        }

        fn stop(self: Box<Self>) -> Option<Box<dyn Servo>> {
            (!self.0.breaks).then_some(self.1)
        }
    }

    fn mock(starts: bool, breaks: bool) -> Arc<Open> {
        let mock = Mock { starts, breaks, ..lost() };
        Arc::new(move || Ok(Box::new(Mock { is_lost: breaks, ..mock.clone() })))
    }

    /// A device that starts, is lost at once and gives the servo back.
    fn lost() -> Mock {
        let info = DeviceInfo {
            name: "mock".into(),
            serial: String::new(),
            freedoms: [3, 3],
            force_max: 1.0,
            continuous_force_max: 1.0,
            stiffness_max: 1.0,
            damping_max: 1.0,
            workspace: [DVec3::ZERO; 2],
            resolution: 1e-5,
            rate: 1000.0,
            buttons: 0,
        };
        Mock { info, starts: true, is_lost: true, breaks: false }
    }

    fn next(failover: &mut Failover, now: f64) -> FailoverEvent {
        // A test whose event does not come ends all the same, after half a minute and more.
        for _ in 0..30_000 {
            match failover.poll(now) {
                Some(event) => return event,
                None => std::thread::sleep(std::time::Duration::from_millis(1)),
            }
        }
        panic!("nothing was told");
    }

    #[test]
    fn a_device_that_opens_and_does_not_start_leaves_the_stand_in() {
        let mut failover = Failover::start(mock(false, false), mock(true, false), Retry::default(), Box::new(Nothing)).unwrap();
        assert!(matches!(next(&mut failover, 0.0), FailoverEvent::StandIn));
        assert!(matches!(next(&mut failover, 0.0), FailoverEvent::Away(DeviceError::Busy)));
        assert!(failover.running().is_some() && !failover.is_here());
        assert!(failover.poll(1.9).is_none() && failover.aside.is_none(), "too early");
        assert!(failover.poll(2.0).is_none() && failover.aside.is_some(), "tried again");
        assert!(failover.stop().is_some());
    }

    /// A device that was here and went is news again, and is tried as soon as the first time.
    #[test]
    fn a_device_that_goes_again_is_told_again() {
        let tries = AtomicU32::new(0);
        let open = Arc::new(move || {
            let is_there = tries.fetch_add(1, Ordering::Relaxed) == 1;
            if is_there { Ok(Box::new(lost()) as Box<dyn HapticDevice>) } else { Err(DeviceError::Busy) }
        });
        let mut failover = Failover::start(open, mock(true, false), Retry::default(), Box::new(Nothing)).unwrap();
        assert!(matches!(next(&mut failover, 0.0), FailoverEvent::StandIn));
        assert!(matches!(next(&mut failover, 0.0), FailoverEvent::Away(DeviceError::Busy)));
        assert!(matches!(next(&mut failover, 2.0), FailoverEvent::Here));
        assert!(matches!(next(&mut failover, 2.0), FailoverEvent::StandIn));
        assert!(matches!(next(&mut failover, 4.0), FailoverEvent::Away(DeviceError::Busy)));
        assert_eq!(failover.next, 6.0);
    }

    #[test]
    fn tries_are_ever_further_apart() {
        let tries = Arc::new(AtomicU32::new(0));
        let count = tries.clone();
        let open = Arc::new(move || {
            count.fetch_add(1, Ordering::Relaxed);
            Err(DeviceError::Busy)
        });
        let mut failover = Failover::start(open, mock(true, false), Retry::default(), Box::new(Nothing)).unwrap();
        // A clock of tenths of seconds that waits for what is done aside.
        for tenth in 0..1000 {
            while failover.poll(f64::from(tenth) * 0.1).is_some() || failover.aside.is_some() {
                std::thread::yield_now();
            }
        }
        // 0, 2, 5, 9.5, 16.25, 26.4, 41.6, 64.3, 94.3 s.
        assert_eq!(tries.load(Ordering::Relaxed), 9);
    }

    #[test]
    fn a_servo_that_failed_ends_all() {
        let mut failover = Failover::start(mock(true, true), mock(true, false), Retry::default(), Box::new(Nothing)).unwrap();
        assert!(matches!(next(&mut failover, 0.0), FailoverEvent::StandIn));
        assert!(matches!(next(&mut failover, 0.0), FailoverEvent::Here));
        assert!(matches!(next(&mut failover, 0.0), FailoverEvent::Ended));
        assert!(failover.running().is_none() && failover.poll(99.0).is_none());
        assert!(failover.stop().is_none());
    }

    #[test]
    fn a_driver_that_panics_is_a_device_that_is_away() {
        let open: Arc<Open> = Arc::new(|| panic!("a driver by plan"));
        let mut failover = Failover::start(open, mock(true, false), Retry::default(), Box::new(Nothing)).unwrap();
        assert!(matches!(next(&mut failover, 0.0), FailoverEvent::StandIn));
        assert!(matches!(next(&mut failover, 0.0), FailoverEvent::Away(DeviceError::Thread(_))));
        assert!(failover.running().is_some());
    }
}
