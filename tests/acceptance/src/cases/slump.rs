//! Clay that slumps under its own weight: a vertical cut and the cylinder of a slump test, damped so that
//! they give way as if loaded slowly; and the cylinder let go at once, as an app does it.

use crate::lab::{DX, Lab, Size, at_walls, block, place, room_with, snapshot, stable_step};
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
/// Times sqrt(H / g) for which clay let go at once is watched: it is at rest, but for its ringing, after two.
const WATCHED: f64 = 4.0;
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

    /// Lets go of a heap of clay of `strength` = k / (rho g H) as an app does: all of gravity at once,
    /// nothing that damps, the default step and averaging, stiffness and Poisson's ratio of the preset clays.
    fn let_go(&self, strength: f64) -> LetGo {
        let height = f64::from(self.height) * DX;
        let soft = Preset::SoftClay.material();
        let yield_stress = 3f64.sqrt() * strength * soft.density * GRAVITY * height;
        let young_modulus = soft.young_modulus / soft.yield_stress * yield_stress;
        let material = ClayMaterial { young_modulus, yield_stress, ..soft };
        let walls = Walls { low: [Wall::Slip, self.floor, Wall::Slip], high: [Wall::Slip; 3] };
        let domain = room_with(self.room, walls);
        let mut particles = self.particles.clone();
        at_walls(&domain, &mut particles);
        let clay = snapshot(domain, material, particles);
        let mut lab = Lab::new(&clay, stable_step(&material));
        lab.plan.volume_averaging = VOLUME_AVERAGING;
        lab.plan.gravity = DVec3::NEG_Y * GRAVITY;
        let steps = ((height / GRAVITY).sqrt() / 16.0 / lab.plan.dt).ceil() as u32;
        let tops = self.tops(&clay.particles);
        let weight = |p: &Particle| material.density * f64::from(p.rest_volume) * GRAVITY;
        let potential = |particles: &[Particle]| particles.iter().map(|p| weight(p) * place(p).y * DX).sum::<f64>();
        let flow = |p: &Particle| yield_stress * f64::from(p.rest_volume) * f64::from(p.hardening);
        let (start, high) = (potential(&clay.particles), mean_height(&clay.particles, &tops));
        let (mut is_sound, mut most, mut created, mut slumps) = (true, 0.0f64, 0.0f64, vec![]);
        let (mut work, mut missing) = (0.0, 0.0);
        for _ in 0..(16.0 * WATCHED) as u32 {
            let report = lab.frame(steps);
            let particles = lab.particles();
            work = start - potential(&particles);
            missing = work - report.energies.kinetic - report.energies.elastic - particles.iter().map(flow).sum::<f64>();
            (most, created) = (most.max(missing), created.max(most - missing));
            is_sound &= report.health.is_ok() && report.redone == 0;
            slumps.push((high - mean_height(&particles, &tops)) / f64::from(self.height));
        }
        if !is_sound {
            return LetGo { slump: f64::NAN, created: f64::NAN, lost: f64::NAN };
        }
        // It rings on: the mean of the last quarter.
        let last = &slumps[slumps.len() * 3 / 4..];
        let slump = last.iter().sum::<f64>() / last.len() as f64;
        LetGo { slump, created: 100.0 * created / work, lost: 100.0 * missing / work }
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

/// What became of clay that was let go.
struct LetGo {
    /// Sinking of the top over H.
    slump: f64,
    /// Greatest energy from nowhere at any time, of the weight's work [%].
    created: f64,
    /// What is missing of that work at the end [%].
    lost: f64,
}

fn mean_height(particles: &[Particle], which: &[usize]) -> f64 {
    which.iter().map(|i| place(&particles[*i]).y).sum::<f64>() / which.len() as f64
}

/// Where the vertical cut gives way: the line through the settled slumps at lower strengths, less the elastic
/// slump, comes to 0.
///
/// It stands for `k / (rho g H) >= 1 / 3.78 = 0.2645` (bounds 3.776 and 3.783: Pastor et al. 2000, Lyamin and
/// Sloan 2002). The full size is judged to half a cell of H, 2 %: no better is its face known.
pub fn cut_slope(size: Size) -> Vec<Row> {
    let height = size.pick(10, 10, 24);
    let bank = Heap::cut(height, 1.0);
    let elastic = bank.settle(f64::INFINITY);
    let strengths: &[f64] = size.pick(&[0.2, 0.22], &[0.22, 0.235], &[0.205, 0.22, 0.235]);
    let points: Vec<[f64; 2]> = strengths.iter().map(|t| [*t, bank.settle(*t) - elastic]).collect();
    let (intercept, slope) = line(&points);
    let onset = -intercept / slope;
    let (least, greatest) = size.pick((0.25, 0.275), (0.25, 0.275), (0.259, 0.27));
    let name = |what: &str| format!("cut slope, damped: {what} k / (rho g H) at which it gives way, {height} cells high");
    vec![
        Row::at_least(name("least"), onset, "-", least),
        Row::at_most(name("greatest"), onset, "-", greatest),
        // Of a column that bulges to one side; only its scale matters here.
        Row::at_most(format!("cut slope, damped: elastic slump, {height} cells high"), elastic * STIFFNESS, "rho g H^2 / E", 0.5),
    ]
}

/// A cylinder let go at once sinks further than the formula, which is of slow loading, by what its motion
/// carries it; no further than the energy of its fall allows, and all of that is accounted for.
pub fn sudden(size: Size) -> Vec<Row> {
    let height = size.pick(12, 12, 24);
    let strengths: &[f64] = size.pick(&[0.15], &[0.15], &[0.1, 0.15, 0.2]);
    let rows_of = |k: &f64| {
        let t = 3f64.sqrt() * k;
        let found = Heap::cylinder(height, Wall::Stick).let_go(*k);
        let soft = Preset::SoftClay.material();
        // What of it is elastic: at most the strain of yield.
        let elastic = soft.yield_stress / soft.young_modulus;
        let name = |what: &str| format!("cylinder of {height} cells let go at once, k = {k} rho g H: {what}");
        [
            Row::at_least(name("slump over the static one"), found.slump / static_slump(t), "-", 1.0),
            Row::at_most(name("slump over what energy allows"), (found.slump - elastic) / energy_bound(t), "-", 1.0),
            Row::at_most(name("energy from nowhere"), found.created, "% of the work", 0.1),
            Row::at_most(name("energy lost by the method"), found.lost, "% of the work", 5.0),
        ]
    };
    strengths.iter().flat_map(rows_of).collect()
}

/// `s / H = 1 - t (1 - ln t)` with t = sY / (rho g H).
fn static_slump(t: f64) -> f64 {
    1.0 - t * (1.0 - t.ln())
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
        let expected = static_slump(3f64.sqrt() * t);
        let slump = Heap::cylinder(height, Wall::Stick).settle(*t);
        Row::at_most(
            format!("cylinder, damped: slump error at k = {t} rho g H"),
            (slump / expected - 1.0).abs(),
            "relative",
            0.15,
        )
    };
    strengths.iter().map(row).collect()
}

