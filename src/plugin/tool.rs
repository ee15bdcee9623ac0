//! Tools of an app: entities whose ways are swept through the clay, never jumped.

use crate::sim::params::ParamsError;
use crate::sim::tool::{Contact, Pose, Tool, ToolShape};
use bevy::prelude::*;

/// A tool that acts on every clay of the app. Its pose is the entity's [`Transform`], below those of its
/// parents; its way from frame to frame is swept.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default)]
#[require(Transform)]
pub struct SculptTool {
    /// Names the tool in reports. No two active tools may have the same.
    pub id: u32,
    /// Shape and contact; the entity's uniform scale scales the shape.
    pub tool: Tool,
    /// Whether the tool touches clay. One that is taken away and put down elsewhere does not sweep from where
    /// it was.
    pub is_active: bool,
}

impl Default for SculptTool {
    /// A ball of 8 mm radius.
    fn default() -> Self {
        let tool = Tool { shape: ToolShape::Sphere { radius: 0.008 }, contact: Contact::default() };
        Self { id: 1, tool, is_active: true }
    }
}

/// Where something of uniform scale is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    pub(super) pose: Pose,
    pub(super) scale: f64,
}

impl Placement {
    /// The place of an entity of kind `name`.
    ///
    /// # Errors
    /// A transform that is not finite, or whose scale is not uniform and positive.
    pub(super) fn new(name: &'static str, transform: &GlobalTransform) -> Result<Self, ParamsError> {
        const UNIFORM_WITHIN: f32 = 1e-3;
        let (scale, rotation, position) = transform.to_scale_rotation_translation();
        if !transform.affine().is_finite() {
            return Err(ParamsError::new(name, position, "must be finite"));
        }
        let is_uniform = (scale - Vec3::splat(scale.x)).abs().max_element() <= UNIFORM_WITHIN * scale.x.abs();
        if scale.x <= 0.0 || !is_uniform {
            return Err(ParamsError::new(name, scale, "must have a uniform, positive scale"));
        }
        let pose = Pose { position: position.as_dvec3(), rotation: rotation.as_dquat().normalize() };
        Ok(Self { pose, scale: f64::from(scale.x) })
    }

    /// `other`, given beside this one, as seen from it.
    pub(super) fn seen(&self, other: &Self) -> Self {
        let pose = Pose {
            position: self.pose.to_local(other.pose.position) / self.scale,
            rotation: (self.pose.rotation.inverse() * other.pose.rotation).normalize(),
        };
        Self { pose, scale: other.scale / self.scale }
    }
}
