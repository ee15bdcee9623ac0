//! Pictures of a run, drawn after it without a window: the clay with its tools, lit, with shadows.

#[path = "../studio/mod.rs"]
mod studio;

use crate::{interrupt, places};
use bevy::asset::RenderAssetUsages;
use bevy::camera::RenderTarget;
use bevy::light::CascadeShadowConfigBuilder;
use bevy::mesh::PrimitiveTopology;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy_clay::plugin::LookPlugin;
use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::mesh::Mesh as Surface;
use std::path::{Path, PathBuf};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 720;
/// Frames before a picture is taken: meshes are uploaded, shadows drawn.
const FRAMES_BEFORE: u32 = 3;

/// Whether this build draws.
pub(crate) const ARE_DRAWN: bool = true;

/// What a picture shows.
pub(crate) struct Moment {
    /// The frame, by which the file is named.
    pub(crate) frame: u64,
    /// The clay.
    pub(crate) surface: Surface,
    /// The tools and where they are.
    pub(crate) tools: Vec<(ToolShape, Pose)>,
}

/// Draws each moment into `folder` as `frame_NNNN.png`; says which files it wrote. Where it `may_stop`, an
/// interrupt ends it after the picture under way.
///
/// # Errors
/// No graphics adapter, or a picture that could not be written.
pub(crate) fn draw(moments: Vec<Moment>, folder: &Path, may_stop: bool) -> Result<Vec<PathBuf>, String> {
    if moments.is_empty() {
        return Ok(vec![]);
    }
    let files: Vec<PathBuf> = moments.iter().map(|m| places::picture(folder, m.frame)).collect();
    let show = Show { moments, files: files.clone(), index: 0, frame: 0, is_taken: false, may_stop };
    studio::take(files, |app| {
        app.add_plugins(LookPlugin).insert_resource(show).add_systems(Startup, spawn).add_systems(Update, (stop, step).chain());
    })
}

/// The moments, and which of them is drawn.
#[derive(Resource)]
struct Show {
    moments: Vec<Moment>,
    files: Vec<PathBuf>,
    index: usize,
    /// Frames since the moment was put up.
    frame: u32,
    /// Whether its picture is on its way.
    is_taken: bool,
    /// Whether an interrupt ends it.
    may_stop: bool,
}

/// Where pictures come from.
#[derive(Resource)]
struct Canvas(Handle<Image>);

/// What goes with its moment.
#[derive(Component)]
struct Passing;

