//! What moves: one displacement for each field of each node, and which of them the clay of a class has at a
//! node.
//!
//! An outer node of a folded column moves as the image of the inner one, a wall node keeps 0 in the folded
//! components, so that walls are no constraints but part of how unknowns become displacements. A field with
//! less than [`ACTIVE_MASS`] of a full cell's mass is no unknown: it starts with its own momentum, then goes
//! along with its neighbours.

use super::super::super::cut::ClassKey;
use super::super::super::implicit::ACTIVE_MASS;
use super::super::grid::Grid;
use super::super::tools::Surroundings;
use super::super::walls::Column;
use glam::{DVec3, IVec3};
use std::collections::BTreeMap;

/// One unknown displacement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unknown {
    /// Where its node stands.
    pub(super) node: IVec3,
    /// A class that moves with it.
    pub(super) key: ClassKey,
    /// Mass \[kg\], folded.
    pub(super) mass: f64,
    /// Velocity [m/s] without stress and contact, with gravity.
    pub(super) velocity: DVec3,
    /// Components to be found: 1, or 0 where a wall or too little mass settles them.
    pub(super) free: DVec3,
    /// 1 where clay moves, however little it is, -1 where a wall holds it.
    pub(super) live: DVec3,
}

/// How the clay of one class at one node moves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    /// With which unknown.
    pub(super) unknown: usize,
    /// As its image, component by component: -1, 0 or 1.
    pub(super) image: DVec3,
    /// Mass \[kg\] of the class at the node itself.
    pub(super) mass: f64,
    /// Its momentum without stress and contact, with gravity [kg m/s].
    pub(super) momentum: DVec3,
    /// Whether the node is part of a column that a wall folded.
    pub(super) is_at_wall: bool,
}

/// The unknowns of a step and the seats of all classes at all nodes.
#[derive(Clone, Debug)]
pub(super) struct Unknowns {
    pub(super) all: Vec<Unknown>,
    pub(super) seats: Vec<Seat>,
    /// The first seat of each node, in the order of the grid's nodes; seats follow the node's classes.
    first_seat: Vec<usize>,
    /// The first unknown of each node, in the order of its fields; none of outer nodes.
    first_unknown: Vec<usize>,
    /// The columns that walls folded: nodes from beyond the wall inwards, and what becomes of each component
    /// in the image.
    columns: Vec<([IVec3; 3], DVec3)>,
}

impl Unknowns {
    /// The unknowns of a grid with velocities set and walls folded.
    pub(super) fn new(grid: &Grid, columns: &[Column], around: &Surroundings) -> Self {
        let full = around.plan.inertial_density() * around.domain.cell_width.powi(3);
        let (mut all, mut first_unknown) = (vec![], vec![]);
        let links = links(grid, columns);
        for ((node, at), link) in grid.coordinates().zip(&grid.nodes).zip(&links) {
            first_unknown.push(all.len());
            if link.inner.is_some() {
                continue;
            }
            for field in &at.fields {
                let key = at.folded.iter().map(|(key, _)| key).find(|key| at.place(*key) == field.place());
                let is_active = field.sum.mass > ACTIVE_MASS * full;
                let free = if is_active { link.image } else { DVec3::ZERO };
                let key = key.unwrap_or(ClassKey::FIRST);
                let live = if field.sum.mass > 0.0 { 2.0 * link.image - 1.0 } else { DVec3::ZERO };
                all.push(Unknown { node, key, mass: field.sum.mass, velocity: field.velocity, free, live });
            }
        }
        let places: Vec<IVec3> = grid.coordinates().collect();
        let column = |c: &Column| ([c.outer, c.wall, c.inner].map(|node| places[node]), c.image);
        let columns = columns.iter().map(column).collect();
        let mut unknowns = Self { all, seats: vec![], first_seat: vec![], first_unknown, columns };
        for (index, (node, at)) in grid.coordinates().zip(&grid.nodes).enumerate() {
            unknowns.first_seat.push(unknowns.seats.len());
            let gravity = around.gravity_step(node);
            for (key, sum) in at.classes.iter() {
                let (inner, image) = follow(&links, index);
                let Some(unknown) = unknowns.of_field(grid, inner, key) else { continue };
                let momentum = sum.momentum + sum.mass * gravity;
                unknowns.seats.push(Seat { unknown, image, mass: sum.mass, momentum, is_at_wall: at.is_at_wall });
            }
        }
        unknowns
    }

