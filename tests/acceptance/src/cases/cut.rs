//! Kept cuts between two plates: what a closed cut carries, and what one that has grown together does.

use crate::lab::{DX, Lab, Size, block, elastic, jitter, place, room, snapshot, stable_step, world};
use crate::report::Row;
use bevy_clay::sim::cut::SheetSet;
use bevy_clay::sim::prelude::*;
use bevy_clay::sim::tool::CUT_FRICTION;
use glam::{DQuat, DVec3, IVec3};

/// Length of the block along x [cells].
const LENGTH: i32 = 12;
/// How far the plates stand in either end at the start [cells], so that they touch it.
const TOUCH: f64 = 1e-3;
/// Strain of the clay between the plates: elastic for every clay used here.
const STRAIN: f64 = 0.005;

/// A block of clay held by two plates that stick to its ends.
struct Press {
    lab: Lab,
    /// Positions of the plates' middles, in cells from the room's low corner.
    plates: [DVec3; 2],
    /// Where each particle was when it was loaded, by id.
    places: Vec<DVec3>,
    /// Sides of cuts that grew together so far.
    welded: u64,
}

/// Whether and how the block is cut.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// Where the plane passes the block's axis [cells from its middle].
    offset: f64,
    /// Normal of the plane.
    normal: DVec3,
}

impl Cut {
    /// Where the plane passes the block's axis [cells from the room's low corner].
    fn middle(&self) -> DVec3 {
        DVec3::new(4.0 + 0.5 * f64::from(LENGTH) + self.offset, 8.0, 8.0)
    }
}

/// Normal of the least-squares plane through points near one with the normal `near`.
fn best_normal(points: &[DVec3], near: DVec3) -> DVec3 {
    let middle = points.iter().sum::<DVec3>() / points.len() as f64;
    let (u, v) = near.any_orthonormal_pair();
    // Height over the plane as a linear function of the places on it: the lattice is symmetric enough for
    // sums without cross terms to be a start, and a few steps of Gauss-Seidel for the rest.
    let (mut a, mut b) = (0.0, 0.0);
    for _ in 0..50 {
        let rest = |p: &DVec3| (*p - middle).dot(near) - a * (*p - middle).dot(u) - b * (*p - middle).dot(v);
        let slope = |d: DVec3| {
            let (top, low) = points.iter().fold((0.0, 0.0), |(top, low), p| {
                let x = (*p - middle).dot(d);
                (top + x * rest(p), low + x * x)
            });
            top / low
        };
        let (da, db) = (slope(u), slope(v));
        (a, b) = (a + 0.5 * da, b + 0.5 * db);
    }
    (near - a * u - b * v).normalize()
}

impl Press {
    /// A block that is whole, or cut and closed.
    fn new(material: ClayMaterial, cut: Option<Cut>, seed: u64) -> Self {
        Self::open(material, cut, 0.0, seed)
    }

    /// A block whose halves are `gap` cells apart along it.
    fn open(material: ClayMaterial, cut: Option<Cut>, gap: f64, seed: u64) -> Self {
        Self::parted(material, cut, gap, true, seed)
    }

    /// The same; its halves never were one, unless `is_cut`.
    fn parted(material: ClayMaterial, cut: Option<Cut>, gap: f64, is_cut: bool, seed: u64) -> Self {
        let domain = room([LENGTH + 8, 16, 16], Wall::Separate);
        let mut particles = block(DVec3::splat(4.0), IVec3::new(LENGTH, 8, 8));
        // As clay is filled: a lattice of half a cell, jittered by a quarter of that.
        let even: Vec<f64> = particles.iter().map(|p| place(p).x).collect();
        jitter(&mut particles, 0.125, seed);
        // The outermost layers are even, and touch the plates as one.
        let ends = [4.25, 3.75 + f64::from(LENGTH)];
        for (p, x) in particles.iter_mut().zip(even).filter(|(_, x)| ends.contains(x)) {
            p.set_grid(p.grid() + DVec3::X * (x - place(p).x));
        }
        if let Some(cut) = cut {
            for p in &mut particles {
                let distance = (place(p) - cut.middle()).dot(cut.normal);
                if is_cut && distance.abs() < 2.0 {
                    p.tags[0] = Tag { sheet: 1, side: if distance < 0.0 { -1 } else { 1 } };
                }
                if distance >= 0.0 {
                    p.set_grid(p.grid() + gap * DVec3::X);
                }
            }
        }
        let places = particles.iter().map(place).collect();
        let mut clay = snapshot(domain, material, particles);
        if !is_cut {
            clay.find_bodies(SheetSet::default());
        }
        let mut lab = Lab::new(&clay, stable_step(&material));
        // Two thirds of critical for the slowest wave along the block.
        lab.plan.validation.damping = material.wave_speed(material.density) / (f64::from(LENGTH) * DX) * 4.0;
        let plate = |end: f64, out: f64| DVec3::new(end + out * (3.0 - TOUCH), 8.0, 8.0);
        Self { lab, plates: [plate(4.0, -1.0), plate(4.0 + f64::from(LENGTH) + gap, 1.0)], places, welded: 0 }
    }

