//! The time step of the explicit integrator: how many substeps a frame needs, and how much inertia may be
//! scaled.

use super::super::frame::FramePlan;
use super::super::integrator::Integrator;
use super::super::material::ClayMaterial;
use super::super::snapshot::Snapshot;
use super::super::tool::ToolPath;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Fraction of the isolated-particle limit that a substep uses; 1e5 steps at it grow total energy by less
/// than 1 %.
pub const STEP_FRACTION: f64 = 0.7;
/// Greatest particle travel per substep \[cells\].
pub const TRAVEL_MAX: f64 = 0.3;
/// Greatest tool travel per substep \[cells\]: faster tools ruin J even where no particle leaks.
pub const TOOL_TRAVEL_MAX: f64 = 0.1;
/// A tool that travels less than this in a frame stands still [cells]: rounding of its pose is 1e-10.
const STILL_TRAVEL: f64 = 1e-6;
/// Greatest tool speed over the wave speed.
pub const TOOL_MACH_MAX: f64 = 0.25;

/// Plastic strain \[-\] in which the ln J of flowing particles come to their cell's mean by all but 1/e.
pub const VOLUME_AVERAGING: f64 = 5e-4;

/// How far inertia may be scaled up while a tool engages supported clay: `rho_s = min(64 rho, eta k / V^2)`,
/// V the tool's speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum InertiaScaling {
    /// Never: free bodies, impacts, waves.
    #[default]
    Off,
    /// eta = 0.002: 1.5 % on the force of a slip-line indentation.
    Accurate,
    /// eta = 0.0075: 3 %.
    Fast,
}

impl InertiaScaling {
    /// Inertial density over density for a tool at `speed` [m/s]; at least 1.
    pub fn density_scale(self, material: &ClayMaterial, speed: f64) -> f64 {
        const SCALE_MAX: f64 = 64.0;
        let eta = match self {
            Self::Off => return 1.0,
            Self::Accurate => 0.002,
            Self::Fast => 0.0075,
        };
        let bound = eta * material.shear_strength() / (material.density * speed * speed).max(f64::MIN_POSITIVE);
        bound.clamp(1.0, SCALE_MAX)
    }
}

/// What bounds the substep. Makes frame plans.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepLimits {
    /// Fraction of the stability limit, [`STEP_FRACTION`] by default.
    pub fraction: f64,
    /// Inertia scaling; applied only while a tool moves.
    pub inertia: InertiaScaling,
    /// Gravity [m/s^2].
    pub gravity: DVec3,
    /// Greatest speed expected in the clay [m/s], from the last report; 0 leaves it to the material and the
    /// tools.
    pub speed: f64,
    /// Anti-locking, see [`FramePlan::volume_averaging`]; [`VOLUME_AVERAGING`] by default.
    pub volume_averaging: f64,
    /// Greatest substep \[s\], however much longer one would be stable.
    pub time_step: Option<f64>,
}

impl Default for StepLimits {
    fn default() -> Self {
        Self {
            fraction: STEP_FRACTION,
            inertia: InertiaScaling::Off,
            gravity: DVec3::new(0.0, -9.81, 0.0),
            speed: 0.0,
            volume_averaging: VOLUME_AVERAGING,
            time_step: None,
        }
    }
}

impl StepLimits {
    /// A plan for one frame of `duration` \[s\] from the state of `snapshot` (its material, cell width and
    /// particle speeds) with `tools`.
    pub fn plan(&self, snapshot: &Snapshot, duration: f64, tools: &[ToolPath]) -> FramePlan {
        let speed =
            snapshot.particles.iter().map(|p| DVec3::from_array(p.velocity.map(f64::from)).length()).fold(self.speed, f64::max);
        Self { speed, ..*self }.frame(&snapshot.material, snapshot.domain.cell_width, duration, tools)
    }

    /// A plan for one frame of `duration` \[s\]: the fewest substeps that keep material, clay speed and tool
    /// speed within their limits.
    pub fn frame(&self, material: &ClayMaterial, cell_width: f64, duration: f64, tools: &[ToolPath]) -> FramePlan {
        let tool_speed = tools.iter().map(ToolPath::speed_max).fold(0.0, f64::max);
        // A tool that stands still needs no scaling, but its speed would ask for the most; and elastic clay
        // has no strength to scale by.
        let moves = tool_speed * duration > STILL_TRAVEL * cell_width && material.yield_stress.is_finite();
        let density_scale = if moves { self.scale(material, tool_speed) } else { 1.0 };
        let limit = material.time_step_limit(cell_width, material.density * density_scale) * self.fraction;
        // A falling clay gains g * duration within the frame.
        let clay_speed = self.speed.max(tool_speed) + self.gravity.length() * duration;
        let dt = limit
            .min(TRAVEL_MAX * cell_width / clay_speed.max(f64::MIN_POSITIVE))
            .min(TOOL_TRAVEL_MAX * cell_width / tool_speed.max(f64::MIN_POSITIVE))
            .min(self.time_step.unwrap_or(f64::INFINITY));
        let steps = (duration / dt).ceil().clamp(1.0, f64::from(u32::MAX));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the range of u32")]
        let plan = FramePlan::new(*material, duration / steps, steps as u32);
        FramePlan {
            integrator: Integrator::Explicit { density_scale },
            gravity: self.gravity,
            tools: tools.to_vec(),
            volume_averaging: self.volume_averaging,
            ..plan
        }
    }

    /// Density scale: within the inertia rule, and so that the tool stays below a quarter of the (scaled)
    /// wave speed.
    fn scale(&self, material: &ClayMaterial, tool_speed: f64) -> f64 {
        let mach = tool_speed / (TOOL_MACH_MAX * material.wave_speed(material.density));
        self.inertia.density_scale(material, tool_speed).min(1.0 / (mach * mach).max(f64::MIN_POSITIVE)).max(1.0)
    }
}
