//! An engine against the f64 oracle: same snapshot, same plan, particle by particle. The cases that every
//! engine has to pass.

mod bodies;
mod flank;
mod implicit;
mod press;
mod weld;

pub use bodies::{bodies, found_bodies};
pub use flank::{worked_flanks, worked_flanks_in_implicit_steps};
pub use implicit::{fallen, implicit_blades, implicit_cuts, implicit_steps, lost, withdrawn};
pub use press::{
    assert_anchors_end_where_the_touch_does, assert_sides_end_where_the_plate_does, found_tools, solid_tools, thin_plates,
    tools_in_a_corner, walls_in_a_corner,
};
pub use weld::{left_pressed, welding};

use bevy_clay::prelude::*;
use bevy_clay::sim::oracle::Oracle;
use bevy_clay::sim::penalty::{NORMAL_STIFFNESS, STICK_FRICTION, TANGENTIAL_STIFFNESS};
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec2, DVec3, IVec3};
use std::f64::consts::PI;

/// Cell width \[m\].
pub const CELL: f64 = 0.01;

/// Clay and the frame that it goes through.
pub struct Case {
    /// The clay at the frame's start.
    pub snapshot: Snapshot,
    /// The frame.
    pub plan: FramePlan,
}

/// A case and how close an engine has to come after its 20 substeps, in cells, strains and substeps. f32
/// rounds positions to 3e-8 cells and strains to 3e-8 of themselves in every substep; the figures seen are a
/// third to a half of the limits.
pub struct Agreement {
    /// What is told where an engine comes no closer.
    pub name: String,
    /// The case.
    pub case: Case,
    /// Of positions \[cells\] and velocities [cells/substep]; three times that of affine velocities.
    pub position: f64,
    /// Of elastic strains [-].
    pub strain: f64,
    /// Particles that have to take a side.
    pub tagged: u64,
}

fn agreement(name: impl Into<String>, snapshot: Snapshot, plan: FramePlan) -> Agreement {
    Agreement { name: name.into(), case: Case { snapshot, plan }, position: 1e-6, strain: 3e-6, tagged: 0 }
}

/// At cuts: the side of a node, and with it its field, is a decision.
fn agreement_at_cut(name: impl Into<String>, snapshot: Snapshot, plan: FramePlan, tagged: u64) -> Agreement {
    Agreement { position: 2e-6, strain: 6e-6, tagged, ..agreement(name, snapshot, plan) }
}

/// The greatest differences between engine and oracle.
#[derive(Debug, Default)]
struct Difference {
    /// Position [cells].
    position: f64,
    /// Elastic strain [-].
    strain: f64,
    /// Velocity [cells per substep].
    velocity: f64,
    /// Affine velocity [1 per substep].
    affine: f64,
    /// Accumulated plastic strain and working [-].
    history: f64,
    /// Particles on another side.
    sides: usize,
    /// Particles of another body.
    bodies: usize,
    /// Particles that cling to other tools or touch other walls.
    clinging: usize,
    /// Place of an anchor [cells].
    anchor: f64,
}

/// A block of `size` cells with 8 jittered particles per cell on the floor's middle, `drop` cells above it.
pub fn block(size: IVec3, drop: f64, walls: Walls, material: ClayMaterial) -> Snapshot {
    let room = (size + 12).as_dvec3() * CELL;
    let domain = Domain::new(DVec3::ZERO, room, CELL, walls).expect("room");
    let mut random = 7u64;
    let mut jitter = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.4 * ((random >> 33) as f64 / (1u64 << 31) as f64) - 0.2
    };
    let floor = domain.wall_nodes().0.as_dvec3();
    let low = floor + DVec3::new(6.0, drop, 6.0);
    let mut particles = vec![];
    for i in 0..size.x * 2 {
        for j in 0..size.y * 2 {
            for k in 0..size.z * 2 {
                let x = low + (IVec3::new(i, j, k).as_dvec3() + 0.5 + DVec3::new(jitter(), jitter(), jitter())) / 2.0;
                particles.push(Particle::at(x, (CELL.powi(3) / 8.0) as f32, particles.len() as u32));
            }
        }
    }
    Snapshot::new(domain, material, particles)
}

