//! What clay bears of a flat blade at the hand's pose: the bounds of [`BladeContact`], moved with the tool.
//!
//! The clay is one spring, as for solid tools; what of its force is not admissible is returned to the nearest
//! that is. An edge bears up to R L of what is against its advance: where it stands it is loaded and unloaded
//! by the clay's stiffness k, so that what it bears is `k l` at most, l its *lead*, the way that it has gone
//! on from where its clay bears nothing. A lead ends at `R L / k`, where the edge cuts; drawn back it becomes
//! negative, and the edge bears nothing in its own cut. All bounds hold the force of none: whatever they are,
//! no cycle of the hand gains energy of them.

use crate::haptics::model::{BladeContact, ContactModel, EDGES_MAX};
use crate::sim::touch::EdgeTouch;
use glam::{DQuat, DVec3};

/// Sweeps over the edges to the nearest force that they bear: of right angles one is exact, a point of 40
/// degrees is left with 1e-3 of it.
const SWEEPS: u32 = 12;

/// Times that bounds are found of the force, which moves the tool against the hand by the coupling.
const ROUNDS: u32 = 3;

/// An edge as it is where the tool is.
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    /// In the tool's own frame.
    outward: DVec3,
    /// Lead \[m\].
    lead: f64,
    /// R L \[N\].
    force: f64,
}

/// What clay bears of a blade with its tool at a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct BladeLimit {
    place: DVec3,
    /// Traction of the flanks, bearing in front and behind \[N\], and their growth \[N/m\].
    forces: [f64; 3],
    growths: [DVec3; 3],
    edges: [Edge; EDGES_MAX],
    friction: f64,
}

/// Where a hand is, by a coupling of this compliance \[m/N\] away from its tool, and how both are turned.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub(super) hand: DVec3,
    pub(super) rotation: DQuat,
    pub(super) compliance: f64,
}

impl BladeLimit {
    /// Of a frame, with the tool at `place` as it ends, of clay of this stiffness in the plane \[N/m\].
    pub(super) fn new(blade: &BladeContact, model: &ContactModel, place: DVec3, stiffness: f64) -> Self {
        let edge = |of: &EdgeTouch| {
            let lead = if of.gap > 0.0 { -of.gap } else { of.force / stiffness };
            Edge { outward: of.outward, lead, force: of.force }
        };
        Self {
            place,
            forces: [blade.flank, blade.bearing[0], blade.bearing[1]],
            growths: [blade.flank_growth, blade.bearing_growth[0], blade.bearing_growth[1]],
            edges: blade.edges.each_ref().map(edge),
            friction: model.friction,
        }
    }

    /// Without clay, where the tool is.
    pub(super) fn without_clay(self) -> Self {
        let edges = self.edges.map(|edge| Edge { force: 0.0, ..edge });
        Self { forces: [0.0; 3], growths: [DVec3::ZERO; 3], edges, ..self }
    }

    /// The tool has gone to `place`.
    pub(super) fn go(&mut self, place: DVec3, rotation: DQuat, stiffness: f64) {
        let way = rotation.conjugate() * (place - std::mem::replace(&mut self.place, place));
        for (force, growth) in self.forces.iter_mut().zip(&self.growths) {
            *force += growth.dot(way);
        }
        for edge in &mut self.edges {
            edge.lead = (edge.lead + edge.outward.dot(way)).min(edge.force / stiffness);
        }
    }

    /// Between this and another with the tool at the same place.
    pub(super) fn lerp(self, to: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        let edge = |i: usize| {
            let [a, b] = [self.edges[i], to.edges[i]];
            Edge { outward: b.outward, lead: mix(a.lead, b.lead), force: mix(a.force, b.force) }
        };
        Self {
            place: self.place,
            forces: std::array::from_fn(|i| mix(self.forces[i], to.forces[i])),
            growths: std::array::from_fn(|i| self.growths[i].lerp(to.growths[i], share)),
            edges: std::array::from_fn(edge),
            friction: mix(self.friction, to.friction),
        }
    }

    /// The admissible force nearest to `trial`, across the blade and then in its plane \[N\]; `before` is
    /// that of the last tick, `stiffness` the clay's in the plane \[N/m\].
    pub(super) fn admit(&self, trial: DVec3, before: DVec3, held: &Held, stiffness: f64) -> DVec3 {
        let normal = held.rotation * DVec3::Z;
        let [_, front, behind] = self.forces.map(|force| force.max(0.0));
        let pressed = trial.dot(normal).clamp(-front, behind);
        let across = trial - trial.dot(normal) * normal;
        let slide = self.slide(pressed);
        let outwards = self.edges.map(|edge| held.rotation * edge.outward);
        let (mut force, mut borne) = (before, [0.0; EDGES_MAX]);
        for _ in 0..ROUNDS {
            let bounds: [f64; EDGES_MAX] = std::array::from_fn(|i| {
                let (edge, outward) = (&self.edges[i], outwards[i]);
                // The tool is where all forces but this one hold it, less what this one gives way.
                let there = held.hand + held.compliance * (force + borne[i] * outward);
                let lead = edge.lead + outward.dot(there - self.place);
                (stiffness * lead / (1.0 + stiffness * held.compliance)).clamp(0.0, edge.force)
            });
            borne = nearest(across, &outwards, &bounds);
            force = in_plane(across, &outwards, &borne, slide) + pressed * normal;
        }
        force
    }

    /// Bound of the flanks' traction under a force across the blade \[N\].
    fn slide(&self, pressed: f64) -> f64 {
        self.forces[0].max(0.0) + self.friction * pressed.abs()
    }

    /// Whether clay under `force` cuts or slides, or does so under less than 1 / `share` of it: then it says
    /// nothing of where its spring is free. By the plane and across it.
    pub(super) fn yields(&self, force: DVec3, rotation: DQuat, share: f64) -> [bool; 2] {
        let normal = rotation * DVec3::Z;
        let pressed = force.dot(normal);
        let across = (force - pressed * normal) / share;
        let outwards = self.edges.map(|edge| rotation * edge.outward);
        let bounds = self.edges.map(|edge| if edge.lead > 0.0 { edge.force } else { 0.0 });
        let most = in_plane(across, &outwards, &nearest(across, &outwards, &bounds), self.slide(pressed));
        let [_, front, behind] = self.forces;
        [most != across, pressed < -share * front || pressed > share * behind]
    }
}

/// What edges bear of a force in the plane \[N\]: `t` in its bounds with the least `|force + sum t_e m_e|`,
/// one edge after the other.
fn nearest(force: DVec3, outwards: &[DVec3; EDGES_MAX], bounds: &[f64; EDGES_MAX]) -> [f64; EDGES_MAX] {
    let (mut borne, mut left) = ([0.0; EDGES_MAX], force);
    for _ in 0..SWEEPS {
        for ((t, outward), bound) in borne.iter_mut().zip(outwards).zip(bounds) {
            let next = (*t - left.dot(*outward)).clamp(0.0, *bound);
            left += (next - *t) * *outward;
            *t = next;
        }
    }
    borne
}

/// The force in the plane, of which edges bear so much and flanks `slide` at most.
fn in_plane(force: DVec3, outwards: &[DVec3; EDGES_MAX], borne: &[f64; EDGES_MAX], slide: f64) -> DVec3 {
    let edges: DVec3 = outwards.iter().zip(borne).map(|(outward, t)| -*t * *outward).sum();
    let rest = force - edges;
    // To the bit what it was where nothing slides.
    if rest.length() <= slide { force } else { edges + rest.clamp_length_max(slide) }
}

#[cfg(test)]
mod tests;
