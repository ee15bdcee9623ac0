//! Contact of solid tools in the oracle: forces against the potential, action and reaction, Coulomb,
//! adhesion.

use bevy_clay::sim::oracle::{Oracle, Particle};
use bevy_clay::sim::params::WALL_NODE;
use bevy_clay::sim::penalty::{NORMAL_STIFFNESS, STICK_FRICTION, area, reach};
use bevy_clay::sim::prelude::*;
use clay_acceptance::lab::Random;
use glam::{DQuat, DVec3, IVec3};

/// Cell width \[m\].
const CELL: f64 = 0.01;

fn clay() -> ClayMaterial {
    ClayMaterial { density: 1000.0, young_modulus: 1e5, poisson_ratio: 0.3, yield_stress: 2e3, ..ClayMaterial::default() }
}

/// An empty room of 16^3 cells whose low corner is the world's origin.
fn room(material: ClayMaterial, walls: Walls) -> Oracle {
    let domain = Domain::new(DVec3::ZERO, DVec3::splat(16.0 * CELL), CELL, walls).expect("a room");
    Oracle::new(&Snapshot::new(domain, material, vec![]))
}

/// Fills the box of `size` cells at `low` with 8 particles a cell.
fn fill(oracle: &mut Oracle, low: DVec3, size: IVec3) {
    let n = size * 2;
    for i in 0..n.x * n.y * n.z {
        let at = IVec3::new(i / (n.y * n.z), i / n.z % n.y, i % n.z).as_dvec3();
        let at = low + 0.5 * (at + 0.5) + f64::from(WALL_NODE);
        oracle.particles.push(Particle::at(at, CELL.powi(3) / 8.0, i.unsigned_abs()));
    }
}

fn plan(oracle: &Oracle, fraction: f64, steps: u32, tools: Vec<ToolPath>) -> FramePlan {
    let dt = fraction * oracle.material.time_step_limit(CELL, oracle.material.density);
    FramePlan { tools, ..FramePlan::new(oracle.material, dt, steps) }
}

/// The way of a tool of `shape` \[cells\] from `from` to `to` \[cells\] over `duration` \[s\].
fn way(id: u32, shape: ToolShape, contact: Contact, [from, to]: [DVec3; 2], duration: f64) -> ToolPath {
    let sample = |time, at: DVec3| PoseSample { time, pose: Pose { position: at * CELL, ..Pose::default() } };
    let samples = vec![sample(0.0, from), sample(duration, to)];
    ToolPath { id, tool: Tool { shape: shape.scaled(CELL), contact }, sheet: 0, samples }
}

const SEPARATE: Contact = Contact::Separate { friction: 0.3 };

/// Solid shapes, in cells.
fn solids() -> impl Iterator<Item = ToolShape> {
    ToolShape::ALL.into_iter().filter(|shape| !shape.is_blade())
}

/// The force of a tool on one particle at rest that it has just touched is the slope of
/// `A kappa / dx max(0, r - s)^2 / 2`, by differences of the shape's distance, for particles of any volume.
#[test]
fn force_is_the_slope_of_the_potential_of_the_gap() {
    let mut random = Random::new(5);
    for shape in solids() {
        let rotation = DQuat::from_scaled_axis(DVec3::new(0.4, -0.7, 0.2));
        let pose = Pose { position: DVec3::splat(8.0 * CELL), rotation };
        let shape = shape.scaled(CELL);
        for volume in [0.125, 0.03, 0.4].iter().cycle().take(60) {
            let outside = DVec3::new(random.uniform(), random.uniform(), random.uniform()).normalize() * 7.0 * CELL;
            let depth = 0.019 * CELL * random.uniform().abs();
            let local = outside - shape.normal(outside) * (shape.distance(outside) - reach(*volume) * CELL + depth);
            let at = pose.to_world(local);
            let mut oracle = room(clay(), Walls::default());
            let grid = oracle.domain.to_grid(at);
            oracle.particles.push(Particle::at(grid, volume * CELL.powi(3), 0));
            let tool = Tool { shape, contact: SEPARATE };
            let plan = plan(&oracle, 0.5, 1, vec![ToolPath::still(1, tool, pose)]);
            let report = oracle.run(&plan);
            let modulus = oracle.material.lame_lambda() + 2.0 * oracle.material.lame_mu();
            let energy = |at: DVec3| {
                let gap = shape.distance(pose.to_local(at)) - reach(*volume) * CELL;
                0.5 * NORMAL_STIFFNESS * modulus / CELL * area(*volume) * CELL * CELL * gap.min(0.0).powi(2)
            };
            let step = 1e-6 * CELL;
            let slope = |axis: DVec3| (energy(at - step * axis) - energy(at + step * axis)) / (2.0 * step);
            let expected = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
            let error = (report.tools[0].force + expected).length() / expected.length();
            assert!(error < 1e-4, "{shape:?}: {} {expected}", report.tools[0].force);
            let momentum = plan.duration() * expected;
            assert!((report.momentum - momentum).length() < 1e-4 * momentum.length(), "{shape:?}: {}", report.momentum);
            let arm = (at - pose.position).cross(report.tools[0].force);
            assert!((report.tools[0].torque - arm).length() <= 1e-9 * arm.length() + 1e-15, "{shape:?}");
        }
    }
}

