//! Balls and clusters: place, normals, volume, steadiness.

use super::clay::{BALL_CENTRE, CELL, CUBE_CENTRE, Random, ball, cluster, domain, lattice, source};
use crate::lab::Size;
use crate::report::Row;
use bevy_clay::sim::frame::{SurfaceParticle, SurfaceSource};
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::SurfaceSettings;
use bevy_clay::surface::grains::{Extraction, extract_with_grains};
use bevy_clay::surface::mesh::Mesh;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Vertices in cells from the ball's middle.
fn from_middle(mesh: &Mesh, source: &SurfaceSource) -> Vec<DVec3> {
    let middle = source.domain.to_world(BALL_CENTRE);
    mesh.positions.iter().map(|p| (Vec3::from_array(*p).as_dvec3() - middle) / CELL).collect()
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|v| v * v).sum::<f64>() / count).sqrt()
}

/// Balls with 8 jittered particles per cell, on the fine grid.
pub fn sphere(size: Size) -> Vec<Row> {
    const RADIUS: f64 = 10.0;
    let jitters: &[f64] = size.pick(&[0.25], &[0.25, 0.5], &[0.25, 0.5]);
    let mut rows = vec![];
    for &jitter in jitters {
        let s = ball(RADIUS, jitter, 3);
        let mesh = extract(&s, &SurfaceSettings::default());
        let places = from_middle(&mesh, &s);
        let normals = mesh.normals.as_deref().unwrap_or_default();
        let angle = |(p, n): (&DVec3, &[f32; 3])| p.angle_between(Vec3::from_array(*n).as_dvec3()).to_degrees();
        let volume = mesh.volume() / (4.0 / 3.0 * PI * (RADIUS * CELL).powi(3)) - 1.0;
        let name = |what: &str| format!("sphere of 10 cells, jitter {jitter}: {what}");
        let check = MeshCheck::of(&mesh);
        let defects = usize::from(!check.is_closed_manifold()) + check.components.abs_diff(1);
        rows.push(Row::at_most(name("volume error"), 100.0 * volume.abs(), "%", 1.0));
        rows.push(Row::at_most(name("rms distance"), rms(places.iter().map(|p| p.length() - RADIUS)), "cells", 0.045));
        rows.push(Row::at_most(name("rms of vertex normals"), rms(places.iter().zip(normals).map(angle)), "degrees", 3.5));
        rows.push(Row::at_most(name("not one closed body"), defects as f64, "count", 0.0));
    }
    // The same ball on finer grids: distance over radius falls as the cells do.
    let error = |radius: f64| {
        let s = ball(radius, 0.25, 3);
        let places = from_middle(&extract(&s, &SurfaceSettings { normals: false, ..SurfaceSettings::default() }), &s);
        rms(places.iter().map(|p| p.length() / radius - 1.0))
    };
    let (coarse, fine) = size.pick((5.0, 10.0), (5.0, 10.0), (5.0, 16.0));
    let order = (error(coarse) / error(fine)).ln() / (fine / coarse).ln();
    rows.push(Row::at_least(format!("sphere: order of distance, {coarse} to {fine} cells"), order, "-", 0.8));
    rows
}

/// Volume [cells] of mesh and grains together.
fn volume(all: &Extraction) -> f64 {
    let grains: f64 = all.grains.iter().map(|g| 4.0 / 3.0 * PI * f64::from(g.radius).powi(3)).sum();
    (all.mesh.volume() + grains) / CELL.powi(3)
}

