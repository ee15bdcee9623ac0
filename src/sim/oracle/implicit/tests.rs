//! The slope against differences of the potential, the turn that strains nothing, the cycle's symmetry, and
//! whole steps against what they must keep.

use super::super::super::frame::{FramePlan, FrameReport, ToolReport};
use super::super::super::integrator::Integrator;
use super::super::super::material::ClayMaterial;
use super::super::super::params::{Domain, Wall, Walls};
use super::super::super::penalty::{NORMAL_STIFFNESS, TANGENTIAL_STIFFNESS, area, reach};
use super::super::super::snapshot::{self, Snapshot, Tag};
use super::super::super::tool::{Contact, Pose, PoseSample, Tool, ToolPath, ToolShape};
use super::super::particle::Particle;
use super::super::tools::{Moment, MovingTool, Surroundings};
use super::super::{Oracle, law};
use super::multigrid::Multigrid;
use super::residual::{System, dot};
use super::{scatter_fields, take_sides, with_system};
use glam::{DMat3, DQuat, DVec3};

const DX: f64 = 1e-3;

/// Numbers in -1 .. 1, the same in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

fn room(wall: Wall) -> Domain {
    let walls = Walls { low: [wall; 3], high: [wall; 3] };
    Domain::new(DVec3::ZERO, DVec3::splat(16.0 * DX), DX, walls).expect("a room")
}

fn clay() -> ClayMaterial {
    ClayMaterial {
        young_modulus: 4.4e5,
        poisson_ratio: 0.45,
        yield_stress: 8e3,
        hardening_modulus: 2e4,
        viscosity: 300.0,
        flow_index: 0.4,
        toughness: 10.0,
        ..ClayMaterial::default()
    }
}

/// A strained block of 4 x 3 x `length` cells with its low corner `low` cells from the room's.
fn block_of(length: i32, low: DVec3, strain: f64) -> Vec<Particle> {
    let mut random = Random(7);
    let at = |i: i32| DVec3::new(f64::from(i % 8), f64::from(i / 8 % 6), f64::from(i / 48)) / 2.0 + 0.25;
    let particle = |i: i32| {
        let symmetric = DMat3::from_cols(random.vector(), random.vector(), random.vector());
        let place = low + 5.0 + at(i) + 0.1 * random.vector();
        let velocity = 2e-2 * random.vector();
        let affine = DMat3::from_cols(random.vector(), random.vector(), random.vector());
        let elastic_strain = (symmetric + symmetric.transpose()) * (0.5 * strain);
        Particle { velocity, affine, elastic_strain, ..Particle::at(place, DX.powi(3) / 8.0, i.unsigned_abs()) }
    };
    (0..96 * length).map(particle).collect()
}

fn block(low: DVec3, strain: f64) -> Vec<Particle> {
    block_of(4, low, strain)
}

fn plan(material: ClayMaterial, dt: f64) -> FramePlan {
    let integrator = Integrator::Implicit { passes: 30 };
    FramePlan { integrator, volume_averaging: 5e-4, gravity: DVec3::new(0.0, -9.81, 0.0), ..FramePlan::new(material, dt, 1) }
}

/// A ball that presses into the middle of the block's top.
fn ball(dt: f64) -> ToolPath {
    let tool = Tool { shape: ToolShape::Sphere { radius: 3.0 * DX }, contact: Contact::Separate { friction: 0.0 } };
    let sample = |time, y: f64| {
        let pose = Pose { position: DVec3::new(4.0, y, 4.0) * DX, rotation: DQuat::IDENTITY };
        PoseSample { time, pose }
    };
    ToolPath { id: 1, tool, sheet: 0, samples: vec![sample(0.0, 6.4), sample(dt, 5.85)] }
}

/// A blade across x within the block, that ends in it and goes sideways.
fn blade(dt: f64) -> ToolPath {
    let shape = ToolShape::Blade { half_width: 2.5 * DX, half_height: DX };
    let tool = Tool { shape, contact: Contact::Separate { friction: 0.0 } };
    let sample = |time, x: f64| {
        let pose = Pose { position: DVec3::new(x, 1.6, 4.0) * DX, rotation: DQuat::from_rotation_y(1.5) };
        PoseSample { time, pose }
    };
    ToolPath { id: 1, tool, sheet: 0, samples: vec![sample(0.0, 3.9), sample(dt, 4.2)] }
}

