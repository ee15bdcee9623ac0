//! What callers rely on: files, threads, odd input, memory.

use bevy_clay::scene::export::write_mesh;
use bevy_clay::sim::frame::{SurfaceParticle, SurfaceSource};
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::{Field, SurfaceSettings};
use bevy_clay::surface::mesh::Mesh;
use clay_acceptance::cases::surface::clay::{CutCube, Random, ball, domain, lattice, source};
use glam::{DMat3, DVec3};

/// A cut cube through an STL file, whose reader merges equal positions: still two closed bodies of the same
/// volume.
#[test]
fn cut_survives_an_stl_file() {
    let mut random = Random(14);
    let cut = CutCube::one(0, &mut random);
    let mesh = extract(&cut.source(DMat3::IDENTITY), &SurfaceSettings::default());
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("cut.stl");
    write_mesh(&path, &mesh).expect("written");
    let read = stl_io::read_stl(&mut std::fs::File::open(&path).expect("file")).expect("an STL");
    let triangles = read.faces.iter().map(|f| f.vertices.map(|v| v as u32)).collect();
    let read = Mesh::new(read.vertices.iter().map(|v| v.0).collect(), triangles);
    let check = MeshCheck::of(&read);
    assert!(check.is_closed_manifold() && check.components == 2, "{check:?}");
    assert!((read.volume() / 1e9 / mesh.volume() - 1.0).abs() < 1e-3);
}

/// The same particles give the same bits on one thread and on five.
#[test]
fn extraction_does_not_depend_on_the_number_of_threads() {
    let mut random = Random(15);
    let cut = CutCube::crossed_by_partial(1, &mut random);
    let s = cut.source(DMat3::IDENTITY);
    let with_threads = |count: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a pool");
        pool.install(|| extract(&s, &SurfaceSettings::default()))
    };
    let one = with_threads(1);
    assert!(!one.triangles.is_empty());
    assert!(one == with_threads(5) && one == with_threads(2));
}

/// Particles that are not finite, or far outside the grid, are left out; no particles give an empty mesh.
#[test]
fn unusable_particles_are_left_out() {
    let s = ball(4.0, 0.25, 3);
    let expected = extract(&s, &SurfaceSettings::default());
    let mut particles = s.particles.to_vec();
    for x in [f32::NAN, f32::INFINITY, -1e30, 1e6] {
        particles.push(SurfaceParticle { position: [20.0, x, 20.0], ..particles[0] });
        particles.push(SurfaceParticle { volume_ratio: f32::NAN, ..particles[0] });
    }
    let mesh = extract(&SurfaceSource { domain: s.domain, particles: particles.into() }, &SurfaceSettings::default());
    assert!(mesh == expected);
    let none = SurfaceSource { domain: s.domain, particles: Vec::new().into() };
    assert!(extract(&none, &SurfaceSettings::default()).triangles.is_empty());
}

/// Two lumps at opposite ends of the largest grid cost what two lumps cost, not what the grid would (64 GiB).
#[test]
fn memory_follows_the_particles_and_not_the_grid() {
    let mut random = Random(16);
    let mut points = Vec::new();
    for corner in [DVec3::splat(8.0), DVec3::splat(1000.0)] {
        points.extend(lattice(corner, corner + 4.0, 0.25, &mut random, |_| true));
    }
    let s = source(domain(1012.0), &points, |_| 0, 1.0);
    let field = Field::of_particles(&s, &SurfaceSettings::default());
    println!("{} KiB", field.memory() / 1024);
    assert!(field.memory() < 1 << 20, "{} bytes", field.memory());
    assert_eq!(MeshCheck::of(&extract(&s, &SurfaceSettings::default())).components, 2);
}
