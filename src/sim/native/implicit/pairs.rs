//! The two sides of a kept cut press on each other, as the oracle's file of this name has it: fields of a
//! node that a cut divides may part, and not approach. In f64, one pair after the other.

use super::super::super::implicit::{CLOSED_GAP, SLIDING_WAY};
use super::super::super::tool::CUT_FRICTION;
use super::vectors::{Block3, Vector};
use glam::DVec3;

/// Two fields of a node, the unit normal from the first to the second, and how far they may come together
/// before they bear \[cells\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Divided {
    /// The slots in which they are unknowns.
    pub(super) slots: [u32; 2],
    /// The node in its block.
    pub(super) node: u8,
    pub(super) normal: DVec3,
    pub(super) room: f64,
}

/// Whether, and how, a pair bears.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Hold {
    Open,
    /// Closed, and held along the cut too: it has not slid in this step, or hardly.
    Sticks,
    /// Closed, with this force on the second along the cut.
    Slides(DVec3),
}

#[derive(Clone, Copy, Debug)]
struct Pair {
    fields: [Field; 2],
    normal: DVec3,
    /// How far they may come together before they bear \[cells\].
    room: f64,
    /// How much of a way between them each of them gives.
    shares: [f64; 2],
    hold: Hold,
}

/// Slot and node.
#[derive(Clone, Copy, Debug)]
struct Field(usize, usize);

impl Field {
    fn of(self, vector: &[Block3]) -> DVec3 {
        let [x, y, z] = &vector[self.0].0;
        DVec3::new(x[self.1].into(), y[self.1].into(), z[self.1].into())
    }

    fn add(self, vector: &mut [Block3], more: DVec3) {
        let sum = (self.of(vector) + more).as_vec3();
        (0..3).for_each(|d| vector[self.0].0[d][self.1] = sum[d]);
    }
}

impl Pair {
    /// None of what is held by walls across the cut, or too light on both sides.
    fn new(divided: &Divided, mass: &[[f32; 64]], free: &[Block3]) -> Option<Self> {
        let fields = divided.slots.map(|slot| Field(slot as usize, divided.node.into()));
        let [a, b] = fields.map(|field| f64::from(mass[field.0][field.1]));
        let free = fields.map(|field| field.of(free));
        let shares = match free.map(|free| free != DVec3::ZERO) {
            _ if a <= 0.0 || b <= 0.0 => return None,
            [true, true] => [b / (a + b), a / (a + b)],
            [true, false] => [0.0, 1.0],
            [false, true] => [1.0, 0.0],
            [false, false] => return None,
        };
        let normal = (divided.normal * free[0].max(free[1])).try_normalize()?;
        Some(Self { fields, normal, room: divided.room, shares, hold: Hold::Open })
    }

    fn apart(&self, vector: &[Block3]) -> DVec3 {
        self.fields[1].of(vector) - self.fields[0].of(vector)
    }

    /// The way of the second against the first from where they would touch.
    fn beyond_touch(&self, u: &[Block3]) -> DVec3 {
        self.apart(u) + self.room * self.normal
    }

    /// The part of that way along the cut: how far they have slid in this step.
    fn slid(&self, u: &[Block3]) -> DVec3 {
        self.apart(u).reject_from_normalized(self.normal)
    }

    /// What is out of balance between the two, as a force on the second.
    fn reaction(&self, slope: &[Block3]) -> DVec3 {
        self.shares[1] * self.fields[1].of(slope) - self.shares[0] * self.fields[0].of(slope)
    }

    /// Takes `way` between the two from both.
    fn bring_together(&self, u: &mut [Block3], way: DVec3) {
        self.fields[0].add(u, self.shares[0] * way);
        self.fields[1].add(u, -self.shares[1] * way);
    }