/// A plan of `steps` substeps, each of `dt_fraction` of the stability limit.
pub fn plan(snapshot: &Snapshot, dt_fraction: f64, steps: u32, tools: Vec<ToolPath>) -> FramePlan {
    let m = snapshot.material;
    let plan = FramePlan::new(m, dt_fraction * m.time_step_limit(CELL, m.density), steps);
    FramePlan { id: 1, gravity: DVec3::new(0.0, -9.81, 0.0), tools, outputs: FrameOutputs::ALL, ..plan }
}

/// Clay of the peers' scene: E 1e5, nu 0.1, yield 2 kPa.
pub fn soft() -> ClayMaterial {
    ClayMaterial { density: 1000.0, young_modulus: 1e5, poisson_ratio: 0.1, yield_stress: 2e3, ..Default::default() }
}

fn compare(engine: &mut dyn Engine, case: &Case) -> (Difference, FrameReport, FrameReport) {
    engine.load(&case.snapshot).expect("load");
    engine.submit(case.plan.clone()).expect("submit");
    let report = engine.wait().expect("report");
    assert!(report.health.is_ok(), "{}", report.health);
    let mut ours = engine.save().expect("save").particles;
    let mut oracle = Oracle::new(&case.snapshot);
    let reference = oracle.run(&case.plan);
    let (dt, unit) = (case.plan.dt, case.plan.dt / CELL);
    ours.sort_by_key(|p| p.id);
    let mut theirs: Vec<_> = oracle.particles.clone();
    theirs.sort_by_key(|p| p.id);
    let mut d = Difference::default();
    for (a, b) in ours.iter().zip(&theirs) {
        d.position = d.position.max((a.grid() - b.position).abs().max_element());
        let e = b.elastic_strain;
        let e = [e.x_axis.x, e.y_axis.y, e.z_axis.z, e.x_axis.y, e.x_axis.z, e.y_axis.z];
        for i in 0..6 {
            d.strain = d.strain.max((f64::from(a.elastic_strain[i]) - e[i]).abs());
        }
        d.velocity = d.velocity.max((DVec3::from_array(a.velocity.map(f64::from)) - b.velocity).abs().max_element() * unit);
        for c in 0..3 {
            let column = DVec3::from_array(a.affine[c].map(f64::from));
            d.affine = d.affine.max((column - b.affine.col(c)).abs().max_element() * dt);
        }
        d.history = d.history.max((f64::from(a.hardening) - b.hardening).abs()).max((f64::from(a.structure) - b.structure).abs());
        d.sides += usize::from(a.tags != b.tags);
        d.bodies += usize::from(a.body != b.body);
        d.clinging += usize::from(a.walls != b.walls);
        for (ours, theirs) in a.anchors.iter().zip(b.anchors) {
            let (id, at) = theirs.unwrap_or((u32::MAX, DVec3::ZERO));
            d.clinging += usize::from(ours.tool != id.wrapping_add(1));
            d.anchor = d.anchor.max((DVec3::from_array(ours.at.map(f64::from)) - at).abs().max_element());
        }
    }
    (d, report, reference)
}

/// Gives each particle the velocity [m/s] of its place \[cells\].
pub fn velocities(snapshot: &mut Snapshot, v: impl Fn(DVec3) -> DVec3) {
    for p in &mut snapshot.particles {
        p.velocity = v(p.grid()).as_vec3().to_array();
    }
}

/// Walls that clay may leave, and a floor.
pub fn floor_walls(floor: Wall) -> Walls {
    Walls { low: [Wall::Separate, floor, Wall::Separate], high: [Wall::Separate; 3] }
}

/// How far the anchor of a particle that slides stands behind it, over its depth in the tool: friction times
/// the normal stiffness over the tangential one. By so much more than the depth is it off.
fn trail(plan: &FramePlan) -> f64 {
    let friction = |path: &ToolPath| match path.tool.contact {
        Contact::Stick => STICK_FRICTION,
        Contact::Separate { friction } => friction,
        _ => 0.0,
    };
    plan.tools.iter().map(friction).fold(0.0, f64::max) * NORMAL_STIFFNESS / TANGENTIAL_STIFFNESS
}

/// Forces out of balance over those that clay bears [-] below which an implicit step is as good as done.
const NEAR_LEAST: f64 = 1e-3;

