//! Between the clay's frame, in which it is touched, and the world, in which a hand feels it.

use crate::haptics::model::{ContactModel, NearParticle};
use crate::haptics::servo::ServoSample;
use crate::plugin::space::ClaySpace;
use crate::sim::tool::Pose;
use glam::{DMat3, Vec3};

/// Where a sample has the clay's tool, in the world.
pub(super) fn pose_of(sample: &ServoSample) -> Pose {
    Pose { position: sample.tool, rotation: sample.rotation.normalize() }
}

/// A model of the clay's frame in the world: lengths times the scale, forces as they are, stiffness and
/// slopes over the scale.
pub(super) fn model_to_world(model: &ContactModel, space: &ClaySpace) -> ContactModel {
    let scale = space.scale();
    let Pose { position, rotation } = space.pose_to_world(Pose { position: model.position, rotation: model.rotation });
    let turn = DMat3::from_quat(space.pose.rotation);
    let mut near = model.near;
    for NearParticle { position, radius, .. } in near.iter_mut().take(model.near().len()) {
        *position = space.point_to_world(Vec3::from_array(*position).as_dvec3()).to_array();
        *radius *= scale as f32;
    }
    ContactModel {
        position,
        rotation,
        force: space.vector_to_world(model.force),
        normal: space.vector_to_world(model.normal),
        gap: model.gap * scale,
        stiffness: turn * model.stiffness * turn.transpose() * scale.recip(),
        yield_slope: model.yield_slope / scale,
        density_gradient: space.vector_to_world(model.density_gradient) / scale,
        blade: model.blade.map(|blade| blade.scaled(scale)),
        near,
        ..*model
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::prelude::{GlobalTransform, Quat, Transform};
    use glam::{DQuat, DVec3};

    /// Turned and scaled, a model says of a place in the world what it said of that place in the clay.
    #[test]
    fn model_says_the_same_of_the_same_place() {
        let transform = Transform::from_xyz(0.3, -0.2, 0.1)
            .with_rotation(Quat::from_euler(bevy::prelude::EulerRot::XYZ, 0.4, 1.2, -0.7))
            .with_scale(Vec3::splat(2.5));
        let space = ClaySpace::new(&GlobalTransform::from(transform)).expect("a frame");
        let stiffness =
            DMat3::from_cols(DVec3::new(300.0, 50.0, 0.0), DVec3::new(50.0, 900.0, -80.0), DVec3::new(0.0, -80.0, 400.0));
        let mut near = ContactModel::NONE.near;
        near[0] = NearParticle { id: 7, position: [0.01, 0.02, 0.03], radius: 1e-3 };
        let clay = ContactModel {
            position: DVec3::new(0.01, 0.03, -0.02),
            rotation: DQuat::from_rotation_x(0.2),
            force: DVec3::new(0.1, 0.7, -0.2),
            normal: DVec3::Y,
            gap: 2e-3,
            stiffness,
            yield_force: 2.0,
            yield_slope: 40.0,
            density_gradient: DVec3::Y * 30.0,
            near_count: 1,
            near,
            ..ContactModel::NONE
        };
        let world = model_to_world(&clay, &space);
        let place = |p: DVec3| space.pose_to_world(Pose { position: p, ..Pose::default() }).position;
        let other = DVec3::new(0.012, 0.028, -0.019);
        let felt = |model: &ContactModel, at: DVec3| model.force - model.stiffness * (at - model.position);
        assert!((felt(&world, place(other)) - space.vector_to_world(felt(&clay, other))).length() < 1e-9);
        let touch = |model: &ContactModel| model.position - model.gap * model.normal;
        assert!((touch(&world) - place(touch(&clay))).length() < 1e-9);
        let limit =
            |model: &ContactModel, at: DVec3| model.yield_force - model.yield_slope * (at - model.position).dot(model.normal);
        assert!((limit(&world, place(other)) - limit(&clay, other)).abs() < 1e-9);
        let fill = |model: &ContactModel, at: DVec3| model.density_gradient.dot(at - model.position);
        assert!((fill(&world, place(other)) - fill(&clay, other)).abs() < 1e-9);
        let ball = world.near()[0];
        assert!((Vec3::from_array(ball.position).as_dvec3() - place(DVec3::new(0.01, 0.02, 0.03))).length() < 1e-6);
        assert!((ball.radius - 2.5e-3).abs() < 1e-8 && ball.id == 7);
    }
}
