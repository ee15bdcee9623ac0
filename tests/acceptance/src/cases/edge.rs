//! A blade pressed edge-first into clay: what its flanks bear.

use crate::cases::slump::line;
use crate::lab::{DX, Lab, Mover, Size, block, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use std::f64::consts::FRAC_PI_2;

/// Thickness of the slab between slip walls, L [cells].
const SLAB: i32 = 4;
/// Shear strength k [Pa]. Only ratios to it matter.
const STRENGTH: f64 = 5e3;
/// Rigidity index G / k [-]: clay yields along the flank within a tenth of a cell's travel.
const RIGIDITY: f64 = 100.0;
/// The blade's plane beside the nodes' [cells]: between two layers of particles, and neither on a node nor
/// half-way between two.
const OFFSET: f64 = 0.1;
/// Depth from which the force counts [cells]: below it the surface dips.
const SHALLOW: f64 = 2.0;
/// Depth of one frame [cells].
const FRAME: f64 = 0.25;

/// A slab of clay and how deep the blade goes into its middle.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// Clay on either side of the blade [cells].
    wide: i32,
    /// Clay [cells].
    deep: i32,
    /// The blade's way [cells].
    way: f64,
    /// `rho V^2 / k` [-].
    inertia: f64,
}

/// Force over way.
#[derive(Clone, Debug, Default)]
struct Curve {
    /// Depth of the edge [cells] and force against the way in [k L dx], into the clay.
    press: Vec<[f64; 2]>,
    /// The same on the way out, deepest first.
    withdraw: Vec<[f64; 2]>,
}

impl Cut {
    fn new(size: Size) -> Self {
        size.pick(
            Self { wide: 6, deep: 12, way: 8.0, inertia: 0.016 },
            Self { wide: 6, deep: 12, way: 8.0, inertia: 0.016 },
            Self { wide: 16, deep: 28, way: 12.0, inertia: 0.002 },
        )
    }

    /// Presses the blade in and, if `returns`, takes it out.
    fn run(&self, contact: Contact, returns: bool) -> Curve {
        let material = ClayMaterial {
            young_modulus: 2.0 * RIGIDITY * STRENGTH * 1.3,
            poisson_ratio: 0.3,
            yield_stress: 3f64.sqrt() * STRENGTH,
            // What the edge takes is judged in `knife`.
            toughness: 0.0,
            ..Preset::SoftClay.material()
        };
        let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], high: [Wall::Slip; 3] };
        let domain = room_with([2 * self.wide, self.deep + 4, SLAB], walls);
        let clay = block(DVec3::ZERO, IVec3::new(2 * self.wide, self.deep, SLAB));
        let mut lab = Lab::new(&snapshot(domain, material, clay), stable_step(&material));
        lab.plan.volume_averaging = VOLUME_AVERAGING;
        // The flanks are open above: the blade's upper rim stays clear of the clay.
        let half_height = self.way / 2.0 + 2.0;
        let shape = ToolShape::Blade { half_width: f64::from(SLAB), half_height };
        let at = DVec3::new(f64::from(self.wide) + OFFSET, f64::from(self.deep) + half_height, f64::from(SLAB) / 2.0);
        let mut mover = Mover::new(&domain, shape, contact, at, DQuat::from_rotation_y(FRAC_PI_2));
        let speed = (self.inertia * STRENGTH / material.density).sqrt();
        let steps = (FRAME * DX / speed / lab.plan.dt).ceil() as u32;
        mover.velocity = DVec3::NEG_Y * FRAME * DX / (f64::from(steps) * lab.plan.dt);
        let unit = STRENGTH * f64::from(SLAB) * DX * DX;
        let frames = (self.way / FRAME).round() as u32;
        let mut curve = Curve::default();
        for frame in 0..frames {
            let force = lab.frame_moving(steps, &mut mover).tools[0].force.y;
            curve.press.push([(f64::from(frame) + 0.5) * FRAME, force / unit]);
        }
        mover.velocity = -mover.velocity;
        for frame in (0..if returns { frames } else { 0 }).rev() {
            let force = lab.frame_moving(steps, &mut mover).tools[0].force.y;
            curve.withdraw.push([(f64::from(frame) + 0.5) * FRAME, force / unit]);
        }
        curve
    }
}

/// Slope b of the least squares `F = a + b h^p`, and what is left of the squares.
fn fit(points: &[[f64; 2]], p: f64) -> (f64, f64) {
    let powers: Vec<[f64; 2]> = points.iter().map(|[h, force]| [h.powf(p), *force]).collect();
    let (a, b) = line(&powers);
    (b, powers.iter().map(|[x, force]| (force - a - b * x).powi(2)).sum())
}

/// The exponent p of the best `F = a + b h^p`.
fn exponent(points: &[[f64; 2]]) -> f64 {
    let candidates = (100..=2000).map(|i| f64::from(i) * 1e-3);
    candidates.min_by(|a, b| fit(points, *a).1.total_cmp(&fit(points, *b).1)).unwrap_or(f64::NAN)
}

/// Beside its edge, which parts this clay for nothing, its flanks bear the clay's shear strength:
/// `F = 2 alpha k L h`, alpha 1 where it sticks, 0 without friction. The law of the blade holds the traction
/// to k: what is judged is that it gets there, along the whole flank. Rigid and plastic clay holds it as much
/// on its way out.
pub fn force(size: Size) -> Vec<Row> {
    let cut = Cut::new(size);
    let counted = |curve: &Curve| -> Vec<[f64; 2]> { curve.press.iter().copied().filter(|p| p[0] > SHALLOW).collect() };
    let sticking = cut.run(Contact::Stick, true);
    let smooth = counted(&Cut { way: cut.way / 2.0, ..cut }.run(Contact::Separate { friction: 0.0 }, false));
    let rough = counted(&sticking);
    let area = |points: &[[f64; 2]]| points.iter().map(|p| p[1] * FRAME).sum::<f64>();
    let work = area(&sticking.press);
    vec![
        Row::at_most(
            "blade force: slope, sticking, traction held to k, off 2 k L by",
            (fit(&rough, 1.0).0 / 2.0 - 1.0).abs(),
            "relative",
            0.1,
        ),
        Row::at_most("blade force: slope, frictionless", (fit(&smooth, 1.0).0 / 2.0).abs(), "of 2 k L", 0.1),
        Row::at_most("blade force: exponent after the intercept, sticking, off 1 by", (exponent(&rough) - 1.0).abs(), "-", 0.05),
        Row::at_least("blade force: loop area over work, sticking", (work - area(&sticking.withdraw)) / work, "-", 0.9),
    ]
}
