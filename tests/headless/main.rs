//! The example `headless` as a process of its own: what it does where standard output is closed, a disk is
//! full, a scene is bad, a run fails midway or is interrupted, and that its results are kept.
#![cfg(unix)]

mod hand;
mod input;
mod places;
mod replay;
mod tally;

use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::LazyLock;
use tempfile::TempDir;

/// The executable: built with the features and the profile of this test, into the same folder.
static HEADLESS: LazyLock<PathBuf> = LazyLock::new(|| {
    let test = std::env::current_exe().expect("this test's own path");
    let profile = test.ancestors().nth(2).expect("the folder of a profile");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(env!("CARGO_MANIFEST_DIR")).args(["build", "--quiet", "--example", "headless"]);
    cargo.arg("--target-dir").arg(profile.parent().expect("the target folder"));
    if !cfg!(feature = "inspector") {
        cargo.arg("--no-default-features");
    }
    // Members that are built together share their features: of this package alone the crate would be compiled
    // anew.
    if !cfg!(feature = "reference") {
        cargo.args(["-p", env!("CARGO_PKG_NAME")]);
    }
    if !cfg!(debug_assertions) {
        cargo.arg("--release");
    }
    assert!(cargo.status().expect("cargo").success(), "the example does not build");
    profile.join("examples/headless")
});

/// A block of 64 particles that rests; three frames.
const BLOCK: &str = "clay: [Box(size: (0.01, 0.01, 0.01))], cell_width: 0.005, duration: 0.05";

/// A folder with scenes and results.
struct Desk(TempDir);

impl Desk {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("folder"))
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A file with this text.
    fn write(&self, name: &str, text: &str) -> PathBuf {
        std::fs::write(self.at(name), text).expect("file");
        self.at(name)
    }

    /// `headless SCENE --out OUT`, both in this folder, with `scene` for the fields of the scene.
    fn command(&self, scene: &str) -> Command {
        self.write("scene.ron", &format!("({scene})"));
        let mut command = Command::new(&*HEADLESS);
        command.current_dir(self.0.path()).args(["scene.ron", "--out", "out"]);
        command
    }

    /// The same command after words of a shell, such as a limit.
    fn command_after(&self, words: &str, scene: &str) -> Command {
        let command = self.command(scene);
        let mut shell = Command::new("sh");
        shell.current_dir(self.0.path()).arg("-c").arg(format!("{words}; exec \"$@\"")).arg("sh");
        shell.arg(command.get_program()).args(command.get_args());
        shell
    }

    fn run(&self, scene: &str) -> Ran {
        Ran::of(&mut self.command(scene))
    }

    /// The summary of the last run.
    fn summary(&self) -> Value {
        let text = std::fs::read_to_string(self.at("out/summary.json")).expect("a summary");
        serde_json::from_str(&text).expect("a summary in JSON")
    }

    /// The names of the results, sorted.
    fn results(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.at("out")).expect("results");
        let mut names: Vec<String> = entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

/// What a process said and how it ended.
#[derive(Debug)]
struct Ran {
    code: Option<i32>,
    out: String,
    error: String,
}

impl Ran {
    fn of(command: &mut Command) -> Self {
        let Output { status, stdout, stderr } = command.stdin(Stdio::null()).output().expect("headless starts");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
        Self { code: status.code(), out: text(stdout), error: text(stderr) }
    }

    /// Checks exit code and standard error: as many lines as parts, each with its part.
    #[track_caller]
    fn ends(&self, code: i32, parts: &[&str]) {
        let lines: Vec<&str> = self.error.lines().collect();
        let fits = lines.len() == parts.len() && lines.iter().zip(parts).all(|(line, part)| line.contains(part));
        assert!(self.code == Some(code) && fits, "exit code {code} and {parts:?} expected of {self:?}");
    }
}

/// A process under way, killed when a test fails.
struct UnderWay(Child);

impl UnderWay {
    fn of(command: &mut Command) -> Self {
        Self(command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("headless starts"))
    }

    /// Waits for the first line on standard output: the run has begun.
    fn begun(&mut self) -> BufReader<std::process::ChildStdout> {
        let mut out = BufReader::new(self.0.stdout.take().expect("a pipe"));
        let mut line = String::new();
        out.read_line(&mut line).expect("a line");
        assert!(line.contains("particles"), "{line}");
        out
    }

