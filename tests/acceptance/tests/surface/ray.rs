//! Rays through the fields, against the mesh of the same fields.
#![expect(clippy::print_stdout, reason = "figures")]

use bevy_clay::sim::frame::SurfaceSource;
use bevy_clay::sim::params::Domain;
use bevy_clay::surface::extract::extract_by;
use bevy_clay::surface::field::{Field, SurfaceSettings, Tier};
use bevy_clay::surface::labels::Rules;
use bevy_clay::surface::mesh::Mesh;
use bevy_clay::surface::ray::{RayHit, cast_ray};
use clay_acceptance::cases::surface::clay::{
    BALL_CENTRE, CELL, CUBE_CENTRE, Cut, CutCube, Random, affine, ball, domain, lattice, source,
};
use glam::{DVec3, Vec3};

/// Distance and normal where a ray meets a mesh first from outside: all triangles are asked (Moeller and
/// Trumbore).
fn cast_mesh(mesh: &Mesh, origin: DVec3, way: DVec3) -> Option<(f64, Vec3)> {
    let hit = |t: &[u32; 3]| {
        let [a, b, c] = mesh.corners(*t);
        let (ab, ac, from) = (b - a, c - a, origin - a);
        let across = -way.dot(ab.cross(ac));
        let (u, v) = (way.dot(ac.cross(from)) / across, way.dot(from.cross(ab)) / across);
        let distance = from.dot(ab.cross(ac)) / across;
        let is_hit = across > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance >= 0.0;
        is_hit.then(|| {
            let [na, nb, nc] = t.map(|v| Vec3::from_array(mesh.normals.as_ref().expect("normals")[v as usize]));
            (distance, (na * (1.0 - u - v) as f32 + nb * u as f32 + nc * v as f32).normalize())
        })
    };
    mesh.triangles.iter().filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Fields with their mesh.
struct Shape {
    field: Field,
    settings: SurfaceSettings,
    mesh: Mesh,
    /// Of the visual grid [m].
    spacing: f64,
}

impl Shape {
    fn new(field: Field, settings: SurfaceSettings, spacing: f64) -> Self {
        let mesh = extract_by(&field, settings.iso_threshold, &Rules::new(settings.method), true);
        Self { field, settings, mesh, spacing }
    }

    fn of(source: &SurfaceSource, tier: Tier) -> Self {
        let settings = SurfaceSettings::new(tier);
        let spacing = source.domain.cell_width / if tier == Tier::Fine { 2.0 } else { 1.0 };
        Self::new(Field::of_particles(source, &settings), settings, spacing)
    }

    /// Blobs: 12^3 nodes of values at random, smoothed once along each axis.
    fn blobs(random: &mut Random) -> Self {
        const N: usize = 14;
        let mut values: Vec<f32> = (0..N * N * N).map(|_| random.range(-1.0, 2.0) as f32).collect();
        for step in [1, N, N * N] {
            let old = values.clone();
            let at = |i: usize| old.get(i).copied().unwrap_or_default();
            values = (0..old.len()).map(|i| (at(i.wrapping_sub(step)) + 2.0 * old[i] + at(i + step)) / 4.0).collect();
        }
        let is_rim = |i: usize| [i % N, i / N % N, i / (N * N)].iter().any(|&k| k == 0 || k == N - 1);
        values.iter_mut().enumerate().filter(|(i, _)| is_rim(*i)).for_each(|(_, v)| *v = 0.0);
        Self::new(Field::from_nodes([N; 3], &values, None), SurfaceSettings::default(), 1.0)
    }

    fn cast(&self, origin: DVec3, way: DVec3) -> Option<RayHit> {
        cast_ray(&self.field, &self.settings, origin, way)
    }

    /// Whether a ray so near to this one meets the mesh far from where this one does that rounding decides.
    fn is_grazing(&self, origin: DVec3, way: DVec3) -> bool {
        let (u, v) = way.any_orthonormal_pair();
        let reach = |shift: DVec3| cast_mesh(&self.mesh, origin + 1e-4 * self.spacing * shift, way).map_or(f64::MAX, |h| h.0);
        let reaches = [u + v, u - v, v - u, -u - v].map(reach);
        reaches.iter().any(|r| (r - reaches[0]).abs() > 0.01 * self.spacing)
    }

    /// 1000 rays through the mesh's box, from outside of it or from within: hits and misses agree but for
    /// grazing rays, and so do places and normals.
    fn assert_rays_agree(&self, name: &str, from_within: bool, random: &mut Random) {
        let (low, high) = self.mesh.bounds().expect("a mesh");
        let (low_node, high_node) = self.field.bounds(self.settings.iso_threshold).expect("clay");
        let margin = (low - low_node).min(high_node - high) / self.spacing;
        let most = (low - low_node).max(high_node - high) / self.spacing;
        assert!(
            margin.min_element() > -1e-3 && most.max_element() < 1.5,
            "{name}: margins {margin} to {most} of the field's box"
        );
        let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
        let (mut hits, mut grazing, mut off, mut turn) = (0, 0, 0.0f64, 0.0f32);
        for _ in 0..1000 {
            let target = middle + half * random.vector(-1.0, 1.0);
            let origin = if from_within {
                middle + half * random.vector(-1.0, 1.0)
            } else {
                middle + 2.0 * half.length() * random.direction()
            };
            let way = (target - origin).normalize();
            let (found, expected) = (self.cast(origin, way), cast_mesh(&self.mesh, origin, way));
            let differs = found.map_or(-1.0, |h| h.distance) - expected.map_or(-1.0, |h| h.0);
            if differs.abs() > 0.01 * self.spacing {
                assert!(self.is_grazing(origin, way), "{name}: {found:?}, on the mesh {expected:?}, from {origin} along {way}");
                grazing += 1;
            } else if let (Some(hit), Some((_, normal))) = (found, expected) {
                hits += 1;
                off = off.max(differs.abs() / self.spacing);
                turn = turn.max(hit.normal.angle_between(normal).to_degrees());
                assert!((hit.normal.length() - 1.0).abs() < 1e-5 && (hit.point - origin - way * hit.distance).length() < 1e-12);
            }
        }
        println!("{name}: {hits} hits, {grazing} grazing, off by {off:.1e} node spacings, normals by {turn:.3} degrees");
        assert!(hits > 100 && grazing < 5 && off < 1e-3 && turn < 0.2, "{name}");
    }
}

/// A cube of 12 cells whose halves stand `gap` cells apart along x, on both sides of a cut.
fn open_cut(gap: f64, random: &mut Random) -> SurfaceSource {
    let cut = CutCube::new(vec![Cut::through(DVec3::X, CUBE_CENTRE)], 2, 0.25, random);
    let tags = cut.tags();
    let apart = |p: &DVec3| *p + DVec3::X * (gap / 2.0).copysign(p.x - CUBE_CENTRE.x);
    let points: Vec<DVec3> = cut.points.iter().map(apart).collect();
    source(domain(36.0), &points, |i| tags[i], 1.0)
}

/// Ball, blobs, cubes with cuts: closed, open, crossing, ending within. Measured: no grazing ray in 18,000,
/// off by 2e-5 node spacings and 0.06 degrees at most (rounding of the mesh's vertices).
#[test]
fn rays_meet_what_the_mesh_shows() {
    let mut random = Random(21);
    for tier in [Tier::Fine, Tier::Coarse] {
        let shape = Shape::of(&ball(8.0, 0.5, 3), tier);
        shape.assert_rays_agree("ball", false, &mut random);
        for gap in [0.0, 0.6, 1.2, 2.5] {
            let shape = Shape::of(&open_cut(gap, &mut random), tier);
            shape.assert_rays_agree(&format!("cut open by {gap} cells"), false, &mut random);
        }
        for (case, kind) in [CutCube::one, CutCube::crossed, CutCube::crossed_by_partial].into_iter().enumerate() {
            let map = affine(&mut random);
            let shape = Shape::of(&kind(case + 1, &mut random).source(map), tier);
            shape.assert_rays_agree(&format!("deformed cut {case}"), false, &mut random);
        }
    }
    for _ in 0..3 {
        let shape = Shape::blobs(&mut random);
        shape.assert_rays_agree("blobs", false, &mut random);
        shape.assert_rays_agree("blobs from within", true, &mut random);
    }
}

fn world(domain: &Domain, cells: DVec3) -> DVec3 {
    domain.to_world(cells)
}

/// Rays into the gap of an open cut meet the lips where the clay ends. Measured: within 0.11 cells of the
/// plane and 4 degrees of its normal.
#[test]
fn lips_of_an_open_cut_are_hit() {
    let mut random = Random(22);
    let s = open_cut(2.0, &mut random);
    let shape = Shape::of(&s, Tier::Fine);
    for i in 0..100 {
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let mouth = CUBE_CENTRE + DVec3::new(0.0, 6.0, random.range(-4.0, 4.0));
        // From the middle of the gap's mouth to a lip 2 to 4 cells below.
        let way = DVec3::new(side, -random.range(2.0, 4.0), 0.0);
        let hit = shape.cast(world(&s.domain, mouth - way), way).expect("a lip");
        let off = (s.domain.to_grid(hit.point) - CUBE_CENTRE).x - side;
        let turn = hit.normal.angle_between(Vec3::X * -side as f32).to_degrees();
        assert!(off.abs() < 0.2 && turn < 8.0, "off by {off} cells, {turn} degrees");
    }
}

/// From within the clay a closed cut is no surface: rays across it leave the cube, which is hit no more.
#[test]
fn closed_cut_is_passed_as_if_whole() {
    let mut random = Random(23);
    let s = open_cut(0.0, &mut random);
    for shape in [Shape::of(&s, Tier::Fine), Shape::of(&s, Tier::Coarse)] {
        for _ in 0..200 {
            let origin = CUBE_CENTRE - 2.5 * DVec3::X + random.vector(-2.0, 2.0);
            let way = DVec3::X + random.vector(-0.3, 0.3);
            assert_eq!(shape.cast(world(&s.domain, origin), way), None, "from {origin} along {way}");
        }
        // On its mesh the far lip is in the way.
        assert!(cast_mesh(&shape.mesh, world(&s.domain, CUBE_CENTRE - 2.5 * DVec3::X), DVec3::X).is_some());
    }
}

/// From within the clay, across a gap, the far lip is met.
#[test]
fn far_lip_of_an_open_cut_is_met_from_within() {
    let mut random = Random(26);
    let s = open_cut(2.0, &mut random);
    let shape = Shape::of(&s, Tier::Fine);
    for _ in 0..100 {
        let origin = CUBE_CENTRE - 3.0 * DVec3::X + random.vector(-1.0, 1.0);
        let hit = shape.cast(world(&s.domain, origin), DVec3::X).expect("the far lip");
        let off = (s.domain.to_grid(hit.point) - CUBE_CENTRE).x - 1.0;
        assert!(off.abs() < 0.2 && hit.normal.x < -0.98, "off by {off} cells, {hit:?}");
    }
}

/// Along the axes, through nodes and between them, from both sides: the ball's surface is where it should be.
#[test]
fn rays_along_the_axes_meet_a_ball() {
    const RADIUS: f64 = 10.0;
    let s = ball(RADIUS, 0.25, 3);
    let shape = Shape::of(&s, Tier::Fine);
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            for beside in [0.0, 0.3, 0.5, 1.0, 4.0, -4.5, 9.0] {
                let mut at = BALL_CENTRE.round();
                at[(axis + 1) % 3] += beside;
                let off = (at - BALL_CENTRE).with_axis(axis, 0.0).length_squared();
                at[axis] = BALL_CENTRE[axis] - 20.0 * sign;
                let hit = shape.cast(world(&s.domain, at), sign * DVec3::AXES[axis]).expect("a hit");
                let expected = 20.0 - (RADIUS * RADIUS - off).sqrt();
                assert!((hit.distance / CELL - expected).abs() < 0.25, "{beside}: {} cells, not {expected}", hit.distance / CELL);
                let out = s.domain.to_grid(hit.point) - BALL_CENTRE;
                assert!(hit.normal.as_dvec3().angle_between(out).to_degrees() < 10.0, "normal {}", hit.normal);
            }
        }
    }
}

