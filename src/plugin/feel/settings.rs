//! What a tool in an arm's hand is told.

use crate::haptics::device::HapticDevice;
use crate::haptics::device::failover::Open;
use crate::haptics::device::fault::DeviceError;
use crate::haptics::device::simulated::{ArmSettings, HandPath, SimulatedArm, SimulatedDevice};
use crate::haptics::guarded::HandOrders;
use crate::haptics::proxy::{SPHERE_MAX, Sphere, ToolSpheres};
use crate::haptics::safety::SafetySettings;
use crate::haptics::servo::{Coupling, ForceScale, Hold, Mode, Placement, ServoSettings};
use crate::sim::params::ParamsError;
use crate::sim::tool::ToolShape;
use bevy::prelude::*;
use glam::DVec3;
use std::sync::Arc;

/// Puts a [`SculptTool`](crate::plugin::tool::SculptTool) into the hand that holds a haptic arm: the tool
/// goes where the hand leads it, the hand feels what the clay does to it. One tool of an app at a time, the
/// first that has this.
///
/// All of it may change at any time. Another [`device`](Self::device) is opened anew; another
/// [`placement`](Self::placement) lets the force go and come back slowly.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
pub struct HapticSettings {
    /// Which arm.
    pub device: ArmChoice,
    /// The hand that stands in while the arm is away, and that of [`ArmChoice::Simulated`].
    pub simulated: SimulatedHand,
    /// The clay that is felt; the first of the app without one. Others are touched, and not felt.
    #[entities]
    pub clay: Option<Entity>,
    /// Whether there is force. Off, it is gone within 20 ms.
    pub has_force: bool,
    /// Where the force comes from.
    pub mode: Mode,
    /// Spring and damper between hand and tool.
    pub coupling: Coupling,
    /// What a hand feels of the clay's force.
    pub force: ForceScale,
    /// Where the device is in the world, and how much larger its ways are there.
    pub placement: Placement,
    /// The button, from 0, that lets the hand go elsewhere without the tool while it is held; none without
    /// one.
    pub clutch: Option<u32>,
    /// Limits of the stages of safety.
    pub safety: SafetySettings,
}

impl Default for HapticSettings {
    /// A Touch at the world's origin, 1:1, its second button the clutch.
    fn default() -> Self {
        Self {
            device: ArmChoice::default(),
            simulated: SimulatedHand::default(),
            clay: None,
            has_force: true,
            mode: Mode::default(),
            coupling: Coupling::default(),
            force: ForceScale::default(),
            placement: Placement::default(),
            clutch: Some(1),
            safety: SafetySettings::default(),
        }
    }
}

impl HapticSettings {
    /// The same with the simulated arm, in this hand.
    #[must_use]
    pub fn simulated(hand: SimulatedHand) -> Self {
        Self { device: ArmChoice::Simulated, simulated: hand, ..Self::default() }
    }

    /// # Errors
    /// A number that no loop of force can have.
    pub fn validate(&self) -> Result<(), ParamsError> {
        self.placement.validate()?;
        let positive = |name, value: f64| {
            let is_sound = value.is_finite() && value > 0.0;
            is_sound.then_some(()).ok_or_else(|| ParamsError::new(name, value, "must be finite and positive"))
        };
        let not_negative = |name, value: f64| {
            let is_sound = value.is_finite() && value >= 0.0;
            is_sound.then_some(()).ok_or_else(|| ParamsError::new(name, value, "must be finite and not negative"))
        };
        positive("haptic force gain", self.force.gain)?;
        not_negative("haptic force knee", self.force.knee)?;
        not_negative("haptic force ceiling", self.force.ceiling)?;
        not_negative("haptic damping", self.coupling.damping)?;
        positive("greatest haptic stiffness", self.coupling.stiffness_max)?;
        if self.coupling.stiffness == f64::INFINITY { Ok(()) } else { positive("haptic stiffness", self.coupling.stiffness) }
    }

    /// For the loop of force of a tool of that shape, in the world.
    pub(super) fn servo(&self, shape: &ToolShape) -> ServoSettings {
        ServoSettings {
            mode: self.mode,
            hold: Hold::default(),
            coupling: self.coupling,
            force: self.force,
            placement: self.placement,
            tool: spheres(shape),
        }
    }

    /// For the loop of force after so many restarts.
    pub(super) fn orders(&self, restarts: u32) -> HandOrders {
        HandOrders { has_force: self.has_force, restarts, clutch: self.clutch, safety: self.safety }
    }
}

/// Which haptic arm.
#[derive(Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum ArmChoice {
    /// A 3D Systems Touch, its library loaded at run time (feature `touch`); the simulated arm until it is
    /// there, and again if it goes.
    #[default]
    Touch,
    /// The simulated arm alone.
    Simulated,
    /// Another arm; the simulated one until it is there, and again if it goes. Reflection does not save what
    /// opens it: see [`ArmOpener::default`].
    Other(#[reflect(ignore, clone)] ArmOpener),
}

impl ArmChoice {
    /// What opens it; none for the stand-in itself.
    pub(super) fn opener(&self) -> Option<Arc<Open>> {
        match self {
            Self::Touch => Some(Arc::new(touch)),
            Self::Simulated => None,
            Self::Other(opener) => Some(opener.0.clone()),
        }
    }
}

