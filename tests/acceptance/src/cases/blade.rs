//! Cuts: nothing passes through the blade, the cut stays when the blade leaves, nothing changes sides at
//! rest.

use crate::lab::{
    Lab, Mover, Random, Size, block, elastic, is_implicit, jitter, place, room, room_with, set_velocity, snapshot, stable_step,
    velocity, wave_step,
};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;

/// Blade with its front along +x.
pub fn along_x() -> DQuat {
    DQuat::from_rotation_y(FRAC_PI_2)
}

/// Depth beyond the blade's plane from which a particle counts as through \[cells\]: clay pressed against the
/// blade stands up to a substep's travel behind it until the next substep puts it back.
pub const DEPTH: f64 = 0.1;

/// Counts particles that go through the rectangle, from positions alone.
pub struct Witness {
    half_width: f64,
    half_height: f64,
    depth: f64,
    /// Side of the plane on which each particle last was clear of it; 0 beside the rectangle.
    side: Vec<i8>,
    /// Side on which each first was clear of it since it last was beside the rectangle, and the greatest
    /// depth beyond the plane from there.
    home: Vec<(i8, f64)>,
    is_through: Vec<bool>,
    leaked: usize,
}

impl Witness {
    /// For `count` particles and a rectangle; one is through from `depth` beyond the plane. All in the unit
    /// of the places to be watched.
    pub fn new(half_width: f64, half_height: f64, depth: f64, count: usize) -> Self {
        let (side, home, is_through) = (vec![0; count], vec![(0, 0.0); count], vec![false; count]);
        Self { half_width, half_height, depth, side, home, is_through, leaked: 0 }
    }

    /// Whether the particle ever went through.
    pub fn is_through(&self, index: usize) -> bool {
        self.is_through[index]
    }

    /// How far the particle ever was behind the rectangle, seen from where it came.
    pub fn depth(&self, index: usize) -> f64 {
        self.home[index].1
    }

    fn is_inside(&self, q: DVec3) -> bool {
        q.x.abs() <= self.half_width && q.y.abs() <= self.half_height
    }

    /// Watches one frame of one substep in which a particle went from `before` to `after`, both in the
    /// blade's frame then \[m\]. If the engine cut the frame into several (`is_cut_up`), the way between is not
    /// known, and only what ends at the rectangle is counted.
    pub fn watch(&mut self, index: usize, before: DVec3, after: DVec3, is_cut_up: bool) {
        let sign = |q: DVec3| if q.z < 0.0 { -1 } else { 1 };
        self.measure(index, before, after);
        if !self.is_inside(before) {
            self.side[index] = 0;
        } else if before.z.abs() > self.depth {
            self.side[index] = sign(before);
        }
        let crossed = sign(before) != sign(after);
        let foot = if crossed && !is_cut_up { before.lerp(after, before.z / (before.z - after.z)) } else { after };
        let from = match self.side[index] {
            _ if !self.is_inside(foot) => 0,
            // It came from beside the rectangle, or stands at the plane since the start: only this substep's
            // crossing is sure.
            0 if crossed => sign(before),
            side => side,
        };
        if after.z.abs() > self.depth && from * sign(after) < 0 {
            self.leaked += 1;
            self.is_through[index] = true;
            self.side[index] = sign(after);
        } else if !self.is_inside(before) && self.is_inside(after) {
            // It came round the rim, or from beside it through the plane, by less than counts: then it
            // belongs where it came from.
            self.side[index] = if crossed && self.is_inside(foot) { sign(before) } else { sign(after) };
        }
    }

    /// Notes how far a particle is behind the rectangle.
    fn measure(&mut self, index: usize, before: DVec3, after: DVec3) {
        let (home, depth) = &mut self.home[index];
        if before.x.abs() > self.half_width || before.y.abs() > self.half_height {
            *home = 0;
        } else if *home == 0 && before.z.abs() > self.depth {
            *home = if before.z < 0.0 { -1 } else { 1 };
        }
        if after.x.abs() <= self.half_width && after.y.abs() <= self.half_height {
            *depth = depth.max(-after.z * f64::from(*home));
        }
    }
}

/// What a sweep left.
struct Sweep {
    /// Particles that went through the rectangle.
    leaked: usize,
    /// Frames that were given up.
    given_up: u32,
    ratio: (f64, f64),
    is_finite: bool,
}

