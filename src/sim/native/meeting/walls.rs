//! The columns of nodes that walls fold or clamp.

use super::super::super::params::{BLOCK, Domain, Wall};
use super::super::nodes::local;
use glam::{DVec3, IVec3};

/// A column of nodes across a wall.
pub(super) struct Column {
    pub(super) axis: usize,
    pub(super) outer: usize,
    pub(super) wall: usize,
    pub(super) inner: usize,
    pub(super) kind: Wall,
    /// The wall's number.
    pub(super) number: usize,
    /// Direction away from the wall along the axis.
    pub(super) inward: f64,
}

impl Column {
    /// Reverses the components that the image of clay in this wall has reversed.
    pub(super) fn reflect(&self, mut v: DVec3) -> DVec3 {
        if self.kind == Wall::Stick {
            return -v;
        }
        v[self.axis] = -v[self.axis];
        v
    }

    /// What a clamped wall leaves of a velocity: none at a stick wall, else none along the axis, or, of a
    /// separating wall, none into it.
    pub(super) fn clamp(&self, mut v: DVec3) -> DVec3 {
        if self.kind == Wall::Stick {
            return DVec3::ZERO;
        }
        if self.kind == Wall::Slip || v[self.axis] * self.inward < 0.0 {
            v[self.axis] = 0.0;
        }
        v
    }
}

/// Whether any wall stands in the block.
pub(super) fn stand_in(block: IVec3, domain: &Domain) -> bool {
    let (low, high) = domain.wall_nodes();
    (low / BLOCK).cmpeq(block).any() || (high / BLOCK).cmpeq(block).any()
}

/// The columns of the walls that stand in the block, axis by axis.
pub(super) fn columns(block: IVec3, domain: &Domain) -> Vec<Column> {
    let mut columns = vec![];
    let (low, high) = domain.wall_nodes();
    for axis in 0..3 {
        let faces = [(low[axis], domain.walls.low[axis], 1, axis), (high[axis], domain.walls.high[axis], -1, axis + 3)];
        for (wall, kind, inward, number) in faces {
            if wall / BLOCK != block[axis] {
                continue;
            }
            for column in 0..16 {
                let at = |w: i32| {
                    let mut c = [column / 4, column % 4, 0];
                    c.rotate_right((axis + 1) % 3);
                    c[axis] = w;
                    local(c[0], c[1], c[2])
                };
                let w = wall % BLOCK;
                let (outer, wall, inner) = (at(w - inward), at(w), at(w + inward));
                columns.push(Column { axis, outer, wall, inner, kind, number, inward: f64::from(inward) });
            }
        }
    }
    columns
}
