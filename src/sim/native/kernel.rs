//! Particle kernels over one block: gather (`g2p`), clay law, scatter (`p2g`), fused or apart.
//!
//! A block's kernel reads the 7^3 velocities around it from one [`Tile`] and writes the sums of one class of
//! its particles to another; both stay in the L1 cache. Eight particles at a time go through the law; gather
//! and scatter go particle by particle with one register per node: what moves it, and what the clay came
//! with. Velocities are in cells per substep, masses in eighths of a full cell's.
//!
//! Loops stand in `#[inline(always)]` functions: closures made inside a `#[target_feature]` function are not
//! inlined through library code.

use super::law;
use super::penalty::Press;
use super::simd::{F8, Lanes, Node};
use super::state::{Cold, Hot, MARGIN, unpack_cell};
use super::step::Step;
use glam::DVec3;

/// Nodes along a tile's x and y, and its padded z.
pub(super) const TILE: usize = 7;
const TILE_Z: usize = 8;

/// The nodes -1 .. 5 about a block, z fastest and padded to 8.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Tile(pub [Node; TILE * TILE * TILE_Z]);

impl Tile {
    /// Nodes, padding included.
    pub(super) const LEN: usize = TILE * TILE * TILE_Z;

    pub(super) const ZERO: Self = Self([Node([0.0; 8]); Self::LEN]);

    pub(super) fn zero() -> Box<Self> {
        Box::new(Self::ZERO)
    }

    /// Index of the node at `(x, y, z)` relative to the block's low corner, each in -1 ..= 5.
    #[inline(always)]
    pub(super) const fn at(x: i32, y: i32, z: i32) -> usize {
        ((x + 1) as usize * TILE + (y + 1) as usize) * TILE_Z + (z + 1) as usize
    }
}

/// What is particular to a block.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    /// Cell of the block's low corner.
    pub origin: [i32; 3],
    /// Where walls stop the particles, relative to `origin` [cells]: (low, high), if a wall is near.
    pub room: Option<([f32; 3], [f32; 3])>,
    /// The yield norm at a grid coordinate, where clay near a tool is softer.
    pub softening: Option<&'a (dyn Fn([f64; 3]) -> f32 + Sync)>,
    /// What multiplies the stress at a grid coordinate, under the laws as published.
    pub stress_factor: Option<&'a (dyn Fn([f64; 3]) -> f32 + Sync)>,
}

struct Eight {
    count: usize,
    cell: [[i32; 3]; 8],
    x: [F8; 3],
    strain: law::Sym8,
    mass: F8,
    hardening: F8,
}

/// What a particle brings to nodes, per mass: its velocity and the columns of h C, in the first four numbers
/// stressed and pressed, in the last as they are.
pub(super) type Brought = [Node; 4];

impl Eight {
    /// Grid coordinate \[cells\] of particle `k` with offset `x`.
    fn grid(&self, place: &Place<'_>, x: &[F8; 3], k: usize) -> [f64; 3] {
        let mut at = [0.0; 3];
        for d in 0..3 {
            at[d] = f64::from(place.origin[d] + self.cell[k][d]) + f64::from(x[d].0[k]);
        }
        at
    }
}

#[inline(always)]
fn load(particles: &[Hot], origin: [i32; 3]) -> Eight {
    let mut out = Eight {
        count: particles.len(),
        cell: [[0; 3]; 8],
        x: [F8::ZERO; 3],
        strain: [F8::ZERO; 6],
        mass: F8::ZERO,
        hardening: F8::ZERO,
    };
    for k in 0..8 {
        // Idle lanes compute on the first particle and are not stored.
        let p = &particles[if k < particles.len() { k } else { 0 }];
        let cell = unpack_cell(p.cell);
        for d in 0..3 {
            out.cell[k][d] = cell[d] - origin[d];
            out.x[d].0[k] = p.offset[d];
        }
        for i in 0..6 {
            out.strain[i].0[k] = p.strain[i];
        }
        out.mass.0[k] = p.mass;
        out.hardening.0[k] = p.hardening;
    }
    out
}

/// Where eight particles stand on their nodes.
pub(super) struct Stencil {
    /// Position relative to the first of its 3 nodes along each axis.
    pub f: [F8; 3],
    pub weights: [[F8; 3]; 3],
    /// Tile index of the first node.
    pub first: [usize; 8],
}

