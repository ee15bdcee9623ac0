//! Haptic devices: drivers that own a clock and push a [`Servo`] once a tick.
//!
//! Units are SI and axes right-handed with Y up; a driver converts at its edge and nowhere else.
//!
//! | file          | what                                                                            |
//! |---------------|---------------------------------------------------------------------------------|
//! | [`fault`]     | what goes wrong with a device, and how it is told                               |
//! | [`failover`]  | a stand-in while a device is lost, and the device again when it is back         |
//! | `hd`, `touch` | 3D Systems Touch by HDAPI, loaded at run time (feature `touch`)                 |
//! | [`trace`]     | a recorded hand, from a file                                                    |
//! | [`vibration`] | controllers that shake and do not push                                          |
//! | [`usb`]       | haptic devices on this machine's USB                                            |

pub mod failover;
pub mod fault;
#[cfg(feature = "touch")]
pub mod hd;
pub mod simulated;
#[cfg(feature = "touch")]
pub mod touch;
pub mod trace;
pub mod usb;
pub mod vibration;

use fault::{DeviceError, DeviceEvent};
use glam::{DQuat, DVec3};

/// What a device says of itself.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceInfo {
    /// Its name, as people call it.
    pub name: String,
    /// Its serial number; empty if it has none.
    pub serial: String,
    /// Axes that it senses, and those that it drives.
    pub freedoms: [u32; 2],
    /// Greatest force \[N\].
    pub force_max: f64,
    /// Greatest force that it holds for as long as one likes \[N\].
    pub continuous_force_max: f64,
    /// Greatest stiffness that it renders, as its maker says \[N/m\].
    pub stiffness_max: f64,
    /// Greatest damping that it renders, as its maker says \[N s/m\].
    pub damping_max: f64,
    /// Least and greatest position that it reaches \[m\].
    pub workspace: [DVec3; 2],
    /// Least motion that it senses \[m\].
    pub resolution: f64,
    /// Ticks a second \[Hz\].
    pub rate: f64,
    /// How many buttons it has.
    pub buttons: u32,
}

/// What a device senses in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceState {
    /// The device's clock \[s\]; the host's ([`clock::now`](super::clock::now)) where it has none.
    pub time: f64,
    /// Where the tip is, in the device's frame \[m\].
    pub position: DVec3,
    /// How the tip is turned.
    pub rotation: DQuat,
    /// How the tip moves, as the driver smooths it \[m/s\].
    pub velocity: DVec3,
    /// Buttons held: bit i is button i.
    pub buttons: u32,
    /// Temperature of the hottest motor, from cold (0) to its limit (1).
    pub motor_temperature: f64,
    /// Whether the device asks for no force in this tick: uncalibrated, a force error, a motor that is too
    /// hot.
    pub is_muted: bool,
}

/// The loop of force. Called by a driver once a tick, from its own thread: it neither allocates, locks, logs
/// nor waits.
pub trait Servo: Send {
    /// A device takes the servo up; its first tick follows. Called aside from the loop: it may take its time.
    fn begin(&mut self, info: &DeviceInfo) {
        let _ = info;
    }

    /// The force on the hand \[N\], in the device's frame, `dt` \[s\] after the tick before.
    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3;
}

/// A device that was opened: it senses and pushes nothing until it runs.
pub trait HapticDevice: Send {
    /// What it says of itself.
    fn info(&self) -> &DeviceInfo;

    /// Runs `servo` once a tick, from a thread that is the device's own, until it is stopped or lost.
    ///
    /// # Errors
    /// A device that does not start; the servo comes back with the reason.
    fn run(self: Box<Self>, servo: Box<dyn Servo>) -> Result<Box<dyn RunningDevice>, NotStarted>;
}

/// A device that did not start, and the servo that it was to run.
pub struct NotStarted {
    /// Why.
    pub error: DeviceError,
    /// As it was given; none if it failed meanwhile.
    pub servo: Option<Box<dyn Servo>>,
}

/// What a running device is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DevicePhase {
    /// It ticks.
    Running,
    /// It is gone: it ticks no more and pushes nothing. Stop it, and open it anew.
    Lost,
    /// It came to its end: a trace that was played.
    Ended,
}

/// A device that ticks. Nothing here waits for the loop, [`RunningDevice::stop`] excepted.
pub trait RunningDevice: Send {
    /// What it says of itself.
    fn info(&self) -> &DeviceInfo;

    /// What it is about.
    fn phase(&self) -> DevicePhase;

    /// Its latest state; none before the first tick.
    fn state(&mut self) -> Option<DeviceState>;

    /// The next thing that happened to it.
    fn event(&mut self) -> Option<DeviceEvent>;

    /// Pushes nothing any more, ends the loop and hands the servo back; none if the servo itself failed.
    fn stop(self: Box<Self>) -> Option<Box<dyn Servo>>;
}