/// What tools give to a free block, momentum and spin, is what they lose: several of them, with any contact.
#[test]
fn tools_feel_what_they_give() {
    for contact in Contact::ALL {
        let mut oracle = room(clay(), Walls::default());
        fill(&mut oracle, DVec3::splat(5.0), IVec3::splat(4));
        let tools = vec![
            (ToolShape::Sphere { radius: 2.0 }, [DVec3::new(6.0, 11.3, 6.5), DVec3::new(6.3, 10.4, 6.2)]),
            (ToolShape::Box { half_size: DVec3::splat(3.0) }, [DVec3::new(1.9, 8.0, 7.0), DVec3::new(2.5, 8.4, 7.3)]),
            (ToolShape::Capsule { radius: 1.5, half_length: 2.0 }, [DVec3::new(10.6, 7.0, 8.5), DVec3::new(10.0, 6.7, 8.0)]),
        ];
        let base = plan(&oracle, 0.5, 40, vec![]);
        let paths = (1..).zip(tools).map(|(id, (shape, at))| way(id, shape, contact, at, base.duration()));
        let plan = FramePlan { tools: paths.collect(), ..base };
        let mut spin = DVec3::ZERO;
        // Substep by substep: a torque is about the tool's origin of its time.
        let mut before = DVec3::ZERO;
        for step in 0..plan.steps {
            let [start, end] = [f64::from(step), f64::from(step + 1)].map(|s| s * plan.dt);
            let cut = |path: &ToolPath| ToolPath {
                samples: [start, end].map(|time| PoseSample { time: time - start, pose: path.pose_at(time) }).into(),
                ..path.clone()
            };
            let report = oracle.run(&FramePlan { steps: 1, tools: plan.tools.iter().map(cut).collect(), ..plan.clone() });
            assert!(report.balance_error() < 1e-12, "{contact:?}: {:e}", report.balance_error());
            for (felt, path) in report.tools.iter().zip(&plan.tools) {
                let origin = path.pose_at(end).position;
                spin -= felt.angular_impulse + origin.cross(felt.impulse);
            }
            before = report.angular_momentum;
            if step + 1 == plan.steps {
                assert!(report.tools.iter().all(|felt| felt.contacts > 0), "{contact:?}: {:?}", report.tools);
            }
        }
        assert!((before - spin).length() < 1e-10 * spin.length(), "{contact:?}: {before} {spin}");
    }
}