/// A blade of 12 x 6 cells is swept 16 cells through a block, `travel` cells per substep of CFL number 0.4.
fn sweep(travel: f64, seed: u64) -> Sweep {
    let domain = room([40, 20, 12], Wall::Slip);
    let material = ClayMaterial { poisson_ratio: 0.3, ..Preset::SoftClay.material() };
    let mut particles = block(DVec3::new(6.0, 0.0, 0.0), IVec3::new(28, 16, 12));
    jitter(&mut particles, 0.1, seed);
    let (low, high) = domain.wall_nodes();
    particles.iter_mut().for_each(|p| p.set_grid(p.grid().clamp(low.as_dvec3(), high.as_dvec3())));
    let mut lab = Lab::new(&snapshot(domain, material, particles), wave_step(&material, 0.4));
    let shape = ToolShape::Blade { half_width: 3.0, half_height: 6.0 };
    let mut random = Random::new(seed);
    let at = DVec3::new(11.03 + 0.3 * random.uniform(), 8.0, 6.0);
    let mut mover = Mover::new(&domain, shape, Contact::Separate { friction: 0.0 }, at, along_x());
    mover.velocity = DVec3::X * travel * domain.cell_width / lab.plan.dt;
    let (half_width, half_height) = (3.0 * domain.cell_width, 6.0 * domain.cell_width);
    let mut before = lab.particles();
    let mut witness = Witness::new(half_width, half_height, DEPTH * domain.cell_width, before.len());
    let (mut given_up, mut ratio) = (0, (f64::INFINITY, 0.0f64));
    let steps = (16.0 / travel).ceil() as u32;
    for _ in 0..steps {
        let start = mover.pose;
        let report = lab.frame_moving(1, &mut mover);
        given_up += u32::from(report.health.contains(Health::GIVEN_UP));
        ratio = (ratio.0.min(report.volume_ratio.0), ratio.1.max(report.volume_ratio.1));
        let after = lab.particles();
        for (i, (a, b)) in before.iter().zip(&after).enumerate() {
            let [a, b] = [(start, a), (mover.pose, b)].map(|(pose, p)| pose.to_local(domain.to_world(p.grid())));
            witness.watch(i, a, b, report.redone > 0 || report.steps > 1);
        }
        before = after;
    }
    Sweep { leaked: witness.leaked, given_up, ratio, is_finite: before.iter().all(Particle::is_finite) }
}

/// Sweeps at 0.02 to 3 cells per substep.
pub fn leak(size: Size) -> Vec<Row> {
    // Implicit steps of tools as fast as sound are up to two hundred passes a substep.
    let (speeds, seeds): (&[f64], _) = match is_implicit() {
        true => (size.pick(&[0.5], &[0.5], &[0.1, 0.5, 1.0, 3.0]), 1),
        false => (size.pick(&[0.1, 1.0, 3.0], &[0.1, 0.5, 1.0, 3.0], &[0.02, 0.1, 0.5, 1.0, 3.0]), size.pick(1, 1, 5)),
    };
    let mut rows = vec![];
    for &travel in speeds {
        let sweeps: Vec<Sweep> = (0..seeds).map(|seed| sweep(travel, seed)).collect();
        let name = |what: &str| format!("blade leak: {what} in {seeds} x 16 cells, {travel} a substep");
        let sum = |f: &dyn Fn(&Sweep) -> f64| sweeps.iter().map(f).sum::<f64>();
        rows.push(Row::at_most(name("particles through"), sum(&|s| s.leaked as f64), "particles", 0.0));
        rows.push(Row::at_most(name("frames given up"), sum(&|s| f64::from(s.given_up)), "frames", 0.0));
        rows.push(Row::at_most(name("clay not finite"), sum(&|s| f64::from(u8::from(!s.is_finite))), "sweeps", 0.0));
        if travel <= 0.1 {
            rows.push(Row::at_least(name("least J"), sweeps.iter().map(|s| s.ratio.0).fold(f64::INFINITY, f64::min), "-", 0.5));
            rows.push(Row::at_most(name("greatest J"), sweeps.iter().map(|s| s.ratio.1).fold(0.0, f64::max), "-", 2.0));
        }
    }
    rows
}

/// A block that is cut through, and what its halves keep of their momentum when they are pulled apart.
struct Halves {
    domain: Domain,
    material: ClayMaterial,
    dt: f64,
    /// The blade's plane [cells].
    at: DVec3,
    /// The clay when the blade has been in it.
    cut: Vec<Particle>,
    cutting: CuttingMethod,
}

/// Momentum of a half after the blade has left and the halves were pulled apart, of that which they were
/// given.
pub fn kept_when_pulled(cutting: CuttingMethod) -> f64 {
    let halves = Halves::new(cutting);
    halves.pull(&halves.cut).0
}

impl Halves {
    fn new(cutting: CuttingMethod) -> Self {
        let domain = room([32, 16, 16], Wall::Separate);
        let material = elastic(0.3);
        let particles = block(DVec3::new(11.0, 4.0, 4.0), IVec3::new(10, 8, 8));
        let dt = wave_step(&material, 0.4);
        let mut lab = Lab::new(&snapshot(domain, material, particles), dt);
        lab.plan.cutting = cutting;
        let shape = ToolShape::Blade { half_width: 7.0, half_height: 7.0 };
        let at = DVec3::new(16.1, 8.0, 8.0);
        let mut mover = Mover::new(&domain, shape, Contact::default(), at, along_x());
        lab.frame_moving(20, &mut mover);
        Self { domain, material, dt, at, cut: lab.particles(), cutting }
    }

    /// Half a lattice spacing either side of the plane: every particle is clearly on one side.
    fn is_front(&self, p: &Particle) -> bool {
        place(p).x > self.at.x
    }

