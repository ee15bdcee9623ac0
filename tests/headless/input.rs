//! Bad input of every kind: exit code 2, one line that names the fault, nothing written.

use super::{BLOCK, Desk, HEADLESS, Ran};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A unit cube in OBJ, with the faces of `more` besides.
pub(crate) fn cube_obj(more: &[&str]) -> String {
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
    let faces = ["1 3 2", "1 4 3", "5 6 7", "5 7 8", "1 2 6", "1 6 5", "3 4 8", "3 8 7", "2 3 7", "2 7 6", "1 5 8", "1 8 4"];
    let lines: String = faces.iter().chain(more).map(|face| format!("f {face}\n")).collect();
    corners.to_string() + &lines
}

/// A torus about the Y axis of these radii [m], in OBJ.
pub(crate) fn torus_obj(ring: f64, tube: f64) -> String {
    const AROUND: usize = 48;
    const ACROSS: usize = 24;
    let mut text = String::new();
    for i in 0..AROUND * ACROSS {
        let (a, b) = ((i / ACROSS) as f64 / AROUND as f64 * TAU, (i % ACROSS) as f64 / ACROSS as f64 * TAU);
        let from_axis = ring + tube * b.cos();
        writeln!(text, "v {} {} {}", from_axis * a.cos(), tube * b.sin(), from_axis * a.sin()).expect("text");
    }
    let at = |i: usize, j: usize| i % AROUND * ACROSS + j % ACROSS + 1;
    for (i, j) in (0..AROUND).flat_map(|i| (0..ACROSS).map(move |j| (i, j))) {
        writeln!(text, "f {} {} {} {}", at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)).expect("text");
    }
    text
}

fn bunny() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes/bunny.obj")
}

/// A scene that has to be refused with a line that holds each part.
#[track_caller]
fn refused(desk: &Desk, scene: &str, parts: &[&str]) {
    let ran = desk.run(scene);
    ran.ends(2, &["error: "]);
    assert!(parts.iter().all(|part| ran.error.contains(part)), "{scene}: {parts:?} expected of {ran:?}");
    assert!(ran.error.len() < 1000 && ran.out.is_empty() && !desk.at("out").exists(), "{scene}: {ran:?}");
}

#[test]
fn damaged_meshes_are_named() {
    let desk = Desk::new();
    let bunny = std::fs::read(bunny()).expect("bunny");
    // Cut within the vertices: no faces.
    std::fs::write(desk.at("cut.obj"), &bunny[..20_000]).expect("file");
    std::fs::write(desk.at("binary.stl"), [0; 100]).expect("file");
    std::fs::write(desk.at("cut.glb"), b"glTF\x02\0\0\0\xff\0\0\0").expect("file");
    let ply = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n";
    let gltf = |extension: &str, mode: u32| {
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "extensionsRequired": [{extension}], "nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{{"attributes": {{}}, "mode": {mode}}}]}}]}}"#
        )
    };
    let files = [
        ("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n".into()),
        ("malformed.obj", "v 0 0 zero\n".into()),
        ("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".into()),
        ("cut.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0".into()),
        ("cut.ply", format!("ply\nformat ascii 1.0\n{ply}")),
        ("malformed.ply", "ply\nformat sideways 1.0\nend_header\n".into()),
        ("malformed.gltf", "{\"asset\": {\"version\": \"2.0\"},\n\"meshes\": 3}".into()),
        ("draco.gltf", gltf("\"KHR_draco_mesh_compression\"", 4)),
        ("points.gltf", gltf("", 0)),
    ];
    for (name, text) in files {
        desk.write(name, &text);
    }
    let cases = [
        ("no_such.obj", "no_such.obj: "),
        ("cut.obj", "cut.obj:669: "),
        ("index.obj", "index.obj:"),
        ("malformed.obj", "malformed.obj:"),
        ("nan.obj", "nan.obj:"),
        ("cut.stl", "cut.stl:"),
        ("binary.stl", "binary.stl:"),
        ("cut.ply", "cut.ply:"),
        ("malformed.ply", "malformed.ply:"),
        ("cut.glb", "cut short"),
        ("malformed.gltf", "malformed.gltf:2:"),
        ("draco.gltf", "compressed by KHR_draco"),
        ("points.gltf", "points"),
    ];
    for (mesh, part) in cases {
        refused(&desk, &format!("clay: [Mesh(path: \"{mesh}\", height: 0.03)], cell_width: 0.003"), &[mesh, part]);
    }
}

