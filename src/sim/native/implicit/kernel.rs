//! Particle kernels of the implicit step over one class of a block: the slope at a place, and the step's end.
//! Eight particles at a time, as in the explicit [`kernel`](super::super::kernel).

use super::super::super::implicit;
use super::super::grid_step::GridReport;
use super::super::kernel::Place;
use super::super::law::{self, Sym8};
use super::super::simd::{F8, Lanes, Pairs, fused};
use super::super::state::{Cold, Hot, unpack_cell};
use super::super::step::Step;
use super::contact::Near;
use super::eights::{Cell, Class, Eight};
use super::tile::{Stencils, Tile4};
use glam::DVec3;

/// A matrix of eight particles: `m[c][r]`, column c.
type Matrix8 = [[F8; 3]; 3];

/// Least determinants at which no cell counts as turned inside out.
#[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
const DETERMINANT_MIN: f32 = implicit::DETERMINANT_MIN as f32;

/// Eight particles at a place of the nodes.
#[derive(Clone, Copy)]
pub(super) struct Bent {
    /// `(I - H / 2)^-1` and `(I + H / 2)^-1`.
    back: Matrix8,
    forward: Matrix8,
    /// Hencky strain after the return.
    hencky: Sym8,
    /// Where they have come.
    moved: [F8; 3],
}

impl Bent {
    const ZERO: Self =
        Self { back: [[F8::ZERO; 3]; 3], forward: [[F8::ZERO; 3]; 3], hencky: [F8::ZERO; 6], moved: [F8::ZERO; 3] };
}

/// How eight particles share volumes with their cells.
#[derive(Clone, Copy)]
struct Sharing {
    /// Plastic strain gained [-].
    plastic: F8,
    /// ln J, and by how much it changes with the cell.
    log: F8,
    change: F8,
    /// Mean stress over what its own ln J makes, in units of ln J.
    pressure: F8,
}

impl Sharing {
    const NONE: Self = Self { plastic: F8::ZERO, log: F8::ZERO, change: F8::ZERO, pressure: F8::ZERO };
}

/// What a thread keeps from class to class.
#[derive(Default)]
pub(super) struct Scratch {
    /// The displacements about a class.
    pub(super) about: Tile4,
    bent: Vec<Bent>,
    sharing: Vec<Sharing>,
}

/// What an evaluation is given for all blocks.
#[derive(Clone, Copy)]
pub(super) struct Evaluation {
    pub(super) step: Step,
    /// Plastic strain within which volumes are shared [-]; 0 for none.
    pub(super) averaging: f32,
    pub(super) purpose: Purpose,
}

/// What an evaluation is for, beside the slope.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// The step's first finds how volumes are shared, and how stiff contact is.
    Begin,
    /// One within finds how stiff contact is there.
    Anew,
    /// Nothing else.
    Search,
    /// The last that is planned finds what contact brings, by which the step is judged.
    Judge,
}

#[inline(always)]
fn product<L: Lanes>(a: &Matrix8, b: &Matrix8) -> Matrix8 {
    let mut out = [[F8::ZERO; 3]; 3];
    for c in 0..3 {
        for r in 0..3 {
            out[c][r] = fused::<L>(a[2][r], b[c][2], fused::<L>(a[1][r], b[c][1], a[0][r] * b[c][0]));
        }
    }
    out
}

#[inline(always)]
fn transposed(m: &Matrix8) -> Matrix8 {
    let mut out = *m;
    for c in 0..3 {
        for r in 0..3 {
            out[c][r] = m[r][c];
        }
    }
    out
}

