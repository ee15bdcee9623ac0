//! The README's scene is a scene. (Its Rust example is a doc test.)

use bevy_clay::prelude::*;
use std::path::Path;

#[test]
fn scene_of_the_readme_builds() {
    let readme = include_str!("../README.md");
    let text = readme.split("```ron\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a block of RON");
    let built = Scene::from_ron(text).expect("scene").build(Path::new(".")).expect("clay");
    assert!(built.snapshot.particles.len() > 1000 && built.frame_count() > 0);
}