/// A plate wider than the block is pressed on it and dragged: what it feels along its way is mu times what it
/// feels across; a sticking plate takes the top along, a slipping one feels nothing along.
#[test]
fn dragged_plate_feels_the_friction_of_coulomb() {
    for (contact, expected) in [
        (SEPARATE, Some(0.3)),
        (Contact::Separate { friction: 0.7 }, Some(0.7)),
        (Contact::Slip, Some(0.0)),
        (Contact::Stick, None),
    ] {
        let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] };
        let mut oracle = room(ClayMaterial { yield_stress: f64::INFINITY, ..clay() }, walls);
        fill(&mut oracle, DVec3::new(6.0, 0.0, 6.0), IVec3::new(4, 2, 4));
        let plate = ToolShape::Box { half_size: DVec3::new(6.0, 1.0, 6.0) };
        let base = plan(&oracle, 0.7, 100, vec![]);
        let mut at = DVec3::new(8.0, 3.05, 8.0);
        let mut go = |by: DVec3| {
            let path = way(4, plate, contact, [at, at + by], base.duration());
            at += by;
            oracle.run(&FramePlan { tools: vec![path], ..base.clone() }).tools[0].force
        };
        go(DVec3::NEG_Y * 0.15);
        let forces: Vec<DVec3> = (0..12).map(|_| go(DVec3::X * 0.2)).collect();
        for force in &forces[6..] {
            let ratio = -force.x / force.y;
            match expected {
                Some(mu) => assert!((ratio - mu).abs() <= 0.005 * mu + 1e-12 && force.y > 0.0, "{contact:?}: {force} {ratio}"),
                None => assert!(-force.x > STICK_FRICTION * 0.5 * force.y.abs(), "{contact:?}: {force}"),
            }
        }
    }
}

/// A plate lifted off a block that it has pressed pulls, if it sticks or slips, by the shear strength times
/// the face's area at most; one that separates never does. Then it has let go.
#[test]
fn lifted_plate_pulls_by_the_strength_at_most() {
    for contact in Contact::ALL {
        let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] };
        let mut oracle = room(clay(), walls);
        fill(&mut oracle, DVec3::new(6.0, 0.0, 6.0), IVec3::new(4, 3, 4));
        let plate = ToolShape::Box { half_size: DVec3::new(6.0, 1.0, 6.0) };
        let base = plan(&oracle, 0.7, 20, vec![]);
        let mut at = DVec3::new(8.0, 4.02, 8.0);
        let mut go = |by: f64| {
            let path = way(4, plate, contact, [at, at + DVec3::Y * by], base.duration());
            at.y += by;
            oracle.run(&FramePlan { tools: vec![path], ..base.clone() }).tools[0]
        };
        go(-0.05);
        let lifted: Vec<ToolReport> = (0..40).map(|_| go(0.03)).collect();
        let most = clay().shear_strength() * 16.0 * CELL * CELL;
        let pull = lifted.iter().map(|felt| -felt.force.y).fold(f64::NEG_INFINITY, f64::max);
        let last = lifted[lifted.len() - 1];
        assert_eq!((last.impulse, last.contacts), (DVec3::ZERO, 0), "{contact:?}");
        if matches!(contact, Contact::Separate { .. }) {
            assert!(pull <= 0.0, "{contact:?}: {pull}");
        } else {
            assert!(pull > 0.5 * most && pull <= most * (1.0 + 1e-9), "{contact:?}: {pull} {most}");
        }
    }
}

/// A sticking tool that is taken away, between two frames, and put back elsewhere has left no anchor.
#[test]
fn tool_that_jumps_leaves_no_anchor() {
    let mut oracle = room(clay(), Walls { low: [Wall::Stick; 3], high: [Wall::Separate; 3] });
    fill(&mut oracle, DVec3::new(6.0, 0.0, 6.0), IVec3::new(4, 3, 4));
    let ball = ToolShape::Sphere { radius: 2.0 };
    let clinging = |oracle: &Oracle| oracle.particles.iter().filter(|p| p.anchors.iter().any(Option::is_some)).count();
    let base = plan(&oracle, 0.5, 20, vec![]);
    let mut go = |at: DVec3, by: f64| {
        let path = way(4, ball, Contact::Stick, [at, at - DVec3::Y * by], base.duration());
        oracle.run(&FramePlan { tools: vec![path], ..base.clone() });
        clinging(&oracle)
    };
    assert!(go(DVec3::new(8.0, 5.1, 8.0), 0.4) > 8);
    assert_eq!(go(DVec3::new(8.0, 13.0, 8.0), 0.0), 0);
}