    /// The unknown with which clay of `key` moves at the node of index `node`, if any does there.
    pub(super) fn of_field(&self, grid: &Grid, node: usize, key: ClassKey) -> Option<usize> {
        let field = grid.nodes[node].field_index(key)?;
        let unknown = self.first_unknown[node] + field;
        (unknown < self.first_unknown.get(node + 1).copied().unwrap_or(self.all.len())).then_some(unknown)
    }

    /// The first unknown of the node of index `node`, in the order of its fields; of an outer one the next
    /// node's.
    pub(super) fn first_of(&self, node: usize) -> usize {
        self.first_unknown[node]
    }

    /// What walls hold of nodes beyond them, where there is clay before: -1, or 0.
    pub(super) fn outer(&self, grid: &Grid) -> Vec<((IVec3, ClassKey), DVec3)> {
        let mut held = vec![];
        for ([outer, _, inner], image) in &self.columns {
            let Some(node) = grid.index(*inner) else { continue };
            let end = self.first_unknown.get(node + 1).copied().unwrap_or(self.all.len());
            for unknown in self.all[self.first_unknown[node]..end].iter().filter(|unknown| unknown.mass > 0.0) {
                held.push(((*outer, unknown.key), (*image - 1.0) * 0.5));
            }
        }
        held
    }

    /// Brings what cells beyond walls have to their images.
    pub(super) fn fold_cells(&self, cells: &mut BTreeMap<([i32; 3], ClassKey), f64>) {
        for axis in 0..3 {
            for ([outer, wall, inner], _) in &self.columns {
                let step = wall[axis] - outer[axis];
                if step == 0 {
                    continue;
                }
                let [from, to] = if step > 0 { [outer, wall] } else { [wall, inner] }.map(|node| node.to_array());
                let keys: Vec<ClassKey> =
                    cells.range((from, ClassKey::FIRST)..).take_while(|c| c.0.0 == from).map(|c| c.0.1).collect();
                for key in keys {
                    let got = cells.remove(&(from, key)).unwrap_or_default();
                    *cells.entry((to, key)).or_default() += got;
                }
            }
        }
    }

    /// The seat of the class `key` at the node of index `node`.
    pub(super) fn seat(&self, grid: &Grid, node: usize, key: ClassKey) -> Option<usize> {
        Some(self.first_seat[node] + grid.nodes[node].classes.iter().position(|class| class.0 == key)?)
    }

    /// The unknowns' components that are free, the others 0.
    pub(super) fn masked(&self, mut of_unknowns: Vec<DVec3>) -> Vec<DVec3> {
        of_unknowns.iter_mut().zip(&self.all).for_each(|(value, unknown)| *value *= unknown.free);
        of_unknowns
    }
}

/// What walls make of a node.
#[derive(Clone, Copy, Debug)]
struct Link {
    /// The node that an outer one is the image of.
    inner: Option<usize>,
    /// Components that stay, of an outer node as images of the inner one's.
    image: DVec3,
}

fn links(grid: &Grid, columns: &[Column]) -> Vec<Link> {
    let mut links = vec![Link { inner: None, image: DVec3::ONE }; grid.nodes.len()];
    for column in columns {
        links[column.wall].image *= 0.5 * (column.image + 1.0);
        let outer = &mut links[column.outer];
        (outer.inner, outer.image) = (Some(column.inner), outer.image * column.image);
    }
    links
}

/// The node that moves in place of node `index`, and as which image.
fn follow(links: &[Link], mut index: usize) -> (usize, DVec3) {
    let mut image = DVec3::ONE;
    while let Some(inner) = links[index].inner {
        image *= links[index].image;
        index = inner;
    }
    (index, image * links[index].image)
}