#[test]
fn bad_scenes_are_named() {
    let desk = Desk::new();
    let values = |young: &str, nu: &str| {
        format!("material: Values(density: 1700, young_modulus: {young}, poisson_ratio: {nu}, yield_stress: 8000)")
    };
    let cases = [
        ("outputs: (surface: \"x.fbx\")".into(), "outputs.surface = x.fbx: must end in "),
        ("outputs: (export: (simplify: -1))".into(), "outputs: simplify = -1"),
        (values("-1", "0.4"), "young_modulus"),
        (values("1e5", "0.5"), "poisson_ratio"),
        ("time_step: 0".into(), "time_step"),
        ("\ncolour: 3".into(), "scene.ron:2:"),
        (
            "outputs: (surface: \"particles.ply\")".into(),
            "outputs.surface = particles.ply: must be another file than the particles'",
        ),
        ("outputs: (surface: \"Particles.PLY\")".into(), "outputs.surface = Particles.PLY: must be another file"),
        ("outputs: (surface: \"particles.ply\", particles: false), frame_time: 0".into(), "frame_time = 0"),
    ];
    for (field, part) in cases {
        refused(&desk, &format!("{BLOCK}, {field}"), &["scene.ron", part]);
    }
    refused(&desk, "clay: [Box(size: (0.02, 0.0002, 0.02))], cell_width: 0.01, jitter: 0", &["too thin"]);
    refused(&desk, "clay: [Box(size: (0.02, 0.02, 0.02))], cell_width: 0.0000005", &["iB"]);
    let none = Ran::of(desk.command(BLOCK).current_dir("/"));
    none.ends(2, &["error: scene.ron: "]);
    Ran::of(desk.command(BLOCK).arg("--no-such-thing")).ends(2, &["error: unexpected argument '--no-such-thing' found"]);
    Ran::of(desk.command(BLOCK).args(["--frames", "0"])).ends(2, &["error: invalid value '0' for '--frames <N>'"]);
}

