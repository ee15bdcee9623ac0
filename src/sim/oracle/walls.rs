//! Walls: separating ones press on particles, the others are mirrors for the clay that has arrived at them.
//!
//! - **Touch**, per particle, after the tools: s is its distance from the wall, r its reach, n the wall's
//!   normal. A separating wall is a surface of the [law of contact](super::super::penalty) without friction:
//!   `g = s - r`; what was found in it comes out slowly, as out of a tool. At a slip or stick wall a particle
//!   has arrived at [`arrival`], and so it stays while `s < 3/2`, where it reaches the wall's nodes.
//!
//! Slip and stick walls are method of images: the clay beyond is the mirror image of the clay before it. A
//! column is three nodes along the wall's axis: the outer one beyond the wall, the one on it, and the inner
//! one.
//!
//! - **Fold**, first of all at nodes, each column whose wall node has clay that has arrived: the outer node
//!   `w - 1` (high walls: `w + 1`) is added to the inner one as its image, axis by axis, x first, each class
//!   apart: mass adds, normal momentum subtracts, the tangential adds (slip) or subtracts (stick). Other
//!   columns have no wall in this substep.
//! - **Velocity**, after [`sides`](super::sides): `v = p / m + g h (rho / rho_s)` of each field's folded sums
//!   (g with the body acceleration at the node and `t` of a manufactured solution), times `exp(-damping h)`.
//! - **Unfold**, after [`contact`](super::contact): at wall nodes the normal (stick: every) component is 0;
//!   each outer node of a folded column takes the inner one's velocity, field by field, with the folded
//!   components reversed, the last fold first. The wall's impulse is what the unfolded masses of wall nodes
//!   and folded columns gained beyond gravity, damping, tools and the other side; all other nodes give it
//!   nothing.
//! - **Validation cases** ([`validation`](super::super::validation)): with clamped walls nothing is folded;
//!   instead nodes at and behind a wall lose their normal component (stick: every; separate: one into the
//!   wall). Last, every field of an affine drive's nodes takes the drive's velocity. What clamped and driven
//!   nodes gain is a wall's impulse.
//!
//! Why: clamping the nodes leaves 17-19 % stress error at the wall at any resolution; reflection converges.
//! Each class folds apart, so that the two sides of a cut stay apart at a wall. A wall's nodes reach a cell
//! and a half: clay that they held from there on came to rest one cell above the floor. Gravity folded too,
//! as the image of falling clay has it, was measured worse under self weight: displacement 6.0e-4 against
//! 5.2e-4 at 32 cells.

use super::super::frame::FrameReport;
use super::super::params::Wall;
use super::super::penalty::{Springs, Surface, arrival, reach};
use super::super::tool::Contact;
use super::grid::{Field, Grid, Sum};
use super::particle::Particle;
use super::tools::Surroundings;
use glam::{DVec3, IVec3};

/// How near clay gives mass to the nodes of a wall \[cells\].
const NODE_REACH: f64 = 1.5;

/// A folded column: indices of its three nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    pub(super) outer: usize,
    pub(super) wall: usize,
    pub(super) inner: usize,
    /// What becomes of each velocity component in the image: -1 or 1.
    pub(super) image: DVec3,
}

