//! The two sides of a kept cut press on each other: fields a, b of a node that a cut divides may part, and
//! not approach, by the explicit step's [law](super::super::contact).
//!
//! With n from a to b, the room r that the gap between their faces leaves, and the way of b against a from
//! where they touch, `w = u_b - u_a + r n`, `w . n >= 0` holds at every place that is looked at: whatever
//! falls short is taken from both, by the other's share of their mass, so that momentum stays. A field that
//! is too light to be an unknown gives way alone.
//!
//! The reaction on b, `(m_a R_b - m_b R_a) / (m_a + m_b)`, is what is out of balance between the two. A pair
//! is *closed* where w . n is 0 ([`CLOSED_GAP`]) and the reaction does not pull. Of a closed pair the rows
//! across are not searched: the reaction is taken out of slopes, and w out of steps, by projections that are
//! each other's transpose. Its friction is lagged: as long as it has not slid ([`SLIDING_WAY`]) and the
//! reaction along the cut is at most [`CUT_FRICTION`] of that across, it *sticks*, and w is not searched at
//! all; else it slides under a force of that size till the next step of the iterations: against the way along
//! the cut, or along the reaction where there is none yet. Friction stops what slides and pushes nothing
//! back: a way along the cut that it would turn round is taken from both, too. (A pair that stuck wherever it
//! stood, after it had slid in the step, bore less than its friction: the better a step was solved, the
//! faster clay went down a slope on which it should have crept.) Pairs that do not part in the first guess
//! start sticking, with w = 0.
//!
//! Momentum is kept to rounding, and the reactions cancel in what is out of balance.

use super::super::super::implicit::{CLOSED_GAP, SLIDING_WAY};
use super::super::super::tool::CUT_FRICTION;
use super::super::contact::facings;
use super::super::grid::Grid;
use super::super::tools::Surroundings;
use super::unknowns::Unknowns;
use glam::{BVec3, DVec3};

/// Whether, and how, a pair bears.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hold {
    Open,
    /// Closed, and held along the cut too: it has not slid in this step, or hardly.
    Sticks,
    /// Closed, with this force on b along the cut \[N\].
    Slides(DVec3),
}

/// Two fields of a node that a kept cut divides, by their unknowns.
#[derive(Clone, Copy, Debug)]
struct Pair {
    fields: [usize; 2],
    /// Unit normal from the first to the second.
    normal: DVec3,
    /// How far they may come together before they bear \[m\].
    room: f64,
    /// How much of a way between them each of them gives.
    shares: [f64; 2],
    hold: Hold,
}

/// The pairs of a step.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    all: Vec<Pair>,
    /// Greatest w . n at which a pair touches \[m\].
    touching: f64,
    /// Way along a cut from which on a pair slides \[m\].
    sliding: f64,
    /// Forces that count as none \[N\].
    nothing: f64,
}

impl Pair {
    fn apart(&self, of_unknowns: &[DVec3]) -> DVec3 {
        of_unknowns[self.fields[1]] - of_unknowns[self.fields[0]]
    }

    /// The way of the second against the first from where they would touch.
    fn beyond_touch(&self, u: &[DVec3]) -> DVec3 {
        self.apart(u) + self.room * self.normal
    }

    /// The part of that way along the cut: how far they have slid in this step.
    fn slid(&self, u: &[DVec3]) -> DVec3 {
        self.apart(u).reject_from_normalized(self.normal)
    }

    /// What is out of balance between the two, as a force on the second.
    fn reaction(&self, slope: &[DVec3]) -> DVec3 {
        self.shares[1] * slope[self.fields[1]] - self.shares[0] * slope[self.fields[0]]
    }

    /// Takes `way` between the two from both.
    fn bring_together(&self, u: &mut [DVec3], way: DVec3) {
        u[self.fields[0]] += self.shares[0] * way;
        u[self.fields[1]] -= self.shares[1] * way;
    }

    /// Adds a force on the second, and its opposite on the first, to a slope.
    fn push(&self, slope: &mut [DVec3], force: DVec3) {
        slope[self.fields[0]] += force;
        slope[self.fields[1]] -= force;
    }

    /// The part of a vector that is not searched.
    fn held(&self, vector: DVec3) -> DVec3 {
        match self.hold {
            Hold::Open => DVec3::ZERO,
            Hold::Sticks => vector,
            Hold::Slides(_) => vector.dot(self.normal) * self.normal,
        }
    }
}

