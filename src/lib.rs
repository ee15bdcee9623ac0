//! Real-time sculpting of elastoplastic clay: MLS-MPM with cuts that persist (CPIC), two-sided marching
//! cubes.
//!
//! Data flows one way, top to bottom; no module imports one below it in this table.
//!
//! | module      | takes                     | makes                              | equations            |
//! |-------------|---------------------------|------------------------------------|----------------------|
//! | [`sim`]     | snapshot, frame plans     | frame reports, surface particles   | Yu et al. Eq. 1-5    |
//! | [`surface`] | surface particles         | closed, oriented triangle meshes   | Eq. 9, two-sided     |
//! | [`haptics`] | contact of a clay frame   | force on a hand, at 1 kHz          | Eq. 6-8              |
//! | [`scene`]   | scene files, mesh files   | snapshots, tool paths, mesh files  | winding number       |
//! | `plugin`    | Bevy's clock and entities | frame plans, Bevy components       | -                    |
//! | `ui`        | Bevy components           | egui panels on them                | -                    |
//! | `xr`        | an OpenXR runtime         | tools in hands, in a headset       | -                    |
//!
//! Units are SI, right-handed, Y up. State is f32 on the device and in the engines, f64 in the oracle.
//! Matrices are column-major: `affine[c][r]` is the derivative of velocity component `r` along axis `c`.
//!
//! # Example
//!
//! A 4 cm cube of clay dropped for one frame of 10 ms:
//!
//! ```
//! use bevy_clay::prelude::*;
//!
//! let scene = ClayScene::from_ron("(clay: [Box(size: (0.04, 0.04, 0.04))], cell_width: 0.004, material: Preset(SoftClay))")?;
//! let snapshot = scene.build(std::path::Path::new("."))?.snapshot;
//! let mut engine = NativeEngine::new();
//! engine.load(&snapshot)?;
//! if let Decision::Run(plan) = Planner::new(&snapshot).frame(&snapshot.material, 0.01, &[]) {
//!     engine.submit(plan)?;
//! }
//! let report = engine.wait()?;
//! assert!((report.grid_mass / report.particle_mass - 1.0).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![warn(missing_docs)]

pub mod haptics;
#[cfg(feature = "bevy")]
pub mod plugin;
pub mod scene;
pub mod sim;
pub mod surface;
#[cfg(feature = "inspector")]
pub mod ui;
#[cfg(feature = "xr")]
pub mod xr;

/// What an app needs. The solver's own rooms have preludes of their own: [`sim::prelude`],
/// [`scene::prelude`], [`surface::prelude`].
pub mod prelude {
    #[cfg(feature = "bevy")]
    pub use crate::plugin::prelude::*;
    pub use crate::scene::export::{BodyFiles, ExportFormat, ExportOptions};
    pub use crate::scene::file::ClayScene;
    pub use crate::sim::engine::{Engine, EngineError};
    pub use crate::sim::frame::{FrameReport, ToolReport};
    pub use crate::sim::health::Health;
    pub use crate::sim::material::{ClayLaw, ClayMaterial, Preset, Weld};
    pub use crate::sim::native::NativeEngine;
    pub use crate::sim::planner::{Backlog, Decision, InertiaScaling, IntegratorChoice, Planner, StepAccuracy};
    pub use crate::sim::snapshot::Snapshot;
    pub use crate::sim::tool::{Contact, Pose, Tool, ToolShape};
    #[cfg(feature = "inspector")]
    pub use crate::ui::prelude::*;
    #[cfg(feature = "xr")]
    pub use crate::xr::prelude::*;
}

/// The README's examples are doc tests, with what they draw by.
#[cfg(all(doctest, feature = "demo"))]
#[doc = include_str!("../README.md")]
struct Readme;

/// So are those of the guide to haptic arms.
#[cfg(all(doctest, feature = "demo"))]
#[doc = include_str!("../docs/haptics.md")]
struct HapticsGuide;
