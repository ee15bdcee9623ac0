//! What touches the clay: kinematic tools that follow a given path; the force on them is an output.

mod blade;
mod contact;
mod edge;
mod outline;
mod path;
mod profile;
mod sampled;
mod shape;

pub(crate) use blade::TRACTION_REACH_MIN;
pub use blade::{Adhesion, BAND, Blade, Near, SET_BACK, stick, traction_share};
pub use contact::{CONTACT_OFFSET, CUT_FRICTION, Contact, Tool};
pub use edge::{EDGE_RAMP, EDGE_REACH, share as edge_share};
pub(crate) use outline::Outline;
pub use path::{Motion, Pose, PoseSample, ToolPath};
pub use profile::{PROFILE_POINTS, Profile};
pub(crate) use sampled::{SPACING, Sample, Sampled, samples};
pub use shape::ToolShape;
