//! The preconditioner: one V-cycle for three scalar operators on the nodes, which know of the particles only
//! how full each cell is.
//!
//! Component a has, on level l with cells of `H = 2^l dx`,
//! `A_a = sum over cells phi H [(lambda + 2 mu) K_a + mu K_b + mu K_c] + extra`, `K_a = k x m x m` with k
//! along axis a, `k = [1 -1; -1 1]`, `m = [2 1; 1 2] / 6`: trilinear elements of the linear law without the
//! terms that couple components. `phi` is the clay's rest volume over the cell's, of each class apart; of a
//! coarse cell the mean of its eight. The extra diagonal is, on the finest level, what the splines' own
//! diagonal `D` has beyond that of the elements (0 at least), inertia `m / h^2` and the springs of contact;
//! coarse levels have the last two restricted, of free components to free ones. Unknowns of coarse nodes are
//! those of the fine node at the same place, as free as these.
//!
//! A cycle: `z = w r / diag`, the rest of r restricted (the transpose of trilinear interpolation), solved on
//! the coarser level by the same, interpolated, added, and smoothed once more by `w / diag`. `w = 1.6 / l`,
//! `l = 4.5 (lambda + 2 mu) / (lambda + 4 mu)` the elements' own bound of the greatest eigenvalue of
//! `diag^-1 A`, whatever the fill. On the coarsest level, of at most [`DIRECT_MAX`] free unknowns, exactly.

use super::super::super::cut::CutKey;
use super::super::super::implicit::{CYCLE_SCALE, DIRECT_MAX, LEVELS_MAX, PIVOT_MIN, smoothing};
use glam::{DVec3, IVec3};
use std::collections::BTreeMap;

/// A symmetric matrix by rows, and its diagonal.
#[derive(Clone, Debug, Default)]
struct Matrix {
    rows: Vec<Vec<(usize, f64)>>,
    diagonal: Vec<f64>,
}

/// One level: the same unknowns for the three components.
#[derive(Clone, Debug)]
struct Level {
    free: Vec<DVec3>,
    matrices: [Matrix; 3],
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
    pub(in crate::sim) places: Vec<(IVec3, CutKey)>,
    /// Components of each that are to be found.
    pub(in crate::sim) free: Vec<DVec3>,
    /// The unknown with which clay of a class moves at a node.
    pub(in crate::sim) find: Box<dyn Fn(IVec3, CutKey) -> Option<usize> + 'a>,
    /// How full each cell is of each class.
    pub(in crate::sim) fill: BTreeMap<([i32; 3], CutKey), f64>,
    /// The splines' diagonal \[N/m\].
    pub(in crate::sim) diagonal: Vec<DVec3>,
    /// Inertia and contact \[N/m\].
    pub(in crate::sim) extra: Vec<DVec3>,
    /// Moduli \[Pa\].
    pub(in crate::sim) mu: f64,
    pub(in crate::sim) lambda: f64,
    /// Width of its cells \[m\].
    pub(in crate::sim) cell_width: f64,
}

/// The fill of cells by class, and the unknowns by their nodes, of one level.
struct Layout {
    fill: BTreeMap<([i32; 3], CutKey), f64>,
    /// Node and class of each unknown.
    places: Vec<(IVec3, CutKey)>,
    /// Of the finest unknown at a place, that of this level.
    of_finest: BTreeMap<usize, usize>,
    scale: i32,
}

impl Layout {
    /// The unknown of `key` at `node` of this level.
    fn find(&self, finest: &Finest<'_>, node: IVec3, key: CutKey) -> Option<usize> {
        self.of_finest.get(&(finest.find)(node * self.scale, key)?).copied()
    }
}

