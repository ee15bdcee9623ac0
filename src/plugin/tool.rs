//! Tools of an app: entities whose ways are swept through the clay, never jumped, and that feel it.

use crate::sim::params::ParamsError;
use crate::sim::tool::{Contact, Pose, Tool, ToolShape};
use bevy::prelude::*;

/// A tool. Its pose is the entity's [`Transform`], below those of its parents; its way from frame to frame is
/// swept. A [`ToolTrail`] gives it poses of a faster clock than the app's.
///
/// Any number of tools may touch any number of clays at once: all of them, or those that [`TouchesOnly`] has.
/// What a tool feels is in [`ToolForce`], why it is left out, if it is, in [`ToolStatus`].
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
#[require(Transform, ToolForce, ToolStatus)]
pub struct SculptTool {
    /// Shape, with lengths in metres; the entity's uniform scale scales it.
    pub shape: ToolShape,
    /// What clay does at its surface.
    pub contact: Contact,
    /// Whether the tool touches clay. One that is taken away and put down elsewhere does not sweep from where
    /// it was.
    pub is_active: bool,
}

impl SculptTool {
    /// A tool of this shape, with [`Contact::default`].
    pub fn new(shape: ToolShape) -> Self {
        Self { shape, ..Self::default() }
    }

    /// A ball of this radius \[m\].
    pub fn ball(radius: f32) -> Self {
        Self::new(ToolShape::Sphere { radius: radius.into() })
    }

    /// A rectangular blade of this width and height \[m\], in the plane of its entity's x and y axes.
    pub fn blade(width: f32, height: f32) -> Self {
        let [half_width, half_height] = [width, height].map(|length| f64::from(length) / 2.0);
        Self { contact: Contact::Slip, ..Self::new(ToolShape::Blade { half_width, half_height }) }
    }
}

impl Default for SculptTool {
    /// A ball of 8 mm radius.
    fn default() -> Self {
        Self { shape: ToolShape::Sphere { radius: 0.008 }, contact: Contact::default(), is_active: true }
    }
}

/// The clays that a [`SculptTool`] touches, where it does not touch all of them.
#[derive(Component, Clone, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
pub struct TouchesOnly(#[entities] pub Vec<Entity>);

/// What the clays do to a [`SculptTool`], in the frame of the world: written in
/// [`ClaySystems::Report`](super::schedule::ClaySystems::Report), nothing while it touches none.
///
/// It is the mean of the last frame that has ended, which is two frames of the app ago or more: right for a
/// picture or a controller's vibration, too late for a haptic arm.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
pub struct ToolForce {
    /// Force of all clays on the tool \[N\].
    pub force: Vec3,
    /// Their torque on it about its entity's origin \[N m\].
    pub torque: Vec3,
    /// Contacts of the tool with grid nodes, summed over the frame's substeps, and particles that took a side
    /// of a blade: nothing while it touches no clay.
    pub contacts: u64,
    /// The clay that presses hardest; none where none does.
    pub clay: Option<Entity>,
}

/// Why a [`SculptTool`] is left out, while all else goes on. Written by the plugin when it changes.
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
pub struct ToolStatus {
    /// A transform or a shape that no tool can have.
    pub error: Option<ParamsError>,
}

/// Poses of a [`SculptTool`] in the world by a clock that is faster than the app's: of a haptic arm at 1 kHz,
/// of a headset. Whoever reads the device pushes them in
/// [`ClaySystems::Tool`](super::schedule::ClaySystems::Tool); the next step drains them, and the clay sees
/// all of the way.
///
/// The last of them is where the tool is now, until others come. Before the first one the entity's
/// [`Transform`] is; after it that is for drawing alone, except for its scale.
#[derive(Component, Clone, Debug, Default)]
pub struct ToolTrail {
    /// Time \[s\] and pose; the first is the last of those drained before.
    samples: Vec<(f64, Isometry3d)>,
}

impl ToolTrail {
    /// The tool is at `pose` in the world at `time` \[s\] of any clock that does not stop: only differences
    /// count. A pose that is older than the last one, or not finite, is left out.
    pub fn push(&mut self, time: f64, pose: Isometry3d) {
        let is_finite = time.is_finite() && pose.translation.is_finite() && pose.rotation.is_finite();
        if is_finite && self.samples.last().is_none_or(|(last, _)| *last < time) {
            self.samples.push((time, pose));
        }
    }

    /// Poses that the next step will take.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether the [`Transform`] counts: no pose was ever pushed.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// The poses that have come, as time before the last one \[s\] and pose in the world; the last one stays.
    pub(super) fn drain(&mut self) -> Vec<(f64, Pose)> {
        let Some(&(now, _)) = self.samples.last() else { return vec![] };
        let pose =
            |p: Isometry3d| Pose { position: Vec3::from(p.translation).as_dvec3(), rotation: p.rotation.as_dquat().normalize() };
        let drained = self.samples.iter().map(|(time, p)| (now - time, pose(*p))).collect();
        self.samples.drain(..self.samples.len() - 1);
        drained
    }
}

/// A tool that is held, in the world.
pub(super) struct HeldTool {
    pub(super) entity: Entity,
    pub(super) tool: Tool,
    pub(super) scale: f64,
    /// Time before now \[s\] and pose, the last one now.
    pub(super) way: Vec<(f64, Pose)>,
    pub(super) only: Option<TouchesOnly>,
}

impl HeldTool {
    /// Whether it touches that clay.
    pub(super) fn touches(&self, clay: Entity) -> bool {
        self.only.as_ref().is_none_or(|only| only.0.contains(&clay))
    }
}
