//! Anti-locking: the volume ratios of flowing particles relax to the mean of their cell.
//!
//! Plastic flow keeps volume, and a cell's few degrees of freedom can follow its particles' ln J only on average: what is left over has no force
//! against it and grows into pressure noise and a strength too great (volumetric locking). Every [`INTERVAL`](super::super::frame::AVERAGING_INTERVAL)
//! substeps the particles at yield take part of the difference to the volume-weighted mean ln J of those in their cell and class. The sum of
//! `V ln J` and every deviator stay; elastic clay is left alone, so that closed-form elastic answers are.

use super::super::limits::FLOWING;
use super::tools::{Moment, Surroundings};
use super::{Particle, law};
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
