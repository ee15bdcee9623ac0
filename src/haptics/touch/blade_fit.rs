//! What a flat blade yields at, put right by what it met as it went on.
//!
//! A frame in which the blade went through clay in its plane, by the unit way u, bore `M = -f . u` where its
//! touch says `E + T`: of the edges that cut `E = sum_e R L_e max(0, m_e . u)`, of the flanks `T = 2 k A`, mean
//! of the frame's two ends. Factors a of edges and b of flanks are the least of
//! `sum w (a E + b T - M)^2 / (E + T)^2 + PRIOR ((a - 1)^2 + (b - 1)^2)`: strokes back, which cut nothing, tell
//! the flanks from the edges.

use super::super::model::BladeContact;
use crate::sim::touch::{BladeTouch, ToolTouch};
use glam::{DQuat, DVec2, DVec3};

/// What the touch's own word counts, of a frame that went on [-].
const PRIOR: f64 = 0.25;

/// What a frame counts of that after another one [-].
const DECAY: f64 = 0.8;

/// How many times the way that its spring gives a blade has gone on before its force is what clay yields at.
const SETTLED: f64 = 2.0;

/// Cosine [-] between the ways of two frames that go on.
const ONWARD: f64 = 0.8;

/// Least and greatest factor that is believed [-].
const FACTORS: [f64; 2] = [0.5, 2.0];

/// Makes a blade's bounds from its touches, frame after frame.
#[derive(Clone, Debug, Default)]
pub(super) struct BladeFit {
    /// The last touch: mean place, what clay bore then, and the way from the frame before.
    last: Option<(DVec3, BladeTouch, DVec3)>,
    /// Way since the blade last turned back \[m\].
    run: f64,
    /// Of the normal equations: `sum w e e`, `sum w e t`, `sum w t t`, and `sum w e r`, `sum w t r`.
    sums: [f64; 5],
}

impl BladeFit {
    /// The bounds after another frame; none of what is no flat blade near clay.
    pub(super) fn bounds(&mut self, touch: &ToolTouch) -> Option<BladeContact> {
        let Some(blade) = &touch.blade else {
            // The next clay is another.
            *self = Self::default();
            return None;
        };
        self.learn(touch, blade);
        let [edges, flanks] = self.factors();
        let mut contact = contact(blade);
        contact.edges.iter_mut().for_each(|edge| edge.force *= edges);
        contact.flank *= flanks;
        contact.flank_growth *= flanks;
        // Clay bears what it does bear.
        let pressed = touch.force.dot(touch.normal);
        contact.bearing = [contact.bearing[0].max(-pressed), contact.bearing[1].max(pressed)];
        Some(contact)
    }

    /// Takes a frame in.
    fn learn(&mut self, touch: &ToolTouch, blade: &BladeTouch) {
        let Some((place, before, way_before)) = self.last.take() else {
            self.last = Some((touch.mean_position, blade.clone(), DVec3::ZERO));
            return;
        };
        let way = touch.mean_position - place;
        let way = way - way.dot(touch.normal) * touch.normal;
        let goes_on = way.dot(way_before) > ONWARD * way.length() * way_before.length();
        self.run = if goes_on { self.run + way.length() } else { 0.0 };
        if let Some(found) = bound([&before, blade], way, touch.pose.rotation).filter(|_| goes_on) {
            let [edges, flanks] = found;
            let along = touch.stiffness * way.normalize_or_zero();
            let stiffness = along.dot(way.normalize_or_zero());
            let said = edges + flanks;
            if said > 0.0 && self.run * stiffness > SETTLED * said {
                let [e, t] = [edges / said, flanks / said];
                let more = (-touch.force.dot(way.normalize_or_zero()) / said - 1.0).clamp(-1.0, 1.0);
                let news = [e * e, e * t, t * t, e * more, t * more];
                self.sums = std::array::from_fn(|i| self.sums[i] * DECAY + news[i]);
            }
        }
        self.last = Some((touch.mean_position, blade.clone(), way));
    }

    /// Factors of edges and flanks [-].
    fn factors(&self) -> [f64; 2] {
        let [ee, et, tt, er, tr] = self.sums;
        let [ee, tt] = [ee + PRIOR, tt + PRIOR];
        let determinant = ee * tt - et * et;
        let more = DVec2::new(tt * er - et * tr, ee * tr - et * er) / determinant;
        let factor = |more: f64| (1.0 + more).clamp(FACTORS[0], FACTORS[1]);
        if more.is_finite() { [factor(more.x), factor(more.y)] } else { [1.0; 2] }
    }
}

/// What edges and flanks bear of a blade that goes this way, by the touches before and after it \[N\]; none
/// where an edge came to whole clay on it.
fn bound(ends: [&BladeTouch; 2], way: DVec3, rotation: DQuat) -> Option<[f64; 2]> {
    let onward = rotation.conjugate() * way.try_normalize()?;
    let mut edges = 0.0;
    for [before, after] in ends[0].edges.iter().zip(&ends[1].edges).map(|pair| [pair.0, pair.1]) {
        let ahead = after.outward.dot(onward).max(0.0);
        match (before.gap > 0.0, after.gap > 0.0) {
            (true, true) => {}
            (false, false) => edges += ahead * 0.5 * (before.force + after.force),
            (true, false) | (false, true) if ahead * after.force.max(before.force) > 0.0 => return None,
            (true, false) | (false, true) => {}
        }
    }
    let flank = 0.5 * ends.iter().map(|end| end.flank.max(0.0)).sum::<f64>();
    Some([edges, flank])
}

/// A touch of a blade as a model has it.
fn contact(touch: &BladeTouch) -> BladeContact {
    let mut contact = BladeContact {
        flank: touch.flank,
        flank_growth: touch.flank_growth,
        bearing: touch.bearing,
        bearing_growth: touch.bearing_growth,
        ..BladeContact::default()
    };
    for (to, from) in contact.edges.iter_mut().zip(&touch.edges) {
        (to.outward, to.gap, to.force) = (from.outward, from.gap, from.force);
    }
    contact
}
