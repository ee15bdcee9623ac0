//! Scenes drawn by lot, in implicit steps: whatever is asked of them, clay stays finite, gains no energy from
//! nowhere, and a poor answer says so.

use super::planned::Planned;
use crate::lab::{DX, Mover, Random, Size, at_walls, block, is_sound, place, room_with, set_velocity, snapshot};
use crate::report::Row;
use bevy_clay::sim::planner::{Policy, RESIDUAL_MAX};
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use rayon::prelude::*;

/// Length of a frame \[s\].
const FRAME: f64 = 1.0 / 90.0;
/// Edge of the room \[cells\].
const ROOM: i32 = 16;
/// Greatest speed of a tool [m/s].
const SPEED_MAX: f64 = 1.0;

/// What happens to the clay.
struct Scene {
    clay: Snapshot,
    movers: Vec<Mover>,
    /// The frame before which the first tool jumps, and by how much \[m\].
    jump: (u32, DVec3),
    gravity: DVec3,
    frames: u32,
}

/// What came of a scene.
#[derive(Clone, Copy, Debug, Default)]
struct Outcome {
    /// Whether a particle was not finite, or the grid lost clay.
    is_broken: bool,
    /// Most energy that the clay had and nobody gave it, over what it had and forces times ways of what gave
    /// it some [-], after frames without a flag.
    gained: f64,
    /// The same after the others.
    gained_flagged: f64,
    /// Frames that said that they were poor.
    flagged: u32,
    frames: u32,
}

/// Draws lots.
struct Lots(Random);

impl Lots {
    /// In `low`..`high`.
    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * 0.5 * (self.0.uniform() + 1.0)
    }

    /// As many as `low`, or less than `high`.
    fn count(&mut self, low: i32, high: i32) -> i32 {
        self.within(f64::from(low), f64::from(high)).floor() as i32
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.count(0, all.len() as i32) as usize]
    }

    /// Between `low` and `high`, each factor as likely.
    fn factor(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.within(0.0, 1.0))
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| self.0.uniform()))
    }

    fn happens(&mut self, chance: f64) -> bool {
        self.within(0.0, 1.0) < chance
    }
}

fn material(lots: &mut Lots) -> ClayMaterial {
    let mut material = lots.one_of(&Preset::ALL).material();
    if lots.happens(0.5) {
        material.poisson_ratio = lots.within(0.0, 0.49);
        material.young_modulus = material.yield_stress * lots.factor(20.0, 500.0);
    }
    if lots.happens(0.3) {
        material.hardening_modulus = material.young_modulus * lots.within(0.0, 0.2);
    }
    if lots.happens(0.3) {
        material.softening = lots.within(0.0, 0.9);
    }
    material
}

/// A block, a sheet, a block above the floor, or crumbs.
fn clay(lots: &mut Lots) -> Snapshot {
    let wall = [Wall::Separate, Wall::Slip, Wall::Stick];
    let mut walls = Walls::default();
    walls.low.iter_mut().chain(&mut walls.high).for_each(|w| *w = lots.one_of(&wall));
    let domain = room_with([ROOM; 3], walls);
    let kind = lots.count(0, 4);
    let size = match kind {
        1 => IVec3::new(lots.count(6, 14), 1, lots.count(6, 14)),
        _ => IVec3::new(lots.count(2, 9), lots.count(2, 9), lots.count(2, 9)),
    };
    let room = f64::from(ROOM) - size.as_dvec3() - 1.0;
    let mut low = DVec3::new(lots.within(0.5, room.x), 0.0, lots.within(0.5, room.z));
    if kind == 2 {
        low.y = lots.within(0.0, room.y);
    }
    let mut particles = block(low, size);
    if kind == 3 {
        particles.retain(|_| lots.happens(0.3));
    }
    at_walls(&domain, &mut particles);
    if lots.happens(0.2) {
        let velocity = lots.vector();
        particles.iter_mut().for_each(|p| set_velocity(p, velocity));
    }
    (0..).zip(&mut particles).for_each(|(id, p)| p.id = id);
    snapshot(domain, material(lots), particles)
}

