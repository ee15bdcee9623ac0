//! Nodes at which all clay moves as one and nothing but gravity acts on it, in f32.

use super::grid_step::{GridReport, GridStep};
use super::nodes::{Nodes, Present};
use super::simd::{Node, in_lanes};
use glam::DVec3;

/// Momentum -> velocity of the nodes of a block.
pub(super) fn plain(nodes: &mut Nodes, step: &GridStep) -> GridReport {
    let damping_impulse = damping_impulse(nodes, step);
    GridReport { speed_max: update_plain(nodes, step), damping_impulse, ..GridReport::default() }
}

/// The same of several classes at those nodes, a bit each, at which they move as one. What validation damping
/// takes is that of all nodes.
pub(super) fn joint(present: &mut Present<'_>, step: &GridStep, chosen: u64) -> GridReport {
    let classes = 0..present.classes.len();
    if (classes.end, chosen) == (1, !0) {
        return plain(present.nodes(0), step);
    }
    let (mut all, mut impulse) = ([Node::default(); 64], DVec3::ZERO);
    for class in classes.clone() {
        impulse += damping_impulse(present.nodes(class), step);
        add(&mut all, present.nodes(class), chosen);
    }
    let speed_max = update_plain(&mut all, step);
    for class in classes {
        share(present.nodes(class), &all, chosen);
    }
    GridReport { speed_max, damping_impulse: impulse, ..GridReport::default() }
}

in_lanes! {
    /// Adds momentum and mass at the chosen nodes.
    fn add(all: &mut Nodes, nodes: &Nodes, chosen: u64) {
        for k in 0..64 {
            if chosen >> k & 1 == 1 {
                for d in 0..4 {
                    all[k].0[d] += nodes[k].0[d];
                }
            }
        }
    }
}

in_lanes! {
    /// Gives the chosen nodes of a class the velocity of all; what it came with is its own.
    fn share(nodes: &mut Nodes, all: &Nodes, chosen: u64) {
        for k in 0..64 {
            if chosen >> k & 1 == 1 {
                let (q, v) = (nodes[k].0, all[k].0);
                let inverse = if q[3] > 0.0 { 1.0 / q[3] } else { 0.0 };
                nodes[k].0 = [v[0], v[1], v[2], q[3], q[4] * inverse, q[5] * inverse, q[6] * inverse, q[7]];
            }
        }
    }
}

/// What validation damping takes from the sums.
fn damping_impulse(nodes: &Nodes, step: &GridStep) -> DVec3 {
    if step.damping == 1.0 {
        return DVec3::ZERO;
    }
    let free = |q: [f64; 8]| DVec3::new(q[0], q[1], q[2]) + q[3] * step.gravity;
    nodes.iter().map(|node| free(node.0.map(f64::from)) * (step.damping - 1.0)).sum()
}

/// Momentum -> velocity where nothing but gravity acts. Returns the greatest speed, NaN if any is not finite.
#[inline]
fn update_plain(nodes: &mut Nodes, step: &GridStep) -> f32 {
    let gravity = step.gravity.as_vec3().to_array();
    let damping = step.damping as f32;
    let (mut greatest, mut all) = (0.0f32, 0.0f32);
    for node in nodes {
        let q = &mut node.0;
        let inverse = if q[3] > 0.0 { 1.0 / q[3] } else { 0.0 };
        let mut speed2 = 0.0;
        for d in 0..3 {
            let v = if q[3] > 0.0 { (q[d] * inverse + gravity[d]) * damping } else { q[d] * 0.0 };
            speed2 += v * v;
            q[d] = v;
            q[4 + d] *= inverse;
        }
        greatest = greatest.max(speed2);
        all += speed2 + q[3] * 0.0;
    }
    if all.is_finite() { greatest.sqrt() } else { f32::NAN }
}
