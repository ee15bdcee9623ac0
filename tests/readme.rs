//! The README's scene is a scene, its clay a clay. (Its Rust example is a doc test.)

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
