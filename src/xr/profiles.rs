//! Which button of which controller does what: a list of suggestions for each interaction profile.
//!
//! A runtime refuses a profile's list as a whole if it knows one of its paths not, and a second list takes
//! the place of the first: so each profile has one list, with paths that its specification has.

use super::hand::Side;
use openxr::ExtensionSet;

/// What a hand does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Input {
    /// Where the hand is: it moves the work.
    Grip,
    /// Where it points: the ray on panels.
    Aim,
    /// Where its tool is.
    Tool,
    /// How hard it presses the tool, from 0 to 1.
    Trigger,
    /// How hard it holds the work, from 0 to 1.
    Squeeze,
    /// Undo and redo, scrolling, the tool's size; from -1 to 1 each way.
    Stick,
    /// Both hands' at once: the work comes in front of the head.
    StickClick,
    /// Opens the panel in this hand; the other one is the tool hand then.
    Menu,
    /// Its motor.
    Shake,
}

impl Input {
    /// Name of its action, and what a runtime's own pages call it.
    pub(super) fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::Grip => ("grip", "Hand"),
            Self::Aim => ("aim", "Pointing hand"),
            Self::Tool => ("tool", "Tool"),
            Self::Trigger => ("press", "Press the tool"),
            Self::Squeeze => ("hold", "Hold the work"),
            Self::Stick => ("stick", "Undo, redo, size"),
            Self::StickClick => ("recentre", "Recentre the work"),
            Self::Menu => ("menu", "Open the panel"),
            Self::Shake => ("shake", "Vibration"),
        }
    }
}

/// Which hands have an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sides {
    Both,
    One(Side),
}

/// A kind of controller.
#[derive(Debug)]
pub(super) struct Profile {
    pub(super) path: &'static str,
    /// Inputs, who has them, and where they are below `/user/hand/SIDE/`.
    bindings: &'static [(Input, Sides, &'static str)],
    /// Whether a runtime with these extensions knows it.
    pub(super) is_known: fn(&ExtensionSet) -> bool,
}

impl Profile {
    /// Its list: inputs and whole paths.
    pub(super) fn suggestions(&self) -> impl Iterator<Item = (Input, String)> {
        self.bindings.iter().flat_map(|&(input, sides, path)| {
            let has = move |side: &Side| sides == Both || sides == One(*side);
            Side::ALL.into_iter().filter(has).map(move |side| (input, format!("{}/{path}", side.path())))
        })
    }
}

use Sides::{Both, One};

