//! The documents name files, modules and tests that exist.

use std::fs;
use std::path::{Path, PathBuf};

const DOCUMENTS: [&str; 5] = ["docs/ARCHITECTURE.md", "docs/DEVIATIONS.md", "docs/EVIDENCE.md", "docs/haptics.md", "docs/xr.md"];
/// What the paths that are looked up begin with.
const FOLDERS: [&str; 8] = [".cargo", "assets", "benches", "docs", "examples", "scripts", "src", "tests"];
/// Modules whose paths are looked up.
const MODULES: [&str; 7] = ["sim", "surface", "haptics", "scene", "plugin", "ui", "xr"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The Rust files that `path`, a file or a folder, stands for.
fn rust_files(path: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(path) else {
        return if path.extension().is_some_and(|e| e == "rs") { vec![path.into()] } else { vec![] };
    };
    entries.flat_map(|entry| rust_files(&entry.expect("entry").path())).collect()
}

/// Whether a file of `path` has a function of this name.
fn has_function(path: &Path, name: &str) -> bool {
    let head = format!("fn {name}(");
    rust_files(path).iter().any(|file| fs::read_to_string(file).is_ok_and(|text| text.contains(&head)))
}

/// Whether the path of a module, or of an item in one, begins with a module that is there.
fn is_module(path: &str) -> bool {
    let mut segments = path.split("::");
    let folder = root().join("src").join(segments.next().unwrap_or_default());
    segments.next().is_none_or(|name| folder.join(name).is_dir() || folder.join(name).with_extension("rs").is_file())
}

/// What the backticks of a document name that is not there. Names that follow `FILE`: are those of functions
/// in it, up to the next file, or to the end of the item, the paragraph or the cell.
fn missing(document: &str) -> Vec<String> {
    let is_name = |s: &str| s.contains('_') && s.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    let mut found = vec![];
    for part in document.split("\n\n").flat_map(|p| p.split("\n- ")).flat_map(|p| p.split('|')) {
        let mut place: Option<&str> = None;
        let pieces: Vec<&str> = part.split('`').collect();
        for quoted in (1..pieces.len()).step_by(2) {
            let (text, after) = (pieces[quoted], pieces.get(quoted + 1).copied().unwrap_or_default());
            let is_path = text.split_once('/').is_some_and(|(folder, _)| FOLDERS.contains(&folder));
            if is_path && !text.contains([' ', '*']) {
                place = after.starts_with(':').then_some(text);
                found.extend((!root().join(text).exists()).then(|| text.to_owned()));
            } else if text.split_once("::").is_some_and(|(module, _)| MODULES.contains(&module)) {
                found.extend((!is_module(text)).then(|| text.to_owned()));
            } else if let Some(file) = place.filter(|file| is_name(text) && !file.ends_with(".wgsl")) {
                found.extend((!has_function(&root().join(file), text)).then(|| format!("{file}: {text}")));
            }
        }
    }
    found
}

#[test]
fn documents_name_what_exists() {
    for name in DOCUMENTS {
        let missing = missing(&fs::read_to_string(root().join(name)).expect("text"));
        assert!(missing.is_empty(), "{name}: {missing:#?}");
    }
}

/// The check itself finds names that went, and leaves alone what is there and what is no name of a test.
#[test]
fn planted_names_are_found() {
    let faults = [
        ("as in `src/sim/gone.rs`", "src/sim/gone.rs"),
        ("`tests/documents.rs`: `planted_names_are_found`,\n`gone_test`.", "tests/documents.rs: gone_test"),
        ("| `tests`: x | `tests/headless`: `no_such_test` |", "tests/headless: no_such_test"),
        ("of `sim::gone::X`", "sim::gone::X"),
    ];
    for (text, name) in faults {
        assert_eq!(missing(text), [name], "{text}");
    }
    let fine = "`src/sim/planner`, `sim::planner::Planner`, `surface::gpu`; `src/sim/mod.rs`: `cargo core`.\n\n`plan_id` | `tests/*/gone.rs`";
    assert_eq!(missing(fine), Vec::<String>::new());
}