/// The slump over H that the energy of clay let go allows where planes stay planes, for `t` = sY / (rho g H):
/// among all stretches l(z) of its layers whose flow takes the weight's work, `rho g int (H - z) (1 - l) =
/// sY int -ln l`, that of the lowest top, `l = t / (q + 1 - z / H)`, at most 1.
fn energy_bound(t: f64) -> f64 {
    const LAYERS: u32 = 2000;
    let sums = |q: f64| {
        (0..LAYERS).map(|i| (f64::from(i) + 0.5) / f64::from(LAYERS)).fold((0.0, 0.0), |(energy, slump), z| {
            let stretch = (t / (q + 1.0 - z)).min(1.0);
            (energy + (1.0 - z) * (1.0 - stretch) + t * stretch.ln(), slump + (1.0 - stretch) / f64::from(LAYERS))
        })
    };
    let (mut low, mut high) = (0.0, 100.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if sums(middle).0 > 0.0 { low = middle } else { high = middle }
    }
    sums(low).1
}

/// Least squares `y = a + b x`.
pub fn line(points: &[[f64; 2]]) -> (f64, f64) {
    let n = points.len() as f64;
    let mean = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p[0]), mean(&|p| p[1]));
    let b = mean(&|p| (p[0] - x) * (p[1] - y)) / mean(&|p| (p[0] - x).powi(2));
    (y - b * x, b)
}