/// The inverse and the determinant.
#[inline(always)]
fn inverse<L: Lanes>(m: &Matrix8) -> (Matrix8, F8) {
    let mut cofactor = [[F8::ZERO; 3]; 3];
    for c in 0..3 {
        for r in 0..3 {
            let (c1, c2, r1, r2) = ((c + 1) % 3, (c + 2) % 3, (r + 1) % 3, (r + 2) % 3);
            cofactor[r][c] = fused::<L>(m[c1][r1], m[c2][r2], -(m[c2][r1] * m[c1][r2]));
        }
    }
    let two = fused::<L>(m[0][1], cofactor[1][0], m[0][0] * cofactor[0][0]);
    let determinant = fused::<L>(m[0][2], cofactor[2][0], two);
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

/// H of what was gathered.
#[inline(always)]
fn gradient_of(got: &[[F8; 3]; 4]) -> Matrix8 {
    let mut gradient = [[F8::ZERO; 3]; 3];
    for c in 0..3 {
        for r in 0..3 {
            gradient[c][r] = 4.0 * got[c][r];
        }
    }
    gradient
}

/// Returns eight particles with the gradient H to the law, and where they have come. Whether no cell was
/// turned inside out comes back.
#[inline(always)]
fn bend<L: Lanes>(step: &Step, eight: &Eight, got: &[[F8; 3]; 4]) -> (Bent, Sharing, bool) {
    let gradient = gradient_of(got);
    let (back, determinant) = inverse::<L>(&beside(&gradient, -0.5));
    let (forward, turned) = inverse::<L>(&beside(&gradient, 0.5));
    let mut sound = true;
    for k in 0..8 {
        let (g, f) = (determinant.0[k], turned.0[k]);
        sound &= (g > DETERMINANT_MIN) & (f > DETERMINANT_MIN * g);
    }
    let increment = product::<L>(&back, &gradient);
    let (hencky, plastic) = law::returned::<L>(&step.flow, &increment, &eight.strain, eight.yield_norm);
    let log = hencky[0] + hencky[1] + hencky[2];
    let sharing = Sharing { plastic, log, change: F8::ZERO, pressure: F8::ZERO };
    (Bent { back, forward, hencky, moved: got[3] }, sharing, sound)
}

/// Shares volumes within each cell, `part` of it: what ln J and the mean stress change by.
fn share(cells: &[Cell], eights: &[Eight], sharing: &mut [Sharing], part: f64) {
    for cell in cells {
        let (mut sum, mut sum_of_squares) = (0.0, 0.0);
        for i in cell.first..cell.end {
            let (eight, sharing) = (&eights[i / 8], &sharing[i / 8]);
            let share = part * f64::from(eight.share.0[i % 8]);
            let logs = share * f64::from(eight.mass.0[i % 8]) * f64::from(sharing.log.0[i % 8]);
            (sum, sum_of_squares) = (sum + logs, sum_of_squares + share * logs);
        }
        let weight = part * cell.weight;
        let mean = sum / weight;
        // The mean of what they are after it.
        let after = mean + part * part * cell.square / weight * mean - sum_of_squares / weight;
        for i in cell.first..cell.end {
            let (share, sharing) = (part * f64::from(eights[i / 8].share.0[i % 8]), &mut sharing[i / 8]);
            let log = f64::from(sharing.log.0[i % 8]);
            let change = share * (mean - log);
            sharing.change.0[i % 8] = change as f32;
            sharing.pressure.0[i % 8] = ((1.0 - share) * change + share * (after - log)) as f32;
        }
    }
}

/// How volumes are shared, of what the particles flow.
fn find_shares(averaging: f32, hot: &[Hot], (eights, shared): (&mut [Eight], &mut Vec<Cell>), sharing: &[Sharing]) {
    for (eight, sharing) in eights.iter_mut().zip(sharing) {
        for k in 0..8 {
            let plastic = sharing.plastic.0[k];
            eight.share.0[k] = if plastic > 0.0 { -(-plastic / averaging).exp_m1() } else { 0.0 };
        }
    }
    shared.clear();
    let mut first = 0;
    for cell in hot.chunk_by(|a, b| a.cell == b.cell) {
        let end = first + cell.len();
        let (mut weight, mut square) = (0.0, 0.0);
        for i in first..end {
            let share = f64::from(eights[i / 8].share.0[i % 8]);
            let own = share * f64::from(eights[i / 8].mass.0[i % 8]);
            (weight, square) = (weight + own, square + share * own);
        }
        if weight > 0.0 {
            shared.push(Cell { first, end, weight, square });
        }
        first = end;
    }
}

/// Brings `-K` times the mass, of `K = (I - H/2)^-T tau (I + H/2)^-T`, and what presses on the particles.
#[inline(always)]
fn bring<L: Pairs>(
    step: &Step,
    eight: &Eight,
    stencils: &Stencils,
    (bent, pressure): (&Bent, F8),
    push: &[F8; 3],
    out: &mut Tile4,
) {
    let mut tau = law::stress_of(&step.law, &bent.hencky);
    let bulk = step.law.lambda + step.law.mu2 / 3.0;
    for entry in &mut tau[..3] {
        *entry = *entry + bulk * pressure;
    }
    let t = [[tau[0], tau[3], tau[4]], [tau[3], tau[1], tau[5]], [tau[4], tau[5], tau[2]]];
    let mut moment = product::<L>(&transposed(&bent.back), &product::<L>(&t, &transposed(&bent.forward)));
    let mass = F8::ZERO - eight.mass;
    for column in &mut moment {
        for entry in column {
            *entry = *entry * mass;
        }
    }
    stencils.scatter::<L>(&moment, push, out);
}

/// What a class of a block brings to the slope at the displacements `about` it, and what else the evaluation
/// is for. Whether no cell was turned inside out comes back.
#[inline(always)]
pub(super) fn slope_with<L: Pairs>(
    evaluation: &Evaluation,
    class: &mut Class,
    clay: (&[Hot], &[Cold]),
    near: Option<&Near<'_>>,
    Scratch { about: u, bent, sharing, .. }: &mut Scratch,
) -> bool {
    let Evaluation { step, averaging, purpose } = evaluation;
    let Class { eights, shared, forces, contact, .. } = class;
    *forces = Tile4::ZERO;
    let mut presses = near.map(|near| Presses::new(near, clay, u, (*purpose, contact.as_deref_mut())));
    // Volumes are shared once a cell's last particle is there, in the first evaluation once all are.
    let (count, finds_shares) = (eights.len(), *purpose == Purpose::Begin && *averaging > 0.0);
    let window = if finds_shares { count } else { shared.iter().map(Cell::window).max().unwrap_or(1) };
    let mask = window.next_power_of_two() - 1;
    bent.resize(bent.len().max(mask + 1), Bent::ZERO);
    sharing.resize(count, Sharing::NONE);
    let (mut is_sound, mut shared_to, mut brought_to) = (true, 0, 0);
    for i in 0..count {
        let (new, own, sound) = bend::<L>(step, &eights[i], &eights[i].stencils().gather::<L>(u));
        is_sound &= sound;
        (bent[i & mask], sharing[i]) = (new, own);
        if finds_shares {
            if i + 1 < count {
                continue;
            }
            find_shares(*averaging, clay.0, (eights, shared), sharing);
        }
        let ended = shared[shared_to..].iter().take_while(|cell| cell.end <= 8 * (i + 1)).count();
        share(&shared[shared_to..shared_to + ended], eights, sharing, implicit::SHARED_WITHIN);
        shared_to += ended;
        let ready = shared.get(shared_to).map_or(i + 1, |cell| (i + 1).min(cell.first / 8));
        for k in brought_to..ready {
            let (eight, bent) = (&eights[k], &bent[k & mask]);
            let stencils = eight.stencils();
            let push = presses.as_mut().map_or([F8::ZERO; 3], |presses| presses.on(k, eight, &stencils, bent));
            bring::<L>(step, eight, &stencils, (bent, sharing[k].pressure), &push, forces);
        }
        brought_to = ready;
    }
    is_sound
}

/// Tools and separating walls before the particles of a class in an evaluation.
struct Presses<'a> {
    near: &'a Near<'a>,
    clay: (&'a [Hot], &'a [Cold]),
    /// No particle moves further: weights sum up to 1.
    way_max: f32,
    purpose: Purpose,
    /// Where what is found goes: stiffness, its diagonal and what is beside it, or what they bring.
    contact: Option<&'a mut [Tile4; 2]>,
}

