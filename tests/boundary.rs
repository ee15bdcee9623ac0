//! The shape of the source tree: what may name what, and how long a file may be.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules in data-flow order: none names one that comes after it.
const ORDER: [&str; 7] = ["sim", "surface", "haptics", "scene", "plugin", "ui", "xr"];
/// Those that build without Bevy.
const WITHOUT_BEVY: [&str; 4] = ["sim", "surface", "haptics", "scene"];
/// Longest files [lines], by ending.
const LONGEST: [(&str, usize); 2] = [("rs", 500), ("wgsl", 250)];

/// Every file under `folder`; none if there is no such folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return vec![] };
    let each = |entry: fs::DirEntry| if entry.path().is_dir() { files(&entry.path()) } else { vec![entry.path()] };
    entries.map(|e| e.expect("entry")).flat_map(each).collect()
}

/// The text without line comments: documentation may name what code may not.
fn code(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Names that follow `crate::` in `code`, those in braces too.
fn crate_names(code: &str) -> Vec<&str> {
    let head = |s: &str| s.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(s.len());
    let mut names = vec![];
    for after in code.split("crate::").skip(1) {
        let Some(group) = after.strip_prefix('{') else {
            names.push(&after[..head(after)]);
            continue;
        };
        let (mut depth, mut start) = (0, 0);
        for (i, c) in group.char_indices() {
            if depth == 0 && (c == ',' || c == '}') {
                let item = group[start..i].trim_start();
                names.push(&item[..head(item)]);
                start = i + 1;
            }
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                _ => {}
            }
        }
    }
    names
}

/// What a file of `module` names that it must not.
fn forbidden(module: &str, text: &str) -> Vec<String> {
    let code = code(text);
    let mut found = vec![];
    if WITHOUT_BEVY.contains(&module) {
        let words = code.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        let bevy = words.filter(|w| *w == "bevy" || (w.starts_with("bevy_") && *w != "bevy_clay"));
        found.extend(bevy.map(str::to_string));
    }
    let after = ORDER.iter().skip_while(|m| **m != module).skip(1);
    let later: Vec<_> = after.copied().collect();
    found.extend(crate_names(&code).into_iter().filter(|name| later.contains(name)).map(|name| format!("crate::{name}")));
    found
}

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

#[test]
fn modules_name_neither_bevy_nor_later_modules() {
    let mut faults = vec![];
    for module in ORDER {
        let mut all = files(&source().join(module));
        all.push(source().join(format!("{module}.rs")));
        for file in all.into_iter().filter(|f| f.extension().is_some_and(|e| e == "rs")) {
            let Ok(text) = fs::read_to_string(&file) else { continue };
            faults.extend(forbidden(module, &text).into_iter().map(|name| format!("{}: {name}", file.display())));
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn source_files_are_short() {
    let mut long = vec![];
    for file in files(&source()) {
        let lines = fs::read_to_string(&file).expect("text").lines().count();
        let most = LONGEST.iter().find(|(ending, _)| file.extension().is_some_and(|e| e == *ending));
        if let Some((_, most)) = most.filter(|(_, most)| lines > *most) {
            long.push(format!("{}: {lines} lines of {most}", file.display()));
        }
    }
    assert!(long.is_empty(), "{long:#?}");
}

/// The check itself finds what it is for, and leaves alone what is allowed.
#[test]
fn planted_faults_are_found() {
    let faults = [
        ("sim", "use bevy::prelude::*;", "bevy"),
        ("scene", "fn f(e: bevy_ecs::entity::Entity) {}", "bevy_ecs"),
        ("sim", "#[cfg(feature = \"bevy\")]", "bevy"),
        ("sim", "use crate::surface::mesh::Mesh;", "crate::surface"),
        ("sim", "use crate::{sim::{plan, tool}, scene::file};", "crate::scene"),
        ("surface", "let s = crate::scene::Scene::default();", "crate::scene"),
    ];
    for (module, text, name) in faults {
        assert_eq!(forbidden(module, text), [name], "{module}: {text}");
    }
    let fine = [
        ("sim", "/// As `bevy::prelude` does. [`crate::surface`]\nuse crate::sim::plan;"),
        ("scene", "use crate::{sim::{plan, surface}, surface::mesh};"),
        ("sim", "const MAGIC: &[u8] = b\"bevyclay\"; // bevy_clay"),
        ("plugin", "use bevy::prelude::*; use crate::sim::plan;"),
    ];
    for (module, text) in fine {
        assert!(forbidden(module, text).is_empty(), "{module}: {text}");
    }
}
