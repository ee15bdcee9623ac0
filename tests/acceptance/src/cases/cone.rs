//! A cone pressed into clay: geometrically similar at every depth, so its force grows with the square of the
//! depth.

use crate::lab::{DX, Lab, Mover, Size, block, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};

/// Depths between which the exponent is fitted [cells].
const DEPTHS: (f64, f64) = (4.0, 12.0);

/// A quarter of a frictionless cone of 45 degrees between its axis and its slant, in a quarter of a block;
/// symmetry at all walls.
pub fn indentation(size: Size) -> Vec<Row> {
    if size != Size::Full {
        return vec![];
    }
    // Walls 3.3 greatest depths away, at 40 cells, raise the exponent to 2.07, whatever the cell: their
    // pressure grows with the cone.
    let clay = IVec3::new(56, 44, 56);
    let top = f64::from(clay.y);
    let domain = room_with([clay.x, clay.y + 8, clay.z], Walls { low: [Wall::Slip; 3], high: [Wall::Slip; 3] });
    let material = Preset::SoftClay.material();
    let mut lab = Lab::new(&snapshot(domain, material, block(DVec3::ZERO, clay)), stable_step(&material));
    let shape = ToolShape::Cone { radius: 20.0, half_height: 10.0 };
    let tip = |depth: f64| DVec3::Y * (top - depth + 10.0);
    let mut mover = Mover::new(&domain, shape, Contact::Separate { friction: 0.0 }, tip(-0.5), DQuat::IDENTITY);
    // rho V^2 / k = 0.0075: 3 % of the force, the same at every depth.
    let speed = (0.0075 * material.shear_strength() / material.density).sqrt();
    mover.velocity = DVec3::NEG_Y * speed;
    let frame = 0.25;
    let steps = (frame * DX / speed / lab.plan.dt).ceil() as u32;
    mover.velocity = DVec3::NEG_Y * frame * DX / (f64::from(steps) * lab.plan.dt);
    let mut points = vec![];
    let mut depth = -0.5;
    while depth < DEPTHS.1 {
        let report = lab.frame_moving(steps, &mut mover);
        let middle = depth + 0.5 * frame;
        depth += frame;
        if !report.health.is_ok() {
            points = vec![];
            break;
        }
        if middle > DEPTHS.0 {
            points.push((middle.ln(), report.tools[0].force.y.ln()));
        }
    }
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - x) * (p.1 - y), s.1 + (p.0 - x).powi(2)));
    vec![Row::at_most("cone: exponent of the force, off 2 by", (xy / xx - 2.0).abs(), "-", 0.05)]
}
