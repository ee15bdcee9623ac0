//! Bodies that press on each other, part, and are found anew at a frame's end.

use super::{Agreement, CELL, agreement_at_cut, block, floor_walls, plan, soft};
use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use glam::{DVec3, IVec3};

/// Clay of two bodies, told apart by an oblique plane, and its motion.
struct Pair {
    name: &'static str,
    numbers: [u32; 2],
    /// Of the second body; the first has the opposite [cells/substep].
    velocity: DVec3,
    /// Between them \[cells\].
    gap: f64,
    /// Those with a kept cut through them, whose halves run into each other.
    cut: &'static [u32],
    is_on_floor: bool,
}

/// Two bodies that run into each other, from apart too, slide along each other and part; with a kept cut
/// through both of them or one, and on a floor.
pub fn bodies() -> Vec<Agreement> {
    let closing = DVec3::new(-0.03, 0.0, 0.02);
    let pair = Pair { name: "bodies close", numbers: [0, 1], velocity: closing, gap: 0.0, cut: &[], is_on_floor: false };
    let pairs = [
        Pair { ..pair },
        Pair { name: "bodies part", velocity: DVec3::new(0.03, 0.01, 0.0), ..pair },
        Pair { name: "bodies slide", numbers: [3, 0], velocity: DVec3::new(-0.002, 0.03, 0.0), ..pair },
        // Less than they come together.
        Pair { name: "bodies meet", numbers: [700, 16383], gap: 0.4, ..pair },
        Pair { name: "cut bodies close", cut: &[0, 1], ..pair },
        Pair { name: "a cut body and a whole one close", cut: &[1], ..pair },
        Pair { name: "bodies close on a floor", numbers: [2, 1], is_on_floor: true, ..pair },
    ];
    pairs.iter().map(pressed).collect()
}

fn pressed(pair: &Pair) -> Agreement {
    let (walls, drop) = if pair.is_on_floor { (floor_walls(Wall::Slip), 0.0) } else { (Walls::default(), 2.0) };
    let mut s = block(IVec3::new(10, 8, 10), drop, walls, soft());
    let p = plan(&s, 0.25, 20, vec![]);
    let middle = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.0, drop + 4.0, 11.0);
    let (normal, across) = (DVec3::new(1.0, 0.3, -0.2).normalize(), DVec3::new(0.1, 0.9, -0.3).normalize());
    for q in &mut s.particles {
        let at = q.grid() - middle;
        let (side, height) = (at.dot(normal).signum(), at.dot(across));
        // Counts on where the bodies press, and goes where they do not.
        if q.id % 5 == 0 && at.dot(normal).abs() < 1.5 {
            q.tags[1] = Tag { sheet: 239, side: 50 };
        }
        q.body = pair.numbers[usize::from(side > 0.0)];
        q.set_grid(q.grid() + 0.5 * pair.gap * side * normal);
        q.elastic_strain[1] = 1e-3;
        let mut velocity = pair.velocity * side;
        if pair.cut.contains(&q.body) {
            velocity -= 0.02 * height.signum() * across;
            if height.abs() < 2.0 {
                q.tags[0] = Tag { sheet: 7, side: if height < 0.0 { -1 } else { 1 } };
            }
        }
        q.velocity = (velocity * CELL / p.dt).as_vec3().to_array();
    }
    agreement_at_cut(pair.name, s, p, 0)
}

/// Three slabs that are pressed along x: two of one body with a cut between them that goes through, and one
/// of another body, which has all but grown together with the second in two places of three. At the frame's
/// end the first is a body of its own, the others are one, with a cut where they have not grown together.
pub fn found_bodies() -> Vec<Agreement> {
    let mut s = block(IVec3::new(10, 8, 10), 2.0, Walls::default(), ClayMaterial { weld: Weld::Sticky, ..soft() });
    let mut p = plan(&s, 0.25, 20, vec![]);
    (p.gravity, p.finds_bodies) = (DVec3::ZERO, true);
    // As in `welding`: one frame more makes it whole.
    let part = (p.duration() / 0.05 * 100.0).floor() as i8;
    let middle = s.domain.wall_nodes().0.as_dvec3().x + 11.03;
    for q in &mut s.particles {
        let [to_cut, to_joint] = [q.grid().x - (middle - 2.2), q.grid().x - (middle + 1.6)];
        if to_cut.abs() < 1.5 {
            q.tags[0] = Tag { sheet: 7, side: if to_cut < 0.0 { -1 } else { 1 } };
        }
        q.body = if to_joint > 0.0 { 4 } else { 0 };
        if to_joint.abs() < 1.4 && q.id % 3 != 0 {
            q.tags[1] = Tag { sheet: 239, side: 101 - part };
        }
        q.elastic_strain[0] = -0.02;
    }
    vec![agreement_at_cut("bodies found", s, p, 0)]
}
