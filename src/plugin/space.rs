//! Between the world and the clay's own frame.

use crate::sim::params::ParamsError;
use crate::sim::tool::Pose;
use bevy::prelude::*;
use glam::DVec3;

/// The frame of a piece of clay, as its entity's transform places it in the world: what particles, walls,
/// surfaces and reports are given in.
///
/// A uniform scale is a magnifying glass: lengths in the world are lengths of the clay times the scale, and
/// forces, torques and gravity, which belong to clay of its own size, are turned and not scaled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClaySpace {
    pub(super) pose: Pose,
    pub(super) scale: f64,
}

impl ClaySpace {
    /// The frame of the clay whose entity is at `transform`.
    ///
    /// # Errors
    /// A transform that is not finite, or whose scale is not uniform and positive.
    pub fn new(transform: &GlobalTransform) -> Result<Self, ParamsError> {
        Self::named("clay transform", transform)
    }

    /// As [`Self::new`], of an entity of kind `name`.
    pub(super) fn named(name: &'static str, transform: &GlobalTransform) -> Result<Self, ParamsError> {
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

    /// How much larger the clay is in the world than it is by itself.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// A point of the world in the clay's frame \[m\].
    pub fn point_to_clay(&self, point: Vec3) -> DVec3 {
        self.pose.to_local(point.as_dvec3()) / self.scale
    }

    /// A point of the clay's frame \[m\] in the world.
    pub fn point_to_world(&self, point: DVec3) -> Vec3 {
        (self.pose.rotation * (self.scale * point) + self.pose.position).as_vec3()
    }

    /// A force, torque, acceleration or direction of the world in the clay's frame: turned, not scaled.
    pub fn vector_to_clay(&self, vector: DVec3) -> DVec3 {
        self.pose.rotation.inverse() * vector
    }

    /// A force, torque, acceleration or direction of the clay's frame in the world: turned, not scaled.
    pub fn vector_to_world(&self, vector: DVec3) -> DVec3 {
        self.pose.rotation * vector
    }

    /// A pose of the world in the clay's frame.
    pub fn pose_to_clay(&self, pose: Pose) -> Pose {
        Pose {
            position: self.pose.to_local(pose.position) / self.scale,
            rotation: (self.pose.rotation.inverse() * pose.rotation).normalize(),
        }
    }

    /// A pose of the clay's frame in the world.
    pub fn pose_to_world(&self, pose: Pose) -> Pose {
        Pose {
            position: self.pose.rotation * (self.scale * pose.position) + self.pose.position,
            rotation: (self.pose.rotation * pose.rotation).normalize(),
        }
    }

    /// A ray of the world in the clay's frame, for [`ClaySurface::cast`](super::show::ClaySurface::cast).
    pub fn ray_to_clay(&self, ray: Ray3d) -> Ray3d {
        let direction = self.vector_to_clay(ray.direction.as_dvec3()).as_vec3();
        // A turned direction is one.
        let direction = Dir3::new(direction).unwrap_or(ray.direction);
        Ray3d { origin: self.point_to_clay(ray.origin).as_vec3(), direction }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// There and back again, and by the transform's own reckoning.
    #[test]
    fn world_and_clay_agree_with_the_transform() {
        let transform = Transform::from_xyz(0.3, -0.2, 0.1)
            .with_rotation(Quat::from_euler(EulerRot::XYZ, 0.4, 1.2, -0.7))
            .with_scale(Vec3::splat(2.5));
        let space = ClaySpace::new(&GlobalTransform::from(transform)).expect("a frame");
        let point = Vec3::new(0.02, 0.05, -0.01);
        assert!((space.point_to_world(point.as_dvec3()) - transform.transform_point(point)).length() < 1e-6);
        assert!((space.point_to_clay(transform.transform_point(point)) - point.as_dvec3()).length() < 1e-7);
        let turned = space.vector_to_world(DVec3::X);
        assert!((turned.as_vec3() - transform.rotation * Vec3::X).length() < 1e-6);
        assert!((space.vector_to_clay(turned) - DVec3::X).length() < 1e-12);
        let pose = Pose { position: point.as_dvec3(), rotation: glam::DQuat::from_rotation_z(0.3) };
        let back = space.pose_to_clay(space.pose_to_world(pose));
        assert!((back.position - pose.position).length() < 1e-12 && back.rotation.angle_between(pose.rotation) < 1e-7);
        let ray = Ray3d::new(transform.transform_point(point), Dir3::Y);
        let seen = space.ray_to_clay(ray);
        assert!((transform.transform_point(seen.get_point(0.1)) - ray.get_point(0.25)).length() < 1e-6);
    }

    /// What no frame can be made of is named.
    #[test]
    fn senseless_transforms_are_refused() {
        let refused = |transform: Transform| ClaySpace::new(&transform.into()).expect_err("a refusal").to_string();
        assert!(refused(Transform::from_scale(Vec3::new(1.0, 2.0, 1.0))).contains("uniform"));
        assert!(refused(Transform::from_scale(Vec3::splat(-1.0))).contains("positive"));
        assert!(refused(Transform::from_xyz(f32::NAN, 0.0, 0.0)).contains("finite"));
    }
}
