//! The scenes of `assets/scenes`, built and checked against the geometry they speak of.

use bevy_clay::prelude::*;
use bevy_clay::scene::fill::{Fill, FilledPoint};
use bevy_clay::scene::prelude::*;
use bevy_clay::scene::solid::{MeshSolid, Solid};
use glam::{DVec3, IVec3};
use std::collections::{HashMap, HashSet};
use std::path::Path;

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes")
}

fn built(name: &str) -> BuiltScene {
    let scene = ClayScene::load(&folder().join(name)).expect("a good scene");
    scene.build(&folder()).expect("a scene that builds")
}

/// The bunny as `bunny_carve.ron` puts it: 80 mm high, on the ground.
fn bunny() -> Solid {
    let mut mesh = ImportedMesh::load(&folder().join("../meshes/bunny.obj")).expect("bunny");
    let (low, high) = mesh.bounds();
    let scale = 0.08 / (high.y - low.y);
    mesh.place(glam::DQuat::IDENTITY, scale, -DVec3::new((low.x + high.x) / 2.0, low.y, (low.z + high.z) / 2.0) * scale);
    Solid::Mesh(Box::new(MeshSolid::new(mesh)))
}

/// Sizes of the connected groups of inside points of a lattice of `spacing`, links cut where `is_cut` says
/// so, with the box of each; largest first.
fn pieces(solid: &Solid, spacing: f64, is_cut: impl Fn(DVec3, DVec3) -> bool) -> Vec<(usize, DVec3, DVec3)> {
    let (points, _) = Fill { spacing, jitter: 0.0, seed: 0 }.fill(std::slice::from_ref(solid));
    let (low, _) = solid.bounds();
    let key = |p: DVec3| ((p - low) / spacing).floor().as_ivec3();
    let place = |k: IVec3| low + (k.as_dvec3() + 0.5) * spacing;
    let mut left: HashSet<IVec3> = points.iter().map(|p: &FilledPoint| key(p.position)).collect();
    let mut pieces = Vec::new();
    while let Some(&start) = left.iter().next() {
        left.remove(&start);
        let (mut todo, mut piece) = (vec![start], (0, DVec3::INFINITY, DVec3::NEG_INFINITY));
        while let Some(k) = todo.pop() {
            let p = place(k);
            piece = (piece.0 + 1, piece.1.min(p), piece.2.max(p));
            for step in [IVec3::X, IVec3::Y, IVec3::Z].into_iter().flat_map(|s| [s, -s]) {
                if left.contains(&(k + step)) && !is_cut(p, place(k + step)) {
                    left.remove(&(k + step));
                    todo.push(k + step);
                }
            }
        }
        pieces.push(piece);
    }
    pieces.sort_by_key(|p| std::cmp::Reverse(p.0));
    pieces
}

/// Whether some blade of the scene sweeps over the link from `a` to `b`: it passes the blade's plane within
/// the rectangle at some time.
fn cuts(scene: &BuiltScene) -> impl Fn(DVec3, DVec3) -> bool {
    let mut rectangles = Vec::new();
    let step = 0.01;
    for i in 0..(scene.scene.duration / step) as u32 {
        for path in scene.tool_paths(f64::from(i) * step, f64::from(i + 1) * step) {
            if let ToolShape::Blade { half_width, half_height } = path.tool.shape {
                rectangles.push((path.pose_at(0.0), half_width, half_height));
            }
        }
    }
    move |a, b| {
        rectangles.iter().any(|(pose, half_width, half_height)| {
            let (a, b) = (pose.to_local(a), pose.to_local(b));
            let foot = a.lerp(b, a.z / (a.z - b.z));
            (a.z < 0.0) != (b.z < 0.0) && foot.x.abs() <= *half_width && foot.y.abs() <= *half_height
        })
    }
}

