//! The preconditioner: one V-cycle for three scalar operators on the nodes, which know of the particles only
//! how full each cell is.
//!
//! Component a has, on level l with cells of `H = 2^l dx`,
//! `A_a = sum over cells phi H [(lambda + 2 mu) K_a + mu K_b + mu K_c] + extra`, `K_a = k x m x m` with k
//! along axis a, `k = [1 -1; -1 1]`, `m = [2 1; 1 2] / 6`: trilinear elements of the linear law without the
//! terms that couple components. `phi` is the clay's rest volume over the cell's, of each class apart, which
//! a particle brings to the eight cells whose middles are about it; beyond walls it is brought back. Of a
//! coarse cell it is the mean of its eight. The extra diagonal is inertia `m / h^2` and the springs of
//! contact, of which the finest level has the diagonal. Coarse levels have them restricted, as matrices, and
//! of those the sums of each row's magnitudes: no softer in any direction.
//!
//! Nodes with too little clay to be unknowns of the step are unknowns here, with nothing to be solved for:
//! the surface of clay is free, and a body moves as one. Of a coarse node see [`Layout::coarser`].
//!
//! A cycle: `z = w r / diag`, the rest of r restricted (the transpose of trilinear interpolation), solved on
//! the coarser level by the same, interpolated, added, and smoothed once more by `w / diag`. `diag` is that
//! of A, on the finest level with the splines' own where that is more, since near the surface they are
//! stiffer. `w = 1.8 / l`, `l = 4.5 (lambda + 2 mu) / (lambda + 4 mu)` the elements' own bound of the
//! greatest eigenvalue of `diag^-1 A`, whatever the fill. On the coarsest level, of at most [`DIRECT_MAX`]
//! free unknowns, exactly.

use super::super::super::cut::ClassKey;
use super::super::super::implicit::{COARSE_SCALE, CYCLE_SCALE, DIRECT_MAX, LEVELS_MAX, PIVOT_MIN, smoothing};
use glam::{DMat3, DVec3, IVec3};
use std::collections::{BTreeMap, BTreeSet};

/// A symmetric matrix by rows, and its diagonal.
#[derive(Clone, Debug, Default)]
struct Matrix {
    rows: Vec<Vec<(usize, f64)>>,
    diagonal: Vec<f64>,
}

/// One level: the same unknowns for the three components.
#[derive(Clone, Debug)]
struct Level {
    /// 1 where clay moves, else 0.
    free: Vec<DVec3>,
    matrices: [Matrix; 3],
    /// What the smoother divides by.
    diagonal: Vec<DVec3>,
    /// Of each unknown, those of the next level that it is interpolated from.
    parents: Vec<Vec<(usize, f64)>>,
}

/// The V-cycle of a step.
#[derive(Clone, Debug)]
pub(in crate::sim) struct Multigrid {
    levels: Vec<Level>,
    /// Cholesky's factors of the last level, by component: rows of the lower triangle.
    factors: [Vec<Vec<f64>>; 3],
    smoothing: f64,
}

/// What the finest level is made of.
pub(in crate::sim) struct Finest<'a> {
    /// Node and class of each unknown.
    pub(in crate::sim) places: Vec<(IVec3, ClassKey)>,
    /// Of each, by component: 1 where clay moves, however little it is, -1 where a wall holds it, else 0.
    pub(in crate::sim) live: Vec<DVec3>,
    /// The same of nodes that are images of others: -1 or 0.
    pub(in crate::sim) outer: Vec<((IVec3, ClassKey), DVec3)>,
    /// The unknown with which clay of a class moves at a node.
    pub(in crate::sim) find: Box<dyn Fn(IVec3, ClassKey) -> Option<usize> + 'a>,
    /// How full each cell is of each class.
    pub(in crate::sim) fill: BTreeMap<([i32; 3], ClassKey), f64>,
    /// The splines' diagonal \[N/m\].
    pub(in crate::sim) diagonal: Vec<DVec3>,
    /// Inertia and contact \[N/m\].
    pub(in crate::sim) extra: Vec<DMat3>,
    /// Moduli \[Pa\].
    pub(in crate::sim) mu: f64,
    pub(in crate::sim) lambda: f64,
    /// Width of its cells \[m\].
    pub(in crate::sim) cell_width: f64,
}