trait WithAxis {
    fn with_axis(self, axis: usize, value: f64) -> Self;
}

impl WithAxis for DVec3 {
    fn with_axis(mut self, axis: usize, value: f64) -> Self {
        self[axis] = value;
        self
    }
}

/// From within a ball there is no way in; from within one of two the other is met.
#[test]
fn rays_from_within_see_fronts_alone() {
    let mut random = Random(24);
    let middles = [DVec3::splat(12.0), DVec3::new(28.0, 12.0, 12.0)];
    let is_in = |p: DVec3| middles.iter().any(|m| m.distance(p) < 5.0);
    let points = lattice(DVec3::splat(4.0), DVec3::new(36.0, 20.0, 20.0), 0.25, &mut random, is_in);
    let s = source(domain(40.0), &points, |_| 0, 1.0);
    let shape = Shape::of(&s, Tier::Fine);
    let from = |way: DVec3| shape.cast(world(&s.domain, middles[0]), way);
    assert!(from(DVec3::NEG_X).is_none() && from(DVec3::Y).is_none());
    let hit = from(DVec3::X * 7.0).expect("the other ball");
    assert!((hit.distance / CELL - 11.0).abs() < 0.2 && hit.normal.x < -0.95, "{hit:?}");
}

/// Rays that are none, rays beside the grid, fields without clay: no hit, no panic.
#[test]
fn degenerate_rays_meet_nothing() {
    let s = ball(4.0, 0.25, 3);
    let shape = Shape::of(&s, Tier::Fine);
    let middle = world(&s.domain, BALL_CENTRE);
    let outside = middle - DVec3::X;
    assert!(shape.cast(outside, DVec3::X).is_some() && shape.cast(outside, 1e100 * DVec3::X).is_some());
    assert!(shape.cast(outside, DVec3::NEG_X).is_none(), "behind");
    let odd = [0.0, -0.0, 1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1e308, 1e-308, f64::MIN_POSITIVE, 1e30];
    for a in odd {
        for b in odd {
            for c in odd {
                let vector = DVec3::new(a, b, c);
                let is_usable = vector.is_finite() && vector.try_normalize().is_some();
                assert!(is_usable || shape.cast(outside, vector).is_none(), "direction {vector}");
                let _ = (shape.cast(outside, vector), shape.cast(middle, vector), shape.cast(vector, DVec3::new(c, a, b)));
                assert!(vector.is_finite() || shape.cast(vector, DVec3::X).is_none(), "from {vector}");
                // From the far side of the world.
                assert!(vector.length() < 1e20 || shape.cast(vector, middle - vector).is_none_or(|h| h.distance.is_finite()));
            }
        }
    }
    let empty = SurfaceSource { domain: s.domain, particles: Vec::new().into() };
    for field in [Field::of_particles(&empty, &shape.settings), Field::from_nodes([0; 3], &[], None)] {
        assert!(cast_ray(&field, &shape.settings, outside, DVec3::X).is_none());
        assert!(cast_ray(&field, &shape.settings, DVec3::ZERO, DVec3::ONE).is_none());
    }
}
