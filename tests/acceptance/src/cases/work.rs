//! What becomes of a tool's work: motion, strain, flow, friction, and what the method itself takes. It must
//! take little and may give nothing.

use crate::lab::{DX, Lab, Mover, Size, at_walls, block, place, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::penalty::{NORMAL_STIFFNESS, area, reach};
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use rayon::prelude::*;

/// Travel between two looks at the books \[cells\].
const SAMPLE: f64 = 0.1;

/// Energy from nowhere [% of the work]: kinetic and elastic energy stand half a substep apart, so that their
/// sum swings by omega dt / 2 < 1 of what moves, and tools at less than a hundredth of the waves' speed leave
/// less than a thousandth of their work in motion.
const CREATED: f64 = 0.1;

/// What the method may take [% of the work]: as much as a tool's force may be off, of which it is a part.
const LOST: f64 = 5.0;

/// A tool's work on clay and what stands against it \[J\].
struct Books {
    lab: Lab,
    domain: Domain,
    mover: Mover,
    /// Speed of the tool [m/s].
    speed: f64,
    /// What the tool has brought in, and the most of it so far.
    work: [f64; 2],
    /// What stands in no other book, and the most of it so far: what transfer and averaging took,
    /// and friction.
    missing: [f64; 2],
    /// Greatest fall of what is missing: energy from nowhere.
    created: f64,
    is_sound: bool,
}

impl Books {
    fn new(clay: &Snapshot, mover: Mover, speed: f64) -> Self {
        let mut lab = Lab::with_threads(clay, stable_step(&clay.material), 1);
        lab.plan.volume_averaging = VOLUME_AVERAGING;
        Self { lab, domain: clay.domain, mover, speed, work: [0.0; 2], missing: [0.0; 2], created: 0.0, is_sound: true }
    }

    /// The tool goes `way` \[cells\] along `direction`, or is held as long as it takes for that.
    fn go(&mut self, way: f64, direction: DVec3) {
        let steps = (SAMPLE * DX / self.speed / self.lab.plan.dt).ceil();
        self.mover.velocity = direction * SAMPLE * DX / (steps * self.lab.plan.dt);
        for _ in 0..(way / SAMPLE).round() as u32 {
            let report = self.lab.frame_moving(steps as u32, &mut self.mover);
            let is_sound = report.health.is_ok() && report.redone == 0 && report.clamped == 0;
            // A tool that does not turn: the work of each substep's force on its way.
            let work = self.work[0] - report.tools[0].impulse.dot(self.mover.velocity);
            let particles = self.lab.particles();
            let stored = report.energies.kinetic + report.energies.elastic + self.springs(&particles);
            let missing = work - stored - self.flow(&particles);
            self.is_sound &= is_sound;
            self.created = self.created.max(self.missing[1] - missing);
            self.work = [work, self.work[1].max(work)];
            self.missing = [missing, self.missing[1].max(missing)];
        }
    }

    /// What flow has taken: the yield stress on the plastic strain.
    fn flow(&self, particles: &[Particle]) -> f64 {
        let yield_stress = self.lab.plan.material.yield_stress;
        if yield_stress.is_infinite() {
            return 0.0;
        }
        particles.iter().map(|p| yield_stress * f64::from(p.rest_volume) * f64::from(p.hardening)).sum()
    }

    /// What stands in the normal springs of contact; blades have none.
    fn springs(&self, particles: &[Particle]) -> f64 {
        let shape = &self.mover.tool.shape;
        if shape.is_blade() {
            return 0.0;
        }
        let material = &self.lab.plan.material;
        let stiffness = NORMAL_STIFFNESS * (material.lame_lambda() + 2.0 * material.lame_mu());
        let of = |p: &Particle| {
            let volume = f64::from(p.rest_volume) / DX.powi(3);
            let distance = shape.distance(self.mover.pose.to_local(self.domain.to_world(p.grid()))) / DX;
            0.5 * area(volume) * stiffness * (distance - reach(volume)).min(0.0).powi(2) * DX.powi(3)
        };
        particles.iter().map(of).sum()
    }

    /// An amount of energy over the work [%]; NaN for a run that went wrong, or where no work was done.
    fn share(&self, energy: f64) -> f64 {
        if self.is_sound && self.work[1] > 0.0 { 100.0 * energy / self.work[1] } else { f64::NAN }
    }

    /// Energy that came from nowhere at any time.
    fn created(&self, name: &str) -> Row {
        Row::at_most(format!("{name}: energy from nowhere"), self.share(self.created), "% of the work", CREATED)
    }

    /// What is missing at the end.
    fn lost(&self, name: &str) -> Row {
        Row::at_most(format!("{name}: work lost by the method"), self.share(self.missing[0]), "% of the work", LOST)
    }
}

/// The sides of a cut of normal `normal` through `middle` \[cells\], on all clay within its band.
pub fn cut(particles: &mut [Particle], normal: DVec3, middle: DVec3) {
    for p in particles {
        let distance = (place(p) - middle).dot(normal);
        if distance.abs() < 2.0 {
            p.tags[0] = Tag { sheet: 1, side: if distance < 0.0 { -1 } else { 1 } };
        }
    }
}

/// A quarter of a block on a sticking floor between slip walls, and a ball of `radius` \[cells\] that is
/// pressed into it by half its radius and taken out again.
fn ball(material: ClayMaterial, contact: Contact, is_cut: bool, [radius, speed]: [f64; 2]) -> Books {
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], high: [Wall::Slip, Wall::Separate, Wall::Slip] };
    let size = IVec3::new(3, 3, 3) * radius as i32 - IVec3::Y;
    let domain = room_with([size.x, size.y + 8, size.z], walls);
    let mut particles = block(DVec3::ZERO, size);
    if is_cut {
        // Half a radius below the top.
        cut(&mut particles, DVec3::new(0.3, 1.0, 0.2).normalize(), DVec3::Y * (f64::from(size.y) - 0.5 * radius));
    }
    at_walls(&domain, &mut particles);
    let at = DVec3::Y * (f64::from(size.y) + radius + 0.05);
    let mover = Mover::new(&domain, ToolShape::Sphere { radius }, contact, at, DQuat::IDENTITY);
    let mut books = Books::new(&snapshot(domain, material, particles), mover, speed);
    books.go(0.1 + 0.5 * radius, DVec3::NEG_Y);
    books.go(0.3, DVec3::ZERO);
    books.go(0.3 + 0.5 * radius, DVec3::Y);
    books.go(0.3, DVec3::ZERO);
    books
}