/// Numbers that are finite and senseless are refused by name, with line and bounds; where none of them is
/// senseless by itself, what they ask for together is.
#[test]
fn absurd_values_are_refused_by_name() {
    let desk = Desk::new();
    let material = |field: &str| {
        let fields = ["density: 1700", "young_modulus: 4.4e5", "poisson_ratio: 0.45", "yield_stress: 8e3"];
        let name = field.split(':').next().unwrap_or_default();
        let kept: Vec<_> = fields.into_iter().filter(|f| !f.starts_with(name)).chain([field]).collect();
        format!("\nmaterial: Values({})", kept.join(", "))
    };
    let tool = |shape: &str, keyframes: &str| format!("\ntools: [(name: \"ram\", shape: {shape}, keyframes: [{keyframes}])]");
    let way =
        |place: &str| tool("Sphere(radius: 0.01)", &format!("(time: 0, position: (0, 1, 0)), (time: 0.01, position: {place})"));
    let cases = [
        (material("density: 1e308"), "density = 1e308: must be finite and positive, 1e-3 to 1e18 kg/m^3"),
        (material("density: 1e-300"), "density = 1e-300"),
        (material("young_modulus: 1e308"), "young_modulus = 1e308"),
        (material("yield_stress: 1e300"), "yield_stress = 1e300"),
        (material("viscosity: 1e300"), "viscosity = 1e300"),
        (material("hardening_modulus: 1e300"), "hardening_modulus = 1e300"),
        (material("law: Worked(loss: 0.5, rate: 1e300, rest_time: 1)"), "rate = 1e300"),
        ("\nsoftening_length: 1e300".into(), "softening_length = 1e300"),
        ("\ngravity: (0, -1e30, 0)".into(), "gravity = [0, -1"),
        ("\nframe_time: 1e300".into(), "frame_time = 1e300"),
        ("\nframe_time: 1e-10".into(), "gives 5.000e8 frames"),
        ("\ntime_step: 1e-300".into(), "time_step = 1e-300"),
        ("\ntime_step: 1e-11".into(), "frame_time = 0.016666666666666666: is too long a frame"),
        ("\ndomain: (low: (0, 0, 0), high: (1e30, 1, 1))".into(), "domain.high = "),
        (way("(1e30, 0, 0)"), "tools[0]: keyframes.position = "),
        (way("(0, 9000, 0)"), "tools[0]: keyframes.speed = 899900: "),
        (tool("Sphere(radius: 1e30)", "(time: 0, position: (0, 1, 0))"), "radius = 1e30"),
        (tool("Sphere(radius: 1)", "(time: 1e300, position: (0, 1, 0))"), "keyframes.time = 1e300"),
        (
            tool("Sphere(radius: 1)", "(time: 0, position: (0, 1, 0), rotation: (axis: (1, 0, 0), degrees: 1e300))"),
            "rotation.degrees = 1e300",
        ),
        (
            tool("Sphere(radius: 1)", "(time: 0, position: (0, 1, 0))")
                .replace("shape", "contact: Separate(friction: 1e300), shape"),
            "friction = 1e300",
        ),
    ];
    for (field, part) in cases {
        refused(&desk, &format!("{BLOCK}, {field}"), &["scene.ron", part]);
    }
    refused(&desk, &BLOCK.replace("duration: 0.05", "duration: 1e300"), &["scene.ron:1:", "duration = 1e300"]);
    refused(&desk, &BLOCK.replace("cell_width: 0.005", "cell_width: 1e300"), &["scene.ron:1:", "cell_width = 1e300"]);
    refused(&desk, &BLOCK.replace("0.01, 0.01, 0.01", "1e300, 1, 1"), &["scene.ron:1:", "size = 1e300"]);
    let slow = BLOCK.replace("duration: 0.05", "duration: 1000, frame_time: 100, gravity: (0, 0, 0), material: Values(density: 1700, young_modulus: 10, poisson_ratio: 0.3, yield_stress: 8)");
    let fast = way("(0, 21, 0)");
    refused(
        &desk,
        &format!("{slow}, {fast}"),
        &["keyframes.speed = 2.000e3 m/s of tools[0] (ram): is too fast for frames of 100 s"],
    );
    desk.write("cube.obj", &cube_obj(&[]));
    refused(&desk, "clay: [Mesh(path: \"cube.obj\", scale: 1e8)], cell_width: 1", &["cube.obj: scaled and in place reaches to "]);
}

