//! How a frame is integrated in time.

use serde::{Deserialize, Serialize};

/// How substeps are integrated in time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Integrator {
    /// Symplectic Euler, stable below
    /// [`ClayMaterial::time_step_limit`](super::material::ClayMaterial::time_step_limit).
    Explicit {
        /// Inertial density over the material's density [-]: 1, or more while a tool engages supported clay.
        /// Weight is not scaled.
        density_scale: f64,
    },
    /// Backward Euler as the least of a potential: steps follow how far clay and tools go, not the speed of
    /// sound. Density is the material's own. On the native engine; blades press on particles in it, as solid
    /// tools do.
    Implicit {
        /// Passes over the particles in each step, each of them an evaluation of the potential's slope;
        /// twice as many where they leave half as much again out of balance as clay bears.
        passes: u32,
    },
}

/// Passes that an implicit step may have: with two it blows up.
pub(super) const PASSES: std::ops::RangeInclusive<u32> = 3..=1000;

impl Default for Integrator {
    fn default() -> Self {
        Self::Explicit { density_scale: 1.0 }
    }
}
