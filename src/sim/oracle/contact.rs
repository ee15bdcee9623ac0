//! Contact at nodes: clay against blades at their poses of `t + h`, the sides of cuts against each other.
//! Outer nodes of folded columns take no part. ([Solid tools](super::penalty) press on particles.)
//!
//! 1. **Blades**, in the plan's order: in a blade's band each field, on one side of it or the other, is
//!    bounded by it where it reaches beyond it: one in front at nodes with distance <= [`CONTACT_OFFSET`],
//!    normal +n; one behind at distance >= -[`CONTACT_OFFSET`], normal -n, by the contact of the tool
//!    (below). A blade that sticks holds these nodes across its plane; along it, it takes each field of
//!    every node of the band along, by at most [`traction_share`](tool::traction_share) of `tau h / (rho_s
//!    dx)`: a traction, shared out as the stress of clay at yield is, of tau = k (1 - l) and what viscosity
//!    adds at the shear rate `s / dx` of the slide s [m/s]; k is the shear strength of fresh clay at a tool,
//!    l what the field's clay has lost of it, in the mean over what its particles brought to the node,
//!    unfolded. (Nodes that stick up to the offset alone bear 1.0 to 1.75 k on two flanks, by where the plane
//!    lies between them.)
//! 2. **Fields**: each two fields a, b of a node, in the order of their bodies and of the divisions they are
//!    beyond (bit i for the i-th sheet), exchange momentum while they approach along n by more than there is
//!    room for, unless a blade stands between them. n is the normal from a to b of the sheet between them, or
//!    the mean of the normals of two, and g the gap between the faces, of two sheets the wider one, both in
//!    the mean over what the 27 nodes about the node find ([`facing`](super::super::facing); no exchange
//!    where a normal vanishes). Of fields of two bodies n and g are those between all clay of the one and all
//!    of the other, whatever sides it has. With
//!    `u = (v_b - v_a) . n + dx max(0, g) / h < 0` and the reduced mass
//!    `m = m_a m_b / (m_a + m_b)` the impulse on b is `-m u` along n and, against sliding, at most
//!    [`CUT_FRICTION`] times that (never more than stops the sliding).
//!
//! Contact at the velocity `v_t` of the blade at the node
//! ([`Motion::velocity_at`](tool::Motion::velocity_at)): stick `v = v_t`; slip removes the relative normal
//! velocity; separate removes it only if negative and reduces the relative tangential speed by at most
//! friction times the normal change.
//!
//! Impulses `m (v_before - v_after)` sum up on the tool.
//!
//! Bodies are rigid at a node, impacts inelastic, friction Coulomb's (Bardenhagen, Brackbill & Sulsky 2000,
//! CMAME 187, for grid contact of two fields). Next to a wall contact moves the folded mass, the clay and its
//! image, as in the full space that the image stands for: so a frictionless wall takes no part in sliding.

use super::super::facing::{Between, Facing};
use super::super::frame::{FrameReport, ToolReport};
use super::super::tool::{self, CONTACT_OFFSET, CUT_FRICTION, Contact};
use super::faces::offsets;
use super::grid::{Band, Field, Grid, Node};
use super::tools::{MovingTool, Surroundings};
use glam::{DVec3, IVec3};

/// Bounds the fields by each blade in its band, in the plan's order; then lets those that kept cuts divide
/// press on each other.
pub(super) fn between_sides(grid: &mut Grid, around: &Surroundings, frame: &mut FrameReport) {
    for (index, coordinate) in grid.coordinates().enumerate() {
        if grid.nodes[index].is_outer {
            continue;
        }
        let mut bands: Vec<(usize, Band)> =
            grid.nodes[index].divisions.iter().enumerate().filter_map(|(i, d)| Some((i, d.band?))).collect();
        bands.sort_by_key(|(_, band)| band.tool);
        for (i, band) in bands {
            against_blade(&mut grid.nodes[index], i, coordinate, band, around, frame);
        }
        for ([a, b], facing) in facings(grid, coordinate, index) {
            exchange(&mut grid.nodes[index], a, b, facing, around.domain.cell_width / around.plan.dt);
        }
    }
}

/// The blade of division `i` stops each field where that reaches beyond the blade's plane; a sticking one
/// takes it along.
fn against_blade(node: &mut Node, i: usize, coordinate: IVec3, band: Band, around: &Surroundings, frame: &mut FrameReport) {
    let tool = &around.tools[band.tool];
    // A plate presses on particles.
    if tool.is_solid() {
        return;
    }
    let world = around.domain.to_world(coordinate.as_dvec3());
    let lost = |field: &Field| node.classes.strength_lost(|key| node.place(key) == field.place());
    let sides: Vec<_> = node.fields.iter().map(|field| (f64::from(node.side(field, i)), lost(field))).collect();
    for (field, (sign, lost)) in node.fields.iter_mut().zip(sides) {
        let (normal, distance) = (band.normal * sign, band.distance * sign);
        let felt = &mut frame.tools[band.tool];
        if tool.path.tool.contact.sticks() {
            let after = tool::stick(field.velocity, tool.velocity(world), normal, distance, around.adhesion().weakened(lost));
            push(field, tool, world, after, felt);
        } else if distance <= CONTACT_OFFSET {
            let after = contact_velocity(tool.path.tool.contact, field.velocity, tool.velocity(world), normal);
            push(field, tool, world, after, felt);
        }
    }
}