fn spawn(
    mut commands: Commands,
    show: Res<Show>,
    mut images: ResMut<Assets<Image>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut colours: ResMut<Assets<StandardMaterial>>,
) {
    let bounds = show.moments.iter().filter_map(|m| m.surface.bounds());
    let (low, high) = bounds.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default();
    let (centre, radius) = (((low + high) / 2.0).as_vec3(), ((high - low).length() / 2.0).max(1e-3) as f32);
    let image = images.add(Image::new_target_texture(WIDTH, HEIGHT, TextureFormat::Rgba8UnormSrgb, None));
    commands.insert_resource(Canvas(image.clone()));
    let eye = centre + Vec3::new(-0.7, 0.65, 0.75).normalize() * radius * 3.2;
    let lens = PerspectiveProjection { near: 0.05 * radius, far: 100.0 * radius, ..default() };
    commands.spawn((
        Camera3d::default(),
        RenderTarget::Image(image.into()),
        Projection::Perspective(lens),
        Transform::from_translation(eye).looking_at(centre, Vec3::Y),
        AmbientLight { brightness: 300.0, ..default() },
    ));
    let cascades = CascadeShadowConfigBuilder {
        num_cascades: 1,
        minimum_distance: 0.05 * radius,
        maximum_distance: 8.0 * radius,
        ..default()
    };
    commands.spawn((
        DirectionalLight { shadow_maps_enabled: true, shadow_depth_bias: 0.01 * radius, illuminance: 7_000.0, ..default() },
        cascades.build(),
        Transform::from_xyz(-0.6, 1.2, 0.5).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    let floor = Plane3d::default().mesh().size(40.0 * radius, 40.0 * radius);
    let at = Transform::from_xyz(centre.x, low.y as f32, centre.z);
    commands.spawn((Mesh3d(meshes.add(floor)), MeshMaterial3d(colours.add(Color::srgb(0.55, 0.57, 0.6))), at));
}

/// Ends it between two pictures if an interrupt asks for it.
fn stop(show: Res<Show>, mut exit: MessageWriter<AppExit>) {
    if show.may_stop && show.frame == 0 && interrupt::is_requested() {
        exit.write(studio::STOPPED);
    }
}

/// Puts a moment up, takes its picture, and goes on to the next.
fn step(
    mut commands: Commands,
    mut show: ResMut<Show>,
    canvas: Res<Canvas>,
    passing: Query<Entity, With<Passing>>,
    mut meshes: ResMut<Assets<Mesh>>,
    (mut colours, mut looks): (ResMut<Assets<StandardMaterial>>, ResMut<Assets<ClayLookMaterial>>),
    mut exit: MessageWriter<AppExit>,
) {
    let Some(moment) = show.moments.get(show.index) else {
        exit.write(AppExit::Success);
        return;
    };
    if show.frame == 0 {
        passing.iter().for_each(|entity| commands.entity(entity).despawn());
        let clay = looks.add(ClayLook::material());
        commands.spawn((Passing, Mesh3d(meshes.add(studio::mesh(&moment.surface))), MeshMaterial3d(clay)));
        let steel = StandardMaterial { base_color: Color::srgb(0.35, 0.45, 0.6), perceptual_roughness: 0.4, ..default() };
        let steel = colours.add(StandardMaterial { cull_mode: None, double_sided: true, ..steel });
        for (shape, pose) in &moment.tools {
            let Some(mesh) = tool(shape) else {
                warn!("no picture of a {shape:?}");
                continue;
            };
            let place = Transform::from_translation(pose.position.as_vec3()).with_rotation(pose.rotation.as_quat());
            commands.spawn((Passing, Mesh3d(meshes.add(mesh)), MeshMaterial3d(steel.clone()), place));
        }
    } else if show.frame >= FRAMES_BEFORE && !show.is_taken {
        let file = show.files[show.index].clone();
        commands.spawn(Screenshot::image(canvas.0.clone())).observe(save_to_disk(file)).observe(
            |_: On<ScreenshotCaptured>, mut show: ResMut<Show>| {
                (show.index, show.frame, show.is_taken) = (show.index + 1, 0, false);
            },
        );
        show.is_taken = true;
    }
    show.frame += 1;
}

/// The mesh of a tool, for the shapes that this program knows.
fn tool(shape: &ToolShape) -> Option<Mesh> {
    Some(match *shape {
        ToolShape::Sphere { radius } => {
            Sphere::new(radius as f32).mesh().ico(5).unwrap_or_else(|_| Sphere::new(radius as f32).into())
        }
        ToolShape::Capsule { radius, half_length } => Capsule3d::new(radius as f32, 2.0 * half_length as f32).into(),
        ToolShape::Box { half_size } => Cuboid { half_size: half_size.as_vec3() }.into(),
        ToolShape::Blade { half_width, half_height } => Rectangle::new(2.0 * half_width as f32, 2.0 * half_height as f32).into(),
        ToolShape::PointedBlade { half_width, half_height } => {
            let (w, h) = (half_width as f32, half_height as f32);
            Triangle2d::new(Vec2::new(0.0, -h), Vec2::new(w, h), Vec2::new(-w, h)).into()
        }
        ToolShape::BentBlade { profile, half_height } => strip(&profile, half_height),
        ToolShape::Wire { half_length } => Mesh::from(Cylinder::new(WIRE_RADIUS, 2.0 * half_length as f32))
            .rotated_by(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2)),
        // Bevy's cone stands on its flat end.
        ToolShape::Cone { radius, half_height } => Mesh::from(Cone { radius: radius as f32, height: 2.0 * half_height as f32 })
            .rotated_by(Quat::from_rotation_x(std::f32::consts::PI)),
        _ => return None,
    })
}

/// Radius at which a wire, which has none, is drawn \[m\].
const WIRE_RADIUS: f32 = 0.0003;

/// A strip bent along a profile.
fn strip(profile: &Profile, half_height: f64) -> Mesh {
    let mut positions = vec![];
    for pair in profile.points().windows(2) {
        let corner = |i: usize, y: f64| [pair[i].x as f32, y as f32, pair[i].y as f32];
        let [a, b] = [0, 1].map(|i| (corner(i, -half_height), corner(i, half_height)));
        positions.extend([a.0, b.0, b.1, a.0, b.1, a.1]);
    }
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_computed_flat_normals()
}
