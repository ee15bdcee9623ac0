//! Frame times of an app with clay under a pressing ball, drawn without a window:
//! `cargo bench --bench frames -- [--engine native|gpu] [--seconds S]`.
//!
//! For each engine and size: app frames (mean, 95th percentile), clay frames with their substeps and time,
//! simulated time per wall time, surface, and the longest time that clay held the main thread.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a benchmark prints its figures")]

use bevy::app::PluginsState;
use bevy::camera::RenderTarget;
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::render::render_resource::TextureFormat;
use bevy::winit::WinitPlugin;
use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use glam::DVec3;
use std::time::{Duration, Instant};

/// Particle counts: 8 to a cell in blocks of these many cells.
const SIZES: [[i32; 3]; 3] = [[10, 10, 10], [16, 15, 16], [24, 23, 24]];
const CELL: f64 = 0.002;
/// Time before the measurement starts [s]: shaders compile, the clay settles, the ball comes near.
const WARM_UP: f64 = 2.0;

fn block(cells: [i32; 3]) -> Snapshot {
    let size = IVec3::from_array(cells).as_dvec3() * CELL;
    let margin = DVec3::new(12.0, 0.0, 12.0) * CELL;
    let room = (-margin, size + margin + DVec3::Y * 16.0 * CELL);
    let domain = Domain::new(room.0, room.1, CELL, Walls::default()).expect("a room");
    let corner = domain.to_grid(DVec3::ZERO);
    let [nx, ny, nz] = cells.map(|c| 2 * c);
    let at = |i: i32| DVec3::new(f64::from(i % nx), f64::from(i / nx % ny), f64::from(i / nx / ny)) * 0.5 + 0.25;
    let particle = |i: i32| Particle::at(corner + at(i), (CELL.powi(3) / 8.0) as f32, i.cast_unsigned());
    let material = ClayMaterial { softening: 0.5, ..Preset::SoftClay.material() };
    Snapshot::new(domain, material, (0..nx * ny * nz).map(particle).collect())
}

/// The middle of the clay's top and how long the ball has been about.
#[derive(Resource)]
struct Press {
    top: Vec3,
    seconds: f32,
}

/// The ball sinks in at 10 mm/s, 4 mm deep, and comes up again.
fn press(time: Res<Time>, mut press: ResMut<Press>, mut ball: Single<&mut Transform, With<SculptTool>>) {
    press.seconds += time.delta_secs();
    let depth = 0.004 * (press.seconds * 2.5).sin();
    ball.translation = press.top + Vec3::Y * (0.008 - depth);
}

fn app(cells: [i32; 3], engine: EngineChoice) -> App {
    let mut app = App::new();
    let window = WindowPlugin { primary_window: None, exit_condition: bevy::window::ExitCondition::DontExit, ..default() };
    app.add_plugins((DefaultPlugins.set(window).disable::<WinitPlugin>().disable::<LogPlugin>(), ClayPlugins));
    let size = IVec3::from_array(cells).as_dvec3() * CELL;
    let top = Vec3::new(size.x as f32 / 2.0, size.y as f32, size.z as f32 / 2.0);
    app.insert_resource(Press { top, seconds: 0.0 }).add_systems(Update, press.in_set(ClaySystems::Tool));
    let settings = ClaySettings { engine, inertia: InertiaScaling::Fast, ..default() };
    app.world_mut().spawn((Clay::snapshot(block(cells)), settings));
    app.world_mut().spawn((SculptTool::ball(0.008), Transform::from_translation(top + Vec3::Y * 0.008)));
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(Image::new_target_texture(
        1280,
        720,
        TextureFormat::Rgba8UnormSrgb,
        None,
    ));
    let camera = Transform::from_translation(top + Vec3::new(0.05, 0.06, 0.08)).looking_at(top, Vec3::Y);
    app.world_mut().spawn((Camera3d::default(), RenderTarget::Image(image.into()), camera));
    let sun = DirectionalLight { shadow_maps_enabled: true, ..default() };
    app.world_mut().spawn((sun, Transform::from_xyz(1.0, 2.0, 0.5).looking_at(Vec3::ZERO, Vec3::Y)));
    while app.plugins_state() == PluginsState::Adding {
        std::thread::sleep(Duration::from_millis(1));
    }
    app.finish();
    app.cleanup();
    app
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let value = |name: &str| args.iter().position(|a| a == name).and_then(|i| args.get(i + 1));
    let seconds = value("--seconds").and_then(|s| s.parse().ok()).unwrap_or(10.0);
    let only = value("--engine").map(String::as_str);
    let only_size = value("--size").and_then(|s| s.parse::<usize>().ok());
    println!(
        "engine | particles | app frame ms mean / p95 | clay frames/s | substeps | clay ms | sim/wall | surface ms | main thread ms"
    );
    for (name, engine) in [("native", EngineChoice::Native), ("gpu", EngineChoice::Gpu)] {
        for (i, cells) in SIZES.into_iter().enumerate() {
            if only.is_none_or(|o| o == name) && only_size.is_none_or(|s| s == i) {
                measure(name, engine, cells, seconds);
            }
        }
    }
}

fn measure(name: &str, engine: EngineChoice, cells: [i32; 3], seconds: f64) {
    let mut app = app(cells, engine);
    let start = Instant::now();
    let mut query = app.world_mut().query::<(&ClayStatus, &ClayMetrics)>();
    while query.single(app.world()).is_ok_and(|(s, _)| s.engine.is_empty()) {
        app.update();
        if start.elapsed() > Duration::from_secs(120) {
            eprintln!("{name}: no engine within two minutes");
            return;
        }
    }
    let started = Instant::now();
    while started.elapsed().as_secs_f64() < WARM_UP {
        app.update();
    }
    let sample = |app: &App, query: &mut QueryState<(&ClayStatus, &ClayMetrics)>| {
        query.single(app.world()).map(|(_, metrics)| *metrics).unwrap_or_default()
    };
    let before = sample(&app, &mut query);
    let (begin, mut frames, mut held) = (Instant::now(), vec![], 0.0f64);
    let (mut substeps, mut clay_ms, mut count, mut time) = (0.0, 0.0, 0.0, before.time);
    while begin.elapsed().as_secs_f64() < seconds {
        let frame = Instant::now();
        app.update();
        frames.push(frame.elapsed().as_secs_f64() * 1e3);
        let now = sample(&app, &mut query);
        held = held.max(now.main_thread_ms);
        if now.time > time {
            (time, count) = (now.time, count + 1.0);
            substeps += f64::from(now.substeps);
            clay_ms += now.frame_ms;
        }
    }
    let wall = begin.elapsed().as_secs_f64();
    let after = sample(&app, &mut query);
    let status = query.single(app.world()).map(|(status, _)| status.clone()).unwrap_or_default();
    frames.sort_by(f64::total_cmp);
    let mean = frames.iter().sum::<f64>() / frames.len() as f64;
    let late = frames[(frames.len() * 95 / 100).min(frames.len() - 1)];
    println!(
        "{name} | {} | {mean:.1} / {late:.1} | {:.1} | {:.0} | {:.1} | {:.3} | {:.1} | {held:.2}",
        status.particle_count,
        count / wall,
        substeps / f64::max(count, 1.0),
        clay_ms / f64::max(count, 1.0),
        (after.time - before.time) / wall,
        after.mesh_ms
    );
    if let Some(error) = status.error {
        eprintln!("{name}: {error}");
    }
    eprintln!("  on {}", status.engine);
}