/// The same blade, that cuts on ahead.
fn knife(dt: f64) -> ToolPath {
    let mut path = blade(dt);
    path.samples[1].pose.position += DVec3::new(-0.3, -0.05, 0.1) * DX;
    path
}

/// What the edges of a flat blade have done to a particle that comes to `at` \[m\] \[J\]: a spring up to its
/// share of the toughness.
fn edge_work(particle: &Particle, tool: &MovingTool<'_>, around: &Surroundings, at: DVec3) -> f64 {
    let ToolShape::Blade { half_width, half_height } = tool.path.tool.shape else { return 0.0 };
    let (material, motion, start) = (&around.plan.material, tool.motion, around.domain.to_world(particle.position));
    let q = motion.end.to_local(start) / DX;
    let [across, along] = [q.x.abs() - half_width / DX, q.y.abs() - half_height / DX];
    let (ahead, outward) = match (across > 0.0, along > 0.0) {
        (true, false) => (across, DVec3::X * q.x.signum()),
        (false, true) => (along, DVec3::Y * q.y.signum()),
        _ => return 0.0,
    };
    if particle.key().side(tool.path.sheet_id()) != 0 || ahead >= 0.6 || q.z.abs() >= 1.0 {
        return 0.0;
    }
    let share = 2.0 * (10.0 * ahead).min(6.0 - 10.0 * ahead).min(1.0) * (1.0 - q.z.abs());
    let most = material.toughness * particle.rest_volume / (DX * DX) * share;
    let modulus = material.lame_lambda() + 2.0 * material.lame_mu();
    let spring = TANGENTIAL_STIFFNESS * modulus * area(particle.rest_volume / DX.powi(3)) * DX;
    let advance = outward.dot(motion.start.to_local(start) - motion.end.to_local(at));
    let bent = advance.clamp(0.0, most / spring);
    0.5 * spring * bent * bent + most * (advance - bent).max(0.0)
}

/// The gap \[m\] of a flat blade to a particle that comes to `at` \[m\], if it is before it.
fn gap_to_blade(particle: &Particle, tool: &MovingTool<'_>, around: &Surroundings, at: DVec3) -> f64 {
    let ToolShape::Blade { half_width, half_height } = tool.path.tool.shape else { return f64::INFINITY };
    let (side, local) = (f64::from(particle.key().side(tool.path.sheet_id())), tool.motion.end.to_local(at));
    if side == 0.0 || local.x.abs() > half_width || local.y.abs() > half_height {
        return f64::INFINITY;
    }
    let before = side * tool.motion.start.to_local(around.domain.to_world(particle.position)).z;
    let kept = particle.anchors[0].map(|(_, anchor)| side * anchor.z * DX);
    side * local.z - kept.unwrap_or(before.min(reach(particle.rest_volume / DX.powi(3)) * DX))
}

/// The potential \[J\], by the book: inertia, elastic energy and what flow takes, frictionless contact.
fn potential(system: &System<'_>, particles: &[Particle], around: &Surroundings, u: &[DVec3]) -> f64 {
    let (plan, dt) = (around.plan, around.plan.dt);
    let material = &plan.material;
    let inertia =
        |(unknown, u): (&super::unknowns::Unknown, &DVec3)| 0.5 * unknown.mass * (*u / dt - unknown.velocity).length_squared();
    let mut sum: f64 = system.unknowns.all.iter().zip(u).map(inertia).sum();
    let bulk = material.lame_lambda() + 2.0 / 3.0 * material.lame_mu();
    for (particle, (update, change, moved)) in particles.iter().zip(system.after(u)) {
        let own = law::energy_density(material, update.elastic_strain);
        let log = law::log_volume_ratio(update.elastic_strain);
        let shared = 0.5 * bulk * ((log + change).powi(2) - log * log);
        let a = update.plastic_strain;
        let n = material.flow_index;
        let sy = around.yield_stress(particle, Moment::End);
        let flow =
            sy * a + 0.5 * material.hardening_modulus * a * a + material.viscosity * a.powf(n + 1.0) / ((n + 1.0) * dt.powf(n));
        sum += particle.rest_volume * (own + shared + flow);
        let volume = particle.rest_volume / DX.powi(3);
        let at = around.domain.to_world(particle.position) + moved;
        let modulus = material.lame_lambda() + 2.0 * material.lame_mu();
        for tool in &around.tools {
            let gap = if tool.is_solid() {
                tool.distance(at, Moment::End) - reach(volume) * DX
            } else {
                gap_to_blade(particle, tool, around, at)
            };
            sum += 0.5 * NORMAL_STIFFNESS * modulus * area(volume) * DX * gap.min(0.0).powi(2);
            sum += edge_work(particle, tool, around, at);
        }
    }
    sum
}

