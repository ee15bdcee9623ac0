//! Which faults of an arm last: each begins once and ends once, whatever ends it.

use super::events::HapticFault;
use crate::haptics::device::fault::Fault;
use bevy::prelude::Entity;

/// Where a fault comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// A running device tells it.
    Device(Fault),
    /// The device cannot be had.
    Away,
    /// Nothing has the hand's loop any more.
    Failed,
}

impl Cause {
    /// Whether a fault of `self` has said already what one of `other` would say: that the loop failed where
    /// the servo did, that a device does not open which was lost.
    fn covers(self, other: Self) -> bool {
        matches!((self, other), (Self::Device(Fault::Lost), Self::Away) | (Self::Device(Fault::Servo), Self::Away | Self::Failed))
    }

    /// Whether it is over once another device has the loop: a device that is gone tells no ends.
    fn goes_with_its_device(self) -> bool {
        matches!(self, Self::Device(fault) if !fault.is_final())
    }
}

/// A fault that begins or ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct FaultNews {
    cause: Cause,
    pub(super) has_begun: bool,
    pub(super) message: String,
}

impl FaultNews {
    /// What an app is told of it, as one of its tool's.
    pub(super) fn event(self, entity: Entity) -> HapticFault {
        let fault = match self.cause {
            Cause::Device(fault) => Some(fault),
            Cause::Away | Cause::Failed => None,
        };
        HapticFault { entity, fault, has_begun: self.has_begun, message: self.message }
    }
}

/// The faults that last, with their messages; the latest last.
#[derive(Clone, Debug, Default)]
pub(super) struct LastingFaults(Vec<(Cause, String)>);

impl LastingFaults {
    /// The latest fault's message.
    pub(super) fn message(&self) -> Option<&str> {
        self.0.last().map(|(_, message)| message.as_str())
    }

    /// A fault is there: told if it is new. A device that is away for another reason than before is told
    /// anew.
    pub(super) fn begin(&mut self, cause: Cause, message: String, news: &mut Vec<FaultNews>) {
        let is_known =
            |(old, said): &(Cause, String)| old.covers(cause) || (*old == cause && (cause != Cause::Away || *said == message));
        if self.0.iter().any(is_known) {
            return;
        }
        self.end(|old| old == cause, news);
        news.push(FaultNews { cause, has_begun: true, message: message.clone() });
        self.0.push((cause, message));
    }

    /// A device tells that a fault is over.
    pub(super) fn end_of(&mut self, fault: Fault, news: &mut Vec<FaultNews>) {
        self.end(|cause| cause == Cause::Device(fault), news);
    }

    /// Another device has the loop: the one before tells no more.
    pub(super) fn end_of_device(&mut self, news: &mut Vec<FaultNews>) {
        self.end(Cause::goes_with_its_device, news);
    }

    /// All is well again, or nobody asks any more.
    pub(super) fn end_all(&mut self, news: &mut Vec<FaultNews>) {
        self.end(|_| true, news);
    }

    fn end(&mut self, is_over: impl Fn(Cause) -> bool, news: &mut Vec<FaultNews>) {
        let over = self.0.extract_if(.., |(cause, _)| is_over(*cause));
        news.extend(over.map(|(cause, message)| FaultNews { cause, has_begun: false, message: format!("over: {message}") }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What was told, in words.
    fn told(news: &mut Vec<FaultNews>) -> Vec<String> {
        let sign = |begun| if begun { '+' } else { '-' };
        news.drain(..).map(|n| format!("{}{:?}: {}", sign(n.has_begun), n.cause, n.message)).collect()
    }

    #[test]
    fn each_fault_begins_once_and_has_its_own_end() {
        let (mut faults, mut news) = (LastingFaults::default(), vec![]);
        faults.begin(Cause::Device(Fault::WarmMotors), "warm".into(), &mut news);
        faults.begin(Cause::Device(Fault::Force), "force".into(), &mut news);
        faults.begin(Cause::Device(Fault::Force), "force".into(), &mut news);
        assert_eq!(told(&mut news), ["+Device(WarmMotors): warm", "+Device(Force): force"]);
        faults.end_of(Fault::Force, &mut news);
        assert_eq!(told(&mut news), ["-Device(Force): over: force"]);
        assert_eq!(faults.message(), Some("warm"), "the other lasts");
        faults.end_of(Fault::Force, &mut news);
        assert!(news.is_empty(), "over once");
        faults.end_all(&mut news);
        assert_eq!((told(&mut news), faults.message()), (vec!["-Device(WarmMotors): over: warm".into()], None));
    }

    /// A device that is lost takes its other faults along, is told once however often it is tried, and is
    /// over when it is back.
    #[test]
    fn lost_device_is_one_fault_until_it_is_back() {
        let (mut faults, mut news) = (LastingFaults::default(), vec![]);
        faults.begin(Cause::Device(Fault::Uncalibrated), "inkwell".into(), &mut news);
        faults.begin(Cause::Device(Fault::Lost), "lost".into(), &mut news);
        faults.end_of_device(&mut news);
        assert_eq!(
            told(&mut news),
            ["+Device(Uncalibrated): inkwell", "+Device(Lost): lost", "-Device(Uncalibrated): over: inkwell"]
        );
        faults.begin(Cause::Away, "did not open".into(), &mut news);
        assert!(news.is_empty(), "that is known");
        faults.begin(Cause::Failed, "failed".into(), &mut news);
        assert_eq!(told(&mut news), ["+Failed: failed"], "that is not");
        faults.end_all(&mut news);
        assert_eq!(told(&mut news), ["-Device(Lost): over: lost", "-Failed: over: failed"]);
    }

    #[test]
    fn device_that_is_away_for_another_reason_is_told_anew() {
        let (mut faults, mut news) = (LastingFaults::default(), vec![]);
        for reason in ["no library", "no library", "no device"] {
            faults.begin(Cause::Away, reason.into(), &mut news);
        }
        assert_eq!(told(&mut news), ["+Away: no library", "-Away: over: no library", "+Away: no device"]);
    }
}