/// Every profile that the controls are made for.
pub(super) const PROFILES: [Profile; 6] = [
    Profile {
        path: "/interaction_profiles/khr/simple_controller",
        bindings: &[
            (Input::Grip, Both, "input/grip/pose"),
            (Input::Aim, Both, "input/aim/pose"),
            (Input::Tool, Both, "input/aim/pose"),
            (Input::Trigger, Both, "input/select/click"),
            (Input::Menu, Both, "input/menu/click"),
            (Input::Shake, Both, "output/haptic"),
        ],
        is_known: |_| true,
    },
    Profile {
        path: "/interaction_profiles/htc/vive_controller",
        bindings: &[
            (Input::Grip, Both, "input/grip/pose"),
            (Input::Aim, Both, "input/aim/pose"),
            (Input::Tool, Both, "input/aim/pose"),
            (Input::Trigger, Both, "input/trigger/value"),
            (Input::Squeeze, Both, "input/squeeze/click"),
            (Input::Stick, Both, "input/trackpad"),
            (Input::StickClick, Both, "input/trackpad/click"),
            (Input::Menu, Both, "input/menu/click"),
            (Input::Shake, Both, "output/haptic"),
        ],
        is_known: |_| true,
    },
    Profile {
        path: "/interaction_profiles/valve/index_controller",
        bindings: &[
            (Input::Grip, Both, "input/grip/pose"),
            (Input::Aim, Both, "input/aim/pose"),
            (Input::Tool, Both, "input/aim/pose"),
            (Input::Trigger, Both, "input/trigger/value"),
            (Input::Squeeze, Both, "input/squeeze/value"),
            (Input::Stick, Both, "input/thumbstick"),
            (Input::StickClick, Both, "input/thumbstick/click"),
            (Input::Menu, Both, "input/b/click"),
            (Input::Shake, Both, "output/haptic"),
        ],
        is_known: |_| true,
    },
    Profile {
        path: "/interaction_profiles/oculus/touch_controller",
        bindings: &[
            (Input::Grip, Both, "input/grip/pose"),
            (Input::Aim, Both, "input/aim/pose"),
            (Input::Tool, Both, "input/aim/pose"),
            (Input::Trigger, Both, "input/trigger/value"),
            (Input::Squeeze, Both, "input/squeeze/value"),
            (Input::Stick, Both, "input/thumbstick"),
            (Input::StickClick, Both, "input/thumbstick/click"),
            (Input::Menu, One(Side::Left), "input/y/click"),
            (Input::Menu, One(Side::Right), "input/b/click"),
            (Input::Shake, Both, "output/haptic"),
        ],
        is_known: |_| true,
    },
    Profile {
        path: "/interaction_profiles/ext/hand_interaction_ext",
        bindings: &[
            (Input::Grip, Both, "input/grip/pose"),
            (Input::Aim, Both, "input/aim/pose"),
            (Input::Tool, Both, "input/pinch_ext/pose"),
            (Input::Trigger, Both, "input/pinch_ext/value"),
            (Input::Squeeze, Both, "input/grasp_ext/value"),
        ],
        is_known: |extensions| extensions.ext_hand_interaction,
    },
    Profile {
        path: "/interaction_profiles/logitech/mx_ink_stylus_logitech",
        bindings: &[
            (Input::Grip, Both, "input/grip/pose"),
            (Input::Aim, Both, "input/aim/pose"),
            (Input::Tool, Both, "input/tip_logitech/pose"),
            (Input::Trigger, Both, "input/tip_logitech/force"),
            (Input::Trigger, Both, "input/cluster_middle_logitech/force"),
            (Input::Squeeze, Both, "input/cluster_front_logitech/click"),
            (Input::Menu, Both, "input/cluster_back_logitech/click"),
            (Input::Shake, Both, "output/haptic"),
        ],
        is_known: |extensions| extensions.logitech_mx_ink_stylus_interaction,
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Whatever the controller, clay can be pressed: the tool, its trigger and a ray, on either hand.
    #[test]
    fn every_profile_presses_with_either_hand() {
        for profile in &PROFILES {
            let list: Vec<_> = profile.suggestions().collect();
            for side in Side::ALL {
                for input in [Input::Grip, Input::Aim, Input::Tool, Input::Trigger] {
                    let is_there = list.iter().any(|(i, path)| *i == input && path.starts_with(side.path()));
                    assert!(is_there, "{}: {input:?} of {side:?}", profile.path);
                }
            }
        }
    }

    /// One list for each profile, and nothing twice in it.
    #[test]
    fn profiles_and_their_bindings_are_there_once() {
        let paths: HashSet<_> = PROFILES.iter().map(|profile| profile.path).collect();
        assert_eq!(paths.len(), PROFILES.len());
        for profile in &PROFILES {
            let list: Vec<_> = profile.suggestions().collect();
            assert_eq!(list.iter().collect::<HashSet<_>>().len(), list.len(), "{}", profile.path);
            assert!(list.iter().all(|(_, path)| path.starts_with("/user/hand/")), "{}", profile.path);
        }
    }

    /// What only an extension knows is suggested where the runtime has it.
    #[test]
    fn extensions_bring_their_profiles() {
        let mut extensions = ExtensionSet::default();
        let count = |extensions: &ExtensionSet| PROFILES.iter().filter(|p| (p.is_known)(extensions)).count();
        assert_eq!(count(&extensions), 4);
        extensions.ext_hand_interaction = true;
        extensions.logitech_mx_ink_stylus_interaction = true;
        assert_eq!(count(&extensions), 6);
    }
}