/// Finds the unknown with which clay of a class moves at a node.
type Find<'a> = Box<dyn Fn(IVec3, ClassKey) -> Option<usize> + 'a>;

/// The cells and nodes of one level.
struct Layout<'a> {
    fill: BTreeMap<([i32; 3], ClassKey), f64>,
    /// Node and class of each unknown.
    places: Vec<(IVec3, ClassKey)>,
    /// As in [`Finest`].
    live: Vec<DVec3>,
    outer: Vec<((IVec3, ClassKey), DVec3)>,
    find: Find<'a>,
    /// Cells of the finest level along one of this.
    scale: i32,
}

impl Multigrid {
    /// The operators of a step.
    pub(in crate::sim) fn new(finest: Finest<'_>) -> Self {
        let Finest { places, live, outer, find, fill, diagonal, mut extra, mu, lambda, cell_width } = finest;
        let moduli = [0, 1, 2].map(|a| DVec3::splat(mu) + DVec3::AXES[a] * (lambda + mu));
        let mut layout = Layout { fill, places, live, outer, find, scale: 1 };
        let mut splines = Some(diagonal);
        let mut levels: Vec<Level> = vec![];
        loop {
            layout.keep_filled();
            let free: Vec<DVec3> = layout.live.iter().map(|live| live.max(DVec3::ZERO)).collect();
            extra.iter_mut().zip(&free).for_each(|(extra, free)| *extra = among(extra, *free));
            let added: Vec<DVec3> =
                extra.iter().map(|extra| if levels.is_empty() { diagonal_of(extra) } else { row_sums(extra) }).collect();
            let width = cell_width * f64::from(layout.scale);
            let mut matrices = [0, 1, 2].map(|a| elements(&layout, moduli[a] * width, a, &free));
            let own = |i: usize| DVec3::from_array([0, 1, 2].map(|a| matrices[a].diagonal[i]));
            let stiffest = |i: usize| splines.as_ref().map_or(own(i), |splines| splines[i].max(own(i)));
            let diagonal = (0..free.len()).map(|i| stiffest(i) + added[i]).collect();
            for (a, matrix) in matrices.iter_mut().enumerate() {
                matrix.add_to_diagonal(&added.iter().map(|added| added[a]).collect::<Vec<_>>());
            }
            splines = None;
            let (count, (mut coarse, parents)) = (count(&free), layout.coarser());
            coarse.keep_filled();
            let coarser = self::count(&coarse.live);
            if count <= DIRECT_MAX || coarser == count || levels.len() + 1 == LEVELS_MAX {
                let factors = [0, 1, 2].map(|a| matrices[a].factored(&free, a));
                levels.push(Level { free, matrices, diagonal, parents: vec![] });
                return Self { levels, factors, smoothing: smoothing(mu, lambda) };
            }
            let mut restricted = vec![DMat3::ZERO; coarse.places.len()];
            for (i, of) in parents.iter().enumerate() {
                of.iter().for_each(|(parent, weight)| restricted[*parent] += extra[i] * *weight);
            }
            levels.push(Level { free, matrices, diagonal, parents });
            (layout, extra) = (coarse, restricted);
        }
    }

    #[cfg(test)]
    pub(in crate::sim) fn level_count(&self) -> usize {
        self.levels.len()
    }

    /// An approximation of `A^-1 r`, 0 where nothing is free.
    pub(in crate::sim) fn cycle(&self, residual: &[DVec3]) -> Vec<DVec3> {
        self.on_level(0, residual).into_iter().map(|z| CYCLE_SCALE * z).collect()
    }

