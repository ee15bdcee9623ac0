//! Limits that every engine keeps, the shaders too.

/// Greatest node travel in one substep \[cells\]: beyond half a cell a particle could leave the nodes that wait
/// for it. A frame that meets it is redone with half the step.
pub const TRAVEL_LIMIT: f32 = 0.49;
/// How often a frame is halved before it is given up: a 16th of the step reaches speeds the plan cannot have
/// known.
pub const REDO_MAX: u32 = 4;
/// Frames that may be under way in one engine: one runs, one is ready.
pub const PENDING_MAX: usize = 2;

/// Least and greatest elastic stretch [-]: beyond, the strain is clamped and counted.
pub const STRETCH_MIN: f64 = 0.05;
/// The greatest.
pub const STRETCH_MAX: f64 = 20.0;

/// Greatest Frobenius norm of `b_trial - I` that series serve [-]. There the Pade [3/3] log and the Taylor-6
/// exp are each off by at most 3e-8 (at -0.25; 1e-9 and less within 0.17), one unit in the last place of an
/// f32 of that size.
pub(crate) const SERIES_MAX: f64 = 0.25;
/// Newton steps for the power law of flow: from the start below the residual is at most the excess itself,
/// and 8 steps bring it to f32 rounding for n >= 0.05 (`power_law_flow_is_solved`).
pub(crate) const FLOW_STEPS: u32 = 8;
/// Most sheets that divide one node: particles know two, and a node sees those within 1.5 cells. The sheets
/// of the lowest numbers count.
pub(crate) const DIVISIONS_MAX: u32 = 4;
