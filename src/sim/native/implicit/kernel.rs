//! Particle kernels of the implicit step over one class of a block: what the grid starts from, the slope at a
//! place, and the step's end. Eight particles at a time, as in the explicit [`kernel`](super::super::kernel).

use super::super::super::implicit;
use super::super::grid_step::GridReport;
use super::super::kernel::{Brought, Place, Stencil, Tile, gather, scatter, stencil};
use super::super::law::{self, Sym8};
use super::super::simd::{F8, Lanes, Node};
use super::super::state::{Cold, Hot, MARGIN, strains, unpack_cell};
use super::super::step::Step;
use super::contact::Near;
use glam::DVec3;

/// A matrix of eight particles: `m[c][r]`, column c.
type Matrix8 = [[F8; 3]; 3];

/// Least determinants at which no cell counts as turned inside out.
#[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
const DETERMINANT_MIN: f32 = implicit::DETERMINANT_MIN as f32;

/// What a particle keeps within a step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seat {
    /// Greatest |dev H| at rest.
    pub(super) yield_norm: f32,
    /// How much of its volume ratio is its cell's [-].
    pub(super) share: f32,
}

/// Eight particles at a place of the nodes.
#[derive(Clone, Copy)]
pub(super) struct Bent {
    /// H.
    gradient: Matrix8,
    /// By how much they moved \[cells\].
    moved: [F8; 3],
    /// Hencky strain after the return.
    hencky: Sym8,
    plastic: F8,
    /// By how much ln J changes with the cell.
    change: F8,
    /// Mean stress over what its own ln J makes, in units of ln J.
    pressure: F8,
}

impl Bent {
    /// By how much particle `k` moved \[cells\].
    fn way(&self, k: usize) -> DVec3 {
        DVec3::new(self.moved[0].0[k].into(), self.moved[1].0[k].into(), self.moved[2].0[k].into())
    }
}