    fn on_level(&self, level: usize, residual: &[DVec3]) -> Vec<DVec3> {
        let at = &self.levels[level];
        if level + 1 == self.levels.len() {
            return self.solve(residual);
        }
        let smooth = |r: DVec3, i: usize| self.smoothing * at.free[i] * r / at.diagonal[i].max(DVec3::splat(f64::MIN_POSITIVE));
        let mut z: Vec<DVec3> = residual.iter().enumerate().map(|(i, r)| smooth(*r, i)).collect();
        let left = at.left_over(residual, &z);
        let mut restricted = vec![DVec3::ZERO; self.levels[level + 1].free.len()];
        for (left, parents) in left.iter().zip(&at.parents) {
            parents.iter().for_each(|(parent, weight)| restricted[*parent] += *weight * *left);
        }
        for (value, free) in restricted.iter_mut().zip(&self.levels[level + 1].free) {
            *value *= *free;
        }
        let coarse = self.on_level(level + 1, &restricted);
        for (i, z) in z.iter_mut().enumerate() {
            let correction: DVec3 = at.parents[i].iter().map(|(parent, weight)| *weight * coarse[*parent]).sum();
            *z += COARSE_SCALE * at.free[i] * correction;
        }
        let left = at.left_over(residual, &z);
        z.iter().zip(&left).enumerate().map(|(i, (z, left))| *z + smooth(*left, i)).collect()
    }

    /// The last level, by its factors.
    fn solve(&self, residual: &[DVec3]) -> Vec<DVec3> {
        let of_component = |a: usize| {
            let factor = &self.factors[a];
            let mut x: Vec<f64> = residual.iter().map(|r| r[a]).collect();
            for i in 0..x.len() {
                let sum: f64 = factor[i][..i].iter().zip(&x).map(|(l, x)| l * x).sum();
                x[i] = (x[i] - sum) / factor[i][i];
            }
            for i in (0..x.len()).rev() {
                let sum: f64 = (i + 1..x.len()).map(|k| factor[k][i] * x[k]).sum();
                x[i] = (x[i] - sum) / factor[i][i];
            }
            x
        };
        let [x, y, z] = [0, 1, 2].map(of_component);
        let last = &self.levels[self.levels.len() - 1];
        (0..residual.len()).map(|i| last.free[i] * DVec3::new(x[i], y[i], z[i])).collect()
    }
}

impl Level {
    /// `r - A z`, 0 where nothing is free.
    fn left_over(&self, residual: &[DVec3], z: &[DVec3]) -> Vec<DVec3> {
        let of = |i: usize| {
            let product = [0, 1, 2].map(|a| self.matrices[a].rows[i].iter().map(|(k, entry)| entry * z[*k][a]).sum());
            self.free[i] * (residual[i] - DVec3::from_array(product))
        };
        (0..residual.len()).map(of).collect()
    }
}

impl Matrix {
    fn add(&mut self, row: usize, column: usize, value: f64) {
        if row == column {
            self.diagonal[row] += value;
        }
        match self.rows[row].iter_mut().find(|entry| entry.0 == column) {
            Some(entry) => entry.1 += value,
            None => self.rows[row].push((column, value)),
        }
    }

    fn add_to_diagonal(&mut self, more: &[f64]) {
        more.iter().enumerate().for_each(|(i, value)| self.add(i, i, *value));
    }

    /// The lower triangle's Cholesky factor, rows of what is not free those of the identity.
    fn factored(&self, free: &[DVec3], a: usize) -> Vec<Vec<f64>> {
        let n = self.rows.len();
        let mut dense = vec![vec![0.0; n]; n];
        for (i, row) in self.rows.iter().enumerate() {
            row.iter().for_each(|(k, value)| dense[i][*k] = *value);
            if free[i][a] == 0.0 || self.diagonal[i] <= 0.0 {
                dense[i].fill(0.0);
                dense[i][i] = 1.0;
            }
        }
        for i in 0..n {
            for k in 0..=i {
                let sum: f64 = (0..k).map(|j| dense[i][j] * dense[k][j]).sum();
                let left = dense[i][k] - sum;
                let pivot = |left: f64| left.max(PIVOT_MIN * self.diagonal[i].max(f64::MIN_POSITIVE)).sqrt();
                dense[i][k] = if i == k { pivot(left) } else { left / dense[k][k] };
            }
        }
        dense
    }
}

