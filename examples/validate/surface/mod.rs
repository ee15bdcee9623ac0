//! The surface: topology of random fields and of cuts, accuracy, clusters, steadiness, time.

mod ball;
pub(crate) mod clay;
mod cuts;
mod fields;

pub(crate) use ball::{clusters, motion, speed, sphere};
pub(crate) use cuts::{cuts, meeting_cuts};
pub(crate) use fields::random_fields;
