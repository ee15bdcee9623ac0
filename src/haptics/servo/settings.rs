//! What a hand may choose of the force.

use super::scale::ForceScale;
use crate::haptics::proxy::ToolSpheres;
use crate::sim::params::ParamsError;
use glam::{DQuat, DVec3};

/// Where the force comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// As published: `f = k_h (x_rg - x_ro)`, Yu et al. Eq. 8, with the anchor `x_rg` where the tool came to
    /// the clay and the tool `x_ro` nearest to the hand outside of it, Eq. 6, by projected Gauss-Seidel. Of
    /// blades, which are no spheres, nothing is felt.
    PaperAnchor {
        /// Whether the anchor follows where the clay yields. As published it does not, and gives back on the
        /// way out all that the hand put in.
        relaxes: bool,
    },
    /// `f = k_h (x_ro - x_h)`: the tool is nearest to the hand outside the clay, by the exact active set,
    /// with a cone of friction. Of blades nothing is felt.
    GodObject,
    /// The clay's own force, some frames old: the truth about the clay, and no force for a stiff hand. Of any
    /// tool, bent blades and wires too.
    ContactImpulse,
    /// The clay's contact at the hand's present pose, by a spring and a damper between hand and tool: of
    /// solid tools, and of flat blades by their edges and flanks.
    #[default]
    Coupled,
}

/// What [`Mode::ContactImpulse`] does between two frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hold {
    /// Goes over to the new force in the time of a frame: a frame later, without steps.
    #[default]
    Blended,
    /// Holds the last force.
    Held,
}

/// Spring and damper between the hand and the clay's tool (Colgate et al. 1995), the tool without mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// k_h \[N/m\]; infinite where the tool is where the hand is.
    pub stiffness: f64,
    /// Damping \[N s/m\].
    pub damping: f64,
    /// Greatest stiffness that a hand may feel \[N/m\].
    pub stiffness_max: f64,
}

impl Default for Coupling {
    /// The stiffness that a Touch renders: 3.7 times less than what a light pinch holds steady 1 ms late.
    fn default() -> Self {
        Self { stiffness: 400.0, damping: 0.5, stiffness_max: 500.0 }
    }
}

/// Where the device's frame is in the world: `world = position + scale rotation device`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Where its origin is \[m\].
    pub position: DVec3,
    /// How it is turned.
    pub rotation: DQuat,
    /// World lengths that a length of the device makes [-].
    pub scale: f64,
}

impl Default for Placement {
    fn default() -> Self {
        Self { position: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: 1.0 }
    }
}

impl Placement {
    /// A place of the device, in the world.
    pub fn point(&self, device: DVec3) -> DVec3 {
        self.position + self.scale * (self.rotation * device)
    }

    /// Whether a device can stand so.
    ///
    /// # Errors
    /// A place or a turn that is none, a scale that is not positive.
    pub fn validate(&self) -> Result<(), ParamsError> {
        let Self { position, rotation, scale } = *self;
        if !(position.is_finite() && rotation.is_finite() && rotation.is_normalized()) {
            return Err(ParamsError::new("haptic placement", position, "must be finite, with a rotation of length 1"));
        }
        if scale.is_finite() && scale > 0.0 {
            return Ok(());
        }
        Err(ParamsError::new("haptic scale", scale, "must be finite and positive"))
    }
}

/// All settings of a servo. Of fixed size: they are handed over without waiting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoSettings {
    /// Where the force comes from.
    pub mode: Mode,
    /// What [`Mode::ContactImpulse`] does between frames.
    pub hold: Hold,
    /// Spring and damper between hand and tool, as the hand feels them.
    pub coupling: Coupling,
    /// What a hand feels of the clay's force.
    pub force: ForceScale,
    /// Where the device is.
    pub placement: Placement,
    /// The tool, for the modes that keep spheres apart.
    pub tool: ToolSpheres,
}

impl Default for ServoSettings {
    fn default() -> Self {
        Self {
            mode: Mode::default(),
            hold: Hold::default(),
            coupling: Coupling::default(),
            force: ForceScale::default(),
            placement: Placement::default(),
            tool: ToolSpheres::new(&[]),
        }
    }
}

impl ServoSettings {
    /// The coupling by lengths of the world: a hand whose way is drawn out feels no more stiffness for it.
    pub fn coupling_in_world(&self) -> Coupling {
        let Coupling { stiffness, damping, stiffness_max } = self.coupling;
        let scale = self.placement.scale * self.force.gain;
        Coupling { stiffness: stiffness.min(stiffness_max) / scale, damping: damping / scale, stiffness_max }
    }
}