#[inline(always)]
pub(super) fn stencil(cell: &[[i32; 3]; 8], x: &[F8; 3]) -> Stencil {
    let mut out = Stencil { f: *x, weights: [[F8::ZERO; 3]; 3], first: [0; 8] };
    let mut base = [[0i32; 8]; 3];
    for d in 0..3 {
        for k in 0..8 {
            let low = x[d].0[k] < 0.5;
            base[d][k] = -i32::from(low);
            out.f[d].0[k] = x[d].0[k] + if low { 1.0 } else { 0.0 };
        }
        let f = out.f[d];
        let (a, b, c) = (F8::splat(1.5) - f, f + -1.0, f + -0.5);
        out.weights[d] = [0.5 * (a * a), F8::splat(0.75) - b * b, 0.5 * (c * c)];
    }
    for k in 0..8 {
        out.first[k] = Tile::at(cell[k][0] + base[0][k], cell[k][1] + base[1][k], cell[k][2] + base[2][k]);
    }
    out
}

/// The node `offset` entries after `first`.
#[inline(always)]
fn node(tile: &Tile, index: usize) -> &Node {
    // SAFETY: cells lie 0 .. 4 in their block (sort) and offsets in [-0.5, 1.5) of the cell (clamped in
    // `advance`; NaN compares to base 0), so the first node is -1 ..= 3 along each axis, the last 5: inside
    // the tile.
    unsafe { tile.0.get_unchecked(index) }
}

#[inline(always)]
fn node_mut(tile: &mut Tile, index: usize) -> &mut Node {
    // SAFETY: as in `node`.
    unsafe { tile.0.get_unchecked_mut(index) }
}

/// The nodes' numbers and their moments (per axis) at each particle: `[v, m_x, m_y, m_z][lane]`.
#[inline(always)]
pub(super) fn gather<L: Lanes>(s: &Stencil, count: usize, nodes: &Tile) -> [[Node; 8]; 4] {
    let mut moments = [[F8::ZERO; 3]; 3];
    for d in 0..3 {
        for i in 0..3 {
            moments[d][i] = s.weights[d][i] * (F8::splat(i as f32) - s.f[d]);
        }
    }
    let mut got = [[Node([0.0; 8]); 8]; 4];
    for k in 0..count {
        let w = |d: usize, i: usize| L::splat(s.weights[d][i].0[k]);
        let m = |d: usize, i: usize| L::splat(moments[d][i].0[k]);
        let (z0, z1, z2, y0, y1, y2) = (w(2, 0), w(2, 1), w(2, 2), m(2, 0), m(2, 1), m(2, 2));
        let zero = L::splat(0.0);
        let (mut v, mut cx, mut cy, mut cz) = (zero, zero, zero, zero);
        for i in 0..3 {
            let (mut g, mut gy, mut gz) = (zero, zero, zero);
            for j in 0..3 {
                let at = s.first[k] + (i * TILE + j) * TILE_Z;
                let (q0, q1, q2) = (L::load(node(nodes, at)), L::load(node(nodes, at + 1)), L::load(node(nodes, at + 2)));
                let sum = q2.times_plus(z2, q1.times_plus(z1, q0.times(z0)));
                let moment = q2.times_plus(y2, q1.times_plus(y1, q0.times(y0)));
                let (wy, my) = (w(1, j), m(1, j));
                g = wy.times_plus(sum, g);
                gy = my.times_plus(sum, gy);
                gz = wy.times_plus(moment, gz);
            }
            let (wx, mx) = (w(0, i), m(0, i));
            v = wx.times_plus(g, v);
            cx = mx.times_plus(g, cx);
            cy = wx.times_plus(gy, cy);
            cz = wx.times_plus(gz, cz);
        }
        v.store(&mut got[0][k]);
        cx.store(&mut got[1][k]);
        cy.store(&mut got[2][k]);
        cz.store(&mut got[3][k]);
    }
    got
}

