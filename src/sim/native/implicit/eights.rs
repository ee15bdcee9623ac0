//! Particles as a step's evaluations see them: what does not change within it, in eights, and what the grid
//! starts from.

use super::super::kernel::{Place, Stencil, Tile, stencil};
use super::super::law::Sym8;
use super::super::simd::{F8, Lanes};
use super::super::state::{Hot, MARGIN, strains, unpack_cell};
use super::super::step::Step;
use super::tile::{Stencils, Tile4};
use glam::IVec3;

/// Eight particles of a class, in the order of the sort; idle lanes have no mass.
#[derive(Clone, Debug)]
pub(super) struct Eight {
    /// Position in the step's middle, relative to the first of its 3 nodes along each axis.
    pub(super) f: [F8; 3],
    /// Tile index of the first node.
    pub(super) first: [u32; 8],
    /// E at the step's start.
    pub(super) strain: Sym8,
    pub(super) mass: F8,
    /// Greatest |dev H| at rest.
    pub(super) yield_norm: F8,
    /// How much of its volume ratio is its cell's [-]: within the step by the first guess.
    pub(super) share: F8,
    /// By how much a particle can move before it touches a tool or a separating wall \[cells\].
    pub(super) clear: F8,
}

/// A cell whose particles share their volumes: the first of the class's, and the end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) first: usize,
    pub(super) end: usize,
    /// Sums of the shares by mass, and of their squares.
    pub(super) weight: f64,
    pub(super) square: f64,
}

impl Cell {
    /// Eights that are under way until its last particle is there.
    pub(super) fn window(&self) -> usize {
        self.end.div_ceil(8) - self.first / 8
    }
}

/// The particles of a class of a block, and what they bring to the nodes.
#[derive(Debug)]
pub(super) struct Class {
    pub(super) block: IVec3,
    /// Of the block, and of the class in it.
    pub(super) index: (usize, usize),
    /// The slot in which its block stands.
    pub(super) slot: usize,
    /// The first of its particles, and how many they are.
    pub(super) particles: (usize, usize),
    pub(super) eights: Vec<Eight>,
    /// The cells in which volumes are shared.
    pub(super) shared: Vec<Cell>,
    /// What stress and contact bring.
    pub(super) forces: Tile4,
    /// What contact alone brings, where tools or walls are near; in the first evaluation its stiffness, the
    /// diagonal and what is beside it.
    pub(super) contact: Option<Box<[Tile4; 2]>>,
    /// Whether a tool or a separating wall touches any of them where they stand as the step begins.
    pub(super) is_touched: bool,
}

impl Default for Class {
    fn default() -> Self {
        Self {
            block: IVec3::ZERO,
            index: (0, 0),
            slot: 0,
            particles: (0, 0),
            eights: vec![],
            shared: vec![],
            forces: Tile4::ZERO,
            contact: None,
            is_touched: false,
        }
    }
}

/// Eight particles where the step's stencils stand.
struct Middle {
    cell: [[i32; 3]; 8],
    x: [F8; 3],
}

#[inline(always)]
fn middle(particles: &[Hot], place: &Place<'_>) -> Middle {
    let mut out = Middle { cell: [[0; 3]; 8], x: [F8::ZERO; 3] };
    for k in 0..8 {
        let p = &particles[if k < particles.len() { k } else { 0 }];
        let cell = unpack_cell(p.cell);
        for d in 0..3 {
            out.cell[k][d] = cell[d] - place.origin[d];
            out.x[d].0[k] = p.offset[d] + (0.5 * p.velocity[d]).clamp(-MARGIN, MARGIN);
        }
    }
    if let Some((low, high)) = place.room {
        for d in 0..3 {
            for k in 0..8 {
                let cell = out.cell[k][d] as f32;
                out.x[d].0[k] = out.x[d].0[k].clamp(low[d] - cell, high[d] - cell);
            }
        }
    }
    out
}

/// Grid coordinates \[cells\] of the first particles of a chunk at the step's middle.
pub(super) fn middles(particles: &[Hot], place: &Place<'_>) -> [[f64; 3]; 8] {
    let m = middle(particles, place);
    std::array::from_fn(|k| std::array::from_fn(|d| f64::from(place.origin[d] + m.cell[k][d]) + f64::from(m.x[d].0[k])))
}

