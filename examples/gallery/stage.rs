//! A small studio: what stands in it is lit, throws shadows, and is seen by one camera or two.

use crate::studio;
use bevy::camera::{RenderTarget, Viewport};
use bevy::light::CascadeShadowConfigBuilder;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy_clay::prelude::*;
use bevy_clay::surface::mesh::Mesh as Surface;
use std::path::{Path, PathBuf};

/// Size of the part of a picture that a camera fills \[pixels\].
const VIEW: UVec2 = UVec2::new(900, 720);
/// Frames for which a surface stays the same before its picture is taken: its mesh has found room, shadows
/// are drawn.
const FRAMES_SAME: u32 = 8;
/// Frames after which a surface that has not come will not come.
const FRAMES_MAX: u32 = 2000;

/// What is seen.
pub(crate) enum Subject {
    /// Clay, shown by the plugin.
    Clay(Box<Snapshot>),
    /// A surface made elsewhere.
    Mesh(Surface),
}

/// A picture to be taken.
pub(crate) struct Shot {
    /// Name of the file, without its ending.
    pub(crate) name: &'static str,
    pub(crate) subject: Subject,
    /// Ways from the subject to the cameras.
    pub(crate) views: &'static [Vec3],
    /// Low and high corner of what is to be seen \[m\], if not the subject's.
    pub(crate) room: Option<(Vec3, Vec3)>,
}

impl Subject {
    /// Low and high corner \[m\].
    fn bounds(&self) -> (Vec3, Vec3) {
        let (low, high) = match self {
            Self::Clay(clay) => {
                let places = clay.particles.iter().map(|p| clay.domain.to_world(p.grid()));
                places.map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default()
            }
            Self::Mesh(surface) => surface.bounds().unwrap_or_default(),
        };
        (low.as_vec3(), high.as_vec3())
    }
}

/// Takes every picture into `folder`; says which files it wrote.
///
/// # Errors
/// No graphics adapter; a surface that does not come; a picture that could not be written.
pub(crate) fn draw(shots: Vec<Shot>, folder: &Path) -> Result<Vec<PathBuf>, String> {
    let files: Vec<PathBuf> = shots.iter().map(|shot| folder.join(format!("{}.png", shot.name))).collect();
    let show = Show { shots, files: files.clone(), index: 0, frame: 0, same: (0, 0), is_taken: false };
    studio::take(files, |app| {
        app.add_plugins(ClayPlugins)
            .insert_resource(show)
            .add_systems(Startup, light)
            .add_systems(Update, step.after(ClaySystems::Show));
    })
}

/// The pictures, and which of them is being taken.
#[derive(Resource)]
struct Show {
    shots: Vec<Shot>,
    files: Vec<PathBuf>,
    index: usize,
    /// Frames since the subject was put up.
    frame: u32,
    /// Triangles shown, and for how many frames as many.
    same: (usize, u32),
    /// Whether the picture is on its way.
    is_taken: bool,
}

/// What goes with its picture.
#[derive(Component)]
struct Passing;

fn light(mut commands: Commands) {
    let sun = DirectionalLight { shadow_maps_enabled: true, shadow_depth_bias: 5e-4, illuminance: 7_000.0, ..default() };
    let cascades = CascadeShadowConfigBuilder { num_cascades: 1, minimum_distance: 0.01, maximum_distance: 0.6, ..default() };
    commands.spawn((sun, cascades.build(), Transform::from_xyz(0.3, 1.2, 0.9).looking_at(Vec3::ZERO, Vec3::Y)));
}

/// Where meshes, images and materials are kept.
type Store<'w> = (
    ResMut<'w, Assets<Mesh>>,
    ResMut<'w, Assets<Image>>,
    ResMut<'w, Assets<StandardMaterial>>,
    ResMut<'w, Assets<ClayLookMaterial>>,
);

