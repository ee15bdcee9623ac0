//! Where the lips of a cut are, and how they meet.
#![expect(clippy::print_stdout, reason = "figures")]

use bevy_clay::surface::extract::{extract, extract_by};
use bevy_clay::surface::field::{Field, SurfaceSettings};
use bevy_clay::surface::labels::{CutMethod, Rules};
use bevy_clay::surface::mesh::Mesh;
use bevy_clay::surface::stitch::print_ready;
use clay_acceptance::cases::surface::clay::{CELL, CUBE_CENTRE, Lips, Random, domain, lattice, source, upright};
use glam::{DMat3, DVec3, Vec3};

/// Tags of one sheet.
fn tag(side: i8) -> u32 {
    u32::from_le_bytes([u8::from(side != 0), side.cast_unsigned(), 0, 0])
}

/// At rest the lips of full cuts lie on each other: mean distance along the normal, over the parts away from
/// the cube's faces. Measured: 0.0002 cells apart, rms off the plane 0.024 to 0.030, worst vertex 0.11 (0.30
/// with lips midway between nodes). At the rims of a cut that is oblique to the cube's face 0.36: there is
/// less clay in the acute side's corner than in the other's, and where they are equal is not in the plane.
#[test]
fn lips_of_a_cut_at_rest_touch() {
    let mut random = Random(13);
    for case in 0..10 {
        let cube = upright(&mut random);
        let cut = cube.cuts[0];
        let s = cube.source(DMat3::IDENTITY);
        let mesh = extract(&s, &SurfaceSettings::default());
        let Lips { areas, gap, rms } = Lips::of(&mesh, &s.domain, &cut);
        // How far a body reaches beyond the plane, at the worst vertex: a cell within, and at the rims.
        let (bodies, _) = print_ready(&mesh);
        let reach = |body: &Mesh, is_counted: fn(f64) -> bool| {
            let places = body.positions.iter().map(|p| s.domain.to_grid(Vec3::from_array(*p).as_dvec3()));
            let d = |range: (f64, f64), p: DVec3| (range.0.min(cut.distance(p)), range.1.max(cut.distance(p)));
            let (low, high) = places.clone().fold((f64::MAX, f64::MIN), d);
            let counted = places.filter(|p| is_counted((*p - CUBE_CENTRE).abs().max_element()));
            let (least, most) = counted.fold((0.0, 0.0), d);
            if high > -low { -least } else { most }
        };
        let overshoot = |is_counted| bodies.components().iter().map(|b| reach(b, is_counted)).fold(0.0, f64::max);
        let [within, at_rims] = [overshoot(|edge| edge < 5.0), overshoot(|_| true)];
        println!("case {case}: gap {gap:.4} rms {rms:.3} overshoot {within:.3}, at rims {at_rims:.3} cells");
        assert!(areas[0] > 60e-6 && areas[1] > 60e-6, "case {case}: lips missing: {areas:?}");
        assert!(gap.abs() <= 0.02 && rms < 0.05, "case {case}: gap {gap}, rms {rms}");
        assert!(within < 0.2 && at_rims < 0.4, "case {case}: overshoot {within}, at rims {at_rims}");
    }
}

/// Where a cut along z of a cube ends: lowest lip vertex over the end of the tags [cells], per cube, and the
/// longest edge [m].
fn fronts(rules: &Rules) -> (Vec<f64>, f32) {
    let mut random = Random(17);
    let mut ends = Vec::new();
    let mut longest = 0.0;
    for _ in 0..10 {
        let (x, depth) = (18.0 + random.range(-1.0, 1.0), 18.0 + random.range(-2.0, 2.0));
        let points = lattice(CUBE_CENTRE - 6.0, CUBE_CENTRE + 6.0, 0.25, &mut random, |_| true);
        let side =
            |i: usize| if (points[i].x - x).abs() >= 3.0 || points[i].y <= depth { 0 } else { (points[i].x - x).signum() as i8 };
        let s = source(domain(30.0), &points, |i| tag(side(i)), 1.0);
        let mesh = extract_by(&Field::of_particles(&s, &SurfaceSettings::default()), 0.5, rules, false);
        let length = |[a, b]: [u32; 2]| Vec3::from_array(mesh.positions[a as usize]).distance(mesh.positions[b as usize].into());
        longest = mesh.edges().map(length).fold(0.0, f32::max).max(longest);
        let positions = mesh.positions.iter().map(|p| s.domain.to_grid(Vec3::from_array(*p).as_dvec3()));
        let is_deep = |p: &DVec3| (*p - CUBE_CENTRE).abs().max_element() < 4.5;
        let end = positions.filter(is_deep).map(|p| p.y - depth).fold(f64::MAX, f64::min);
        ends.push(end);
    }
    println!("lowest lip vertex over the end of the tags {ends:.2?} cells, longest edge {longest:.5} m");
    (ends, longest)
}

