//! The f64 oracle against closed forms: free flight, rotation, waves, weight, walls, tools and cuts.

use bevy_clay::sim::frame::{FramePlan, FrameReport};
use bevy_clay::sim::health::Health;
use bevy_clay::sim::integrator::Integrator;
use bevy_clay::sim::material::{ClayMaterial, Preset};
use bevy_clay::sim::oracle::{Oracle, Particle, law};
use bevy_clay::sim::params::{Domain, WALL_NODE, Wall, Walls};
use bevy_clay::sim::snapshot::{Snapshot, Tag};
use bevy_clay::sim::tool::{Contact, Pose, PoseSample, Tool, ToolPath, ToolShape};
use bevy_clay::sim::validation::Validation;
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const CELL_WIDTH: f64 = 0.01;

fn elastic(poisson_ratio: f64) -> ClayMaterial {
    ClayMaterial { density: 1000.0, young_modulus: 1e5, poisson_ratio, yield_stress: f64::INFINITY, ..ClayMaterial::default() }
}

/// A room of `cells` with its low corner at the world's origin and no clay in it.
fn empty(cells: [f64; 3], walls: Walls, material: ClayMaterial) -> Oracle {
    let domain = Domain::new(DVec3::ZERO, DVec3::from_array(cells) * CELL_WIDTH, CELL_WIDTH, walls).expect("domain");
    Oracle::new(&Snapshot::new(domain, material, Vec::new()))
}

fn all(wall: Wall) -> Walls {
    Walls { low: [wall; 3], high: [wall; 3] }
}

/// Fills the box at `low` of `size`, in cells from the room's low corner, with `per_edge` particles per cell
/// and axis.
fn fill(oracle: &mut Oracle, low: [f64; 3], size: [u32; 3], per_edge: [u32; 3]) {
    let [nx, ny, nz] = [0, 1, 2].map(|axis| size[axis] * per_edge[axis]);
    let spacing = DVec3::from_array(per_edge.map(|n| 1.0 / f64::from(n)));
    let rest_volume = CELL_WIDTH.powi(3) * spacing.element_product();
    for (x, y, z) in (0..nx).flat_map(|x| (0..ny).flat_map(move |y| (0..nz).map(move |z| (x, y, z)))) {
        let at = (DVec3::new(x.into(), y.into(), z.into()) + 0.5) * spacing + DVec3::from_array(low) + f64::from(WALL_NODE);
        let id = u32::try_from(oracle.particles.len()).expect("few particles");
        oracle.particles.push(Particle::at(at, rest_volume, id));
    }
}

/// One frame of `steps` at `fraction` of the stability limit; no gravity, no tools.
fn plan(oracle: &Oracle, fraction: f64, steps: u32) -> FramePlan {
    let limit = oracle.material.time_step_limit(CELL_WIDTH, oracle.material.density);
    FramePlan::new(oracle.material, fraction * limit, steps)
}

/// World position [m] of a point given in cells from the room's low corner.
fn world(cells: [f64; 3]) -> DVec3 {
    DVec3::from_array(cells) * CELL_WIDTH
}

/// A tool that moves from `from` to `to` [cells] in `duration` [s].
fn moving(id: u32, shape: ToolShape, contact: Contact, rotation: DQuat, from: [f64; 3], to: [f64; 3], duration: f64) -> ToolPath {
    let sample = |time, at| PoseSample { time, pose: Pose { position: world(at), rotation } };
    ToolPath { id, tool: Tool { shape, contact }, sheet: 0, samples: vec![sample(0.0, from), sample(duration, to)] }
}

/// A square blade of `half` cells.
fn blade(half: f64) -> ToolShape {
    ToolShape::Blade { half_width: half * CELL_WIDTH, half_height: half * CELL_WIDTH }
}

/// Turns the blade's front to +X.
fn front_along_x() -> DQuat {
    DQuat::from_rotation_y(FRAC_PI_2)
}

