//! Particles to surface: fields, two-sided marching cubes, meshes and their checks.

/// What most programs need.
pub mod prelude {}
