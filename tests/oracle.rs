//! The f64 oracle against closed forms: free flight, rotation, waves, weight, walls, tools and cuts.

use bevy_clay::sim::engine::{FramePlan, FrameReport, Validation};
use bevy_clay::sim::material::{ClayMaterial, Preset};
use bevy_clay::sim::oracle::{Oracle, Particle, law};
use bevy_clay::sim::params::{Domain, WALL_NODE, Wall, Walls};
use bevy_clay::sim::snapshot::{Snapshot, Tag};
use bevy_clay::sim::tool::{Contact, Pose, PoseSample, Tool, ToolPath, ToolShape};
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const CELL_WIDTH: f64 = 0.01;

fn elastic(poisson_ratio: f64) -> ClayMaterial {
    ClayMaterial { density: 1000.0, young_modulus: 1e5, poisson_ratio, yield_stress: f64::INFINITY, ..ClayMaterial::default() }
}

/// A room of `cells` with its low corner at the world's origin and no clay in it.
fn empty(cells: [f64; 3], walls: Walls, material: ClayMaterial) -> Oracle {
    let domain = Domain::new(DVec3::ZERO, DVec3::from_array(cells) * CELL_WIDTH, CELL_WIDTH, walls).expect("domain");
    Oracle::new(&Snapshot { domain, material, time: 0.0, particles: Vec::new() })
}

fn all(wall: Wall) -> Walls {
    Walls { low: [wall; 3], high: [wall; 3] }
}

/// Fills the box at `low` of `size`, in cells from the room's low corner, with `per_edge` particles per cell and axis.
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
    FramePlan {
        id: 0,
        dt: fraction * oracle.material.time_step_limit(CELL_WIDTH, oracle.material.density),
        steps,
        material: oracle.material,
        density_scale: 1.0,
        gravity: DVec3::ZERO,
        tools: Vec::new(),
        seed: 0,
        validation: Validation::default(),
    }
}

/// World position [m] of a point given in cells from the room's low corner.
fn world(cells: [f64; 3]) -> DVec3 {
    DVec3::from_array(cells) * CELL_WIDTH
}

/// A tool that moves from `from` to `to` [cells] in `duration` [s].
fn moving(id: u32, shape: ToolShape, contact: Contact, rotation: DQuat, from: [f64; 3], to: [f64; 3], duration: f64) -> ToolPath {
    let sample = |time, at| PoseSample { time, pose: Pose { position: world(at), rotation } };
    ToolPath { id, tool: Tool { shape, contact }, samples: vec![sample(0.0, from), sample(duration, to)] }
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

/// One turn of a free block: angular momentum to rounding, kinetic energy to 5e-4, strain no more than the spin itself causes.
#[test]
fn free_rotation_keeps_angular_momentum() {
    let mut oracle = empty([16.0, 16.0, 12.0], all(Wall::Slip), elastic(0.3));
    fill(&mut oracle, [6.0, 6.0, 4.0], [4, 4, 4], [2, 2, 2]);
    let wave_speed = oracle.material.wave_speed(oracle.material.density);
    let spin = DVec3::new(0.0, 0.0, 0.005 * wave_speed / CELL_WIDTH);
    let centre = DVec3::new(8.0, 8.0, 6.0) + f64::from(WALL_NODE);
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
    fill(&mut oracle, [4.0, 3.0, 3.0], [cells, 2, 2], [2, 2, 2]);
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

/// Relative L2 errors of displacement and stress of a column of `cells` under its own weight on a slip wall, against the exact solution of
/// confined Hencky elasticity: `M ln(l) / l = -rho g (H - X)` for the stretch l, `u = int (l - 1) dX`, `tau = M ln l`.
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
        steps: (25.0 * length / wave_speed / dt) as u32,
        gravity: DVec3::new(0.0, -gravity, 0.0),
        validation: Validation { damping: 0.7 * PI * wave_speed / length },
        ..plan(&oracle, 1.0, 1)
    });
    let stretch = |at: f64| {
        let load = material.density * gravity * (length - at);
        (0..50).fold(1.0f64, |l, _| l - (modulus * l.ln() / l + load) / (modulus * (1.0 - l.ln()) / (l * l)))
    };
    let displacement = |at: f64| (0..1000).map(|i| stretch(at * (f64::from(i) + 0.5) / 1000.0) - 1.0).sum::<f64>() * at / 1000.0;
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

/// An isolated particle, strained and let go, gains no energy below `dx sqrt(rho / 3K)` and explodes above it.
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