impl<'a> Presses<'a> {
    fn new(
        near: &'a Near<'a>,
        clay: (&'a [Hot], &'a [Cold]),
        u: &Tile4,
        (purpose, contact): (Purpose, Option<&'a mut [Tile4; 2]>),
    ) -> Self {
        let mut contact = contact.filter(|_| purpose != Purpose::Search);
        if let Some(contact) = &mut contact {
            **contact = [Tile4::ZERO; 2];
        }
        Self { near, clay, way_max: u.length_max(), purpose, contact }
    }

    /// What they give the particles of the eight of this index.
    #[inline(always)]
    fn on(&mut self, index: usize, eight: &Eight, stencils: &Stencils, bent: &Bent) -> [F8; 3] {
        let mut push = [F8::ZERO; 3];
        if eight.clear.0.iter().any(|clear| *clear <= self.way_max) {
            self.press(index, eight, stencils, (&bent.moved, &mut push));
        }
        push
    }

    #[inline(never)]
    fn press(&mut self, index: usize, eight: &Eight, stencils: &Stencils, (moved, push): (&[F8; 3], &mut [F8; 3])) {
        for k in (0..8).filter(|k| eight.clear.0[*k] <= self.way_max) {
            // Idle lanes are infinitely far, and so are nodes that run away.
            let at = 8 * index + k;
            let (Some(hot), Some(cold)) = (self.clay.0.get(at), self.clay.1.get(at)) else { continue };
            let moved = DVec3::from_array([0, 1, 2].map(|d| moved[d].0[k].into()));
            if f64::from(eight.clear.0[k]) > moved.length() {
                continue;
            }
            let is_stiffness = matches!(self.purpose, Purpose::Begin | Purpose::Anew);
            let press = self.near.press((hot, cold), moved, is_stiffness, None);
            (0..3).for_each(|d| push[d].0[k] = press.velocity[d] * hot.mass);
            let Some(contact) = self.contact.as_deref_mut() else { continue };
            let found = match is_stiffness {
                // What motion as it was leads away from a tool may well meet it, as stiffly as where it
                // stands.
                true if press.stiffness == [[0.0; 3]; 2] => self.near.stiffness_still((hot, cold)),
                true => press.stiffness,
                false => [press.velocity, [0.0; 3]],
            };
            for (of, tile) in found.iter().zip(contact).filter(|(of, _)| **of != [0.0; 3]) {
                stencils.add_one(k, of.map(|s| s * hot.mass), tile);
            }
        }
    }
}

/// Ends the step of a class of a block at the displacements `about` it; leaves what contact brings in the
/// class. Returns the number of particles clamped.
#[inline(always)]
pub(super) fn end_with<L: Pairs>(
    Evaluation { step, averaging, .. }: &Evaluation,
    class: &mut Class,
    place: &Place<'_>,
    (hot, cold): (&mut [Hot], &mut [Cold]),
    mut near: Option<(&Near<'_>, &mut GridReport)>,
    Scratch { about: u, sharing, .. }: &mut Scratch,
) -> u32 {
    let way_max = if near.is_some() { u.length_max() } else { 0.0 };
    sharing.clear();
    if *averaging > 0.0 {
        for eight in &class.eights {
            sharing.push(bend::<L>(step, eight, &eight.stencils().gather::<L>(u)).1);
        }
        find_shares(*averaging, hot, (&mut class.eights, &mut class.shared), sharing);
        share(&class.shared, &class.eights, sharing, 1.0);
    }
    if let Some(contact) = &mut class.contact {
        contact[0] = Tile4::ZERO;
    }
    let mut clamped = 0;
    for (i, ((hot, cold), eight)) in hot.chunks_mut(8).zip(cold.chunks_mut(8)).zip(&class.eights).enumerate() {
        let stencils = eight.stencils();
        let mut got = stencils.gather::<L>(u);
        for idle in hot.len()..8 {
            got.iter_mut().flatten().for_each(|of_eight| of_eight.0[idle] = 0.0);
        }
        let gradient = gradient_of(&got);
        let (back, _) = inverse::<L>(&beside(&gradient, -0.5));
        let update = law::update(&step.law, &step.flow, &product::<L>(&back, &gradient), &eight.strain, eight.yield_norm);
        clamped += update.clamped;
        if let Some((near, report)) = &mut near {
            for (k, (hot, cold)) in hot.iter().zip(&mut *cold).enumerate() {
                if eight.clear.0[k] > way_max {
                    near.leave(cold);
                    continue;
                }
                let (before, moved) = (*cold, DVec3::from_array([0, 1, 2].map(|d| got[3][d].0[k].into())));
                let press = near.press((hot, &before), moved, false, Some((cold, &mut **report)));
                if let Some(contact) = class.contact.as_deref_mut().filter(|_| press.velocity != [0.0; 3]) {
                    stencils.add_one(k, press.velocity.map(|v| v * hot.mass), &mut contact[0]);
                }
            }
        } else {
            cold.iter_mut().for_each(|cold| cold.anchors = Default::default());
        }
        let change = sharing.get(i).map_or(F8::ZERO, |sharing| sharing.change);
        store(step, place, (hot, cold), &update, &change, &got);
    }
    clamped
}

/// Stores eight particles one step on.
#[inline(always)]
fn store(
    step: &Step,
    place: &Place<'_>,
    (hot, cold): (&mut [Hot], &mut [Cold]),
    update: &law::Update,
    change: &F8,
    got: &[[F8; 3]; 4],
) {
    for (k, (p, c)) in hot.iter_mut().zip(cold).enumerate() {
        let change = change.0[k];
        let grown = if change == 0.0 { 0.0 } else { (2.0 / 3.0 * change).exp_m1() };
        for i in 0..6 {
            let strain = update.elastic_strain[i].0[k];
            p.strain[i] = strain + (strain + if i < 3 { 1.0 } else { 0.0 }) * grown;
        }
        p.hardening += update.plastic.0[k];
        if let Some(working) = step.working {
            c.structure = working.after(c.structure, update.plastic.0[k]);
        }
        for d in 0..3 {
            let moved = got[3][d].0[k];
            (p.velocity[d], c.way[d]) = (moved, moved);
            p.offset[d] += moved;
            for column in 0..3 {
                p.affine[column][d] = 4.0 * got[column][d].0[k];
            }
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
