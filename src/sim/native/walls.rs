//! Walls before particles: what separating ones give, and where clay has arrived at the others.

use super::super::params::{BLOCK, Domain, Wall};
use super::super::penalty::{Springs, Surface, arrival, reach};
use super::super::tool::Contact;
use super::grid_step::GridReport;
use super::state::MARGIN;
use glam::{DVec3, IVec3};
use std::sync::atomic::{AtomicBool, Ordering};

/// How near clay gives mass to the nodes of a wall \[cells\].
const NODE_REACH: f64 = 1.5;

/// Where clay that has arrived gives mass to the walls that hold it: a mark for each of their nodes.
#[derive(Debug)]
pub(super) struct Arrivals {
    /// Of each wall by number; empty for one that holds nothing.
    marks: [Vec<AtomicBool>; 6],
    size: IVec3,
}

impl Arrivals {
    pub(super) fn new(domain: &Domain) -> Self {
        let size = domain.grid_cells();
        let kinds = [domain.walls.low, domain.walls.high];
        let marks = std::array::from_fn(|wall| {
            let (u, v) = across(wall);
            let count = if kinds[wall / 3][wall % 3] == Wall::Separate { 0 } else { size[u] * size[v] };
            (0..count).map(|_| AtomicBool::new(false)).collect()
        });
        Self { marks, size }
    }

    /// Takes all marks away.
    pub(super) fn clear(&mut self) {
        self.marks.iter_mut().flatten().for_each(|mark| *mark.get_mut() = false);
    }

    fn mark(&self, wall: usize, node: IVec3) -> Option<&AtomicBool> {
        let (u, v) = across(wall);
        self.marks[wall].get((node[u] * self.size[v] + node[v]) as usize)
    }

    /// Whether the wall of this number holds what moves at its node `node`.
    pub(super) fn holds(&self, wall: usize, node: IVec3) -> bool {
        self.mark(wall, node).is_some_and(|mark| mark.load(Ordering::Relaxed))
    }

    /// A particle at `at` has arrived at the wall.
    fn note(&self, wall: usize, at: DVec3) {
        let base = (at - 0.5).floor().as_ivec3();
        let (u, v) = across(wall);
        for i in 0..9 {
            let mut node = base;
            node[u] += i / 3;
            node[v] += i % 3;
            if let Some(mark) = self.mark(wall, node) {
                mark.store(true, Ordering::Relaxed);
            }
        }
    }
}

/// The axes along a wall.
const fn across(wall: usize) -> (usize, usize) {
    ((wall + 1) % 3, (wall + 2) % 3)
}

/// A wall that particles of a block may touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearWall {
    number: usize,
    kind: Wall,
    at: f64,
    normal: DVec3,
}

impl NearWall {
    /// The walls near `block`, by number.
    pub(super) fn of(block: IVec3, domain: &Domain) -> Vec<Self> {
        let (low, high) = domain.wall_nodes();
        let side = |walls: [Wall; 3], at: IVec3, inward: f64, first: usize| {
            (0..3)
                .map(move |d| (d, Self { number: first + d, kind: walls[d], at: at[d].into(), normal: inward * DVec3::AXES[d] }))
        };
        let is_near = |(axis, wall): &(usize, Self)| {
            let middle = f64::from(block[*axis] * BLOCK) + 0.5 * f64::from(BLOCK);
            (middle - wall.at).abs() < 0.5 * f64::from(BLOCK) + f64::from(MARGIN) + NODE_REACH
        };
        let walls = side(domain.walls.low, low, 1.0, 0).chain(side(domain.walls.high, high, -1.0, 3));
        walls.filter(is_near).map(|(_, wall)| wall).collect()
    }

    /// What the wall does to a particle of rest volume `volume` [cells^3] at `at` that moves at `velocity`
    /// and touched it before, or had arrived, if it `was_noted`: the velocity it gives, and whether that is
    /// so now.
    pub(super) fn touch(
        &self,
        (at, velocity, volume): (DVec3, DVec3, f64),
        springs: impl FnOnce() -> Springs,
        was_noted: bool,
        arrivals: &Arrivals,
    ) -> (DVec3, bool) {
        let distance = self.distance(at);
        match self.kind {
            Wall::Slip | Wall::Stick => {
                let has_arrived = self.has_arrived(at, volume, was_noted);
                if has_arrived {
                    arrivals.note(self.number, at);
                }
                (DVec3::ZERO, has_arrived)
            }
            Wall::Separate => {
                let gap = distance - reach(volume);
                if gap >= 0.0 {
                    return (DVec3::ZERO, false);
                }
                let leaving = self.normal.dot(velocity);
                let surface = Surface { contact: Contact::Separate { friction: 0.0 }, gap, normal: self.normal, leaving };
                let Some(touch) = springs().touch(&surface, at, was_noted.then_some(at)) else { return (DVec3::ZERO, false) };
                (touch.force / (8.0 * volume), touch.anchor.is_some())
            }
        }
    }

    /// Distance \[cells\] of a grid coordinate from the wall.
    pub(super) fn distance(&self, at: DVec3) -> f64 {
        (at - self.at).dot(self.normal)
    }

    /// Unit normal into the room.
    pub(super) fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Whether clay can leave the wall.
    pub(super) fn is_separating(&self) -> bool {
        self.kind == Wall::Separate
    }

    /// Whether it holds clay that has noted these walls.
    pub(super) fn holds(&self, noted: u32) -> bool {
        !self.is_separating() && noted & self.bit() != 0
    }

    /// Whether clay of rest volume `volume` [cells^3] has arrived at `at`, or had if it `was_noted` and not
    /// left since, at a wall that holds it.
    pub(super) fn has_arrived(&self, at: DVec3, volume: f64, was_noted: bool) -> bool {
        let distance = self.distance(at);
        !self.is_separating() && distance < NODE_REACH && (was_noted || distance <= arrival(volume))
    }

    /// Marks the nodes of the wall that clay at `at` reaches.
    pub(super) fn mark(&self, at: DVec3, arrivals: &Arrivals) {
        arrivals.note(self.number, at);
    }

    /// The wall's bit among those of a particle.
    pub(super) fn bit(&self) -> u32 {
        1 << self.number
    }
}

impl GridReport {
    /// Books the impulse of a wall on the clay.
    pub(super) fn push_by_wall(&mut self, impulse: DVec3) {
        self.wall_impulse += impulse;
        self.impulse_scale += impulse.length();
    }
}
