//! The scene in which the law as published fails: a block stands on a sticky floor under its weight with a
//! tool at its top, in a slab 4 cells thick between slip walls (plane strain).

use crate::lab::Lab;
use bevy_clay::sim::params::WALL_NODE;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3};
use std::f64::consts::FRAC_PI_2;

/// Gravity [m/s^2].
const GRAVITY: f64 = 9.81;
/// Edge of the room [m]; the block stands in its middle.
const ROOM: f64 = 1.0;
/// Half the tool's extent across the block [m].
const TOOL_HALF_WIDTH: f64 = 0.05;
/// Height from which potential energy counts, below the floor [cells]: as in the reference computation.
const DATUM: f64 = 3.0;

/// What touches the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touch {
    /// A wire along the block's top, which parts nothing where it stands: only Eq. 4-5 know of it.
    Wire,
    /// A rod along the slab.
    Rod,
}

/// The block at work.
pub struct Collapse {
    /// The engine.
    pub lab: Lab,
    domain: Domain,
    material: ClayMaterial,
    tool: Tool,
    pose: Pose,
    /// Height of the block \[cells\].
    pub height: f64,
    /// Energy that the tool has brought into the clay \[J\].
    pub tool_work: f64,
}

/// Particles along an edge of the block of 0.4 m: an odd number, so that its top lies half-way between two
/// layers of nodes.
fn edge(cells_per_metre: i32) -> i32 {
    (0.4 * f64::from(cells_per_metre)).floor() as i32 * 2 + 1
}

impl Collapse {
    /// The block of `material` at rest, `dt` \[s\] a substep, on `threads` cores (0 for all).
    pub fn new(material: ClayMaterial, cells_per_metre: i32, dt: f64, touch: Touch, threads: usize) -> Self {
        let dx = ROOM / f64::from(cells_per_metre);
        let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Slip], high: [Wall::Separate, Wall::Separate, Wall::Slip] };
        let domain = Domain::new(DVec3::ZERO, DVec3::new(ROOM, ROOM, 4.0 * dx), dx, walls).expect("a sound room");
        let n = edge(cells_per_metre);
        let height = f64::from(n) / 2.0;
        let low = DVec3::new((f64::from(cells_per_metre) - height) / 2.0, 0.0, 0.0) + f64::from(WALL_NODE);
        let volume = (dx.powi(3) / 8.0) as f32;
        let particle = |i: i32| {
            let at = DVec3::new(f64::from(i / (n * 8)), f64::from(i / 8 % n), f64::from(i % 8));
            Particle::at(low + (at + 0.5) / 2.0, volume, i.cast_unsigned())
        };
        let particles = (0..n * n * 8).map(particle).collect();
        let mut lab = Lab::with_threads(&Snapshot::new(domain, material, particles), dt, threads);
        lab.plan.gravity = DVec3::NEG_Y * GRAVITY;
        let (shape, contact, above, rotation) = match touch {
            Touch::Wire => (ToolShape::Wire { half_length: TOOL_HALF_WIDTH }, Contact::Slip, 0.0, DQuat::IDENTITY),
            Touch::Rod => (
                ToolShape::Capsule { radius: TOOL_HALF_WIDTH, half_length: 8.0 * dx },
                Contact::Separate { friction: 0.0 },
                TOOL_HALF_WIDTH,
                DQuat::from_rotation_x(FRAC_PI_2),
            ),
        };
        let position = DVec3::new(ROOM / 2.0, height * dx + above, 2.0 * dx);
        let tool = Tool { shape, contact };
        Self { lab, domain, material, tool, pose: Pose { position, rotation }, height, tool_work: 0.0 }
    }

    /// Puts the tool at `height` \[cells\] above the floor, between frames.
    pub fn jump(&mut self, height: f64) {
        self.pose.position.y = height * self.domain.cell_width;
    }

    /// Runs `steps` substeps while the tool goes down at `speed` [m/s].
    pub fn frame(&mut self, steps: u32, speed: f64) -> FrameReport {
        let duration = self.lab.plan.dt * f64::from(steps);
        let start = self.pose;
        self.pose.position.y -= speed * duration;
        let sample = |time, pose| PoseSample { time, pose };
        let samples = vec![sample(0.0, start), sample(duration, self.pose)];
        let report = self.lab.frame_with(steps, &[ToolPath { id: 1, tool: self.tool, sheet: 0, samples }]);
        self.tool_work += report.tools.first().map_or(0.0, |t| t.impulse.y * speed);
        report
    }

    /// Kinetic, elastic and potential energy \[J\]. Elastic energy is multiplied as the stress is.
    pub fn energy(&self, report: &FrameReport, particles: &[Particle]) -> f64 {
        let dx = self.domain.cell_width;
        let of = |p: &Particle| {
            let x = self.domain.to_world(p.grid());
            let distance = self.tool.shape.distance(self.pose.to_local(x));
            let potential = self.material.density * GRAVITY * (x.y + DATUM * dx);
            let elastic = self.material.stress_factor_at(distance, dx) * self.elastic_density(p);
            f64::from(p.rest_volume) * (potential + elastic)
        };
        report.energies.kinetic + particles.iter().map(of).sum::<f64>()
    }

    /// Elastic energy per volume [J/m^3]: `mu |H|^2 + lambda tr(H)^2 / 2`, for a strain that is plane as the
    /// scene is.
    fn elastic_density(&self, p: &Particle) -> f64 {
        let [xx, yy, zz, xy, ..] = p.elastic_strain.map(f64::from);
        let greatest = 1.0 + 0.5 * (xx + yy) + (0.5 * (xx - yy)).hypot(xy);
        let least = ((1.0 + xx) * (1.0 + yy) - xy * xy) / greatest;
        let hencky = [greatest, least, 1.0 + zz].map(|b| 0.5 * b.max(f64::MIN_POSITIVE).ln());
        let (square, trace) = (hencky.iter().map(|h| h * h).sum::<f64>(), hencky.iter().sum::<f64>());
        self.material.lame_mu() * square + 0.5 * self.material.lame_lambda() * trace * trace
    }

    /// Mean drop \[m\] of the block's upper corners, particles within 2 cells of a side and one of the top,
    /// since `start`.
    pub fn corner_drop(&self, start: &[Particle], now: &[Particle]) -> f64 {
        let middle = ROOM / 2.0 / self.domain.cell_width + f64::from(WALL_NODE);
        let is_corner = |p: &Particle| {
            let x = p.grid();
            x.y > self.height - 1.0 + f64::from(WALL_NODE) && (x.x - middle).abs() > self.height / 2.0 - 2.0
        };
        let drops: Vec<f64> = start.iter().zip(now).filter(|(a, _)| is_corner(a)).map(|(a, b)| a.grid().y - b.grid().y).collect();
        drops.iter().sum::<f64>() / drops.len() as f64 * self.domain.cell_width
    }
}