#[test]
fn free_fall_is_symplectic_to_rounding() {
    let mut oracle = empty([8.0, 32.0, 8.0], all(Wall::Slip), ClayMaterial { young_modulus: 1e3, ..elastic(0.3) });
    fill(&mut oracle, [2.0, 26.0, 2.0], [4, 4, 4], [2, 2, 2]);
    let start: Vec<_> = oracle.particles.iter().map(|p| p.position).collect();
    let gravity = DVec3::new(0.0, -9.81, 0.0);
    let plan = FramePlan { dt: 2e-3, steps: 100, gravity, ..plan(&oracle, 1.0, 100) };
    let report = oracle.run(&plan);
    let time = plan.duration();
    let fall = gravity * (0.5 * time * (time + plan.dt) / CELL_WIDTH);
    for (particle, start) in oracle.particles.iter().zip(&start) {
        let error = (particle.position - *start - fall).length() / fall.length();
        assert!(error < 1e-12, "{error:e}");
        assert!(particle.affine.abs_diff_eq(DMat3::ZERO, 1e-9) && particle.elastic_strain.abs_diff_eq(DMat3::ZERO, 1e-12));
    }
    assert!((report.gravity_impulse - report.momentum).length() < 1e-12 * report.momentum.length());
    assert!((report.grid_mass / report.particle_mass - 1.0).abs() < 1e-13 && report.health.is_ok());
}

/// One turn of a free block: angular momentum to rounding, kinetic energy to 5e-4, strain no more than the
/// spin itself causes.
#[test]
fn free_rotation_keeps_angular_momentum() {
    let mut oracle = empty([16.0, 16.0, 12.0], all(Wall::Slip), elastic(0.3));
    fill(&mut oracle, [6.0, 6.0, 4.0], [4, 4, 2], [2, 2, 2]);
    let wave_speed = oracle.material.wave_speed(oracle.material.density);
    let spin = DVec3::new(0.0, 0.0, 0.005 * wave_speed / CELL_WIDTH);
    let centre = DVec3::new(8.0, 8.0, 5.0) + f64::from(WALL_NODE);
    for particle in &mut oracle.particles {
        particle.velocity = spin.cross(particle.position - centre) * CELL_WIDTH;
        particle.affine = DMat3::from_cols(spin.cross(DVec3::X), spin.cross(DVec3::Y), spin.cross(DVec3::Z));
    }
    let dt = 0.4 * CELL_WIDTH / wave_speed;
    let first = oracle.run(&FramePlan { dt, ..plan(&oracle, 1.0, 1) });
    let last = oracle.run(&FramePlan { dt, ..plan(&oracle, 1.0, (TAU / (spin.z * dt)).round() as u32) });
    let drift = (last.angular_momentum - first.angular_momentum).length() / first.angular_momentum.length();
    assert!(drift < 1e-12, "{drift:e} after {} steps", last.steps);
    assert!(
        (last.energies.kinetic / first.energies.kinetic - 1.0).abs() < 5e-4,
        "{} {}",
        last.energies.kinetic,
        first.energies.kinetic
    );
    let strain =
        oracle.particles.iter().flat_map(|p| p.elastic_strain.to_cols_array()).fold(0.0, |most: f64, e| most.max(e.abs()));
    // Centrifugal strain: rho (omega R)^2 over the modulus, R the half diagonal, twice that as it swings.
    let bound = 4.0 * (spin.z * 2.0 * 2f64.sqrt() * CELL_WIDTH / wave_speed).powi(2);
    assert!(strain < bound, "{strain:e} {bound:e}");
}

/// Relative error of the first axial frequency `c / 2 L` of a free bar of `cells`.
fn bar_frequency_error(cells: u32) -> f64 {
    let mut oracle = empty([f64::from(cells) + 8.0, 8.0, 8.0], all(Wall::Slip), elastic(0.0));
    fill(&mut oracle, [4.0, 3.0, 3.0], [cells, 1, 1], [2, 2, 2]);
    let wave_speed = oracle.material.wave_speed(oracle.material.density);
    let length = f64::from(cells) * CELL_WIDTH;
    let phase = |p: &Particle| PI * (p.position.x - 4.0 - f64::from(WALL_NODE)) / f64::from(cells);
    let mode: Vec<f64> = oracle.particles.iter().map(|p| phase(p).cos()).collect();
    for particle in &mut oracle.particles {
        let speed = 1e-3 * wave_speed;
        particle.affine.x_axis.x = -speed * PI / length * phase(particle).sin();
        particle.velocity.x = speed * phase(particle).cos();
    }
    let dt = 0.4 * CELL_WIDTH / wave_speed;
    let plan = FramePlan { dt, ..plan(&oracle, 1.0, 1) };
    let period = 2.0 * length / wave_speed;
    let (mut zeros, mut before) = (Vec::new(), f64::NAN);
    for step in 0..(5.0 * period / dt) as u32 {
        oracle.run(&plan);
        let amplitude: f64 = oracle.particles.iter().zip(&mode).map(|(p, m)| p.velocity.x * m).sum();
        if amplitude * before < 0.0 {
            zeros.push(dt * (f64::from(step) + before / (before - amplitude)));
        }
        before = amplitude;
    }
    let half_periods = (zeros.len() - 1) as f64;
    period * half_periods / (2.0 * (zeros[zeros.len() - 1] - zeros[0])) - 1.0
}

