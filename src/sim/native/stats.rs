//! Sums over the particles, in f64 and in a fixed order.

use super::super::params::Domain;
use super::super::sums::ParticleSums;
use super::law;
use super::state::{Cold, Hot, strains};
use glam::DVec3;
use rayon::prelude::*;

/// Particles per task of what goes once over all of them: sums' order must not depend on the number of
/// threads.
pub(super) const CHUNK: usize = 2048;

/// Sums over all particles.
pub(super) fn sums(domain: &Domain, hot: &[Hot], cold: &[Cold]) -> ParticleSums {
    let chunks = hot.par_chunks(CHUNK).zip(cold.par_chunks(CHUNK));
    let parts: Vec<_> = chunks.map(|(h, c)| sums_of_chunk(domain, h, c)).collect();
    parts.iter().fold(ParticleSums::ZERO, |sum, p| sum.plus(p))
}

fn sums_of_chunk(domain: &Domain, hot: &[Hot], cold: &[Cold]) -> ParticleSums {
    let mut s = ParticleSums::ZERO;
    // A quadratic spline's inertia: sum of w (x_i - x_p)^2 = dx^2 / 4 along each axis.
    let inertia = domain.cell_width * domain.cell_width / 4.0;
    for (hot, cold) in hot.chunks(8).zip(cold.chunks(8)) {
        let (norm2, trace) = law::hencky_invariants(&strains(hot));
        for (k, (h, c)) in hot.iter().zip(cold).enumerate() {
            let volume = f64::from(c.rest_volume);
            let v = DVec3::from_array(h.velocity.map(f64::from));
            let a = h.affine.map(|c| DVec3::from_array(c.map(f64::from)));
            let x = h.place();
            let curl = DVec3::new(a[1].z - a[2].y, a[2].x - a[0].z, a[0].y - a[1].x);
            let j = f64::from(trace.0[k]).exp();
            s.count += 1;
            s.volume += volume;
            s.momentum += volume * v;
            s.angular += volume * (domain.to_world(x).cross(v) + inertia * curl);
            s.speed += volume * v.length();
            s.kinetic += 0.5 * volume * (v.length_squared() + inertia * a.iter().map(|c| c.length_squared()).sum::<f64>());
            s.strain.0 += volume * f64::from(norm2.0[k]);
            s.strain.1 += volume * f64::from(trace.0[k]).powi(2);
            s.ratio = (s.ratio.0.min(j), s.ratio.1.max(j));
            s.present_volume += volume * j;
        }
    }
    s
}
