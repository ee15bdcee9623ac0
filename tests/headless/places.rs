//! Where results and recordings go: nothing is written over what a run reads or writes itself, and what
//! cannot be written is told before the first frame, without a trace.

use crate::{BLOCK, Desk, HEADLESS, Ran, input};
use std::os::unix::fs::symlink;
use std::process::Command;

/// `headless scene.ron` with `arguments`, in the desk's folder.
fn run(desk: &Desk, scene: &str, arguments: &[&str]) -> Ran {
    desk.write("scene.ron", &format!("({scene})"));
    Ran::of(Command::new(&*HEADLESS).current_dir(desk.at("")).arg("scene.ron").args(arguments))
}

/// What a file and a link of this name hold.
fn text(desk: &Desk, name: &str) -> String {
    std::fs::read_to_string(desk.at(name)).expect("a file")
}

/// A name that is too long, a folder in a file's place, a folder that cannot be made: told before a frame is
/// run, and nothing is left or lost.
#[test]
fn places_that_take_no_file_are_refused_before_the_run() {
    let desk = Desk::new();
    let long = format!("{BLOCK}, outputs: (surface: \"{}.stl\")", "n".repeat(300));
    desk.run(&long).ends(2, &["nnn...: cannot be written: "]);
    assert!(!desk.at("out").exists());
    std::fs::create_dir_all(desk.at("out/metrics.csv")).expect("folder");
    desk.run(BLOCK).ends(2, &["error: out/metrics.csv: cannot be written: is a directory"]);
    assert_eq!(desk.results(), ["metrics.csv"]);
    let mut nowhere = Command::new(&*HEADLESS);
    nowhere.current_dir(desk.0.path()).args(["scene.ron", "--out", "/dev/null/x"]);
    Ran::of(&mut nowhere).ends(2, &["/dev/null/x: the output folder cannot be made: "]);
}

/// The results of a run in the folder of its mesh do not take the mesh's place.
#[test]
fn input_is_not_overwritten() {
    let desk = Desk::new();
    let mesh = input::cube_obj(&[]);
    desk.write("cube.obj", &mesh);
    desk.write(
        "scene.ron",
        "(clay: [Mesh(path: \"cube.obj\", height: 0.02)], cell_width: 0.005, duration: 0.01, outputs: (surface: \"cube.obj\"))",
    );
    let mut command = Command::new(&*HEADLESS);
    command.current_dir(desk.0.path()).args(["scene.ron", "--out", "."]);
    Ran::of(&mut command).ends(2, &["./cube.obj: is an input of this run and would be overwritten"]);
    assert_eq!(std::fs::read_to_string(desk.at("cube.obj")).expect("mesh"), mesh);
}

/// Bodies in files of their own take every place of their kind of name, however many there will be.
#[test]
fn bodies_apart_take_no_input_s_place() {
    let desk = Desk::new();
    let mesh = input::cube_obj(&[]);
    desk.write("part-2.obj", &mesh);
    let scene = |clay: &str| {
        let bodies = format!("{clay}, Box(size: (0.02, 0.02, 0.02), center: (0.1, 0.01, 0))");
        format!("clay: [{bodies}], cell_width: 0.005, duration: 0.01, outputs: (surface: \"part.obj\", export: (bodies: Apart))")
    };
    let read = scene("Mesh(path: \"part-2.obj\", height: 0.02)");
    run(&desk, &read, &["--out", "."]).ends(2, &["./part-2.obj: is an input of this run and would be overwritten"]);
    assert_eq!(text(&desk, "part-2.obj"), mesh);
    // Names that are like theirs and none of them.
    for name in ["part-02.obj", "part-0.obj", "part-two.obj", "part.obj"] {
        desk.write(name, &mesh);
        run(&desk, &read.replace("part-2.obj", name), &["--out", "."]).ends(0, &[]);
        assert_eq!(text(&desk, name), mesh);
    }
    let record = run(&desk, &scene("Box(size: (0.02, 0.02, 0.02))"), &["--out", "out", "--record", "out/part-2.obj"]);
    record.ends(2, &["out/part-2.obj: is a result of this run and would be overwritten by its recording"]);
}

/// The tenth body's name is too long for a file: it alone is lost, and the summary names the others.
#[test]
fn body_that_cannot_be_written_costs_no_other() {
    let desk = Desk::new();
    let boxes: Vec<_> =
        (0..10).map(|i| format!("Box(size: (0.01, 0.01, 0.01), center: ({}, 0, 0))", 0.03 * f64::from(i))).collect();
    let stem = "n".repeat(249);
    let scene = format!(
        "clay: [{}], cell_width: 0.005, duration: 0.01, outputs: (surface: \"{stem}.stl\", export: (bodies: Apart))",
        boxes.join(", ")
    );
    run(&desk, &scene, &[]).ends(1, &[&format!("error: out/{stem}-10.stl: cannot be written: ")]);
    let surface = &desk.summary()["surface"];
    let names: Vec<_> = (1..10).map(|number| format!("{stem}-{number}.stl")).collect();
    assert_eq!(surface["files"], serde_json::json!(names));
    assert_eq!(surface["bodies_cm3"].as_array().map(Vec::len), Some(9));
    assert!(names.iter().all(|name| desk.at("out").join(name).exists()));
}

