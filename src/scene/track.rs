//! Tools on keyframes.

use super::check::{Check, check_place};
use super::line::short;
use crate::sim::params::{Bounds, ParamsError, SPEED, TIME};
use crate::sim::tool::{Contact, Pose, PoseSample, Tool, ToolPath, ToolShape};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Times closer than this are one [s]: far below any substep, far above the rounding of `frame * frame_time`.
const SAME_TIME: f64 = 1e-9;

/// Angles of a turn [degrees]: 2700 times round, which between two keyframes is none.
const ANGLE: Bounds =
    Bounds::new(0.0, 1e6, " degrees", "must be an angle in degrees", "no turn between two keyframes is more than half a one");

/// Least length of an axis. One of 1e-161 has a square that is hardly a number, and no direction.
const AXIS_MIN: f64 = 1e-6;

/// A turn about an axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisAngle {
    /// The axis, of any length from 1e-6 on.
    pub axis: DVec3,
    /// The angle, right-handed \[degrees\].
    pub degrees: f64,
}

impl Default for AxisAngle {
    fn default() -> Self {
        Self { axis: DVec3::Y, degrees: 0.0 }
    }
}

impl AxisAngle {
    /// The rotation as a quaternion.
    pub fn quaternion(&self) -> DQuat {
        DQuat::from_axis_angle(self.axis.normalize_or(DVec3::Y), self.degrees.to_radians())
    }
}

impl Check for AxisAngle {
    fn check(&self) -> Result<(), ParamsError> {
        if self.axis.try_normalize().is_none() || self.axis.length() < AXIS_MIN {
            let reason = format!("must be finite and of a length of at least {AXIS_MIN:e}");
            return Err(ParamsError::new("rotation.axis", self.axis, reason));
        }
        ANGLE.check_signed("rotation.degrees", self.degrees)
    }
}

/// Where a tool is at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// Time from the scene's start \[s\].
    pub time: f64,
    /// Position of the tool's origin \[m\].
    pub position: DVec3,
    /// Rotation from the tool's frame to the world.
    #[serde(default)]
    pub rotation: AxisAngle,
}

impl Keyframe {
    fn sample(&self) -> PoseSample {
        PoseSample { time: self.time, pose: Pose { position: self.position, rotation: self.rotation.quaternion() } }
    }
}

/// How an arm is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Grip {
    /// By two finger tips.
    Pinch,
    /// As a pen is.
    Stylus,
    /// In a fist.
    Firm,
}

/// A tool and its way through the scene. It exists from its first keyframe to its last; with one keyframe,
/// from that time on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToolTrack {
    /// What to call it in reports.
    #[serde(default)]
    pub name: String,
    /// Its shape.
    pub shape: ToolShape,
    /// The contact of its surface.
    #[serde(default)]
    pub contact: Contact,
    /// Poses in strict order of time. Between them position is linear and rotation takes the shorter way.
    pub keyframes: Vec<Keyframe>,
    /// Whose hand leads it by a simulated haptic arm: it means to go where the keyframes say, and goes where
    /// the clay's force lets it. Without one the tool is there.
    #[serde(default)]
    pub hand: Option<Grip>,
}

impl Check for ToolTrack {
    fn check(&self) -> Result<(), ParamsError> {
        self.tool().validate()?;
        if self.keyframes.is_empty() {
            return Err(ParamsError::new("keyframes", "[]", format!("tool `{}` needs at least one", short(&self.name))));
        }
        for frame in &self.keyframes {
            TIME.check_signed("keyframes.time", frame.time)?;
            check_place("keyframes.position", frame.position)?;
            frame.rotation.check()?;
        }
        if let Some(pair) = self.keyframes.windows(2).find(|pair| pair[1].time - pair[0].time <= SAME_TIME) {
            let reason = format!("must be later than the keyframe before, at {} s", pair[0].time);
            return Err(ParamsError::new("keyframes.time", pair[1].time, reason));
        }
        let turn = |frame: &Keyframe| frame.rotation.quaternion();
        if self.hand.is_some()
            && let Some(other) = self.keyframes.iter().find(|frame| turn(frame) != turn(&self.keyframes[0]))
        {
            let reason = "must be that of the first keyframe: a simulated arm does not turn its tool";
            return Err(ParamsError::new("keyframes.rotation", format!("{:?}", other.rotation), reason));
        }
        SPEED.check("keyframes.speed", self.speed_max())
    }
}

impl ToolTrack {
    /// The tool.
    pub fn tool(&self) -> Tool {
        Tool { shape: self.shape, contact: self.contact }
    }

    /// What messages call it where it is `index` in the scene's list: `tools[2] (knife)`.
    pub fn title(&self, index: usize) -> String {
        let name = short(&self.name);
        if name.is_empty() { format!("tools[{index}]") } else { format!("tools[{index}] ({name})") }
    }

    /// The whole way as `id`.
    pub(super) fn whole(&self, id: u32) -> ToolPath {
        ToolPath { id, tool: self.tool(), sheet: 0, samples: self.keyframes.iter().map(Keyframe::sample).collect() }
    }

    /// The greatest speed of any of its points [m/s].
    pub fn speed_max(&self) -> f64 {
        self.whole(1).speed_max()
    }

