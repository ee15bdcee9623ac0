//! Stands for the pictures in a build that cannot draw.

use bevy_clay::prelude::*;
use bevy_clay::surface::mesh::Mesh as Surface;
use std::path::{Path, PathBuf};

/// Whether this build draws.
pub(crate) const ARE_DRAWN: bool = false;

/// What a picture would show.
#[expect(dead_code, reason = "nothing is drawn")]
pub(crate) struct Moment {
    /// The frame.
    pub(crate) frame: u64,
    /// The clay.
    pub(crate) surface: Surface,
    /// The tools and where they are.
    pub(crate) tools: Vec<(ToolShape, Pose)>,
}

/// Draws nothing.
///
/// # Errors
/// Always: says what drawing needs.
pub(crate) fn draw(_: Vec<Moment>, _: &Path, _: bool) -> Result<Vec<PathBuf>, String> {
    Err("they need the default features (leave out --no-default-features)".into())
}
