//! A simulated arm in an operator's hand: in virtual time, where nothing depends on the machine, and in real
//! time on a thread of its own.

mod arm;
mod device;
mod path;
mod running;

pub use arm::{ArmSettings, DELAY_MAX, Operator, SimulatedArm};
pub use device::SimulatedDevice;
pub use path::HandPath;
pub use running::{RunningArm, Timing};

#[cfg(test)]
mod tests;
