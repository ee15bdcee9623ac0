//! The clay solver: explicit MLS-MPM/APIC with quadratic B-splines, Hencky elasticity, von Mises plasticity
//! and persistent cuts.
//!
//! A frame is a [`FramePlan`](frame::FramePlan) run by an [`Engine`](engine::Engine). One substep of it, from
//! `t` to `t + h`, in this order on every engine:
//!
//! | pass        | does                                                               | equation            |
//! |-------------|--------------------------------------------------------------------|---------------------|
//! | `averaging` | particles that flowed share their cell's volume ratio              | -                   |
//! | `tags`      | particles that a blade came near or swept over take their side     | Eq. 1, swept        |
//! | (`ahead`)   | what edges of blades have to part                                  | -                   |
//! | `penalty`   | solid tools, edges of blades and walls press on particles          | one potential       |
//! | `p2g`       | mass and momentum of each side class to the nodes, with the stress | Eq. 2-4             |
//! | `grid`      | walls fold their outer nodes onto the inner ones                   | -                   |
//! |             | cuts divide the nodes: what is on one side moves as one field      | Eq. 2-3, compatible |
//! |             | how what stands on two sides of a cut, or two bodies, face each    | -                   |
//! |             | other                                                              | -                   |
//! |             | momentum -> velocity, gravity                                      | -                   |
//! |             | contact: flanks of blades, then the sides of cuts                  | -                   |
//! |             | walls give their outer nodes the image of the inner ones' velocity | -                   |
//! | `g2p`       | velocity and affine from the particle's own side, advection; what  | -                   |
//! |             | nodes do not see of its own velocity fades                         | -                   |
//! | (`law`)     | elastic strain, flow, working: the next substep's stress           | Eq. 5 (softening)   |
//! | `weld`      | pressed sides of a cut grow together; once, at the frame's end,    | -                   |
//! | `carry`     | clay behind a cut's thinned side takes that side; likewise, and    | -                   |
//! |             | then volumes are averaged again                                    | -                   |
//!
//! Each pass stands, to the last sign, at the head of its file in `oracle`, beside the plain f64 code that
//! does it: `averaging`, `tags`, `penalty`, `p2g`, `walls`, `sides`, `contact`, `g2p`, `law`, `weld`,
//! `carry`, and `ghost` and `interactive` for the methods of others
//! ([`cutting`](frame::FramePlan::cutting)). Engines are written from these texts; the oracle judges them,
//! particle by particle.
//!
//! # Notation
//!
//! Lengths are in cells unless said; nodes stand at integers. The stencil of a particle at `x` is nodes
//! `b .. b + 2` with `b = floor(x - 1/2)` and the quadratic weights
//! `w = (1.5 - f)^2 / 2, 3/4 - (f - 1)^2, (f - 1/2)^2 / 2` of `f = x - b`. `rho_s` is the inertial density,
//! `m_p = rho_s V_p`, `V_p` the particle's rest volume. A *class* is all particles on the same sides of the
//! same cuts ([`ClassKey`](cut::ClassKey)).
//!
//! # Files
//!
//! In data-flow order: [`params`], [`material`] and [`strength`] say what the clay is, [`tool`] what touches
//! it, [`penalty`] how, `ahead` what edges have to part, [`snapshot`] holds its state, [`cut`] the sides of
//! cuts, [`cutting`] the method, [`planner`] decides what a frame does, [`integrator`] by which steps,
//! [`frame`] is its plan and report, [`engine`] the seam, [`native`] the CPU engine, [`gpu`] the one of
//! compute passes, [`oracle`] the readable f64 judge of both.

#![deny(
    clippy::wildcard_enum_match_arm,
    reason = "a new law, shape, contact or method must not fall to what was meant for another"
)]

mod admit;
pub(crate) mod ahead;
pub mod body;
mod carry;
mod coefficients;
pub mod cut;
pub mod cutting;
pub(crate) mod disjoint;
pub mod engine;
mod facing;
pub mod frame;
pub mod gpu;
pub mod health;
mod implicit;
pub mod integrator;
pub mod limits;
pub mod material;
pub mod native;
#[cfg(feature = "reference")]
pub mod oracle;
pub(crate) mod packet;
pub mod params;
mod patch;
pub mod penalty;
pub mod planner;
pub mod snapshot;
mod spline;
pub mod strength;
mod sums;
mod support;
pub mod tool;
pub mod touch;
#[cfg(feature = "reference")]
pub mod trace;
#[cfg(feature = "reference")]
pub mod validation;
#[cfg(not(feature = "reference"))]
#[expect(unreachable_pub, reason = "public with the feature `reference`")]
mod validation;
mod variants;
mod weld;

/// What most programs need.
pub mod prelude {
    pub use super::cutting::CuttingMethod;
    pub use super::engine::{Engine, EngineError};
    pub use super::frame::{FrameOutputs, FramePlan, FrameReport, SurfaceParticle, SurfaceSource, ToolReport};
    pub use super::gpu::{GpuDevice, GpuEngine, GpuError, GpuLink, GpuMode};
    pub use super::health::Health;
    pub use super::integrator::Integrator;
    pub use super::material::{ClayLaw, ClayMaterial, Preset, Weld};
    pub use super::native::NativeEngine;
    pub use super::params::{Domain, ParamsError, Wall, Walls};
    pub use super::planner::{
        Backlog, Decision, InertiaScaling, IntegratorChoice, Planner, PlannerState, Policy, Sheets, StepAccuracy, StepLimits,
        ToolSamples,
    };
    pub use super::snapshot::{Anchor, Forecast, Particle, Snapshot, SnapshotError, Tag};
    pub use super::tool::{Contact, Pose, PoseSample, Profile, Tool, ToolPath, ToolShape};
}