impl Pairs {
    /// The pairs of the nodes that kept cuts divide.
    pub(super) fn new(grid: &Grid, unknowns: &Unknowns, around: &Surroundings) -> Self {
        let mut all = vec![];
        for (index, coordinate) in grid.coordinates().enumerate() {
            let node = &grid.nodes[index];
            if node.is_outer || node.fields.len() < 2 {
                continue;
            }
            for (pair, facing) in facings(grid, coordinate, index) {
                let fields = pair.map(|f| unknowns.first_of(index) + f);
                all.extend(Pair::new(unknowns, fields, facing.normal, facing.room() * around.domain.cell_width));
            }
        }
        let (material, cell_width) = (&around.plan.material, around.domain.cell_width);
        let touching = CLOSED_GAP * cell_width;
        let sliding = SLIDING_WAY * cell_width;
        Self { all, touching, sliding, nothing: (material.lame_lambda() + 2.0 * material.lame_mu()) * cell_width * touching }
    }

    /// Makes the first guess one that is possible: what does not part sticks.
    pub(super) fn begin(&mut self, u: &mut [DVec3]) {
        for pair in &mut self.all {
            let way = pair.beyond_touch(u);
            pair.hold = if way.dot(pair.normal) <= self.touching { Hold::Sticks } else { Hold::Open };
            if pair.hold == Hold::Sticks {
                pair.bring_together(u, way);
            }
        }
        self.close(u);
    }

    /// Whether nothing is cut.
    pub(super) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Takes from the displacements what approaches, and what friction would have slide back.
    pub(super) fn close(&self, u: &mut [DVec3]) {
        for pair in &self.all {
            let slid = pair.slid(u);
            if matches!(pair.hold, Hold::Slides(friction) if friction.dot(slid) > 0.0) {
                pair.bring_together(u, slid);
            }
            let across = pair.beyond_touch(u).dot(pair.normal);
            if across < 0.0 {
                pair.bring_together(u, across * pair.normal);
            }
        }
    }

    /// Which pairs are closed at the displacements `u` \[m\] with the slope there, and how they hold.
    pub(super) fn settle(&mut self, u: &[DVec3], slope: &[DVec3]) {
        for pair in &mut self.all {
            let reaction = pair.reaction(slope);
            let push = reaction.dot(pair.normal);
            let along = reaction - push * pair.normal;
            let most = CUT_FRICTION * push.max(0.0);
            let slid = pair.slid(u);
            pair.hold = match () {
                () if pair.beyond_touch(u).dot(pair.normal) > self.touching || push < -self.nothing => Hold::Open,
                () if slid.length() > self.sliding => Hold::Slides(slid * (-most / slid.length())),
                () if along.length() <= most.max(self.nothing) => Hold::Sticks,
                () => Hold::Slides(along * (most / along.length())),
            };
        }
    }

    /// Adds the friction of what slides to a slope.
    pub(super) fn rub(&self, slope: &mut [DVec3]) {
        for pair in &self.all {
            if let Hold::Slides(friction) = pair.hold {
                pair.push(slope, friction);
            }
        }
    }

    /// Takes the reactions of closed pairs from a slope.
    pub(super) fn without_reactions(&self, mut slope: Vec<DVec3>) -> Vec<DVec3> {
        for pair in self.all.iter().rev() {
            let held = pair.held(pair.reaction(&slope));
            pair.push(&mut slope, held);
        }
        slope
    }

    /// Takes from a step what would part closed pairs, or close them further.
    pub(super) fn along(&self, mut step: Vec<DVec3>) -> Vec<DVec3> {
        for pair in &self.all {
            let held = pair.held(pair.apart(&step));
            pair.bring_together(&mut step, held);
        }
        step
    }
}

impl Pair {
    /// None of what is held by walls across the cut, or too light on both sides.
    fn new(unknowns: &Unknowns, fields: [usize; 2], normal: DVec3, room: f64) -> Option<Self> {
        let [a, b] = fields.map(|field| &unknowns.all[field]);
        let is_found = |free: DVec3| free.cmpne(DVec3::ZERO) != BVec3::FALSE;
        let total = a.mass + b.mass;
        let shares = match (is_found(a.free), is_found(b.free)) {
            (true, true) => [b.mass / total, a.mass / total],
            (true, false) => [0.0, 1.0],
            (false, true) => [1.0, 0.0],
            (false, false) => return None,
        };
        let normal = (normal * a.free.max(b.free)).try_normalize()?;
        Some(Self { fields, normal, room, shares, hold: Hold::Open })
    }
}
