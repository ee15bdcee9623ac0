//! The surface: topology of random fields against the count of their nodes, accuracy on a sphere.

use crate::lab::{DX, Random, Size, room, world};
use crate::report::Row;
use bevy_clay::sim::params::WALL_NODE;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::{extract, extract_field};
use bevy_clay::surface::field::{Field, SurfaceSettings};
use bevy_clay::surface::oracle::euler_number_of_nodes;
use glam::{DVec3, Vec3};

/// Random fields of 7^3 nodes between empty ones; every other one of whole numbers, with many values that equal the threshold.
pub(crate) fn random_fields(size: Size) -> Vec<Row> {
    let mut random = Random::new(1);
    let extent = [9; 3];
    let (mut open, mut edges, mut vertices, mut turned, mut degenerate, mut euler) = (0, 0, 0, 0, 0, 0);
    for case in 0..size.pick(200, 1000, 1000) {
        let mut values = vec![-1.0f32; 729];
        for i in 0..343 {
            let value = random.next();
            let at = i % 7 + 1 + 9 * (i / 7 % 7 + 1 + 9 * (i / 49 + 1));
            values[at] = if case % 2 == 0 { value as f32 } else { (value * 3.5).round() as f32 };
        }
        let mesh = extract_field(&Field::from_nodes(extent, &values, None), 0.0);
        let check = MeshCheck::of(&mesh);
        open += check.open_edges;
        edges += check.nonmanifold_edges;
        vertices += check.nonmanifold_vertices;
        turned += check.misoriented_edges;
        degenerate += check.degenerate_triangles;
        euler += usize::from(check.euler != euler_number_of_nodes(extent, &values, 0.0));
    }
    let row = |what: &str, count: usize| Row::at_most(format!("random fields: {what}"), count as f64, "count", 0.0);
    vec![
        row("open edges", open),
        row("edges of more than two triangles", edges),
        row("vertices of more than one fan", vertices),
        row("misoriented edges", turned),
        row("degenerate triangles", degenerate),
        row("fields whose Euler number is not that of their nodes", euler),
    ]
}

/// A ball of 10 cells with 8 jittered particles per cell, on the fine grid.
pub(crate) fn sphere(size: Size) -> Vec<Row> {
    const RADIUS: f64 = 10.0;
    let jitters: &[f64] = size.pick(&[0.25], &[0.25, 0.5], &[0.25, 0.5]);
    let domain = room([32; 3], Wall::Separate);
    let centre = DVec3::new(16.13, 15.87, 16.31);
    let mut rows = vec![];
    for &jitter in jitters {
        let particles = ball(centre, RADIUS, jitter);
        let mesh = extract(&SurfaceSource { domain, particles: particles.into() }, &SurfaceSettings::default());
        let middle = world(&domain, centre);
        let from_middle = |p: &[f32; 3]| (Vec3::from_array(*p).as_dvec3() - middle) / DX;
        let errors: Vec<f64> = mesh.positions.iter().map(|p| from_middle(p).length() - RADIUS).collect();
        let count = errors.len() as f64;
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
        let angle = |(p, n): (&[f32; 3], &[f32; 3])| from_middle(p).angle_between(Vec3::from_array(*n).as_dvec3()).to_degrees();
        let normals = mesh.normals.as_deref().unwrap_or_default();
        let normal_rms =
            (mesh.positions.iter().zip(normals).map(angle).map(|a| a * a).sum::<f64>() / normals.len() as f64).sqrt();
        let volume = mesh.volume() / (4.0 / 3.0 * std::f64::consts::PI * (RADIUS * DX).powi(3)) - 1.0;
        let name = |what: &str| format!("sphere of 10 cells, jitter {jitter}: {what}");
        let check = MeshCheck::of(&mesh);
        let defects = usize::from(!check.is_closed_manifold()) + check.components.abs_diff(1);
        rows.push(Row::at_most(name("volume error"), 100.0 * volume.abs(), "%", 1.0));
        rows.push(Row::at_most(name("rms distance"), rms, "cells", 0.045));
        rows.push(Row::at_most(name("rms of vertex normals"), normal_rms, "degrees", 3.5));
        rows.push(Row::at_most(name("not one closed body"), defects as f64, "count", 0.0));
    }
    rows
}

/// Particles of a lattice of half a cell, each moved by up to `jitter` of that along each axis, inside the ball.
pub(crate) fn ball(centre: DVec3, radius: f64, jitter: f64) -> Vec<SurfaceParticle> {
    let mut random = Random::new(3);
    let n = 4 * (radius as i32 + 2);
    let low = centre.floor() - f64::from(n) / 4.0;
    let place = |i: i32| DVec3::new(f64::from(i / n / n), f64::from(i / n % n), f64::from(i % n));
    let mut particle = |i: i32| {
        let shift = DVec3::new(random.next(), random.next(), random.next()) * jitter;
        let at = low + (place(i) + 0.5 + shift) / 2.0;
        let position = (at + f64::from(WALL_NODE)).as_vec3().to_array();
        (at.distance(centre) < radius).then_some(SurfaceParticle { position, volume_ratio: 1.0, density_weight: 0.125, tags: 0 })
    };
    (0..n * n * n).filter_map(&mut particle).collect()
}
