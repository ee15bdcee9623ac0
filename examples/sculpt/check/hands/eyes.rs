//! What the eyes see, as pictures; what a second eye costs, pass by pass; and that the clay costs the same.

use super::Step;
use super::act::clay;
use bevy::asset::RenderAssetUsages;
use bevy::camera::RenderTarget;
use bevy::diagnostic::{Diagnostic, DiagnosticsStore};
use bevy::prelude::*;
use bevy::render::diagnostic::RenderDiagnosticsPlugin;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages};
use bevy::render::renderer::RenderAdapterInfo;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};
use bevy_clay::prelude::*;
use bevy_clay::xr::panel::XrPanel;
use bevy_mod_xr::camera::XrCamera;
use bevy_mod_xr::session::{XrFirst, XrHandleEvents};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// Pixels of a picture of what an eye sees.
const PICTURE: UVec2 = UVec2::new(640, 480);
/// Pixels that Monado's null compositor has for an eye.
const EYE: UVec2 = UVec2::new(320, 240);
/// Frames over which a time is taken: what diagnostics keep of both eyes.
const FRAMES: usize = 60;

/// Takes the time of each frame and of its passes.
pub(super) struct EyesPlugin;

impl Plugin for EyesPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(RenderDiagnosticsPlugin)
            .init_resource::<Busy>()
            .init_resource::<Taken>()
            .init_resource::<IsShut>()
            .add_systems(XrFirst, end.before(XrHandleEvents::Poll))
            .add_systems(First, begin)
            .add_systems(Update, (count.after(ClaySystems::Show), shut));
    }
}

/// How long the app was at work in frames, without what it waited for the headset; and what the clay did in
/// them.
#[derive(Resource, Default)]
struct Busy {
    began: Option<Instant>,
    /// \[ms\]
    times: Vec<f64>,
    frames: u32,
    /// Frames of clay and surfaces, and the most of them in a frame of the headset.
    reports: [u32; 2],
    surfaces: [u32; 2],
}

/// What frames cost.
#[derive(Clone, Default)]
struct Cost {
    /// The median of a frame \[ms\].
    frame: f64,
    /// Each pass, of all cameras, in a frame \[ms\].
    passes: BTreeMap<String, f64>,
}

/// What was taken: of both eyes, of one, and again.
#[derive(Resource, Default)]
struct Taken(Vec<Cost>);

fn begin(mut busy: ResMut<Busy>) {
    busy.began = Some(Instant::now());
}

fn end(mut busy: ResMut<Busy>) {
    if let Some(began) = busy.began.take() {
        busy.times.push(began.elapsed().as_secs_f64() * 1e3);
    }
}

fn count(shown: Query<(), Changed<ClaySurface>>, mut reports: MessageReader<ClayReport>, mut busy: ResMut<Busy>) {
    busy.frames += 1;
    let now = [reports.read().count() as u32, shown.iter().count() as u32];
    let Busy { reports, surfaces, .. } = &mut *busy;
    for ([all, most], now) in [reports, surfaces].into_iter().zip(now) {
        *all += now;
        *most = now.max(*most);
    }
}

/// What the frames cost since [`anew`].
fn cost_of(world: &mut World) -> Cost {
    let mut times = world.resource::<Busy>().times.clone();
    times.sort_by(f64::total_cmp);
    let frame = times.get(times.len() / 2).copied().unwrap_or_default();
    let of_device = |diagnostic: &Diagnostic| {
        let name = diagnostic.path().as_str().strip_prefix("render/")?.strip_suffix("/elapsed_gpu")?;
        Some((name.to_string(), diagnostic.values().sum::<f64>() / times.len() as f64))
    };
    Cost { frame, passes: world.resource::<DiagnosticsStore>().iter().filter_map(of_device).collect() }
}

/// Begins to take times.
fn anew(world: &mut World) {
    world.resource_mut::<Busy>().times.clear();
    world.resource_mut::<DiagnosticsStore>().iter_mut().for_each(Diagnostic::clear_history);
}

/// A camera of the check's own.
#[derive(Component)]
struct Third;

/// A camera that sees what an eye sees, into a picture of `size`.
fn see(world: &mut World, eye: u32, size: UVec2) -> Option<(Entity, Handle<Image>)> {
    let mut eyes = world.query::<(&XrCamera, &GlobalTransform, &Projection)>();
    let (_, place, projection) = eyes.iter(world).find(|(camera, ..)| camera.0 == eye)?;
    let (place, projection) = (place.compute_transform(), projection.clone());
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba8UnormSrgb;
    let mut image = Image::new_fill(extent, TextureDimension::D2, &[0; 4], format, RenderAssetUsages::default());
    image.texture_descriptor.usage |= TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
    let image = world.resource_mut::<Assets<Image>>().add(image);
    let camera = Camera { order: -20 - eye as isize, ..default() };
    let camera =
        world.spawn((Third, Camera3d::default(), camera, RenderTarget::Image(image.clone().into()), projection, place)).id();
    Some((camera, image))
}

/// Pictures that are to be taken.
#[derive(Resource, Default)]
struct Wanted(Vec<(PathBuf, Handle<Image>)>);