    /// Moves the second plate by `way` [cells] in `steps` substeps, waits as long, and returns the force on
    /// it [N].
    fn moved(&mut self, way: DVec3, steps: u32) -> DVec3 {
        let shape = ToolShape::Box { half_size: DVec3::new(3.0, 6.0, 6.0) };
        let tool = Tool { shape: shape.scaled(DX), contact: Contact::Stick };
        let domain = room([LENGTH + 8, 16, 16], Wall::Separate);
        let pose = |at: DVec3| Pose { position: world(&domain, at), rotation: DQuat::IDENTITY };
        let still = ToolPath::still(1, tool, pose(self.plates[0]));
        let from = self.plates[1];
        self.plates[1] += way;
        let sample = |time, at| PoseSample { time, pose: pose(at) };
        let samples = vec![sample(0.0, from), sample(self.lab.plan.dt * f64::from(steps), self.plates[1])];
        let path = ToolPath { id: 2, tool, sheet: 0, samples };
        self.run(steps, &[still.clone(), path]);
        let held = ToolPath::still(2, tool, pose(self.plates[1]));
        self.run(steps, &[still.clone(), held.clone()]);
        self.run(20, &[still, held]).tools[1].force
    }

    /// Normal of the cut as it is now: of the best planes through the particles that were beside it.
    fn normal(&self, cut: &Cut) -> DVec3 {
        let particles = self.lab.particles();
        let of_side = |side: i8| {
            let is_beside = |at: &DVec3| (0.0..0.5).contains(&((*at - cut.middle()).dot(cut.normal) * f64::from(side)));
            let points = self.places.iter().zip(&particles).filter(|(at, _)| is_beside(at)).map(|(_, p)| place(p));
            best_normal(&points.collect::<Vec<_>>(), cut.normal)
        };
        (of_side(1) + of_side(-1)).normalize()
    }

    fn run(&mut self, steps: u32, tools: &[ToolPath]) -> FrameReport {
        let report = self.lab.frame_with(steps, tools);
        self.welded += report.welded;
        report
    }

    /// Waits for `time` [s], in frames of `steps`, with the plates where they are.
    fn wait(&mut self, time: f64, steps: u32) {
        let tools = self.lab.plan.tools.clone();
        for _ in 0..(time / self.lab.plan.dt / f64::from(steps)).ceil() as u32 {
            self.run(steps, &tools);
        }
    }
}

/// Travel of a plate [cells] for the strain of the cases.
fn travel() -> f64 {
    STRAIN * f64::from(LENGTH)
}

/// Planes through the block: upright and tilted by up to 10 degrees (friction holds them to 26), at and
/// between nodes.
fn cuts(size: Size) -> Vec<Cut> {
    let all = [(0.25, 0.17, 0.0), (0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.1, -0.1, 0.12), (0.37, 0.0, -0.17)];
    let count = size.pick(1, 1, 5);
    all.into_iter().take(count).map(|(offset, y, z)| Cut { offset, normal: DVec3::new(1.0, y, z).normalize() }).collect()
}

