//! Snapshots from scenes, and what stops them.

use super::*;
use crate::sim::frame::{Energies, FramePlan, FrameReport, ToolReport};
use crate::sim::params::WALL_NODE;
use crate::sim::planner::Decision;
use std::fs;

fn build(text: &str) -> Result<BuiltScene, SceneError> {
    ClayScene::from_ron(text)?.build(Path::new("."))
}

fn built(text: &str) -> BuiltScene {
    build(text).expect(text)
}

fn error_of(text: &str) -> String {
    let error = build(text).expect_err(text).to_string();
    assert!(!error.contains('\n'), "{error}");
    error
}

#[test]
fn box_of_whole_cells_gets_whole_particles() {
    for (ppc, made) in [(1, 1), (8, 8), (10, 8), (27, 27), (64, 64)] {
        let scene = built(&format!("(clay: [Box(size: (0.04, 0.02, 0.012))], cell_width: 0.004, particles_per_cell: {ppc})"));
        let cells = 10 * 5 * 3;
        assert_eq!(scene.snapshot.particles.len(), cells * made);
        let volume = (0.004f64.powi(3) / made as f64) as f32;
        assert!(scene.snapshot.particles.iter().all(|p| (p.rest_volume / volume - 1.0).abs() < 1e-6));
        let mut held = std::collections::HashMap::new();
        scene.snapshot.particles.iter().for_each(|p| *held.entry(p.cell).or_insert(0) += 1);
        assert!(held.len() == cells && held.values().all(|n| *n == made), "{ppc}");
        assert_eq!(scene.warnings.len(), usize::from(ppc == 10), "{:?}", scene.warnings);
    }
}

#[test]
fn automatic_room_has_its_floor_under_the_clay() {
    let scene = built("(clay: [Box(size: (0.04, 0.04, 0.04))], cell_width: 0.004)");
    let (low, high) = scene.snapshot.domain.corners();
    assert!((low.y + 0.02).abs() < 1e-12 && low.x < -0.05 && high.min_element() > 0.05, "{low} {high}");
    let lowest = scene.snapshot.particles.iter().map(|p| p.grid().y).fold(f64::INFINITY, f64::min);
    assert!(lowest > f64::from(WALL_NODE) && lowest < f64::from(WALL_NODE) + 0.5, "{lowest}");
    let scene = built("(clay: [Box(size: (0.04, 0.04, 0.04), center: (0, 0.02, 0))], cell_width: 0.004)");
    assert_eq!(scene.snapshot.domain.corners().0.y, 0.0);
}

#[test]
fn automatic_room_reaches_tools_within_the_clays_extent() {
    let tool = |x: f64| format!("tools: [(shape: Sphere(radius: 0.01), keyframes: [(time: 0, position: ({x}, 0, 0))])]");
    let high = |x| {
        let scene = built(&format!("(clay: [Box(size: (0.04, 0.04, 0.04))], cell_width: 0.002, {})", tool(x)));
        scene.snapshot.domain.corners().1.x
    };
    for (x, low) in [(0.0, 0.036), (0.045, 0.055), (9.0, 0.06)] {
        assert!((low - 1e-9..low + 0.008).contains(&high(x)), "tool at {x}: {}", high(x));
    }
}

#[test]
fn overlapping_pieces_count_once() {
    let one = built("(clay: [Sphere(radius: 0.02)], cell_width: 0.004)");
    let two = built("(clay: [Sphere(radius: 0.02), Sphere(radius: 0.02), Sphere(radius: 0.01)], cell_width: 0.004)");
    assert_eq!(one.snapshot.particles.len(), two.snapshot.particles.len());
    let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.02f64.powi(3);
    assert!((one.snapshot.rest_volume() / exact - 1.0).abs() < 1e-6, "{}", one.snapshot.rest_volume() / exact);
    assert!((two.snapshot.rest_volume() / exact - 1.0).abs() < 1e-3, "{}", two.snapshot.rest_volume() / exact);
}

#[test]
fn particles_depend_on_the_seed_alone() {
    let text = |seed: u32| format!("(clay: [Cylinder(radius: 0.02, height: 0.03)], cell_width: 0.003, seed: {seed})");
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
    let alone = pool(1).install(|| built(&text(3)));
    let crowd = pool(5).install(|| built(&text(3)));
    assert_eq!(alone.snapshot, crowd.snapshot);
    assert_ne!(alone.snapshot, built(&text(4)).snapshot);
}

