//! Clay that slumps under its own weight: a vertical cut, and the cylinder of a slump test.

use crate::lab::{DX, Lab, Size, block, place, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use glam::{DVec3, IVec3};

/// Gravity [m/s^2].
const GRAVITY: f64 = 9.81;
/// Young's modulus over rho g H [-]: the elastic slump of a cut is 0.002 H.
const STIFFNESS: f64 = 300.0;
/// Time over which gravity grows [sqrt(H / g)]: many passages of a wave.
const RAMP: f64 = 2.4;
/// Damping of node velocities [sqrt(g / H)]. The answers are those of slow loading: at 0.3 inertia carries a
/// cylinder half as far again beyond its rest (slump 0.39 against 0.25 at k = 0.2 rho g H); at 3 a ramp of 6
/// gives the same slump as one of 2.4 to 0.5 %.
const DAMPING: f64 = 3.0;
/// The slump has settled when it grows by less than this share of H in a time of `sqrt(H / g) / 2`.
const SETTLED: f64 = 1e-4;
/// Longest time for that [sqrt(H / g)].
const PATIENCE: f64 = 60.0;
/// Thickness of the slab between slip walls for plane strain [cells].
const SLAB: i32 = 4;

/// A heap on its floor.
#[derive(Clone, Debug)]
struct Heap {
    /// Height H [cells].
    height: i32,
    /// Room [cells].
    room: [i32; 3],
    /// The floor.
    floor: Wall,
    /// The clay at the start.
    particles: Vec<Particle>,
    /// The top's particles are seen to this distance from the axis or plane of symmetry [cells].
    seen: f64,
}

impl Heap {
    /// Half of a bank with a vertical face, `wide` heights from the symmetry plane to the face, on a rough
    /// floor.
    fn cut(height: i32, wide: f64) -> Self {
        let width = (wide * f64::from(height)).round() as i32;
        Self {
            height,
            room: [width + 2 * height, height + 4, SLAB],
            floor: Wall::Stick,
            particles: block(DVec3::ZERO, IVec3::new(width, height, SLAB)),
            seen: 0.2 * f64::from(height),
        }
    }

    /// A quarter of a cylinder as high as wide.
    fn cylinder(height: i32, floor: Wall) -> Self {
        let radius = f64::from(height) / 2.0;
        let mut particles = block(DVec3::ZERO, IVec3::new(height / 2, height, height / 2));
        particles.retain(|p| place(p).x.hypot(place(p).z) < radius);
        Self { height, room: [3 * height / 2, height + 4, 3 * height / 2], floor, particles, seen: 0.3 * radius }
    }

    /// Sinking of the top over H of clay of `strength` = k / (rho g H), infinite for elastic clay; NaN if it
    /// does not settle.
    fn settle(&self, strength: f64) -> f64 {
        let height = f64::from(self.height) * DX;
        let soft = Preset::SoftClay.material();
        let weight = soft.density * GRAVITY * height;
        let material = ClayMaterial {
            young_modulus: STIFFNESS * weight,
            poisson_ratio: 0.3,
            yield_stress: 3f64.sqrt() * strength * weight,
            ..soft
        };
        let walls = Walls { low: [Wall::Slip, self.floor, Wall::Slip], high: [Wall::Slip; 3] };
        let clay = snapshot(room_with(self.room, walls), material, self.particles.clone());
        let mut lab = Lab::new(&clay, stable_step(&material));
        lab.plan.volume_averaging = VOLUME_AVERAGING;
        let unit = (height / GRAVITY).sqrt();
        lab.plan.validation.damping = DAMPING / unit;
        // Eight frames for the time in which the slump must stand still.
        let steps = (unit / 16.0 / lab.plan.dt).ceil() as u32;
        let frame = f64::from(steps) * lab.plan.dt / unit;
        let tops = self.tops(&clay.particles);
        let start = mean_height(&clay.particles, &tops);
        let (mut time, mut history) = (0.0, vec![]);
        while time < PATIENCE {
            lab.plan.gravity = DVec3::NEG_Y * GRAVITY * ((time + frame / 2.0) / RAMP).min(1.0);
            lab.frame(steps);
            time += frame;
            history.push((start - mean_height(&lab.particles(), &tops)) / f64::from(self.height));
            if let [.., then, _, _, _, _, _, _, _, now] = history[..]
                && time > RAMP + 1.0
                && (now - then).abs() < SETTLED
            {
                return now;
            }
        }
        f64::NAN
    }

    /// Indices of the top layer's particles that are seen.
    fn tops(&self, particles: &[Particle]) -> Vec<usize> {
        let is_seen = |p: &Particle| {
            let q = place(p);
            let across = if self.room[2] == SLAB { q.x } else { q.x.hypot(q.z) };
            q.y > f64::from(self.height) - 0.5 && across < self.seen
        };
        let mut ids: Vec<u32> = particles.iter().map(|p| p.id).collect();
        ids.sort_unstable();
        let index = |p: &Particle| ids.binary_search(&p.id).ok();
        particles.iter().filter(|p| is_seen(p)).filter_map(index).collect()
    }
}

fn mean_height(particles: &[Particle], which: &[usize]) -> f64 {
    which.iter().map(|i| place(&particles[*i]).y).sum::<f64>() / which.len() as f64
}

/// Where the vertical cut gives way: the line through the settled slumps at lower strengths, less the elastic
/// slump, comes to 0.
///
/// It stands for `k / (rho g H) >= 1 / 3.78 = 0.2645` (bounds 3.776 and 3.783: Pastor et al. 2000, Lyamin and
/// Sloan 2002).
pub fn cut_slope(size: Size) -> Vec<Row> {
    let height = size.pick(10, 10, 24);
    let bank = Heap::cut(height, 1.0);
    let elastic = bank.settle(f64::INFINITY);
    let strengths: &[f64] = size.pick(&[0.2, 0.22], &[0.22, 0.235], &[0.205, 0.22, 0.235]);
    let points: Vec<[f64; 2]> = strengths.iter().map(|t| [*t, bank.settle(*t) - elastic]).collect();
    let (intercept, slope) = line(&points);
    let onset = -intercept / slope;
    let name = |what: &str| format!("cut slope: {what} k / (rho g H) at which it gives way, {height} cells high");
    vec![
        Row::at_least(name("least"), onset, "-", 0.25),
        Row::at_most(name("greatest"), onset, "-", 0.275),
        // Of a column that bulges to one side; only its scale matters here.
        Row::at_most(format!("cut slope: elastic slump, {height} cells high"), elastic * STIFFNESS, "rho g H^2 / E", 0.5),
    ]
}

/// The slump of a cylinder as high as wide on a rough floor: `s / H = 1 - 2 t (1 - ln 2 t)`,
/// `t = tau_y / (rho g H)` (Murata 1984, Pashias et al. 1996). There a layer flows where the greatest shear
/// stress, half the weight above over its area, exceeds `tau_y`: half the yield stress in uniaxial
/// compression, which is `sqrt(3) / 2 k` of von Mises clay.
pub fn cylinder(size: Size) -> Vec<Row> {
    let height = 24;
    // 16 cells are 19 % off at 0.15: too few for the limit, so that `--quick` has no such row.
    let strengths: &[f64] = size.pick(&[], &[], &[0.05, 0.1, 0.15, 0.2]);
    let row = |t: &f64| {
        let compression = 3f64.sqrt() * t;
        let expected = 1.0 - compression * (1.0 - compression.ln());
        let slump = Heap::cylinder(height, Wall::Stick).settle(*t);
        Row::at_most(format!("cylinder: slump error at k = {t} rho g H"), (slump / expected - 1.0).abs(), "relative", 0.15)
    };
    strengths.iter().map(row).collect()
}

/// Least squares `y = a + b x`.
pub fn line(points: &[[f64; 2]]) -> (f64, f64) {
    let n = points.len() as f64;
    let mean = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p[0]), mean(&|p| p[1]));
    let b = mean(&|p| (p[0] - x) * (p[1] - y)) / mean(&|p| (p[0] - x).powi(2));
    (y - b * x, b)
}