/// Holds the engine to its limits against the oracle after the plan's substeps.
pub fn assert_close(engine: &mut dyn Engine, agreement: &Agreement) {
    let Agreement { name, case, position, strain, tagged } = agreement;
    let (position, strain) = (*position, *strain);
    let (d, ours, theirs) = compare(engine, case);
    assert!(d.position <= position && d.strain <= strain && d.sides == 0 && d.bodies == 0, "{name}: {d:?}");
    assert!(d.velocity <= position && d.affine <= 3.0 * position && d.history <= 2.0 * strain, "{name}: {d:?}");
    assert!(d.clinging == 0 && d.anchor <= trail(&case.plan).max(1.0) * position, "{name}: {d:?}");
    assert_eq!((ours.welded, ours.carried, ours.sheets), (theirs.welded, theirs.carried, theirs.sheets), "{name}");
    assert_eq!((ours.body_max, ours.passes), (theirs.body_max, theirs.passes), "{name}");
    // Near the least rounding decides whether the sides of a cut stick or slide, whether a step is cut for
    // it, and what is left.
    if theirs.residual > NEAR_LEAST {
        assert_eq!(ours.rejected, theirs.rejected, "{name}");
        let residual_off = (ours.residual - theirs.residual).abs();
        assert!(residual_off <= 1e-3 * theirs.residual, "{name}: {} {}", ours.residual, theirs.residual);
    } else {
        assert!(ours.residual <= NEAR_LEAST, "{name}: {} {}", ours.residual, theirs.residual);
    }
    assert!(ours.has_loose_clay.is_some() && ours.has_loose_clay == theirs.has_loose_clay, "{name}: {:?}", ours.has_loose_clay);
    let scale = theirs.impulse_scale + theirs.momentum_scale;
    for (a, b) in ours.tools.iter().zip(&theirs.tools) {
        assert!((a.impulse - b.impulse).length() <= 1e-5 * scale, "{name}: impulse {} against {}", a.impulse, b.impulse);
        assert!((a.angular_impulse - b.angular_impulse).length() <= 1e-5 * scale * 0.1, "{name}: {}", a.angular_impulse);
        assert!(b.contacts + b.tagged > 0, "{name}: the tool must touch the clay");
        assert_eq!((a.tagged, a.displaced), (b.tagged, b.displaced), "{name}");
    }
    assert!((ours.wall_impulse - theirs.wall_impulse).length() <= 1e-5 * scale, "{name}: wall {}", ours.wall_impulse);
    assert!((ours.energies.elastic / theirs.energies.elastic - 1.0).abs() < 1e-4, "{name}: {:?}", ours.energies);
    assert!(ours.balance_error() <= 1e-5 && theirs.balance_error() <= 1e-12, "{name}");
    assert!((ours.grid_mass / ours.particle_mass - 1.0).abs() <= 1e-7, "{name}: {}", ours.grid_mass / ours.particle_mass);
    assert!(ours.tools.iter().map(|t| t.tagged).sum::<u64>() >= *tagged, "{name}: {:?}", ours.tools);
    if theirs.angular_momentum.length() > 0.0 {
        let error = (ours.angular_momentum - theirs.angular_momentum).length();
        assert!(error <= 1e-4 * theirs.momentum_scale * 0.1, "{name}: angular {}", ours.angular_momentum);
    }
}

/// A tool that moves from `from` to `to` (grid coordinates) over the frame.
pub fn moving(snapshot: &Snapshot, plan: &FramePlan, tool: Tool, from: DVec3, to: DVec3, rotation: DQuat) -> ToolPath {
    let at = |time, x| PoseSample { time, pose: Pose { position: snapshot.domain.to_world(x), rotation } };
    ToolPath { id: 3, tool, sheet: 0, samples: vec![at(0.0, from), at(plan.duration(), to)] }
}

/// A tool that clay may leave, with friction.
pub const SEPARATE: Contact = Contact::Separate { friction: 0.3 };