/// A partial cut ends where the tags end, and its lips are welded there without caps along the front.
/// Measured: -0.11 to 0.38 cells. Longest edge 1.12 cells, at a rim; 12.3 with lips that are not welded at
/// the front.
#[test]
fn crack_front_stands_where_the_tags_end() {
    let rules = Rules::new(CutMethod::TwoSided);
    let (ends, longest) = fronts(&rules);
    assert!(ends.iter().all(|e| e.abs() <= 0.75), "{ends:?} cells");
    // The diagonal of a cell of the visual grid is 0.87 cells, and 1.22 where a vertex stands a node beside
    // its edge, at a rim; a cap over a whole unwelded front would be longer.
    assert!(f64::from(longest) <= 1.25 * CELL, "{longest} m");
    // The way that failed, any trace of a tag making an owner: the cut runs ahead of its tags.
    let (ends, _) = fronts(&Rules { owner_share: 0.05, ..rules });
    assert!(ends.iter().all(|e| *e < -0.75), "{ends:?} cells");
}

/// A cut that gapes by 0.2 cells per cell of depth: its lips part from nothing at the front, smoothly, to the
/// gap of the clay.
#[test]
fn lips_close_smoothly_at_the_front() {
    const SLOPE: f64 = 0.3;
    let mut random = Random(19);
    let (x, depth) = (18.1, 14.2);
    let mut points = lattice(CUBE_CENTRE - 6.0, CUBE_CENTRE + 6.0, 0.25, &mut random, |_| true);
    let sides: Vec<i8> =
        points.iter().map(|p| if (p.x - x).abs() >= 3.0 || p.y <= depth { 0 } else { (p.x - x).signum() as i8 }).collect();
    let shift = |p: &DVec3| 0.5 * SLOPE * (p.y - depth).max(0.0) * (p.x - x).signum();
    points.iter_mut().for_each(|p| p.x += shift(p));
    let s = source(domain(30.0), &points, |i| tag(sides[i]), 1.0);
    let mesh = extract(&s, &SurfaceSettings::default());
    // Area-weighted place of each lip by height over the front, in steps of half a cell.
    let mut lips = [[(0.0, 0.0); 2]; 14];
    for t in &mesh.triangles {
        let vector = mesh.area_vector(*t);
        let centre = s.domain.to_grid(mesh.corners(*t).iter().sum::<DVec3>() / 3.0);
        let bin = ((centre.y - depth) / 0.5).floor();
        let is_deep = (centre.z - 18.0).abs() < 4.5 && (centre.x - x).abs() < 2.5;
        if is_deep && (0.0..14.0).contains(&bin) && vector.x.abs() > 0.7 * vector.length() {
            let lip = &mut lips[bin as usize][usize::from(vector.x < 0.0)];
            lip.0 += vector.length() * centre.x;
            lip.1 += vector.length();
        }
    }
    let gaps: Vec<f64> = lips.iter().map(|[left, right]| right.0 / right.1 - left.0 / left.1).collect();
    println!("gaps {gaps:.2?} cells");
    for (bin, gap) in gaps.iter().enumerate().filter(|(bin, gap)| *bin > 0 || gap.is_finite()) {
        let expected = SLOPE * (bin as f64 + 0.5) * 0.5;
        assert!((gap - expected).abs() < 0.4, "{gap} against {expected} at {bin}");
    }
    let steps: Vec<f64> = gaps.windows(2).map(|w| w[1] - w[0]).filter(|s| s.is_finite()).collect();
    assert!(steps.iter().all(|s| s.abs() < 0.45), "{steps:?}");
}