/// A blade without friction goes edge-first into a block, presses on one flank, then on the other, and
/// leaves.
fn blade(material: ClayMaterial, speed: f64) -> Books {
    let walls = Walls { low: [Wall::Stick; 3], high: [Wall::Stick, Wall::Separate, Wall::Stick] };
    let domain = room_with([10, 14, 6], walls);
    let mut particles = block(DVec3::ZERO, IVec3::new(10, 7, 6));
    at_walls(&domain, &mut particles);
    let shape = ToolShape::Blade { half_width: 1.7, half_height: 2.4 };
    let contact = Contact::Separate { friction: 0.0 };
    let mover = Mover::new(&domain, shape, contact, DVec3::new(5.1, 9.5, 3.0), super::blade::along_x());
    let mut books = Books::new(&snapshot(domain, material, particles), mover, speed);
    books.go(3.0, DVec3::NEG_Y);
    books.go(0.8, DVec3::X);
    books.go(1.2, DVec3::NEG_X);
    books.go(3.0, DVec3::Y);
    books.go(0.3, DVec3::ZERO);
    books
}

/// Balls on elastic clay and on clay that flows, whole and cut, and a blade.
pub fn tools(size: Size) -> Vec<Row> {
    let ball_of = size.pick([2.0, 0.2], [3.0, 0.2], [4.0, 0.1]);
    let clay = ClayMaterial { weld: Weld::Off, ..Preset::SoftClay.material() };
    let elastic = ClayMaterial { yield_stress: f64::INFINITY, ..clay };
    let (smooth, rough) = (Contact::Separate { friction: 0.0 }, Contact::default());
    let judged = |name: &str, books: &Books| vec![books.created(name), books.lost(name)];
    // Friction takes what it takes: of what is missing then, no share is the method's by name.
    let rubbed = |name: &str, books: &Books| vec![books.created(name)];
    let mut runs: Vec<Box<dyn Fn() -> Vec<Row> + Sync>> = vec![
        Box::new(|| judged("ball on elastic clay", &ball(elastic, smooth, false, ball_of))),
        Box::new(|| judged("ball on clay", &ball(clay, smooth, false, ball_of))),
        Box::new(|| rubbed("ball with friction on a cut", &ball(clay, rough, true, ball_of))),
        Box::new(|| rubbed("blade into clay and across", &blade(clay, ball_of[1]))),
    ];
    if size == Size::Full {
        runs.push(Box::new(|| rubbed("ball that sticks to clay", &ball(clay, Contact::Stick, false, ball_of))));
        runs.push(Box::new(|| rubbed("ball on cut elastic clay", &ball(elastic, smooth, true, ball_of))));
    }
    runs.par_iter().flat_map_iter(|run| run()).collect()
}
