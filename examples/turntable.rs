//! Clay on a turntable: it turns below a tool that stands, and gravity still pulls down: `cargo demo
//! turntable`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, turn.in_set(ClaySystems::Tool))
        .run()
}

#[derive(Component)]
struct Table;

fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut colours: ResMut<Assets<StandardMaterial>>) {
    let wood = MeshMaterial3d(colours.add(Color::srgb(0.45, 0.35, 0.25)));
    let table = (Table, Mesh3d(meshes.add(Cylinder::new(0.05, 0.006))), wood.clone(), Transform::from_xyz(0.0, -0.003, 0.0));
    // A child of the table goes round with it: poses, forces and gravity are turned for it.
    commands.spawn(table).with_child((Clay::ball(0.022).with_cell_width(0.0028), Transform::from_xyz(0.0, 0.003, 0.0)));
    let rib = Vec3::new(0.003, 0.02, 0.008);
    let tool = SculptTool::new(ToolShape::Box { half_size: rib.as_dvec3() });
    commands.spawn((tool, Mesh3d(meshes.add(Cuboid::from_size(2.0 * rib))), wood));
}

/// The rib comes closer until it has turned a groove, and goes away again.
fn turn(
    time: Res<Time>,
    mut table: Single<&mut Transform, With<Table>>,
    mut rib: Single<&mut Transform, (With<SculptTool>, Without<Table>)>,
) {
    table.rotate_y(time.delta_secs());
    rib.translation = Vec3::new(0.026 - 0.005 * (0.5 * time.elapsed_secs()).sin(), 0.022, 0.0);
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