/// The slope is that of the potential, to 1e-6 of itself, by central differences along random ways: clay
/// that yields, hardens and flows, with volumes shared, under a ball, about a blade and before its edge,
/// on walls that hold it.
#[test]
fn residual_is_the_slope_of_the_potential() {
    let dt = 2e-3;
    for (wall, tool) in [(Wall::Slip, ball(dt)), (Wall::Stick, ball(dt)), (Wall::Stick, blade(dt)), (Wall::Stick, knife(dt))] {
        let domain = room(wall);
        let mut plan = plan(clay(), dt);
        plan.tools = vec![tool];
        let mut particles = block(DVec3::new(2.0, 0.1, 2.0), 0.03);
        let mut around = Surroundings::new(&domain, &plan, 0.0);
        let mut frame = FrameReport { tools: vec![ToolReport::default()], ..FrameReport::default() };
        take_sides(&mut particles, &mut around, &mut frame);
        let grid = scatter_fields(&mut particles, &around);
        with_system(&particles, &grid, &around, |system, guess| {
            let mut random = Random(11);
            let offset: Vec<DVec3> = guess.iter().map(|_| 2e-2 * DX * random.vector()).collect();
            let offset = system.unknowns.masked(offset);
            let u: Vec<DVec3> = guess.iter().zip(&offset).map(|(u, more)| *u + *more).collect();
            let slope = system.slope(&u);
            let flows = system.after(&u).iter().filter(|after| after.0.plastic_strain > 0.0).count();
            let after = system.after(&u);
            let touches = after.iter().zip(&particles).filter(|((.., moved), p)| {
                let at = around.domain.to_world(p.position) + *moved;
                around.tools[0].distance(at, Moment::End) < reach(0.125) * DX
            });
            let touches = touches.count();
            assert!(slope.is_sound && flows > 100 && touches > 3, "{flows} {touches}");
            let tool = &around.tools[0];
            let work = after
                .iter()
                .zip(&particles)
                .map(|((.., moved), p)| edge_work(p, tool, &around, around.domain.to_world(p.position) + *moved));
            assert_eq!(work.filter(|work| *work > 0.0).count() > 10, !tool.is_solid());
            for _ in 0..8 {
                let way = system.unknowns.masked(guess.iter().map(|_| random.vector()).collect());
                let at = |t: f64| u.iter().zip(&way).map(|(u, way)| *u + t * *way).collect::<Vec<_>>();
                let h = 1e-4 * DX;
                let [back, forth] = [-h, h].map(|t| potential(system, &particles, &around, &at(t)));
                let (found, expected) = ((forth - back) / (2.0 * h), dot(&slope.residual, &way));
                let scale = dot(&slope.residual, &slope.residual).sqrt() * dot(&way, &way).sqrt();
                assert!((found - expected).abs() < 1e-6 * scale, "{wall:?}: {found} {expected} of {scale}");
            }
        });
    }
}

