//! Names of objects on a device: an error that names one of them is of this crate's work.

/// What the label of every object begins with.
pub(crate) const LABEL: &str = "bevy_clay:";

/// The label of an object.
pub(crate) fn label(name: &str) -> String {
    format!("{LABEL}{name}")
}
