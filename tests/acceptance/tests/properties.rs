//! What holds for every state: moments of the kernel, objectivity, kept volume, dissipation, and the round
//! trip of logarithm and exponential.

use bevy_clay::sim::frame::FrameReport;
use bevy_clay::sim::oracle::Oracle;
use bevy_clay::sim::oracle::law::{self, Spectrum};
use bevy_clay::sim::prelude::*;
use clay_acceptance::lab::{self, DX, Lab, room, snapshot};
use glam::{DMat3, DQuat, DVec3};
use proptest::prelude::*;

/// `2 mu = 1 Pa`, `lambda = 0`: the stress is the Hencky strain.
const UNIT: (f64, f64) = (1.0, 0.0);
/// Clay that yields at a Hencky deviator of about 1 %.
const CLAY: (f64, f64) = (4.4e5, 0.45);

fn material((young_modulus, poisson_ratio): (f64, f64)) -> ClayMaterial {
    ClayMaterial { young_modulus, poisson_ratio, ..Preset::SoftClay.material() }
}

/// The law's step with a yield stress [Pa], of clay whose flow knows no rate.
fn advance(yield_stress: f64, elastic_strain: DMat3, increment: DMat3) -> law::Advanced {
    law::advance(&material(CLAY), yield_stress, 1.0, elastic_strain, increment)
}

/// Hencky strain of an elastic strain.
fn hencky(elastic_strain: DMat3) -> DMat3 {
    law::kirchhoff_stress(&material(UNIT), elastic_strain)
}

/// Any matrix with entries up to `size`.
fn matrix(size: f64) -> impl Strategy<Value = DMat3> {
    prop::array::uniform9(-size..size).prop_map(|entries| DMat3::from_cols_array(&entries))
}

/// Elastic strain `b - I` of a random Hencky strain with entries up to `size`.
fn strain(size: f64) -> impl Strategy<Value = DMat3> {
    matrix(size).prop_map(|m| {
        let spectrum = Spectrum::of((m + m.transpose()) * 0.5);
        spectrum.with(spectrum.values.map(|h| (2.0 * h).exp_m1()))
    })
}

/// Any rotation.
fn rotation() -> impl Strategy<Value = DMat3> {
    prop::array::uniform4(-1.0..1.0).prop_filter_map("a quaternion of length 0", |[x, y, z, w]| {
        let q = DQuat::from_xyzw(x, y, z, w);
        (q.length() > 0.1).then(|| DMat3::from_quat(q.normalize()))
    })
}

/// Double contraction `a : b`.
fn contraction(a: DMat3, b: DMat3) -> f64 {
    a.to_cols_array().iter().zip(b.to_cols_array()).map(|(a, b)| a * b).sum()
}

/// Greatest entry of `a - b`.
fn distance(a: DMat3, b: DMat3) -> f64 {
    (a - b).to_cols_array().iter().fold(0.0, |most, entry| entry.abs().max(most))
}

/// What a deformation gradient's closed path takes from the world per rest volume [J/m^3]: the work, the
/// energy left in the clay, and what flow dissipated, step by step.
struct Cycle {
    work: f64,
    stored: f64,
    dissipated: f64,
    least: f64,
}

/// The path `F(s) = I + A sin(2 pi s) + B (1 - cos(2 pi s))` in `steps`; work by the midpoint rule, second
/// order in the step.
fn cycle(yield_stress: f64, a: DMat3, b: DMat3, steps: u32) -> Cycle {
    let clay = material(CLAY);
    let at = |step: u32| {
        let phase = std::f64::consts::TAU * f64::from(step) / f64::from(steps);
        DMat3::IDENTITY + a * phase.sin() + b * (1.0 - phase.cos())
    };
    let (mut elastic, mut stress) = (DMat3::ZERO, DMat3::ZERO);
    let mut sum = Cycle { work: 0.0, stored: 0.0, dissipated: 0.0, least: 0.0 };
    for step in 0..steps {
        let (from, to) = (at(step), at(step + 1));
        let increment = (to - from) * from.inverse();
        let trial = advance(f64::INFINITY, elastic, increment).elastic_strain;
        elastic = advance(yield_stress, elastic, increment).elastic_strain;
        let before = std::mem::replace(&mut stress, law::kirchhoff_stress(&clay, elastic));
        sum.work += contraction((before + stress) * 0.5, (to - from) * 2.0 * (to + from).inverse());
        let lost = contraction(stress, hencky(trial) - hencky(elastic));
        sum.dissipated += lost;
        sum.least = sum.least.min(lost);
    }
    sum.stored = law::energy_density(&clay, elastic);
    sum
}

