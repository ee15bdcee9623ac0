//! The time step of the implicit integrator: by how far tools and clay go, not by the speed of sound.

use super::super::frame::FramePlan;
use super::super::integrator::Integrator;
use super::super::material::ClayMaterial;
use super::super::tool::ToolPath;
use super::afford::FRAME_MAX;
use super::step::StepLimits;
use serde::{Deserialize, Serialize};

/// Greatest travel of clay in an implicit step \[cells\]: less than that of a first guess
/// ([`GUESS_WAY_MAX`](super::super::implicit::GUESS_WAY_MAX)), or a body in flight loses momentum.
const CLAY_TRAVEL_MAX: f64 = 0.5;

/// How many times as many steps as travel alone asks for a frame may have.
pub(super) const REFINEMENT_MAX: u32 = 4;

/// How finely implicit steps follow a tool: what is won in error is paid for in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum StepAccuracy {
    /// A step for 0.225 cells of tool travel, a frame of 20 mm/s at 90 Hz in cells of a millimetre: force
    /// within 1 to 5 %, displacements 2 to 6 %.
    #[default]
    Interactive,
    /// Half of that, at 1.6 times the time: force within 0.3 to 4 %, displacements 1 to 5 %.
    Fine,
}

impl StepAccuracy {
    /// Greatest tool travel in a step \[cells\].
    pub fn travel(self) -> f64 {
        match self {
            Self::Interactive => 0.225,
            Self::Fine => 0.1125,
        }
    }

    /// Passes over the particles in a step.
    pub fn passes(self) -> u32 {
        match self {
            Self::Interactive => 15,
            Self::Fine => 12,
        }
    }
}

impl StepLimits {
    /// A plan for one frame of `duration` \[s\] in implicit steps: the fewest that keep tools and clay within
    /// their travel, times `refinement`.
    pub fn implicit_frame(
        &self,
        accuracy: StepAccuracy,
        refinement: u32,
        (material, cell_width): (&ClayMaterial, f64),
        duration: f64,
        tools: &[ToolPath],
    ) -> FramePlan {
        let rate = self.implicit_rate(accuracy, cell_width, tools);
        // A whole number of steps must not gain one by rounding.
        let steps = (duration * rate - 1e-6).ceil().max(1.0) * f64::from(refinement.clamp(1, REFINEMENT_MAX));
        let steps = steps.min(f64::from(u32::MAX));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the range of u32")]
        let plan = FramePlan::new(*material, duration / steps, steps as u32);
        FramePlan {
            integrator: Integrator::Implicit { passes: accuracy.passes() },
            gravity: self.gravity,
            tools: tools.to_vec(),
            volume_averaging: self.volume_averaging,
            ..plan
        }
    }

    /// Steps per second \[1/s\] that the tools and the clay's own speed ask for; none is longer than
    /// [`FRAME_MAX`].
    pub(super) fn implicit_rate(&self, accuracy: StepAccuracy, cell_width: f64, tools: &[ToolPath]) -> f64 {
        let tool_speed = tools.iter().map(ToolPath::speed_max).fold(0.0, f64::max);
        let by_tools = tool_speed / (accuracy.travel() * cell_width);
        let by_clay = self.speed / (CLAY_TRAVEL_MAX * cell_width);
        by_tools.max(by_clay).max(1.0 / self.time_step.unwrap_or(f64::INFINITY).min(FRAME_MAX))
    }
}