impl Multigrid {
    /// The operators of a step.
    pub(in crate::sim) fn new(finest: &Finest<'_>) -> Self {
        let (mu, lambda) = (finest.mu, finest.lambda);
        let moduli = [0, 1, 2].map(|a| DVec3::splat(mu) + DVec3::AXES[a] * (lambda + mu));
        let mut layout = Layout {
            fill: finest.fill.clone(),
            places: finest.places.clone(),
            of_finest: (0..finest.places.len()).map(|i| (i, i)).collect(),
            scale: 1,
        };
        let mut free = finest.free.clone();
        let mut extra = finest.extra.clone();
        let mut levels: Vec<Level> = vec![];
        loop {
            let cell_width = finest.cell_width * f64::from(layout.scale);
            let matrices = [0, 1, 2].map(|a| {
                let mut matrix = elements(finest, &layout, moduli[a] * cell_width, a, &free);
                let own = |i: usize| if levels.is_empty() { (finest.diagonal[i][a] - matrix.diagonal[i]).max(0.0) } else { 0.0 };
                let more: Vec<f64> = (0..free.len()).map(|i| own(i) + extra[i][a]).collect();
                matrix.add_to_diagonal(&more);
                matrix
            });
            let (coarse, parents) = coarser(finest, &layout);
            let mut coarse_free = vec![DVec3::ZERO; coarse.places.len()];
            for (fine, at) in &coarse.of_finest {
                coarse_free[*at] = finest.free[*fine];
            }
            let (count, coarser) = (count(&free), count(&coarse_free));
            if count <= DIRECT_MAX || coarser == count || levels.len() + 1 == LEVELS_MAX {
                let factors = [0, 1, 2].map(|a| matrices[a].factored(&free, a));
                levels.push(Level { free, matrices, parents: vec![] });
                return Self { levels, factors, smoothing: smoothing(mu, lambda) };
            }
            let mut restricted = vec![DVec3::ZERO; coarse.places.len()];
            for (i, of) in parents.iter().enumerate() {
                of.iter().for_each(|(parent, weight)| restricted[*parent] += *weight * free[i] * extra[i]);
            }
            restricted.iter_mut().zip(&coarse_free).for_each(|(extra, free)| *extra *= *free);
            let fine_free = std::mem::replace(&mut free, coarse_free);
            levels.push(Level { free: fine_free, matrices, parents });
            (layout, extra) = (coarse, restricted);
        }
    }

    #[cfg(test)]
    pub(super) fn level_count(&self) -> usize {
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
        let smooth = |r: DVec3, i: usize| {
            let diagonal = [0, 1, 2].map(|a| at.matrices[a].diagonal[i].max(f64::MIN_POSITIVE));
            self.smoothing * at.free[i] * r / DVec3::from_array(diagonal)
        };
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
            *z += at.free[i] * correction;
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
fn elements(finest: &Finest<'_>, layout: &Layout, moduli: DVec3, a: usize, free: &[DVec3]) -> Matrix {
    let n = free.len();
    let mut matrix = Matrix { rows: vec![vec![]; n], diagonal: vec![0.0; n] };
    for ((cell, key), fill) in &layout.fill {
        let corners: [Option<usize>; 8] = std::array::from_fn(|c| {
            let found = layout.find(finest, IVec3::from_array(*cell) + corner(c), *key)?;
            (free[found][a] != 0.0).then_some(found)
        });
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

/// Unknowns that are free along some axis.
fn count(free: &[DVec3]) -> usize {
    free.iter().filter(|free| **free != DVec3::ZERO).count()
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

/// The next level, and what each unknown of this one is interpolated from.
fn coarser(finest: &Finest<'_>, layout: &Layout) -> (Layout, Vec<Vec<(usize, f64)>>) {
    let mut coarse = Layout { fill: BTreeMap::new(), places: vec![], of_finest: BTreeMap::new(), scale: 2 * layout.scale };
    for ((cell, key), fill) in &layout.fill {
        let parent = cell.map(|c| c.div_euclid(2));
        *coarse.fill.entry((parent, *key)).or_default() += fill / 8.0;
    }
    for (fine, at) in &layout.of_finest {
        let (node, key) = layout.places[*at];
        if node.to_array().iter().all(|n| n.rem_euclid(2) == 0) {
            coarse.of_finest.insert(*fine, coarse.places.len());
            coarse.places.push((node.div_euclid(IVec3::splat(2)), key));
        }
    }
    let parents = layout.places.iter().map(|(node, key)| {
        let mut of = vec![];
        for c in 0..8 {
            let low = node.div_euclid(IVec3::splat(2));
            let at = low + corner(c);
            let distance = (at * 2 - *node).abs();
            let weight: f64 = distance.to_array().iter().map(|d| [1.0, 0.5, 0.0][(*d).clamp(0, 2) as usize]).product();
            if weight > 0.0
                && let Some(parent) = coarse.find(finest, at, *key)
            {
                of.push((parent, weight));
            }
        }
        of
    });
    let parents = parents.collect();
    (coarse, parents)
}