    /// The times from which and until which it is there \[s\]; none without keyframes.
    pub(super) fn span(&self) -> Option<(f64, f64)> {
        let (first, last) = (self.keyframes.first()?.time, self.keyframes.last()?.time);
        Some((first, if self.keyframes.len() == 1 { f64::INFINITY } else { last }))
    }

    /// The path as `id` through the frame from `start` to `end` \[s\], its times from `start` on; none in
    /// frames without the tool. Samples stand at the frame's ends and at the keyframes within, which is
    /// exact: engines interpolate as keyframes do.
    pub fn path(&self, id: u32, start: f64, end: f64) -> Option<ToolPath> {
        let (first, last) = self.span()?;
        let (from, to) = (start.max(first), end.min(last));
        if to - from <= SAME_TIME {
            return None;
        }
        let whole = self.whole(id);
        let within = |s: &&PoseSample| s.time > from + SAME_TIME && s.time < to - SAME_TIME;
        let times = std::iter::once(from).chain(whole.samples.iter().filter(within).map(|s| s.time)).chain(std::iter::once(to));
        let samples = times.map(|time| PoseSample { time: time - start, pose: whole.pose_at(time) }).collect();
        Some(ToolPath { samples, ..whole })
    }

    /// Low and high corner of a box that the tool stays in at its keyframes \[m\].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let half = match self.shape {
            ToolShape::Sphere { radius } => DVec3::splat(radius),
            ToolShape::Capsule { radius, half_length } => DVec3::new(radius, radius + half_length, radius),
            ToolShape::Box { half_size } => half_size,
            ToolShape::Blade { half_width, half_height } | ToolShape::PointedBlade { half_width, half_height } => {
                DVec3::new(half_width, half_height, 0.0)
            }
            ToolShape::BentBlade { profile, half_height } => {
                let reach = profile.points().iter().fold(glam::DVec2::ZERO, |reach, p| reach.max(p.abs()));
                DVec3::new(reach.x, half_height, reach.y)
            }
            ToolShape::Wire { half_length } => DVec3::X * half_length,
            ToolShape::Cone { radius, half_height } => DVec3::new(radius, half_height, radius),
        };
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.keyframes.iter().fold(none, |(low, high), frame| {
            let turn = glam::DMat3::from_quat(frame.rotation.quaternion());
            let reach = turn.x_axis.abs() * half.x + turn.y_axis.abs() * half.y + turn.z_axis.abs() * half.z;
            (low.min(frame.position - reach), high.max(frame.position + reach))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(times: &[f64]) -> ToolTrack {
        let keyframes = times
            .iter()
            .map(|&time| Keyframe {
                time,
                position: DVec3::X * time,
                rotation: AxisAngle { axis: DVec3::Z * 3.0, degrees: 90.0 * time },
            })
            .collect();
        ToolTrack { name: "t".into(), shape: ToolShape::Sphere { radius: 0.1 }, contact: Contact::Stick, keyframes, hand: None }
    }

    /// At every time of every frame the path is where the keyframes say.
    #[test]
    fn path_of_frames_follows_keyframes() {
        let track = track(&[0.5, 0.8, 1.25]);
        let mut frames = 0;
        for frame in 0..20 {
            let (start, end) = (f64::from(frame) * 0.1, f64::from(frame + 1) * 0.1);
            let Some(path) = track.path(7, start, end) else { continue };
            frames += 1;
            assert!(path.is_finite() && path.id == 7);
            for i in 0..=10 {
                let time = (start + f64::from(i) * 0.01).clamp(0.5, 1.25);
                let pose = path.pose_at(time - start);
                assert!((pose.position - DVec3::X * time).length() < 1e-9, "{time}: {pose:?}");
                assert!(pose.rotation.angle_between(DQuat::from_rotation_z((90.0 * time).to_radians())) < 1e-6);
            }
        }
        assert_eq!(frames, 8, "from 0.5 to 1.25 s in frames of 0.1 s");
    }

    #[test]
    fn single_keyframe_stands_from_its_time_on() {
        let track = track(&[0.5]);
        assert_eq!(track.path(1, 0.3, 0.4), None);
        let path = track.path(1, 5.0, 5.1).expect("path");
        assert_eq!((path.speed_max(), path.pose_at(0.0).position), (0.0, DVec3::X * 0.5));
    }

    #[test]
    fn keyframes_out_of_order_or_missing_are_refused() {
        for (times, part) in
            [(&[0.0, 0.2, 0.1][..], "0.1: must be later"), (&[0.2, 0.2], "later"), (&[], "at least one"), (&[f64::NAN], "finite")]
        {
            let error = track(times).check().expect_err("bad keyframes").to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn bounds_of_turned_blade_hold_its_corners() {
        let mut track = track(&[0.0, 1.0]);
        track.shape = ToolShape::Blade { half_width: 0.3, half_height: 0.1 };
        let (low, high) = track.bounds();
        let expected = (DVec3::new(-0.3, -0.3, 0.0), DVec3::new(1.1, 0.3, 0.0));
        assert!((low - expected.0).length() < 1e-12 && (high - expected.1).length() < 1e-12, "{low} {high}");
    }
}