proptest! {
    /// The law knows no direction and no spin: a step seen from a turned frame is the step turned, and a
    /// rotation after the step turns its result.
    #[test]
    fn law_is_objective(e in strain(0.2), l in matrix(0.05), r in rotation(), sy in 1e3f64..1e5) {
        let turned = |m: DMat3| r * m * r.transpose();
        let plain = advance(sy, e, l);
        for other in [advance(sy, turned(e), turned(l)), advance(sy, e, r * (DMat3::IDENTITY + l) - DMat3::IDENTITY)] {
            prop_assert!(distance(other.elastic_strain, turned(plain.elastic_strain)) < 1e-13);
            prop_assert!((other.plastic_strain - plain.plastic_strain).abs() < 1e-13);
        }
        let stress = law::kirchhoff_stress(&material(CLAY), plain.elastic_strain);
        let seen = law::kirchhoff_stress(&material(CLAY), turned(plain.elastic_strain));
        prop_assert!(distance(seen, turned(stress)) < 1e-12 * CLAY.0);
    }

    /// Stress is symmetric and has the axes of the strain.
    #[test]
    fn stress_is_symmetric_and_coaxial(e in strain(0.5)) {
        let stress = law::kirchhoff_stress(&material(CLAY), e);
        prop_assert!(distance(stress, stress.transpose()) == 0.0);
        prop_assert!(distance(stress * e, e * stress) < 1e-12 * CLAY.0);
    }

    /// The return keeps J, ends on the yield surface, and takes energy:
    /// `tau : (H_trial - H) = sqrt(3/2) |dev tau| da = sY da >= 0`.
    #[test]
    fn return_keeps_volume_and_dissipates(e in strain(0.2), l in matrix(0.05), sy in 1e3f64..1e5) {
        let trial = advance(f64::INFINITY, e, l).elastic_strain;
        let after = advance(sy, e, l);
        let j = (DMat3::IDENTITY + e).determinant().sqrt() * (DMat3::IDENTITY + l).determinant();
        prop_assert!((law::volume_ratio(after.elastic_strain) / j - 1.0).abs() < 1e-13);
        let stress = law::kirchhoff_stress(&material(CLAY), after.elastic_strain);
        let deviator = stress - DMat3::from_diagonal(DVec3::splat((stress.x_axis.x + stress.y_axis.y + stress.z_axis.z) / 3.0));
        prop_assert!((1.5 * contraction(deviator, deviator)).sqrt() <= sy * (1.0 + 1e-12));
        let lost = contraction(stress, hencky(trial) - hencky(after.elastic_strain));
        prop_assert!(after.plastic_strain >= 0.0 && lost >= -1e-9, "{lost}");
        prop_assert!((lost - sy * after.plastic_strain).abs() < 1e-12 * CLAY.0, "{lost}");
    }

    /// A closed path of elastic clay takes no work; one of yielding clay takes what flow dissipates and what
    /// stays in it, and never gives any.
    #[test]
    fn closed_path_never_gives_work(a in matrix(0.1), b in matrix(0.1)) {
        let elastic = cycle(f64::INFINITY, a, b, 200);
        let scale = CLAY.0 * (contraction(a, a) + contraction(b, b));
        prop_assert!(elastic.stored.abs() < 1e-12 * scale && elastic.dissipated.abs() < 1e-9 * scale);
        prop_assert!(elastic.work.abs() < 1e-3 * scale, "{} of {scale}", elastic.work);
        let clay = cycle(8e3, a, b, 200);
        prop_assert!(clay.least >= -1e-9 && clay.work >= -1e-3 * scale);
        // Backward Euler takes the stress at the step's end: first order.
        let balance = clay.work - clay.stored - clay.dissipated;
        prop_assert!(balance.abs() < 0.02 * clay.work + 1e-3 * scale, "{balance} of {}", clay.work);
    }

    /// Exponential after logarithm is the strain again, for stretches of 1/4 to 4 and for strains of 1e-9.
    #[test]
    fn exponential_undoes_logarithm(e in strain(0.6), size in prop_oneof![Just(1.0), Just(1e-9)]) {
        let e = e * size;
        let h = Spectrum::of(hencky(e));
        let error = distance(h.with(h.values.map(|h| (2.0 * h).exp_m1())), e);
        prop_assert!(error < 1e-13 * size, "{error}");
    }
}

