//! Where the work is before the head.

use super::grab::WorkRoot;
use super::hand::{Side, XrControllers};
use bevy::prelude::*;
use bevy_mod_openxr::helper_traits::ToVec3;
use bevy_mod_openxr::resources::OxrViews;
use bevy_mod_xr::camera::XrCamera;
use bevy_mod_xr::session::XrTrackingRoot;

/// Brings the work in front of the head, upright and at its scale. Both sticks pressed ask for it too.
#[derive(Event, Clone, Copy, Debug, Default)]
pub struct RecentreWork;

/// Where that is.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Resource)]
pub struct WorkPlace {
    /// Before the eyes \[m\], level: an arm that rests, and far enough for eyes at ease.
    pub distance: f32,
    /// Below them \[m\].
    pub drop: f32,
    /// Whether the work comes there when a session begins.
    pub at_start: bool,
}

impl Default for WorkPlace {
    fn default() -> Self {
        Self { distance: 0.5, drop: 0.35, at_start: true }
    }
}

impl WorkPlace {
    /// Place and rotation of the work of a head at `eyes`, which looks along `look`: its own z comes to the
    /// viewer.
    fn before(&self, eyes: Vec3, look: Vec3) -> (Vec3, Quat) {
        // A head that looks straight down has its work before it as it has its feet.
        let ahead = look.with_y(0.0).normalize_or(Vec3::NEG_Z);
        (eyes + ahead * self.distance - Vec3::Y * self.drop, Quat::from_rotation_arc(Vec3::NEG_Z, ahead))
    }
}

/// Whether the work still has to come: a head that has not been seen has no front.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub(super) struct Awaited(bool);

/// A session began.
pub(super) fn begin(place: Res<WorkPlace>, mut awaited: ResMut<Awaited>) {
    awaited.0 |= place.at_start;
}

/// Somebody asks.
pub(super) fn ask(_: On<RecentreWork>, mut awaited: ResMut<Awaited>) {
    awaited.0 = true;
}

/// Both sticks ask.
pub(super) fn press(controllers: Res<XrControllers>, mut was_pressed: Local<bool>, mut commands: Commands) {
    let is_pressed = Side::ALL.into_iter().all(|side| controllers.get(side).stick_click);
    if is_pressed && !std::mem::replace(&mut *was_pressed, is_pressed) {
        commands.trigger(RecentreWork);
    }
    *was_pressed = is_pressed;
}

/// Brings the work there, once the head is seen.
pub(super) fn recentre(
    (place, views): (Res<WorkPlace>, Option<Res<OxrViews>>),
    mut awaited: ResMut<Awaited>,
    root: Query<&GlobalTransform, With<XrTrackingRoot>>,
    cameras: Query<(), With<XrCamera>>,
    mut works: Query<&mut Transform, With<WorkRoot>>,
) {
    let Some(views) = views.filter(|views| awaited.0 && !views.is_empty() && !cameras.is_empty()) else { return };
    awaited.0 = false;
    let eyes = views.iter().map(|view| view.pose.position.to_vec3()).sum::<Vec3>() / views.len() as f32;
    let turned = views.iter().next().map_or(Quat::IDENTITY, |view| {
        use bevy_mod_openxr::helper_traits::ToQuat;
        view.pose.orientation.to_quat()
    });
    let root = root.iter().next().map_or(Isometry3d::IDENTITY, GlobalTransform::to_isometry);
    let (translation, rotation) = place.before(root * eyes, root.rotation * turned * Vec3::NEG_Z);
    for mut work in &mut works {
        work.translation = translation;
        work.rotation = rotation;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Level, at arm's length, its front to the viewer, wherever the head looks.
    #[test]
    fn work_comes_before_the_eyes() {
        let place = WorkPlace::default();
        let eyes = Vec3::new(0.3, 1.2, 2.0);
        for look in [Vec3::NEG_Z, Vec3::X, Vec3::new(0.5, -0.8, 0.3), Vec3::Z, Vec3::NEG_Y] {
            let (at, rotation) = place.before(eyes, look);
            assert!(((at - eyes).with_y(0.0).length() - place.distance).abs() < 1e-6);
            assert!((eyes.y - at.y - place.drop).abs() < 1e-6);
            assert!((rotation * Vec3::Y).distance(Vec3::Y) < 1e-5, "{look}");
            let to_viewer = (eyes - at).with_y(0.0).normalize();
            assert!((rotation * Vec3::Z).distance(to_viewer) < 1e-5, "{look}");
        }
    }
}