    /// Pulls at clay that stands as the cut one does: what the front half keeps of its momentum, and the clay
    /// afterwards.
    fn pull(&self, clay: &[Particle]) -> (f64, Vec<Particle>) {
        let speed = 0.01 * self.material.wave_speed(self.material.density);
        let mut clay = clay.to_vec();
        for p in &mut clay {
            set_velocity(p, DVec3::X * if self.is_front(p) { speed } else { -speed });
        }
        let mut lab = Lab::new(&snapshot(self.domain, self.material, clay.clone()), self.dt);
        lab.plan.cutting = self.cutting;
        lab.frame(400);
        let after = lab.particles();
        let front: f64 = clay.iter().zip(&after).filter(|(a, _)| self.is_front(a)).map(|(_, b)| velocity(b).x).sum();
        (front / (speed * clay.iter().filter(|p| self.is_front(p)).count() as f64), after)
    }
}

/// A block is cut through, the blade is taken away, and the halves are pulled apart.
pub fn withdrawn(_: Size) -> Vec<Row> {
    let halves = Halves::new(CuttingMethod::default());
    let (cut, at) = (&halves.cut, halves.at);
    let (kept, after) = halves.pull(cut);
    // A side is kept by its tag, or by being another body's than all of the other side are.
    let bodies_of = |side: i8| -> BTreeSet<u32> {
        cut.iter().zip(&after).filter(|(a, _)| a.tags[0].sign() == side).map(|(_, b)| b.body).collect()
    };
    let others = [bodies_of(-1), bodies_of(1)];
    let sides = |p: &Particle| p.tags.map(|tag| (tag.sheet, tag.sign()));
    let is_lost = |(a, b): &(&Particle, &Particle)| {
        a.tags[0].side != 0 && sides(a) != sides(b) && others[usize::from(a.tags[0].side < 0)].contains(&b.body)
    };
    let sides_lost = cut.iter().zip(&after).filter(is_lost).count();
    let untagged = |p: &Particle| Particle { tags: Default::default(), ..*p };
    let (whole, _) = halves.pull(&cut.iter().map(untagged).collect::<Vec<_>>());
    let band = |p: &Particle| (place(p).x - at.x).abs() < 1.4;
    let wrong = cut.iter().filter(|p| band(p) && p.tags[0].sign() != if halves.is_front(p) { 1 } else { -1 }).count();
    vec![
        Row::at_most("blade withdrawn: particles in its band on no or the wrong side", wrong as f64, "particles", 0.0),
        Row::at_most("blade withdrawn: sides lost while pulled apart", sides_lost as f64, "particles", 0.0),
        Row::at_most("blade withdrawn: momentum that crosses the cut", (kept - 1.0).abs(), "of m v", 1e-3),
        // The same pull on whole clay: 400 substeps are four crossings of the block by a wave.
        Row::at_least("blade withdrawn: momentum that crosses whole clay", (whole - 1.0).abs(), "of m v", 0.2),
    ]
}

/// A blade stands half-way into a block that settles under gravity on a floor.
pub fn at_rest(size: Size) -> Vec<Row> {
    let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] };
    let domain = room_with([20, 16, 16], walls);
    let material = Preset::SoftClay.material();
    let mut particles = block(DVec3::new(5.0, 0.0, 4.0), IVec3::new(10, 8, 8));
    // Some particles stand at the blade's plane and are pressed against it: without memory they would change
    // sides.
    jitter(&mut particles, 0.24, 5);
    let mut random = Random::new(5);
    let speed = 1e-2 * material.wave_speed(material.density);
    for p in &mut particles {
        set_velocity(p, DVec3::new(random.uniform(), random.uniform(), random.uniform()) * speed);
    }
    let mut lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
    lab.plan.gravity = DVec3::new(0.0, -9.81, 0.0);
    let shape = ToolShape::Blade { half_width: 6.0, half_height: 4.0 };
    let mut mover = Mover::new(&domain, shape, Contact::default(), DVec3::new(10.02, 8.2, 8.0), along_x());
    let (mut flips, mut on_wrong_side) = (0, 0);
    let mut before = lab.particles();
    for _ in 0..size.pick(50, 100, 1000) {
        lab.frame_moving(10, &mut mover);
        let after = lab.particles();
        flips += before.iter().zip(&after).filter(|(a, b)| a.tags[0].sign() * b.tags[0].sign() < 0).count();
        before = after;
    }
    for p in &before {
        let q = mover.pose.to_local(domain.to_world(p.grid())) / domain.cell_width;
        let is_at_blade = q.x.abs() < 5.9 && q.y.abs() < 3.9 && q.z.abs() < 1.4 && q.z.abs() > 0.1;
        on_wrong_side += usize::from(is_at_blade && f64::from(p.tags[0].side) * q.z <= 0.0);
    }
    let steps = size.pick(500, 1000, 10_000);
    vec![
        Row::at_most(format!("blade at rest: sides changed in {steps} substeps"), flips as f64, "particles", 0.0),
        Row::at_most("blade at rest: particles beside it on no or the wrong side", on_wrong_side as f64, "particles", 0.0),
    ]
}