/// However long an identifier or a text is, and with line breaks in it, a message is one line; and it names
/// the field where RON gives none.
#[test]
fn messages_are_one_short_line() {
    let desk = Desk::new();
    let long = "x".repeat(10_000);
    for field in [
        format!("{long}: 3"),
        format!("material: Preset({long})"),
        format!("material: {long}(3)"),
        format!("material: File(\"{}\\n{long}\")", "a".repeat(200)),
        format!("outputs: (surface: \"{long}.fbx\")"),
        "outputs: (surface: \"a\\nb.fbx\")".into(),
        "outputs: (surface: \"a\\nb.stl\")".into(),
        format!("tools: [(name: \"{long}\\n\", shape: Sphere(radius: 1), keyframes: [])]"),
    ] {
        refused(&desk, &format!("{BLOCK}, {field}"), &["scene.ron"]);
    }
    refused(&desk, "clay: [Mesh(path: \"a\\nb.obj\")], cell_width: 0.1", &["a b.obj: "]);
    desk.write("long.clay.ron", &format!("(law: {long})"));
    refused(&desk, &format!("{BLOCK}, material: File(\"long.clay.ron\")"), &["long.clay.ron:1:", "law: `xxx"]);
    // Nor what comes from the command line.
    let at = |arguments: &[&str]| Ran::of(desk.command(BLOCK).args(arguments));
    at(&["--pictures", &long]).ends(2, &["error: invalid value 'xxx"]);
    desk.write("a", "a file");
    at(&["--record", &format!("no/such/{long}")]).ends(2, &["error: no/such/xxx"]);
    let replayed = |place: &str| Ran::of(Command::new(&*HEADLESS).current_dir(desk.at("")).args(["--replay", place]));
    for place in [&long, "x\ny"] {
        let mut command = Command::new(&*HEADLESS);
        let out = Ran::of(command.current_dir(desk.at("")).args(["scene.ron", "--out", &format!("a/{place}")]));
        let replay = replayed(place);
        out.ends(2, &["error: a/x"]);
        replay.ends(2, &["error: x"]);
        assert!(out.error.len() < 400 && replay.error.len() < 400, "{out:?} {replay:?}");
    }
    std::fs::create_dir_all(desk.at("x\ny/metrics.csv")).expect("folder");
    let mut command = Command::new(&*HEADLESS);
    let ran = Ran::of(command.current_dir(desk.at("")).args(["scene.ron", "--out", "x\ny"]));
    ran.ends(2, &["error: x y/metrics.csv: cannot be written: is a directory"]);
    let cases = [
        ("frame_time: \"abc\"", "scene.ron:1:", "frame_time: "),
        ("\nseed: -1", "scene.ron:2:", "seed = -1"),
        ("\nwalls: (low: (Slip, 3, Slip))", "scene.ron:2:", "walls.low[1]: "),
        (
            "\ntools: [(shape: Sphere(radius: 1), keyframes: [(time: 0, position: (0, \"b\", 0))])]",
            "scene.ron:2:",
            "tools[0].keyframes[0].position[1]: ",
        ),
        (
            "\ntools: [(shape: Sphere(radius: -1), keyframes: [(time: 0, position: (0, 1, 0))])]",
            "scene.ron:2:",
            "tools[0]: radius = -1",
        ),
    ];
    for (field, place, name) in cases {
        refused(&desk, &format!("{BLOCK}, {field}"), &[place, name]);
    }
}

#[test]
fn bad_clays_are_named() {
    let desk = Desk::new();
    refused(&desk, &format!("{BLOCK}, material: File(\"no_such.clay.ron\")"), &["scene.ron: material = ", "no_such.clay.ron"]);
    let cases = [
        ("unit", "(\n  density: \"3 kPa\")", "unit.clay.ron:2:3: density"),
        ("value", "(yield_stress: \"-3 kPa\")", "value.clay.ron:1:2: yield_stress"),
        ("huge", "(density: 1e308)", "huge.clay.ron:1:2: density = 1e308"),
        ("base", "(extends: \"no_such.clay.ron\")", "base.clay.ron:1:2: extends"),
        ("circle", "(extends: \"circle.clay.ron\")", "circle.clay.ron:1:2: extends"),
        ("law", "(law: Melted)", "law.clay.ron:1:"),
    ];
    for (name, text, part) in cases {
        desk.write(&format!("{name}.clay.ron"), text);
        refused(&desk, &format!("{BLOCK}, material: File(\"{name}.clay.ron\")"), &[part]);
    }
}

/// An unknown key of a clay file is a warning, and so is an open mesh.
#[test]
fn odd_input_works_with_a_warning() {
    let desk = Desk::new();
    desk.write("odd.clay.ron", "(\n  yeild_stress: \"9 kPa\")");
    let ran = desk.run(&format!("{BLOCK}, material: File(\"odd.clay.ron\")"));
    ran.ends(0, &["warning: odd.clay.ron:2:3: unknown key `yeild_stress` is left out; did you mean `yield_stress`?"]);
    let bunny = std::fs::read_to_string(bunny()).expect("bunny");
    let lines: Vec<&str> = bunny.lines().filter(|line| !line.starts_with("f 1 ")).collect();
    desk.write("open.obj", &lines[..lines.len() - 20].join("\n"));
    let ran = desk.run("clay: [Mesh(path: \"open.obj\", height: 0.03)], cell_width: 0.003, duration: 0.01");
    ran.ends(0, &["warning: open.obj: the mesh is open: "]);
}
