//! The coarsest level, exactly: Cholesky's factors in f64, by component.
//!
//! Unknowns stand in the order of their nodes, x slowest, and rows of the factors from their first entry that
//! is not 0 on: what lies before stays 0.

use super::super::super::super::implicit::PIVOT_MIN;
use super::super::super::super::params::BLOCK;
use super::super::super::nodes::{local, offset};
use super::super::vectors::Block1;
use super::level::Level;
use glam::IVec3;

/// The unknowns of the last level, and where the factors' entries are.
#[derive(Debug, Default)]
pub(super) struct Direct {
    /// Slot and node of each unknown.
    nodes: Vec<(u32, u8)>,
    /// The unknown + 1 that each node moves with; 0 if there is none.
    unknowns: Vec<[u32; 64]>,
    /// The first column of each row, and where it is stored.
    rows: Vec<(usize, usize)>,
    pairs: Vec<Pair>,
}

/// The factor of one component, and its solution.
#[derive(Debug, Default)]
pub(super) struct Factor {
    entries: Vec<f64>,
    x: Vec<f64>,
}

impl Direct {
    /// Takes the operator of a level, and finds its factors.
    pub(super) fn set_up(&mut self, factors: [&mut Factor; 3], level: &Level, moduli: [[f64; 3]; 3]) {
        self.number(level);
        self.find_pairs(level);
        let n = self.nodes.len();
        self.rows.clear();
        self.rows.extend((0..n).map(|i| (i, 0)));
        self.pairs.iter().for_each(|pair| self.rows[pair.row].0 = self.rows[pair.row].0.min(pair.column));
        let mut start = 0;
        for (i, row) in self.rows.iter_mut().enumerate() {
            row.1 = start;
            start += i + 1 - row.0;
        }
        let (rows, nodes, pairs) = (&self.rows, &self.nodes, &self.pairs);
        for (a, factor) in factors.into_iter().enumerate() {
            factor.x.resize(n, 0.0);
            factor.entries.clear();
            factor.entries.resize(start, 0.0);
            let is_free = |i: usize| level.inverse[nodes[i].0 as usize].0[a][usize::from(nodes[i].1)] > 0.0;
            for pair in pairs.iter().filter(|pair| is_free(pair.row) && is_free(pair.column)) {
                let (first, start) = rows[pair.row];
                factor.entries[start + pair.column - first] += pair.fill * element(moduli[a], pair.differs);
            }
            for (i, (slot, node)) in nodes.iter().enumerate() {
                let own = level.added[*slot as usize].0[a][usize::from(*node)];
                let at = rows[i].1 + i - rows[i].0;
                factor.entries[at] = if is_free(i) { factor.entries[at] + f64::from(own) } else { 1.0 };
            }
            factor.factorise(rows);
        }
    }

    /// Numbers the unknowns.
    fn number(&mut self, level: &Level) {
        self.nodes.clear();
        for (slot, inverse) in level.inverse.iter().enumerate() {
            let is_free = |node: &usize| (0..3).any(|a| inverse.0[a][*node] > 0.0);
            self.nodes.extend((0..64).filter(is_free).map(|node| (slot as u32, node as u8)));
        }
        let at = |&(slot, node): &(u32, u8)| {
            let place = level.layout.slots[slot as usize];
            ((place.block * BLOCK + offset(node.into())).to_array(), slot)
        };
        self.nodes.sort_unstable_by_key(at);
        self.unknowns.clear();
        self.unknowns.resize(level.layout.slots.len(), [0; 64]);
        for ((slot, node), unknown) in self.nodes.iter().zip(1..) {
            self.unknowns[*slot as usize][usize::from(*node)] = unknown;
        }
        for tie in level.layout.links.iter().rev() {
            self.unknowns[tie.from.0 as usize][usize::from(tie.from.1)] = self.unknowns[tie.to.0 as usize][usize::from(tie.to.1)];
        }
    }

