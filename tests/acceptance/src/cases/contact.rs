//! Tools and walls: Newton's third law frame by frame, a floor that lets go, where clay stops at a tool.

use crate::lab::{
    self, Lab, Mover, Size, block, elastic, place, room, room_with, set_velocity, snapshot, stable_step, velocity, wave_step,
};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};

/// The kinds of tool, in cells, with a name, a place over the block of `momentum` and a way of moving.
fn tools() -> [(&'static str, ToolShape, DVec3, DQuat, DVec3); 4] {
    let tilt = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.2, 1.4);
    let press = DVec3::new(-0.4, -1.0, -0.3);
    [
        ("sphere", ToolShape::Sphere { radius: 3.0 }, DVec3::new(5.0, 9.5, 5.0), DQuat::IDENTITY, press),
        ("capsule", ToolShape::Capsule { radius: 2.0, half_length: 3.0 }, DVec3::new(5.0, 8.5, 5.0), tilt, press),
        ("box", ToolShape::Box { half_size: DVec3::new(2.0, 3.0, 2.0) }, DVec3::new(5.0, 8.5, 5.0), tilt, press),
        (
            "blade",
            ToolShape::Blade { half_width: 4.0, half_height: 5.0 },
            DVec3::new(5.0, 8.0, 5.0),
            DQuat::from_euler(glam::EulerRot::XYZ, 0.2, 1.2, 0.1),
            DVec3::new(-1.0, -0.5, -0.3),
        ),
    ]
}

/// Scale of inertia from frame to frame, over and over: up and down, by little and by much.
const SCALES: [f64; 6] = [1.0, 16.0, 64.0, 4.0, 1.0, 64.0];

/// What the books of momentum are off by.
#[derive(Default)]
struct MomentumBooks {
    /// Greatest error of a frame, relative.
    frame: f64,
    /// Error of the whole run, relative, with the clay's momentum added up from its particles.
    run: f64,
    /// What changes of scale gave and took [kg m/s], of all impulses.
    rescaled: f64,
    /// Greatest error of the nodes' mass, relative.
    mass: f64,
    contacts: u64,
}

/// A tool goes through a block on a stick floor, beside a slip and a separating wall, while inertia is scaled
/// otherwise in each frame.
fn momentum_books(frames: usize, shape: ToolShape, contact: Contact, [at, way]: [DVec3; 2], rotation: DQuat) -> MomentumBooks {
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Separate], high: [Wall::Slip; 3] };
    let domain = room_with([16, 16, 16], walls);
    let clay = snapshot(domain, Preset::SoftClay.material(), block(DVec3::ZERO, IVec3::new(9, 7, 9)));
    let dt = stable_step(&clay.material);
    let mut lab = Lab::new(&clay, dt);
    lab.plan.gravity = DVec3::new(0.0, -9.81, 0.0);
    let mut mover = Mover::new(&domain, shape, contact, at, rotation);
    // 0.03 cells in the longest substep.
    mover.velocity = way * 0.00375 * domain.cell_width / dt;
    let mut found = MomentumBooks::default();
    let (mut momentum, mut scale, mut rescaled) = (DVec3::ZERO, 0.0, 0.0);
    // Implicit steps know no other density.
    let scales: &[f64] = if lab::is_implicit() { &[1.0] } else { &SCALES };
    for &density_scale in scales.iter().cycle().take(frames) {
        lab.plan.integrator = Integrator::Explicit { density_scale };
        lab.plan.dt = dt * density_scale.sqrt();
        let report = lab.frame_moving(20, &mut mover);
        found.frame = found.frame.max(report.balance_error());
        found.mass = found.mass.max((report.grid_mass / report.particle_mass - 1.0).abs());
        found.contacts += report.tools[0].contacts;
        momentum += report.gravity_impulse + report.wall_impulse - report.tools[0].impulse + report.rescaled_momentum;
        momentum += report.unbalanced_impulse;
        scale += report.impulse_scale;
        rescaled += report.rescaled_momentum.length();
    }
    let of = |p: &Particle| velocity(p) * f64::from(p.rest_volume);
    let density = clay.material.density * lab.plan.density_scale();
    let clay: DVec3 = density * lab.particles().iter().map(of).sum::<DVec3>();
    (found.run, found.rescaled) = ((clay - momentum).length() / scale, rescaled / scale);
    found
}

/// Each tool with each contact.
pub fn momentum(size: Size) -> Vec<Row> {
    let contacts = [("stick", Contact::Stick), ("slip", Contact::Slip), ("separate", Contact::Separate { friction: 0.3 })];
    // Rounding. Native: nodes at tools and walls are worked out in f64. GPU: all is f32, with node sums in
    // fixed point of 31 bits for the greatest sum the frame admits: 1e-6 a substep, and 1e-5 for a frame
    // whose errors all lean one way.
    let limit = if lab::is_gpu() { 1e-5 } else { 1e-6 };
    let mut rows = vec![];
    let (mut run, mut rescaled, mut mass) = (0.0f64, f64::INFINITY, 0.0f64);
    for (shape_name, shape, at, rotation, way) in tools() {
        for (contact_name, contact) in contacts {
            // Twice as many drive the box into the floor, until frames are given up.
            let books = momentum_books(size.pick(6, 12, 12), shape, contact, [at, way], rotation);
            // A tool that touched nothing proves nothing.
            let value = if books.contacts > 0 { books.frame } else { f64::NAN };
            rows.push(Row::at_most(format!("momentum: {shape_name}, {contact_name}: of a frame"), value, "relative", limit));
            (run, rescaled, mass) = (run.max(books.run), rescaled.min(books.rescaled), mass.max(books.mass));
        }
    }
    // Nor does inertia that took or gave nothing.
    let run = if rescaled > 1e-3 || lab::is_implicit() { run } else { f64::NAN };
    rows.push(Row::at_most("momentum: all tools: over frames and changes of inertia", run, "relative", limit));
    rows.push(Row::at_most("momentum: grid mass over particle mass - 1", mass, "relative", 1e-7));
    rows
}

