//! The proxy's way: Gauss-Newton steps towards a target, from tick to tick.

use super::super::model::NearParticle;
use super::active_set::ActiveSet;
use super::pairs::{Pairs, ToolSpheres};
use super::projected::Multipliers;
use super::solution::Solution;
use glam::{DQuat, DVec3};

/// Steps of Gauss-Newton in a tick, at most. Two follow a hand at 0.5 m/s; the others are for clay that has
/// come too near since the last frame.
const STEP_MAX: u32 = 6;

/// Way of a step, of the least radius of two spheres that touch [-]: no sphere of clay is leapt over.
const STEP_FRACTION: f64 = 0.5;

/// Pairs that a step may not reach are left out; what they may be nearer by rounding \[m\].
const MARGIN: f64 = 1e-6;

/// Depth in the clay at which the proxy counts as caught \[m\]: that of the acceptance limit.
pub const CAUGHT: f64 = 1e-6;

/// Which solver places the proxy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solver {
    /// The exact active set.
    #[default]
    ActiveSet,
    /// Projected Gauss-Seidel, as published.
    Projected,
}

/// A tool that stays outside the clay.
#[derive(Clone, Debug, Default)]
pub struct Proxy {
    /// Where its origin is \[m\].
    pub position: DVec3,
    /// Where the planes were laid \[m\].
    linearised: DVec3,
    active: ActiveSet,
    multipliers: Multipliers,
    pairs: Pairs,
}

/// What a step met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProxyStep {
    /// Whether a sphere of clay holds the proxy off its target.
    pub is_held: bool,
    /// Whether the clay about it leaves no way out: it is somewhat inside.
    pub is_caught: bool,
    /// Least gap to the clay, Eq. 7 \[m\]; infinite if none is within half a radius.
    pub gap: f64,
    /// Pivots or sweeps of all its solutions, the most of any of them.
    pub iterations: u32,
    /// Pairs of the last solution.
    pub pairs: u32,
}

impl ProxyStep {
    /// Of a tool that nothing is near.
    const FREE: Self = Self { is_held: false, is_caught: false, gap: f64::INFINITY, iterations: 0, pairs: 0 };
}

/// What the proxy moves among.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// The tool.
    pub tool: &'a ToolSpheres,
    /// How it is turned.
    pub rotation: DQuat,
    /// The clay near it.
    pub near: &'a [NearParticle],
    /// Out of the clay, of any length: the way that a caught proxy is pushed.
    pub outwards: DVec3,
}

impl Proxy {
    /// A proxy at a place that is not looked at: of a hand that holds it there.
    pub fn at(position: DVec3) -> Self {
        Self { position, ..Self::default() }
    }

    /// Goes towards `target` as far as the clay lets it, by a diagonal stiffness \[N/m\].
    pub fn advance(&mut self, target: DVec3, stiffness: DVec3, about: &Surroundings<'_>, solver: Solver) -> ProxyStep {
        let mut met = ProxyStep::FREE;
        self.pairs.clear();
        if about.near.is_empty() || about.tool.spheres().is_empty() {
            self.position = target;
            return met;
        }
        let least = about.near.iter().fold(about.tool.radius_min(), |least, p| least.min(p.radius.into()));
        let cap = STEP_FRACTION * least;
        for _ in 0..STEP_MAX {
            self.linearised = self.position;
            self.pairs.collect(about.tool, self.position, about.rotation, about.near, cap + MARGIN);
            let found = self.solve(target, stiffness, solver);
            met.iterations = met.iterations.max(found.iterations);
            met.pairs = self.pairs.constraints().len() as u32;
            met.is_held = found.position != target;
            if !found.is_feasible {
                self.position += about.outwards.normalize_or(DVec3::Y) * cap;
            } else if self.step_to(found.position, cap) {
                break;
            }
        }
        self.look(&mut met);
        met
    }

    /// Goes towards another target by the same planes, which hold wherever they were laid: C is convex.
    /// False, and nothing done, where that may lead among spheres that have none.
    pub fn slide(&mut self, target: DVec3, stiffness: DVec3, met: &mut ProxyStep, solver: Solver) -> bool {
        let found = self.solve(target, stiffness, solver);
        let reach = self.position.distance(self.linearised) + MARGIN;
        let is_safe = found.is_feasible && found.position.distance(self.linearised) <= reach;
        if is_safe {
            met.iterations = met.iterations.max(found.iterations);
            self.position = found.position;
            self.look(met);
        }
        is_safe
    }

    /// Goes towards a place, by `cap` \[m\] at most; whether it is there.
    fn step_to(&mut self, place: DVec3, cap: f64) -> bool {
        let way = place - self.position;
        let length = way.length();
        let is_there = length <= cap;
        self.position = if is_there { place } else { self.position + way * (cap / length) };
        is_there
    }

    fn look(&self, met: &mut ProxyStep) {
        met.gap = self.pairs.gap_after(self.position - self.linearised);
        met.is_caught = met.gap < -CAUGHT;
    }

    fn solve(&mut self, target: DVec3, stiffness: DVec3, solver: Solver) -> Solution {
        match solver {
            Solver::ActiveSet => self.active.solve(&self.pairs, stiffness, target),
            Solver::Projected => self.multipliers.solve(&self.pairs, stiffness, target),
        }
    }
}