#[test]
fn absurd_resolution_names_memory_and_the_width_that_fits() {
    let text = |cell_width: f64| format!("(clay: [Box(size: (0.1, 0.1, 0.1))], cell_width: {cell_width:e})");
    let gib = f64::from(1 << 30);
    let check = |cell_width: f64, limit: f64| {
        let scene = ClayScene::from_ron(&text(cell_width)).expect("scene");
        let clay = scene.clay_solids(Path::new("."), None).expect("solids");
        scene.check_memory(&clay.solids, (clay.low, clay.high), limit)
    };
    for (cell_width, limit) in [(1e-9, 8.0 * gib), (1e-5, gib), (1e-3, 0.02 * gib), (5e-5, 1e6 * gib)] {
        let error = check(cell_width, limit).expect_err("absurd");
        let line = error.to_string();
        let SceneError::Memory { fits, bytes, .. } = error else { panic!("{error}") };
        assert!(line.contains("iB") && line.contains("cell_width = ") && bytes > 0.0, "{line}");
        check(fits, limit).expect("the width named fits");
        let domain = ClayScene::from_ron(&text(fits)).expect("scene").room_about(DVec3::splat(-0.05), DVec3::splat(0.05), fits);
        Domain::new(domain.low, domain.high, fits, ClayScene::from_ron(&text(fits)).expect("scene").walls)
            .expect("a grid that is not too long");
    }
    // Where memory is not in the way, the length of the grid is, and the domain says so.
    let long = ClayScene::from_ron("(clay: [Box(size: (1, 0.001, 0.001))], cell_width: 0.0005)").expect("scene");
    let error = long.build(Path::new(".")).expect_err("too long").to_string();
    assert!(error.contains("more than 1024 cells along an axis"), "{error}");
    let build =
        |cell_width: f64, limit: f64| ClayScene::from_ron(&text(cell_width)).expect("scene").build_within(Path::new("."), limit);
    let error = build(1e-5, gib).expect_err("absurd").to_string();
    assert!(
        error.starts_with("scene: cell_width = 0.00001 gives about 8.000e12 particles")
            && error.contains("over the limit of 1.0 GiB"),
        "{error}"
    );
    assert!(memory_limit() > 1e6);
}

/// Cells that would do about the clay are none too small: the room given is too large, be it for the memory
/// or for the grid.
#[test]
fn absurd_room_is_named() {
    let room = |half: f64| format!("domain: (low: (-{half}, -{half}, -{half}), high: ({half}, {half}, {half}))");
    for (half, parts) in [
        (1e4, ["over the limit of ", "cell_width = 0.005 m"]),
        (4.0, ["more than 1024 cells along an axis", "smallest cell width"]),
    ] {
        let error = error_of(&format!("(clay: [Box(size: (0.1, 0.1, 0.1))], cell_width: 0.005, {})", room(half)));
        assert!(error.starts_with("scene: domain = [-") && parts.iter().all(|part| error.contains(part)), "{error}");
    }
    // Where the cells are too small for the clay alone, it is they.
    let error = error_of(&format!("(clay: [Box(size: (0.1, 0.1, 0.1))], cell_width: 1e-8, {})", room(1e4)));
    assert!(error.starts_with("scene: cell_width = "), "{error}");
    let error = error_of(&format!("(clay: [Box(size: (1, 0.001, 0.001))], cell_width: 0.0005, {})", room(1.0)));
    assert!(error.starts_with("scene: cell_width = "), "{error}");
}