/// Small pieces: mesh and grains against the particles' volume; bodies with sharp edges.
pub fn clusters(size: Size) -> Vec<Row> {
    let settings = SurfaceSettings::default();
    let count = size.pick(5, 15, 100);
    let (mut least, mut small, mut small_mean, mut large) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for n in [1, 2, 3, 4, 6, 7, 8, 10, 12, 13, 14, 15, 16, 20, 26, 27, 40, 64, 125] {
        let mut random = Random(5);
        let ratios: Vec<f64> = (0..count)
            .map(|_| {
                volume(&extract_with_grains(&source(domain(24.0), &cluster(n, &mut random), |_| 0, 1.0), &settings))
                    / (n as f64 / 8.0)
            })
            .collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let worst = ratios.iter().fold(0.0f64, |w, r| w.max((r - 1.0).abs()));
        match n {
            0..8 => least = least.max(worst),
            8..27 => (small, small_mean) = (small.max(worst), small_mean.max((mean - 1.0).abs())),
            _ => large = large.max(worst),
        }
    }
    let cube = lattice(CUBE_CENTRE - 6.0, CUBE_CENTRE + 6.0, 0.5, &mut Random(8), |_| true);
    let cube = source(domain(36.0), &cube, |_| 0, 1.0);
    let bulk =
        [ball(10.0, 0.5, 3), cube].map(|s| volume(&extract_with_grains(&s, &settings)) / (s.particles.len() as f64 / 8.0) - 1.0);
    vec![
        Row::at_most("clusters of 1 to 7: volume, worst", 100.0 * least, "%", 50.0),
        Row::at_most("clusters of 8 to 26: volume, worst", 100.0 * small, "%", 50.0),
        Row::at_most("clusters of 8 to 26: volume, mean of a size", 100.0 * small_mean, "%", 50.0),
        Row::at_most("clusters of 27 and more: volume, worst", 100.0 * large, "%", 25.0),
        Row::at_most("ball and cube: volume, worst", 100.0 * bulk[0].abs().max(bulk[1].abs()), "%", 1.0),
    ]
}

/// A ball that moves by parts of a cell: how much its surface trembles in the clay's own frame. The same clay
/// twice: the same bits.
pub fn motion(size: Size) -> Vec<Row> {
    const RADIUS: f64 = 10.0;
    let first = ball(RADIUS, 0.5, 3);
    let mut random = Random(9);
    let rays: Vec<DVec3> = (0..size.pick(50, 100, 400)).map(|_| random.direction()).collect();
    let settings = SurfaceSettings { normals: false, ..SurfaceSettings::default() };
    let steps = 8;
    let mut reaches = vec![vec![]; rays.len()];
    for step in 0..steps {
        let shift = DVec3::new(0.125, 0.07, 0.03) * f64::from(step);
        let moved = |p: &SurfaceParticle| {
            let position = (Vec3::from_array(p.position) + shift.as_vec3()).to_array();
            SurfaceParticle { position, ..*p }
        };
        let s = SurfaceSource { domain: first.domain, particles: first.particles.iter().map(moved).collect::<Vec<_>>().into() };
        let mesh = extract(&s, &settings);
        let places: Vec<DVec3> = from_middle(&mesh, &s).into_iter().map(|p| p - shift).collect();
        for (ray, reach) in rays.iter().zip(&mut reaches) {
            reach.push(farthest(&mesh, &places, *ray));
        }
    }
    let variance = |r: &Vec<f64>| {
        let mean = r.iter().sum::<f64>() / f64::from(steps);
        r.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(steps)
    };
    let jitter = (reaches.iter().map(variance).sum::<f64>() / rays.len() as f64).sqrt();
    let settings = SurfaceSettings::default();
    let differs = extract(&first, &settings) != extract(&first, &settings);
    vec![
        Row::at_most("moving ball: surface trembles, rms", jitter, "cells", 0.015),
        Row::at_most("the same clay twice: differs", f64::from(u8::from(differs)), "-", 0.0),
    ]
}

/// Where a ray from the origin leaves the mesh.
fn farthest(mesh: &Mesh, places: &[DVec3], ray: DVec3) -> f64 {
    let hit = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| places[v as usize]);
        let normal = (b - a).cross(c - a);
        let along = a.dot(normal) / ray.dot(normal);
        let p = ray * along;
        let is_in = [(a, b), (b, c), (c, a)].iter().all(|(u, v)| (*v - *u).cross(p - *u).dot(normal) >= 0.0);
        (is_in && along > 0.0).then_some(along)
    };
    mesh.triangles.iter().filter_map(hit).fold(0.0, f64::max)
}