#[test]
fn free_bar_frequency_converges_at_second_order() {
    let [e8, e16, e32] = [8, 16, 32].map(|cells| bar_frequency_error(cells).abs());
    let orders = [(e8 / e16).log2(), (e16 / e32).log2()];
    assert!(e32 < 1.5e-3 && orders.iter().all(|order| *order > 1.8), "{e8:e} {e16:e} {e32:e} {orders:?}");
    println!("bar: {e8:e} {e16:e} {e32:e}, orders {orders:?}");
}

/// Relative L2 errors of displacement and stress of a column of `cells` under its own weight on a slip wall,
/// against the exact solution of confined Hencky elasticity: `M ln(l) / l = -rho g (H - X)` for the stretch
/// l, `u = int (l - 1) dX`, `tau = M ln l`.
fn self_weight_errors(cells: u32) -> (f64, f64) {
    let height = 0.1;
    let scale = height / f64::from(cells) / CELL_WIDTH;
    // The column is `cells` high whatever the cell width: gravity is scaled to keep rho g H.
    let gravity = 9.81 * 1500.0 / 1000.0 * scale;
    let mut oracle = empty([4.0, f64::from(cells) + 4.0, 4.0], all(Wall::Slip), elastic(0.0));
    fill(&mut oracle, [0.0; 3], [4, cells, 4], [1, 2, 1]);
    let material = oracle.material;
    let modulus = material.lame_lambda() + 2.0 * material.lame_mu();
    let wave_speed = material.wave_speed(material.density);
    let length = f64::from(cells) * CELL_WIDTH;
    let start: Vec<f64> = oracle.particles.iter().map(|p| (p.position.y - f64::from(WALL_NODE)) * CELL_WIDTH).collect();
    let dt = 0.4 * CELL_WIDTH / wave_speed;
    oracle.run(&FramePlan {
        dt,
        steps: (15.0 * length / wave_speed / dt) as u32,
        gravity: DVec3::new(0.0, -gravity, 0.0),
        validation: Validation { damping: 0.7 * PI * wave_speed / length, ..Validation::default() },
        ..plan(&oracle, 1.0, 1)
    });
    let stretch = |at: f64| {
        let load = material.density * gravity * (length - at);
        (0..8).fold(1.0f64, |l, _| l - (modulus * l.ln() / l + load) / (modulus * (1.0 - l.ln()) / (l * l)))
    };
    let displacement = |at: f64| (0..100).map(|i| stretch(at * (f64::from(i) + 0.5) / 100.0) - 1.0).sum::<f64>() * at / 100.0;
    let (mut u, mut s) = ([0.0; 2], [0.0; 2]);
    for (particle, at) in oracle.particles.iter().zip(start) {
        let moved = (particle.position.y - f64::from(WALL_NODE)) * CELL_WIDTH - at;
        let (exact_u, exact_s) = (displacement(at), modulus * stretch(at).ln());
        let stress = law::kirchhoff_stress(&material, particle.elastic_strain).y_axis.y;
        u = [u[0] + (moved - exact_u).powi(2), u[1] + exact_u.powi(2)];
        s = [s[0] + (stress - exact_s).powi(2), s[1] + exact_s.powi(2)];
    }
    ((u[0] / u[1]).sqrt(), (s[0] / s[1]).sqrt())
}

#[test]
fn column_under_its_weight_follows_the_closed_form() {
    let (u16, s16) = self_weight_errors(16);
    let (u32, s32) = self_weight_errors(32);
    println!("column: u {u16:e} {u32:e}, stress {s16:e} {s32:e}");
    assert!(u32 < 1e-3 && s32 < 1e-2, "u {u16:e} {u32:e}, stress {s16:e} {s32:e}");
}

