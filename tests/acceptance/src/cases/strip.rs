//! A strip pressed into clay in plane strain: a force without steps, and that of Prandtl's punch.

use super::press::{Curve, SAMPLE, force_at, jitter_below};
use crate::lab::{DX, Lab, Mover, Size, block, place, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// The floor's bit among the walls that a particle has arrived at.
const FLOOR: u32 = 1 << 1;

/// Greatest over least force of the samples within any `window` [cells] of travel that lie in `range`.
fn unevenness(curve: &[[f64; 2]], range: [f64; 2], window: f64) -> f64 {
    let seen: Vec<_> = curve.iter().filter(|c| (range[0]..=range[1]).contains(&c[0])).collect();
    let of_window = |first: &[f64; 2]| {
        let within = seen.iter().filter(|c| (first[0]..=first[0] + window).contains(&c[0])).map(|c| c[1]);
        let (least, most) = within.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), f| (l.min(f), m.max(f)));
        if least > 0.0 { most / least } else { f64::NAN }
    };
    // NaN is worse than anything.
    seen.iter().map(|c| of_window(c)).fold(f64::NAN, |a, b| if a >= b || b.is_nan() { if b.is_nan() { b } else { a } } else { b })
}

/// Half of a strip of width `width` [cells] pressed into clay in plane strain, by symmetry.
#[derive(Clone, Copy, Debug)]
struct Strip {
    width: i32,
    /// How far clay and strip stand above where nodes are [cells].
    shift: f64,
    contact: Contact,
    jitter: f64,
    /// How deep it goes [cells].
    depth: f64,
    /// Over the shear wave's speed.
    speed: f64,
}

impl Strip {
    /// F / (B k) against depth.
    fn press(&self) -> Curve {
        const SLAB: i32 = 4;
        let strength = 5e3;
        let shear_modulus = 100.0 * strength;
        let material = ClayMaterial {
            young_modulus: 2.0 * shear_modulus * 1.45,
            poisson_ratio: 0.45,
            yield_stress: 3f64.sqrt() * strength,
            ..Preset::SoftClay.material()
        };
        let b = f64::from(self.width);
        let size = IVec3::new(5 * self.width / 2, 2 * self.width, SLAB);
        let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], high: [Wall::Slip; 3] };
        let domain = room_with([size.x, size.y + 4, size.z], walls);
        let top = f64::from(size.y) + self.shift;
        let mut particles = block(DVec3::Y * self.shift, size);
        if self.jitter > 0.0 {
            jitter_below(&mut particles, self.jitter, top);
        }
        // Shifted clay would first fall on the floor: it has been there.
        particles.iter_mut().filter(|p| place(p).y < self.shift + 0.5).for_each(|p| p.walls |= FLOOR);
        let mut lab = Lab::with_threads(&snapshot(domain, material, particles), stable_step(&material), 1);
        lab.plan.volume_averaging = VOLUME_AVERAGING;
        let shape = ToolShape::Box { half_size: DVec3::new(b / 2.0, 2.0, f64::from(SLAB)) };
        let at = DVec3::new(0.0, top + 2.0 + 0.1, f64::from(SLAB) / 2.0);
        let mut mover = Mover::new(&domain, shape, self.contact, at, DQuat::IDENTITY);
        let speed = self.speed * (material.lame_mu() / material.density).sqrt();
        let steps = (SAMPLE * DX / speed / lab.plan.dt).ceil();
        let (mut depth, mut curve) = (-0.1, vec![]);
        while depth < self.depth {
            mover.velocity = DVec3::NEG_Y * SAMPLE * DX / (steps * lab.plan.dt);
            let report = lab.frame_moving(steps as u32, &mut mover);
            // The mean over the way of the sample.
            curve.push([depth + 0.5 * SAMPLE, report.tools[0].force.y / (0.5 * b * f64::from(SLAB) * DX * DX * strength)]);
            depth += SAMPLE;
        }
        curve
    }
}

/// The strip's force, sticking, with friction and without, with its face at four offsets to the grid; then of
/// wider strips, and what these lead to.
pub fn forces(size: Size) -> Vec<Row> {
    let separate = |friction| Contact::Separate { friction };
    let speed = size.pick(0.004, 0.004, 0.002);
    let depth = size.pick(1.1, 1.5, 2.4);
    let one = |contact, shift| Strip { width: 8, shift, contact, jitter: 0.0, depth, speed };
    let offsets: &[f64] = size.pick(&[0.0], &[0.0, 0.5], &[0.0, 0.25, 0.5, 0.75]);
    let mut strips: Vec<(String, Strip)> = vec![];
    for (name, contact) in [("stick", Contact::Stick), ("friction 0.3", separate(0.3))] {
        strips.extend(offsets.iter().map(|&shift| (format!("strip of 8, {name}, offset {shift}"), one(contact, shift))));
    }
    strips.push(("strip of 8, no friction, jittered".into(), Strip { jitter: 0.125, ..one(separate(0.0), 0.0) }));
    let widths: &[i32] = size.pick(&[], &[], &[16, 32]);
    strips.extend(widths.iter().map(|&width| (format!("strip of {width}"), Strip { width, ..one(separate(0.3), 0.0) })));
    let curves: Vec<Curve> = strips.par_iter().map(|(_, strip)| strip.press()).collect();
    let mut rows = vec![];
    for ((name, strip), curve) in strips.iter().zip(&curves) {
        let most = if strip.contact == separate(0.0) { 1.10 } else { 1.06 };
        let range = [0.5, depth];
        rows.push(Row::at_most(format!("{name}: greatest over least in half a cell"), unevenness(curve, range, 0.5), "-", most));
        if strip.contact != separate(0.0) {
            let jump = 100.0 * (unevenness(curve, range, 0.1) - 1.0);
            rows.push(Row::at_most(format!("{name}: jump within 0.1 cells"), jump, "%", 3.0));
        }
    }
    if size == Size::Full {
        let exact = 2.0 + PI;
        // At a depth of B / 16: F / (B k) as a line over 1 / B, at 0.
        let points: Vec<[f64; 2]> = strips
            .iter()
            .zip(&curves)
            .filter(|((_, s), _)| s.shift == 0.0 && s.contact == separate(0.3))
            .map(|((_, s), curve)| [1.0 / f64::from(s.width), force_at(curve, f64::from(s.width) / 16.0)])
            .collect();
        for &[inverse, factor] in &points {
            let most = exact * (1.0 + 1.6 * inverse) * 1.07;
            rows.push(Row::at_most(format!("strip of {:.0}: F / (B k) at a depth of B / 16", 1.0 / inverse), factor, "-", most));
        }
        let off = intercept(&points) / exact - 1.0;
        rows.push(Row::at_most("strips: F / (B k) of the endless one, off 2 + pi by", 100.0 * off.abs(), "%", 5.0));
    }
    rows
}

/// Where the least-squares line through `points` is at 0.
fn intercept(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p[0] / n, s.1 + p[1] / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p[0] - x) * (p[1] - y), s.1 + (p[0] - x).powi(2)));
    y - xy / xx * x
}