impl Eight {
    /// The particles of a chunk, which yield as fresh clay does and are far from everything.
    #[inline(always)]
    fn new(step: &Step, chunk: &[Hot], s: &Stencil) -> Self {
        let far = F8::splat(f32::INFINITY);
        let mut out =
            Self { f: s.f, first: [0; 8], strain: strains(chunk), mass: F8::ZERO, yield_norm: far, share: F8::ZERO, clear: far };
        for k in 0..8 {
            out.first[k] = s.first[k] as u32;
        }
        for (k, p) in chunk.iter().enumerate() {
            (out.mass.0[k], out.yield_norm.0[k]) = (p.mass, step.yield_norm);
        }
        out
    }

    /// Where the particles stand on their nodes.
    #[inline(always)]
    pub(super) fn stencils(&self) -> Stencils {
        Stencils::of(&self.f, &self.first)
    }
}

/// Makes the eights of a class, and scatters `[p, m, D, fill]`: momentum, mass, the splines' diagonal, and
/// the volume in cells by their low corners.
#[inline(always)]
pub(super) fn found_with<L: Lanes>(step: &Step, place: &Place<'_>, hot: &[Hot], eights: &mut Vec<Eight>, out: &mut Tile) {
    *out = Tile::ZERO;
    eights.clear();
    let mu = 0.5 * step.law.mu2;
    // Numbers stored one by one, and then read as a row, would be waited for.
    let last = L::load_row(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    for chunk in hot.chunks(8) {
        let middle = middle(chunk, place);
        let s = stencil(&middle.cell, &middle.x);
        eights.push(Eight::new(step, chunk, &s));
        for (k, p) in chunk.iter().enumerate() {
            scatter_one::<L>((mu, mu + step.law.lambda), p, &s, k, out);
            let shares: [[f32; 2]; 3] = std::array::from_fn(|d| [1.5 - s.f[d].0[k], s.f[d].0[k] - 0.5]);
            for c in 0..8 {
                let [i, j, l] = [c >> 2, c >> 1 & 1, c & 1];
                let share = shares[0][i] * shares[1][j] * shares[2][l];
                let to = &mut out.0[s.first[k] + (i * 7 + j) * 8 + l];
                L::splat(p.mass / 8.0 * share).times_plus(last, L::load(to)).store(to);
            }
        }
    }
}

/// What one particle brings: sums of a term for each axis, by the weight and, the diagonal, by its square.
#[inline(always)]
fn scatter_one<L: Lanes>((mu, both): (f32, f32), p: &Hot, s: &Stencil, k: usize, out: &mut Tile) {
    let zero = L::splat(0.0);
    let (mut terms, mut weights) = ([[zero; 3]; 3], [[zero; 3]; 3]);
    let mass = p.mass;
    let [vx, vy, vz] = p.velocity.map(|v| mass * v);
    let still = L::load_row(&[vx, vy, vz, mass, 0.0, 0.0, 0.0, 0.0]);
    for axis in 0..3 {
        let ([x, y, z], stiff) = (p.affine[axis], [0, 1, 2].map(|d| if d == axis { both + mu } else { mu }));
        let slopes = L::load_row(&[x, y, z, 0.0, stiff[0], stiff[1], stiff[2], 0.0]);
        for i in 0..3 {
            let arm = i as f32 - s.f[axis].0[k];
            let (once, twice) = (mass * arm, 4.0 * mass * arm * arm);
            let term = L::halves(once, twice).times(slopes);
            terms[axis][i] = if axis == 0 { term.plus(still) } else { term };
            let w = s.weights[axis][i].0[k];
            weights[axis][i] = L::halves(w, w * w);
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            let (term, weight) = (terms[0][i].plus(terms[1][j]), weights[0][i].times(weights[1][j]));
            for z in 0..3 {
                let to = &mut out.0[s.first[k] + (i * 7 + j) * 8 + z];
                term.plus(terms[2][z]).times_plus(weight.times(weights[2][z]), L::load(to)).store(to);
            }
        }
    }
}
