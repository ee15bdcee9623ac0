//! Anti-locking: the volume ratios of flowing particles relax to the mean of their cell.
//!
//! Before substeps 0, 8, 16 .. of the frame, where
//! [`volume_averaging`](super::super::frame::FramePlan::volume_averaging) `q > 0`: of each cell `floor(x)`
//! and class, the particles at yield (`|d| >= 0.99 y` of [`law`](super::law), without the viscous part, tools
//! at their poses of `t`) take `1 - (1 - q)^k` of the difference to their mean `ln J`, weighted by rest
//! volume: `b *= exp(2 (change of ln J) / 3)`. k is the number of substeps up to the next averaging or the
//! frame's end. The sum of `V ln J` and every deviator stay; elastic clay is left alone, so that closed-form
//! elastic answers are.
//!
//! Why: plastic flow keeps volume, and a cell's few degrees of freedom can follow its particles' ln J only on
//! average. What is left over has no force against it and grows into pressure noise and a strength too great
//! (volumetric locking).

use super::super::limits::FLOWING;
use super::law;
use super::particle::Particle;
use super::tools::{Moment, Surroundings};
use std::collections::BTreeMap;

/// Relaxes the particles before substep `step` of the frame, if the plan asks for it there.
pub(super) fn average_volumes(particles: &mut [Particle], around: &Surroundings, step: u32) {
    let share = around.plan.averaging_share(step, around.plan.steps);
    if share == 0.0 {
        return;
    }
    let mut cells: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (i, particle) in particles.iter().enumerate() {
        let limit = (2.0f64 / 3.0).sqrt() * around.yield_stress(particle, Moment::Start) / (2.0 * around.plan.material.lame_mu());
        if law::invariants(particle.elastic_strain).0 >= FLOWING * limit {
            let cell = particle.position.floor().as_ivec3().to_array();
            cells.entry((cell, particle.key())).or_default().push(i);
        }
    }
    for members in cells.values() {
        let log = |i: &usize| law::invariants(particles[*i].elastic_strain).1;
        let volume: f64 = members.iter().map(|i| particles[*i].rest_volume).sum();
        let mean = members.iter().map(|i| particles[*i].rest_volume * log(i)).sum::<f64>() / volume;
        let changes: Vec<f64> = members.iter().map(|i| share * (mean - log(i))).collect();
        for (i, change) in members.iter().zip(changes) {
            particles[*i].elastic_strain = law::dilated(particles[*i].elastic_strain, change);
        }
    }
}
