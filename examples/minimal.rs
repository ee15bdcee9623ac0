//! A block of clay in a window, pressed by a ball: `cargo demo minimal`. With `-- --frames N` it
//! ends after N frames, or more if there is no dent yet; without one after a second of clay it ends badly.
#![expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]

use bevy::light::CascadeShadowConfigBuilder;
use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    let systems = (press.in_set(ClaySystems::Tool), (draw, check).after(ClaySystems::Show));
    App::new().add_plugins((DefaultPlugins, ClayPlugins)).add_systems(Startup, spawn).add_systems(Update, systems).run()
}

/// The ball that is drawn.
#[derive(Component)]
struct Ball;

fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut colours: ResMut<Assets<StandardMaterial>>) -> Result {
    let scene = ClayScene::from_ron("(clay: [Box(size: (0.06, 0.03, 0.06), center: (0, 0.015, 0))], cell_width: 0.004)")?;
    commands.spawn(Clay::new(scene.build(std::path::Path::new("."))?.snapshot));
    let ball = (Mesh3d(meshes.add(Sphere::new(0.008))), MeshMaterial3d(colours.add(Color::srgb(0.3, 0.4, 0.6))));
    commands.spawn(SculptTool::default());
    commands.spawn((Ball, ball));
    let floor = Plane3d::default().mesh().size(0.4, 0.4);
    commands.spawn((Mesh3d(meshes.add(floor)), MeshMaterial3d(colours.add(Color::srgb(0.5, 0.5, 0.5)))));
    // Shadows as sharp as the clay is small.
    let sun = DirectionalLight { shadow_maps_enabled: true, shadow_depth_bias: 1e-3, illuminance: 6_000.0, ..default() };
    let cascades = CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 0.5, ..default() }.build();
    commands.spawn((sun, cascades, Transform::from_xyz(-0.8, 1.2, 0.5).looking_at(Vec3::ZERO, Vec3::Y)));
    let camera = Transform::from_xyz(0.07, 0.11, 0.11).looking_at(Vec3::Y * 0.015, Vec3::Y);
    commands.spawn((Camera3d::default(), camera));
    Ok(())
}

/// From the clay's top down into it, round in a circle, and up again, every 4 seconds.
fn press(time: Res<Time>, mut ball: Single<&mut Transform, With<SculptTool>>) {
    let angle = 1.5 + time.elapsed_secs() * std::f32::consts::TAU / 4.0;
    ball.translation = Vec3::new(0.014 * angle.sin(), 0.037 + 0.008 * angle.cos(), 0.014 * angle.cos());
}

/// Draws the ball where the clay has it: in slow motion that is behind the hand.
fn draw(hand: Single<Entity, With<SculptTool>>, clay: Option<Single<&ClayEngine>>, mut ball: Single<&mut Transform, With<Ball>>) {
    if let Some(pose) = clay.and_then(|clay| clay.tool_pose(*hand)) {
        ball.translation = pose.position.as_vec3();
    }
}

/// After as many frames as asked for: is there a dent 1 mm deep in the top of the clay?
fn check(mut frame: Local<u32>, clay: Single<(&ClayStatus, Option<&ClaySurface>)>, mut exit: MessageWriter<AppExit>) {
    *frame += 1;
    if std::env::args().skip_while(|a| a != "--frames").nth(1).and_then(|n| n.parse().ok()).is_some_and(|n: u32| *frame >= n) {
        let (status, surface) = *clay;
        // Straight down, every 2 mm of the way round.
        let place = |i: i32| Vec3::new((i % 19 - 9) as f32, 50.0, (i / 19 - 9) as f32) * 0.002;
        let height = |surface: &ClaySurface, i| surface.cast(Ray3d::new(place(i), Dir3::NEG_Y)).map(|hit| hit.point.y);
        if surface.is_some_and(|surface| (0..361).any(|i| height(surface, i).is_some_and(|y| y < 0.029))) {
            exit.write(AppExit::Success);
        } else if status.time > 1.0 {
            exit.write(AppExit::error());
        }
    }
}