/// The elements' matrix of component `a` among what is free.
fn elements(layout: &Layout<'_>, moduli: DVec3, a: usize, free: &[DVec3]) -> Matrix {
    let n = free.len();
    let mut matrix = Matrix { rows: vec![vec![]; n], diagonal: vec![0.0; n] };
    for ((cell, key), fill) in &layout.fill {
        let corners = layout.corners(*cell, *key).map(|found| found.filter(|found| free[*found][a] != 0.0));
        for (i, row) in corners.iter().enumerate() {
            for (k, column) in corners.iter().enumerate() {
                if let (Some(row), Some(column)) = (row, column) {
                    matrix.add(*row, *column, fill * element(moduli, i, k));
                }
            }
        }
    }
    matrix
}

/// What of a matrix is among free components.
fn among(matrix: &DMat3, free: DVec3) -> DMat3 {
    let free = DMat3::from_diagonal(free);
    free * *matrix * free
}

fn diagonal_of(matrix: &DMat3) -> DVec3 {
    DVec3::new(matrix.x_axis.x, matrix.y_axis.y, matrix.z_axis.z)
}

/// The sum of each row's magnitudes: a diagonal that is no softer than the matrix in any direction.
fn row_sums(matrix: &DMat3) -> DVec3 {
    matrix.x_axis.abs() + matrix.y_axis.abs() + matrix.z_axis.abs()
}

/// Unknowns that are free along some axis.
fn count(live: &[DVec3]) -> usize {
    live.iter().filter(|live| live.max_element() > 0.0).count()
}

/// Corner `c` of a cell.
fn corner(c: usize) -> IVec3 {
    IVec3::new(i32::from(c & 1 == 1), i32::from(c >> 1 & 1 == 1), i32::from(c >> 2 & 1 == 1))
}

/// Entry of a unit cell's element between two of its corners.
pub(in crate::sim) fn element(moduli: DVec3, i: usize, k: usize) -> f64 {
    let is_same = [0, 1, 2].map(|axis| (i ^ k) >> axis & 1 == 0);
    let stiffness = is_same.map(|same| if same { 1.0 } else { -1.0 });
    let mass = is_same.map(|same| if same { 1.0 / 3.0 } else { 1.0 / 6.0 });
    moduli.x * stiffness[0] * mass[1] * mass[2]
        + moduli.y * mass[0] * stiffness[1] * mass[2]
        + moduli.z * mass[0] * mass[1] * stiffness[2]
}

/// The nodes that the coarser level interpolates a node from, with their weights.
fn parents_of(node: IVec3) -> impl Iterator<Item = (IVec3, f64)> {
    let low = node.div_euclid(IVec3::splat(2));
    let weight = move |at: IVec3| -> f64 {
        let distance = (at * 2 - node).abs().to_array();
        distance.iter().map(|d| [1.0, 0.5, 0.0][(*d).clamp(0, 2) as usize]).product()
    };
    (0..8).map(move |c| low + corner(c)).map(move |at| (at, weight(at))).filter(|(_, weight)| *weight > 0.0)
}

impl<'a> Layout<'a> {
    /// The unknowns at a cell's corners.
    fn corners(&self, cell: [i32; 3], key: ClassKey) -> [Option<usize>; 8] {
        std::array::from_fn(|c| (self.find)(IVec3::from_array(cell) + corner(c), key))
    }