/// The impulse \[N s\] of separating walls on a particle that got `before` of the tools; notes the walls that
/// it touches or has arrived at.
pub(super) fn touch(
    particle: &mut Particle,
    springs: &Springs,
    before: DVec3,
    around: &Surroundings,
    frame: &mut FrameReport,
) -> DVec3 {
    let (domain, cell_width) = (around.domain, around.domain.cell_width);
    let noted = std::mem::take(&mut particle.walls);
    let mut impulse = DVec3::ZERO;
    if around.plan.validation.clamped_walls {
        return impulse;
    }
    let volume = particle.rest_volume / cell_width.powi(3);
    let mass = around.plan.inertial_density() * particle.rest_volume;
    let (low, high) = domain.wall_nodes();
    let world = domain.to_world(particle.position);
    for (number, kind) in domain.walls.low.into_iter().chain(domain.walls.high).enumerate() {
        let axis = number % 3;
        let (at, normal) = if number < 3 { (low, DVec3::AXES[axis]) } else { (high, -DVec3::AXES[axis]) };
        let distance = (particle.position - at.as_dvec3()).dot(normal);
        let was_noted = noted >> number & 1 == 1;
        let is_noted = match kind {
            Wall::Slip | Wall::Stick => distance < NODE_REACH && (was_noted || distance <= arrival(volume)),
            Wall::Separate => {
                let leaving = normal.dot(particle.velocity + (before + impulse) / mass);
                let gap = (distance - reach(volume)) * cell_width;
                let surface = Surface { contact: Contact::Separate { friction: 0.0 }, gap, normal, leaving };
                let touch = springs.touch(&surface, world, was_noted.then_some(world));
                let given = touch.map_or(DVec3::ZERO, |touch| touch.force * around.plan.dt);
                impulse += given;
                frame.wall_impulse += given;
                frame.impulse_scale += given.length();
                touch.is_some_and(|touch| touch.anchor.is_some())
            }
        };
        particle.walls |= u32::from(is_noted) << number;
    }
    impulse
}

/// The slip and stick walls at which a particle has arrived at `position` \[cells\], or was and has not
/// left, a bit each.
pub(super) fn is_arrived(particle: &Particle, position: DVec3, around: &Surroundings) -> u32 {
    let domain = around.domain;
    let volume = particle.rest_volume / domain.cell_width.powi(3);
    let (low, high) = domain.wall_nodes();
    let mut arrived = 0;
    for (number, kind) in domain.walls.low.into_iter().chain(domain.walls.high).enumerate() {
        let (face, inward) = if number < 3 { (low, 1.0) } else { (high, -1.0) };
        let distance = inward * (position[number % 3] - f64::from(face[number % 3]));
        let was_noted = particle.walls >> number & 1 == 1;
        let is_noted = distance < NODE_REACH && (was_noted || distance <= arrival(volume));
        arrived |= u32::from(is_noted && kind != Wall::Separate && !around.plan.validation.clamped_walls) << number;
    }
    arrived
}

/// Folds the outer nodes onto their inner nodes, axis by axis. Columns of a later axis hold what the earlier
/// axes folded, so that a corner's outer node reaches its inner one in steps; the columns come back in the
/// order of folding.
pub(super) fn fold(grid: &mut Grid, around: &Surroundings) -> Vec<Column> {
    for node in &mut grid.nodes {
        node.folded = node.classes.clone();
    }
    let domain = around.domain;
    let mut columns = Vec::new();
    if around.plan.validation.clamped_walls {
        return columns;
    }
    let (low, high) = domain.wall_nodes();
    for axis in 0..3 {
        let faces = [(domain.walls.low[axis], low[axis], 1, axis), (domain.walls.high[axis], high[axis], -1, axis + 3)];
        for (kind, at, inward, number) in faces {
            let normal = IVec3::AXES[axis] * inward;
            for node in grid.plane(axis, at) {
                let nodes = [node - normal, node, node + normal].map(|n| grid.index(n));
                let [Some(outer), Some(wall), Some(inner)] = nodes else { continue };
                let column = Column { outer, wall, inner, image: image(kind, normal) };
                let has_arrived = grid.nodes[wall].walls >> number & 1 == 1;
                if kind != Wall::Separate && has_arrived {
                    fold_column(grid, &column);
                    columns.push(column);
                }
            }
        }
    }
    columns
}

/// Signs of the velocity components of the image.
fn image(kind: Wall, normal: IVec3) -> DVec3 {
    match kind {
        Wall::Stick => DVec3::NEG_ONE,
        Wall::Slip | Wall::Separate => DVec3::ONE - 2.0 * normal.abs().as_dvec3(),
    }
}

