//! What touches the clay: kinematic tools that follow a given path; the force on them is an output.

mod blade;
mod path;
mod profile;
mod sampled;
mod shape;
mod touch;

pub use blade::{BAND, Blade, Near, SET_BACK, stick, traction_share};
pub(crate) use blade::{Outline, TRACTION_REACH_MIN};
pub use path::{Motion, Pose, PoseSample, ToolPath};
pub use profile::{PROFILE_POINTS, Profile};
pub(crate) use sampled::{SPACING, Sample, Sampled, samples};
pub use shape::{CONTACT_OFFSET, ToolShape};
pub(crate) use touch::spline;
pub use touch::{TOUCH_FADE, TOUCH_OFFSET, TOUCH_SHARE, closed_share, particle_touch};

use super::params::{Bounds, ParamsError};
use super::variants::variants;
use serde::{Deserialize, Serialize};

/// Friction between the two sides of a kept cut [-]: clay on clay slides at about 27 degrees.
pub const CUT_FRICTION: f64 = 0.5;

/// How a tool's surface acts on the clay it touches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Contact {
    /// The clay moves with the tool. Along a blade it slides where more than its shear strength would be
    /// needed to take it along.
    Stick,
    /// The clay slides along the tool without friction and cannot leave it.
    Slip,
    /// The clay can leave; while pressed it slides against Coulomb friction.
    Separate {
        /// Coulomb coefficient mu [-].
        friction: f64,
    },
}

variants! {
    /// Every contact.
    Contact: Stick, Slip, Separate { friction: 0.3 }
}

impl Default for Contact {
    /// Separating with friction 0.3, between oiled metal and wet clay.
    fn default() -> Self {
        Self::Separate { friction: 0.3 }
    }
}

impl Contact {
    /// Whether clay can leave the tool.
    pub(crate) fn can_part(&self) -> bool {
        match self {
            Self::Stick | Self::Slip => false,
            Self::Separate { .. } => true,
        }
    }

    /// Whether the clay along a blade is taken along by it.
    pub(crate) fn sticks(&self) -> bool {
        match self {
            Self::Stick => true,
            Self::Slip | Self::Separate { .. } => false,
        }
    }

    /// Nodes closer than this [cells] to a solid tool take part in its contact.
    pub(crate) fn offset(&self) -> f64 {
        if self.can_part() { TOUCH_OFFSET } else { CONTACT_OFFSET }
    }
}

/// Coulomb coefficients: rubber on rock has 1 or 2. Clay that should not slide at all sticks.
const FRICTION: Bounds = Bounds::new(
    0.0,
    1e3,
    "",
    "must be finite and not negative",
    "rubber on rock has 1 or 2; for clay that does not slide there is `Stick`",
);

/// A tool: a shape and how it touches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tool {
    /// The shape in the tool's own frame.
    pub shape: ToolShape,
    /// The contact of its surface.
    #[serde(default)]
    pub contact: Contact,
}

impl Tool {
    /// Whether it is a solid tool that clay can leave.
    pub(crate) fn separates(&self) -> bool {
        !self.shape.is_blade() && self.contact.can_part()
    }

    /// Checks shape and contact.
    ///
    /// # Errors
    /// The first parameter that is out of its range, by name.
    pub fn validate(&self) -> Result<(), ParamsError> {
        self.shape.validate()?;
        match self.contact {
            Contact::Separate { friction } => FRICTION.check("friction", friction),
            Contact::Stick | Contact::Slip => Ok(()),
        }
    }
}