/// A block that falls onto the floor at 0.05 cells per substep: impact, compression to J = 0.6, yielding.
pub fn impact() -> Vec<Agreement> {
    let mut cases = vec![];
    for floor in [Wall::Separate, Wall::Slip, Wall::Stick] {
        let mut s = block(IVec3::new(9, 12, 11), 0.3, floor_walls(floor), soft());
        let p = plan(&s, 0.25, 20, vec![]);
        velocities(&mut s, |_| DVec3::new(0.004, -0.05, 0.002) * CELL / p.dt);
        cases.push(agreement(format!("impact {floor:?}"), s, p));
    }
    cases
}

/// A block that shears, turns and stretches unequally along all axes: every transposed product would show.
pub fn asymmetric_deformation() -> Vec<Agreement> {
    let mut cases = vec![];
    let mut s = block(IVec3::new(8, 8, 8), 3.0, Walls::default(), soft());
    let p = plan(&s, 0.25, 20, vec![]);
    let centre = s.domain.to_grid(s.domain.corners().0) + DVec3::splat(10.0);
    velocities(&mut s, |x| {
        let r = x - centre;
        DVec3::new(0.004 * r.y - 0.001 * r.z, 0.002 * r.x + 0.003 * r.z, -0.005 * r.y + 0.002 * r.z + 0.001 * r.x) * CELL / p.dt
    });
    cases.push(agreement("asymmetric", s, p));
    cases
}

/// A ball pressed into clay of every law, worked and hardened before.
pub fn laws() -> Vec<Agreement> {
    let viscous = |viscosity, flow_index| ClayMaterial { viscosity, flow_index, ..soft() };
    let worked = ClayLaw::Worked { loss: 0.6, rate: 5.0, rest_time: 0.05 };
    let all = [
        ("hardening", ClayMaterial { hardening_modulus: 2e4, ..soft() }),
        ("linear viscosity", viscous(20.0, 1.0)),
        ("Herschel-Bulkley", ClayMaterial { hardening_modulus: 5e3, ..viscous(300.0, 0.3) }),
        ("worked", ClayMaterial { law: worked, softening: 0.3, ..soft() }),
    ];
    all.into_iter().map(|(name, material)| pressed(name, material, 0.0)).collect()
}

/// The same of every law that there is.
pub fn all_laws() -> Vec<Agreement> {
    let clay = |law| ClayMaterial { law, softening: 0.3, softening_length: 4.0 * CELL, ..soft() };
    ClayLaw::ALL.into_iter().map(|law| pressed(law.identifier(), clay(law), 0.0)).collect()
}

/// Flowing particles that share their cell's volume ratio: uniform clay, and clay that the tool softens.
pub fn averaging() -> Vec<Agreement> {
    let soft_near = ClayMaterial { softening: 0.4, hardening_modulus: 2e3, ..soft() };
    vec![pressed("averaging", soft(), 0.05), pressed("averaging of softened clay", soft_near, 0.2)]
}

/// A ball that slides into the top of a block which was strained, worked and moved before.
pub fn pressed(name: &str, material: ClayMaterial, volume_averaging: f64) -> Agreement {
    let mut s = block(IVec3::new(10, 8, 10), 0.0, floor_walls(Wall::Stick), material);
    for (i, p) in s.particles.iter_mut().enumerate() {
        let phase = i as f32 * 0.37;
        p.elastic_strain =
            [0.03 * phase.sin(), 0.02 * phase.cos(), -0.02, 0.04 * (2.0 * phase).sin(), 0.01, 0.03 * (3.0 * phase).cos()];
        p.hardening = 0.1 + 0.1 * phase.sin();
        p.structure = 0.3 + 0.2 * phase.cos();
    }
    let mut p = plan(&s, 0.25, 20, vec![]);
    p.volume_averaging = volume_averaging;
    let tool = Tool { shape: ToolShape::Sphere { radius: 3.2 * CELL }, contact: SEPARATE };
    let top = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.0, 8.0 + 2.4, 11.3);
    p.tools = vec![moving(&s, &p, tool, top, top + DVec3::new(0.5, -1.2, 0.1), DQuat::IDENTITY)];
    agreement(name, s, p)
}

