//! The law as published fails as it is known to, and the law by default does not: dust that falls freely, and
//! energy from nothing.

use crate::cases::collapse::{Collapse, Touch};
use crate::lab::Size;
use crate::report::Row;
use bevy_clay::sim::prelude::*;

/// What became of the block.
struct Outcome {
    /// Drop of the corners at 0.2 s [m].
    drop: f64,
    /// Greatest total energy over the first.
    growth: f64,
}

/// The clay of the reference computation, with softening length `tau` [cells] of `cell_width`.
fn clay(law: ClayLaw, tau: f64, cell_width: f64) -> ClayMaterial {
    ClayMaterial {
        density: 1000.0,
        young_modulus: 1e5,
        poisson_ratio: 0.1,
        softening_length: tau * cell_width,
        law,
        ..ClayMaterial::default()
    }
}

/// `frames` of 0.02 s, the first 15 with the tool at the top, the others with it at mid-height.
fn run(material: ClayMaterial, cells_per_metre: i32, frames: u32) -> Outcome {
    let dx = 1.0 / f64::from(cells_per_metre);
    let steps = (0.02 / (0.3 * dx / material.wave_speed(material.density))).ceil();
    let mut block = Collapse::new(material, cells_per_metre, 0.02 / steps, Touch::Wire, 0);
    let start = block.lab.particles();
    let mut outcome = Outcome { drop: f64::NAN, growth: f64::NAN };
    let mut first = f64::NAN;
    for frame in 1..=frames {
        let report = block.frame(steps as u32, 0.0);
        let particles = block.lab.particles();
        let energy = block.energy(&report, &particles);
        first = if first.is_nan() { energy } else { first };
        outcome.growth = outcome.growth.max(energy / first);
        match frame {
            10 => outcome.drop = block.corner_drop(&start, &particles),
            15 => block.jump((block.height / 2.0).floor() + 0.5),
            _ => {}
        }
    }
    outcome
}

/// Stress multiplied by zeta of Eq. 5 to the letter, against yield stress blended by it.
pub fn published(size: Size) -> Vec<Row> {
    let cells = size.pick(32, 48, 64);
    let dx = 1.0 / f64::from(cells);
    let fall = 9.81 * 0.2 * 0.2 / 2.0;
    let dust = run(clay(ClayLaw::AsPublished, 0.3, dx), cells, 10);
    let frames = size.pick(30, 22, 30);
    let blend = ClayMaterial { poisson_ratio: 0.45, yield_stress: 1e4, softening: 0.8, ..clay(ClayLaw::Softened, 3.0, dx) };
    let sound = run(blend, cells, frames);
    let mut rows = vec![
        Row::at_most("as published, tau 0.3 cells: corners fall freely", 100.0 * (dust.drop / fall - 1.0).abs(), "%", 1.0),
        Row::at_most("softened, tau 3 cells: energy after the tool's jump", sound.growth, "x", 1.001),
        Row::at_most("softened, tau 3 cells: drop of the corners", sound.drop, "m", 0.02),
    ];
    // At 32 cells per metre the tool's 3 cells hold up so much of the block that hardly any of it falls: 1.2
    // x.
    if size != Size::Test {
        let bomb = run(clay(ClayLaw::AsPublished, 3.0, dx), cells, frames);
        rows.push(Row::at_least("as published, tau 3 cells: energy after the tool's jump", bomb.growth, "x", 4.0));
    }
    rows
}