    fn signal(&self, name: &str) {
        let status = Command::new("kill").args([name, &self.0.id().to_string()]).status().expect("kill");
        assert!(status.success(), "the process is gone");
    }
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        // Ended already if the test went well.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

const RESULTS: [&str; 4] = ["metrics.csv", "particles.ply", "summary.json", "surface.stl"];

/// The summary names version, frames, how the run ended and the exit code; what is not watched in a terminal
/// says now and then how far it is.
#[test]
fn whole_run_ends_with_0_and_a_summary() {
    let desk = Desk::new();
    let ran = desk.run(&format!("{BLOCK}, frame_time: 0.0025"));
    ran.ends(0, &[]);
    assert_eq!(desk.results(), RESULTS);
    let summary = desk.summary();
    assert_eq!(summary["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(summary["frames"], serde_json::json!({"planned": 20, "run": 20}));
    assert_eq!((&summary["exit_status"], &summary["ended"]), (&0.into(), &"with its last frame".into()));
    let lines = ran.out.lines().filter(|line| line.starts_with("frame ")).count();
    assert!((10..=20).contains(&lines), "a line for each tenth of the run: {}", ran.out);
    assert!(ran.out.contains("frame 2 of 20,") && ran.out.contains("frame 20 of 20,"), "{}", ran.out);
}

/// Files, units and exit codes are told, and so is the version.
#[test]
fn help_and_version_are_told() {
    let said = |argument: &str| Ran::of(Command::new(&*HEADLESS).arg(argument));
    let version = said("--version");
    assert_eq!((version.code, version.out.trim()), (Some(0), concat!("headless ", env!("CARGO_PKG_VERSION"))));
    for argument in ["--help", "-h"] {
        let help = said(argument);
        let parts = [
            "--record <FILE>",
            "--replay <FILE>",
            "summary.json",
            "metrics.csv",
            "millimetres",
            "Exit codes:",
            "\n  2  ",
            "\n  130  ",
        ];
        assert!(help.code == Some(0) && parts.iter().all(|part| help.out.contains(part)), "{help:?}");
    }
}

/// A reader that has had enough, as `head` has.
#[test]
fn results_outlive_a_reader_that_leaves() {
    let desk = Desk::new();
    let mut process = UnderWay::of(&mut desk.command(&format!("{BLOCK}, frame_time: 0.0005")));
    drop(process.begun());
    let mut error = String::new();
    process.0.stderr.take().expect("a pipe").read_to_string(&mut error).expect("text");
    assert_eq!((process.0.wait().expect("ended").code(), error.as_str()), (Some(0), ""));
    assert_eq!((desk.results().as_slice(), &desk.summary()["exit_status"]), (&RESULTS.map(String::from)[..], &0.into()));
}

/// A full disk behind standard output, and behind standard error too.
#[test]
#[cfg(target_os = "linux")]
fn results_outlive_a_full_standard_output() {
    let desk = Desk::new();
    let full = || std::fs::File::create("/dev/full").expect("/dev/full");
    let output = desk.command(BLOCK).stdin(Stdio::null()).stdout(full()).output().expect("headless starts");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(0) && error.starts_with("warning: standard output takes no more lines"), "{error}");
    assert!(error.lines().count() == 1 && desk.results() == RESULTS, "{error}");
    let both = Desk::new();
    let status = both.command(BLOCK).stdin(Stdio::null()).stdout(full()).stderr(full()).status().expect("headless starts");
    assert_eq!((status.code(), both.results().as_slice()), (Some(0), &RESULTS.map(String::from)[..]));
}

/// A file that outgrows its disk (here a limit on its size) takes neither the metrics nor the summary with
/// it, and is said.
#[test]
fn full_disk_costs_one_file() {
    let desk = Desk::new();
    // In units of 512 or 1024 bytes: 4 to 8 KiB hold the summary and the metrics, and not the surface.
    let mut limited = desk.command_after("trap '' XFSZ; ulimit -f 8", BLOCK);
    Ran::of(&mut limited).ends(1, &["error: out/surface.stl: cannot be written: "]);
    assert_eq!(desk.results(), ["metrics.csv", "particles.ply", "summary.json"]);
    let summary = desk.summary();
    assert_eq!((&summary["exit_status"], &summary["frames"]["run"]), (&1.into(), &3.into()));
    assert!(summary["faults"][0].as_str().is_some_and(|fault| fault.contains("surface.stl")), "{summary}");
}

/// A run that is killed while it writes (by the limit of the test above) leaves a file behind, and no summary
/// that looks healthy; the next run removes the file.
#[test]
fn leftovers_of_a_killed_run_go_with_the_next() {
    let desk = Desk::new();
    desk.run(BLOCK).ends(0, &[]);
    let killed = Ran::of(&mut desk.command_after("ulimit -f 8", BLOCK));
    let left = desk.results().into_iter().filter(|name| name.ends_with(".tmp")).count();
    assert_eq!((killed.code, left), (None, 1), "{killed:?}");
    let summary = desk.summary();
    assert_eq!((&summary["ended"], &summary["exit_status"]), (&"not yet, or the run was killed".into(), &Value::Null));
    let next = desk.run(BLOCK);
    next.ends(0, &[]);
    assert!(next.out.contains("removed 1 unfinished file(s)"), "{}", next.out);
    assert_eq!(desk.results(), RESULTS);
}

/// Clay under a law that is unstable once its tool has left: the frame is given up, and the message names
/// scene, frame and tool. What there was is kept, and the summary of a healthy run before does not stay.
#[test]
fn run_that_fails_midway_keeps_what_it_has() {
    let desk = Desk::new();
    desk.run(BLOCK).ends(0, &[]);
    let tool = "(name: \"ram\", shape: Sphere(radius: 0.01), keyframes: [(time: 0, position: (0, 0.0151, 0)), (time: 0.05, position: (0, 0.0149, 0)), \
        (time: 0.15, position: (0, 0.1, 0))])";
    let law = "density: 1700, young_modulus: 4.4e5, poisson_ratio: 0.45, yield_stress: 8e3, softening_length: 0.002, law: AsPublishedDefaultD";
    let scene = format!(
        "clay: [Box(size: (0.01, 0.01, 0.01))], cell_width: 0.005, duration: 0.2, integrator: Explicit, gravity: (0, 0, 0), material: Values({law}), tools: [{tool}]"
    );
    let ran = desk.run(&scene);
    ran.ends(1, &["error: scene.ron: frame 3, from 0.050000 s: "]);
    let parts = ["the frame was given up", "the fastest tool is tools[0] (ram), whose keyframes give 8.510e-1 m/s"];
    assert!(parts.iter().all(|part| ran.error.contains(part)), "{}", ran.error);
    assert_eq!(desk.results(), RESULTS);
    let summary = desk.summary();
    assert_eq!((&summary["exit_status"], &summary["ended"]), (&1.into(), &"early".into()));
    assert_eq!(summary["frames"], serde_json::json!({"planned": 12, "run": 3}));
    assert_eq!(summary["faults"][0], ran.error.trim_start_matches("error: ").trim_end());
    let metrics = std::fs::read_to_string(desk.at("out/metrics.csv")).expect("metrics");
    assert_eq!(metrics.lines().count(), 5, "a header, three frames and the one that was given up");
}

/// Ctrl+C: what there is so far is written.
#[test]
fn interrupted_run_writes_what_there_is() {
    let desk = Desk::new();
    let mut process = UnderWay::of(&mut desk.command(&BLOCK.replace("duration: 0.05", "duration: 500")));
    let mut out = process.begun();
    process.signal("-INT");
    let mut rest = String::new();
    out.read_to_string(&mut rest).expect("text");
    assert_eq!(process.0.wait().expect("ended").code(), Some(130));
    assert!(rest.contains("interrupted after "), "{rest}");
    assert_eq!(desk.results(), RESULTS);
    let summary = desk.summary();
    assert_eq!((&summary["exit_status"], &summary["ended"]), (&130.into(), &"interrupted".into()));
    assert!(summary["frames"]["run"].as_u64() < summary["frames"]["planned"].as_u64(), "{summary}");
}

/// A second Ctrl+C does not wait for the frame under way, which here takes minutes.
#[test]
fn second_interrupt_ends_at_once() {
    let desk = Desk::new();
    let mut process =
        UnderWay::of(&mut desk.command(&BLOCK.replace("duration: 0.05", "duration: 600, frame_time: 600, gravity: (0, 0, 0)")));
    let _out = process.begun();
    let mut error = BufReader::new(process.0.stderr.take().expect("a pipe"));
    process.signal("-INT");
    let mut line = String::new();
    error.read_line(&mut line).expect("a line");
    assert!(line.starts_with("warning: interrupted: the frame or picture under way ends"), "{line}");
    process.signal("-INT");
    assert_eq!(process.0.wait().expect("ended").code(), Some(130));
    assert_eq!(desk.summary()["ended"], "not yet, or the run was killed");
}

/// Healthy clay that is coarse is well: the check of the surface's volume knows that cells round what is
/// curved.
#[test]
fn coarse_torus_is_well() {
    let desk = Desk::new();
    desk.write("torus.obj", &input::torus_obj(0.03, 0.01));
    for (cell_width, count) in [("0.0057", 2_800..3_200), ("0.004", 8_000..8_600)] {
        let scene = format!("clay: [Mesh(path: \"torus.obj\")], cell_width: {cell_width}, duration: 0.02");
        desk.run(&scene).ends(0, &[]);
        let summary = desk.summary();
        assert!(summary["particles"].as_u64().is_some_and(|n| count.contains(&n)), "{summary}");
        assert_eq!(summary["surface"]["closed_manifold"], true);
    }
}

/// Crushed clay is not well however few its cells are: its surface cannot be smaller than they. Nor is clay
/// whose stretch was clamped, which the checks of volume alone would let pass where it swells again.
#[test]
fn crushed_clay_is_a_fault() {
    let desk = Desk::new();
    let clay = |density: f64, young: f64, gravity: f64| {
        let values = format!("Values(density: {density}, young_modulus: {young}, poisson_ratio: 0.3, yield_stress: 10)");
        desk.run(&format!(
            "{}, gravity: (0, -{gravity}, 0), integrator: Explicit, material: {values}",
            BLOCK.replace("0.05", "0.2")
        ))
    };
    let volume = "check failed: the surface encloses ";
    clay(1700.0, 1e3, 1500.0).ends(1, &[volume]);
    let summary = desk.summary();
    assert!(summary["J"][0].as_f64().is_some_and(|least| least < 0.01), "{summary}");
    assert_eq!((&summary["surface"]["volume_error_max"], &summary["exit_status"]), (&0.3.into(), &1.into()));
    clay(1e18, 1e-3, 9.81).ends(1, &["check failed: a particle's stretch was clamped to 0.05 .. 20", volume]);
}

/// A closed cube with a triangle given twice has no hole, and its volume is its own.
#[test]
fn doubled_triangle_is_no_hole() {
    let desk = Desk::new();
    desk.write("cube.obj", &input::cube_obj(&["1 3 2", "2 6 1"]));
    let ran = desk.run("clay: [Mesh(path: \"cube.obj\", height: 0.02)], cell_width: 0.005, duration: 0.01");
    ran.ends(0, &["warning: cube.obj: 2 triangle(s) are given more than once; each counts once"]);
    let volume = desk.summary()["rest_volume_m3"].as_f64().expect("a volume");
    assert!((volume / 8e-6 - 1.0).abs() < 1e-6, "{volume}");
}

/// A triangle given again the other way round is told as what makes the hole.
#[test]
fn reversed_triangle_is_told() {
    let desk = Desk::new();
    desk.write("cube.obj", &input::cube_obj(&["1 2 3"]));
    let ran = desk.run("clay: [Mesh(path: \"cube.obj\", height: 0.02)], cell_width: 0.005, duration: 0.01");
    ran.ends(0, &["warning: cube.obj: the mesh is open: 3 open edges around 1 hole(s), "]);
    assert!(ran.error.contains("; 1 triangle(s) are given again facing the other way, and the two cancel; "), "{ran:?}");
    desk.write("cube.obj", &input::cube_obj(&[]).replace("f 1 3 2\n", ""));
    let ran = desk.run("clay: [Mesh(path: \"cube.obj\", height: 0.02)], cell_width: 0.005, duration: 0.01");
    ran.ends(0, &["warning: cube.obj: the mesh is open: 3 open edges around 1 hole(s), "]);
    assert!(!ran.error.contains("facing the other way"), "{ran:?}");
}

/// What does not end is refused like what is too long.
#[test]
#[cfg(target_os = "linux")]
fn input_without_end_is_refused() {
    let zero = |arguments: &[&str], desk: &Desk| Ran::of(Command::new(&*HEADLESS).current_dir(desk.0.path()).args(arguments));
    let desk = Desk::new();
    zero(&["/dev/zero", "--out", "out"], &desk).ends(2, &["/dev/zero: is longer than 16 MiB, the most that a scene may have"]);
    for name in ["zero.obj", "zero.clay.ron"] {
        std::os::unix::fs::symlink("/dev/zero", desk.at(name)).expect("a link");
    }
    desk.run("clay: [Mesh(path: \"zero.obj\")], cell_width: 0.005")
        .ends(2, &["zero.obj: is longer than 512 MiB, the most that a mesh may have"]);
    desk.run(&format!("{BLOCK}, material: File(\"zero.clay.ron\")"))
        .ends(2, &["zero.clay.ron: is longer than 1 MiB, the most that a clay may have"]);
    assert!(!Path::new(&desk.at("out")).exists());
}
