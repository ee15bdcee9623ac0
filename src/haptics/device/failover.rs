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
    open: Arc<Open>,
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
        } else if !self.is_device && self.running.is_some() && now >= self.next {
            let open = self.open.clone();
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
