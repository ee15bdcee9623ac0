//! What the host decides before a frame: fixed point scales and how often particles are re-binned.

use super::super::frame::AVERAGING_INTERVAL;
use super::super::frame::FramePlan;
use super::super::params::Domain;
use super::super::snapshot::Forecast;
use super::layout::Status;

/// Greatest sum of the weights of a node over particles that stand one to a cell: 0.5 + 0.75 + 0.5 along each
/// axis.
const WEIGHT_SUM_MAX: f64 = 1.75 * 1.75 * 1.75;
/// Headroom of the speed bound over the last speed known: a frame that needs more is redone with more. Each
/// bit of headroom is a bit of the momentum.
const REACH_HEADROOM: f64 = 2.0;
/// Headroom of the cell count over the last known.
const CELL_COUNT_HEADROOM: f64 = 1.25;
/// Headroom of the node mass over the last known.
const NODE_MASS_HEADROOM: f64 = 1.5;
/// The least bound on speed [cells/substep]: 2^-12 makes the momentum's quantum 2^-36, far below what f32
/// resolves.
const REACH_MIN: f64 = 1.0 / 4096.0;
/// Part of the margin of one cell that particles may use between two re-bins.
const MARGIN: f64 = 0.9;
/// Re-binning less often than this gains nothing.
const INTERVAL_MAX: u32 = 32;
const _: () = assert!(AVERAGING_INTERVAL.is_power_of_two());

/// Fixed point scales, powers of two, and the bounds for which no sum overflows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Scales {
    /// Mass to i32.
    pub mass: f32,
    /// Momentum to i32.
    pub momentum: f32,
    /// Greatest |v + A d| of a particle [cells/substep].
    pub reach_limit: f32,
    /// Greatest number of particles in a cell.
    pub cell_count_limit: u32,
    /// Greatest mass of a node.
    pub node_mass_limit: f32,
}

/// Greatest speed of the plan's tools \[cells per substep\].
fn tool_travel(plan: &FramePlan, domain: &Domain, dt: f64) -> f64 {
    plan.tools.iter().map(|t| t.speed_max() * dt / domain.cell_width).fold(0.0, f64::max)
}

impl Scales {
    /// Scales for a frame of `plan` run with substeps of `dt` \[s\], of particles up to `mass_max`.
    pub(super) fn new(plan: &FramePlan, domain: &Domain, dt: f64, forecast: &Forecast, mass_max: f64) -> Self {
        let gained = plan.gravity.length() * plan.duration();
        let reach = (REACH_HEADROOM * forecast.reach + gained) * dt / domain.cell_width + 2.0 * tool_travel(plan, domain, dt);
        let count = (CELL_COUNT_HEADROOM * f64::from(forecast.cell_count)).ceil().max(1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        Self::serving(reach, count as u32, NODE_MASS_HEADROOM * forecast.node_mass, mass_max)
    }

    /// The finest scales that serve particles up to `reach` [cells/substep], up to `cell_count` of them, each
    /// up to `mass_max`, in a cell, and nodes up to `node_mass`. A node's mass is bounded by the cell count,
    /// whatever happens, so it tells the truth; a node's momentum by its mass, which the grid pass holds to
    /// its limit.
    #[expect(clippy::cast_possible_truncation, reason = "powers of two")]
    pub(super) fn serving(reach: f64, cell_count: u32, node_mass: f64, mass_max: f64) -> Self {
        let reach = 2f64.powf(reach.max(REACH_MIN).log2().ceil());
        // The rounding of the shares adds at most half a unit each: nothing beside 2^30.
        let scale = |most: f64| (30.99 - most.log2()).floor().exp2() as f32;
        Self {
            mass: scale(WEIGHT_SUM_MAX * f64::from(cell_count) * mass_max),
            momentum: scale(node_mass * reach),
            reach_limit: reach as f32,
            cell_count_limit: cell_count,
            node_mass_limit: node_mass as f32,
        }
    }

    /// Scales that serve more: the bound doubled that `status` says was met. By how much depends on what the
    /// device had done when it stopped, which differs from run to run.
    pub(super) fn relaxed(&self, status: &Status, mass_max: f64) -> Self {
        let (mut reach, mut cell_count) = (f64::from(self.reach_limit), self.cell_count_limit);
        let mut node_mass = f64::from(self.node_mass_limit).max(mass_max);
        // Each bound is looked at by another pass, and after the first that is met no pass does anything.
        if status.reach_met != 0 {
            reach *= 2.0;
        } else if status.cell_count > cell_count {
            cell_count *= 2;
        } else {
            node_mass *= 2.0;
        }
        Self::serving(reach, cell_count, node_mass, mass_max)
    }
}

/// Substeps between two re-bins.
pub(super) fn interval(plan: &FramePlan, domain: &Domain, dt: f64, forecast: &Forecast) -> u32 {
    let gained = plan.gravity.length() * plan.duration();
    let travel = (1.5 * forecast.speed + gained) * dt / domain.cell_width + tool_travel(plan, domain, dt);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a small count")]
    let substeps = (MARGIN / travel.max(1e-9)).clamp(1.0, f64::from(INTERVAL_MAX)) as u32;
    // Volumes are averaged where the particles have just been sorted: a power of two divides the substeps
    // between two averagings.
    if plan.averages() { 1 << substeps.min(AVERAGING_INTERVAL).ilog2() } else { substeps }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Met by little or by much, a bound is doubled; the others stay.
    #[test]
    fn scales_are_relaxed_by_what_was_met_alone() {
        let s = Scales::serving(0.1, 10, 12.0, 1.0);
        let relaxed =
            |reach_met, cell_count, node_mass| s.relaxed(&Status { reach_met, cell_count, node_mass, ..Status::default() }, 1.0);
        for much in [11, 15, 400] {
            assert_eq!(relaxed(1, 10, much), Scales::serving(0.2, 10, 12.0, 1.0));
            assert_eq!(relaxed(0, much, 0), Scales::serving(0.1, 20, 12.0, 1.0));
            assert_eq!(relaxed(0, 10, much), Scales::serving(0.1, 10, 24.0, 1.0));
        }
    }

    /// The worst clay that the bounds admit does not overflow, and the scales waste less than two bits.
    #[test]
    fn scales_serve_their_bounds() {
        for count in [1, 8, 64, 500] {
            for reach in [1e-5, 0.03, 0.49, 7.0] {
                for mass in [0.3, 1.0, 1.9] {
                    let node = f64::from(count) * mass * 1.5;
                    let s = Scales::serving(reach, count, node, mass);
                    let sum = WEIGHT_SUM_MAX * f64::from(count) * mass * f64::from(s.mass);
                    assert!((0.24 * 2f64.powi(31)..2f64.powi(31)).contains(&sum), "{s:?}: {sum}");
                    assert!(f64::from(s.reach_limit) >= reach);
                    let sum = node * f64::from(s.reach_limit) * f64::from(s.momentum);
                    assert!((0.24 * 2f64.powi(31)..2f64.powi(31)).contains(&sum), "{s:?}: {sum}");
                    assert_eq!(s.mass.log2().fract(), 0.0);
                }
            }
        }
    }
}
