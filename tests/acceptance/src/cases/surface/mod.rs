//! The surface: topology of random fields and of cuts, accuracy, clusters, steadiness; times.

mod ball;
pub mod clay;
mod cut_faces;
mod cuts;
pub mod device;
mod fields;
mod gpu;
mod rest;
mod settled;
pub mod speed;

pub use ball::{clusters, motion, sphere};
pub use cut_faces::{moved_blade, parted_block};
pub use cuts::{cuts, meeting_cuts};
pub use fields::random_fields;
pub use gpu::on_device;
pub use rest::at_rest;
pub use settled::cases as settled_cuts;

use crate::lab::Random;
use bevy_clay::sim::frame::SurfaceParticle;
use bevy_clay::sim::params::WALL_NODE;
use glam::DVec3;

/// Particles of a lattice of half a cell, each moved by up to `jitter` of that along each axis, inside the
/// ball; `centre` from the room's low corner.
pub fn ball(centre: DVec3, radius: f64, jitter: f64) -> Vec<SurfaceParticle> {
    let mut random = Random::new(3);
    let n = 4 * (radius as i32 + 2);
    let low = centre.floor() - f64::from(n) / 4.0;
    let place = |i: i32| DVec3::new(f64::from(i / n / n), f64::from(i / n % n), f64::from(i % n));
    let mut particle = |i: i32| {
        let shift = DVec3::new(random.uniform(), random.uniform(), random.uniform()) * jitter;
        let at = low + (place(i) + 0.5 + shift) / 2.0;
        let position = (at + f64::from(WALL_NODE)).as_vec3().to_array();
        (at.distance(centre) < radius).then_some(SurfaceParticle {
            position,
            volume_ratio: 1.0,
            density_weight: 0.125,
            ..Default::default()
        })
    };
    (0..n * n * n).filter_map(&mut particle).collect()
}