fn contact(lots: &mut Lots) -> Contact {
    let friction = lots.within(0.0, 1.0);
    lots.one_of(&[Contact::Stick, Contact::Slip, Contact::Separate { friction }, Contact::Separate { friction: 0.0 }])
}

/// A tool that goes through the clay's middle, more or less, from where it does not touch it yet.
fn tool(lots: &mut Lots, clay: &Snapshot, id: u32) -> Mover {
    const GAP: f64 = 0.5;
    let size = lots.within(1.0, 3.5);
    let shapes = [
        ToolShape::Sphere { radius: size },
        ToolShape::Capsule { radius: 0.6 * size, half_length: size },
        ToolShape::Box { half_size: DVec3::new(size, 0.5 * size, size) },
        ToolShape::Cone { radius: size, half_height: size },
        ToolShape::Blade { half_width: 2.0 * size, half_height: 2.0 * size },
    ];
    let shape = lots.one_of(&shapes);
    let middle = clay.particles.iter().map(place).sum::<DVec3>() / clay.particles.len().max(1) as f64;
    let direction = (lots.vector() + DVec3::NEG_Y * 0.5).normalize_or(DVec3::NEG_Y);
    let speed = lots.factor(0.005, SPEED_MAX);
    let turn = DQuat::from_axis_angle(lots.vector().normalize_or(DVec3::Y), lots.within(0.0, 3.0));
    let mut mover = Mover::new(&clay.domain, shape, contact(lots), middle + lots.vector(), turn);
    let nearest = |mover: &Mover| {
        let distance = |p: &Particle| mover.tool.shape.distance(mover.pose.to_local(clay.domain.to_world(p.grid())));
        clay.particles.iter().map(distance).fold(f64::INFINITY, f64::min)
    };
    while nearest(&mover) < GAP * DX {
        mover.pose.position -= 0.25 * DX * direction;
    }
    // It meets the clay some frames later.
    mover.pose.position -= direction * (speed * FRAME * lots.within(0.0, 4.0)).min(DX);
    Mover { id, velocity: direction * speed, ..mover }
}

/// Whether two tools come so near to each other on their ways that nothing could be between them.
fn collide([a, b]: [&Mover; 2], duration: f64) -> bool {
    const BETWEEN: f64 = 3.0 * DX;
    let (way, velocity) = (b.pose.position - a.pose.position, b.velocity - a.velocity);
    let nearest = (-way.dot(velocity) / velocity.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, duration);
    let radii = a.tool.shape.bounding_radius() + b.tool.shape.bounding_radius();
    (way + velocity * nearest).length() < radii + BETWEEN
}

impl Scene {
    fn drawn(seed: u64) -> Self {
        let mut lots = Lots(Random::new(seed));
        // Of neighbouring seeds the first numbers are alike.
        lots.vector();
        let clay = clay(&mut lots);
        let frames = lots.count(8, 21).cast_unsigned();
        let mut movers: Vec<Mover> = (1..=lots.count(0, 3).cast_unsigned()).map(|id| tool(&mut lots, &clay, id)).collect();
        // Rigid tools that go through each other leave clay between them nowhere to be.
        if let [a, b] = &movers[..]
            && collide([a, b], f64::from(frames) * FRAME)
        {
            movers.pop();
        }
        let jump = if lots.happens(0.2) {
            (lots.count(2, 20).cast_unsigned(), 3.0 * DX * lots.vector())
        } else {
            (u32::MAX, DVec3::ZERO)
        };
        let gravity = if lots.happens(0.7) { DVec3::NEG_Y * 9.81 } else { DVec3::ZERO };
        Self { clay, movers, jump, gravity, frames }
    }

