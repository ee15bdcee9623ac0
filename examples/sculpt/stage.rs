//! A board and lights that suit things of a few centimetres.

use crate::looks::Looks;
use crate::start::Extent;
use bevy::light::CascadeShadowConfigBuilder;
use bevy::prelude::*;

/// What is behind everything.
const BACKGROUND: Color = Color::srgb(0.60, 0.64, 0.67);
const BOARD: Color = Color::srgb(0.46, 0.40, 0.33);

/// What the clay stands on.
#[derive(Component)]
pub(crate) struct Board;

/// Sets the stage.
pub(crate) struct StagePlugin;

impl Plugin for StagePlugin {
    fn build(&self, app: &mut App) {
        let ambient = GlobalAmbientLight { brightness: 260.0, color: Color::srgb(0.92, 0.95, 1.0), ..default() };
        app.insert_resource(ClearColor(BACKGROUND)).insert_resource(ambient).add_systems(Startup, (lay_board, light));
    }
}

fn lay_board(extent: Res<Extent>, mut meshes: ResMut<Assets<Mesh>>, mut looks: Looks, mut commands: Commands) {
    let Extent { middle, radius, floor } = *extent;
    // A board, not a whole table: each pixel costs a software renderer much.
    let (width, height) = (1.75 * radius, 0.14 * radius);
    // A hair below the clay's underside, which would flicker through it.
    let gap = 2e-3 * radius;
    let look = StandardMaterial { base_color: BOARD, perceptual_roughness: 0.9, reflectance: 0.2, ..default() };
    let mut board = commands.spawn((
        Board,
        Name::new("board"),
        Mesh3d(meshes.add(Cylinder::new(width, height).mesh().resolution(96).build())),
        Transform::from_xyz(middle.x, floor - gap - height / 2.0, middle.z),
    ));
    looks.put(&mut board, look);
}

fn light(extent: Res<Extent>, mut commands: Commands) {
    let radius = extent.radius;
    let key = DirectionalLight {
        illuminance: 9000.0,
        color: Color::srgb(1.0, 0.96, 0.90),
        shadow_maps_enabled: true,
        // Bevy's own bias is meant for rooms, not for a lump of clay.
        shadow_depth_bias: 0.06 * radius,
        ..default()
    };
    let shadows = CascadeShadowConfigBuilder {
        num_cascades: 1,
        minimum_distance: 0.1 * radius,
        maximum_distance: 7.0 * radius,
        ..default()
    };
    let from = |x, y, z| Transform::from_xyz(x, y, z).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((Name::new("key light"), key, shadows.build(), from(-1.5, 1.15, 0.35)));
    let fill = DirectionalLight { illuminance: 1500.0, color: Color::srgb(0.80, 0.88, 1.0), ..default() };
    commands.spawn((Name::new("fill light"), fill, from(1.6, 0.7, 0.4)));
}