/// A blade that cuts in its own plane and one swept along its normal, with each contact. (No node lies on the
/// blade's edge in any substep: there the last bit would decide.)
pub fn blades() -> Vec<Agreement> {
    let mut cases = vec![];
    for (name, step) in [("cut", DVec3::new(0.0, -3.0, 0.0)), ("sweep", DVec3::new(1.2, 0.0, 0.3))] {
        for contact in Contact::ALL {
            let s = block(IVec3::new(10, 8, 10), 0.0, floor_walls(Wall::Stick), soft());
            let mut p = plan(&s, 0.25, 20, vec![]);
            let shape = ToolShape::Blade { half_width: 4.1 * CELL, half_height: 3.4 * CELL };
            let turn = DQuat::from_rotation_y(1.4);
            let at = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.1, 8.07, 11.3);
            p.tools = vec![moving(&s, &p, Tool { shape, contact }, at, at + step, turn)];
            cases.push(agreement_at_cut(format!("{name} {contact:?}"), s, p, 500));
        }
    }
    cases
}

/// A gouge that digs and turns, a pointed blade that stabs, wires that are pulled through, straight and round
/// a bend.
pub fn other_blades() -> Vec<Agreement> {
    let bend: Vec<DVec2> = (0..7).map(|i| DVec2::from_angle(PI + f64::from(i) * PI / 6.0) * 2.6 * CELL).collect();
    let gouge = ToolShape::BentBlade { profile: Profile::new(&bend).expect("a profile"), half_height: 3.4 * CELL };
    let pointed = ToolShape::PointedBlade { half_width: 2.1 * CELL, half_height: 4.3 * CELL };
    let wire = ToolShape::Wire { half_length: 7.3 * CELL };
    let down = DVec3::new(0.02, -2.0, 0.01);
    let mut cases = vec![];
    for (name, shape, contact, step, turn) in [
        ("gouge digs", gouge, Contact::Slip, down, DQuat::from_rotation_y(0.4)),
        ("gouge sweeps", gouge, SEPARATE, DVec3::new(0.4, 0.1, -1.1), DQuat::from_rotation_y(0.4)),
        ("point stabs", pointed, SEPARATE, down, DQuat::from_rotation_y(1.4)),
        ("point sticks", pointed, Contact::Stick, DVec3::new(0.7, -0.4, 0.3), DQuat::from_rotation_y(1.4)),
        ("wire", wire, SEPARATE, down, DQuat::from_rotation_y(1.4)),
        ("wire aslant", wire, SEPARATE, DVec3::new(0.1, -0.8, 0.9), DQuat::from_rotation_y(0.2)),
    ] {
        let s = block(IVec3::new(10, 8, 10), 0.0, floor_walls(Wall::Stick), soft());
        let mut p = plan(&s, 0.25, 20, vec![]);
        let at = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.1, 7.07, 11.3);
        p.tools = vec![moving(&s, &p, Tool { shape, contact }, at, at + step, turn)];
        cases.push(agreement_at_cut(name, s, p, 100));
    }
    cases
}

/// Every blade and wire that there is, pushed down aslant, with each contact.
pub fn all_blades() -> Vec<Agreement> {
    let mut cases = vec![];
    for shape in ToolShape::ALL.into_iter().filter(ToolShape::is_blade).map(|shape| shape.scaled(CELL)) {
        for contact in Contact::ALL {
            let s = block(IVec3::new(10, 8, 10), 0.0, floor_walls(Wall::Stick), soft());
            let mut p = plan(&s, 0.25, 20, vec![]);
            let at = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.1, 7.57, 11.3);
            let way = DVec3::new(0.3, -1.1, 0.2);
            p.tools = vec![moving(&s, &p, Tool { shape, contact }, at, at + way, DQuat::from_rotation_y(0.4))];
            cases.push(agreement_at_cut(format!("{} {contact:?}", shape.identifier()), s, p, 100));
        }
    }
    cases
}