/// Puts a subject up, waits until it is seen, takes its picture, and goes on to the next.
fn step(
    mut commands: Commands,
    mut show: ResMut<Show>,
    passing: Query<Entity, With<Passing>>,
    cameras: Query<&RenderTarget, With<Camera>>,
    clay: Query<(&ClayMetrics, Has<Mesh3d>)>,
    mut store: Store,
    mut exit: MessageWriter<AppExit>,
) {
    let Some(shot) = show.shots.get(show.index) else {
        exit.write(AppExit::Success);
        return;
    };
    if show.frame == 0 {
        passing.iter().for_each(|entity| commands.entity(entity).despawn());
        put_up(shot, &mut commands, &mut store);
    }
    let shown = match (&shot.subject, clay.iter().next()) {
        (Subject::Mesh(surface), _) => surface.triangles.len(),
        (Subject::Clay(_), Some((metrics, true))) => metrics.triangle_count,
        _ => 0,
    };
    show.frame += 1;
    show.same = (shown, if shown == show.same.0 && shown > 0 { show.same.1 + 1 } else { 0 });
    if show.frame > FRAMES_MAX {
        error!("{}: no surface after {FRAMES_MAX} frames", show.shots[show.index].name);
        exit.write(AppExit::error());
    } else if show.same.1 >= FRAMES_SAME
        && !show.is_taken
        && let Some(target) = cameras.iter().next().and_then(RenderTarget::as_image)
    {
        let file = show.files[show.index].clone();
        commands.spawn(Screenshot::image(target.clone())).observe(save_to_disk(file)).observe(
            |_: On<ScreenshotCaptured>, mut show: ResMut<Show>| {
                (show.index, show.frame, show.same, show.is_taken) = (show.index + 1, 0, (0, 0), false);
            },
        );
        show.is_taken = true;
    }
}

/// The subject, the floor that it stands on, and the cameras, each with its part of one image.
fn put_up(shot: &Shot, commands: &mut Commands, (meshes, images, materials, looks): &mut Store) {
    let (low, high) = shot.room.unwrap_or_else(|| shot.subject.bounds());
    let (centre, radius) = ((low + high) / 2.0, ((high - low).length() / 2.0).max(1e-3));
    let mut place = commands.spawn((Passing, Visibility::default()));
    match &shot.subject {
        Subject::Clay(snapshot) => {
            let settings = ClaySettings { engine: EngineChoice::Native, surface: SurfaceBackend::Gpu, ..default() };
            place.insert((Clay::snapshot((**snapshot).clone()), settings, ClayClock { paused: true, ..default() }));
        }
        Subject::Mesh(surface) => {
            place.insert(Mesh3d(meshes.add(studio::mesh(surface))));
        }
    }
    // In one tone: the second is constant on a triangle, and would draw the triangles of hollows as teeth.
    let look = ClayLookMaterial { base: ClayLook::base(), extension: ClayLook { tone: 0.0, ..default() } };
    place.insert(MeshMaterial3d(looks.add(look)));
    let floor = meshes.add(Plane3d::default().mesh().size(40.0 * radius, 40.0 * radius));
    let grey = materials.add(Color::srgb(0.55, 0.57, 0.6));
    commands.spawn((Passing, Mesh3d(floor), MeshMaterial3d(grey), Transform::from_xyz(centre.x, low.y, centre.z)));
    let size = UVec2::new(VIEW.x * shot.views.len() as u32, VIEW.y);
    let image = images.add(Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None));
    for (index, way) in (0u32..).zip(shot.views) {
        let eye = centre + way.normalize() * radius * 3.1;
        let lens = PerspectiveProjection { near: 0.05 * radius, far: 100.0 * radius, ..default() };
        let viewport = Viewport { physical_position: UVec2::new(VIEW.x * index, 0), physical_size: VIEW, ..default() };
        // The first clears the whole image.
        let clear_color = if index == 0 { ClearColorConfig::Default } else { ClearColorConfig::None };
        commands.spawn((
            Passing,
            Camera3d::default(),
            Camera { order: index as isize, viewport: Some(viewport), clear_color, ..default() },
            RenderTarget::Image(image.clone().into()),
            Projection::Perspective(lens),
            Transform::from_translation(eye).looking_at(centre, Vec3::Y),
            AmbientLight { brightness: 300.0, ..default() },
        ));
    }
}