    /// Adds a force on the second, and its opposite on the first, to a slope.
    fn push(&self, slope: &mut [Block3], force: DVec3) {
        self.fields[0].add(slope, force);
        self.fields[1].add(slope, -force);
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

/// The pairs of a step.
#[derive(Clone, Debug)]
pub(super) struct Pairs {
    all: Vec<Pair>,
    /// Forces that count as none.
    nothing: f64,
}

impl Pairs {
    /// The pairs of nodes of these masses that kept cuts divide, of clay of this P-wave modulus; `free` is 0
    /// where nothing is to be found.
    pub(super) fn new(divided: &[Divided], (mass, free): (&[[f32; 64]], &[Block3]), modulus: f64) -> Self {
        let all = divided.iter().filter_map(|divided| Pair::new(divided, mass, free)).collect();
        Self { all, nothing: CLOSED_GAP * modulus }
    }

    /// Whether no cut divides any node.
    pub(super) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Makes the first guess one that is possible: what does not part sticks.
    pub(super) fn begin(&mut self, u: &mut Vector) {
        for pair in &mut self.all {
            let way = pair.beyond_touch(u);
            pair.hold = if way.dot(pair.normal) <= CLOSED_GAP { Hold::Sticks } else { Hold::Open };
            if pair.hold == Hold::Sticks {
                pair.bring_together(u, way);
            }
        }
        self.close(u);
    }

    /// Takes from the displacements what approaches, and what friction would have slide back. Whether
    /// anything does comes back.
    pub(super) fn close(&self, u: &mut Vector) -> bool {
        let mut is_any = false;
        for pair in &self.all {
            let slid = pair.slid(u);
            if matches!(pair.hold, Hold::Slides(friction) if friction.dot(slid) > 0.0) {
                is_any = true;
                pair.bring_together(u, slid);
            }
            let across = pair.beyond_touch(u).dot(pair.normal);
            if across < 0.0 {
                is_any = true;
                pair.bring_together(u, across * pair.normal);
            }
        }
        is_any
    }

    /// Which pairs are closed at the displacements `u` with the slope there, and how they hold.
    pub(super) fn settle(&mut self, u: &Vector, slope: &Vector) {
        for pair in &mut self.all {
            let reaction = pair.reaction(slope);
            let push = reaction.dot(pair.normal);
            let along = reaction - push * pair.normal;
            let most = CUT_FRICTION * push.max(0.0);
            let slid = pair.slid(u);
            pair.hold = match () {
                () if pair.beyond_touch(u).dot(pair.normal) > CLOSED_GAP || push < -self.nothing => Hold::Open,
                () if slid.length() > SLIDING_WAY => Hold::Slides(slid * (-most / slid.length())),
                () if along.length() <= most.max(self.nothing) => Hold::Sticks,
                () => Hold::Slides(along * (most / along.length())),
            };
        }
    }

    /// Adds the friction of what slides to a slope.
    pub(super) fn rub(&self, slope: &mut Vector) {
        for pair in &self.all {
            if let Hold::Slides(friction) = pair.hold {
                pair.push(slope, friction);
            }
        }
    }

    /// What friction adds to the product of a slope and a step.
    pub(super) fn work(&self, step: &Vector) -> f64 {
        let of = |pair: &Pair| match pair.hold {
            Hold::Slides(friction) => -friction.dot(pair.apart(step)),
            Hold::Open | Hold::Sticks => 0.0,
        };
        self.all.iter().map(of).sum()
    }

    /// Takes the reactions of closed pairs from a slope.
    pub(super) fn take_reactions(&self, slope: &mut Vector) {
        for pair in self.all.iter().rev().filter(|pair| pair.hold != Hold::Open) {
            let held = pair.held(pair.reaction(slope));
            pair.push(slope, held);
        }
    }

    /// Takes from a step what would part closed pairs, or close them further.
    pub(super) fn take_ways(&self, step: &mut Vector) {
        for pair in self.all.iter().filter(|pair| pair.hold != Hold::Open) {
            let held = pair.held(pair.apart(step));
            pair.bring_together(step, held);
        }
    }
}