/// A lone particle in the middle of a room, anywhere in its cell, in linear motion; the stress it has is
/// none.
fn lone(offset: DVec3, velocity: DVec3, affine: DMat3) -> Snapshot {
    let mut particle = Particle::at(DVec3::splat(8.0) + offset, (DX.powi(3) / 8.0) as f32, 0);
    lab::set_velocity(&mut particle, velocity);
    particle.affine = affine.to_cols_array_2d().map(|c| c.map(|v| v as f32));
    snapshot(room([12; 3], Wall::Separate), lab::elastic(0.3), vec![particle])
}

/// Node velocities of a lone particle are `v + C (x_i - x_p)`, so that one substep gives
/// `v sum w + C sum w arm` for the velocity and `4 (v sum w arm + C sum w arm arm^T)` for the affine: both as
/// they were if and only if the moments are 1, 0 and I / 4.
fn check_moments(
    before: &Particle,
    after: &Particle,
    report: &FrameReport,
    dt: f64,
    tolerance: f64,
) -> Result<(), TestCaseError> {
    let affine = |p: &Particle| DMat3::from_cols_array_2d(&p.affine.map(|c| c.map(f64::from)));
    let (v, c) = (lab::velocity(before), affine(before));
    let scale = v.length().max(contraction(c, c).sqrt() * DX);
    prop_assert!((lab::velocity(after) - v).length() <= tolerance * scale, "{} {v}", lab::velocity(after));
    prop_assert!(distance(affine(after), c) * DX <= 8.0 * tolerance * scale, "{} {c}", affine(after));
    let moved = (after.grid() - before.grid()) * DX;
    prop_assert!((moved - v * dt).length() < 1e-6 * DX, "{moved}");
    prop_assert!((report.grid_mass / report.particle_mass - 1.0).abs() < tolerance);
    Ok(())
}

/// A frame of one substep on the oracle and on the native engine.
fn one_substep(clay: &Snapshot, dt: f64) -> [(Vec<Particle>, FrameReport); 2] {
    let mut lab = Lab::with_threads(clay, dt, 1);
    let mut oracle = Oracle::new(clay);
    let report = oracle.run(&lab.plan);
    let native = lab.frame(1);
    [(oracle.snapshot().particles, report), (lab.particles(), native)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Moments of the kernel through the whole substep of the oracle and of the native engine.
    #[test]
    fn linear_motion_passes_through_the_grid(
        offset in prop::array::uniform3(0.0..1.0).prop_map(DVec3::from_array),
        velocity in prop::array::uniform3(-1.0..1.0).prop_map(DVec3::from_array),
        affine in matrix(100.0),
    ) {
        let clay = lone(offset, velocity, affine);
        let dt = 1e-6;
        let [oracle, native] = one_substep(&clay, dt);
        // The oracle's state is rounded to f32 to be compared.
        check_moments(&clay.particles[0], &oracle.0[0], &oracle.1, dt, 1e-7)?;
        check_moments(&clay.particles[0], &native.0[0], &native.1, dt, 1e-6)?;
    }

    /// Inner stress neither pushes nor turns a body: symmetric stress, on both engines.
    #[test]
    fn stress_keeps_momentum_and_angular_momentum(
        strains in prop::collection::vec((strain(0.1), prop::array::uniform3(0.0..2.0)), 2..12),
    ) {
        let particle = |(i, (e, at)): (usize, &(DMat3, [f64; 3]))| {
            let mut p = Particle::at(DVec3::splat(8.0) + DVec3::from_array(*at), (DX.powi(3) / 8.0) as f32, i as u32);
            let (x, y, z) = (e.x_axis, e.y_axis, e.z_axis);
            p.elastic_strain = [x.x, y.y, z.z, x.y, x.z, y.z].map(|v| v as f32);
            p
        };
        let particles: Vec<Particle> = strains.iter().enumerate().map(particle).collect();
        let clay = snapshot(room([12; 3], Wall::Separate), lab::elastic(0.3), particles);
        let dt = 0.2 * lab::stable_step(&clay.material);
        for ((_, report), tolerance) in one_substep(&clay, dt).iter().zip([1e-12, 1e-5]) {
            let scale = (2.0 * report.energies.kinetic * report.particle_mass).sqrt();
            prop_assert!(report.momentum.length() <= tolerance * scale, "{} of {scale}", report.momentum);
            // About the world's origin, 0.3 m away.
            prop_assert!(report.angular_momentum.length() <= tolerance * scale, "{} of {scale}", report.angular_momentum);
        }
    }
}