/// Pictures into `folder`, named for what they show.
pub(super) fn pictures(folder: PathBuf, name: &'static str) -> Vec<Step> {
    let look = move |world: &mut World| {
        let mut pictures: Vec<_> = [(0, "left"), (1, "right")]
            .into_iter()
            .filter_map(|(eye, side)| {
                let (_, image) = see(world, eye, PICTURE)?;
                Some((folder.join(format!("{name}_{side}.png")), image))
            })
            .collect();
        let panel = world.get_resource::<XrPanel>().filter(|panel| panel.is_open).map(|panel| panel.context);
        if let Some(RenderTarget::Image(panel)) = panel.and_then(|context| world.get::<RenderTarget>(context)) {
            pictures.push((folder.join("panel.png"), panel.handle.clone()));
        }
        world.insert_resource(Wanted(pictures));
    };
    let take = |world: &mut World| {
        for (path, image) in world.resource::<Wanted>().0.clone() {
            world.commands().spawn(Screenshot::image(image)).observe(save_to_disk(path));
        }
    };
    let are_there = |world: &mut World| world.resource::<Wanted>().0.iter().all(|(path, _)| path.exists());
    vec![
        Step::new("cameras", 0.5, look),
        Step::new("pictures", 0.2, take).until(are_there),
        Step::new("without the cameras", 0.2, away),
    ]
}

fn away(world: &mut World) {
    let cameras: Vec<Entity> = world.query_filtered::<Entity, With<Third>>().iter(world).collect();
    cameras.into_iter().for_each(|camera| {
        world.despawn(camera);
    });
}

/// Whether the second eye is shut.
#[derive(Resource, Default)]
struct IsShut(bool);

/// In every frame: OpenXR's plugin opens both.
fn shut(is_shut: Res<IsShut>, mut eyes: Query<(&XrCamera, &mut Camera)>) {
    eyes.iter_mut().filter(|(eye, _)| is_shut.0 && eye.0 == 1).for_each(|(_, mut camera)| camera.is_active = false);
}

/// What the second eye costs, while the clay stands: its steps would have the same cores.
pub(super) fn cost() -> Vec<Step> {
    let pause = |paused: bool| {
        move |world: &mut World| {
            let clay = clay(world);
            world.get_mut::<ClayClock>(clay).expect("a clock").paused = paused;
        }
    };
    let is_enough = |world: &mut World| world.resource::<Busy>().times.len() >= FRAMES;
    let mut steps = vec![Step::new("the clay stands", 0.3, pause(true))];
    for both in [true, false, true, false] {
        steps.push(Step::new("as many eyes", 0.2, move |world| world.resource_mut::<IsShut>().0 = !both));
        steps.push(Step { end: Box::new(take), ..Step::new("frames", 0.0, anew).until(is_enough) });
    }
    steps.push(Step::check("frames", |world| compare(&world.resource::<Taken>().0)));
    steps.push(Step::check("adapter", |world| Ok(world.resource::<RenderAdapterInfo>().name.clone())));
    steps.push(Step::new("both eyes, and the clay goes on", 0.2, move |world| {
        world.resource_mut::<IsShut>().0 = false;
        pause(false)(world);
    }));
    steps
}

fn take(world: &mut World) -> Result<String, String> {
    let cost = cost_of(world);
    world.resource_mut::<Taken>().0.push(cost);
    Ok(String::new())
}

/// Both eyes against one.
fn compare(taken: &[Cost]) -> Result<String, String> {
    let mean = |first: usize, of: &dyn Fn(&Cost) -> f64| (of(&taken[first]) + of(&taken[first + 2])) / 2.0;
    let pass = |name: &str, first: usize| mean(first, &|cost| cost.passes.get(name).copied().unwrap_or_default());
    let frames = taken.iter().map(|cost| format!("{:.1}", cost.frame)).collect::<Vec<_>>().join(", ");
    let passes: Vec<String> =
        taken[0].passes.keys().map(|name| format!("{name} {:.2} and {:.2}", pass(name, 0), pass(name, 1))).collect();
    let said = format!(
        "at work, of both eyes, one, both, one: {frames} ms a frame of {} x {} an eye; passes of both and of one [ms]: {}",
        EYE.x,
        EYE.y,
        passes.join(", ")
    );
    let opaque = "main_opaque_pass_3d";
    if pass(opaque, 0) > pass(opaque, 1) && pass(opaque, 1) > 0.0 { Ok(said) } else { Err(said) }
}

/// How often the clay went on and its surface was made, against frames of the headset.
pub(super) fn once() -> Step {
    Step::check("once a frame", |world| {
        let Busy { frames, reports, surfaces, .. } = world.resource::<Busy>();
        let said = format!(
            "{} frames of clay and {} surfaces in {frames} of the headset with two eyes, at most {} and {} seen in one",
            reports[0], surfaces[0], reports[1], surfaces[1]
        );
        // Two frames of clay may end between two looks; of each there is one surface at most.
        if reports[0] <= *frames && surfaces[0] <= reports[0] && surfaces[1] == 1 { Ok(said) } else { Err(said) }
    })
}
