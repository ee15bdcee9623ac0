//! Where the faces of a cut stand that a moving blade has made: in the blade's plane, with all the clay's
//! volume, lip to lip.

use crate::lab::{DX, Lab, Mover, Size, block, jitter, room, snapshot, stable_step, world};
use crate::report::Row;
use bevy_clay::scene::resample::surface_source;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::SurfaceSettings;
use bevy_clay::surface::mesh::Mesh;
use glam::{DMat3, DQuat, DVec3, IVec3};

/// Edge of the block, and of its room [cells].
const EDGE: i32 = 12;
const ROOM: i32 = 32;
/// Speed of the blade [m/s].
const SPEED: f64 = 1.5;
/// Half the blade [cells]: wider than the block, and thinner than it along its way.
const HALF_WIDTH: f64 = 10.0;
const HALF_HEIGHT: f64 = 1.5;
/// Substeps of a frame.
const STEPS: u32 = 20;
/// Cells from the block's sides at which the face of the cut begins.
const RIM: f64 = 1.5;

/// A plane through the block: offset of the block's middle along it [cells], its normal.
type Plane = (f64, DVec3);

fn planes(size: Size) -> Vec<Plane> {
    let all = [
        (0.4, DVec3::new(1.0, 0.17, -0.1)),
        (0.25, DVec3::X),
        (0.0, DVec3::X),
        (0.1, DVec3::new(1.0, 0.6, 0.3)),
        (0.5, DVec3::new(0.3, 1.0, -0.7)),
    ];
    all[..size.pick(1, 2, 5)].to_vec()
}

fn middle() -> DVec3 {
    DVec3::splat(0.5 * f64::from(ROOM))
}

/// Jittered clay at rest, nothing about it.
fn clay(seed: u64) -> Snapshot {
    let mut particles = block(middle() - 0.5 * f64::from(EDGE), IVec3::splat(EDGE));
    jitter(&mut particles, 0.1, seed);
    let material = ClayMaterial { toughness: 0.0, ..Preset::SoftClay.material() };
    snapshot(room([ROOM; 3], Wall::Separate), material, particles)
}

/// A blade is drawn through the clay along the plane, and taken away; the clay comes to rest.
fn cut(clay: &Snapshot, (offset, normal): Plane) -> Mesh {
    let normal = normal.normalize();
    let way = normal.any_orthonormal_vector();
    let rotation = DQuat::from_mat3(&DMat3::from_cols(way.cross(normal), way, normal));
    let shape = ToolShape::Blade { half_width: HALF_WIDTH, half_height: HALF_HEIGHT };
    let reach = f64::from(EDGE);
    let mut lab = Lab::new(clay, stable_step(&clay.material));
    let start = middle() + offset * normal - reach * way;
    let mut blade = Mover::new(&clay.domain, shape, Contact::Slip, start, rotation);
    blade.velocity = SPEED * way;
    let duration = lab.plan.dt * f64::from(STEPS);
    for _ in 0..(2.0 * reach * DX / SPEED / duration).ceil() as u32 {
        lab.frame_moving(STEPS, &mut blade);
    }
    lab.plan.validation.damping = 0.02 / lab.plan.dt;
    (0..10).for_each(|_| _ = lab.frame(STEPS));
    mesh(&clay.domain, &lab.particles())
}

fn mesh(domain: &Domain, particles: &[Particle]) -> Mesh {
    extract(&surface_source(domain, particles), &SurfaceSettings::default())
}

/// Distances of the face's triangles from the plane [cells], by which side they face, with their areas.
fn face(mesh: &Mesh, domain: &Domain, (offset, normal): Plane) -> [Vec<(f64, f64)>; 2] {
    let normal = normal.normalize();
    let point = world(domain, middle() + offset * normal);
    let mut sides = [vec![], vec![]];
    for t in &mesh.triangles {
        let vector = mesh.area_vector(*t);
        let centre = mesh.corners(*t).iter().sum::<DVec3>() / 3.0;
        let (along, distance) = (vector.dot(normal) / vector.length(), (centre - point).dot(normal) / DX);
        let inside = ((centre - world(domain, middle())) / DX).abs().max_element() < 0.5 * f64::from(EDGE) - RIM;
        if inside && along.abs() > 0.7 && distance.abs() < 1.5 {
            sides[usize::from(along < 0.0)].push((distance, vector.length()));
        }
    }
    sides
}

/// The block after a blade has gone through, obliquely and off the grid.
pub fn parted_block() -> Mesh {
    cut(&clay(0), planes(Size::Test)[0])
}

/// Volume, place and gap of the faces that blades leave.
pub fn moved_blade(size: Size) -> Vec<Row> {
    let (mut lost, mut off, mut farthest, mut gap, mut open) = (0.0f64, 0.0f64, 0.0f64, 0.0f64, 0);
    for (seed, plane) in planes(size).into_iter().enumerate() {
        let clay = clay(seed as u64);
        let whole = mesh(&clay.domain, &clay.particles);
        let cut = cut(&clay, plane);
        let parts = cut.components();
        open += parts.iter().filter(|part| !MeshCheck::of(part).is_closed_manifold()).count() + parts.len().abs_diff(2);
        lost = lost.max((cut.volume() / whole.volume() - 1.0).abs());
        let sides = face(&cut, &clay.domain, plane);
        let mean = sides.each_ref().map(|side| {
            let area: f64 = side.iter().map(|s| s.1).sum();
            side.iter().map(|s| s.0 * s.1).sum::<f64>() / area
        });
        let worst = sides.iter().flatten().map(|s| s.0.abs()).fold(0.0, f64::max);
        off = mean.iter().fold(off, |off, m| if m.is_nan() { f64::INFINITY } else { off.max(m.abs()) });
        farthest = farthest.max(worst);
        gap = gap.max((mean[0] - mean[1]).abs());
    }
    let count = planes(size).len();
    let name = |what: &str| format!("block of {EDGE} cells, {count} planes, a blade drawn through each: {what}");
    vec![
        Row::at_most(name("volume off that of the whole block"), 100.0 * lost, "%", 0.2),
        Row::at_most(name("faces off the plane in the mean"), off, "cells", 0.05),
        Row::figure(name("farthest triangle of a face"), farthest, "cells"),
        Row::at_most(name("distance between the lips in the mean"), gap, "cells", 0.02),
        Row::at_most(name("parts more or less than two, and not closed"), open as f64, "meshes", 0.0),
    ]
}