#[test]
fn clay_outside_the_room_and_thin_clay_are_told() {
    let room = "domain: (low: (-0.03, 0, -0.03), high: (0.03, 0.06, 0.03))";
    let error = error_of(&format!(
        "(clay: [Sphere(radius: 0.01, center: (0, 0.02, 0)), Sphere(radius: 0.02)], cell_width: 0.002, {room})"
    ));
    assert!(error.contains("clay[1] (sphere) reaches outside the domain along y: -0.02"), "{error}");
    let error = error_of("(clay: [Box(size: (0.04, 0.04, 0.0001)), Sphere(radius: 0.02, center: (1, 0, 0))], cell_width: 0.01)");
    assert!(error.contains("clay[0] (box) is too thin for cell_width = 0.01"), "{error}");
    let thin = built("(clay: [Box(size: (0.04, 0.04, 0.002))], cell_width: 0.003)");
    assert!(thin.warnings[0].contains("clay[0] (box) is 2.00e-3 m thick"), "{:?}", thin.warnings);
    assert!((thin.snapshot.rest_volume() / (0.04 * 0.04 * 0.002) - 1.0).abs() < 1e-6);
}

/// A tool that is never there while the scene runs is told, by its number and name; one that is there for a
/// part of it, or from then on, is not.
#[test]
fn tools_outside_the_scene_are_told() {
    let warnings = |name: &str, times: &[f64]| {
        let keyframes: String = times.iter().map(|time| format!("(time: {time}, position: (0, 1, 0)), ")).collect();
        let tool = format!("(name: \"{name}\", shape: Sphere(radius: 0.01), keyframes: [{keyframes}])");
        built(&format!("(clay: [Box(size: (0.04, 0.04, 0.04))], cell_width: 0.01, duration: 0.5, tools: [{tool}])")).warnings
    };
    assert_eq!(warnings("late", &[0.5, 2.0]), ["tools[0] (late) is there from 0.5 s to 2 s, never in a scene from 0 s to 0.5 s"]);
    assert!(warnings("", &[0.7])[0].starts_with("tools[0] is there from 0.7 s on, never"));
    assert_eq!(warnings("early", &[-1.0, 0.0]).len(), 1);
    for times in [&[0.4, 2.0][..], &[-1.0, 0.1], &[-1.0], &[0.0, 0.2]] {
        assert_eq!(warnings("there", times), Vec::<String>::new(), "{times:?}");
    }
}

/// A solid tool that begins in the clay is told of, whenever it begins; what only touches it, and a blade, is
/// not.
#[test]
fn tools_that_begin_in_clay_are_told() {
    let warnings = |shape: &str, time: f64, height: f64| {
        let tool = format!(
            "(shape: {shape}, keyframes: [(time: {time}, position: (0, {height}, 0)), (time: 0.4, position: (0, 1, 0))])"
        );
        built(&format!("(clay: [Box(size: (0.04, 0.04, 0.04))], cell_width: 0.01, duration: 0.5, tools: [{tool}])")).warnings
    };
    let ball = "Sphere(radius: 0.01)";
    let found = warnings(ball, 0.0, 0.02);
    assert!(matches!(&found[..], [told] if told.starts_with("tools[0] begins 9.3e-3 m deep in the clay")), "{found:?}");
    assert_eq!(warnings(ball, 0.2, 0.02), found);
    for (shape, height) in [(ball, 0.0301), (ball, 0.05), ("Blade(half_width: 0.03, half_height: 0.01)", 0.02)] {
        assert_eq!(warnings(shape, 0.0, height), Vec::<String>::new(), "{shape} {height}");
    }
}

/// A tetrahedron with `faces` of its four, as OBJ.
fn tetrahedron(faces: &[&str]) -> String {
    format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{}", faces.iter().map(|f| format!("f {f}\n")).collect::<String>())
}