/// The two halves of a kept cut run into each other, from apart too, slide along each other and part.
pub fn kept_cut() -> Vec<Agreement> {
    let mut cases = vec![];
    let closing = DVec3::new(-0.03, 0.0, 0.02);
    for (name, v, gap) in [
        ("close", closing, 0.0),
        ("open", DVec3::new(0.03, 0.01, 0.0), 0.0),
        ("slide", DVec3::new(-0.002, 0.03, 0.0), 0.0),
        // Less than they come together.
        ("meet", closing, 0.4),
    ] {
        let mut s = block(IVec3::new(10, 8, 10), 2.0, Walls::default(), soft());
        let p = plan(&s, 0.25, 20, vec![]);
        let middle = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.0, 6.0, 11.0);
        for q in &mut s.particles {
            let normal = DVec3::new(1.0, 0.3, -0.2).normalize();
            let side = (q.grid() - middle).dot(normal);
            q.velocity = (v * side.signum() * CELL / p.dt).as_vec3().to_array();
            q.set_grid(q.grid() + 0.5 * gap * side.signum() * normal);
            // Tags reach 3 cells from the cut; it ends inside the block.
            if side.abs() < 3.0 && q.grid().y > middle.y - 2.0 {
                q.tags[0] = Tag { sheet: 1, side: if side < 0.0 { -1 } else { 1 } };
            }
        }
        cases.push(agreement_at_cut(name, s, p, 0));
    }
    cases
}

/// Two kept cuts that cross, whose four pieces run into each other, slide and part; a third, parallel to one
/// of them, makes slabs.
pub fn crossed_cuts() -> Vec<Agreement> {
    let mut cases = vec![];
    for (name, pieces, v) in [
        ("crossed, close", 2, DVec3::new(-0.03, 0.0, 0.02)),
        ("crossed, open", 2, DVec3::new(0.03, 0.01, 0.02)),
        ("slabs, slide", 3, DVec3::new(-0.004, 0.03, -0.01)),
    ] {
        let mut s = block(IVec3::new(10, 8, 10), 2.0, Walls::default(), soft());
        let p = plan(&s, 0.25, 20, vec![]);
        let middle = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.0, 6.0, 11.0);
        let normals = [DVec3::new(1.0, 0.3, -0.2), DVec3::new(0.1, -0.2, 1.0), DVec3::new(1.0, 0.3, -0.2)];
        for q in &mut s.particles {
            let mut speed = DVec3::ZERO;
            let (at, mut free) = (q.grid(), q.tags.iter_mut());
            for (i, normal) in normals.iter().enumerate().take(pieces) {
                // The third plane is 2.5 cells behind the first: most particles between them know both.
                let side = (at - middle).dot(normal.normalize()) + if i == 2 { 2.5 } else { 0.0 };
                speed += v * side.signum() * (DVec3::ONE - DVec3::AXES[i] * 0.5);
                if side.abs() < 2.0
                    && let Some(tag) = free.next()
                {
                    *tag = Tag { sheet: [7, 3, 200][i], side: if side < 0.0 { -1 } else { 1 } };
                }
            }
            q.velocity = (speed * CELL / p.dt).as_vec3().to_array();
        }
        cases.push(agreement_at_cut(name, s, p, 0));
    }
    cases
}

/// Two cuts that cross, tagged for less than splines reach: their sides are carried on, past what is in the
/// way of both.
pub fn carrying() -> Vec<Agreement> {
    let case = |name: &str, sheets: &[u8]| {
        let mut s = block(IVec3::new(10, 8, 10), 2.0, Walls::default(), soft());
        let p = plan(&s, 0.25, 20, vec![]);
        let middle = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.03, 6.0, 11.0);
        for q in &mut s.particles {
            q.elastic_strain[0] = 1e-3;
            let at = q.grid() - middle;
            let sides = [at.x + 0.2 * at.z, at.y + 0.3 * at.z - 1.3];
            for (tag, (sheet, side)) in q.tags.iter_mut().zip(sheets.iter().zip(sides)).filter(|(_, (_, side))| side.abs() < 0.7)
            {
                *tag = Tag { sheet: *sheet, side: if side < 0.0 { -1 } else { 1 } };
            }
        }
        // What has grown together stays so.
        s.particles.iter_mut().step_by(5).filter(|q| q.tags[1].side == 0).for_each(|q| q.tags[1] = Tag { sheet: 7, side: 0 });
        agreement_at_cut(format!("carrying, {name}"), s, p, 0)
    };
    vec![case("one", &[7]), case("two", &[7, 3])]
}