/// Adds what the particles bring to the tile.
#[inline(always)]
pub(super) fn scatter<L: Lanes>(s: &Stencil, count: usize, brought: &[Brought; 8], mass: F8, out: &mut Tile) {
    for k in 0..count {
        let m = L::splat(mass.0[k]);
        let row = |r: usize| L::load(&brought[k][r]).times(m);
        let (ax, ay, az) = (row(1), row(2), row(3));
        let at = |i: usize, d: usize| L::splat(i as f32 - s.f[d].0[k]);
        let w = |d: usize, i: usize| L::splat(s.weights[d][i].0[k]);
        // Momentum at node (i, j, 0); one more step in z adds az.
        let base = az.times_plus(at(0, 2), row(0));
        let (z0, z1, z2) = (w(2, 0), w(2, 1), w(2, 2));
        for i in 0..3 {
            let at_x = ax.times_plus(at(i, 0), base);
            for j in 0..3 {
                let wxy = w(0, i).times(w(1, j));
                let q0 = ay.times_plus(at(j, 1), at_x).times(wxy);
                let step = az.times(wxy);
                let q1 = q0.plus(step);
                let q2 = q1.plus(step);
                let first = s.first[k] + (i * TILE + j) * TILE_Z;
                for (q, z, n) in [(q0, z0, 0), (q1, z1, 1), (q2, z2, 2)] {
                    let to = node_mut(out, first + n);
                    q.times_plus(z, L::load(to)).store(to);
                }
            }
        }
    }
}

/// Particle state one substep on.
struct Advanced {
    /// By how much they moved.
    way: [F8; 3],
    x: [F8; 3],
    update: law::Update,
}

#[inline(always)]
fn advance(step: &Step, place: &Place<'_>, eight: &Eight, cold: &[Cold], got: &[[Node; 8]; 4]) -> Advanced {
    let mut way = [F8::ZERO; 3];
    let mut gradient = [[F8::ZERO; 3]; 3];
    let mut x = eight.x;
    for d in 0..3 {
        for k in 0..8 {
            way[d].0[k] = got[0][k].0[d];
            for c in 0..3 {
                gradient[c][d].0[k] = 4.0 * got[c + 1][k].0[d];
            }
            x[d].0[k] = (eight.x[d].0[k] + way[d].0[k]).clamp(-MARGIN, 1.0 + MARGIN);
        }
    }
    if let Some((low, high)) = place.room {
        for d in 0..3 {
            for k in 0..8 {
                let cell = eight.cell[k][d] as f32;
                x[d].0[k] = x[d].0[k].clamp(low[d] - cell, high[d] - cell);
            }
        }
    }
    let mut yield_norm = F8::splat(step.yield_norm);
    if let Some(softening) = place.softening {
        for k in 0..eight.count {
            yield_norm.0[k] = softening(eight.grid(place, &x, k));
        }
    }
    if step.has_history() {
        for k in 0..eight.count {
            yield_norm.0[k] = step.yield_norm_of(yield_norm.0[k], eight.hardening.0[k], cold[k].structure);
        }
    }
    let mut update = law::update(&step.law, &step.flow, &gradient, &eight.strain, yield_norm);
    multiply_stress(place, eight, &x, &mut update.stress);
    Advanced { way, x, update }
}

/// The laws as published: stress times zeta.
#[inline(always)]
fn multiply_stress(place: &Place<'_>, eight: &Eight, x: &[F8; 3], stress: &mut law::Sym8) {
    let Some(factor) = place.stress_factor else { return };
    for k in 0..eight.count {
        let factor = factor(eight.grid(place, x, k));
        for component in &mut *stress {
            component.0[k] *= factor;
        }
    }
}

/// What a particle of velocity `v` and affine `c` brings under the stress of lane `k`. Written whole: what is
/// pieced together in memory is slow to load as one register.
#[inline(always)]
fn brought(v: [f32; 3], c: [[f32; 3]; 3], tau: &law::Sym8, k: usize) -> Brought {
    let [xx, yy, zz, xy, xz, yz] = [tau[0].0[k], tau[1].0[k], tau[2].0[k], tau[3].0[k], tau[4].0[k], tau[5].0[k]];
    let [[cxx, cxy, cxz], [cyx, cyy, cyz], [czx, czy, czz]] = c;
    [
        Node([v[0], v[1], v[2], 1.0, v[0], v[1], v[2], 0.0]),
        Node([cxx - xx, cxy - xy, cxz - xz, 0.0, cxx, cxy, cxz, 0.0]),
        Node([cyx - xy, cyy - yy, cyz - yz, 0.0, cyx, cyy, cyz, 0.0]),
        Node([czx - xz, czy - yz, czz - zz, 0.0, czx, czy, czz, 0.0]),
    ]
}