/// An isolated particle, strained and let go, gains no energy below `dx sqrt(rho / 3K)` and explodes above
/// it.
#[test]
fn isolated_particle_limit_is_the_formula() {
    for poisson_ratio in [0.1, 0.3, 0.45, 0.49] {
        let is_stable = |fraction: f64| {
            let mut oracle = empty([8.0; 3], all(Wall::Slip), elastic(poisson_ratio));
            fill(&mut oracle, [3.3, 3.4, 3.6], [1; 3], [1; 3]);
            let strain =
                DMat3::from_cols(DVec3::new(2e-6, 1e-7, 2e-7), DVec3::new(1e-7, 1e-6, 0.0), DVec3::new(2e-7, 0.0, 1.5e-6));
            oracle.particles[0].elastic_strain = strain;
            let start = law::energy_density(&oracle.material, strain) * oracle.particles[0].rest_volume;
            let plan = plan(&oracle, fraction, 200);
            (0..20).all(|_| {
                let energies = oracle.run(&plan).energies;
                energies.elastic + energies.kinetic < 1e3 * start
            })
        };
        let (mut low, mut high) = (0.2, 3.0);
        for _ in 0..12 {
            let middle = 0.5 * (low + high);
            if is_stable(middle) { low = middle } else { high = middle }
        }
        assert!((0.99..1.01).contains(&low), "nu {poisson_ratio}: {low} of the formula");
    }
}

/// Every pass keeps account: with walls, gravity, damping and scaled inertia, each contact of each tool, the
/// clay's momentum changes by what the report names and nothing else.
#[test]
fn momentum_balances_with_walls_and_every_tool() {
    let box_of = |half: f64| ToolShape::Box { half_size: DVec3::splat(half * CELL_WIDTH) };
    let shapes = [
        ToolShape::Sphere { radius: 1.6 * CELL_WIDTH },
        ToolShape::Capsule { radius: 1.2 * CELL_WIDTH, half_length: 1.5 * CELL_WIDTH },
        box_of(1.3),
        blade(3.0),
    ];
    let contacts = [Contact::Stick, Contact::Slip, Contact::Separate { friction: 0.4 }];
    let walls = Walls { low: [Wall::Stick, Wall::Separate, Wall::Slip], high: [Wall::Slip; 3] };
    for (shape, contact) in shapes.into_iter().flat_map(|s| contacts.map(|c| (s, c))) {
        let mut oracle = empty([8.0, 12.0, 8.0], walls, ClayMaterial { softening: 0.5, ..Preset::SoftClay.material() });
        fill(&mut oracle, [0.0; 3], [5, 5, 5], [2, 2, 2]);
        oracle.particles.iter_mut().for_each(|p| p.velocity = DVec3::new(0.02, -0.1, 0.03));
        let plan = plan(&oracle, 0.7, 40);
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.1, 0.2);
        let path = moving(7, shape, contact, turn, [2.6, 6.2, 2.4], [2.5, 3.1, 2.7], plan.duration());
        let duration = plan.duration();
        let validation = Validation { damping: 20.0, ..Validation::default() };
        let gravity = DVec3::new(1.0, -9.81, 0.5);
        let report = oracle.run(&FramePlan {
            tools: vec![path],
            gravity,
            validation,
            integrator: Integrator::Explicit { density_scale: 4.0 },
            ..plan
        });
        let error = report.balance_error();
        assert!(error < 1e-12, "{shape:?} {contact:?}: {error:e}");
        let tool = report.tools[0];
        assert!(tool.impulse.length() > 1e-3 * report.impulse_scale && tool.contacts > 0, "{shape:?} {contact:?}: {tool:?}");
        assert!(report.wall_impulse.y > 0.0 && report.health.is_ok(), "{:?} {}", report.wall_impulse, report.health);
        let weight = gravity * (report.particle_mass / 4.0);
        assert!((report.gravity_impulse - weight * duration).length() < 1e-12 * report.gravity_impulse.length());
    }
}

