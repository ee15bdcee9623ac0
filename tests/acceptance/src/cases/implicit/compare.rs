//! How far one run is from another.

use super::stroke::{Pressed, Sample, Stroke, Way};
use glam::DVec3;

/// The explicit step at the clay's own density as the step goes to nothing: what runs are compared with.
#[derive(Debug)]
pub struct Reference {
    /// At a step, that of the planner in cases.
    pub coarse: Pressed,
    /// At half of it.
    pub fine: Pressed,
}

impl Reference {
    /// Runs the stroke twice.
    pub(super) fn new(stroke: &Stroke) -> Self {
        let (coarse, fine) = rayon::join(|| stroke.press(Way::Explicit(1.0)), || stroke.press(Way::Explicit(0.5)));
        Self { coarse, fine }
    }

    /// The force over a part of the way \[N\], of first order in the step.
    fn force(&self, [from, to, _]: Sample) -> f64 {
        2.0 * self.fine.mean(from, to) - self.coarse.mean(from, to)
    }

    /// Ways of the particles \[cells\].
    fn ways(&self) -> Vec<DVec3> {
        self.fine.ways.iter().zip(&self.coarse.ways).map(|(fine, coarse)| 2.0 * *fine - *coarse).collect()
    }

    /// Rms of the error of `forces` over the mean force [-], of the parts of the way in `range` \[cells\].
    pub fn force_error(&self, forces: &[Sample], range: [f64; 2]) -> f64 {
        let is_in = |s: &&Sample| s[0] >= range[0] && s[1] <= range[1];
        let pairs: Vec<[f64; 2]> = forces.iter().filter(is_in).map(|s| [s[2], self.force(*s)]).collect();
        let mean = pairs.iter().map(|p| p[1]).sum::<f64>() / pairs.len() as f64;
        (pairs.iter().map(|p| (p[0] - p[1]).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt() / mean
    }

    /// Error of the particles' ways in L2, over their own [-].
    pub fn way_error(&self, ways: &[DVec3]) -> f64 {
        distance(ways, &self.ways())
    }

    /// What changes from sample to sample beside the trend over three of them, over the mean force [-], in
    /// `range` \[cells\]: of `forces`, of the reference's, whose clay comes into contact layer by layer, and
    /// of what is between the two.
    pub(super) fn jitters(&self, forces: &[Sample], range: [f64; 2]) -> [f64; 3] {
        let seen: Vec<&Sample> = forces.iter().filter(|s| s[0] >= range[0] && s[1] <= range[1]).collect();
        let jitter_of = |of: &dyn Fn(&Sample) -> f64| jitter(&seen.iter().map(|s| of(s)).collect::<Vec<_>>());
        let mean = seen.iter().map(|s| s[2]).sum::<f64>() / seen.len() as f64;
        [jitter_of(&|s| s[2]), jitter_of(&|s| self.force(*s)), jitter_of(&|s| s[2] - self.force(*s))].map(|j| j / mean)
    }

    /// What the reference itself may be off by: force on the parts of the way of `forces`, and ways, as far
    /// as the smaller step is from none [-].
    pub fn uncertainty(&self, forces: &[Sample], range: [f64; 2]) -> [f64; 2] {
        let parts: Vec<[f64; 2]> = forces.iter().map(|s| [s[0], s[1]]).collect();
        let seen = self.fine.over(&parts);
        [self.force_error(&seen, range), self.way_error(&self.fine.ways)]
    }
}

/// Distance of `ways` from `reference` in L2, over the latter's norm [-].
pub(super) fn distance(ways: &[DVec3], reference: &[DVec3]) -> f64 {
    let norm = |of: &mut dyn Iterator<Item = DVec3>| of.map(DVec3::length_squared).sum::<f64>().sqrt();
    norm(&mut ways.iter().zip(reference).map(|(a, b)| *a - *b)) / norm(&mut reference.iter().copied())
}

/// What of values changes from one to the next beside their trend over three, rms.
fn jitter(values: &[f64]) -> f64 {
    let beside: Vec<f64> = values.windows(4).map(|v| v[2] - v[1] - (v[3] - v[0]) / 3.0).collect();
    (beside.iter().map(|b| b * b).sum::<f64>() / beside.len() as f64).sqrt()
}
