//! Accuracy: a ball of ten cells, small clusters.

use bevy_clay::sim::frame::SurfaceSource;
use bevy_clay::sim::params::Domain;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::{SurfaceSettings, Tier};
use bevy_clay::surface::grains::extract_with_grains;
use bevy_clay::surface::mesh::Mesh;
use clay_acceptance::cases::surface::clay::{BALL_CENTRE, CELL, CUBE_CENTRE, Random, ball, cluster, domain, lattice, source};
use glam::{DVec3, Vec3};

const RADIUS: f64 = 10.0;

#[derive(Debug)]
struct SphereError {
    volume_percent: f64,
    mean: f64,
    rms: f64,
    max: f64,
    normal_rms: f64,
    components: usize,
}

/// Errors of a mesh against the sphere, lengths in cells, angles in degrees.
fn sphere_error(mesh: &Mesh, domain: &Domain, radius: f64) -> SphereError {
    let centre = domain.to_world(BALL_CENTRE);
    let local = |p: &[f32; 3]| (Vec3::from_array(*p).as_dvec3() - centre) / CELL;
    let d: Vec<f64> = mesh.positions.iter().map(|p| local(p).length() - radius).collect();
    let n = d.len() as f64;
    let mean = d.iter().sum::<f64>() / n;
    let rms = (d.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    let normals = mesh.normals.as_ref().expect("normals");
    let angles =
        mesh.positions.iter().zip(normals).map(|(p, m)| local(p).angle_between(Vec3::from_array(*m).as_dvec3()).to_degrees());
    let normal_rms = (angles.map(|a| a * a).sum::<f64>() / n).sqrt();
    let exact = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3) * CELL.powi(3);
    SphereError {
        volume_percent: 100.0 * (mesh.volume() / exact - 1.0),
        mean,
        rms,
        max: d.iter().fold(0.0, |a, x| x.abs().max(a)),
        normal_rms,
        components: mesh.component_labels().1,
    }
}

/// Sphere of 10 cells, 8 particles per cell, jitter 1/4 and 1/2 of the particle distance, default settings.
/// Measured: volume -0.11 and -0.18 %, rms 0.032 and 0.043 cells, vertex normals 2.4 and 3.1 degrees rms, one
/// body.
#[test]
fn sphere_of_ten_cells_is_accurate_on_the_fine_grid() {
    for jitter in [0.25, 0.5] {
        let s = ball(RADIUS, jitter, 3);
        let error = sphere_error(&extract(&s, &SurfaceSettings::default()), &s.domain, RADIUS);
        println!("jitter {jitter}: {error:?}");
        assert!(error.volume_percent.abs() <= 0.5, "{error:?}");
        assert!(error.rms <= 0.045 && error.mean.abs() <= 0.01 && error.max < 0.25, "{error:?}");
        assert!(error.normal_rms <= 3.5, "{error:?}");
        assert_eq!(error.components, 1);
    }
}

/// The same on the coarse grid. Measured: volume -0.82 and -0.89 %, rms 0.026 and 0.033 cells, vertex normals
/// 1.3 and 1.5 degrees rms.
#[test]
fn sphere_of_ten_cells_is_accurate_on_the_coarse_grid() {
    for jitter in [0.25, 0.5] {
        let s = ball(RADIUS, jitter, 3);
        let error = sphere_error(&extract(&s, &SurfaceSettings::new(Tier::Coarse)), &s.domain, RADIUS);
        println!("jitter {jitter}: {error:?}");
        assert!(error.volume_percent.abs() <= 1.5 && error.rms <= 0.045 && error.normal_rms <= 2.0, "{error:?}");
        assert_eq!(error.components, 1);
    }
}

/// Compressed clay keeps its place: particles at 0.8 of their distance and J = 0.512. Measured: volume -0.45
/// %.
#[test]
fn sphere_of_compressed_clay_keeps_its_volume() {
    let s = ball(RADIUS, 0.25, 3);
    let points: Vec<DVec3> =
        s.particles.iter().map(|p| BALL_CENTRE + 0.8 * (Vec3::from_array(p.position).as_dvec3() - BALL_CENTRE)).collect();
    let s = source(s.domain, &points, |_| 0, 0.512);
    let error = sphere_error(&extract(&s, &SurfaceSettings::default()), &s.domain, 8.0);
    println!("{error:?}");
    assert!(error.volume_percent.abs() <= 1.0, "{error:?}");
}

