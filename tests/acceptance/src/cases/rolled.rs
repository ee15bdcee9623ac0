//! Cuts in clay that is pressed flat: they stay what they are, and end where they did.

use crate::lab::{DX, Lab, Mover, Size, block, jitter, place, room, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};

/// The block [cells]: one that stands, with room to become a flat one.
const BLOCK: IVec3 = IVec3::new(8, 12, 8);
const ROOM: [i32; 3] = [32, 24, 32];
/// The block's middle [cells].
const MIDDLE: DVec3 = DVec3::new(16.0, 12.0, 16.0);
/// Speed of a plate [m/s]: a hundredth of the clay's speed of sound.
const PRESS_SPEED: f64 = 0.4;
/// Acceleration of what pulls the halves apart [m/s^2]: 10 g.
const PULL: f64 = 98.1;
/// Substeps of a frame.
const STEPS: u32 = 20;

/// A block in mid air between two plates that it sticks to, with the sides of a level cut.
struct Rolled {
    lab: Lab,
    /// The lower and the upper one.
    plates: [Mover; 2],
    /// Where each particle stood from the block's middle before anything moved, by id [cells].
    places: Vec<DVec3>,
    /// Sides carried on.
    carried: u64,
}

impl Rolled {
    /// A block with the sides of a cut where `is_cut` says.
    fn new(is_cut: impl Fn(DVec3) -> bool) -> Self {
        let domain = room(ROOM, Wall::Separate);
        let mut particles = block(MIDDLE - BLOCK.as_dvec3() / 2.0, BLOCK);
        jitter(&mut particles, 0.1, 3);
        let places: Vec<DVec3> = particles.iter().map(|p| place(p) - MIDDLE).collect();
        // As a blade tags: as far as splines reach.
        let near = places.iter().zip(&mut particles).filter(|(at, _)| at.y.abs() < 1.6 && is_cut(**at));
        near.for_each(|(at, p)| p.tags[0] = Tag { sheet: 1, side: if at.y < 0.0 { -1 } else { 1 } });
        // It sticks to the plates with three times what the pull takes.
        let strength = ClayMaterial { yield_stress: 30e3, young_modulus: 1.65e6, ..Preset::SoftClay.material() };
        let material = ClayMaterial { weld: Weld::Off, ..strength };
        let lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
        let plate = |side: f64| {
            let shape = ToolShape::Box { half_size: DVec3::new(15.0, 2.0, 15.0) };
            let at = MIDDLE + DVec3::Y * side * (0.5 * f64::from(BLOCK.y) + 2.0);
            Mover { id: if side < 0.0 { 1 } else { 2 }, ..Mover::new(&domain, shape, Contact::Stick, at, DQuat::IDENTITY) }
        };
        Self { lab, plates: [plate(-1.0), plate(1.0)], places, carried: 0 }
    }

    /// A frame in which the plates part at these speeds [m/s].
    fn frame(&mut self, [lower, upper]: [f64; 2]) -> FrameReport {
        let duration = self.lab.plan.dt * f64::from(STEPS);
        (self.plates[0].velocity, self.plates[1].velocity) = (DVec3::NEG_Y * lower, DVec3::Y * upper);
        let paths = self.plates.each_mut().map(|plate| plate.path(duration));
        let report = self.lab.frame_with(STEPS, &paths);
        self.carried += report.carried;
        report
    }

    fn frames(&self, time: f64) -> u32 {
        (time / self.lab.plan.dt / f64::from(STEPS)).ceil() as u32
    }

    /// Presses it to `share` of its height and holds it.
    fn press(&mut self, share: f64) {
        let way = 0.5 * (1.0 - share) * f64::from(BLOCK.y) * DX;
        (0..self.frames(way / PRESS_SPEED)).for_each(|_| _ = self.frame([-PRESS_SPEED; 2]));
        (0..self.frames(5e-3)).for_each(|_| _ = self.frame([0.0; 2]));
    }

    /// Pulls the upper plate off, by three quarters of a cell from where the plates bear nothing any more;
    /// how much of that way opens between the clay over the cut and under it [-].
    fn pull(&mut self) -> f64 {
        let duration = self.lab.plan.dt * f64::from(STEPS);
        while self.frame([0.0, 0.02]).tools[0].force.y < 0.0 {}
        let before = self.apart();
        let (mut speed, mut way) = (0.0, 0.0);
        while way < 0.75 * DX {
            speed += PULL * duration;
            way += speed * duration;
            _ = self.frame([0.0, speed]);
        }
        (self.apart() - before) * DX / way
    }

    /// Mean height of the half of a cell over the cut over that of the half under it [cells].
    fn apart(&self) -> f64 {
        let particles = self.lab.particles();
        let mean = |side: f64| {
            let is_beside = |at: &DVec3| (0.0..0.5).contains(&(side * at.y));
            let heights = self.places.iter().zip(&particles).filter(|(at, _)| is_beside(at)).map(|(_, p)| place(p).y);
            let heights: Vec<f64> = heights.collect();
            heights.iter().sum::<f64>() / heights.len() as f64
        };
        mean(1.0) - mean(-1.0)
    }
}

/// Level cuts through the middle of a block that is pressed flat, down to a quarter of its height, though
/// healing is off and what was tagged is by then a fraction of a cell thick: its halves come apart.
pub(super) fn rolled(size: Size) -> Vec<Row> {
    let shares = size.pick(&[0.4][..], &[0.25], &[0.67, 0.4, 0.3, 0.25]);
    let opened = |is_cut: bool, share: f64| {
        let mut block = Rolled::new(|_| is_cut);
        block.press(share);
        block.pull()
    };
    let row = |share: &f64| {
        let name = format!("cut block pressed to {share} of its height, pulled at 10 g: way that opens at the cut");
        Row::at_least(name, 100.0 * opened(true, *share), "%", 95.0)
    };
    let whole =
        |share: f64| Row::at_most(format!("the same block whole, pressed to {share}"), 100.0 * opened(false, share), "%", 50.0);
    let whole = size.pick(None, None, Some(0.4)).map(whole);
    shares.iter().map(row).chain(whole).collect()
}

/// A cut that ends in the middle of the block ends there when it has been pressed flat: no side is carried
/// past its front but into what came to lie over or under the cut.
pub(super) fn ended(size: Size) -> Vec<Row> {
    let mut block = Rolled::new(|at| at.x < 0.0);
    block.press(size.pick(0.4, 0.4, 0.25));
    let particles = block.lab.particles();
    let has_side = |p: &Particle| p.tags.iter().any(|tag| tag.side != 0);
    let tagged = || block.places.iter().zip(&particles).filter(|(_, p)| has_side(p)).map(|(at, _)| at);
    // Of what a blade would have tagged there.
    let past = tagged().filter(|at| at.x > 0.5 && at.y.abs() < 1.6).count();
    vec![
        Row::at_least("cut that ends in a block pressed flat: sides carried on", block.carried as f64, "", 500.0),
        Row::at_most(
            "cut that ends in a block pressed flat: particles beside its plane with a side half a cell past its front",
            past as f64,
            "",
            0.0,
        ),
    ]
}
