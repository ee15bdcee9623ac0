//! Bodies that touch: each a closed mesh of its own, as the sides of a cut are.

use bevy_clay::sim::frame::SurfaceSource;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::{Field, SurfaceSettings, Tier};
use bevy_clay::surface::mesh::Mesh;
use bevy_clay::surface::ray::cast_ray;
use clay_acceptance::cases::surface::clay::{CELL, CUBE_CENTRE, Cut, CutCube, Random, affine, changed};
use glam::{DMat3, DVec3};

const TIERS: [Tier; 2] = [Tier::Fine, Tier::Coarse];

fn meshes(source: &SurfaceSource) -> [Mesh; 2] {
    TIERS.map(|tier| extract(source, &SurfaceSettings::new(tier)))
}

/// Volumes of a mesh's components, the least first [cells].
fn volumes(mesh: &Mesh) -> Vec<f64> {
    let mut volumes: Vec<f64> = mesh.components().iter().map(|body| body.volume() / CELL.powi(3)).collect();
    volumes.sort_by(f64::total_cmp);
    volumes
}

/// Blades on nodes, between them, and anywhere: two bodies are what the two sides of the cut are, without its
/// tags.
#[test]
fn two_bodies_are_the_sides_of_a_cut() {
    let mut random = Random(31);
    let on_grid = [0.0, 0.25, 0.5, 0.1, 0.37].map(|off| Cut::through(DVec3::X, CUBE_CENTRE + off));
    let mut cubes: Vec<CutCube> = on_grid.map(|cut| CutCube::new(vec![cut], 2, 0.25, &mut random)).into();
    cubes.extend((0..12).map(|i| CutCube::one(2 * i, &mut random)));
    for (i, cube) in cubes.iter().enumerate() {
        let map = if i % 3 == 2 { affine(&mut random) } else { DMat3::IDENTITY };
        for (cut, bodies) in meshes(&cube.source(map)).iter().zip(meshes(&cube.parted_source(map))) {
            assert_eq!(cube.fault(&bodies), None, "{i}");
            let [cut, bodies] = [volumes(cut), volumes(&bodies)];
            assert!(cut.iter().zip(&bodies).all(|(a, b)| (a - b).abs() < 5e-4 * a), "{i}: {bodies:?}, as sides {cut:?}");
        }
    }
}

/// Three planes through a point, each piece a body: eight closed components, but for pieces without a node.
#[test]
fn eight_bodies_meet_at_a_point() {
    let mut random = Random(32);
    for i in 0..16 {
        let axes = if i < 4 { DMat3::IDENTITY } else { DMat3::from_axis_angle(random.direction(), random.range(0.0, 3.0)) };
        let point = CUBE_CENTRE + if i == 0 { DVec3::ZERO } else { random.vector(-1.0, 1.0) };
        let cube = CutCube::octants(point, axes, &mut random);
        let map = if i % 4 == 3 { affine(&mut random) } else { DMat3::IDENTITY };
        for mesh in meshes(&cube.parted_source(map)) {
            assert_eq!(cube.fault(&mesh), None, "{i}");
        }
    }
}

/// A body alone is the same mesh whatever its number, with cuts and without; so are bodies that are not near
/// each other.
#[test]
fn numbers_alone_change_nothing() {
    let mut random = Random(33);
    for i in 0..4 {
        let cube = CutCube::one(i, &mut random).source(DMat3::IDENTITY);
        let numbered = changed(&cube, |all| all.iter_mut().for_each(|p| p.body = 7));
        let apart = |number: u32| {
            changed(&cube, |all| {
                let other = all.iter().map(|p| [p.position[0], p.position[1] - 11.5, p.position[2]]);
                let other: Vec<_> = all.iter().zip(other).map(|(p, position)| (position, *p)).collect();
                all.iter_mut().for_each(|p| p.position[1] += 5.0);
                all.extend(other.into_iter().map(|(position, mut p)| {
                    (p.position, p.body, p.tags) = (position, number, 0);
                    p
                }));
            })
        };
        for (first, second) in [(&cube, numbered), (&apart(0), apart(9))] {
            assert!(meshes(first) == meshes(&second), "{i}");
        }
    }
}

/// A cut that ends in a body, or goes through it, or through two that touch: it opens up to the other body's
/// face, which is whole.
#[test]
fn cuts_end_at_the_face_of_another_body() {
    let mut random = Random(34);
    for i in 0..24 {
        let depth = CUBE_CENTRE.y + if i % 3 == 2 { -7.0 } else { random.range(-3.0, 3.0) };
        let (cube, source) = CutCube::cut_beside_body(i % 2 == 1, depth, &mut random);
        for (tier, mesh) in TIERS.iter().zip(meshes(&source)) {
            assert_eq!(cube.fault(&mesh), None, "{i} {tier:?}");
        }
    }
}

/// Rays meet what the mesh shows of bodies that have come apart by less than f sees.
#[test]
fn rays_meet_the_face_of_each_body() {
    let cube = CutCube::new(vec![Cut::through(DVec3::X, CUBE_CENTRE + 0.1)], 2, 0.25, &mut Random(35));
    let source = changed(&cube.parted_source(DMat3::IDENTITY), |all| {
        all.iter_mut().filter(|p| p.body == 0).for_each(|p| p.position[0] -= 1.5);
    });
    let settings = SurfaceSettings::default();
    let field = Field::of_particles(&source, &settings);
    let mesh = extract(&source, &settings);
    let depth = |from: DVec3| {
        let hit = cast_ray(&field, &settings, source.domain.to_world(from), DVec3::NEG_Y);
        hit.map(|hit| source.domain.to_grid(hit.point).y)
    };
    let above = CUBE_CENTRE + DVec3::new(0.0, 10.0, 0.2);
    let [left, gap, right] = [-4.0, -0.65, 4.0].map(|x| depth(above + DVec3::X * x));
    assert!([left, right].iter().all(|y| y.is_some_and(|y| (y - CUBE_CENTRE.y - 6.0).abs() < 0.2)), "{left:?} {right:?}");
    assert!(gap.is_none_or(|y| y < CUBE_CENTRE.y), "{gap:?} in the gap");
    assert_eq!(volumes(&mesh).len(), 2);
}
