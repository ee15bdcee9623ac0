//! The shape of the source tree: what may name what, and how long a file may be.

use std::collections::{BTreeMap, BTreeSet};
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

/// Circles of files that are left, by their modules, each with its reason.
const CIRCLES: [(&[&str], &str); 0] = [];

/// A module's path from the crate's root.
type Module = Vec<String>;

/// The modules of `src` with their code, those of tests left out.
fn modules() -> BTreeMap<Module, String> {
    let root = source();
    let rust = files(&root).into_iter().filter(|f| f.extension().is_some_and(|e| e == "rs"));
    let module = |file: PathBuf| {
        let place = file.strip_prefix(&root).expect("below src").with_extension("");
        let mut path: Module = place.iter().map(|p| p.to_string_lossy().into_owned()).collect();
        path.pop_if(|last| *last == "mod" || *last == "lib");
        (path, without_tests(&code(&fs::read_to_string(&file).expect("text"))))
    };
    let is_test = |path: &Module| path.last().is_some_and(|last| ["tests", "properties"].contains(&last.as_str()));
    rust.map(module).filter(|(path, _)| !is_test(path)).collect()
}

/// The code without its test modules: they may name whom they like.
fn without_tests(code: &str) -> String {
    let mut rest = code;
    let mut kept = String::new();
    while let Some(at) = rest.find("#[cfg(test)]\nmod ").or_else(|| rest.find("#[cfg(all(test,")) {
        kept.push_str(&rest[..at]);
        let after = &rest[at..];
        // A module in a file of its own is left out by its name.
        let open = after.find('{').filter(|open| after.find(';').is_none_or(|end| *open < end));
        let Some(open) = open else {
            rest = &after[after.find(';').map_or(after.len(), |end| end + 1)..];
            continue;
        };
        let mut depth = 0;
        let end = after[open..].char_indices().find_map(|(i, c)| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            (depth == 0).then_some(open + i + 1)
        });
        rest = &after[end.unwrap_or(after.len())..];
    }
    kept + rest
}

/// The paths that begin with `segments` and go on in `rest`, groups in braces taken apart.
fn tree(segments: &[String], rest: &str) -> Vec<Module> {
    let rest = rest.trim_start();
    if let Some(group) = rest.strip_prefix('{') {
        let (mut depth, mut start, mut all) = (0, 0, vec![]);
        for (i, c) in group.char_indices() {
            if depth == 0 && (c == ',' || c == '}') {
                all.extend(tree(segments, &group[start..i]));
                start = i + 1;
            }
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                _ => {}
            }
        }
        return all;
    }
    let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
    if end == 0 {
        return if segments.is_empty() { vec![] } else { vec![segments.to_vec()] };
    }
    let path = [segments, &[rest[..end].to_string()]].concat();
    match rest[end..].trim_start().strip_prefix("::") {
        Some(after) => tree(&path, after),
        None => vec![path],
    }
}

/// The modules that `code` of `module` names.
fn named(module: &Module, code: &str, all: &BTreeMap<Module, String>) -> BTreeSet<Module> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let starts = code.match_indices(is_word).map(|(i, _)| i).filter(|i| {
        let before = &code[..*i];
        // Who may see an item is no use of the module.
        !before.ends_with(is_word) && !before.ends_with("::") && !before.ends_with('.') && !before.ends_with("pub(in ")
    });
    let mut found = BTreeSet::new();
    for start in starts {
        let word_end = code[start..].find(|c| !is_word(c)).unwrap_or(code.len() - start);
        let word = &code[start..start + word_end];
        let child = [&module[..], &[word.to_string()]].concat();
        if !code[start + word_end..].starts_with("::")
            || !(["crate", "super", "self"].contains(&word) || all.contains_key(&child))
        {
            continue;
        }
        for path in tree(&[], &code[start..]) {
            let mut at: Module = if path[0] == "crate" { vec![] } else { module.clone() };
            for segment in &path {
                match segment.as_str() {
                    "crate" | "self" => {}
                    "super" => {
                        at.pop();
                    }
                    _ => {
                        let next = [&at[..], std::slice::from_ref(segment)].concat();
                        if !all.contains_key(&next) {
                            break;
                        }
                        at = next;
                    }
                }
            }
            // The crate's root holds nothing but the modules.
            if at != *module && !at.is_empty() {
                found.insert(at);
            }
        }
    }
    found
}