/// What an evaluation is given for all blocks.
#[derive(Clone, Copy)]
pub(super) struct Evaluation {
    pub(super) step: Step,
    /// Plastic strain within which volumes are shared [-]; 0 for none.
    pub(super) averaging: f32,
    /// Whether it is the step's first: it finds how volumes are shared, and how stiff contact is.
    pub(super) is_first: bool,
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

/// Scatters `[p, m, D, fill]`: momentum, mass, the splines' diagonal, and the volume in cells by their low
/// corners.
#[inline(always)]
pub(super) fn found(step: &Step, place: &Place<'_>, hot: &[Hot], out: &mut Tile) {
    *out = Tile::ZERO;
    let (mu, both) = (0.5 * step.law.mu2, 0.5 * step.law.mu2 + step.law.lambda);
    for chunk in hot.chunks(8) {
        let middle = middle(chunk, place);
        let s = stencil(&middle.cell, &middle.x);
        for (k, p) in chunk.iter().enumerate() {
            for n in 0..27 {
                let at = [n / 9, n / 3 % 3, n % 3];
                let weight = s.weights[0][at[0]].0[k] * s.weights[1][at[1]].0[k] * s.weights[2][at[2]].0[k];
                let mut arm = [0.0f32; 3];
                for d in 0..3 {
                    arm[d] = at[d] as f32 - s.f[d].0[k];
                }
                let square = arm[0] * arm[0] + arm[1] * arm[1] + arm[2] * arm[2];
                let (mass, stiff) = (weight * p.mass, 4.0 * p.mass * weight * weight);
                let mut q = [0.0f32; 8];
                for d in 0..3 {
                    let affine = p.affine[0][d] * arm[0] + p.affine[1][d] * arm[1] + p.affine[2][d] * arm[2];
                    q[d] = mass * (p.velocity[d] + affine);
                    q[4 + d] = stiff * (mu * square + both * arm[d] * arm[d]);
                }
                q[3] = mass;
                let to = &mut out.0[s.first[k] + (at[0] * 7 + at[1]) * 8 + at[2]].0;
                for d in 0..8 {
                    to[d] += q[d];
                }
            }
            let mut cell = [0i32; 3];
            for d in 0..3 {
                cell[d] = middle.cell[k][d] + middle.x[d].0[k].floor() as i32;
            }
            out.0[Tile::at(cell[0], cell[1], cell[2])].0[7] += p.mass / 8.0;
        }
    }
}

#[inline(always)]
fn product(a: &Matrix8, b: &Matrix8) -> Matrix8 {
    let mut out = [[F8::ZERO; 3]; 3];
    for c in 0..3 {
        for r in 0..3 {
            out[c][r] = a[0][r] * b[c][0] + a[1][r] * b[c][1] + a[2][r] * b[c][2];
        }
    }
    out
}

/// The inverse and the determinant.
#[inline(always)]
fn inverse(m: &Matrix8) -> (Matrix8, F8) {
    let minor = |c: usize, r: usize| {
        let (c1, c2, r1, r2) = ((c + 1) % 3, (c + 2) % 3, (r + 1) % 3, (r + 2) % 3);
        m[c1][r1] * m[c2][r2] - m[c2][r1] * m[c1][r2]
    };
    let mut cofactor = [[F8::ZERO; 3]; 3];
    for c in 0..3 {
        for r in 0..3 {
            cofactor[r][c] = minor(c, r);
        }
    }
    let determinant = m[0][0] * cofactor[0][0] + m[0][1] * cofactor[1][0] + m[0][2] * cofactor[2][0];
    let over = F8::splat(1.0) / determinant;
    for column in &mut cofactor {
        for entry in column {
            *entry = *entry * over;
        }
    }
    (cofactor, determinant)
}

/// `I + half H`.
#[inline(always)]
fn beside(gradient: &Matrix8, half: f32) -> Matrix8 {
    let mut out = *gradient;
    for c in 0..3 {
        for r in 0..3 {
            out[c][r] = half * gradient[c][r];
        }
        out[c][c] = out[c][c] + 1.0;
    }
    out
}

/// Gathers H and u of a chunk, and returns it to the law. Whether a cell was turned inside out comes back.
#[inline(always)]
fn bend<L: Lanes>(step: &Step, s: &Stencil, hot: &[Hot], seats: &[Seat], u: &Tile) -> (Bent, bool) {
    let got = gather::<L>(s, hot.len(), u);
    let mut gradient = [[F8::ZERO; 3]; 3];
    let mut moved = [F8::ZERO; 3];
    let mut yield_norm = F8::splat(f32::INFINITY);
    for k in 0..hot.len() {
        for d in 0..3 {
            moved[d].0[k] = got[0][k].0[d];
            for c in 0..3 {
                gradient[c][d].0[k] = 4.0 * got[c + 1][k].0[d];
            }
        }
        yield_norm.0[k] = seats[k].yield_norm;
    }
    let (back, determinant) = inverse(&beside(&gradient, -0.5));
    let (_, forward) = inverse(&beside(&gradient, 0.5));
    let mut is_sound = true;
    for k in 0..8 {
        let (g, f) = (determinant.0[k], forward.0[k]);
        is_sound &= g > DETERMINANT_MIN && f > DETERMINANT_MIN * g;
    }
    let increment = product(&back, &gradient);
    let (hencky, plastic) = law::returned(&step.flow, &increment, &strains(hot), yield_norm);
    let (change, pressure) = (F8::ZERO, F8::ZERO);
    (Bent { gradient, moved, hencky, plastic, change, pressure }, is_sound)
}

/// Shares volumes within each cell: what ln J and the mean stress change by.
fn share(hot: &[Hot], seats: &[Seat], bent: &mut [Bent]) {
    let mut first = 0;
    for cell in hot.chunk_by(|a, b| a.cell == b.cell) {
        let members = first..first + cell.len();
        first = members.end;
        let trace = |bent: &[Bent], i: usize| {
            let h = &bent[i / 8].hencky;
            f64::from(h[0].0[i % 8]) + f64::from(h[1].0[i % 8]) + f64::from(h[2].0[i % 8])
        };
        let weight = |i: usize| f64::from(seats[i].share) * f64::from(hot[i].mass);
        let sum: f64 = members.clone().map(weight).sum();
        if sum <= 0.0 {
            continue;
        }
        let mean = members.clone().map(|i| weight(i) * trace(bent, i)).sum::<f64>() / sum;
        let mut after = 0.0;
        for i in members.clone() {
            let change = f64::from(seats[i].share) * (mean - trace(bent, i));
            after += weight(i) * (trace(bent, i) + change);
            bent[i / 8].change.0[i % 8] = change as f32;
        }
        for i in members {
            let (share, change) = (f64::from(seats[i].share), f64::from(bent[i / 8].change.0[i % 8]));
            let own = trace(bent, i);
            bent[i / 8].pressure.0[i % 8] = ((1.0 - share) * (own + change) + share * after / sum - own) as f32;
        }
    }
}

/// What a class of a block brings to the slope at the displacements `u`: `[f, contact]`, in the first pass
/// `[f, contact's stiffness]`, which also finds how volumes are shared. Whether no cell was turned inside out
/// comes back.
#[inline(always)]
pub(super) fn slope_with<L: Lanes>(
    Evaluation { step, averaging, is_first }: &Evaluation,
    place: &Place<'_>,
    (hot, cold, seats): (&[Hot], &[Cold], &mut [Seat]),
    near: Option<&Near<'_>>,
    u: &Tile,
    bent: &mut Vec<Bent>,
    out: &mut Tile,
) -> bool {
    *out = Tile::ZERO;
    bent.clear();
    let mut is_sound = true;
    for (chunk, seats) in hot.chunks(8).zip(seats.chunks(8)) {
        let middle = middle(chunk, place);
        let (new, sound) = bend::<L>(step, &stencil(&middle.cell, &middle.x), chunk, seats, u);
        is_sound &= sound;
        bent.push(new);
    }
    if *is_first && *averaging > 0.0 {
        for (seats, bent) in seats.chunks_mut(8).zip(&*bent) {
            for (k, seat) in seats.iter_mut().enumerate() {
                seat.share = -(-bent.plastic.0[k] / averaging).exp_m1();
            }
        }
    }
    if *averaging > 0.0 {
        share(hot, seats, bent);
    }
    let bulk = step.law.lambda + step.law.mu2 / 3.0;
    for ((chunk, cold), bent) in hot.chunks(8).zip(cold.chunks(8)).zip(&*bent) {
        let middle = middle(chunk, place);
        let mut tau = law::stress_of(&step.law, &bent.hencky);
        for entry in &mut tau[..3] {
            *entry = *entry + bulk * bent.pressure;
        }
        let moment = moment(&bent.gradient, &tau);
        let mut brought = [[Node([0.0; 8]); 4]; 8];
        for k in 0..chunk.len() {
            for c in 0..3 {
                for d in 0..3 {
                    brought[k][c + 1].0[d] = -moment[c][d].0[k];
                }
            }
        }
        if let Some(near) = near {
            push(near, chunk, cold, bent, *is_first, &mut brought);
        }
        let mut mass = F8::ZERO;
        for (k, p) in chunk.iter().enumerate() {
            mass.0[k] = p.mass;
        }
        scatter::<L>(&stencil(&middle.cell, &middle.x), chunk.len(), &brought, mass, out);
    }
    is_sound
}

/// `K = (I - H/2)^-T tau (I + H/2)^-T`.
#[inline(always)]
fn moment(gradient: &Matrix8, tau: &Sym8) -> Matrix8 {
    let (back, _) = inverse(&beside(gradient, -0.5));
    let (forward, _) = inverse(&beside(gradient, 0.5));
    let t = [[tau[0], tau[3], tau[4]], [tau[3], tau[1], tau[5]], [tau[4], tau[5], tau[2]]];
    let transposed = |m: &Matrix8| {
        let mut out = *m;
        for c in 0..3 {
            for r in 0..3 {
                out[c][r] = m[r][c];
            }
        }
        out
    };
    product(&transposed(&back), &product(&t, &transposed(&forward)))
}

fn push(near: &Near<'_>, hot: &[Hot], cold: &[Cold], bent: &Bent, is_first: bool, brought: &mut [Brought; 8]) {
    for (k, (hot, cold)) in hot.iter().zip(cold).enumerate() {
        let press = near.press(hot, cold, bent.way(k), None);
        let row = &mut brought[k][0].0;
        row[..3].copy_from_slice(&press.velocity);
        row[4..7].copy_from_slice(if is_first { &press.stiffness } else { &press.velocity });
    }
}

/// Ends the step of a class of a block at the displacements `u`. Returns the number of particles clamped.
#[inline(always)]
pub(super) fn end_with<L: Lanes>(
    Evaluation { step, averaging, .. }: &Evaluation,
    place: &Place<'_>,
    (hot, cold, seats): (&mut [Hot], &mut [Cold], &[Seat]),
    mut near: Option<(&Near<'_>, &mut GridReport)>,
    u: &Tile,
    bent: &mut Vec<Bent>,
) -> u32 {
    bent.clear();
    for (chunk, seats) in hot.chunks(8).zip(seats.chunks(8)) {
        let middle = middle(chunk, place);
        bent.push(bend::<L>(step, &stencil(&middle.cell, &middle.x), chunk, seats, u).0);
    }
    if *averaging > 0.0 {
        share(hot, seats, bent);
    }
    let mut clamped = 0;
    for (i, ((hot, cold), bent)) in hot.chunks_mut(8).zip(cold.chunks_mut(8)).zip(&*bent).enumerate() {
        let mut yield_norm = F8::splat(f32::INFINITY);
        for k in 0..hot.len() {
            yield_norm.0[k] = seats[8 * i + k].yield_norm;
        }
        let (back, _) = inverse(&beside(&bent.gradient, -0.5));
        let increment = product(&back, &bent.gradient);
        let update = law::update(&step.law, &step.flow, &increment, &strains(hot), yield_norm);
        clamped += update.clamped;
        for (k, (p, c)) in hot.iter_mut().zip(cold).enumerate() {
            match &mut near {
                Some((near, report)) => {
                    let before = *c;
                    near.press(p, &before, bent.way(k), Some((&mut *c, &mut **report)));
                }
                None => c.anchors = Default::default(),
            }
            let grown = (2.0 / 3.0 * bent.change.0[k]).exp_m1();
            for i in 0..6 {
                let strain = update.elastic_strain[i].0[k];
                p.strain[i] = strain + (strain + if i < 3 { 1.0 } else { 0.0 }) * grown;
            }
            p.hardening += update.plastic.0[k];
            if let Some(working) = step.working {
                c.structure = working.after(c.structure, update.plastic.0[k]);
            }
            for d in 0..3 {
                p.velocity[d] = bent.moved[d].0[k];
                for column in 0..3 {
                    p.affine[column][d] = bent.gradient[column][d].0[k];
                }
                c.way[d] = bent.moved[d].0[k];
                p.offset[d] += bent.moved[d].0[k];
            }
            if let Some((low, high)) = place.room {
                let cell = unpack_cell(p.cell);
                for d in 0..3 {
                    let cell = (cell[d] - place.origin[d]) as f32;
                    p.offset[d] = p.offset[d].clamp(low[d] - cell, high[d] - cell);
                }
            }
        }
    }
    clamped
}