#[test]
fn mesh_is_placed_scaled_and_warned_about() {
    let folder = tempfile::tempdir().expect("folder");
    let whole = ["1 3 2", "1 2 4", "1 4 3", "2 3 4"];
    let turned = ["1 2 3", "1 4 2", "1 3 4", "2 4 3"];
    for (name, faces) in
        [("whole.obj", &whole[..]), ("turned.obj", &turned), ("open.obj", &whole[..3]), ("flat.obj", &whole[1..2])]
    {
        fs::write(folder.path().join(name), tetrahedron(faces)).expect("write");
    }
    let build = |mesh: &str| {
        ClayScene::from_ron(&format!("(clay: [Mesh(path: {mesh})], cell_width: 0.004)")).expect("scene").build(folder.path())
    };
    let volume = |scene: &BuiltScene| scene.snapshot.rest_volume() / (0.05f64.powi(3) / 6.0);
    let scene = build("\"whole.obj\", height: 0.05, position: (0.1, 0.2, 0.3)").expect("whole");
    assert!(scene.warnings.is_empty() && (volume(&scene) - 1.0).abs() < 1e-6, "{:?}", scene.warnings);
    assert!((scene.snapshot.domain.corners().0.y - 0.2).abs() < 1e-9);
    assert!(scene.fill.sampled_error.abs() < 0.02, "{:?}", scene.fill);
    let scene = build("\"turned.obj\", scale: 0.05, center: (0, 0, 0)").expect("turned");
    assert!(scene.warnings == ["turned.obj: the mesh is inside out; filled as if turned"] && (volume(&scene) - 1.0).abs() < 1e-6);
    assert!((scene.snapshot.domain.corners().0.y + 0.025).abs() < 1e-9);
    let scene = build("\"open.obj\", scale: 0.05").expect("open");
    assert!(scene.warnings[0].contains("3 open edges around 1 hole(s), the largest 8.66e-2 m across"), "{:?}", scene.warnings);
    assert!((0.1..1.5).contains(&volume(&scene)), "{}", volume(&scene));
    let flat = build("\"flat.obj\", height: 0.05").expect_err("no height").to_string();
    assert!(flat.contains("flat.obj: the mesh has no height"), "{flat}");
    let missing = build("\"none.obj\"").expect_err("missing").to_string();
    assert!(missing.contains("none.obj: "), "{missing}");
}

#[test]
fn frames_cover_the_duration_and_keep_the_time_step() {
    let keyframes = "keyframes: [(time: 0.1, position: (0, 0.1, 0)), (time: 0.3, position: (0, 0.09, 0))]";
    let text = format!(
        "(clay: [Sphere(radius: 0.02)], cell_width: 0.004, frame_time: 0.1, duration: 0.5, integrator: Explicit, inertia: Accurate, seed: 9,
        tools: [(shape: Sphere(radius: 0.01), keyframes: [(time: 9, position: (0, 0, 0))]), (shape: Sphere(radius: 0.01), {keyframes})])"
    );
    let mut scene = built(&text);
    assert_eq!(scene.frame_count(), 5);
    // Whether inertia is scaled in frame 2, of what frame 0 did.
    let plans = |scene: &BuiltScene, first: &FrameReport| -> Vec<FramePlan> {
        let mut planner = scene.planner();
        let frames = 0..scene.frame_count();
        let plan = |frame| {
            let Decision::Run(plan) = scene.next(frame, &mut planner) else { panic!("frame {frame} waits") };
            planner.sent();
            let report = if frame == 0 { first.clone() } else { FrameReport::default() };
            planner.note(&mut FrameReport { plan_id: frame, ..report });
            plan
        };
        frames.map(plan).collect()
    };
    let free = FrameReport::default();
    let tools: Vec<usize> = plans(&scene, &free).iter().map(|plan| plan.tools.len()).collect();
    assert_eq!(tools, [0, 1, 1, 0, 0]);
    // Inertia is scaled only where a tool touches clay, a wall holds all of it up, and none is landing.
    let tool = ToolReport { contacts: 1, ..ToolReport::default() };
    let touched = FrameReport { tools: vec![tool], ..FrameReport::default() };
    let held = FrameReport { wall_impulse: DVec3::Y, ..touched.clone() };
    let falling = FrameReport { has_loose_clay: Some(true), ..held.clone() };
    let engaged = FrameReport { has_loose_clay: Some(false), ..held.clone() };
    let landing = FrameReport { energies: Energies { kinetic: 1.1, elastic: 1.0 }, ..engaged.clone() };
    for first in [&free, &touched, &held, &falling, &landing] {
        assert_eq!(plans(&scene, first)[2].density_scale(), 1.0, "{first:?}");
    }
    let plan = &plans(&scene, &engaged)[2];
    assert_eq!((plan.id, plan.tools[0].id), (2, 2));
    assert!(plan.density_scale() > 1.0 && (plan.duration() - 0.1).abs() < 1e-12 && plan.validate().is_ok());
    scene.scene.time_step = Some(1e-5);
    let plan = &plans(&scene, &free)[1];
    assert!(plan.dt <= 1e-5 && (plan.duration() - 0.1).abs() < 1e-12);
}
