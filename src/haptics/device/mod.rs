//! Haptic devices: drivers that own a clock and push a [`Servo`] once a tick.
//!
//! Units are SI and axes right-handed with Y up; a driver converts at its edge and nowhere else.

pub mod simulated;

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
    /// The device's clock \[s\].
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
    /// The force on the hand \[N\], in the device's frame, `dt` \[s\] after the tick before.
    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3;
}
