//! The programs as processes: what they do where standard output is full or closed, or where a result cannot
//! be written.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

const VALIDATE: &str = env!("CARGO_BIN_EXE_validate");
const CHART: &str = env!("CARGO_BIN_EXE_chart");
/// A case of some milliseconds, of three rows.
const CASE: [&str; 4] = ["physics", "--quick", "--only", "free fall"];

/// A folder with results.
struct Desk(TempDir);

impl Desk {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("folder"))
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// What the programs read and write of the documents, in a folder `docs`.
    fn with_docs() -> Self {
        let desk = Self::new();
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
        for folder in ["docs/data", "docs/images"] {
            fs::create_dir_all(desk.at(folder)).expect("folder");
        }
        for file in ["EVIDENCE.md", "data/acceptance.json", "data/commands.json", "data/chart.json"] {
            fs::copy(docs.join(file), desk.at("docs").join(file)).expect(file);
        }
        desk
    }

    fn command(&self, program: &str, arguments: &[&str]) -> Command {
        let mut command = Command::new(program);
        command.current_dir(self.0.path()).stdin(Stdio::null()).args(arguments);
        command
    }

    /// The case, with `arguments` besides.
    fn run(&self, arguments: &[&str]) -> Output {
        self.command(VALIDATE, &CASE).args(arguments).output().expect("validate starts")
    }

    /// How many rows the file `rows.json` holds.
    #[track_caller]
    fn rows(&self) -> usize {
        let text = fs::read_to_string(self.at("rows.json")).expect("rows.json");
        serde_json::from_str::<serde_json::Value>(&text).expect("JSON")["rows"].as_array().expect("rows").len()
    }
}

/// The run ended with this exit code, and said these lines on standard error, each as it begins and each with
/// its part.
#[track_caller]
fn ends(output: &Output, code: i32, lines: &[[&str; 2]]) {
    let error = String::from_utf8_lossy(&output.stderr);
    let is_so = |(line, [start, part]): (&str, &[&str; 2])| line.starts_with(start) && line.contains(part);
    assert!(
        output.status.code() == Some(code) && error.lines().count() == lines.len() && error.lines().zip(lines).all(is_so),
        "code {code} and {lines:?} expected of {:?}: {error}",
        output.status
    );
}

/// A full disk behind standard output costs the table alone, and the exit code says so.
#[test]
#[cfg(target_os = "linux")]
fn rows_outlive_a_full_standard_output() {
    let desk = Desk::new();
    let full = || fs::File::create("/dev/full").expect("/dev/full");
    let said = ["error: standard output took no more lines: ", ""];
    let rows = desk.command(VALIDATE, &CASE).args(["--json", "rows.json"]).stdout(full()).output().expect("validate starts");
    ends(&rows, 1, &[said]);
    assert_eq!(desk.rows(), 3);
    let both = Desk::new();
    let mut command = both.command(VALIDATE, &CASE);
    let status = command.args(["--json", "rows.json"]).stdout(full()).stderr(full()).status().expect("validate starts");
    assert_eq!((status.code(), both.rows()), (Some(1), 3));

    let desk = Desk::with_docs();
    let mut chart = desk.command(CHART, &["--redraw", "--docs", "docs", "--out", "out"]);
    ends(&chart.stdout(full()).output().expect("chart starts"), 1, &[said]);
    assert!(desk.at("out/chart.csv").exists() && desk.at("docs/images/chart.png").exists());
}

/// A reader that has had enough, as `head` has.
#[test]
fn rows_outlive_a_reader_that_leaves() {
    let desk = Desk::new();
    let mut command = desk.command(VALIDATE, &CASE);
    let mut process =
        command.args(["--json", "rows.json"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("validate starts");
    let mut line = String::new();
    BufReader::new(process.stdout.take().expect("a pipe")).read_line(&mut line).expect("a line");
    let mut error = String::new();
    process.stderr.take().expect("a pipe").read_to_string(&mut error).expect("text");
    assert_eq!((process.wait().expect("ended").code(), error.as_str(), desk.rows()), (Some(0), "", 3));
}

/// Every place is tried before a case is run: exit code 2, and not a line of the table.
#[test]
fn places_that_take_no_file_are_refused_before_the_run() {
    let desk = Desk::with_docs();
    let refused = |arguments: &[&str], start: &str, part: &str| {
        let output = desk.run(arguments);
        ends(&output, 2, &[[start, part]]);
        assert!(output.stdout.is_empty(), "{arguments:?} ran a case");
    };
    fs::create_dir(desk.at("folder")).expect("folder");
    refused(&["--json", "folder"], "error: --json folder: ", "is a directory");
    refused(&["--json", "no/such.json"], "error: --json no/such.json: ", "cannot be written");
    fs::write(desk.at("file"), "").expect("file");
    refused(&["--dump", "file"], "error: --dump file: ", "exists");
    refused(&["--docs", "folder"], "error: --docs folder/data/acceptance.json: ", "No such file");

    fs::create_dir(desk.at("docs/images/cut_methods.png")).expect("folder");
    refused(&["--docs", "docs"], "error: --docs docs/images/cut_methods.png: ", "is a directory");
    fs::remove_dir(desk.at("docs/images/cut_methods.png")).expect("folder");
    fs::create_dir_all(desk.at("out/chart.png")).expect("folder");
    let chart = desk.command(CHART, &["--smoke", "--out", "out"]).output().expect("chart starts");
    ends(&chart, 2, &[["error: --out out/chart.png: ", "is a directory"]]);
    assert!(chart.stdout.is_empty(), "the chart measured a point");

    let page = fs::read_to_string(desk.at("docs/EVIDENCE.md")).expect("the page");
    for mark in ["<!-- VALIDATE:END -->", "<!-- RESULTS substep:BEGIN -->"] {
        fs::write(desk.at("docs/EVIDENCE.md"), page.replace(mark, "")).expect("the page");
        refused(&["--docs", "docs"], "error: --docs docs/EVIDENCE.md: ", mark.split(":").next().expect("a name"));
    }
}

/// Each result is written for itself, the rows first: what outgrows its disk (here a limit on the size of
/// files) is said, and is no bad argument.
#[test]
fn documents_that_cannot_be_written_cost_themselves_alone() {
    let desk = Desk::with_docs();
    let record = fs::read(desk.at("docs/data/acceptance.json")).expect("the record");
    // In units of 512 or 1024 bytes: the three rows fit, and no document does.
    let limited = format!("trap '' XFSZ; ulimit -f 8; exec '{VALIDATE}' \"$@\"");
    let mut command = desk.command("sh", &["-c", &limited, "sh"]);
    let output = command.args(CASE).args(["--docs", "docs", "--json", "rows.json"]).output().expect("sh");
    let fault = |file: &'static str| [file, "cannot be written"];
    ends(
        &output,
        1,
        &[
            fault("error: --docs docs/data/acceptance.json: "),
            fault("error: --docs docs/images/cut_methods.png: "),
            fault("error: --docs docs/EVIDENCE.md: "),
        ],
    );
    assert_eq!((desk.rows(), fs::read(desk.at("docs/data/acceptance.json")).expect("the record") == record), (3, true));
}