/// A run's inputs are all the files that were read: those that its clay extends, and the numbers of its glTF
/// mesh.
#[test]
fn recording_takes_no_input_s_place() {
    let desk = Desk::new();
    desk.write("base.clay.ron", "(density: 1600)");
    desk.write("my.clay.ron", "(extends: \"base.clay.ron\")");
    symlink(desk.at("base.clay.ron"), desk.at("link")).expect("a link");
    let corners = [[0f32, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]];
    let indices = [0u32, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    let numbers: Vec<u8> =
        corners.iter().flatten().flat_map(|x| x.to_le_bytes()).chain(indices.iter().flat_map(|i| i.to_le_bytes())).collect();
    std::fs::write(desk.at("numbers.bin"), &numbers).expect("file");
    desk.write(
        "mesh.gltf",
        r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "buffers": [{"uri": "numbers.bin", "byteLength": 96}],
            "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 48}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}, {"bufferView": 1, "componentType": 5125, "count": 12, "type": "SCALAR"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}]}"#,
    );
    let scene = "clay: [Mesh(path: \"mesh.gltf\")], cell_width: 0.002, duration: 0.01, material: File(\"my.clay.ron\")";
    for record in ["scene.ron", "my.clay.ron", "base.clay.ron", "link", "mesh.gltf", "numbers.bin", "./out/../numbers.bin"] {
        let ran = run(&desk, scene, &["--record", record]);
        ran.ends(2, &[&format!("{record}: is an input of this run and would be overwritten")]);
        assert!(!desk.at("out").exists(), "{record}");
    }
    assert_eq!(
        (std::fs::read(desk.at("numbers.bin")).ok(), text(&desk, "base.clay.ron")),
        (Some(numbers), "(density: 1600)".into())
    );
    run(&desk, scene, &["--record", "run.clayrun"]).ends(0, &[]);
}

/// A place that takes no recording, and one that is a result's by any way, are told before a frame is run.
#[test]
fn recording_takes_no_result_s_place() {
    let desk = Desk::new();
    let at = |out: &str, place: &str| run(&desk, BLOCK, &["--out", out, "--pictures", "1", "--record", place]);
    at("out", "no/such/run.clayrun").ends(2, &["error: no/such/run.clayrun: cannot be written: "]);
    std::fs::create_dir(desk.at("real")).expect("folder");
    symlink("real", desk.at("link")).expect("a link");
    for (out, place) in [
        ("out", "out/surface.stl"),
        ("out", "out/../out/surface.stl"),
        ("out", "out/frame_0003.png"),
        ("link", "real/metrics.csv"),
        ("real", "link/summary.json"),
    ] {
        let refusal = format!("error: {place}: is a result of this run and would be overwritten by its recording");
        at(out, place).ends(2, &[&refusal]);
    }
    assert!(!desk.at("out").exists() && std::fs::read_dir(desk.at("real")).expect("folder").count() == 0);
}

/// A refusal leaves no folder that was made for the run, and no part of a recording.
#[test]
fn refusal_leaves_no_trace() {
    let desk = Desk::new();
    let long = format!("{BLOCK}, outputs: (surface: \"{}.stl\")", "n".repeat(300));
    run(&desk, &long, &["--out", "a/b/c"]).ends(2, &["nnn"]);
    assert!(!desk.at("a").exists());
    run(&desk, BLOCK, &["--out", &format!("a/b/{}", "n".repeat(300))]).ends(2, &["the output folder cannot be made: "]);
    assert!(!desk.at("a").exists());
    // The limit ends the file within the clay.
    let mut limited = desk.command_after("trap '' XFSZ; ulimit -f 2", BLOCK);
    Ran::of(limited.args(["--record", "run.clayrun"])).ends(2, &["error: run.clayrun: "]);
    assert!(!desk.at("out").exists() && !desk.at("run.clayrun").exists());
}

/// A folder in the place of a picture that was asked for.
#[test]
fn picture_s_place_is_tried_before_the_run() {
    let desk = Desk::new();
    std::fs::create_dir_all(desk.at("out/frame_0003.png")).expect("folder");
    run(&desk, BLOCK, &["--pictures", "1"]).ends(2, &["error: out/frame_0003.png: cannot be written: is a directory"]);
    assert_eq!(desk.results(), ["frame_0003.png"]);
    // No one missed these.
    run(&desk, BLOCK, &["--pictures", "0"]).ends(0, &[]);
}
