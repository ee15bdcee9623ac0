//! Nodes: what the particles bring, the fields that move, and the box of them about the clay.

use super::super::snapshot::Side;
use super::stencil;
use glam::{DVec3, IVec3};

/// Mass and momentum gathered at a node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    /// Inertial mass [kg].
    pub(super) mass: f64,
    /// Momentum [kg m/s].
    pub(super) momentum: DVec3,
}

impl std::ops::AddAssign for Sum {
    fn add_assign(&mut self, other: Self) {
        self.mass += other.mass;
        self.momentum += other.momentum;
    }
}

/// One velocity field at a node: all clay that moves together there.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Field {
    /// What moves: the folded sums of the field's classes.
    pub(super) sum: Sum,
    /// Velocity [m/s].
    pub(super) velocity: DVec3,
    /// Velocity [m/s] that validation damping took.
    pub(super) damped: DVec3,
    /// Impulse of tools and of the other side on this field [N s].
    pub(super) contact_impulse: DVec3,
}

/// A blade in whose band a node stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Band {
    /// Index of the tool in the plan.
    pub(super) tool: usize,
    /// Signed distance of the node from the blade's plane [cells].
    pub(super) distance: f64,
}

/// How many fields a node has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Division {
    /// One: untagged, front and back move together.
    #[default]
    Whole,
    /// Two: main is untagged clay and the owner's class, other is the other class.
    Split {
        /// The class that moves with untagged clay here.
        owner: Side,
        /// The blade that divides the node, or none where a kept cut does.
        band: Option<Band>,
    },
}

/// A grid node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node {
    /// What the particles of the classes untagged, front and back brought.
    pub(super) classes: [Sum; 3],
    /// The same with what walls folded onto this node or away from it.
    pub(super) folded: [Sum; 3],
    /// Mass [kg] of the clay that touches a separating tool.
    pub(super) touching: f64,
    /// One field or two.
    pub(super) division: Division,
    /// Main and other.
    pub(super) fields: [Field; 2],
    /// Part of a column that a wall folded; held by a clamped wall or driven, in validation cases.
    pub(super) is_at_wall: bool,
    /// Folded onto its mirror: it moves as its image, and contact passes it by.
    pub(super) is_ghost: bool,
}

/// The classes in the order of [`Node::classes`].
pub(super) const CLASSES: [Side; 3] = [Side::None, Side::Front, Side::Back];

/// Index of a side's class in [`Node::classes`].
pub(super) fn class(side: Side) -> usize {
    match side {
        Side::None => 0,
        Side::Front => 1,
        Side::Back => 2,
    }
}

impl Node {
    /// Folded mass [kg] of the clay of one side.
    pub(super) fn class_mass(&self, side: Side) -> f64 {
        self.folded[class(side)].mass
    }

    /// The field in which the clay of `side` moves.
    pub(super) fn field(&self, side: Side) -> &Field {
        &self.fields[self.field_index(side)]
    }

    /// The field, 0 main or 1 other, in which the particles of `side` move.
    pub(super) fn field_index(&self, side: Side) -> usize {
        match self.division {
            Division::Split { owner, .. } if side != Side::None && side != owner => 1,
            _ => 0,
        }
    }
}

/// The nodes about the clay: the dense box of all stencils and one node more, so that a wall node in use has both its neighbours.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    low: IVec3,
    size: IVec3,
    /// The nodes, z fastest.
    pub(super) nodes: Vec<Node>,
}

impl Grid {
    /// Empty nodes about the particles at `positions` [cells].
    pub(super) fn about(positions: impl Iterator<Item = DVec3> + Clone) -> Self {
        let low = positions.clone().map(stencil::base).reduce(IVec3::min).unwrap_or(IVec3::ZERO) - 1;
        let high = positions.map(stencil::base).reduce(IVec3::max).unwrap_or(IVec3::ZERO) + 3;
        let size = high - low + 1;
        let count = size.to_array().map(|n| n.unsigned_abs() as usize).iter().product();
        Self { low, size, nodes: vec![Node::default(); count] }
    }

    /// Where `node` is stored, if the box holds it.
    pub(super) fn index(&self, node: IVec3) -> Option<usize> {
        let at = node - self.low;
        let inside = at.cmpge(IVec3::ZERO).all() && at.cmplt(self.size).all();
        inside.then(|| {
            let [x, y, z] = at.to_array().map(|n| n.unsigned_abs() as usize);
            let [_, ny, nz] = self.size.to_array().map(|n| n.unsigned_abs() as usize);
            (x * ny + y) * nz + z
        })
    }

    /// The node at grid coordinate `node`, if the box holds it.
    pub(super) fn get(&self, node: IVec3) -> Option<&Node> {
        self.index(node).map(|i| &self.nodes[i])
    }

    /// Grid coordinates of all nodes in the order of storage.
    pub(super) fn coordinates(&self) -> impl Iterator<Item = IVec3> + use<> {
        let (low, size) = (self.low, self.size);
        (0..size.x).flat_map(move |x| (0..size.y).flat_map(move |y| (0..size.z).map(move |z| low + IVec3::new(x, y, z))))
    }

    /// Grid coordinates of the nodes of the plane `node[axis] = at`.
    pub(super) fn plane(&self, axis: usize, at: i32) -> impl Iterator<Item = IVec3> + use<> {
        let (mut low, mut size) = (self.low, self.size);
        let holds = (low[axis]..low[axis] + size[axis]).contains(&at);
        low[axis] = at;
        size[axis] = i32::from(holds);
        Self { low, size, nodes: Vec::new() }.coordinates()
    }
}