    fn run(mut self) -> Outcome {
        let policy = Policy {
            integrator: IntegratorChoice::Implicit,
            gravity: self.gravity,
            outputs: FrameOutputs::ALL,
            ..Policy::default()
        };
        let mut planned = Planned::new(&self.clay, policy, 1);
        let density = self.clay.material.density;
        let kinetic = |p: &Particle| {
            0.5 * density * f64::from(p.rest_volume) * DVec3::from_array(p.velocity.map(f64::from)).length_squared()
        };
        let mut is_coming_out = false;
        // What half of the Earth's weight, the least that forces out of balance are judged by, gives in a
        // frame.
        let mass = density * self.clay.particles.iter().map(|p| f64::from(p.rest_volume)).sum::<f64>();
        let idle = 0.5 * mass * (0.5 * 9.81 * FRAME).powi(2);
        let (mut given, mut scale) = (self.clay.particles.iter().map(kinetic).sum::<f64>(), 0.0f64);
        let mut outcome = Outcome { frames: self.frames, ..Outcome::default() };
        for frame in 0..self.frames {
            if frame == self.jump.0 {
                self.movers.iter_mut().take(1).for_each(|m| m.pose.position += self.jump.1);
            }
            let paths: Vec<ToolPath> = self.movers.iter_mut().map(|m| m.path(FRAME)).collect();
            let before = self.clay_height(&planned);
            let report = planned.frame(FRAME, &paths);
            let fallen = self.gravity.y * density * (self.clay_height(&planned) - before);
            (given, scale) = (given + fallen, scale + fallen.abs());
            for tool in &report.tools {
                let Some(mover) = self.movers.iter().find(|m| m.id == tool.id) else { continue };
                given -= tool.impulse.dot(mover.velocity);
                scale += tool.impulse.length() * mover.velocity.length();
            }
            let energy = report.energies.kinetic + report.energies.elastic;
            is_coming_out &= report.tools.first().is_some_and(|tool| tool.contacts > 0);
            if frame == self.jump.0 || is_coming_out {
                // Springs of a tool that is put into clay hold energy that no way gave, until it is out.
                given = given.max(energy);
                is_coming_out = true;
            }
            let gained = (energy - given) / (scale + energy).max(idle).max(f64::MIN_POSITIVE);
            let is_flagged = report.residual > RESIDUAL_MAX || !report.health.is_ok() || report.redone > 0;
            outcome.flagged += u32::from(is_flagged);
            let most = if is_flagged { &mut outcome.gained_flagged } else { &mut outcome.gained };
            *most = most.max(gained);
            if is_flagged {
                // What poor frames gained is not counted again after them.
                given = given.max(energy);
            }
            let is_lost = report.health.contains(Health::MASS_LOST);
            // What is squeezed between rigid things may be torn in a frame that says so; not lost.
            let is_whole = is_sound(&planned.particles()) || is_flagged;
            outcome.is_broken |= is_lost || !energy.is_finite() || !is_whole;
        }
        outcome
    }

    /// Volume times height of the clay [m^4].
    fn clay_height(&self, planned: &Planned) -> f64 {
        planned.particles().iter().map(|p| f64::from(p.rest_volume) * self.clay.domain.to_world(p.grid()).y).sum()
    }
}

/// Scenes by lot, of fixed seeds.
pub fn scenes(size: Size) -> Vec<Row> {
    let count: u64 = size.pick(4, 8, 1000);
    let outcomes: Vec<Outcome> = (0..count).into_par_iter().map(|seed| Scene::drawn(seed).run()).collect();
    let broken = outcomes.iter().filter(|o| o.is_broken).count() as f64;
    let most = |of: fn(&Outcome) -> f64| outcomes.iter().map(of).fold(0.0, f64::max);
    let frames: u32 = outcomes.iter().map(|o| o.frames).sum();
    let flagged: u32 = outcomes.iter().map(|o| o.flagged).sum();
    vec![
        Row::at_most("implicit, scenes by lot: not finite, or clay lost", broken, "scenes", 0.0),
        Row::at_most("the same: energy from nowhere, over all", 100.0 * most(|o| o.gained), "%", 5.0),
        Row::figure("the same, in frames that say they are poor", 100.0 * most(|o| o.gained_flagged), "%"),
        Row::figure("the same: frames that say they are poor", 100.0 * f64::from(flagged) / f64::from(frames), "%"),
    ]
}