/// A particle's velocity and affine after a substep: those of the nodes, and of what these did not see of its
/// own a share, whose way with the nodes turns the particle so that angular momentum stays.
#[inline(always)]
fn transferred(step: &Step, own: &Hot, got: [&Node; 4]) -> ([f32; 3], [[f32; 3]; 3]) {
    let (v, kept) = (&got[0].0, step.velocity_kept);
    let (mut velocity, mut affine, mut unseen) = ([0.0; 3], [[0.0; 3]; 3], [0.0; 3]);
    for d in 0..3 {
        unseen[d] = kept * (own.velocity[d] - v[4 + d]);
        velocity[d] = v[d] + unseen[d];
    }
    let [ux, uy, uz] = unseen;
    let (sx, sy, sz) = (2.0 * (v[1] * uz - v[2] * uy), 2.0 * (v[2] * ux - v[0] * uz), 2.0 * (v[0] * uy - v[1] * ux));
    let spin = [[0.0, sz, -sy], [-sz, 0.0, sx], [sy, -sx, 0.0]];
    for c in 0..3 {
        let m = &got[c + 1].0;
        for d in 0..3 {
            affine[c][d] = 4.0 * m[d] + kept * (own.affine[c][d] - 4.0 * m[4 + d]) - spin[c][d];
        }
    }
    (velocity, affine)
}

/// Stores the particles one substep on. Returns what they bring.
#[inline(always)]
fn store(step: &Step, particles: &mut [Hot], cold: &mut [Cold], new: &Advanced, got: &[[Node; 8]; 4]) -> [Brought; 8] {
    let mut out = [[Node([0.0; 8]); 4]; 8];
    if let Some(working) = step.working {
        for (k, p) in cold.iter_mut().enumerate() {
            p.structure = working.after(p.structure, new.update.plastic.0[k]);
        }
    }
    for (k, p) in particles.iter_mut().enumerate() {
        for d in 0..3 {
            p.offset[d] = new.x[d].0[k];
        }
        for i in 0..6 {
            p.strain[i] = new.update.elastic_strain[i].0[k];
        }
        p.hardening += new.update.plastic.0[k];
        let (velocity, affine) = transferred(step, p, [&got[0][k], &got[1][k], &got[2][k], &got[3][k]]);
        out[k] = brought(velocity, affine, &new.update.stress, k);
        (p.velocity, p.affine) = (velocity, affine);
    }
    out
}

/// Adds what tools and walls give to what particles bring, and what blades that stick have to know of them.
#[inline(always)]
fn push(press: &mut Option<&mut Press<'_>>, hot: &[Hot], cold: &mut [Cold], brought: &mut [Brought; 8]) {
    let Some(press) = press else { return };
    for ((hot, cold), brought) in hot.iter().zip(cold).zip(brought) {
        let own = DVec3::from_array(hot.velocity.map(f64::from));
        let given = press.on(hot, cold, own);
        for d in 0..3 {
            brought[0].0[d] += given[d];
        }
        brought[0].0[7] = press.strength_lost(hot, cold);
    }
}

#[inline(always)]
fn g2p2g_with<L: Lanes>(
    step: &Step,
    place: &Place<'_>,
    hot: &mut [Hot],
    cold: &mut [Cold],
    velocity: &Tile,
    mut press: Option<&mut Press<'_>>,
    out: &mut Tile,
) -> u32 {
    *out = Tile::ZERO;
    let mut clamped = 0;
    for (chunk, cold) in hot.chunks_mut(8).zip(cold.chunks_mut(8)) {
        let eight = load(chunk, place.origin);
        let got = gather::<L>(&stencil(&eight.cell, &eight.x), eight.count, velocity);
        let new = advance(step, place, &eight, cold, &got);
        let mut brought = store(step, chunk, cold, &new, &got);
        clamped += new.update.clamped;
        push(&mut press, chunk, cold, &mut brought);
        scatter::<L>(&stencil(&eight.cell, &new.x), eight.count, &brought, eight.mass, out);
    }
    clamped
}