/// A block that stands on a separating floor is tossed up; another falls on it and bounces.
pub fn separating_floor(_: Size) -> Vec<Row> {
    let domain = room([12, 20, 12], Wall::Separate);
    let material = elastic(0.3);
    let toss = |bottom: f64, speed: f64| {
        let mut particles = block(DVec3::new(3.0, bottom, 3.0), IVec3::splat(6));
        particles.iter_mut().for_each(|p| set_velocity(p, DVec3::Y * speed));
        let mut lab = Lab::new(&snapshot(domain, material, particles), wave_step(&material, 0.4));
        let (mut pull, mut push, mut momentum) = (0.0, 0.0, 0.0);
        for _ in 0..400 {
            let report = lab.frame(1);
            pull += (-report.wall_impulse.y).max(0.0);
            push += report.wall_impulse.y.max(0.0);
            momentum = report.momentum.y;
        }
        let lowest = lab.particles().iter().map(|p| place(p).y).fold(f64::INFINITY, f64::min);
        let mass = 6.0 * 36.0 * domain.cell_width.powi(3) * material.density;
        (pull / (mass * speed.abs()), push / (mass * speed.abs()), momentum / (mass * speed.abs()), lowest)
    };
    let speed = 0.02 * material.wave_speed(material.density);
    let (up_pull, _, up_momentum, up_lowest) = toss(0.0, speed);
    let (fall_pull, fall_push, _, fall_lowest) = toss(1.5, -speed);
    vec![
        Row::at_most("separating floor: pull on a tossed block", up_pull, "of m v", 1e-3),
        Row::at_most("separating floor: momentum lost by a tossed block", (up_momentum - 1.0).abs(), "of m v", 1e-3),
        // 400 substeps at 0.008 cells.
        Row::at_least("separating floor: height of a tossed block", up_lowest, "cells", 3.0),
        Row::at_most("separating floor: pull on a bouncing block", fall_pull, "of m v", 1e-3),
        Row::at_least("separating floor: push on a bouncing block", fall_push, "of m v", 1.0),
        Row::at_least("separating floor: height after the bounce", fall_lowest, "cells", 0.25),
    ]
}

/// A ball and a box face are pressed slowly into clay: how far the clay's outer faces, a quarter cell beyond
/// its top particles, stay from the drawn surface.
pub fn tool_offset(size: Size) -> Vec<Row> {
    let cells = size.pick(16, 20, 28);
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], high: [Wall::Slip; 3] };
    let domain = room_with([cells, 20, cells], walls);
    let material = Preset::SoftClay.material();
    let middle = f64::from(cells) / 2.0;
    let depth = 2.0;
    // The tool comes from where it cannot touch yet: else clay that is held off too far would only keep its
    // first distance.
    const CLEAR: f64 = 2.0;
    let press = |shape: ToolShape, reach: f64| {
        let particles = block(DVec3::ZERO, IVec3::new(cells, 10, cells));
        let mut lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
        let start = lab.particles();
        let mut mover =
            Mover::new(&domain, shape, Contact::default(), DVec3::new(middle, 10.0 + CLEAR + reach, middle), DQuat::IDENTITY);
        let per_step = size.pick(0.01, 0.005, 0.0025);
        mover.velocity = DVec3::NEG_Y * per_step * domain.cell_width / lab.plan.dt;
        for _ in 0..20 {
            lab.frame_moving(((CLEAR + depth) / per_step / 20.0) as u32, &mut mover);
        }
        // The top layer under the tool: within 2 cells of its axis when it started.
        let is_seen = |p: &Particle| place(p).y > 9.5 && (place(p).x - middle).hypot(place(p).z - middle) < 2.0;
        let gap = |p: &Particle| {
            let to_world = domain.to_world(p.grid());
            mover.tool.shape.distance(mover.pose.to_local(to_world)) / domain.cell_width
        };
        let gaps: Vec<f64> = start.iter().zip(lab.particles()).filter(|(a, _)| is_seen(a)).map(|(_, b)| gap(&b) - 0.25).collect();
        gaps.iter().sum::<f64>() / gaps.len() as f64
    };
    let ball = press(ToolShape::Sphere { radius: 5.0 }, 5.0);
    let face = press(ToolShape::Box { half_size: DVec3::new(4.0, 4.0, 4.0) }, 4.0);
    vec![offset_row("ball", ball), offset_row("box face", face)]
}

fn offset_row(name: &str, offset: f64) -> Row {
    // The sign is told in the name: clay that stays away from the tool, or that stands in it.
    let side = if offset >= 0.0 { "clay stops before it" } else { "clay stands in it" };
    Row::at_most(format!("tool offset: {name} ({side})"), offset.abs(), "cells", 0.5)
}