#[cfg(feature = "touch")]
fn touch() -> Result<Box<dyn HapticDevice>, DeviceError> {
    use crate::haptics::device::touch::{Touch, TouchOptions};
    Ok(Box::new(Touch::open(TouchOptions::default())?))
}

#[cfg(not(feature = "touch"))]
fn touch() -> Result<Box<dyn HapticDevice>, DeviceError> {
    Err(DeviceError::Library("this program was built without the feature `touch`".into()))
}

/// Opens an arm, from a thread of its own; the same function is called again when the arm was away.
#[derive(Clone)]
pub struct ArmOpener(pub Arc<Open>);

impl Default for ArmOpener {
    /// Opens nothing, and says so: what stands in a saved scene for an opener, until the app puts its own
    /// there.
    fn default() -> Self {
        Self(Arc::new(|| Err(DeviceError::Library("no function was given that opens this arm".into()))))
    }
}

impl std::fmt::Debug for ArmOpener {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("ArmOpener")
    }
}

impl PartialEq for ArmOpener {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// A hand that holds the simulated arm, and where it means to go, in the device's frame.
#[derive(Clone, Debug, PartialEq, Reflect)]
#[reflect(Clone, Debug, Default, PartialEq)]
pub struct SimulatedHand {
    /// The arm, and the hand's mass, spring and damper.
    pub arm: ArmSettings,
    /// Its way from when the arm starts.
    pub path: HandPath,
}

impl Default for SimulatedHand {
    /// At rest in the upper half of what the arm reaches, away from what stands on its origin.
    fn default() -> Self {
        Self { arm: ArmSettings::default(), path: HandPath::new([(0.0, DVec3::Y * 0.05)]) }
    }
}

impl SimulatedHand {
    /// What opens it: each time at the start of its way.
    pub(super) fn opener(&self) -> Arc<Open> {
        let Self { arm, path } = self.clone();
        Arc::new(move || Ok(Box::new(SimulatedDevice::new(SimulatedArm::new(arm, path.clone())))))
    }
}

/// A tool as spheres, for the modes that keep spheres apart: balls and rods as they are, other solids by the
/// ball within them about their origin, blades not at all.
fn spheres(shape: &ToolShape) -> ToolSpheres {
    let ball = |centre, radius| Sphere { centre, radius };
    match *shape {
        ToolShape::Sphere { radius } => ToolSpheres::new(&[ball(DVec3::ZERO, radius)]),
        ToolShape::Capsule { radius, half_length } => {
            // A radius apart they are off the rod by an eighth of it, as far as there are so many.
            let steps = (2.0 * half_length / radius).ceil().clamp(1.0, SPHERE_MAX as f64 - 1.0);
            let at = |i: usize| DVec3::Y * (2.0 * i as f64 / steps - 1.0) * half_length;
            let rod: Vec<_> = (0..=steps as usize).map(|i| ball(at(i), radius)).collect();
            ToolSpheres::new(&rod)
        }
        _ => match -shape.distance(DVec3::ZERO) {
            within if within > 0.0 => ToolSpheres::new(&[ball(DVec3::ZERO, within)]),
            _ => ToolSpheres::new(&[]),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solids_are_spheres_within_them() {
        for shape in ToolShape::ALL {
            let tool = spheres(&shape);
            assert_eq!(tool.spheres().is_empty(), shape.is_blade() || shape.distance(DVec3::ZERO) >= 0.0, "{shape:?}");
            for Sphere { centre, radius } in tool.spheres() {
                assert!(*radius > 0.0 && shape.distance(*centre) + radius < 1e-12, "{shape:?}: {centre}, {radius}");
            }
        }
        let rod = spheres(&ToolShape::Capsule { radius: 1e-3, half_length: 5e-3 });
        let ends = [rod.spheres()[0].centre.y, rod.spheres()[10].centre.y];
        assert_eq!((rod.spheres().len(), ends), (11, [-5e-3, 5e-3]));
    }

    #[test]
    fn senseless_settings_are_named() {
        let usual = HapticSettings::default();
        assert_eq!(usual.validate(), Ok(()));
        let rigid = Coupling { stiffness: f64::INFINITY, ..Coupling::default() };
        assert_eq!(HapticSettings { coupling: rigid, ..usual.clone() }.validate(), Ok(()));
        let scaled = |scale| HapticSettings { placement: Placement { scale, ..usual.placement }, ..usual.clone() };
        for (bad, part) in [
            (scaled(0.0), "scale"),
            (scaled(f64::NAN), "scale"),
            (HapticSettings { placement: Placement { position: DVec3::NAN, ..usual.placement }, ..usual.clone() }, "placement"),
            (HapticSettings { force: ForceScale { gain: -1.0, ..usual.force }, ..usual.clone() }, "gain"),
            (HapticSettings { coupling: Coupling { damping: f64::NAN, ..usual.coupling }, ..usual.clone() }, "damping"),
            (HapticSettings { coupling: Coupling { stiffness: -400.0, ..usual.coupling }, ..usual.clone() }, "stiffness"),
        ] {
            let error = bad.validate().expect_err("a refusal").to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