#[inline(always)]
fn g2p_with<L: Lanes>(step: &Step, place: &Place<'_>, hot: &mut [Hot], cold: &mut [Cold], velocity: &Tile) -> u32 {
    let mut clamped = 0;
    for (chunk, cold) in hot.chunks_mut(8).zip(cold.chunks_mut(8)) {
        let eight = load(chunk, place.origin);
        let got = gather::<L>(&stencil(&eight.cell, &eight.x), eight.count, velocity);
        let new = advance(step, place, &eight, cold, &got);
        store(step, chunk, cold, &new, &got);
        for (k, p) in cold.iter_mut().enumerate() {
            p.way = [0, 1, 2].map(|d| new.way[d].0[k]);
        }
        clamped += new.update.clamped;
    }
    clamped
}

/// [`g2p`] of particles whose velocities and moments `[v, m_x, m_y, m_z]` were gathered elsewhere.
pub(super) fn finish_gathered(step: &Step, place: &Place<'_>, hot: &mut [Hot], cold: &mut [Cold], gathered: &[[Node; 4]]) -> u32 {
    let mut clamped = 0;
    for ((chunk, cold), gathered) in hot.chunks_mut(8).zip(cold.chunks_mut(8)).zip(gathered.chunks(8)) {
        let got = std::array::from_fn(|c| std::array::from_fn(|k| gathered.get(k).map_or(Node([0.0; 8]), |g| g[c])));
        let new = advance(step, place, &load(chunk, place.origin), cold, &got);
        store(step, chunk, cold, &new, &got);
        clamped += new.update.clamped;
    }
    clamped
}

#[inline(always)]
fn p2g_with<L: Lanes>(
    step: &Step,
    place: &Place<'_>,
    hot: &[Hot],
    cold: &mut [Cold],
    mut press: Option<&mut Press<'_>>,
    out: &mut Tile,
) {
    *out = Tile::ZERO;
    for (chunk, cold) in hot.chunks(8).zip(cold.chunks_mut(8)) {
        let eight = load(chunk, place.origin);
        let mut tau = law::stress(&step.law, &eight.strain);
        multiply_stress(place, &eight, &eight.x, &mut tau);
        let mut all = [[Node([0.0; 8]); 4]; 8];
        for (k, p) in chunk.iter().enumerate() {
            all[k] = brought(p.velocity, p.affine, &tau, k);
        }
        push(&mut press, chunk, cold, &mut all);
        scatter::<L>(&stencil(&eight.cell, &eight.x), eight.count, &all, eight.mass, out);
    }
}

/// Instantiates a kernel for AVX2 + FMA beside the plain one, and the function that chooses between them.
macro_rules! dispatch {
    ($(#[$doc:meta])* $name:ident = $kernel:ident / $fast:ident, ($step:ident, $($arg:ident: $type:ty),*) -> $ret:ty) => {
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,fma")]
        fn $fast($step: &Step, $($arg: $type),*) -> $ret {
            $kernel::<super::simd::Wide>($step, $($arg),*)
        }

        $(#[$doc])*
        #[inline]
        pub(super) fn $name($step: &Step, $($arg: $type),*) -> $ret {
            #[cfg(target_arch = "x86_64")]
            if $step.fma {
                // SAFETY: `fma` is set only after AVX2 and FMA were detected.
                return unsafe { $fast($step, $($arg),*) };
            }
            $kernel::<F8>($step, $($arg),*)
        }
    };
}
dispatch!(
    /// Gather, law and scatter of one class run; `out` is overwritten. Returns the number of particles
    /// clamped.
    g2p2g = g2p2g_with / g2p2g_avx2, (step, place: &Place<'_>, hot: &mut [Hot], cold: &mut [Cold], velocity: &Tile, press: Option<&mut Press<'_>>, out: &mut Tile) -> u32);
dispatch!(
    /// Gather and law of one class run. Returns the number of particles clamped.
    g2p = g2p_with / g2p_avx2, (step, place: &Place<'_>, hot: &mut [Hot], cold: &mut [Cold], velocity: &Tile) -> u32);
dispatch!(
    /// Scatter of one class run from stored velocity, affine and strain; `out` is overwritten.
    p2g = p2g_with / p2g_avx2, (step, place: &Place<'_>, hot: &[Hot], cold: &mut [Cold], press: Option<&mut Press<'_>>, out: &mut Tile) -> ());
