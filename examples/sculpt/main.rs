//! Sculpts clay in a window: `cargo demo sculpt [-- --scene FILE --clay FILE --engine
//! auto|native|gpu --surface auto|cpu|gpu --frames N --script --screenshot FILE --out DIR]`.
//!
//! | file     | does                                              |
//! |----------|---------------------------------------------------|
//! | `args`   | the command line, the clay to start with          |
//! | `stage`  | board, lights, camera                             |
//! | `pick`   | where the pointer's ray meets the clay            |
//! | `tools`  | the tools: shapes, poses, looks                   |
//! | `stroke` | from pointer to tool                              |
//! | `pace`   | how fast the clay's time goes                     |
//! | `hud`    | keys, bar of tools, help                          |
//! | `script` | a stroke without a mouse                          |
//! | `watch`  | answers, what strokes left behind, the last check |
//! | `say`    | lines for the terminal; as in `headless`          |
//!
//! Exit code 2: bad arguments or scene, in one line; 1: the check at the end failed; 0: all is well.

mod args;
mod hud;
mod pace;
mod pick;
#[path = "../headless/say.rs"]
mod say;
mod script;
mod stage;
mod stroke;
mod tools;
mod watch;

use args::{Args, Start};
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::render::renderer::RenderAdapterInfo;
use bevy::window::WindowResolution;
use bevy_clay::prelude::*;
use bevy_egui::{EguiGlobalSettings, EguiPrimaryContextPass, PrimaryEguiContext};
use glam::DVec3;
use wgpu::DeviceType;

/// Softening of the clay about a tool: with it a hand leaves marks where it presses and not beside.
const SOFTENING: f64 = 0.5;
/// Length of the clay's ball over a unit of the tools.
const UNITS: f32 = 4.0;

fn main() -> AppExit {
    let prepared = Args::read().and_then(|args| {
        display()?;
        let start = args.start()?;
        Ok((args, start))
    });
    let (args, start) = match prepared {
        Ok(prepared) => prepared,
        Err(error) => {
            say::error(&error);
            return AppExit::from_code(2);
        }
    };
    let window = Window { title: "bevy_clay".into(), resolution: WindowResolution::new(1280, 800), ..default() };
    let log = LogPlugin { filter: "warn,bevy_clay=info".into(), ..default() };
    let is_scripted = args.script;
    let mut app = App::new();
    app.add_plugins(DefaultPlugins.set(WindowPlugin { primary_window: Some(window), ..default() }).set(log))
        .add_plugins((ClayPlugins, SoftwareDrawingPlugin, ClayPanelPlugin { export_folder: args.out.clone() }))
        .insert_resource(ClearColor(stage::BACKGROUND))
        .insert_resource(args)
        .insert_resource(start)
        .init_resource::<tools::Hand>()
        .init_resource::<stroke::Pointer>()
        .init_resource::<stroke::Work>()
        .init_resource::<pace::Pace>()
        .init_resource::<hud::Help>()
        .init_resource::<script::Script>()
        .init_resource::<watch::Watch>()
        .add_message::<stroke::StrokeNews>()
        .add_systems(Startup, (set_up, tools::spawn))
        .add_systems(Update, (hud::keys, stage::orbit).chain().before(ClaySystems::Report))
        .add_systems(
            Update,
            (tools::shape, stroke::point, stroke::work, pace::keep, pace::draw).chain().in_set(ClaySystems::Tool),
        )
        .add_systems(
            Update,
            (tools::tint, tools::late, watch::count, watch::measure, watch::end).chain().after(ClaySystems::Show),
        )
        .add_systems(EguiPrimaryContextPass, (hud::bar, hud::help).chain())
        .add_observer(set_panels);
    // The camera with the panels is chosen by hand.
    app.world_mut().resource_mut::<EguiGlobalSettings>().auto_create_primary_context = false;
    if is_scripted {
        app.add_systems(Update, script::play.before(stroke::point).in_set(ClaySystems::Tool));
    }
    app.run()
}

/// Whether a window can be opened at all.
fn display() -> Result<(), String> {
    let is_set = std::env::var_os("DISPLAY").is_some_and(|value| !value.is_empty());
    if cfg!(target_os = "linux") && !is_set {
        return Err("there is no display (DISPLAY is not set); `xvfb-run` makes one, the example `headless` needs none".into());
    }
    Ok(())
}

/// Puts the clay on the table.
fn set_up(
    (args, start, adapter): (Res<Args>, Res<Start>, Res<RenderAdapterInfo>),
    mut commands: Commands,
    (mut meshes, mut materials): (ResMut<Assets<Mesh>>, ResMut<Assets<StandardMaterial>>),
    (mut hand, mut notice): (ResMut<tools::Hand>, ResMut<ClayNotice>),
    mut exit: MessageWriter<AppExit>,
) {
    let draws_fast = adapter.device_type != DeviceType::Cpu;
    let is_fast = draws_fast && !matches!(args.engine, args::EngineArg::Native);
    start.warnings().iter().for_each(|w| watch::say(&format!("warning: {w}")));
    let snapshot = match start.snapshot(is_fast) {
        Ok(snapshot) => snapshot,
        Err(error) => {
            say::error(&error);
            exit.write(AppExit::from_code(2));
            return;
        }
    };
    let ball = ball(&snapshot);
    hand.unit = ball.1 / UNITS;
    let floor = snapshot.domain.corners().0.y as f32;
    let eye = stage::set(&mut commands, &mut meshes, &mut materials, ball, floor);
    if draws_fast {
        commands.entity(eye).insert(PrimaryEguiContext);
    }
    let inertia = if is_fast { InertiaScaling::Off } else { InertiaScaling::Fast };
    let line = if is_fast {
        format!("{} particles; drawn by {}", snapshot.particles.len(), adapter.name)
    } else {
        format!(
            "no graphics processor for the clay ({}): {} particles, inertia scaled, slow motion, so that it answers",
            adapter.name,
            snapshot.particles.len()
        )
    };
    watch::say(&line);
    notice.text = line;
    let material = start.material(SOFTENING);
    let settings = ClaySettings { engine: args.engine.into(), inertia, surface: args.surface.into(), ..default() };
    let look = StandardMaterial {
        base_color: Color::srgb(0.58, 0.42, 0.34),
        perceptual_roughness: 0.88,
        reflectance: 0.25,
        ..default()
    };
    let mut clay = commands.spawn((
        Name::new("clay"),
        Clay::snapshot(snapshot),
        material,
        settings,
        ClayHistory::default(),
        MeshMaterial3d(materials.add(look)),
    ));
    if let Some(file) = &args.clay {
        clay.insert(MaterialFile::new(file));
    }
}

/// Where a processor draws, the panels stand over the small picture, in the window's own pixels.
fn set_panels(screen: On<Add, ScreenCamera>, mut commands: Commands) {
    commands.entity(screen.entity).insert(PrimaryEguiContext);
}

/// Middle and half the diagonal of the box of the particles \[m\].
fn ball(snapshot: &Snapshot) -> (Vec3, f32) {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = snapshot
        .particles
        .iter()
        .map(|p| snapshot.domain.to_world(p.grid()))
        .fold(none, |(low, high), at| (low.min(at), high.max(at)));
    ((low + high).as_vec3() / 2.0, (high - low).length() as f32 / 2.0)
}
