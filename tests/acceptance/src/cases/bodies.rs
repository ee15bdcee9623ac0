//! Bodies that cuts leave: three planes through one point make eight.

use crate::lab::{DX, Lab, Mover, Size, block, jitter, room, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::scene::resample::surface_source;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::SurfaceSettings;
use glam::{DMat3, DQuat, DVec3, IVec3};
use std::collections::BTreeMap;

/// Edge of the block [cells].
const EDGE: i32 = 8;
/// The block's middle [cells]: where the planes meet is off the grid.
const MIDDLE: f64 = 14.0;
const MEETING: DVec3 = DVec3::new(14.2, 13.9, 14.4);
/// Speed of the blade [m/s].
const SPEED: f64 = 1.5;
/// Half the blade [cells]: wider than the block, and thinner than it along its way.
const HALF_WIDTH: f64 = 8.0;
const HALF_HEIGHT: f64 = 1.5;
/// Substeps of a frame.
const STEPS: u32 = 20;

/// The planes' normals, and along which axis the blade goes through each.
fn planes() -> [(DVec3, DVec3); 3] {
    [(DVec3::new(1.0, 0.1, -0.05), DVec3::Y), (DVec3::new(0.05, 1.0, 0.12), DVec3::Z), (DVec3::new(-0.1, 0.05, 1.0), DVec3::X)]
}

/// A blade is drawn through the block along a plane, and taken away.
fn cut(lab: &mut Lab, domain: &Domain, (normal, way): (DVec3, DVec3)) {
    let normal = normal.normalize();
    let way = way.reject_from_normalized(normal).normalize();
    let rotation = DQuat::from_mat3(&DMat3::from_cols(way.cross(normal), way, normal));
    let shape = ToolShape::Blade { half_width: HALF_WIDTH, half_height: HALF_HEIGHT };
    let reach = 0.5 * f64::from(EDGE) + HALF_HEIGHT + 2.5;
    let mut blade = Mover::new(domain, shape, Contact::Slip, MEETING - reach * way, rotation);
    blade.velocity = SPEED * way;
    let duration = lab.plan.dt * f64::from(STEPS);
    for _ in 0..(2.0 * reach * DX / SPEED / duration).ceil() as u32 {
        lab.frame_moving(STEPS, &mut blade);
    }
    // The planner learns of it two frames later.
    (0..4).for_each(|_| _ = lab.frame(STEPS));
}

/// Three cuts, one after the other, that cross in one point inside a block.
pub(super) fn pieces(_: Size) -> Vec<Row> {
    let domain = room([28, 28, 28], Wall::Separate);
    let mut particles = block(DVec3::splat(MIDDLE - 0.5 * f64::from(EDGE)), IVec3::splat(EDGE));
    jitter(&mut particles, 0.1, 5);
    let material = ClayMaterial { toughness: 0.0, ..Preset::SoftClay.material() };
    let mut lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
    planes().into_iter().for_each(|plane| cut(&mut lab, &domain, plane));
    let particles = lab.particles();
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    particles.iter().for_each(|p| *counts.entry(p.body).or_default() += 1);
    let least = counts.values().min().copied().unwrap_or(0) as f64 / particles.len() as f64;
    let meshes = extract(&surface_source(&domain, &particles), &SurfaceSettings::default()).components();
    let closed = meshes.iter().filter(|mesh| MeshCheck::of(mesh).is_closed_manifold() && mesh.volume() > 0.0).count();
    let name = |what: &str| format!("block of {EDGE} cells, three planes through one point: {what}");
    vec![
        Row::at_most(name("bodies more or less than eight"), counts.len().abs_diff(8) as f64, "bodies", 0.0),
        Row::at_least(name("clay of the smallest, of an eighth"), 800.0 * least, "%", 60.0),
        Row::at_most(name("exported meshes more or less than eight"), meshes.len().abs_diff(8) as f64, "meshes", 0.0),
        Row::at_most(name("exported meshes that are not closed"), (meshes.len() - closed) as f64, "meshes", 0.0),
    ]
}