/// Clusters of 8 particles keep their volume within 50 % in the mean, of 27 and more within 25 % each.
/// Measured volume over particle volume, mean of 30: 1 1.5, 2 2.4, 4 1.6, 8 1.43, 16 1.05, 27 0.86, 64 0.81,
/// 125 0.80. The coarse grid does not resolve clusters: 8 0.9, 27 0.2, 125 0.5.
#[test]
fn small_clusters_keep_their_volume() {
    for tier in [Tier::Fine, Tier::Coarse] {
        for count in [1, 2, 4, 8, 16, 27, 64, 125] {
            let mut random = Random(5);
            let mut ratio = || {
                let points = cluster(count, &mut random);
                let mesh = extract(&source(domain(24.0), &points, |_| 0, 1.0), &SurfaceSettings::new(tier));
                mesh.volume() / CELL.powi(3) / (count as f64 / 8.0)
            };
            let ratios: Vec<f64> = (0..30).map(|_| ratio()).collect();
            let mean = ratios.iter().sum::<f64>() / 30.0;
            let (low, high) = ratios.iter().fold((f64::MAX, 0.0f64), |(a, b), &r| (a.min(r), b.max(r)));
            println!("{tier:?} {count}: {mean:.2} [{low:.2} {high:.2}]");
            if tier == Tier::Fine {
                assert!(count < 8 || (mean - 1.0).abs() <= 0.5, "{count}: {mean}");
                assert!(count < 27 || (low >= 0.75 && high <= 1.25), "{count}: {low} {high}");
            }
        }
    }
}

/// Every particle shows: by the surface, or as a grain. Mesh and grains together have the particles' volume:
/// clusters of 27 and more within 25 % each, of 8 and more within 50 % in the mean; smaller ones are grains
/// alone.
#[test]
fn no_particle_is_lost() {
    for count in [1, 2, 4, 7, 8, 12, 16, 27, 64, 125] {
        let mut random = Random(5);
        let mut ratio = || {
            let s = source(domain(24.0), &cluster(count, &mut random), |_| 0, 1.0);
            let all = extract_with_grains(&s, &SurfaceSettings::default());
            assert!(count >= 8 || (all.grains.len() == count && all.mesh.triangles.is_empty()), "{count}");
            let grains: f64 = all.grains.iter().map(|g| 4.0 / 3.0 * std::f64::consts::PI * f64::from(g.radius).powi(3)).sum();
            (all.mesh.volume() + grains) / CELL.powi(3) / (count as f64 / 8.0)
        };
        let ratios: Vec<f64> = (0..30).map(|_| ratio()).collect();
        let mean = ratios.iter().sum::<f64>() / 30.0;
        let (low, high) = ratios.iter().fold((f64::MAX, 0.0f64), |(a, b), &r| (a.min(r), b.max(r)));
        println!("{count}: {mean:.2} [{low:.2} {high:.2}]");
        assert!((mean - 1.0).abs() <= if count < 8 { 1e-5 } else { 0.5 }, "{count}: {mean}");
        assert!(count < 27 || (low >= 0.75 && high <= 1.25), "{count}: {low} {high}");
    }
}

/// Bodies have no grains, whatever their edges, where ever they are on the grid: no edge is beset with balls.
#[test]
fn bodies_have_no_grains() {
    let mut random = Random(8);
    for tier in [Tier::Fine, Tier::Coarse] {
        for (case, jitter) in [0.0, 0.25, 0.5].into_iter().cycle().take(12).enumerate() {
            let low = DVec3::splat(8.0) + random.vector(0.0, 1.0);
            let cube = lattice(low, low + 8.0, jitter, &mut random, |_| true);
            // An edge of 30 degrees.
            let wedge = lattice(low, low + 8.0, jitter, &mut random, |p| p.x - low.x > 1.7 * (p.y - low.y));
            let plate = lattice(low, low + DVec3::new(8.0, 0.5, 8.0), jitter, &mut random, |_| true);
            for (name, points) in [("cube", cube), ("wedge", wedge), ("plate", plate)] {
                let s = source(domain(24.0), &points, |_| 0, 1.0);
                let grains = extract_with_grains(&s, &SurfaceSettings::new(tier)).grains;
                assert!(grains.is_empty(), "{name} {case} {tier:?}: {} grains", grains.len());
            }
        }
        for (name, s) in [("ball", ball(RADIUS, 0.5, 3)), ("cube", jittered_cube())] {
            let all = extract_with_grains(&s, &SurfaceSettings::new(tier));
            let error = all.mesh.volume() / (s.particles.len() as f64 / 8.0 * CELL.powi(3)) - 1.0;
            println!("{name} {tier:?}: volume {:.2} %", 100.0 * error);
            assert!(all.grains.is_empty(), "{name}");
            assert!(tier == Tier::Coarse || error.abs() <= 0.01, "{name}: {error}");
        }
    }
}

fn jittered_cube() -> SurfaceSource {
    let cube = lattice(CUBE_CENTRE - 6.0, CUBE_CENTRE + 6.0, 0.5, &mut Random(8), |_| true);
    source(domain(36.0), &cube, |_| 0, 1.0)
}
