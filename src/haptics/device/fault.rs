//! What goes wrong with a device: errors before it runs, events while it does.

use thiserror::Error;

/// A device that cannot be had.
#[derive(Debug, Error)]
pub enum DeviceError {
    /// Its library is not there, or is another.
    #[error("{0}")]
    Library(String),
    /// Its library is there, and says no.
    #[error("the device did not open: {text} (error 0x{code:04x}, internal {internal}). {hint}")]
    Refused {
        /// The library's number for it.
        code: u32,
        /// The driver's number for it.
        internal: i32,
        /// The library's words for it.
        text: String,
        /// What helps.
        hint: &'static str,
    },
    /// This process has it open already: a library of this kind drives one.
    #[error("the device is open already in this program")]
    Busy,
    /// Its thread did not start.
    #[error("the device's thread did not start: {0}")]
    Thread(#[from] std::io::Error),
    /// A recording that is none.
    #[error("{path}, line {line}: {what}")]
    Trace {
        /// The file.
        path: String,
        /// Line, from 1.
        line: usize,
        /// What is wrong with it.
        what: String,
    },
}

/// A fault of a running device. While one lasts the device pushes nothing; [`Fault::Other`] excepted, which
/// is told only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// It does not know where its arm is.
    Uncalibrated,
    /// It gave up a force: too great, too sudden, too fast.
    Force,
    /// A motor is too hot.
    WarmMotors,
    /// What it senses is no number.
    Pose,
    /// What the servo asked for is no number.
    Command,
    /// The servo itself failed.
    Servo,
    /// It answers no more: unplugged, switched off, a cable.
    Lost,
    /// Another error of its library.
    Other,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 8] =
        [Self::Uncalibrated, Self::Force, Self::WarmMotors, Self::Pose, Self::Command, Self::Servo, Self::Lost, Self::Other];

    /// The fault's bit in a set of faults.
    pub const fn bit(self) -> u32 {
        1 << self as u32
    }

    /// Whether the device pushes nothing while it lasts.
    pub const fn is_muting(self) -> bool {
        !matches!(self, Self::Other)
    }

    /// Whether the loop is over with it.
    pub const fn is_final(self) -> bool {
        matches!(self, Self::Servo | Self::Lost)
    }

    /// What it means, and what helps.
    pub const fn message(self) -> &'static str {
        match self {
            Self::Uncalibrated => "the device is not calibrated: put the stylus into the inkwell and leave it there for a moment",
            Self::Force => "the device refused a force and pushes nothing for a moment",
            Self::WarmMotors => "the motors are too hot: no force until they are cooler",
            Self::Pose => "the device reports a place that is no number: no force until it is one",
            Self::Command => "a force that is no number was asked for, and none was given",
            Self::Servo => "the force loop failed and was ended: no force until the device is opened again",
            Self::Lost => "the device does not answer (unplugged, or switched off): no force until it is back",
            Self::Other => "the device's library reports an error",
        }
    }
}

/// Something that happened to a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceEvent {
    /// When, by the clock of [`DeviceState::time`](super::DeviceState::time) \[s\].
    pub time: f64,
    /// What.
    pub fault: Fault,
    /// Whether it began here or ended.
    pub has_begun: bool,
    /// The library's number for it; 0 if it has none.
    pub code: u32,
    /// The driver's number for it.
    pub internal: i32,
}

impl std::fmt::Display for DeviceEvent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if !self.has_begun {
            return write!(f, "over: {}", self.fault.message());
        }
        f.write_str(self.fault.message())?;
        if self.code != 0 {
            write!(f, " (error 0x{:04x}, internal {})", self.code, self.internal)?;
        }
        Ok(())
    }
}

/// Faults that last: each begins once and ends once, however often it is reported meanwhile. For drivers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Episodes {
    active: u32,
    /// When each was last reported \[s\].
    last: [f64; Fault::ALL.len()],
}

/// A fault that was not reported for this long is over \[s\]: a hundred ticks, so that one that is reported in
/// every tick or in every tenth is one.
const QUIET: f64 = 0.1;

impl Episodes {
    /// Reports a fault; whether it begins with it.
    pub fn report(&mut self, fault: Fault, time: f64) -> bool {
        self.last[fault as usize] = time;
        let is_new = self.active & fault.bit() == 0;
        self.active |= fault.bit();
        is_new
    }

    /// The faults that end now, as bits; none that is final.
    pub fn end(&mut self, time: f64) -> u32 {
        let is_over =
            |fault: &Fault| self.active & fault.bit() != 0 && !fault.is_final() && time - self.last[*fault as usize] > QUIET;
        let over = Fault::ALL.iter().filter(|f| is_over(f)).fold(0, |set, fault| set | fault.bit());
        self.active &= !over;
        over
    }

    /// The faults that last, as bits.
    pub fn active(&self) -> u32 {
        self.active
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_begins_and_ends_once() {
        let mut episodes = Episodes::default();
        assert!(episodes.report(Fault::Force, 1.0));
        assert!(!episodes.report(Fault::Force, 1.05));
        assert_eq!((episodes.end(1.14), episodes.active()), (0, Fault::Force.bit()));
        assert_eq!((episodes.end(1.16), episodes.active()), (Fault::Force.bit(), 0));
        assert!(episodes.report(Fault::Force, 2.0));
    }

    #[test]
    fn a_lost_device_stays_lost() {
        let mut episodes = Episodes::default();
        assert!(episodes.report(Fault::Lost, 1.0));
        assert_eq!((episodes.end(9.0), episodes.active()), (0, Fault::Lost.bit()));
    }

    #[test]
    fn bits_are_the_places_in_all() {
        for (i, fault) in Fault::ALL.iter().enumerate() {
            assert_eq!(fault.bit(), 1 << i, "{fault:?}");
        }
    }
}
