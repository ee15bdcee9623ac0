//! When contact and cuts begin and end.

use bevy::prelude::*;

/// A tool that leaves the clay for less than this has not left it \[s\]: clay is uneven, and a hand shakes.
const CONTACT_GAP: f64 = 0.05;
/// A cut is over when nothing was parted for this long \[s\]: as a stroke is.
const CUT_GAP: f64 = 0.15;

/// What the tool in the hand is about.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub(super) struct Contact {
    /// When it last touched \[s\]; none while it does not.
    touched: Option<f64>,
    /// When it last parted clay \[s\]; none while it does not.
    parted: Option<f64>,
}

impl Contact {
    /// Takes in a sample at `time` \[s\]: whether contact begins with it, or is over.
    pub(super) fn touch(&mut self, is_touching: bool, time: f64) -> Option<bool> {
        if is_touching {
            return self.touched.replace(time).is_none().then_some(true);
        }
        self.touched.take_if(|last| time - *last > CONTACT_GAP).map(|_| false)
    }

    /// Whether it touches, or has not been gone for long.
    pub(super) fn is_touching(&self) -> bool {
        self.touched.is_some()
    }

    /// Takes in a frame at `time` \[s\]: whether a cut begins with it.
    pub(super) fn cut(&mut self, is_cutting: bool, time: f64) -> bool {
        if is_cutting {
            return self.parted.replace(time).is_none();
        }
        self.parted.take_if(|last| time - *last > CUT_GAP);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contact_begins_and_ends_once() {
        let mut contact = Contact::default();
        let steps =
            [(false, 0.0), (true, 0.1), (true, 0.11), (false, 0.12), (true, 0.15), (false, 0.16), (false, 0.21), (false, 0.3)];
        let told = steps.map(|(is_touching, time)| contact.touch(is_touching, time));
        assert_eq!(told, [None, Some(true), None, None, None, None, Some(false), None]);
        assert_eq!(contact.touch(true, 0.4), Some(true));
    }

    #[test]
    fn cuts_begin_once() {
        let mut contact = Contact::default();
        let steps = [(true, 0.0), (false, 0.1), (true, 0.2), (false, 0.3), (false, 0.4), (true, 0.5)];
        assert_eq!(steps.map(|(is_cutting, time)| contact.cut(is_cutting, time)), [true, false, false, false, false, true]);
    }
}
