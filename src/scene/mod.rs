//! Scene files, mesh files in and out, clay filled from meshes.

/// What most programs need.
pub mod prelude {}