/// A separating tool comes up to clay at rest: while there is a gap it takes nothing, however near the nodes
/// are, and then it pushes.
#[test]
fn separating_tool_pushes_what_it_touches() {
    let plate = ToolShape::Box { half_size: DVec3::new(3.0, 1.0, 3.0) * CELL_WIDTH };
    let ball = ToolShape::Sphere { radius: 2.0 * CELL_WIDTH };
    for (shape, half) in [(plate, 1.0), (ball, 2.0)] {
        for shift in [0.0, 0.2, 0.45, 0.7] {
            let mut oracle = empty([12.0; 3], all(Wall::Separate), elastic(0.3));
            fill(&mut oracle, [4.0, 2.0 + shift, 4.0], [4, 4, 4], [2, 2, 2]);
            let face = 6.0 + shift + half;
            let plan = plan(&oracle, 0.7, 20);
            let mut go = |from: f64, to: f64| {
                // The ball is over a particle.
                let [from, to] = [from, to].map(|gap| [6.25, face + gap, 6.25]);
                let contact = Contact::Separate { friction: 0.3 };
                let path = moving(1, shape, contact, DQuat::IDENTITY, from, to, plan.duration());
                oracle.run(&FramePlan { tools: vec![path], ..plan.clone() }).tools[0]
            };
            let before = go(0.4, 0.05);
            assert_eq!((before.impulse, before.contacts), (DVec3::ZERO, 0), "{shape:?} {shift}");
            assert!(go(0.05, -0.15).impulse.y > 0.0, "{shape:?} {shift}");
        }
    }
}

/// A box drags the foot of a block along a frictionless floor: the floor takes no part in it, the box gives
/// all of the momentum.
#[test]
fn slip_floor_takes_no_tangential_impulse() {
    let mut oracle = empty([16.0, 12.0, 12.0], all(Wall::Slip), elastic(0.3));
    fill(&mut oracle, [4.0, 0.0, 4.0], [4, 4, 4], [2, 2, 2]);
    let plan = plan(&oracle, 0.7, 40);
    let foot = ToolShape::Box { half_size: DVec3::new(1.2, 1.2, 1.2) * CELL_WIDTH };
    let drag = moving(1, foot, Contact::Stick, DQuat::IDENTITY, [5.0, 1.0, 6.0], [5.3, 1.0, 6.1], plan.duration());
    let report = oracle.run(&FramePlan { tools: vec![drag], gravity: DVec3::new(0.3, -9.81, 0.2), ..plan });
    let wall = report.wall_impulse;
    let dragged = report.tools[0].impulse.length();
    assert!(dragged > 1e-3 * report.impulse_scale && wall.y.abs() > 1e-3 * dragged, "{dragged} {wall}");
    assert!(wall.x.abs() < 1e-12 * report.impulse_scale && wall.z.abs() < 1e-12 * report.impulse_scale, "{wall} {dragged}");
}

/// A block thrown up from a separating floor leaves with all its momentum; one that falls on it and bounces
/// is only ever pushed.
#[test]
fn separating_floor_never_pulls() {
    let mut oracle = empty([16.0, 16.0, 16.0], all(Wall::Separate), elastic(0.3));
    fill(&mut oracle, [6.0, 0.0, 6.0], [4, 4, 4], [2, 2, 2]);
    oracle.particles.iter_mut().for_each(|p| p.velocity = DVec3::new(0.1, 0.5, 0.0));
    let thrown = oracle.run(&plan(&oracle, 0.7, 100));
    assert_eq!(thrown.wall_impulse, DVec3::ZERO);
    assert!((thrown.momentum - thrown.momentum_before).length() < 1e-12 * thrown.momentum_scale);

    let mut oracle = empty([16.0, 16.0, 16.0], all(Wall::Separate), elastic(0.3));
    fill(&mut oracle, [6.0, 1.7, 6.0], [4, 4, 4], [2, 2, 2]);
    oracle.particles.iter_mut().for_each(|p| p.velocity = DVec3::new(0.1, -0.5, 0.0));
    let step = FramePlan { gravity: DVec3::new(0.0, -1.0, 0.0), ..plan(&oracle, 0.7, 1) };
    let reports: Vec<FrameReport> = (0..250).map(|_| oracle.run(&step)).collect();
    let pushed: f64 = reports.iter().map(|r| r.wall_impulse.y).sum();
    let pulled: f64 = reports.iter().map(|r| r.wall_impulse.y.min(0.0)).sum();
    let sideways: f64 = reports.iter().map(|r| r.wall_impulse.x.abs()).sum();
    let momentum = 0.5 * reports[0].particle_mass;
    println!("bounce: pushed {} m v, pulled {:e} m v", pushed / momentum, pulled / momentum);
    assert!(pulled >= -1e-14 * momentum && sideways < 1e-12 * momentum, "{pulled:e} {sideways:e}");
    assert!(pushed > 1.2 * momentum, "{} m v", pushed / momentum);
    assert_eq!(reports[249].wall_impulse, DVec3::ZERO, "the block has left");
}

