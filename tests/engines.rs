//! The native engine against the f64 oracle.

mod common;

use bevy_clay::prelude::*;
use common::{Agreement, assert_close};

fn assert_all(cases: Vec<Agreement>) {
    let mut engine = NativeEngine::new();
    for case in cases {
        assert_close(&mut engine, &case);
    }
}

#[test]
fn impact_agrees() {
    assert_all(common::impact());
}

#[test]
fn asymmetric_deformation_agrees() {
    assert_all(common::asymmetric_deformation());
}

#[test]
fn solid_tools_agree() {
    assert_all(common::solid_tools());
}

#[test]
fn blades_agree() {
    assert_all(common::blades());
}

#[test]
fn kept_cut_agrees() {
    assert_all(common::kept_cut());
}

#[test]
fn laws_agree() {
    assert_all(common::laws());
}

/// The laws as published: the stress itself fades from the tool.
#[test]
fn published_laws_agree() {
    let law = |law| ClayMaterial { law, softening_length: 4.0 * common::CELL, ..common::soft() };
    let all = [("as published", ClayLaw::AsPublished), ("as published, default d", ClayLaw::AsPublishedDefaultD)];
    assert_all(all.into_iter().map(|(name, l)| common::pressed(name, law(l), 0.0)).collect());
}

#[test]
fn volume_averaging_agrees() {
    assert_all(common::averaging());
}

/// Two runs give the same bits, on one thread and on two.
#[test]
fn runs_are_bit_identical() {
    let run = |threads| common::run(&mut NativeEngine::with_threads(threads), &common::mixed(), 3);
    let one = run(1);
    assert!(one == run(2), "one thread against two");
    assert!(one == run(1), "two runs");
}