/// The fields of a node that press on each other, in the order of both, and how the second faces the first,
/// its normal from the first to the second: across the one cut between them, or both of two, or from body to
/// body. Not those that a blade stands between, which acts on both, nor where there is no normal.
pub(super) fn facings(grid: &Grid, coordinate: IVec3, index: usize) -> Vec<([usize; 2], Facing)> {
    let node = &grid.nodes[index];
    let count = node.fields.len();
    let pairs = (1..count).flat_map(|b| (0..b).map(move |a| [a, b]));
    pairs.filter_map(|pair| Some((pair, facing_of(grid, coordinate, node, pair.map(|f| &node.fields[f]))?))).collect()
}

fn facing_of(grid: &Grid, coordinate: IVec3, node: &Node, [from, to]: [&Field; 2]) -> Option<Facing> {
    let between = |i: &usize| node.side(to, *i) != node.side(from, *i);
    let between: Vec<usize> = (0..node.divisions.len()).filter(between).collect();
    if between.iter().any(|i| node.divisions[*i].band.is_some()) {
        return None;
    }
    let mean = |between: Between| {
        let nodes = offsets().filter_map(|o| grid.get(coordinate + o));
        let found = nodes.flat_map(|n| n.found.iter().filter(|found| found.0 == between).map(|found| found.1));
        Facing::mean(found.fold([0.0; 5], |sum, f| std::array::from_fn(|i| sum[i] + f[i])))
    };
    if from.body != to.body {
        return mean(Between::Bodies { back: from.body, front: to.body });
    }
    let of_cut = |i: usize| Some(mean(Between::Sides(node.divisions[i].sheet))?.turned(node.side(to, i)));
    Facing::across(between.into_iter().map(of_cut).collect::<Option<Vec<_>>>()?.into_iter())
}

/// Two fields of a node exchange momentum while they approach by more than there is room for in the step:
/// equal and opposite. `speed` is a cell a step [m/s].
fn exchange(node: &mut Node, a: usize, b: usize, facing: Facing, speed: f64) {
    let [behind, before] = [node.fields[a], node.fields[b]];
    if behind.sum.mass == 0.0 || before.sum.mass == 0.0 {
        return;
    }
    let relative = before.velocity - behind.velocity;
    let approach = relative.dot(facing.normal);
    let excess = approach + facing.room() * speed;
    if excess >= 0.0 {
        return;
    }
    let reduced_mass = behind.sum.mass * before.sum.mass / (behind.sum.mass + before.sum.mass);
    let sliding = relative - approach * facing.normal;
    let stopped = friction_stop(sliding.length(), CUT_FRICTION * -excess);
    let impulse = -reduced_mass * (excess * facing.normal + sliding * stopped);
    for (field, on_field) in [(b, impulse), (a, -impulse)] {
        let field = &mut node.fields[field];
        field.velocity += on_field / field.sum.mass;
        field.contact_impulse += on_field;
    }
}

/// Share of a sliding `speed` [m/s] that friction able to take `most` [m/s] stops.
fn friction_stop(speed: f64, most: f64) -> f64 {
    if speed > most { most / speed } else { 1.0 }
}

/// A tool brings one field at the node `world` \[m\] to the velocity `after` [m/s].
fn push(field: &mut Field, tool: &MovingTool, world: DVec3, after: DVec3, felt: &mut ToolReport) {
    if field.sum.mass == 0.0 {
        return;
    }
    let impulse = field.sum.mass * (after - field.velocity);
    if after != field.velocity {
        felt.contacts += 1;
    }
    field.velocity = after;
    field.contact_impulse += impulse;
    felt.impulse -= impulse;
    felt.angular_impulse -= (world - tool.motion.end.position).cross(impulse);
}

/// Velocity [m/s] that contact with a surface moving at `surface` [m/s] leaves of `velocity` [m/s].
pub(super) fn contact_velocity(contact: Contact, velocity: DVec3, surface: DVec3, normal: DVec3) -> DVec3 {
    let relative = velocity - surface;
    let leaving = relative.dot(normal);
    match contact {
        Contact::Stick => surface,
        Contact::Slip => velocity - leaving * normal,
        Contact::Separate { .. } if leaving >= 0.0 => velocity,
        Contact::Separate { friction } => {
            let sliding = relative - leaving * normal;
            surface + sliding * (1.0 - friction_stop(sliding.length(), friction * -leaving))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On a floor moving along x: stick moves with it, slip keeps the tangent, separate lets go or takes
    /// Coulomb's share of it.
    #[test]
    fn contact_velocity_follows_its_kind() {
        let (surface, normal) = (DVec3::new(1.0, 0.0, 0.0), DVec3::Y);
        let after = |contact, velocity| contact_velocity(contact, velocity, surface, normal);
        let pressed = DVec3::new(3.0, -1.0, 0.0);
        let leaving = DVec3::new(3.0, 1.0, 0.0);
        let separate = |friction| Contact::Separate { friction };
        assert_eq!(after(Contact::Stick, pressed), surface);
        assert_eq!(after(Contact::Slip, pressed), DVec3::new(3.0, 0.0, 0.0));
        assert_eq!(after(Contact::Slip, leaving), DVec3::new(3.0, 0.0, 0.0));
        assert_eq!(after(separate(0.3), leaving), leaving);
        assert_eq!(after(separate(0.5), pressed), DVec3::new(2.5, 0.0, 0.0));
        assert_eq!(after(separate(3.0), pressed), surface);
        assert_eq!(after(separate(0.3), DVec3::new(1.0, -1.0, 0.0)), surface);
    }
}
