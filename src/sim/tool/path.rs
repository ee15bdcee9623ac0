//! A tool's way through a frame: samples in time, swept over the substeps and never jumped.

use super::super::cut::{JOINT_SHEET, PLATE_SHEET};
use super::contact::Tool;
use super::outline::Outline;
use super::shape::ToolShape;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Where a tool is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position of the tool's origin \[m\].
    pub position: DVec3,
    /// Rotation from the tool's frame to the world.
    pub rotation: DQuat,
}

impl Default for Pose {
    fn default() -> Self {
        Self { position: DVec3::ZERO, rotation: DQuat::IDENTITY }
    }
}

impl Pose {
    /// World point \[m\] -> the tool's frame \[m\].
    pub fn to_local(&self, world: DVec3) -> DVec3 {
        self.rotation.inverse() * (world - self.position)
    }

    /// Point in the tool's frame \[m\] -> world \[m\].
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.rotation * local + self.position
    }

    /// The pose at the part `t` [-] of the way from here to `other`: position linear, rotation slerp.
    pub fn between(&self, other: Self, t: f64) -> Self {
        // By the way: sums of shares of both ends would let a tool that stands creep.
        let position = self.position + (other.position - self.position) * t;
        Self { position, rotation: self.rotation.slerp(other.rotation, t) }
    }

    /// Way \[m\] to `other` of any point within `radius` \[m\] of the tool's origin, at most.
    pub fn way(&self, other: Self, radius: f64) -> f64 {
        // By atan2: an arc cosine of nearly 1 sees turns of 3e-8 where there is none.
        let between = self.rotation.inverse() * other.rotation;
        let turn = 2.0 * between.xyz().length().atan2(between.w.abs()) * radius;
        self.position.distance(other.position) + turn
    }
}

/// A pose at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseSample {
    /// Seconds from the start of the frame.
    pub time: f64,
    /// The pose then.
    pub pose: Pose,
}

impl PoseSample {
    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.time.is_finite() && self.pose.position.is_finite() && self.pose.rotation.is_finite()
    }
}

/// A tool and the samples of its path over one frame, in order of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToolPath {
    /// Names the tool in the report.
    pub id: u32,
    /// The tool.
    pub tool: Tool,
    /// The sheet, from 1, that the tool cuts if it is a blade; 0 for one named by the id. A box with a sheet
    /// from [`PLATE_SHEET`] on is a plate, which parts the clay on its two sides while it is there; one
    /// without leaves it to the grid, which does not see what is thinner than two cells.
    /// [`Sheets`](crate::sim::planner::Sheets) deals them.
    #[serde(default)]
    pub sheet: u8,
    /// At least one sample; held before the first and after the last.
    pub samples: Vec<PoseSample>,
}

impl ToolPath {
    /// A tool that stands still.
    pub fn still(id: u32, tool: Tool, pose: Pose) -> Self {
        Self { id, tool, sheet: 0, samples: vec![PoseSample { time: 0.0, pose }] }
    }

    /// The sheet that this tool cuts if it is a blade: as given, or the id's, from 1 to below
    /// [`JOINT_SHEET`] and around.
    #[expect(clippy::cast_possible_truncation, reason = "a remainder of less than 240")]
    pub fn sheet_id(&self) -> u8 {
        if self.sheet != 0 { self.sheet } else { ((self.id.max(1) - 1) % (u32::from(JOINT_SHEET) - 1)) as u8 + 1 }
    }

    /// What parts the clay, a blade, a wire, or the middle of a plate, where `shape` is the tool's in the
    /// caller's unit.
    pub(crate) fn outline(&self, shape: ToolShape) -> Option<Outline> {
        match shape {
            ToolShape::Box { half_size } => (self.sheet >= PLATE_SHEET).then_some(Outline::Plate { half_size }),
            ToolShape::Sphere { .. }
            | ToolShape::Capsule { .. }
            | ToolShape::Blade { .. }
            | ToolShape::PointedBlade { .. }
            | ToolShape::BentBlade { .. }
            | ToolShape::Wire { .. }
            | ToolShape::Cone { .. } => shape.outline(),
        }
    }

    /// Whether the tool parts the clay: as a blade, a wire, or a plate.
    pub fn divides(&self) -> bool {
        self.outline(self.tool.shape).is_some()
    }

    /// The pose at `time` \[s\]: position linear, rotation slerp between samples. A path without samples stays
    /// at the world's origin.
    pub fn pose_at(&self, time: f64) -> Pose {
        let next = self.samples.partition_point(|s| s.time <= time);
        match (next.checked_sub(1).map(|i| self.samples[i]), self.samples.get(next)) {
            (None, None) => Pose::default(),
            (None, Some(first)) => first.pose,
            (Some(last), None) => last.pose,
            (Some(a), Some(b)) => a.pose.between(b.pose, (time - a.time) / (b.time - a.time)),
        }
    }

    /// The motion over one substep from `start` to `end` \[s\].
    pub fn motion(&self, start: f64, end: f64) -> Motion {
        Motion { start: self.pose_at(start), end: self.pose_at(end), duration: end - start }
    }

    /// Greatest speed [m/s] of any point of the tool within its bounding sphere over the path's samples.
    pub fn speed_max(&self) -> f64 {
        let radius = self.tool.shape.bounding_radius();
        let speed = |w: &[PoseSample]| w[0].pose.way(w[1].pose, radius) / (w[1].time - w[0].time);
        self.samples.windows(2).map(speed).fold(0.0, f64::max)
    }

    /// Whether every number of the path is finite, with samples in strict order of time.
    pub fn is_finite(&self) -> bool {
        self.samples.iter().all(PoseSample::is_finite) && self.samples.windows(2).all(|w| w[0].time < w[1].time)
    }
}

/// A rigid motion over one substep.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Pose at the substep's start.
    pub start: Pose,
    /// Pose at its end.
    pub end: Pose,
    /// Seconds between them.
    pub duration: f64,
}

impl Motion {
    /// Velocity [m/s] over the substep of the tool's material point that stands at `world` \[m\] at its end.
    pub fn velocity_at(&self, world: DVec3) -> DVec3 {
        (world - self.start.to_world(self.end.to_local(world))) / self.duration
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tool between two poses that are the same stands there, to the last bit.
    #[test]
    fn between_equal_poses_a_tool_stands() {
        for height in [0.0048, 0.0052, 0.0087, 0.0093, -0.1] {
            let pose = Pose { position: DVec3::new(0.3, height, 1.0 / 3.0), ..Pose::default() };
            assert!((0..100).all(|i| pose.between(pose, f64::from(i) / 99.0).position == pose.position), "{height}");
        }
    }
}
