//! Anti-locking: the volume ratios of particles that have flowed come to the mean of their cell, by how far
//! they have flowed.
//!
//! Where [`volume_averaging`](super::super::frame::FramePlan::volume_averaging) `g > 0`, before substeps 8,
//! 16, 24 .. of the frame and at its end, after [`weld`](super::weld): of each cell `floor(x)` and class,
//! with the plastic strain `e` of each particle since the last time, in this frame, and
//! `f = 1 - exp(-e / g)`: `ln J += f (mean - ln J)`, the mean weighted by `f` and rest volume:
//! `b *= exp(2 (change of ln J) / 3)`. The sum of `V ln J` and every deviator stay; clay that does not flow
//! is left alone, so that closed-form elastic answers are, and so is what a tool at rest holds.
//!
//! Why: plastic flow keeps volume, and a cell's few degrees of freedom can follow its particles' ln J only on
//! average. What is left over has no force against it and grows into pressure noise and a strength too great
//! (volumetric locking). It grows with flow, not with time: relaxed in time, it flattened the pressure under
//! a tool at rest too, whose force fell by a sixth.

use super::law;
use super::particle::Particle;
use std::collections::BTreeMap;

/// Averages the particles' volumes within the plastic strain `strain` [-], and begins to count it anew.
pub(super) fn average_volumes(particles: &mut [Particle], strain: f64) {
    let mut cells: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (i, particle) in particles.iter().enumerate().filter(|(_, p)| p.flowed > 0.0) {
        let cell = particle.position.floor().as_ivec3().to_array();
        cells.entry((cell, particle.key())).or_default().push(i);
    }
    for members in cells.values() {
        // Share, weight and ln J of each.
        let of_particle = |&i: &usize| {
            let share = -(-particles[i].flowed / strain).exp_m1();
            (share, share * particles[i].rest_volume, law::log_volume_ratio(particles[i].elastic_strain))
        };
        let terms: Vec<(f64, f64, f64)> = members.iter().map(of_particle).collect();
        let (weight, sum) = terms.iter().fold((0.0, 0.0), |s, (_, weight, log)| (s.0 + weight, s.1 + weight * log));
        for (&i, (share, _, log)) in members.iter().zip(terms) {
            particles[i].elastic_strain = law::dilated(particles[i].elastic_strain, share * (sum / weight - log));
        }
    }
    particles.iter_mut().for_each(|p| p.flowed = 0.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    /// What has flowed far comes to the mean, by how far each has; the sum of V ln J stays, and clay that has
    /// not flowed.
    #[test]
    fn particles_share_by_how_far_they_flowed() {
        let at = |i: u32, log: f64, flowed: f64| {
            let strain = law::dilated(DMat3::from_diagonal(DVec3::new(0.02, -0.01, 0.0)), log);
            let position = DVec3::new(3.1, 4.2, 5.3) + 0.1 * f64::from(i);
            Particle { elastic_strain: strain, flowed, ..Particle::at(position, 1.0 + f64::from(i), i) }
        };
        let mut particles = [at(0, 0.01, 1.0), at(1, -0.02, 1.0), at(2, 0.03, 5e-4), at(3, 0.04, 0.0)];
        let logs = |particles: &[Particle]| particles.iter().map(|p| law::log_volume_ratio(p.elastic_strain)).collect::<Vec<_>>();
        let sum = |logs: &[f64]| logs.iter().zip(1..).map(|(log, volume)| log * f64::from(volume)).sum::<f64>();
        let before = logs(&particles);
        average_volumes(&mut particles, 5e-4);
        let after = logs(&particles);
        assert!((after[0] - after[1]).abs() < 1e-12 && (sum(&after) - sum(&before)).abs() < 1e-14, "{before:?} {after:?}");
        let share = 1.0 - (-1.0f64).exp();
        assert!(((after[2] - before[2]) / (after[0] - before[2]) - share).abs() < 1e-9, "{before:?} {after:?}");
        assert!(after[3] == before[3] && particles.iter().all(|p| p.flowed == 0.0), "{before:?} {after:?}");
    }
}
