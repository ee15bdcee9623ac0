//! A blade goes through a block, which stays cut when it has left: `cargo demo knife`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, (cut.in_set(ClaySystems::Tool), part.after(ClaySystems::Report)))
        .run()
}

fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut colours: ResMut<Assets<StandardMaterial>>) {
    commands.spawn(Clay::block(Vec3::new(0.05, 0.025, 0.03)).with_cell_width(0.0025));
    // A blade is a rectangle without thickness, in the plane of its x and y axes.
    let (width, height) = (0.02, 0.05);
    let look = (Mesh3d(meshes.add(Cuboid::new(width, height, 0.0003))), MeshMaterial3d(colours.add(Color::srgb(0.7, 0.7, 0.75))));
    commands.spawn((SculptTool::blade(width, height), look));
}

/// Through the block, across its longest edge, and out on the other side.
fn cut(time: Res<Time>, knife: Single<(&mut Transform, &mut SculptTool)>) {
    let (mut place, mut knife) = knife.into_inner();
    let way = 0.035 - 0.02 * time.elapsed_secs();
    // The blade's own x axis points along its way.
    *place = Transform::from_xyz(0.002, 0.02, way).with_rotation(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2));
    knife.is_active = way > -0.035;
}

/// When the knife has left, the smaller piece is taken away.
fn part(knife: Single<&SculptTool>, clay: Single<Entity, With<Clay>>, mut is_done: Local<bool>, mut commands: Commands) {
    if !knife.is_active && !std::mem::replace(&mut *is_done, true) {
        commands.trigger(DropOffcuts { entity: *clay });
    }
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
