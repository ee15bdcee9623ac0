//! Walls by reflection: the clay beyond a wall is the mirror image of the clay before it (method of images).
//!
//! A column is three nodes along the wall's axis: the outer one beyond the wall, the one on it, and the inner
//! one.
//!
//! - **Fold**, first of all: the outer node `w - 1` (high walls: `w + 1`) is added to the inner one as its
//!   image, axis by axis, x first, each class apart: mass adds, normal momentum subtracts, the tangential
//!   adds (slip, separate) or subtracts (stick). A separating wall folds a column only while clay reaches its
//!   outer node, within half a cell of the wall (more than [`WALL_TOUCH`] of the column's mass), and its
//!   reaction, of the classes' totals, is positive: `R = (m+ - m-) v - (p+ + p0 + p-) - (m+ + m0 + m-) g'`
//!   with `v = (p+ - p-) / (m+ + m-) + g'`: `+` inner node, `0` wall node, `-` outer node, `p` the normal
//!   momenta away from the wall, `g' = g h (rho / rho_s)` along it. Else that column has no wall in this
//!   substep.
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
//! Each class folds apart, so that the two sides of a cut stay apart at a wall. Clay further off than half a
//! cell shares the wall node with its image, and came to rest one cell above the floor where that was taken
//! for contact. Gravity folded too, as the image of falling clay has it, was measured worse under self
//! weight: displacement 6.0e-4 against 5.2e-4 at 32 cells.

use super::super::params::{WALL_TOUCH, Wall};
use super::grid::{Field, Grid, Sum};
use super::tools::Surroundings;
use glam::{DVec3, IVec3};

/// A folded column: indices of its three nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Column {
    outer: usize,
    wall: usize,
    inner: usize,
    /// What becomes of each velocity component in the image: -1 or 1.
    image: DVec3,
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
        let faces = [(domain.walls.low[axis], low[axis], 1), (domain.walls.high[axis], high[axis], -1)];
        for (kind, at, inward) in faces {
            let normal = IVec3::AXES[axis] * inward;
            for node in grid.plane(axis, at) {
                let nodes = [node - normal, node, node + normal].map(|n| grid.index(n));
                let [Some(outer), Some(wall), Some(inner)] = nodes else { continue };
                let column = Column { outer, wall, inner, image: image(kind, normal) };
                if kind != Wall::Separate || reaction(grid, &column, node, normal, around) > 0.0 {
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

/// Impulse R \[N s\] along the `normal` with which a wall that folds the column about `node` would act on the
/// clay.
fn reaction(grid: &Grid, column: &Column, node: IVec3, normal: IVec3, around: &Surroundings) -> f64 {
    let gravity = around.gravity_step(node).dot(normal.as_dvec3());
    let total = |node: usize| {
        let classes = &grid.nodes[node].folded;
        let momentum = |sum: Sum| sum.momentum.dot(normal.as_dvec3());
        (classes.mass(), classes.iter().map(|(_, sum)| momentum(sum)).sum::<f64>())
    };
    let [(outer_mass, outer), (wall_mass, wall), (inner_mass, inner)] = [column.outer, column.wall, column.inner].map(total);
    if outer_mass <= WALL_TOUCH * (outer_mass + wall_mass + inner_mass) {
        return 0.0;
    }
    let folded_mass = inner_mass + outer_mass;
    let velocity = if folded_mass > 0.0 { (inner - outer) / folded_mass + gravity } else { 0.0 };
    (inner_mass - outer_mass) * velocity - (inner + wall + outer) - (folded_mass + wall_mass) * gravity
}

fn fold_column(grid: &mut Grid, column: &Column) {
    for node in [column.outer, column.wall, column.inner] {
        grid.nodes[node].is_at_wall = true;
    }
    grid.nodes[column.outer].is_outer = true;
    let outer = std::mem::take(&mut grid.nodes[column.outer].folded);
    for (key, Sum { mass, momentum }) in outer.iter() {
        *grid.nodes[column.inner].folded.of(key) += Sum { mass, momentum: column.image * momentum };
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
        outer.fields = inner.fields.into_iter().map(|f| Field { beyond: f.beyond, ..image(f) }).collect();
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
