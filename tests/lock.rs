//! Cargo.lock holds one copy of each crate whose types cross borders: two copies compile and then do not fit
//! together.

/// Crates that must not be there twice.
const ONCE: [&str; 5] = ["wgpu", "naga", "glam", "egui", "bevy_ecs"];

/// `name version` of every package of the lock file whose name is in `names`.
fn versions<'a>(lock: &'a str, names: &[&str]) -> Vec<(&'a str, &'a str)> {
    let field =
        |block: &'a str, key: &str| block.lines().find_map(|l| l.strip_prefix(key)?.strip_prefix(" = \"")?.strip_suffix('"'));
    let package = |block: &'a str| Some((field(block, "name")?, field(block, "version")?));
    lock.split("[[package]]").filter_map(package).filter(|(name, _)| names.contains(name)).collect()
}

/// Those of `names` that the lock file holds in more than one version, each with its versions.
fn doubled(lock: &str, names: &[&str]) -> Vec<String> {
    let found = versions(lock, names);
    let of = |name: &str| found.iter().filter(|(n, _)| *n == name).map(|(_, v)| *v).collect::<Vec<_>>();
    names.iter().map(|name| (name, of(name))).filter(|(_, v)| v.len() > 1).map(|(n, v)| format!("{n}: {v:?}")).collect()
}

#[test]
fn lock_holds_one_version_of_shared_crates() {
    let lock = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.lock")).expect("Cargo.lock");
    let glam = versions(&lock, &["glam"]);
    assert_eq!(glam.len(), 1, "the check reads the lock file: {glam:?}");
    let doubled = doubled(&lock, &ONCE);
    assert!(doubled.is_empty(), "{doubled:?}");
}

/// The check itself finds a second copy, and does not take `glam_matrix_extras` for `glam`.
#[test]
fn planted_second_version_is_found() {
    let package = |name: &str, version: &str| format!("[[package]]\nname = \"{name}\"\nversion = \"{version}\"\n\n");
    let one = package("glam", "0.32.1") + &package("glam_matrix_extras", "0.3.0");
    assert!(doubled(&one, &ONCE).is_empty());
    assert_eq!(doubled(&(one + &package("glam", "0.34.2")), &ONCE), [r#"glam: ["0.32.1", "0.34.2"]"#]);
}

/// The app outside, which is built as a user would build it, is built of what is tested here: its own lock
/// file adds to this one and changes nothing.
#[test]
fn outside_app_has_the_versions_tested_here() {
    let read = |file: &str| std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(file));
    // The published package leaves it out.
    let Ok(outside) = read("tests/outside/Cargo.lock") else { return };
    let here = read("Cargo.lock").expect("Cargo.lock");
    let names = |lock: &str| -> std::collections::BTreeSet<String> {
        lock.lines().filter_map(|l| Some(l.strip_prefix("name = \"")?.strip_suffix('"')?.to_string())).collect()
    };
    let shared: Vec<String> = names(&here).intersection(&names(&outside)).cloned().collect();
    let shared: Vec<&str> = shared.iter().map(String::as_str).collect();
    assert!(shared.len() > 100, "the check reads both: {}", shared.len());
    let there = versions(&outside, &shared);
    let missing: Vec<_> = versions(&here, &shared).into_iter().filter(|package| !there.contains(package)).collect();
    assert!(missing.is_empty(), "not in tests/outside/Cargo.lock: {missing:?}");
}

/// Crates of Bevy that a build of both packages draws in, those for tests, benches and examples too.
fn bevy_crates(features: &[&str]) -> Vec<String> {
    let tree =
        ["tree", "--offline", "--locked", "--no-default-features", "--edges", "all", "--target", "all", "--prefix", "none"];
    let output =
        std::process::Command::new(env!("CARGO")).args(tree).args(features).current_dir(env!("CARGO_MANIFEST_DIR")).output();
    let output = output.expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8(output.stdout).expect("text");
    let names: Vec<_> = lines.lines().filter_map(|line| line.split(' ').next()).collect();
    assert!(names.contains(&"wgpu") && names.contains(&"proptest"), "the check reads the tree: {names:?}");
    let bevy = names.into_iter().filter(|name| *name == "bevy" || name.starts_with("bevy_") && *name != "bevy_clay");
    bevy.map(str::to_string).collect()
}

/// Whoever wants the solver without Bevy gets no crate of it, in tests and examples neither.
#[test]
fn builds_without_bevy_have_no_crate_of_it() {
    assert_eq!(bevy_crates(&[]), Vec::<String>::new());
    assert!(!bevy_crates(&["--features", "bevy_clay/bevy"]).is_empty(), "the check finds them where they are");
}
