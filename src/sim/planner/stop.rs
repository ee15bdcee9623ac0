//! Tools that stop at once: what the clay's inertia then takes off their force.
//!
//! Clay before a tool goes on where that stops, and carries a part of the contact's stress away with its
//! waves, `sqrt(rho mu)` for each m/s. It is over within the time that waves take about the tool, some tenths
//! of a millisecond: backward Euler, whose steps are ten times as long, has nothing of it.

use super::super::material::ClayMaterial;
use super::super::tool::ToolPath;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Stress that clay carries away over its yield stress [-] from which on a stop is sharp: 0.125 m/s in soft
/// clay. Of a ball of 2.5 cells that stops 2 cells deep in it, explicit steps keep 4.5 % less than implicit
/// ones at 0.3 of it (0.15 m/s), 9 at 0.4, 15 at 0.6, 35 at 1.2 and all at 2.4; 1 % more at 0.2.
const STRESS_MIN: f64 = 0.25;

/// What is left of a tool's speed [-] where it counts as stopped: what goes on meets clay that flows anew.
const SPEED_LEFT_MAX: f64 = 0.1;

/// How tools' origins move where a frame ends: [m/s], by id. What only turns counts as standing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Ends(Vec<(u32, DVec3)>);

impl Ends {
    /// Of the tools of a frame.
    pub(super) fn of(tools: &[ToolPath]) -> Self {
        Self(tools.iter().map(|path| (path.id, velocities(path).last().unwrap_or(DVec3::ZERO))).collect())
    }

    /// Whether any of the `tools`, from where they moved like this, stops sharply in clay of `material`.
    pub(super) fn stop_sharply(&self, material: &ClayMaterial, tools: &[ToolPath]) -> bool {
        let speed_min = STRESS_MIN * material.yield_stress / (material.density * material.lame_mu()).sqrt();
        tools.iter().any(|path| {
            let mut before = self.0.iter().find(|(id, _)| *id == path.id).map_or(DVec3::ZERO, |(_, velocity)| *velocity);
            // A single sample is a tool that stands.
            let still = (path.samples.len() == 1).then_some(DVec3::ZERO);
            velocities(path).chain(still).any(|velocity| {
                let (speed, left) = (before.length(), velocity.dot(before.normalize_or_zero()).max(0.0));
                before = velocity;
                left <= SPEED_LEFT_MAX * speed && speed - left >= speed_min
            })
        })
    }
}

/// How a tool's origin moves from sample to sample [m/s].
fn velocities(path: &ToolPath) -> impl Iterator<Item = DVec3> {
    path.samples.windows(2).map(|pair| (pair[1].pose.position - pair[0].pose.position) / (pair[1].time - pair[0].time))
}

#[cfg(test)]
mod tests {
    use super::super::super::material::Preset;
    use super::super::super::tool::{Contact, Pose, PoseSample, Tool, ToolShape};
    use super::*;

    /// A ball at these heights [mm] every millisecond.
    fn path(heights: &[f64]) -> ToolPath {
        let tool = Tool { shape: ToolShape::Sphere { radius: 0.005 }, contact: Contact::default() };
        let pose = |y: f64| Pose { position: DVec3::Y * 1e-3 * y, ..Pose::default() };
        let samples = (0..).zip(heights).map(|(ms, y)| PoseSample { time: 1e-3 * f64::from(ms), pose: pose(*y) });
        ToolPath { id: 3, tool, sheet: 0, samples: samples.collect() }
    }

    /// Stops are sharp from a speed on that the material has; whether one falls into a frame or between two,
    /// and whether the tool stands there or turns round. Slowing down is none, nor a tool of another id.
    #[test]
    fn sharp_stops_are_told() {
        let soft = Preset::SoftClay.material();
        let stops = |material: &ClayMaterial, before: &[f64], heights: &[f64]| {
            Ends::of(&[path(before)]).stop_sharply(material, &[path(heights)])
        };
        let still = &[0.0, 0.0][..];
        assert!(stops(&soft, still, &[0.0, 0.13, 0.13]) && !stops(&soft, still, &[0.0, 0.12, 0.12]));
        assert!(stops(&soft, &[0.0, 0.2], still) && stops(&soft, &[0.0, 0.2], &[0.2]));
        assert!(stops(&soft, still, &[0.0, 0.2, 0.0]) && !stops(&soft, &[0.0], &[0.2, 0.2]));
        assert!(!stops(&soft, still, &[0.0, 0.4, 0.5, 0.6]) && !stops(&soft, still, &[0.0, 0.1, 0.2, 0.22, 0.22]));
        let stiff = Preset::StiffClay.material();
        assert!(!stops(&stiff, still, &[0.0, 0.2, 0.2]) && stops(&stiff, still, &[0.0, 1.0, 1.0]));
        let other = ToolPath { id: 4, ..path(&[0.0, 0.2]) };
        assert!(!Ends::of(&[other]).stop_sharply(&soft, &[path(still)]));
    }
}