/// A cut that was never open carries small compression as whole clay does, no tension, and shear up to
/// friction. Nothing is said of one that opened and is closed again.
pub fn closed(size: Size) -> Vec<Row> {
    let steps = size.pick(200, 200, 600);
    let material = elastic(0.3);
    let (mut compression, mut tension, mut shear, mut whole_shear) = (0.0f64, 0.0f64, 0.0f64, f64::INFINITY);
    for (seed, cut) in cuts(size).into_iter().enumerate() {
        let press = |cut| Press::new(material, cut, seed as u64);
        let pressed = [None, Some(cut)].map(|cut| press(cut).moved(-DVec3::X * travel(), steps).x);
        let pulled = [None, Some(cut)].map(|cut| press(cut).moved(DVec3::X * travel(), steps).x);
        compression = compression.max((pressed[1] / pressed[0] - 1.0).abs());
        tension = tension.max((pulled[1] / pulled[0]).abs());
        // Pressed, then moved along the plane by three times what whole clay would bear with that friction.
        let sheared = [None, Some(cut)].map(|cut| {
            let mut press = press(cut);
            press.moved(-DVec3::X * travel(), steps);
            let normal = cut.map_or(DVec3::X, |cut: Cut| cut.normal);
            let along = DVec3::Y - normal * normal.y;
            let force = press.moved(along * 6.0 * travel(), 2 * steps);
            // The clay between the plates turns a little as it is sheared, and the plane with it.
            let normal = cut.map_or(DVec3::X, |cut| press.normal(&cut));
            let across = force.dot(normal);
            (force - across * normal).length() / (CUT_FRICTION * across.abs())
        });
        whole_shear = whole_shear.min(sheared[0]);
        shear = shear.max(sheared[1]);
    }
    let count = cuts(size).len();
    let name = |what: &str| format!("cut closed from the start, 0.5 % strain, {count} planes: {what}");
    vec![
        Row::at_most(name("compression off that of whole clay"), 100.0 * compression, "%", 5.0),
        Row::at_most(name("tension, of that of whole clay"), 100.0 * tension, "%", 1.0),
        Row::at_most(name("shear over friction times compression"), shear, "-", 1.0),
        Row::at_least(name("the same of whole clay, moved as far"), whole_shear, "-", 1.5),
    ]
}

/// Halves of a block that plates bring together and part again.
struct Closing {
    /// Greatest force until their faces are within a tenth of a cell, and greatest tension as they part [k].
    early: f64,
    tension: f64,
    /// Force off that of whole clay that is pressed as far from there [-].
    off: f64,
}

/// How far apart the halves are at first, and how far whole clay is pressed [cells].
const WAYS: [f64; 2] = [1.3, 0.5];

fn closing(cut: Cut, is_cut: bool, seed: u64) -> Closing {
    const STEP: f64 = 0.1;
    let steps = 60;
    let material = ClayMaterial { weld: Weld::Off, poisson_ratio: 0.3, ..Preset::SoftClay.material() };
    let strength = material.shear_strength() * 64.0 * DX * DX;
    let gap = WAYS[0] / cut.normal.x;
    let mut press = Press::parted(material, Some(cut), gap, is_cut, seed);
    let (mut left, mut early, mut tension) = (WAYS[0], 0.0f64, 0.0f64);
    while left > 0.1 + 0.5 * STEP {
        left -= STEP;
        early = early.max(press.moved(-DVec3::X * STEP / cut.normal.x, steps).x / strength);
    }
    let mut whole = Press::new(material, None, seed);
    press.moved(-DVec3::X * left / cut.normal.x, steps);
    let count = (WAYS[1] / STEP).round() as u32;
    let pressed = [&mut press, &mut whole].map(|press| {
        let forces = (0..count).map(|_| press.moved(-DVec3::X * STEP, steps).x);
        forces.last().unwrap_or_default()
    });
    for _ in 0..2 * count {
        tension = tension.max(-press.moved(DVec3::X * STEP, steps).x / strength);
    }
    Closing { early, tension, off: (pressed[0] / pressed[1] - 1.0).abs() }
}

