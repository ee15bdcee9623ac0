//! Cuts that the blade has left: made by blades, deformed, shaken and settled on the engine, they are still
//! there, and their lips lie on each other.

use super::clay::{CELL, CUBE_CENTRE, CutCube, Random, affine, domain};
use crate::lab::{Lab, Size, set_velocity, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::SurfaceSettings;
use bevy_clay::surface::mesh::Mesh;
use glam::{DMat3, DQuat, DVec3};

/// Speed of the particles before they settle, over that of waves [-].
const SHAKE: f64 = 1e-3;

/// A blade that stands in the plane of a cut: large, or with its lower edge where the cut ends.
fn blade(cube: &CutCube, index: usize) -> ToolPath {
    let cut = &cube.cuts[index];
    let half = 12.0;
    let shape = ToolShape::Blade { half_width: half * CELL, half_height: half * CELL };
    // Up in the plane: where the cut ends across its `end`, else anywhere.
    let (along, depth) = cut.end;
    let up = along.reject_from(cut.normal).try_normalize().unwrap_or_else(|| cut.normal.any_orthonormal_vector());
    let middle = if depth == f64::MIN {
        cut.point
    } else {
        // The plane's point with p . along = depth, half a blade further up.
        cut.point + up * ((depth - cut.point.dot(along)) / up.dot(along) + half)
    };
    let rotation = DQuat::from_mat3(&DMat3::from_cols(up.cross(cut.normal), up, cut.normal));
    let pose = Pose { position: domain(30.0).to_world(middle), rotation };
    ToolPath::still(index as u32 + 1, Tool { shape, contact: Contact::Slip }, pose)
}

/// The cube cut by blades in one substep, deformed by `map`, shaken and settled for `steps` substeps.
fn settled(cube: &CutCube, map: DMat3, steps: u32, random: &mut Random) -> (Vec<Particle>, Mesh) {
    let material = ClayMaterial { weld: Weld::Off, ..Preset::SoftClay.material() };
    let volume = (CELL.powi(3) / 8.0) as f32;
    let particles = cube.points.iter().zip(0..).map(|(p, id)| Particle::at(*p, volume, id)).collect();
    let dt = stable_step(&material) * CELL / crate::lab::DX;
    let mut lab = Lab::new(&snapshot(domain(30.0), material, particles), dt);
    lab.frame_with(1, &(0..cube.cuts.len()).map(|i| blade(cube, i)).collect::<Vec<_>>());
    let mut particles = lab.particles();
    let speed = SHAKE * material.wave_speed(material.density);
    for (p, at) in particles.iter_mut().zip(&cube.points) {
        // Where it was before a blade set it back by its thousandth of a cell.
        let tags = p.tags;
        *p = Particle::at(CUBE_CENTRE + map * (*at - CUBE_CENTRE), volume * map.determinant().abs() as f32, p.id);
        p.tags = tags;
        set_velocity(p, random.vector(-speed, speed));
    }
    let mut lab = Lab::new(&snapshot(domain(30.0), material, particles), dt);
    // Settled to a thousandth in the first hundred substeps.
    lab.plan.validation.damping = 0.07 / dt;
    lab.frame(steps);
    let source = lab.engine.surface().expect("clay is loaded");
    (lab.particles(), extract(&source, &SurfaceSettings::default()))
}

/// Mean distance [cells] between the lips of a cut through the cube, along its normal `n` at the plane
/// through `point`: area-weighted, away from the faces.
fn lip_gap(mesh: &Mesh, n: DVec3, point: DVec3) -> Option<f64> {
    let domain = domain(30.0);
    let (mut areas, mut sums) = ([0.0; 2], [0.0; 2]);
    for t in &mesh.triangles {
        let vector = mesh.area_vector(*t);
        let centre = domain.to_grid(mesh.corners(*t).iter().sum::<DVec3>() / 3.0);
        let (along, distance) = (vector.dot(n) / vector.length(), (centre - point).dot(n));
        if (centre - CUBE_CENTRE).abs().max_element() < 3.5 && along.abs() > 0.7 && distance.abs() < 0.75 {
            // The lip of the clay behind faces forward.
            let lip = usize::from(along < 0.0);
            areas[lip] += vector.length();
            sums[lip] += vector.length() * distance;
        }
    }
    let has_both = areas.iter().all(|a| *a > 10.0 * CELL * CELL);
    has_both.then(|| sums[1] / areas[1] - sums[0] / areas[0])
}

/// Cubes cut once, deformed and settled; those with two cuts that cross.
pub fn cases(size: Size) -> Vec<Row> {
    let steps = size.pick(100, 300, 1000);
    // Every other cube, of some two seconds each, is cut through; every fourth has two cuts.
    let (count, crossings) = size.pick((2, 1), (2, 1), (200, 50));
    let mut random = Random(21);
    let (mut right, mut crossed, mut gap, mut known) = (0, 0, 0.0f64, usize::MAX);
    for i in 0..count {
        let cube = CutCube::one(i, &mut random);
        let map = affine(&mut random);
        let (particles, mesh) = settled(&cube, map, steps, &mut random);
        // A cut that has gone through has left two bodies.
        let knows = |p: &&Particle| p.tags[0].side != 0 || p.body != 0;
        known = known.min(particles.iter().filter(knows).count());
        right += usize::from(cube.fault(&mesh).is_none());
        if cube.bodies == 2 {
            let n = (map.inverse().transpose() * cube.cuts[0].normal).normalize();
            let point = CUBE_CENTRE + map * (cube.cuts[0].point - CUBE_CENTRE);
            // Lips that are not there are no lips that lie on each other.
            gap = gap.max(lip_gap(&mesh, n, point).map_or(f64::INFINITY, f64::abs));
        }
    }
    for i in 0..crossings {
        let cube = CutCube::crossed(i, &mut random);
        let (_, mesh) = settled(&cube, affine(&mut random), steps, &mut random);
        crossed += usize::from(cube.fault(&mesh).is_none());
    }
    let percent = |right: usize, count: usize| 100.0 * right as f64 / count as f64;
    vec![
        Row::at_least(
            "cuts of a blade that stood for a substep, mapped and settled: right bodies",
            percent(right, count),
            "%",
            99.0,
        ),
        Row::at_least("cuts that cross, the same: four bodies", percent(crossed, crossings), "%", 99.0),
        Row::at_most("settled cuts: distance between the lips, worst", gap, "cells", 0.02),
        Row::at_least("settled cuts: least number of particles at one", known as f64, "particles", 500.0),
    ]
}
