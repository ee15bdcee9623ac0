//! The README's scene is a scene, its clay a clay, its app the one that is run. (Its Rust examples are doc
//! tests.)

use bevy_clay::prelude::*;
use bevy_clay::scene::prelude::*;
use std::path::Path;

/// The README's blocks of RON, from 0.
fn block(index: usize) -> &'static str {
    let readme = include_str!("../README.md");
    readme.split("```ron\n").nth(index + 1).and_then(|rest| rest.split("```").next()).expect("a block of RON")
}

#[test]
fn scene_of_the_readme_builds() {
    let built = ClayScene::from_ron(block(0)).expect("scene").build(Path::new(".")).expect("clay");
    assert!(built.snapshot.particles.len() > 1000 && built.frame_count() > 0);
}

#[test]
fn clay_of_the_readme_is_read() {
    let clay = ClayFile::from_ron(block(1)).expect("clay");
    assert_eq!((clay.warnings.len(), clay.material.yield_stress), (0, 25e3));
}

/// The app that a new user would copy is compiled by itself, pressed and undone: see `scripts/test.sh`.
#[test]
fn app_of_the_readme_is_the_one_that_is_run() {
    let app = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/outside/src/main.rs");
    // The published package leaves it out.
    if let Ok(app) = std::fs::read_to_string(app) {
        assert!(include_str!("../README.md").contains(&format!("```rust,no_run\n{app}```\n")), "README.md quotes another app");
        assert!(app.lines().count() < 60, "{} lines", app.lines().count());
    }
}
