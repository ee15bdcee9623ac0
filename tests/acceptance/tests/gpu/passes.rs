//! Single passes against the oracle: what `p2g` brings to the nodes, what `grid` makes of it, what `g2p`
//! brings back.

use bevy_clay::prelude::*;
use bevy_clay::sim::oracle::Oracle;
use bevy_clay::sim::prelude::*;
use clay_acceptance::agreement::{self, CELL, Case, SEPARATE, moving};
use glam::{DQuat, DVec3, IVec3};
use libtest_mimic::Failed;
use std::collections::HashMap;

/// `count` particles about a room's corner, in strained, turning, shearing motion; unequal along all axes.
/// With cuts: tags of both sides.
fn scattered(count: usize, has_cuts: bool) -> Case {
    let walls = Walls { low: [Wall::Slip, Wall::Separate, Wall::Stick], high: [Wall::Separate; 3] };
    // Cuts grow together at a frame's end, beyond the passes that are compared.
    let clay = ClayMaterial { weld: Weld::Off, ..agreement::soft() };
    let mut s = agreement::block(IVec3::splat(12), 0.0, walls, clay);
    let mut random = 11u64;
    let mut next = move || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as f64 / (1u64 << 31) as f64 - 0.5
    };
    let low = s.domain.wall_nodes().0.as_dvec3();
    let side = (count as f64 / 8.0).cbrt().ceil().max(1.0) + 1.0;
    s.particles.truncate(count);
    let p = agreement::plan(&s, 0.25, 1, vec![]);
    for q in &mut s.particles {
        let mut vector = || DVec3::new(next(), next(), next());
        q.set_grid(low + (vector() + 0.5) * side);
        q.velocity = (vector() * 0.2 * CELL / p.dt).as_vec3().to_array();
        q.affine = [0, 1, 2].map(|_| (vector() * 0.02 / p.dt).as_vec3().to_array());
        let (d, o) = (vector() * 0.1, vector() * 0.05);
        q.elastic_strain = [d.x, d.y, d.z, o.x, o.y, o.z].map(|e| e as f32);
        q.rest_volume *= 0.6 + 0.4 * next() as f32;
        if has_cuts {
            let side = [-1, 0, 1][q.id as usize % 3];
            q.tags[0] = Tag { sheet: u8::from(side != 0), side };
        }
    }
    let mut p = agreement::plan(&s, 0.25, 1, vec![]);
    let ball = Tool { shape: ToolShape::Sphere { radius: 1.5 * CELL }, contact: SEPARATE };
    let blade = Tool { shape: ToolShape::Blade { half_width: 2.1 * CELL, half_height: 1.7 * CELL }, contact: SEPARATE };
    let (at, turn) = (low + DVec3::new(2.03, 1.51, 0.82), DQuat::from_scaled_axis(DVec3::new(0.3, 1.2, -0.4)));
    p.tools = vec![moving(&s, &p, ball, at, at + DVec3::new(0.03, -0.06, 0.02), DQuat::IDENTITY)];
    if has_cuts {
        p.tools.push(ToolPath { id: 4, ..moving(&s, &p, blade, at, at + DVec3::new(-0.05, 0.01, 0.04), turn) });
    }
    Case { snapshot: s, plan: p }
}

/// Particle counts below, at and above the workgroup size of 64, and not multiples of it.
pub(crate) fn each_pass_agrees(engine: &mut GpuEngine) -> Result<(), Failed> {
    for count in [1, 7, 63, 64, 65, 128, 1000] {
        for has_cuts in [false, true] {
            one_substep(engine, &scattered(count, has_cuts), &format!("{count} particles, cuts: {has_cuts}"))?;
        }
    }
    Ok(())
}

fn one_substep(engine: &mut GpuEngine, case: &Case, name: &str) -> Result<(), Failed> {
    let (snapshot, plan) = (&case.snapshot, &case.plan);
    let ours = engine.trace(snapshot, plan.clone()).map_err(|e| format!("{name}: {e}"))?;
    let mut oracle = Oracle::new(snapshot);
    let theirs: HashMap<_, _> = oracle.trace(plan).into_iter().map(|n| ((n.node, n.key), n)).collect();
    let mass_unit = plan.inertial_density() * CELL.powi(3) / 8.0;
    let (speed_unit, mut seen) = (CELL / plan.dt, 0.0);
    for n in &ours {
        let Some(o) = theirs.get(&(n.node, n.key)) else {
            assert!(n.mass == 0.0, "{name}: mass beyond the oracle's nodes at {}", n.node);
            continue;
        };
        seen += n.mass;
        // p2g: a few roundings of f32, and half a unit of fixed point a particle.
        assert!(
            (n.mass - o.mass).abs() < 3e-7 * o.mass.max(mass_unit),
            "{name}: mass {} against {} at {}",
            n.mass,
            o.mass,
            n.node
        );
        let error = (n.momentum - o.momentum).length() / (mass_unit * speed_unit);
        assert!(error < 1e-6, "{name}: momentum off by {error} at {} of {:?}", n.node, n.key);
        // grid: where there is hardly any mass, velocity is momentum over hardly any.
        let error = (n.velocity - o.velocity).length() / speed_unit * (o.mass / mass_unit).min(1.0);
        assert!(error < 2e-6, "{name}: velocity off by {error} at {} of {:?}", n.node, n.key);
    }
    let all: f64 = theirs.values().map(|n| n.mass).sum();
    assert!((seen / all - 1.0).abs() < 1e-6, "{name}: nodes missed");
    // g2p.
    let saved = engine.save().map_err(|e| e.to_string())?.particles;
    let by_id: HashMap<u32, &Particle> = saved.iter().map(|p| (p.id, p)).collect();
    for o in &oracle.particles {
        let p = by_id[&o.id];
        let moved = (p.grid() - o.position).length();
        assert!(moved < 5e-7, "{name}: particle {} off by {moved}", o.id);
        assert_eq!(p.tags, o.tags, "{name}: sides of particle {}", o.id);
        for c in 0..3 {
            let column = DVec3::from_array(p.affine[c].map(f64::from));
            let error = (column - o.affine.col(c)).length() * plan.dt;
            assert!(error < 3e-6, "{name}: affine of particle {} off by {error}", o.id);
        }
        let ours = DVec3::new(p.elastic_strain[0].into(), p.elastic_strain[3].into(), p.elastic_strain[4].into());
        let error = (ours - o.elastic_strain.col(0)).length();
        assert!(error < 2e-6, "{name}: strain of particle {} off by {error}", o.id);
    }
    Ok(())
}
