//! Nodes: what the particles bring, the fields that move, and the box of them about the clay.

use super::super::cut::ClassKey;
use super::super::facing::Between;
use super::stencil;
use glam::{DVec3, IVec3};

/// Mass and momentum gathered at a node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sum {
    /// Inertial mass \[kg\].
    pub(super) mass: f64,
    /// Momentum [kg m/s].
    pub(super) momentum: DVec3,
    /// The same without the impulses of stress and of tools: what the particles had.
    pub(super) before: DVec3,
    /// Mass times what the clay has lost of its strength at tools \[kg\].
    pub(super) lost: f64,
}

impl std::ops::AddAssign for Sum {
    fn add_assign(&mut self, other: Self) {
        self.mass += other.mass;
        self.momentum += other.momentum;
        self.before += other.before;
        self.lost += other.lost;
    }
}

/// One velocity field at a node: all clay that moves together there.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Field {
    /// The body that the clay is of.
    pub(super) body: u16,
    /// Which of the node's divisions the clay is beyond, from their owners' sides: a bit each.
    pub(super) beyond: u32,
    /// What moves: the folded sums of the field's classes.
    pub(super) sum: Sum,
    /// Velocity [m/s].
    pub(super) velocity: DVec3,
    /// Velocity [m/s] that validation damping took.
    pub(super) damped: DVec3,
    /// Impulse of tools and of the other fields on this one \[N s\].
    pub(super) contact_impulse: DVec3,
}

impl Field {
    /// By what fields of a node are told apart.
    pub(super) fn place(&self) -> (u16, u32) {
        (self.body, self.beyond)
    }
}

/// A blade in whose band a node stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Band {
    /// Index of the tool in the plan.
    pub(super) tool: usize,
    /// Signed distance of the node from the blade \[cells\].
    pub(super) distance: f64,
    /// Unit normal of the blade's front at its point nearest to the node.
    pub(super) normal: DVec3,
}

/// A sheet that divides the clay at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Division {
    /// The sheet.
    pub(super) sheet: u8,
    /// The side (+1, -1) with which clay moves here that has none.
    pub(super) owner: i8,
    /// The blade that divides the node, or none where a kept cut does.
    pub(super) band: Option<Band>,
}

/// The sums of the classes at a node, in the order of their keys.
#[derive(Clone, Debug, Default)]
pub(super) struct Classes(Vec<(ClassKey, Sum)>);

impl Classes {
    /// The classes with their sums.
    pub(super) fn iter(&self) -> impl Iterator<Item = (ClassKey, Sum)> + Clone {
        self.0.iter().copied()
    }

    /// The sum of a class.
    pub(super) fn of(&mut self, key: ClassKey) -> &mut Sum {
        let at = self.0.binary_search_by_key(&key, |c| c.0).unwrap_or_else(|at| {
            self.0.insert(at, (key, Sum::default()));
            at
        });
        &mut self.0[at].1
    }

    /// The velocity [m/s] with which the particles of a class came, if there are any.
    pub(super) fn velocity_before(&self, key: ClassKey) -> Option<DVec3> {
        let (_, sum) = self.iter().find(|(class, sum)| *class == key && sum.mass > 0.0)?;
        Some(sum.before / sum.mass)
    }

    /// What the clay of these classes has lost of its strength at tools, in the mean [-]; fresh where there
    /// is none.
    pub(super) fn strength_lost(&self, is_its: impl Fn(ClassKey) -> bool) -> f64 {
        let its = || self.iter().filter(|(key, _)| is_its(*key));
        let mass: f64 = its().map(|(_, sum)| sum.mass).sum();
        if mass > 0.0 { its().map(|(_, sum)| sum.lost).sum::<f64>() / mass } else { 0.0 }
    }

    /// Mass \[kg\] of the clay of a body.
    pub(super) fn mass_of(&self, body: u16) -> f64 {
        self.iter().filter(|(key, _)| key.body() == body).map(|(_, sum)| sum.mass).sum()
    }

    /// Mass \[kg\] of the clay of all other bodies.
    pub(super) fn mass_beside(&self, body: u16) -> f64 {
        self.iter().filter(|(key, _)| key.body() != body).map(|(_, sum)| sum.mass).sum()
    }

    /// Mass \[kg\] of the clay of a body on one side of a sheet.
    pub(super) fn mass_of_side(&self, body: u16, sheet: u8, side: i8) -> f64 {
        let its = |key: ClassKey| key.body() == body && key.side(sheet) == side;
        self.iter().filter(|(key, _)| its(*key)).map(|(_, sum)| sum.mass).sum()
    }

    /// Masses \[kg\] of the clay in front of something and behind it.
    pub(super) fn masses(&self, between: Between) -> [f64; 2] {
        [true, false]
            .map(|side| self.iter().filter(|(key, _)| between.is_front(*key) == Some(side)).map(|(_, sum)| sum.mass).sum())
    }

    /// Mass \[kg\] of the clay on one side of a sheet.
    pub(super) fn mass_on(&self, sheet: u8, side: i8) -> f64 {
        self.iter().filter(|(key, _)| key.side(sheet) == side).map(|(_, sum)| sum.mass).sum()
    }
}

/// A grid node.
#[derive(Clone, Debug, Default)]
pub(super) struct Node {
    /// What the particles of each class brought.
    pub(super) classes: Classes,
    /// The same with what walls folded onto this node or away from it.
    pub(super) folded: Classes,
    /// The sheets that divide the clay here, in their order; none at a whole node.
    pub(super) divisions: Vec<Division>,
    /// How what stands on two sides of something here faces each other, by this node and those about it
    /// alone, as it counts in a mean.
    pub(super) found: Vec<(Between, [f64; 5])>,
    /// What moves apart here, by [`Field::body`] and [`Field::beyond`] in order.
    pub(super) fields: Vec<Field>,
    /// The walls at which clay that moves here has arrived, a bit each.
    pub(super) walls: u32,
    /// Part of a column that a wall folded; held by a clamped wall or driven, in validation cases.
    pub(super) is_at_wall: bool,
    /// Folded onto its mirror: it moves as its image, and contact passes it by.
    pub(super) is_outer: bool,
}

impl Node {
    /// The body of clay of `key`, and which divisions it is beyond: untagged clay is nowhere beyond, it moves
    /// with the owners.
    pub(super) fn place(&self, key: ClassKey) -> (u16, u32) {
        let is_beyond = |d: &Division| key.side(d.sheet) == -d.owner;
        (key.body(), self.divisions.iter().enumerate().map(|(i, d)| u32::from(is_beyond(d)) << i).sum())
    }

    /// Which of the fields the clay of `key` moves in, if there is any such clay.
    pub(super) fn field_index(&self, key: ClassKey) -> Option<usize> {
        let place = self.place(key);
        self.fields.iter().position(|field| field.place() == place)
    }

    /// The field in which the clay of `key` moves, if there is any such clay.
    pub(super) fn field(&self, key: ClassKey) -> Option<&Field> {
        self.field_index(key).map(|at| &self.fields[at])
    }

    /// The side of division `i` on which a field is.
    pub(super) fn side(&self, field: &Field, i: usize) -> i8 {
        let owner = self.divisions[i].owner;
        if field.beyond >> i & 1 == 1 { -owner } else { owner }
    }
}

/// The nodes about the clay: the dense box of all stencils and one node more, so that a wall node in use has
/// both its neighbours.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    low: IVec3,
    size: IVec3,
    /// The nodes, z fastest.
    pub(super) nodes: Vec<Node>,
}

impl Grid {
    /// Empty nodes about the particles at `positions` \[cells\].
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
