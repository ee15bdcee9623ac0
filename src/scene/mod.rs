//! Scene files, mesh files in and out, clay filled from meshes.

pub mod export;

/// What most programs need.
pub mod prelude {}