/// Nodes that turn by 40 degrees, and shift, strain nothing: stress forces stay as they are, turned.
#[test]
fn rigid_turn_strains_nothing() {
    let (domain, dt) = (room(Wall::Separate), 2e-3);
    let plan = FramePlan { gravity: DVec3::ZERO, ..plan(ClayMaterial { yield_stress: f64::INFINITY, ..clay() }, dt) };
    let mut particles = block(DVec3::new(4.0, 5.0, 4.0), 0.0);
    let around = Surroundings::new(&domain, &plan, 0.0);
    let grid = scatter_fields(&mut particles, &around);
    with_system(&particles, &grid, &around, |system, _| {
        // Cayley's turn: H = skew with |axis| = 2 tan(angle / 2).
        let axis = DVec3::new(1.0, 2.0, -2.0) / 3.0 * (2.0 * (20f64).to_radians().tan());
        let centre = DVec3::new(6.0, 6.5, 6.0) * DX;
        let of = |node: glam::IVec3| axis.cross(domain.to_world(node.as_dvec3()) - centre) + DX * DVec3::splat(0.1);
        let u: Vec<DVec3> = system.unknowns.all.iter().map(|unknown| of(unknown.node)).collect();
        let strain = system.after(&u).into_iter().map(|(update, ..)| update.elastic_strain.to_cols_array());
        let worst = strain.flatten().fold(0.0, |worst: f64, e| worst.max(e.abs()));
        assert!(worst < 1e-12, "{worst:e}");
    });
}

/// The cycle is symmetric and positive: `a . P b = b . P a`, `a . P a > 0`.
#[test]
fn cycle_is_symmetric_and_positive() {
    let (domain, plan) = (room(Wall::Stick), plan(clay(), 2e-3));
    let mut particles = block_of(12, DVec3::new(0.0, 0.0, 3.0), 0.0);
    let around = Surroundings::new(&domain, &plan, 0.0);
    let grid = scatter_fields(&mut particles, &around);
    with_system(&particles, &grid, &around, |system, guess| {
        let cycle = Multigrid::new(system.finest(&grid.0, guess));
        assert!(cycle.level_count() > 1, "{}", cycle.level_count());
        let mut random = Random(3);
        for _ in 0..4 {
            let [a, b] = [0, 1].map(|_| system.unknowns.masked(guess.iter().map(|_| random.vector()).collect()));
            let [pa, pb] = [&a, &b].map(|x| cycle.cycle(x));
            let scale = (dot(&a, &pa) * dot(&b, &pb)).sqrt();
            assert!(scale > 0.0 && (dot(&a, &pb) - dot(&b, &pa)).abs() < 1e-12 * scale, "{scale}");
        }
    });
}

fn run(particles: &[Particle], domain: Domain, plan: &FramePlan) -> (Oracle, FrameReport) {
    let particles: Vec<snapshot::Particle> = particles.iter().map(Particle::to_snapshot).collect();
    let mut oracle = Oracle::new(&Snapshot::new(domain, plan.material, particles));
    let report = oracle.run(plan);
    (oracle, report)
}

/// The sides of a cut come out of each other at once and without a change of momentum; what closed pairs hold
/// is taken out of slopes and steps by projections that are each other's transpose, of cuts that cross too.
#[test]
fn pairs_bound_and_project() {
    for is_crossed in [false, true] {
        let (domain, plan) = (room(Wall::Slip), plan(clay(), 2e-3));
        let mut particles = block(DVec3::new(2.0, 0.0, 2.0), 0.0);
        for p in &mut particles {
            let tag = |sheet, side: f64| Tag { sheet, side: if side < 0.0 { -1 } else { 1 } };
            let across = if is_crossed { tag(2, p.position.x - 10.0 + 0.1 * p.position.z) } else { Tag::default() };
            p.tags = [tag(1, p.position.y - 6.6), across];
        }
        let around = Surroundings::new(&domain, &plan, 0.0);
        let grid = scatter_fields(&mut particles, &around);
        with_system(&particles, &grid, &around, |system, guess| {
            let (mut random, mut pairs) = (Random(5), system.pairs.clone());
            let mut vector = || system.unknowns.masked(guess.iter().map(|_| random.vector()).collect());
            let momentum = |u: &[DVec3]| u.iter().zip(&system.unknowns.all).map(|(u, at)| *u * at.mass * at.free).sum::<DVec3>();
            let mass: f64 = system.unknowns.all.iter().map(|at| at.mass).sum();
            let (mut u, slope, step) = (vector(), vector(), vector());
            let (loose, before) = (u.clone(), momentum(&u));
            pairs.begin(&mut u);
            assert!((momentum(&u) - before).length() < 1e-14 * mass && distance(&u, &loose) > 0.5, "{before}");
            let mut twice = u.clone();
            pairs.close(&mut twice);
            assert!(is_crossed || distance(&u, &twice) < 1e-14);
            pairs.settle(&u, &slope);
            let (of_slope, of_step) = (pairs.without_reactions(slope.clone()), pairs.along(step.clone()));
            let products = [dot(&of_slope, &step), dot(&slope, &of_step), dot(&slope, &step)];
            assert!((products[0] - products[1]).abs() < 1e-12 && (products[0] - products[2]).abs() > 0.1, "{products:?}");
            assert!(is_crossed || distance(&pairs.along(of_step.clone()), &of_step) < 1e-14);
        });
    }
}