fn closing_rows(size: Size, what: &str, is_cut: bool) -> Vec<Row> {
    let all: Vec<Closing> = (0..).zip(cuts(size)).map(|(seed, cut)| closing(cut, is_cut, seed)).collect();
    let most = |of: fn(&Closing) -> f64| all.iter().map(of).fold(0.0, f64::max);
    let name = |row: &str| format!("{what} {} cells apart that plates close, {} planes: {row}", WAYS[0], all.len());
    vec![
        Row::at_most(name("force until faces are within 0.1 cells"), most(|c| c.early), "k", 0.01),
        Row::at_most(name("force off that of whole clay pressed as far"), 100.0 * most(|c| c.off), "%", 5.0),
        Row::at_most(name("tension as they part"), most(|c| c.tension), "k", 0.01),
    ]
}

/// An open cut that plates close: its sides bear nothing until their faces are within a tenth of a cell, and
/// then as much as whole clay that is pressed as far from there.
pub fn opened(size: Size) -> Vec<Row> {
    closing_rows(size, "sides of a cut", true)
}

/// The same of bodies that never were one.
pub fn bodies(size: Size) -> Vec<Row> {
    closing_rows(size, "bodies", false)
}

/// Sides that have grown together when a cut has been pressed at 0.76 k for half of the 0.3 s that it takes,
/// most of them in frames of half a millisecond.
fn welded_early(cut: Cut, seed: u64) -> u64 {
    const STEPS: u32 = 400;
    const HALF: f64 = 0.15;
    let material = ClayMaterial { weld: Weld::Pressed, poisson_ratio: 0.3, ..Preset::SoftClay.material() };
    let mut press = Press::new(material, Some(cut), seed);
    press.moved(-DVec3::X * 1.6 * travel(), STEPS);
    let dt = press.lab.plan.dt;
    let frame = (5e-4 / dt).floor().max(1.0);
    press.wait(HALF - f64::from(2 * STEPS + 20) * dt - frame * dt, frame as u32);
    press.welded
}

/// A cut that is pressed at 0.76 k for as long as it takes is whole clay again; one that may not grow
/// together is not.
pub fn welded(size: Size) -> Vec<Row> {
    let steps = size.pick(400, 400, 600);
    // What grows together almost at a touch takes a sixth of the time.
    let (rule, time) = size.pick((Weld::Sticky, 0.055), (Weld::Sticky, 0.055), (Weld::Pressed, 0.32));
    let (mut tension, mut shear, mut never, mut left) = (0.0f64, 0.0f64, 0.0f64, 0u64);
    let mut early = 0;
    for (seed, cut) in cuts(size).into_iter().take(size.pick(1, 1, 3)).enumerate() {
        let press = |cut: Option<Cut>, weld: Weld| {
            let material = ClayMaterial { weld, poisson_ratio: 0.3, ..Preset::SoftClay.material() };
            let mut press = Press::new(material, cut, seed as u64);
            press.moved(-DVec3::X * 1.6 * travel(), steps);
            press.wait(time, 100);
            let pulled = press.moved(DVec3::X * 2.6 * travel(), steps).x;
            let sheared = press.moved(DVec3::Y * 2.0 * travel(), steps).y;
            (pulled, sheared, press.welded)
        };
        let whole = press(None, rule);
        let healed = press(Some(cut), rule);
        let kept = press(Some(cut), Weld::Off);
        tension = tension.max((healed.0 / whole.0 - 1.0).abs());
        shear = shear.max((healed.1 / whole.1 - 1.0).abs());
        never = never.max((kept.0 / whole.0).abs());
        early += welded_early(cut, seed as u64);
        left += u64::from(healed.2 == 0) + kept.2;
    }
    vec![
        Row::at_most("welded cut: tension off that of whole clay", 100.0 * tension, "%", 10.0),
        Row::at_most("welded cut: shear off that of whole clay", 100.0 * shear, "%", 10.0),
        Row::at_most("cut that never grows together: tension, of that of whole clay", 100.0 * never, "%", 1.0),
        Row::at_most("sides that grew together after half the time, in frames of 0.5 ms", early as f64, "sides", 0.0),
        Row::at_most("cuts that grew together and should not have, or the other way round", left as f64, "runs", 0.0),
    ]
}