    /// Clay moves where there is any in a cell about.
    fn keep_filled(&mut self) {
        let mut is_filled = vec![false; self.live.len()];
        for ((cell, key), _) in self.fill.iter().filter(|(_, fill)| **fill > 0.0) {
            self.corners(*cell, *key).into_iter().flatten().for_each(|i| is_filled[i] = true);
        }
        for (live, _) in self.live.iter_mut().zip(is_filled).filter(|(_, is_filled)| !is_filled) {
            *live = live.min(DVec3::ZERO);
        }
    }

    /// The next level, and what each unknown of this one is interpolated from.
    ///
    /// A node has clay of a class that moves where that moves at more of the nodes about it than walls hold,
    /// by the weights of interpolation. It goes with another class where its clay at the same place does;
    /// with clay of no class where none of its own reaches it.
    fn coarser(&self) -> (Self, Vec<Vec<(usize, f64)>>) {
        let mut fill = BTreeMap::<([i32; 3], ClassKey), f64>::new();
        for ((cell, key), of) in &self.fill {
            *fill.entry((cell.map(|c| c.div_euclid(2)), *key)).or_default() += of / 8.0;
        }
        let mut sums = BTreeMap::<([i32; 3], ClassKey), DVec3>::new();
        let all = self.places.iter().copied().zip(self.live.iter().copied()).chain(self.outer.iter().copied());
        for ((node, key), live) in all {
            for (parent, weight) in parents_of(node) {
                *sums.entry((parent.to_array(), key)).or_default() += weight * live;
            }
        }
        let filled = self.fill.iter().filter(|(_, fill)| **fill > 0.0);
        let corners = filled.flat_map(|((cell, key), _)| (0..8).map(|c| (IVec3::from_array(*cell) + corner(c), *key)));
        let reached: BTreeSet<_> = corners.map(|(node, key)| (node.to_array(), key)).collect();
        let mut leaders = BTreeMap::new();
        for (node, key) in sums.keys() {
            let same = IVec3::from_array(*node) * 2;
            let is_reached = reached.contains(&(same.to_array(), *key));
            let found = (self.find)(same, *key).filter(|found| is_reached && self.live[*found] != DVec3::ZERO);
            let fine = found.map(|found| self.places[found]);
            if let Some((_, leader)) = fine.filter(|(at, leader)| *at == same && leader != key) {
                leaders.insert((*node, *key), leader);
            }
        }
        for ((node, key), leader) in &leaders {
            let sum = sums.remove(&(*node, *key)).unwrap_or_default();
            *sums.entry((*node, *leader)).or_default() += sum;
        }
        let alone = |((node, key), sum): (&([i32; 3], ClassKey), &DVec3)| {
            let leader = leaders.get(&(*node, key.without_sides())).copied().unwrap_or(key.without_sides());
            (*sum == DVec3::ZERO && *key != leader).then_some(((*node, *key), leader))
        };
        let alone: Vec<_> = sums.iter().filter_map(alone).collect();
        for (place, _) in &alone {
            sums.remove(place);
        }
        leaders.extend(alone);
        let index: BTreeMap<_, usize> = sums.keys().copied().zip(0..).collect();
        let find: Find<'a> = Box::new(move |node, key| {
            let node = node.to_array();
            let of = |key: ClassKey| index.get(&(node, leaders.get(&(node, key)).copied().unwrap_or(key))).copied();
            of(key).or_else(|| of(key.without_sides()))
        });
        let parents = self
            .places
            .iter()
            .map(|(node, key)| parents_of(*node).filter_map(|(parent, weight)| Some((find(parent, *key)?, weight))).collect());
        let parents = parents.collect();
        let places = sums.keys().map(|(node, key)| (IVec3::from_array(*node), *key)).collect();
        let sign = |sum: f64| if sum == 0.0 { 0.0 } else { sum.signum() };
        let live = sums.values().map(|sum| DVec3::from_array(sum.to_array().map(sign))).collect();
        (Self { fill, places, live, outer: vec![], find, scale: 2 * self.scale }, parents)
    }
}