fn fold_column(grid: &mut Grid, column: &Column) {
    for node in [column.outer, column.wall, column.inner] {
        grid.nodes[node].is_at_wall = true;
    }
    grid.nodes[column.outer].is_outer = true;
    let outer = std::mem::take(&mut grid.nodes[column.outer].folded);
    for (key, sum) in outer.iter() {
        *grid.nodes[column.inner].folded.of(key) += Sum { momentum: column.image * sum.momentum, ..sum };
    }
}

/// Momentum to velocity: `v = p / m + g h rho / rho_s`, times `exp(-damping h)` in validation cases.
pub(super) fn set_velocities(grid: &mut Grid, around: &Surroundings) {
    for (coordinate, node) in grid.coordinates().zip(&mut grid.nodes) {
        for field in node.fields.iter_mut().filter(|field| field.sum.mass > 0.0) {
            let free = field.sum.momentum / field.sum.mass + around.gravity_step(coordinate);
            field.velocity = free * around.damping_factor();
            field.damped = field.velocity - free;
        }
    }
}

/// Undoes the folds, the last first: outer nodes move as images, class by class; wall nodes keep the mean of
/// a vector and its image.
pub(super) fn unfold(grid: &mut Grid, columns: &[Column]) {
    for column in columns.iter().rev() {
        let inner = grid.nodes[column.inner].clone();
        let outer = &mut grid.nodes[column.outer];
        outer.divisions = inner.divisions;
        // The image pushes nobody: the contact of the inner node is its own.
        let image = |f: Field| Field { velocity: column.image * f.velocity, damped: column.image * f.damped, ..Field::default() };
        outer.fields = inner.fields.into_iter().map(|f| Field { body: f.body, beyond: f.beyond, ..image(f) }).collect();
        for field in &mut grid.nodes[column.wall].fields {
            field.velocity *= 0.5 * (column.image + 1.0);
            field.damped *= 0.5 * (column.image + 1.0);
        }
    }
}

/// Clamped walls in place of mirrors, the negative control of validation cases: nodes on a wall and behind it
/// lose their velocity along the normal, at a stick wall all of it, at a separating one what goes into the
/// wall.
pub(super) fn clamp(grid: &mut Grid, around: &Surroundings) {
    if !around.plan.validation.clamped_walls {
        return;
    }
    let walls = around.domain.walls;
    let (low, high) = around.domain.wall_nodes();
    for (node, at) in grid.coordinates().zip(&mut grid.nodes) {
        for axis in 0..3 {
            let faces = [
                (walls.low[axis], node[axis] <= low[axis], DVec3::AXES[axis]),
                (walls.high[axis], node[axis] >= high[axis], -DVec3::AXES[axis]),
            ];
            for (kind, is_behind, normal) in faces {
                if is_behind {
                    at.is_at_wall = true;
                    at.fields.iter_mut().for_each(|field| field.velocity = clamped(kind, field.velocity, normal));
                }
            }
        }
    }
}

/// What a clamped wall leaves of a velocity.
fn clamped(kind: Wall, velocity: DVec3, normal: DVec3) -> DVec3 {
    let leaving = velocity.dot(normal);
    match kind {
        Wall::Stick => DVec3::ZERO,
        Wall::Separate if leaving > 0.0 => velocity,
        Wall::Slip | Wall::Separate => velocity - leaving * normal,
    }
}

/// Sets the velocity of the driven nodes of a validation case; what that takes is booked as a wall's impulse.
pub(super) fn drive(grid: &mut Grid, around: &Surroundings) {
    let Some(drive) = around.plan.validation.affine_drive else { return };
    for (coordinate, node) in grid.coordinates().zip(&mut grid.nodes) {
        if let Some(velocity) = drive.velocity_at(around.domain.to_world(coordinate.as_dvec3())) {
            node.is_at_wall = true;
            node.fields.iter_mut().for_each(|field| field.velocity = velocity);
        }
    }
}
