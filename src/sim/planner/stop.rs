//! Tools that stop at once: what the clay's inertia then takes off their force.
//!
//! Clay before a tool goes on where that stops, and carries a part of the contact's stress away with its
//! waves, `sqrt(rho mu)` for each m/s. It is over within the time that waves take about the tool, tenths of a
//! millisecond to some: backward Euler, whose steps are ten times as long, has nothing of it.

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

/// How long explicit steps follow the clay after a stop, over the time in which shear waves pass the tool's
/// bounding radius [-]. With 1 a ball of 10 mm that stopped from 0.4 m/s, 1.2 ms before its frame's end, kept
/// 3.6 % more than by explicit steps alone, with 2 one from 0.2 m/s 1.1 %; with 4 and 8 all less than 1 %.
const SETTLING: f64 = 4.0;

/// How tools' origins move where a frame ends: [m/s], by id; and for how long yet clay is about to settle
/// after a stop \[s\]. What only turns counts as standing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Ends {
    velocities: Vec<(u32, DVec3)>,
    unsettled: f64,
}

impl Ends {
    /// Of a frame of `duration` \[s\] with these tools in clay of `material`, after the frame that ended like
    /// `before`.
    pub(super) fn of(before: &Self, material: &ClayMaterial, duration: f64, tools: &[ToolPath]) -> Self {
        let last = |path: &ToolPath| (path.id, velocities(path).last().map_or(DVec3::ZERO, |(_, velocity)| velocity));
        let unsettled = before.unsettled_after(material, tools).map_or(0.0, |until| (until - duration).max(0.0));
        Self { velocities: tools.iter().map(last).collect(), unsettled }
    }

    /// Whether clay of `material` has a sharp stop to settle in a frame with these tools, after one that
    /// ended like this.
    pub(super) fn are_unsettled(&self, material: &ClayMaterial, tools: &[ToolPath]) -> bool {
        self.unsettled_after(material, tools).is_some()
    }

    /// Until when \[s\] from the start of a frame with these tools clay settles after sharp stops; none where
    /// there are none.
    fn unsettled_after(&self, material: &ClayMaterial, tools: &[ToolPath]) -> Option<f64> {
        let before = (self.unsettled > 0.0).then_some(self.unsettled);
        let stops = tools.iter().filter_map(|path| self.stop(material, path));
        before.into_iter().chain(stops).reduce(f64::max)
    }

    /// Until when clay settles after the last sharp stop of a tool.
    fn stop(&self, material: &ClayMaterial, path: &ToolPath) -> Option<f64> {
        let shear_speed = (material.lame_mu() / material.density).sqrt();
        let speed_min = STRESS_MIN * material.yield_stress / (material.density * shear_speed);
        let settling = SETTLING * path.tool.shape.bounding_radius() / shear_speed;
        let mut before = self.velocities.iter().find(|(id, _)| *id == path.id).map_or(DVec3::ZERO, |(_, velocity)| *velocity);
        // A single sample is a tool that stands.
        let still = (path.samples.len() == 1).then_some((0.0, DVec3::ZERO));
        let stops = velocities(path).chain(still).filter_map(|(time, velocity)| {
            let (speed, left) = (before.length(), velocity.dot(before.normalize_or_zero()).max(0.0));
            before = velocity;
            (left <= SPEED_LEFT_MAX * speed && speed - left >= speed_min).then_some(time + settling)
        });
        stops.reduce(f64::max)
    }
}

/// How a tool's origin moves from sample to sample [m/s], each from when \[s\] on.
fn velocities(path: &ToolPath) -> impl Iterator<Item = (f64, DVec3)> {
    path.samples.windows(2).map(|pair| {
        let way = pair[1].pose.position - pair[0].pose.position;
        (pair[0].time, way / (pair[1].time - pair[0].time))
    })
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
        let after = |before: &[f64]| Ends::of(&Ends::default(), &soft, 1e-3, &[path(before)]);
        let stops =
            |material: &ClayMaterial, before: &[f64], heights: &[f64]| after(before).are_unsettled(material, &[path(heights)]);
        let still = &[0.0, 0.0][..];
        assert!(stops(&soft, still, &[0.0, 0.13, 0.13]) && !stops(&soft, still, &[0.0, 0.12, 0.12]));
        assert!(stops(&soft, &[0.0, 0.2], still) && stops(&soft, &[0.0, 0.2], &[0.2]));
        assert!(stops(&soft, still, &[0.0, 0.2, 0.0]) && !stops(&soft, &[0.0], &[0.2, 0.2]));
        assert!(!stops(&soft, still, &[0.0, 0.4, 0.5, 0.6]) && !stops(&soft, still, &[0.0, 0.1, 0.2, 0.22, 0.22]));
        let stiff = Preset::StiffClay.material();
        assert!(!stops(&stiff, still, &[0.0, 0.2, 0.2]) && stops(&stiff, still, &[0.0, 1.0, 1.0]));
        let other = ToolPath { id: 4, ..path(&[0.0, 0.2]) };
        assert!(!Ends::of(&Ends::default(), &soft, 1e-3, &[other]).are_unsettled(&soft, &[path(still)]));
    }

    /// After a stop clay settles for as long as waves take about the tool, into the frames after too.
    #[test]
    fn clay_settles_after_a_stop() {
        let soft = Preset::SoftClay.material();
        let settling = SETTLING * 0.005 / (soft.lame_mu() / soft.density).sqrt();
        let stand = [path(&[0.0])];
        let mut ends = Ends::of(&Ends::default(), &soft, 2e-3, &[path(&[0.0, 0.2, 0.2])]);
        let mut left = settling - 1e-3;
        while left > 0.0 {
            assert!(ends.are_unsettled(&soft, &stand), "{left} s");
            ends = Ends::of(&ends, &soft, 1e-3, &stand);
            left -= 1e-3;
        }
        assert!(!ends.are_unsettled(&soft, &stand));
        // Long before the frame's end.
        assert!(!Ends::of(&Ends::default(), &soft, 1.0, &[path(&[0.0, 0.2, 0.2])]).are_unsettled(&soft, &stand));
    }
}