/// A particle of a cell, which reaches half of one, moves freely until it has arrived at a wall. One that has
/// and stands 1.2 cells above it gives the wall node `(1.5 - 1.2)^2 / 2` of its weight: of its velocity that
/// part is stopped, but by a separating wall.
#[test]
fn walls_hold_what_has_arrived() {
    const FLOOR: u32 = 1 << 1;
    let run = |wall, height: f64, noted| {
        let mut oracle = empty([8.0; 3], all(wall), elastic(0.3));
        fill(&mut oracle, [4.0, height - 0.5, 4.0], [1; 3], [1; 3]);
        oracle.particles[0].velocity.y = -0.1;
        oracle.particles[0].walls = noted;
        oracle.run(&plan(&oracle, 0.5, 1));
        (oracle.particles[0].velocity.y / -0.1, oracle.particles[0].walls)
    };
    for wall in [Wall::Slip, Wall::Stick, Wall::Separate] {
        let holds = wall != Wall::Separate;
        for (height, noted, velocity, is_noted) in [
            (1.2, 0, 1.0, false),
            (1.2, FLOOR, if holds { 1.0 - 0.045 } else { 1.0 }, holds),
            (1.501, FLOOR, 1.0, false),
            (0.551, 0, 1.0, false),
            (0.549, 0, if holds { 1.0 - 0.4522 } else { 1.0 }, holds),
        ] {
            let (found, walls) = run(wall, height, noted);
            assert!((found - velocity).abs() < 1e-5, "{wall:?} at {height}, {noted}: {found}");
            assert_eq!(walls, if is_noted { FLOOR } else { 0 }, "{wall:?} at {height}, {noted}");
        }
    }
    let touching = run(Wall::Separate, 0.49, 0);
    assert!(touching.0 < 1.0 && touching.1 == FLOOR, "{touching:?}");
    let found = run(Wall::Separate, 0.4, 0);
    assert!(found.0 < 0.0 && found.1 == 0, "{found:?}");
}

/// A block at rest in the corner of three walls, slip or stick, with diagonal gravity: the walls carry its
/// weight.
#[test]
fn corner_carries_the_weight() {
    for wall in [Wall::Slip, Wall::Stick, Wall::Separate] {
        let mut oracle = empty([8.0; 3], all(wall), elastic(0.3));
        fill(&mut oracle, [0.0; 3], [4, 4, 4], [2, 2, 2]);
        let rest = FramePlan {
            gravity: DVec3::new(-2.0, -9.81, -3.0),
            validation: Validation { damping: 300.0, ..Validation::default() },
            ..plan(&oracle, 0.7, 600)
        };
        oracle.run(&rest);
        let report = oracle.run(&FramePlan { steps: 50, ..rest });
        let error = (report.wall_impulse + report.gravity_impulse).length() / report.gravity_impulse.length();
        assert!(error < 1e-3, "{wall:?}: {error:e}");
        let low = oracle.particles.iter().map(|p| p.position.min_element() - f64::from(WALL_NODE)).fold(f64::INFINITY, f64::min);
        assert!((0.2..0.3).contains(&low), "{wall:?}: lowest particle at {low} cells");
    }
}

/// Momentum along x [kg m/s] of the particles that `is_front` names.
fn momentum_x(oracle: &Oracle, is_front: &[bool]) -> f64 {
    let parts = oracle.particles.iter().zip(is_front).filter(|(_, front)| **front);
    parts.map(|(p, _)| p.rest_volume * oracle.material.density * p.velocity.x).sum()
}

/// An elastic block of 8 x 4 x 4 cells on a slip floor, cut at `plane` cells by tags if `is_cut`, its two
/// parts moving apart (or, negative, together) at `speed` [m/s] each. Which particles are in front comes
/// along.
fn cut_block(plane: f64, is_cut: bool, speed: f64) -> (Oracle, Vec<bool>) {
    let mut oracle = empty([24.0, 12.0, 12.0], all(Wall::Slip), elastic(0.3));
    fill(&mut oracle, [8.0, 0.0, 4.0], [8, 4, 4], [2, 2, 2]);
    let distance = |p: &Particle| p.position.x - f64::from(WALL_NODE) - plane;
    for particle in &mut oracle.particles {
        let side = if distance(particle) > 0.0 { 1 } else { -1 };
        if is_cut && distance(particle).abs() <= 1.5 {
            particle.tags[0] = Tag { sheet: 1, side };
        }
        particle.velocity.x = speed * f64::from(side);
    }
    let is_front = oracle.particles.iter().map(|p| distance(p) > 0.0).collect();
    (oracle, is_front)
}

