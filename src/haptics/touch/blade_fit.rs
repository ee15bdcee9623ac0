//! What a flat blade yields at, put right by what it met as it went on.
//!
//! A frame in which the blade went through clay in its plane, by the unit way u, bore `M = -f . u` where its
//! touch says `E + T`: of the edges that cut `E = sum_e R L_e max(0, m_e . u)`, of the flanks `T = 2 k A`,
//! mean of the frame's two ends. Factors a of edges and b of flanks are the least of
//! `sum w (a E + b T - M)^2 / (E + T)^2 + PRIOR ((a - 1)^2 + (b - 1)^2)`: strokes back, which cut nothing,
//! tell the flanks from the edges. A frame weighs by what it bore of all that edges and flanks could,
//! squared: of a way that is hardly against anything nothing is learnt.

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

/// Part [-] of a frame's way that its latter half has to have: half of it where nothing slows down.
const LATTER: f64 = 0.25;

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
        // The frame's latter half too: a blade that turns back in it has let go.
        let latter = touch.latter_way.dot(way);
        if goes_on && latter > LATTER * way.length_squared() {
            self.weigh(touch, [&before, blade], way);
        }
        self.last = Some((touch.mean_position, blade.clone(), way));
    }

    /// Takes in a frame that went on between these touches.
    fn weigh(&mut self, touch: &ToolTouch, ends: [&BladeTouch; 2], way: DVec3) {
        let onward = way.normalize_or_zero();
        let Some([edges, flanks]) = bound(ends, onward, touch.pose.rotation) else { return };
        let (said, stiffness) = (edges + flanks, (touch.stiffness * onward).dot(onward));
        if said > 0.0 && self.run * stiffness > SETTLED * said {
            let all = ends[1].flank.max(0.0) + ends[1].edges.iter().map(|edge| edge.force).sum::<f64>();
            let weight = (said / all).min(1.0).powi(2);
            let [e, t] = [edges / said, flanks / said];
            let more = (-touch.force.dot(onward) / said - 1.0).clamp(-1.0, 1.0);
            let news = [e * e, e * t, t * t, e * more, t * more];
            self.sums = std::array::from_fn(|i| self.sums[i] * DECAY.powf(weight) + weight * news[i]);
        }
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

/// What edges and flanks bear of a blade that goes on this way, of unit length, by the touches before and
/// after it \[N\]; none where an edge came to whole clay on it.
fn bound(ends: [&BladeTouch; 2], onward: DVec3, rotation: DQuat) -> Option<[f64; 2]> {
    let onward = rotation.conjugate() * onward;
    let mut edges = 0.0;
    for (before, after) in ends[0].edges.iter().zip(&ends[1].edges) {
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
    contact.edges.iter_mut().zip(&touch.edges).for_each(|(to, from)| *to = *from);
    contact
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::tool::Pose;
    use crate::sim::touch::EdgeTouch;
    use glam::DMat3;

    const FLANK: f64 = 0.4;
    const EDGE: f64 = 0.1;

    /// A frame of a knife that ends with its edge at height `y` \[m\], `way` above where it began.
    fn touch(y: f64, way: f64, gap: f64, force: f64) -> ToolTouch {
        let edge = EdgeTouch { outward: DVec3::NEG_Y, gap, force: EDGE };
        let blade = BladeTouch { flank: FLANK, bearing: [0.5; 2], edges: vec![edge], ..BladeTouch::default() };
        ToolTouch {
            pose: Pose { position: DVec3::Y * y, ..Pose::default() },
            mean_position: DVec3::Y * (y - 0.5 * way),
            latter_way: DVec3::Y * (0.5 * way),
            force: DVec3::Y * force + DVec3::Z * 0.7,
            normal: DVec3::Z,
            stiffness: DMat3::from_diagonal(DVec3::splat(5000.0)),
            blade: Some(blade),
            ..ToolTouch::default()
        }
    }

    /// Frames of 0.3 mm, by the force that the blade bears upwards.
    fn stroke(fit: &mut BladeFit, from: f64, way: f64, gap: f64, force: f64) -> BladeContact {
        let frames = (1..=12).map(|i| touch(from + way * f64::from(i), way, gap, force));
        frames.map(|touch| fit.bounds(&touch).expect("a blade")).last().expect("a frame")
    }

    /// What a blade bears as it cuts is what it is said to bear next; the flanks are told from the edge by
    /// the way out, and what presses across counts as borne.
    #[test]
    fn bounds_follow_what_clay_bears() {
        let mut fit = BladeFit::default();
        let bears = 1.2 * EDGE + 0.8 * FLANK;
        let cut = stroke(&mut fit, 0.0, -0.3e-3, 0.0, bears);
        assert!((cut.edges[0].force + cut.flank - bears).abs() < 0.1 * (bears - EDGE - FLANK).abs(), "{cut:?}");
        assert_eq!(cut.bearing, [0.5, 0.7]);
        let out = stroke(&mut fit, -3.6e-3, 0.3e-3, 1e-3, -0.8 * FLANK);
        assert!((out.flank / FLANK - 0.8).abs() < 0.02, "{out:?}");
        assert!(out.edges[0].force > 0.9 * EDGE, "{out:?}");
    }

    /// Nothing is learnt of a blade that is held, turns back, or goes where hardly anything is against it,
    /// and nothing is kept of other clay.
    #[test]
    fn frames_that_do_not_cut_say_nothing() {
        let mut fit = BladeFit::default();
        let ways = [-1e-6, -1e-6, 0.0, -0.3e-3, 0.3e-3, -0.3e-3, 0.2e-3, -0.02e-3];
        let mut y = 0.0;
        for way in ways {
            y += way;
            assert!(fit.bounds(&touch(y, way, 0.0, 0.05)).is_some());
        }
        assert_eq!(fit.factors(), [1.0; 2]);
        // A frame that went on in the mean and ends on its way back.
        stroke(&mut fit, 0.0, -0.3e-3, 0.0, EDGE + FLANK);
        let before = fit.factors();
        fit.bounds(&ToolTouch { latter_way: DVec3::Y * 0.2e-3, ..touch(-3.6e-3, -0.1e-3, 0.0, 0.1) });
        assert_eq!(fit.factors(), before);
        stroke(&mut fit, 0.0, -0.3e-3, 0.0, 0.3);
        assert!(fit.factors()[1] < 0.9);
        assert!(fit.bounds(&ToolTouch::default()).is_none());
        assert_eq!(fit.factors(), [1.0; 2]);
    }
}
