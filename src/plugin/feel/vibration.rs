//! Controllers that shake for tools: what a tool feels, for hands that hold no arm.

use super::events::HapticFault;
use crate::haptics::device::vibration::{Shaker, VibrationSink};
use bevy::platform::cell::SyncCell;
use bevy::prelude::Entity;
use glam::DVec3;

/// Frames further apart than this \[s\] are none of one contact: a shake of them would last as long.
const GAP: f64 = 0.1;

/// A controller that shakes for a tool.
pub(super) struct Vibration {
    pub(super) tool: Entity,
    sink: SyncCell<Box<dyn VibrationSink>>,
    shaker: Shaker,
    /// When it was last looked at \[s\], and where the tool was \[m\].
    last: Option<(f64, DVec3)>,
    /// The sink's words when it failed: it is left alone since.
    error: Option<String>,
}

impl Vibration {
    /// What the tool feels at `time` \[s\], at that place \[m\]; what there is to tell where the sink fails
    /// with it.
    pub(super) fn feel(&mut self, time: f64, place: DVec3, force: DVec3) -> Option<HapticFault> {
        // Several frames that ended in one look are one.
        if self.error.is_some() || self.last.is_some_and(|(last, _)| last >= time) {
            return None;
        }
        let before = self.last.replace((time, place));
        let Some((before, from)) = before.filter(|(before, _)| time - before < GAP) else {
            self.shaker = Shaker::default();
            // The first has no change.
            _ = self.shaker.shake(force, 0.0, GAP);
            return None;
        };
        let dt = time - before;
        let velocity = (place - from) / dt;
        let slip = force.try_normalize().map_or(0.0, |normal| velocity.reject_from_normalized(normal).length());
        let words = self.shaker.shake(force, slip, dt).and_then(|shake| self.sink.get().shake(&shake).err())?;
        let message = format!("what shakes for the tool has failed, and is left alone: {words}");
        self.error = Some(message.clone());
        Some(HapticFault { entity: self.tool, fault: None, has_begun: true, message })
    }

    /// Feels nothing: what comes next begins anew.
    pub(super) fn rest(&mut self) {
        self.last = None;
    }
}

/// The controllers that shake.
#[derive(Default)]
pub(super) struct Vibrations {
    pub(super) all: Vec<Vibration>,
    /// Ends of failures that are to be told.
    pub(super) over: Vec<HapticFault>,
}

impl Vibrations {
    pub(super) fn set(&mut self, tool: Entity, sink: Box<dyn VibrationSink>) {
        self.remove(tool);
        let sink = SyncCell::new(sink);
        self.all.push(Vibration { tool, sink, shaker: Shaker::default(), last: None, error: None });
    }

    pub(super) fn remove(&mut self, tool: Entity) {
        let gone = self.all.extract_if(.., |vibration| vibration.tool == tool);
        let end = |error| HapticFault { entity: tool, fault: None, has_begun: false, message: format!("over: {error}") };
        self.over.extend(gone.filter_map(|vibration| vibration.error.map(end)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::haptics::device::vibration::Shake;
    use std::sync::{Arc, Mutex};

    struct Controller(Arc<Mutex<Vec<Shake>>>);

    impl VibrationSink for Controller {
        fn shake(&mut self, shake: &Shake) -> Result<(), String> {
            self.0.lock().map_err(|error| error.to_string())?.push(*shake);
            Ok(())
        }
    }

    /// Neither force that is switched off nor force that comes on again is a change that a contact made.
    #[test]
    fn force_that_is_switched_does_not_shake() {
        let shakes = Arc::new(Mutex::new(Vec::new()));
        let mut all = Vibrations::default();
        all.set(Entity::PLACEHOLDER, Box::new(Controller(shakes.clone())));
        let vibration = &mut all.all[0];
        let feel = |vibration: &mut Vibration, time: f64, force: f64| {
            assert!(vibration.feel(time, DVec3::ZERO, DVec3::Y * force).is_none());
            std::mem::take(&mut *shakes.lock().expect("a lock")).len()
        };
        assert_eq!(feel(vibration, 0.0, 0.0), 0);
        assert_eq!(feel(vibration, 0.01, 1.0), 1, "a contact");
        vibration.rest();
        assert_eq!(feel(vibration, 0.02, 2.0), 0, "on again");
        assert_eq!(feel(vibration, 0.03, 1.0), 1);
    }
}
