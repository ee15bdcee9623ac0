//! Small clusters beside a ball, as in Fig. 4 of the paper: by Equation 9, which loses them, and by ours,
//! where each has its volume.

use bevy_clay::sim::frame::{SurfaceParticle, SurfaceSource};
use bevy_clay::sim::params::{Domain, Walls};
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::SurfaceSettings;
use bevy_clay::surface::grains::extract_with_grains;
use bevy_clay::surface::mesh::Mesh;
use glam::DVec3;

/// Cell width \[m\].
pub(crate) const CELL: f64 = 0.005;
/// Radius of the ball \[cells\].
const RADIUS: f64 = 4.0;
/// Particles of a cluster along each axis, half a cell apart: clusters of 1, 2, 4, 8 and 27.
const CLUSTERS: [[u32; 3]; 5] = [[1, 1, 1], [2, 1, 1], [2, 1, 2], [2, 2, 2], [3, 3, 3]];
/// Middles of neighbouring clusters \[cells\].
const SPACING: f64 = 3.6;

/// The clay: a ball, and the clusters in a row in front of it, all upon the same floor.
pub(crate) fn clay() -> SurfaceSource {
    let domain = Domain::new(DVec3::ZERO, DVec3::new(24.0, 16.0, 24.0) * CELL, CELL, Walls::default()).expect("a room");
    let floor = 3.0;
    let ball = DVec3::new(12.0, floor + RADIUS, 10.0);
    let steps = (2.0 * RADIUS) as i32 * 2;
    let offset = |i: i32| (f64::from(i) + 0.5) * 0.5 - RADIUS;
    let grid = (0..steps.pow(3)).map(|i| DVec3::new(offset(i % steps), offset(i / steps % steps), offset(i / steps / steps)));
    let mut places: Vec<DVec3> = grid.filter(|at| at.length() < RADIUS).map(|at| ball + at).collect();
    for (i, count) in (0..).zip(CLUSTERS) {
        let middle = DVec3::new(12.0 + (f64::from(i) - 2.0) * SPACING, floor + 0.25 * f64::from(count[1]), 17.1);
        let along = |k: u32, axis: usize| (f64::from(k) + 0.5 - 0.5 * f64::from(count[axis])) * 0.5;
        for k in 0..count.iter().product() {
            let at = DVec3::new(along(k % count[0], 0), along(k / count[0] % count[1], 1), along(k / count[0] / count[1], 2));
            places.push(middle + at);
        }
    }
    let particle = |place: DVec3| SurfaceParticle {
        position: domain.to_grid(place * CELL).as_vec3().to_array(),
        volume_ratio: 1.0,
        density_weight: 0.125,
        tags: 0,
        body: 0,
    };
    SurfaceSource { domain, particles: places.into_iter().map(particle).collect::<Vec<_>>().into() }
}

/// What each way shows of the same particles.
pub(crate) fn meshes() -> [(&'static str, Mesh); 2] {
    let clay = clay();
    [
        ("Equation 9 as published", extract(&clay, &SurfaceSettings::equation_9())),
        ("surface and grains", extract_with_grains(&clay, &SurfaceSettings::default()).drawn()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The picture of small clusters beside a ball: by Equation 9 they are gone, ours shows each with its
    /// volume.
    #[test]
    fn clusters_beside_a_ball_show() {
        let particles = clay().particles.len();
        let [(_, published), (_, ours)] = meshes();
        let volumes = |mesh: &Mesh| {
            let mut volumes: Vec<f64> = mesh.components().iter().map(|b| b.volume() / CELL.powi(3) * 8.0).collect();
            volumes.sort_by(f64::total_cmp);
            volumes
        };
        // Volumes in particles. What is left of the 42 of the clusters has less than one.
        let published = volumes(&published);
        assert!(published.iter().rev().skip(1).all(|v| *v < 1.0), "{published:?}");
        let ours = volumes(&ours);
        assert_eq!(
            ours.len(),
            1 + 2 + 4 + 8 + 1 + 1,
            "a ball for each particle of the small ones, a body for each of the others"
        );
        assert!(ours[..15].iter().all(|v| (v - 1.0).abs() < 1e-3), "{ours:?}");
        assert!((ours[15] / 27.0 - 1.0).abs() < 0.25, "{ours:?}");
        // A ball of 4 cells is all skin.
        assert!((ours[16] / (particles - 42) as f64 - 1.0).abs() < 0.05, "{ours:?}");
    }
}