    /// The entries of the cells' matrices on and before the diagonal.
    fn find_pairs(&mut self, level: &Level) {
        self.pairs.clear();
        for (slot, fill) in level.fill.iter().enumerate() {
            for cell in (0..64).filter(|cell| fill[*cell] > 0.0) {
                let corners: [usize; 8] = std::array::from_fn(|c| {
                    let node = offset(cell) + IVec3::new(c as i32 & 1, c as i32 >> 1 & 1, c as i32 >> 2);
                    let (about, at) = (node / BLOCK, node % BLOCK);
                    let seen = level.layout.neighbours[slot][13 + (about.x + 3 * about.y + 9 * about.z) as usize];
                    let unknowns = seen.checked_sub(1).map(|seen| &self.unknowns[seen as usize]);
                    unknowns.map_or(0, |unknowns| unknowns[local(at.x, at.y, at.z)] as usize)
                });
                for (i, k) in (0..64).map(|ik| (ik / 8, ik % 8)) {
                    if corners[k] > 0 && corners[i] >= corners[k] {
                        let (row, column) = (corners[i] - 1, corners[k] - 1);
                        self.pairs.push(Pair { row, column, differs: i ^ k, fill: fill[cell].into() });
                    }
                }
            }
        }
    }

    /// The solution for `residual`, which slots have at nodes; `solution` stays as it is where nothing is
    /// free.
    pub(super) fn solve(&self, factor: &mut Factor, residual: impl Fn(usize, usize) -> f32, solution: &mut [Block1]) {
        for (x, (slot, node)) in factor.x.iter_mut().zip(&self.nodes) {
            *x = residual(*slot as usize, usize::from(*node)).into();
        }
        factor.solve(&self.rows);
        for (x, (slot, node)) in factor.x.iter().zip(&self.nodes) {
            solution[*slot as usize].0[usize::from(*node)] = *x as f32;
        }
    }
}

/// A cell's share in an entry: along which axes its corners differ, a bit each.
#[derive(Debug)]
struct Pair {
    row: usize,
    column: usize,
    differs: usize,
    fill: f64,
}

/// Entry of a cell's element between two of its corners.
fn element(moduli: [f64; 3], differs: usize) -> f64 {
    let entry = |axis: usize, k: [f64; 2]| k[differs >> axis & 1];
    let [k, m] = [[1.0, -1.0], [1.0 / 3.0, 1.0 / 6.0]];
    (0..3).map(|a| (0..3).map(|axis| entry(axis, if axis == a { k } else { m })).product::<f64>() * moduli[a]).sum()
}

/// Scalar product, in four sums.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (four, rest) = a.as_chunks::<4>();
    let (other, other_rest) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in four.iter().zip(other) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest.iter().zip(other_rest).map(|(a, b)| a * b).sum::<f64>()
}

impl Factor {
    fn factorise(&mut self, rows: &[(usize, usize)]) {
        for (i, (first, start)) in rows.iter().enumerate() {
            let (before, row) = self.entries.split_at_mut(*start);
            let diagonal = row[i - first];
            for k in *first..i {
                let (other_first, other_start) = rows[k];
                let common = *first.max(&other_first);
                let other = &before[other_start..];
                let sum = dot(&row[common - first..k - first], &other[common - other_first..k - other_first]);
                row[k - first] = (row[k - first] - sum) / other[k - other_first];
            }
            let sum = dot(&row[..i - first], &row[..i - first]);
            row[i - first] = (diagonal - sum).max(PIVOT_MIN * diagonal.max(f64::MIN_POSITIVE)).sqrt();
        }
    }

    /// Solves for what stands in x.
    fn solve(&mut self, rows: &[(usize, usize)]) {
        for (i, (first, start)) in rows.iter().enumerate() {
            let row = &self.entries[*start..=start + i - first];
            self.x[i] = (self.x[i] - dot(&row[..i - first], &self.x[*first..i])) / row[i - first];
        }
        for (i, (first, start)) in rows.iter().enumerate().rev() {
            let row = &self.entries[*start..=start + i - first];
            let x = self.x[i] / row[i - first];
            self.x[i] = x;
            self.x[*first..i].iter_mut().zip(row).for_each(|(value, entry)| *value -= entry * x);
        }
    }
}