/// The greatest difference.
fn distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

/// In free flight momentum and angular momentum stay, to what nodes with too little clay to be unknowns and
/// the iterations leave; every impulse is booked.
#[test]
fn free_flight_keeps_momentum() {
    let domain = room(Wall::Separate);
    let mut particles = block_of(6, DVec3::new(4.0, 5.0, 3.0), 0.0);
    let spin = DVec3::new(3.0, -5.0, 8.0);
    for p in &mut particles {
        let arm = domain.to_world(p.position) - DVec3::new(6.0, 6.5, 6.0) * DX;
        p.velocity = DVec3::new(0.05, 0.1, 0.0) + spin.cross(arm);
        p.affine = DMat3::from_cols(spin.cross(DVec3::X), spin.cross(DVec3::Y), spin.cross(DVec3::Z));
    }
    let integrator = Integrator::Implicit { passes: 40 };
    let plan = FramePlan { steps: 3, gravity: DVec3::ZERO, integrator, ..plan(clay(), 1e-3) };
    let standing = FramePlan { steps: 1, dt: 1e-12, integrator: Integrator::default(), ..plan.clone() };
    let before = run(&particles, domain, &standing).1;
    let (_, report) = run(&particles, domain, &plan);
    let lost = (report.momentum - before.momentum).length() / before.momentum.length();
    let turned = (report.angular_momentum - before.angular_momentum).length() / before.angular_momentum.length();
    assert!(lost < 2e-3 && turned < 2e-3, "{lost:e} {turned:e}");
    assert!(report.balance_error() < 1e-12, "{:e}", report.balance_error());
}

/// A step that is lost with its passes gets as many again, one that has enough does not.
#[test]
fn lost_step_gets_more_passes() {
    let (domain, dt) = (room(Wall::Slip), 2e-3);
    let of = |passes| {
        let mut ball = ball(dt);
        ball.samples[1].pose.position.y -= 0.3 * DX;
        let plan = FramePlan { integrator: Integrator::Implicit { passes }, tools: vec![ball], ..plan(clay(), dt) };
        let mut particles = block(DVec3::new(2.0, 0.0, 2.0), 0.0);
        particles.iter_mut().for_each(|p| (p.velocity, p.affine) = (DVec3::ZERO, DMat3::ZERO));
        run(&particles, domain, &plan).1
    };
    let [few, many] = [3, 40].map(of);
    assert_eq!((few.passes, many.passes), (6, 40), "{} {}", few.residual, many.residual);
}

/// Under a ball the impulses of tool, wall, weight and what is out of balance are all that the clay's
/// momentum gets; and more passes leave less out of balance.
#[test]
fn impulses_are_booked_and_iterations_go_down() {
    let (domain, dt) = (room(Wall::Slip), 2e-3);
    let of = |passes| {
        let mut plan = FramePlan { integrator: Integrator::Implicit { passes }, tools: vec![ball(dt)], ..plan(clay(), dt) };
        plan.volume_averaging = 0.0;
        let mut particles = block(DVec3::new(2.0, 0.0, 2.0), 0.0);
        particles.iter_mut().for_each(|p| (p.velocity, p.affine) = (DVec3::ZERO, DMat3::ZERO));
        run(&particles, domain, &plan).1
    };
    let [few, many] = [4, 160].map(of);
    for report in [&few, &many] {
        assert!(report.balance_error() < 1e-12 && report.tools[0].impulse.y > 0.0, "{report:?}");
    }
    assert!(many.residual < 0.2 * few.residual && many.residual < 0.03, "{} {}", few.residual, many.residual);
    assert!(many.unbalanced_impulse.length() < 0.1 * many.tools[0].impulse.y, "{}", many.unbalanced_impulse);
}
