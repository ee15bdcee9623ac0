//! A tool, and how its surface acts on the clay that it touches.

use super::super::params::{Bounds, ParamsError};
use super::super::variants::variants;
use super::shape::ToolShape;
use serde::{Deserialize, Serialize};

/// Offset of contact with a blade \[cells\]: nodes less than this before it take part, so that the clay's
/// face rests on the blade.
pub const CONTACT_OFFSET: f64 = 0.4;

/// Friction between the two sides of a kept cut [-]: clay on clay slides at about 27 degrees.
pub const CUT_FRICTION: f64 = 0.5;

/// How a tool's surface acts on the clay it touches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum Contact {
    /// The clay moves with the tool. It slides, and comes off, where more than its shear strength would be
    /// needed to take it along. (Off a blade it does not come.)
    Stick,
    /// The clay slides along the tool without friction, and leaves it where more than its shear strength
    /// would be needed to hold it. (A blade it does not leave.)
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
