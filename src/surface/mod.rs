//! Particles to surface: fields, two-sided marching cubes, meshes and their checks.
//!
//! | stage      | takes               | makes                                     | equation            |
//! |------------|---------------------|-------------------------------------------|---------------------|
//! | [`field`]  | surface particles   | f, each body's, P, M of each cut, by node | Eq. 9, by volume    |
//! | [`extract`]| f, P, M             | closed meshes of bodies, cuts' two lips   | two-sided MC        |
//! | [`ray`]    | f, P, M, a ray      | where it meets that mesh                  | two-sided MC        |
//! | [`stitch`] | mesh                | manifold bodies for export                | -                   |
//!
//! Beside the flow: [`grains`] are the particles outside of the mesh, those of small `clusters` among
//! them, drawn as balls (`balls`), [`labels`] holds the rules of cuts, [`mc_table`] generates the 256
//! cases, [`mesh`] measures, [`check`] counts defects, [`oracle`] predicts the topology from the nodes
//! alone.
//!
//! # Example
//!
//! ```
//! use bevy_clay::sim::prelude::*;
//! use bevy_clay::surface::prelude::*;
//! use glam::DVec3;
//!
//! // A ball of 40 mm with 8 particles per cell of 4 mm.
//! let domain = Domain::new(DVec3::splat(-0.04), DVec3::splat(0.04), 0.004, Walls::default())?;
//! let mut particles = Vec::new();
//! for i in 0..40u32 * 40 * 40 {
//!     let at = DVec3::new(f64::from(i % 40), f64::from(i / 40 % 40), f64::from(i / 1600)) + 0.5;
//!     let world = at * 0.002 - 0.04;
//!     if world.length() < 0.02 {
//!         let position = domain.to_grid(world).as_vec3().to_array();
//!         particles.push(SurfaceParticle { position, volume_ratio: 1.0, density_weight: 0.125, ..Default::default() });
//!     }
//! }
//! let mesh = extract(&SurfaceSource { domain, particles: particles.into() }, &SurfaceSettings::default());
//! assert!(MeshCheck::of(&mesh).is_closed_manifold());
//! assert!((mesh.volume() / 33.5e-6 - 1.0).abs() < 0.05);
//! # Ok::<(), ParamsError>(())
//! ```

mod balls;
mod bodies;
mod caps;
mod cells;
pub mod check;
mod closure;
mod clusters;
pub mod extract;
pub mod field;
pub mod gpu;
pub mod grains;
mod grid;
pub mod labels;
pub mod mc_table;
pub mod mesh;
pub mod oracle;
pub mod ray;
mod scatter;
pub(crate) mod sheets;
pub mod stitch;

/// What most programs need.
pub mod prelude {
    pub use super::check::MeshCheck;
    pub use super::extract::extract;
    pub use super::field::{SurfaceSettings, Tier};
    pub use super::grains::{Extraction, Grain, extract_with_grains};
    pub use super::labels::CutMethod;
    pub use super::ray::{RayHit, cast_ray};
    pub use super::stitch::{Repairs, print_ready};
}