/// Pulled apart, the halves of a cut block do not feel each other; those of a whole block do.
#[test]
fn cut_halves_part_without_force() {
    for plane in [12.0, 12.3, 12.5] {
        let [cut, whole] = [true, false].map(|is_cut| {
            let (mut oracle, is_front) = cut_block(plane, is_cut, 0.2);
            let before = momentum_x(&oracle, &is_front);
            oracle.run(&plan(&oracle, 0.7, 60));
            momentum_x(&oracle, &is_front) / before
        });
        assert!((cut - 1.0).abs() < 1e-12 && whole < 0.7, "plane {plane}: cut {cut}, whole {whole}");
    }
}

/// Pushed together, they stop each other as whole clay does, and rise no more than whole clay does; then they
/// part. (Not to rounding: what each side's particles have beyond the nodes stays with that side.)
#[test]
fn cut_halves_press_on_each_other() {
    for plane in [12.0, 12.3] {
        let [cut, whole] = [true, false].map(|is_cut| {
            let (mut oracle, is_front) = cut_block(plane, is_cut, -0.2);
            // Smooth, as nodes can have it: what they cannot is not contact's.
            for particle in &mut oracle.particles {
                let distance = particle.position.x - f64::from(WALL_NODE) - plane;
                particle.velocity.x = -0.1 * distance;
                particle.affine.x_axis.x = -0.1 / oracle.domain.cell_width;
            }
            let before = momentum_x(&oracle, &is_front).abs();
            let step = plan(&oracle, 0.7, 2);
            let observe = |_| {
                let report = oracle.run(&step);
                assert!(report.balance_error() < 1e-12, "{:e}", report.balance_error());
                DVec3::new(momentum_x(&oracle, &is_front), report.momentum.y, 0.0) / before
            };
            (0..10).map(observe).collect::<Vec<_>>()
        });
        // From impact to rebound, 18 substeps; then the cut opens where whole clay holds together.
        let worst = cut[..9].iter().zip(&whole).map(|(c, w)| (*c - *w).length()).fold(0.0, f64::max);
        println!("pressed cut at {plane}: {worst:e} from whole clay");
        assert!(worst < 3e-3 && cut[9].x > whole[9].x + 0.01, "plane {plane}: {worst:e}, {} {}", cut[9], whole[9]);
    }
}

/// A blade a hundredth of a cell wider than the room sweeps a block at up to 3 cells per substep: nothing
/// leaks through. (By one exactly as wide a particle goes at half a cell per substep: flung to the wall, it
/// stands on the blade's rim to the last bit, is beside it by rounding, and comes back behind it. At 1e-6
/// cells wider none does.)
#[test]
fn swept_blade_leaks_nothing() {
    for cells_per_substep in [0.1, 0.5, 1.0, 3.0] {
        let mut oracle = empty([40.0, 12.0, 12.0], all(Wall::Slip), Preset::SoftClay.material());
        fill(&mut oracle, [6.0, 4.0, 4.0], [8, 4, 4], [2, 2, 2]);
        let steps = (16.0 / cells_per_substep) as u32;
        let plan = plan(&oracle, 0.7, steps);
        let end = 4.0 + f64::from(steps) * cells_per_substep;
        let sweep =
            moving(1, blade(6.01), Contact::default(), front_along_x(), [4.0, 6.0, 6.0], [end, 6.0, 6.0], plan.duration());
        let swept = oracle.run(&FramePlan { tools: vec![sweep.clone()], ..plan.clone() });
        // The blade stands: whoever it still has to put back, it does.
        let still = ToolPath::still(1, sweep.tool, sweep.pose_at(plan.duration()));
        let held = oracle.run(&FramePlan { tools: vec![still], steps: 2, ..plan });
        let behind = |p: &&Particle| p.position.x - f64::from(WALL_NODE) < end - 0.1;
        let leaked = oracle.particles.iter().filter(behind).count();
        println!("{cells_per_substep} cells/substep: {} put back, J {:?}", swept.tools[0].pushed_back, swept.volume_ratio);
        assert_eq!(leaked, 0, "{cells_per_substep} cells/substep, {} put back", swept.tools[0].pushed_back);
        assert!(swept.tools[0].tagged >= 1024 && oracle.particles.iter().all(|p| p.tags[0].side >= 0), "{:?}", swept.tools);
        assert!(held.balance_error() < 1e-12 && held.momentum.is_finite());
    }
}