/// A blade slices through two kept cuts, which a particle has room for but not for all three.
pub fn recut() -> Vec<Agreement> {
    let mut cases = crossed_cuts();
    cases.truncate(1);
    for Agreement { name, case, tagged, .. } in &mut cases {
        *name = "recut".into();
        *tagged = 500;
        let at = case.snapshot.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.1, 8.07, 11.3);
        let blade = Tool { shape: ToolShape::Blade { half_width: 4.1 * CELL, half_height: 3.4 * CELL }, contact: SEPARATE };
        let turn = DQuat::from_rotation_y(2.2);
        let path = moving(&case.snapshot, &case.plan, blade, at, at - DVec3::Y, turn);
        case.plan.tools = vec![ToolPath { id: 4, ..path }];
    }
    cases
}

/// Blades without friction that go between two bodies, which they part no more.
pub fn parted() -> Vec<Agreement> {
    let mut cases = blades();
    cases.retain(|agreement| agreement.case.plan.tools[0].tool.contact == Contact::Slip);
    for Agreement { name, case, .. } in &mut cases {
        *name = format!("{name} between bodies");
        let blade = case.plan.tools[0].samples[0].pose;
        for p in &mut case.snapshot.particles {
            p.body = u32::from(blade.to_local(case.snapshot.domain.to_world(p.grid())).z < 0.0);
        }
    }
    cases
}

/// A frame through sorts, a wall, a ball and a blade: what two runs of an engine have to agree on to the bit.
pub fn mixed() -> Case {
    let mut s = block(IVec3::splat(8), 0.5, floor_walls(Wall::Separate), ClayMaterial { softening: 0.3, ..soft() });
    let mut p = plan(&s, 0.25, 60, vec![]);
    velocities(&mut s, |_| DVec3::new(0.01, -0.05, 0.02) * CELL / p.dt);
    let at = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(10.0, 9.0, 10.0);
    let blade = Tool { shape: ToolShape::Blade { half_width: 0.1, half_height: 0.1 }, contact: SEPARATE };
    let ball = Tool { shape: ToolShape::Sphere { radius: 0.04 }, contact: SEPARATE };
    p.tools = vec![
        moving(&s, &p, blade, at + DVec3::Y * 8.0, at - DVec3::Y * 2.0, DQuat::from_rotation_y(0.3)),
        moving(&s, &p, ball, at + DVec3::new(-3.0, 3.0, 0.0), at + DVec3::new(-3.0, -3.0, 0.0), DQuat::IDENTITY),
    ];
    p.tools[1].id = 4;
    Case { snapshot: s, plan: p }
}

/// Frames that are given up, one for its own fault and one behind it, leave the clay as it was: its particles
/// to the bit, the time, and what it is made of, which a frame that runs changes to its plan's material.
///
/// # Panics
/// They do not.
pub fn assert_given_up_frames_leave_no_trace(engine: &mut dyn Engine) {
    let mut s = block(IVec3::splat(4), 1.0, Walls::default(), soft());
    let mut p = plan(&s, 0.25, 4, vec![]);
    p.material = ClayMaterial { young_modulus: 0.5 * s.material.young_modulus, ..s.material };
    let run = |engine: &mut dyn Engine, clay: &Snapshot| {
        engine.load(clay).expect("load");
        (0..2).for_each(|_| engine.submit(p.clone()).expect("submit"));
        let given_up = [(); 2].map(|()| engine.wait().expect("report").health.contains(Health::GIVEN_UP));
        let mut saved = engine.save().expect("save");
        saved.particles.sort_by_key(|p| p.id);
        (given_up, saved)
    };
    let (given_up, saved) = run(engine, &s);
    assert_eq!((given_up, saved.material), ([false; 2], p.material));
    s.particles[7].velocity[0] = 1e30;
    let (given_up, saved) = run(engine, &s);
    assert_eq!((given_up, saved.material, saved.time), ([true; 2], s.material, s.time));
    assert!(saved.particles == s.particles, "the clay changed");
}

/// Runs the case's plan `frames` times on end; the state as bytes, particles by id.
pub fn run(engine: &mut dyn Engine, case: &Case, frames: usize) -> Vec<u8> {
    engine.load(&case.snapshot).expect("load");
    for _ in 0..frames {
        engine.submit(case.plan.clone()).expect("submit");
        let report = engine.wait().expect("report");
        assert!(report.health.is_ok(), "{}", report.health);
    }
    let mut saved = engine.save().expect("save");
    saved.particles.sort_by_key(|p| p.id);
    saved.to_bytes()
}
