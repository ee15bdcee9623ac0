//! Cuts of no width: how many bodies, and of what kind.
#![expect(clippy::print_stdout, reason = "what fails")]

use bevy_clay::sim::frame::{SurfaceParticle, SurfaceSource};
use bevy_clay::surface::extract::{extract, extract_by};
use bevy_clay::surface::field::{Field, SurfaceSettings, Tier};
use bevy_clay::surface::labels::{CutMethod, Rules};
use bevy_clay::surface::stitch::print_ready;
use clay_acceptance::cases::surface::clay::{CutCube, Random, affine};
use glam::DMat3;

type Kind = fn(usize, &mut Random) -> CutCube;

/// The faults of `count` cubes, on one grid.
fn faults(kind: Kind, count: usize, is_deformed: bool, tier: Tier, seed: u64) -> Vec<String> {
    let mut random = Random(seed);
    let fault = |i: usize| {
        let cube = kind(i, &mut random);
        let map = if is_deformed { affine(&mut random) } else { DMat3::IDENTITY };
        let mesh = extract(&cube.source(map), &SurfaceSettings::new(tier));
        cube.fault(&mesh).map(|f| format!("{tier:?} {i}: {f}"))
    };
    (0..count).filter_map(fault).collect()
}

fn assert_few(name: &str, kind: Kind, count: usize, most: [usize; 4]) {
    let cases = [(Tier::Fine, false), (Tier::Fine, true), (Tier::Coarse, false), (Tier::Coarse, true)];
    let mut is_fine = true;
    for ((tier, is_deformed), most) in cases.into_iter().zip(most) {
        let faults = faults(kind, count, is_deformed, tier, if is_deformed { 12 } else { 11 });
        println!("{name}, {tier:?}, deformed {is_deformed}: {} of {count} wrong: {faults:#?}", faults.len());
        is_fine &= faults.len() <= most;
    }
    assert!(is_fine, "{name}");
}

/// 80 random cuts, half of them through, as made, and after a random affine map of +-15 %: always closed and
/// oriented as extracted, a manifold of the right topology after repair. Measured: a handle at the crack
/// front in 1 of 320.
#[test]
fn cuts_of_no_width_give_the_right_bodies() {
    assert_few("one cut", CutCube::one, 80, [1, 0, 0, 0]);
}

/// Two cuts that cross: four bodies. The coarse grid has nodes every cell.
#[test]
fn crossing_cuts_give_four_bodies() {
    assert_few("crossed", CutCube::crossed, 40, [0; 4]);
}

/// Parallel cuts 2 to 4 cells apart.
#[test]
fn parallel_cuts_give_three_slabs() {
    assert_few("slabs", CutCube::slabs, 40, [0; 4]);
}

/// A cut through, crossed by one that ends in the middle of both halves.
#[test]
fn partial_cut_across_a_full_one_leaves_two_bodies() {
    assert_few("crossed by a partial cut", CutCube::crossed_by_partial, 40, [0; 4]);
}

/// A cut that ends at another one.
#[test]
fn cut_up_to_another_gives_three_bodies() {
    assert_few("T-junction", CutCube::joined, 40, [0; 4]);
}

/// A closed cut through, by tags or by bodies, anywhere in the cube: its rims keep the volume. 2.3 to
/// 2.9 % less with the clay of each side alone.
#[test]
fn closed_cuts_keep_the_volume() {
    let mut random = Random(29);
    let settings = SurfaceSettings::default();
    let mut lost = vec![];
    for i in 0..10 {
        let cube = CutCube::one(2 * i, &mut random);
        let [tagged, parted] = [cube.source(DMat3::IDENTITY), cube.parted_source(DMat3::IDENTITY)];
        let particles = tagged.particles.iter().map(|p| SurfaceParticle { tags: 0, ..*p }).collect::<Vec<_>>().into();
        let whole = extract(&SurfaceSource { particles, ..tagged.clone() }, &settings).volume();
        lost.extend([tagged, parted].map(|source| 100.0 * (1.0 - extract(&source, &settings).volume() / whole)));
    }
    println!("volume lost: {lost:.3?} %");
    assert!(lost.iter().all(|l| l.abs() <= 0.2), "{lost:?}");
}

/// Equation 9 as published, on cuts right through: three of four are wrong.
#[test]
fn equation_9_cannot_show_a_thin_cut() {
    let mut random = Random(12);
    let settings = SurfaceSettings::equation_9();
    let faults = (0..40).filter(|&i| {
        let cube = CutCube::one(2 * i, &mut random);
        cube.fault(&extract(&cube.source(DMat3::IDENTITY), &settings)).is_some()
    });
    let count = faults.count();
    println!("{count} of 40 wrong");
    assert!(count >= 24, "{count}");
}

/// Two lumps that a cut parts, with some dust of no side beside them: the dust joins them only by the rule
/// that failed.
#[test]
fn empty_nodes_do_not_bridge_a_cut() {
    let (mut total, mut front, mut back) = (vec![0.0; 6 * 5 * 5], vec![0.0; 6 * 5 * 5], vec![0.0; 6 * 5 * 5]);
    for i in 0..150 {
        let [x, y, z] = [i % 6, i / 6 % 5, i / 30];
        if (1..5).contains(&x) && (1..4).contains(&y) && (1..4).contains(&z) {
            let is_dust = y == 3;
            total[i] = if is_dust { 0.2 } else { 1.0 };
            if !is_dust {
                let side = if x < 3 { &mut front } else { &mut back };
                side[i] = 1.0;
            }
        }
    }
    let field = Field::from_nodes([6, 5, 5], &total, [(&front[..], &back[..])]);
    let rules = Rules::new(CutMethod::TwoSided);
    let bodies = |rules: Rules| print_ready(&extract_by(&field, 0.5, &rules, false)).0.component_labels().1;
    assert_eq!([bodies(rules), bodies(Rules { empty_nodes_join: true, ..rules })], [2, 1]);
}
