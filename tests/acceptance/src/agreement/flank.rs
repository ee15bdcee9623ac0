//! Blades that clay sticks to which was worked and hardened unevenly, and flows: they hold it by its present
//! strength.

use super::{Agreement, blades, implicit_blades, soft};
use bevy_clay::sim::prelude::*;

/// The cases of a blade that sticks, in worked clay.
fn worked(mut cases: Vec<Agreement>) -> Vec<Agreement> {
    let law = ClayLaw::Worked { loss: 0.7, rate: 3.0, rest_time: 0.1 };
    let material = ClayMaterial { law, softening: 0.2, hardening_modulus: 5e3, viscosity: 40.0, flow_index: 0.4, ..soft() };
    cases.retain(|agreement| agreement.case.plan.tools[0].tool.contact == Contact::Stick);
    for Agreement { name, case, .. } in &mut cases {
        *name = format!("{name}, worked");
        (case.snapshot.material, case.plan.material) = (material, material);
        for (i, p) in case.snapshot.particles.iter_mut().enumerate() {
            let phase = i as f32 * 0.37;
            (p.hardening, p.structure) = (0.1 + 0.1 * phase.sin(), 0.5 + 0.4 * phase.cos());
        }
    }
    cases
}

/// In explicit steps: each field by the mean of its clay's.
pub fn worked_flanks() -> Vec<Agreement> {
    worked(blades())
}

/// In implicit steps: each particle by its own.
pub fn worked_flanks_in_implicit_steps() -> Vec<Agreement> {
    worked(implicit_blades())
}