/// Sets of modules each of which names, by way of others, every other one.
fn circles(names: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<BTreeSet<Module>> {
    let reached = |from: &Module| {
        let (mut seen, mut next) = (BTreeSet::new(), vec![from]);
        while let Some(module) = next.pop() {
            next.extend(names.get(module).into_iter().flatten().filter(|m| seen.insert((*m).clone())));
        }
        seen
    };
    let reach: BTreeMap<&Module, BTreeSet<Module>> = names.keys().map(|m| (m, reached(m))).collect();
    let circle = |m: &Module| reach[m].iter().filter(|o| reach.get(o).is_some_and(|r| r.contains(m))).cloned().collect();
    let mut all: Vec<BTreeSet<Module>> = names.keys().map(circle).filter(|c: &BTreeSet<Module>| c.len() > 1).collect();
    all.sort();
    all.dedup();
    all
}

/// Files name each other in one direction; a circle that is left stands in [`CIRCLES`].
#[test]
fn files_name_each_other_one_way() {
    let all = modules();
    let names = all.iter().map(|(module, code)| (module.clone(), named(module, code, &all))).collect();
    let show = |circle: &BTreeSet<Module>| circle.iter().map(|m| m.join("::")).collect::<Vec<_>>();
    let found: Vec<_> = circles(&names).iter().map(show).collect();
    let known: Vec<Vec<String>> = CIRCLES.iter().map(|(c, _)| c.iter().map(ToString::to_string).collect()).collect();
    let told = |circle: &Vec<String>| {
        let edges = |m: &String| {
            let module: Module = m.split("::").map(String::from).collect();
            let to = named(&module, &all[&module], &all)
                .iter()
                .map(|m| m.join("::"))
                .filter(|m| circle.contains(m))
                .collect::<Vec<_>>();
            format!("{m} -> {}", to.join(", "))
        };
        circle.iter().map(edges).collect::<Vec<_>>()
    };
    let new: Vec<_> = found.iter().filter(|c| !known.contains(c)).map(told).collect();
    assert!(new.is_empty(), "circles of files: {new:#?}");
    let gone: Vec<_> = known.iter().filter(|c| !found.contains(c)).collect();
    assert!(gone.is_empty(), "no longer circles, to be taken off the list: {gone:#?}");
}

/// Every way in which a file may name another is seen.
#[test]
fn planted_circles_are_found() {
    let ways = [
        "use crate::b::X;",
        "use super::b;",
        "use crate::{b::{X, Y}, c};",
        "fn f(x: super::b::X) {}",
        "mod d { use super::super::b::X; }",
    ];
    for way in ways {
        let text = |module: &str| match module {
            "a" => way.to_string(),
            "b" => "fn g() { crate::a::f(); }".into(),
            _ => String::new(),
        };
        let all: BTreeMap<Module, String> = ["a", "b", "c"].map(|m| (vec![m.to_string()], text(m))).into();
        let names = all.iter().map(|(m, code)| (m.clone(), named(m, code, &all))).collect();
        assert_eq!(circles(&names).len(), 1, "{way}");
    }
    let all: BTreeMap<Module, String> = ["a", "b"].map(|m| (vec![m.to_string()], String::new())).into();
    assert_eq!(named(&vec!["a".into()], "pub(in super::b) fn f() {}", &all), BTreeSet::new());
    let tests = "fn f() {}\n#[cfg(test)]\nmod tests { use super::b; { } }\nfn g() {}";
    assert_eq!(without_tests(tests).matches("super").count(), 0);
    assert!(without_tests(tests).ends_with("fn g() {}"));
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
        ("surface", "let s = crate::scene::ClayScene::default();", "crate::scene"),
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

/// What makes objects on a device names them as this crate's: an error that names one is told apart by that.
#[test]
fn objects_on_a_device_are_named_by_the_crate() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = vec![];
    for path in files(&root).iter().filter(|path| path.extension().is_some_and(|e| e == "rs")) {
        let text = fs::read_to_string(path).expect("text");
        let code = code(text.split("#[cfg(test)]").next().unwrap_or_default());
        for after in code.split("label: ").skip(1).filter(|_| code.contains("wgpu::")) {
            let is_named = ["Some(\"bevy_clay:", "Some(&label", "Some(LABEL"].iter().any(|named| after.starts_with(named));
            let is_type = ["&", "Option<", "String", "u32"].iter().any(|ty| after.starts_with(ty));
            if !is_named && !is_type {
                found.push(format!("{}: label: {}", path.display(), after.lines().next().unwrap_or_default()));
            }
        }
        for default in ["EncoderDescriptor::default()", "ComputePassDescriptor::default()"] {
            found.extend(code.contains(default).then(|| format!("{}: {default}", path.display())));
        }
    }
    assert!(found.is_empty(), "labels that do not begin with `bevy_clay:`:\n{}", found.join("\n"));
}
