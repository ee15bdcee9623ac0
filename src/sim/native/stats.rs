//! Sums over the particles, in f64 and in a fixed order.

use super::super::engine::{Energies, FramePlan, FrameReport};
use super::super::params::Domain;
use super::law;
use super::simd::F8;
use super::state::{Cold, Hot, unpack_cell};
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// Volume-weighted sums: times density they are mass, momentum and energy.
#[derive(Clone, Debug)]
pub(super) struct Stats {
    pub count: usize,
    /// Sum of V [m^3].
    pub volume: f64,
    /// Sum of V v.
    pub momentum: DVec3,
    angular: DVec3,
    /// Sum of V |v|.
    speed: f64,
    /// Sum of V (v^2 + |C|^2 dx^2 / 4) / 2.
    kinetic: f64,
    /// Sums of V |H|^2 and V tr(H)^2.
    strain: (f64, f64),
    ratio: (f64, f64),
    /// Sum of V J.
    present_volume: f64,
}

/// Particles per task: the sums' order must not depend on the number of threads.
const CHUNK: usize = 2048;

impl Stats {
    pub(super) fn of(domain: &Domain, hot: &[Hot], cold: &[Cold]) -> Self {
        let parts: Vec<Self> =
            hot.par_chunks(CHUNK).zip(cold.par_chunks(CHUNK)).map(|(h, c)| Self::of_chunk(domain, h, c)).collect();
        parts.iter().fold(Self::ZERO, |sum, p| sum.plus(p))
    }

    const ZERO: Self = Self {
        count: 0,
        volume: 0.0,
        momentum: DVec3::ZERO,
        angular: DVec3::ZERO,
        speed: 0.0,
        kinetic: 0.0,
        strain: (0.0, 0.0),
        ratio: (f64::INFINITY, f64::NEG_INFINITY),
        present_volume: 0.0,
    };

    fn plus(&self, p: &Self) -> Self {
        Self {
            count: self.count + p.count,
            volume: self.volume + p.volume,
            momentum: self.momentum + p.momentum,
            angular: self.angular + p.angular,
            speed: self.speed + p.speed,
            kinetic: self.kinetic + p.kinetic,
            strain: (self.strain.0 + p.strain.0, self.strain.1 + p.strain.1),
            ratio: (self.ratio.0.min(p.ratio.0), self.ratio.1.max(p.ratio.1)),
            present_volume: self.present_volume + p.present_volume,
        }
    }

    fn of_chunk(domain: &Domain, hot: &[Hot], cold: &[Cold]) -> Self {
        let mut s = Self::ZERO;
        // A quadratic spline's inertia: sum of w (x_i - x_p)^2 = dx^2 / 4 along each axis.
        let inertia = domain.cell_width * domain.cell_width / 4.0;
        for (hot, cold) in hot.chunks(8).zip(cold.chunks(8)) {
            let mut strain = [F8::ZERO; 6];
            for (k, h) in hot.iter().enumerate() {
                for i in 0..6 {
                    strain[i].0[k] = h.strain[i];
                }
            }
            let (norm2, trace) = law::hencky_invariants(&strain);
            for (k, (h, c)) in hot.iter().zip(cold).enumerate() {
                let volume = f64::from(c.rest_volume);
                let v = DVec3::from_array(c.velocity.map(f64::from));
                let a = c.affine.map(|c| DVec3::from_array(c.map(f64::from)));
                let x = IVec3::from_array(unpack_cell(h.cell)).as_dvec3() + DVec3::from_array(h.offset.map(f64::from));
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

    /// Whether every sum is: then every particle is.
    pub(super) fn is_finite(&self) -> bool {
        let sums = [self.speed, self.kinetic, self.strain.0, self.strain.1, self.present_volume];
        self.momentum.is_finite() && self.angular.is_finite() && sums.iter().all(|s| s.is_finite())
    }

    /// Fills in what a report says of the particles.
    pub(super) fn write(&self, report: &mut FrameReport, plan: &FramePlan) {
        let density = plan.inertial_density();
        let m = &plan.material;
        report.particle_count = self.count;
        report.particle_mass = self.volume * density;
        report.momentum = self.momentum * density;
        report.angular_momentum = self.angular * density;
        report.momentum_scale = self.speed * density;
        let elastic = m.lame_mu() * self.strain.0 + 0.5 * m.lame_lambda() * self.strain.1;
        report.energies = Energies { kinetic: self.kinetic * density, elastic };
        report.volume_ratio = if self.count > 0 { self.ratio } else { (1.0, 1.0) };
        report.volume = self.present_volume;
    }
}