/// A blade slices through a block and leaves: the cut stays, and the halves part without force.
#[test]
fn withdrawn_blade_leaves_the_cut() {
    let (mut oracle, _) = cut_block(12.1, false, 0.0);
    let plan = FramePlan { steps: 120, ..plan(&oracle, 0.7, 1) };
    let [above, through] = [[12.1, 10.0, 6.0], [12.1, 2.0, 6.0]];
    let slice = |from, to| moving(3, blade(4.0), Contact::Slip, front_along_x(), from, to, plan.duration());
    for path in [slice(above, through), slice(through, above)] {
        let report = oracle.run(&FramePlan { tools: vec![path], ..plan.clone() });
        assert_eq!(report.tools[0].pushed_back, 0);
    }
    let is_front: Vec<bool> = oracle.particles.iter().map(|p| p.position.x - f64::from(WALL_NODE) > 12.1).collect();
    assert!(oracle.particles.iter().zip(&is_front).all(|(p, front)| p.tags[0].sign() != if *front { -1 } else { 1 }));
    let pull = |oracle: &mut Oracle| {
        for (particle, front) in oracle.particles.iter_mut().zip(&is_front) {
            particle.velocity = DVec3::X * if *front { 0.2 } else { -0.2 };
            particle.affine = DMat3::ZERO;
        }
        let before = momentum_x(oracle, &is_front);
        oracle.run(&FramePlan { steps: 60, ..plan.clone() });
        momentum_x(oracle, &is_front) / before
    };
    let kept = pull(&mut oracle.clone());
    oracle.particles.iter_mut().for_each(|p| p.tags[0] = Tag::default());
    let healed = pull(&mut oracle);
    assert!((kept - 1.0).abs() < 1e-12 && healed < 0.7, "cut {kept}, healed {healed}");
}

/// An isolated particle sheared alike near a tool and far from it gains `s sY / (3 mu)` more plastic strain
/// near it: the yield stress is `sY (1 - s)` there.
#[test]
fn clay_near_the_tool_is_softer_by_the_softening() {
    let softening = 0.4;
    let hardening = |distance: f64| {
        let mut oracle = empty([32.0, 8.0, 8.0], all(Wall::Slip), ClayMaterial { softening, ..Preset::SoftClay.material() });
        fill(&mut oracle, [3.3, 3.4, 3.6], [1; 3], [1; 3]);
        let plan = plan(&oracle, 0.5, 1);
        oracle.particles[0].affine.y_axis.x = 0.2 / plan.dt;
        let ball = Tool { shape: ToolShape::Sphere { radius: CELL_WIDTH }, contact: Contact::Slip };
        let pose = Pose { position: world([4.8 + distance, 3.9, 4.1]), ..Pose::default() };
        oracle.run(&FramePlan { tools: vec![ToolPath::still(1, ball, pose)], ..plan });
        oracle.particles[0].hardening
    };
    let material = Preset::SoftClay.material();
    let expected = softening * material.yield_stress / (3.0 * material.lame_mu());
    // 3 cells is near, 24 cells is 7 softening lengths beyond.
    let measured = hardening(2.9) - hardening(24.0);
    assert!((measured / expected - 1.0).abs() < 2e-3, "{measured} {expected}");
}

/// A snapshot comes back as it was, to f32; a particle that is not finite is frozen, named, and harms nobody.
#[test]
fn snapshot_round_trips_and_freezes_what_is_not_finite() {
    let (mut oracle, _) = cut_block(12.0, true, 0.1);
    oracle.run(&plan(&oracle, 0.7, 5));
    let mut snapshot = oracle.snapshot();
    assert_eq!(Oracle::new(&snapshot).snapshot(), snapshot);
    snapshot.particles[3].velocity[1] = f32::NAN;
    let mut loaded = Oracle::new(&snapshot);
    let report = loaded.run(&plan(&loaded, 0.7, 5));
    assert_eq!((report.quarantined, report.particle_count), (vec![3], snapshot.particles.len() - 1));
    assert!(report.momentum.is_finite() && report.health.contains(Health::QUARANTINED));
    assert_eq!(loaded.snapshot().particles.len(), snapshot.particles.len());
}
