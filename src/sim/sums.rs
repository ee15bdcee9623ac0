//! Sums over the particles and what a report says of them: the same for every engine.

use super::frame::{Energies, FramePlan, FrameReport};
use super::health::Health;
use glam::DVec3;

/// Volume-weighted sums over particles: times density they are mass, momentum and energy.
#[derive(Clone, Debug)]
pub(super) struct ParticleSums {
    /// Number of particles.
    pub(super) count: usize,
    /// Sum of V [m^3].
    pub(super) volume: f64,
    /// Sum of V v [m^4/s].
    pub(super) momentum: DVec3,
    /// Sum of V (x x v + dx^2 / 4 curl of C) about the world's origin [m^5/s].
    pub(super) angular: DVec3,
    /// Sum of V |v| [m^4/s].
    pub(super) speed: f64,
    /// Sum of V (v^2 + |C|^2 dx^2 / 4) / 2 [m^5/s^2].
    pub(super) kinetic: f64,
    /// Sums of V |H|^2 and V tr(H)^2 [m^3].
    pub(super) strain: (f64, f64),
    /// Least and greatest J.
    pub(super) ratio: (f64, f64),
    /// Sum of V J [m^3].
    pub(super) present_volume: f64,
}

impl ParticleSums {
    /// No particles.
    pub(super) const ZERO: Self = Self {
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

    /// The sums of both.
    pub(super) fn plus(&self, p: &Self) -> Self {
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
        report.density_scale = plan.density_scale();
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

/// Sets the health bits that follow from a report's numbers, and names the particles frozen out.
pub(super) fn judge(report: &mut FrameReport, quarantined: &[u32]) {
    report.quarantined = quarantined.to_vec();
    if report.clamped > 0 {
        report.health.insert(Health::STRAIN);
    }
    if !quarantined.is_empty() {
        report.health.insert(Health::QUARANTINED);
    }
    // f32 node sums of 64 particles a cell are off by 1e-6 of the mass where all nodes round alike.
    if (report.grid_mass / report.particle_mass - 1.0).abs() > 3e-6 {
        report.health.insert(Health::MASS_LOST);
    }
}