#[test]
fn bunny_carve_has_the_particles_and_the_volume() {
    let scene = built("bunny_carve.ron");
    println!("{} particles, {:?}", scene.snapshot.particles.len(), scene.fill);
    assert!(scene.snapshot.particles.len() >= 60_000 && scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert!((scene.snapshot.rest_volume() / 110.425e-6 - 1.0).abs() < 1e-3, "{}", scene.snapshot.rest_volume());
    assert!(scene.fill.sampled_error.abs() < 1e-3, "{:?}", scene.fill);
    assert!(scene.snapshot.particles.iter().all(|p| p.rest_volume > 0.0 && p.is_finite()));
    assert_eq!(scene.snapshot.domain.corners().0.y, 0.0);
}

/// The blade parts the bunny in two: the tip of one ear, and everything else in one piece.
#[test]
fn bunny_blade_severs_one_ear_and_nothing_else() {
    const SPACING: f64 = 0.0015;
    let scene = built("bunny_carve.ron");
    let bunny = bunny();
    let whole = pieces(&bunny, SPACING, |_, _| false);
    assert_eq!(whole.len(), 1, "{whole:?}");
    let parted = pieces(&bunny, SPACING, cuts(&scene));
    println!("{parted:?}");
    assert_eq!(parted.len(), 2, "{parted:?}");
    let (ear, low, high) = parted[1];
    let volume = ear as f64 * SPACING.powi(3);
    assert!((0.5e-6..2e-6).contains(&volume), "an ear of {volume} m^3");
    assert!(
        high.z < -0.015 && low.y > 0.055 && high.x < -0.02,
        "the tip is behind the blade, high, at its own side: {low} {high}"
    );
}

/// The blade's band stays clear of the body, the head and the other ear: 2 cells about the swept plane (the
/// band is 1.5), the ear alone is inside.
#[test]
fn bunny_blade_stays_clear_of_everything_but_the_ear() {
    let scene = built("bunny_carve.ron");
    let bunny = bunny();
    let cell = scene.snapshot.domain.cell_width;
    let (tool_low, tool_high) = scene.scene.tools[0].bounds();
    let mut inside = 0;
    for (low, high) in [(tool_low.y, 0.056), (0.056, tool_high.y)] {
        for p in lattice(
            DVec3::new(tool_low.x - cell, low, tool_low.z - 2.0 * cell),
            DVec3::new(tool_high.x + cell, high, tool_high.z + 2.0 * cell),
        ) {
            if bunny.contains(p) {
                inside += 1;
                assert!(p.y > 0.056 && (-0.039..-0.022).contains(&p.x), "the blade comes near {p}");
            }
        }
    }
    assert!(inside > 100, "{inside}");
}

fn lattice(low: DVec3, high: DVec3) -> impl Iterator<Item = DVec3> {
    let count = ((high - low) / 0.001).ceil().as_ivec3();
    let range = move |n: i32| 0..=n;
    range(count.z).flat_map(move |z| {
        range(count.y).flat_map(move |y| {
            range(count.x).map(move |x| low + (high - low) * IVec3::new(x, y, z).as_dvec3() / count.as_dvec3())
        })
    })
}

/// The ball starts and ends clear of the bunny and goes a few millimetres deep; so does no other part of its
/// way.
#[test]
fn bunny_ball_presses_the_flank_a_few_millimetres() {
    let scene = built("bunny_carve.ron");
    let bunny = bunny();
    let ball = &scene.scene.tools[1];
    let ToolShape::Sphere { radius } = ball.shape else { panic!("a ball") };
    let deepest = |center: DVec3| {
        let inside = lattice(center - radius, center + radius).filter(|p| p.distance(center) < radius && bunny.contains(*p));
        inside.map(|p| radius - p.distance(center)).fold(0.0, f64::max)
    };
    let depths: Vec<f64> = ball.keyframes.iter().map(|k| deepest(k.position)).collect();
    println!("depths {depths:?}");
    assert!(depths[0] == 0.0 && depths[3] == 0.0 && (0.003..0.006).contains(&depths[1]), "{depths:?}");
}

#[test]
fn cube_blade_parts_the_cube_in_equal_halves() {
    let scene = built("cube_cut.ron");
    assert_eq!((scene.snapshot.particles.len(), scene.warnings.len()), (64_000, 0));
    let cube = Solid::Box { low: DVec3::new(-0.02, 0.0, -0.02), high: DVec3::new(0.02, 0.04, 0.02) };
    let parted = pieces(&cube, 0.002, cuts(&scene));
    assert_eq!(parted.iter().map(|p| p.0).collect::<Vec<_>>(), [4000, 4000]);
}

/// Tools move at a sculptor's speed, and are gone from the clay at the end.
#[test]
fn tools_are_slow_and_leave() {
    for name in ["bunny_carve.ron", "cube_cut.ron"] {
        let scene = built(name);
        let frame_time = scene.scene.frame_time;
        for frame in 0..scene.frame_count() {
            let Decision::Run(plan) = scene.next(frame, &mut scene.planner()) else { panic!("{name}, frame {frame} waits") };
            plan.validate().expect("a plan that can be run");
            assert!(plan.tools.iter().all(|tool| tool.speed_max() < 0.1), "{name}, frame {frame}");
        }
        assert!(scene.tool_paths(scene.scene.duration - frame_time, scene.scene.duration).is_empty(), "{name}");
    }
}

#[test]
fn slump_cylinder_is_softer_than_its_weight() {
    let scene = built("slump.ron");
    let material = scene.snapshot.material;
    assert!(material.yield_stress < 0.5 * material.density * 9.81 * 0.04);
    let exact = std::f64::consts::PI * 0.02 * 0.02 * 0.04;
    assert!(
        (scene.snapshot.rest_volume() / exact - 1.0).abs() < 1e-6 && scene.fill.sampled_error.abs() < 2e-3,
        "{:?}",
        scene.fill
    );
}

/// Counts and volumes of the bunny over cell widths; a second run gives the same particles.
#[test]
fn bunny_fill_converges_over_cell_widths() {
    for (cell_width, least) in [(0.008, 1000), (0.004, 10_000), (0.002, 90_000)] {
        let text = format!("(clay: [Mesh(path: \"../meshes/bunny.obj\", height: 0.08)], cell_width: {cell_width})");
        let scene = ClayScene::from_ron(&text).expect("scene").build(&folder()).expect("built");
        let report = &scene.fill;
        println!("cell {cell_width}: {report:?}");
        assert!(report.particle_count > least);
        assert!((scene.snapshot.rest_volume() / 110.425e-6 - 1.0).abs() < 1e-4);
        assert!(report.sampled_error.abs() < 0.3 * cell_width, "{report:?}");
    }
    let mut held: HashMap<[i32; 3], u32> = HashMap::new();
    built("bunny_carve.ron").snapshot.particles.iter().for_each(|p| *held.entry(p.cell).or_default() += 1);
    let most = held.values().copied().max().unwrap_or_default();
    assert!(most <= 12, "{most} particles in one cell");
}

/// A block that a knife has cut through, with nothing but faces between its halves, of which a box pushes one
/// over a floor without friction: nothing holds them, and what they bear is their inertia.
const PUSHED_HALF: &str = "(
    clay: [Box(size: (0.016, 0.012, 0.016), center: (0, 0.006, 0))], cell_width: 0.002,
    walls: (low: (Separate, Separate, Separate)), domain: (low: (-0.016, 0, -0.016), high: (0.016, 0.032, 0.016)),
    tools: [
        (shape: Blade(half_width: 0.014, half_height: 0.010), keyframes: [
            (time: 0.0, position: (0, 0.0225, 0), rotation: (axis: (0, 1, 0), degrees: 90)),
            (time: 0.2, position: (0, 0.0095, 0), rotation: (axis: (0, 1, 0), degrees: 90)),
            (time: 0.3, position: (0, 0.0225, 0), rotation: (axis: (0, 1, 0), degrees: 90))]),
        (shape: Box(half_size: (0.002, 0.005, 0.006)), keyframes: [
            (time: 0.3, position: (-0.011, 0.006, 0)), (time: 0.55, position: (-0.005, 0.006, 0))])],
    frame_time: 0.016666666666666666, duration: 0.4)";

/// Halves that come into contact as one is pushed bear what they do in explicit steps: a frame in which
/// forces far beyond the clay's strength are left out of balance is run anew in shorter steps.
#[test]
fn pushed_half_bears_next_to_nothing() {
    let built = ClayScene::from_ron(PUSHED_HALF).expect("a scene").build(Path::new(".")).expect("clay");
    let (mut engine, mut planner) = (NativeEngine::new(), built.planner());
    engine.load(&built.snapshot).expect("sound clay");
    for frame in 0..built.frame_count() {
        let Decision::Run(plan) = built.next(frame, &mut planner) else { panic!("a frame is owed") };
        engine.submit(plan).expect("a sound plan");
        planner.sent();
        let mut report = engine.wait().expect("a report");
        planner.note(&mut report);
        let pushed = report.tools.iter().find(|tool| tool.id == 2).map_or(0.0, |tool| tool.force.length());
        assert!(report.health.is_ok() && pushed < 0.05, "frame {frame}: {pushed} N, {}", report.health);
        // The knife leaves 2e-6 J; a frame that was lost had 1e-4 to 9e-4.
        assert!(frame < 18 || report.energies.elastic < 1e-5, "frame {frame}: {} J", report.energies.elastic);
    }
}
