//! Where a haptic arm stands, as a file: `NAME.placement.ron`, which people read and write.
//!
//! ```ron
//! (
//!     position: (0.15, 0.8, -0.35),
//!     rotation: (axis: (0, 1, 0), degrees: 90),
//!     scale: 2,
//! )
//! ```
//!
//! Lengths are metres of the world, in a headset of the room; what is left out is as in
//! [`Placement::default`].

use super::check::{Check, check_place};
use super::error::SceneError;
use super::line::named;
use super::text::{from_ron, read_text};
use super::track::AxisAngle;
use crate::haptics::servo::Placement;
use crate::sim::params::ParamsError;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The longest placement file [bytes].
const BYTES_MAX: u64 = 1 << 16;

/// A [`Placement`] as its file says it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlacementFile {
    /// Where the device's origin is \[m\].
    pub position: DVec3,
    /// How the device is turned.
    pub rotation: AxisAngle,
    /// World lengths that a length of the device makes \[-\]: 1 is one to one.
    pub scale: f64,
}

impl Default for PlacementFile {
    fn default() -> Self {
        let Placement { position, scale, .. } = Placement::default();
        Self { position, rotation: AxisAngle::default(), scale }
    }
}

impl PlacementFile {
    /// Reads the placement file at `path`.
    ///
    /// # Errors
    /// One line that names the file: one that cannot be read or is no placement (with line and field), a
    /// value that no arm can have.
    pub fn load(path: &Path) -> Result<Placement, SceneError> {
        Self::from_text(&read_text(path, BYTES_MAX, "placement file")?, &named(path))
    }

    fn from_text(text: &str, file: &str) -> Result<Placement, SceneError> {
        let read: Self = from_ron(text, file)?;
        read.placement().map_err(|error| SceneError::Params { file: file.into(), error })
    }

    fn placement(&self) -> Result<Placement, ParamsError> {
        check_place("position", self.position)?;
        self.rotation.check()?;
        let placement = Placement { position: self.position, rotation: self.rotation.quaternion(), scale: self.scale };
        placement.validate().map(|()| placement)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Placement, String> {
        PlacementFile::from_text(text, "arm.placement.ron").map_err(|error| error.to_string())
    }

    /// The device's x axis points where the file turns it to; a file of nothing is 1 : 1 at the origin.
    #[test]
    fn placements_are_what_their_files_say() {
        let placed =
            read("(position: (0.15, 0.8, -0.35), rotation: (axis: (0, 2, 0), degrees: 90), scale: 2)").expect("a placement");
        let tip = placed.point(DVec3::new(0.01, 0.02, 0.0));
        assert!(tip.distance(DVec3::new(0.15, 0.84, -0.37)) < 1e-12, "{tip}");
        assert_eq!(read("()"), Ok(Placement::default()));
    }

    /// What is wrong is one line that names the file and the field.
    #[test]
    fn bad_files_are_named_in_a_line() {
        for (text, parts) in [
            ("(position: (0, 0), scale: 1)", ["arm.placement.ron:1:", "position"]),
            ("(posture: (0, 0, 0))", ["arm.placement.ron:1:", "posture"]),
            ("(scale: 0)", ["arm.placement.ron: ", "scale"]),
            ("(scale: -2)", ["arm.placement.ron: ", "scale"]),
            ("(position: (0, inf, 0))", ["arm.placement.ron: ", "position"]),
            ("(rotation: (axis: (0, 0, 0), degrees: 9))", ["arm.placement.ron: ", "rotation.axis"]),
            ("a picture", ["arm.placement.ron:1:", ""]),
        ] {
            let error = read(text).expect_err(text);
            assert!(parts.iter().all(|part| error.contains(part)) && error.lines().count() == 1, "{error}");
        }
        let error = PlacementFile::load(Path::new("no_such.placement.ron")).expect_err("no file").to_string();
        assert!(error.starts_with("no_such.placement.ron: "), "{error}");
    }
}
