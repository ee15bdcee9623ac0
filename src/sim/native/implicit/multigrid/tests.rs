//! The cycle against the oracle's, on clay in full and in part, at walls and at cuts.

use super::*;
use crate::sim::cut::ClassKey;
use crate::sim::native::implicit::layout::{Layout, Link, Place};
use crate::sim::native::implicit::vectors::{self, Block1, Vector};
use crate::sim::native::nodes::{local, offset};
use crate::sim::oracle::implicit::multigrid as oracle;
use crate::sim::params::BLOCK;
use crate::sim::snapshot::Tag;
use glam::{DMat3, DVec3, IVec3};
use std::collections::{BTreeMap, BTreeSet};

const MU: f32 = 1.5;
const LAMBDA: f32 = 13.5;

/// A number in 0 .. 1 for a place and a purpose.
fn noise(at: IVec3, purpose: u32) -> f32 {
    let mut hash = purpose.wrapping_mul(0x9e37_79b9);
    for c in at.to_array() {
        hash = (hash ^ c.cast_unsigned()).wrapping_mul(0x85eb_ca6b);
        hash ^= hash >> 13;
    }
    hash = hash.wrapping_mul(0xc2b2_ae35);
    (hash >> 8) as f32 / (1 << 24) as f32
}

/// A node of a slot.
type Seat = (u32, u8);

/// What a cycle is made of.
#[derive(Default)]
struct Case {
    layout: Layout,
    fill: Vec<[f32; 64]>,
    diagonal: Vector,
    extra: Vector,
    cross: Vector,
    live: Vector,
    index: Index,
    /// Nodes of slots that are no unknowns, with those in their place; none for outer nodes of walls.
    followed: BTreeMap<Seat, Option<Seat>>,
}

/// A class beside the plane of the cut, on one side or the other.
fn side(side: i8) -> ClassKey {
    ClassKey::new(0, [Tag { sheet: 3, side }, Tag::default()])
}

impl Case {
    /// Clay with so much fill in each cell, cut at the plane y = `cut`, against a slip wall at x = `wall`.
    fn new(size: i32, fill: impl Fn(IVec3) -> f32, cut: Option<i32>, wall: Option<i32>) -> Self {
        let mut cells = BTreeMap::new();
        for i in 0..8 * size.pow(3) {
            let n = 2 * size;
            let cell = IVec3::new(i / n / n, i / n % n, i % n) - size;
            let key = cut.filter(|cut| (-2..2).contains(&(cell.y - cut)));
            let key = key.map_or(ClassKey::FIRST, |cut| side(if cell.y < cut { -1 } else { 1 }));
            if fill(cell) > 0.0 {
                cells.insert((cell.to_array(), key), fill(cell));
            }
        }
        let mut case = Self::default();
        case.lay_out(&cells);
        case.link(cut, wall);
        case.fill(&cells, wall);
        case
    }

    /// The slots that clay in these cells reaches.
    fn lay_out(&mut self, cells: &BTreeMap<([i32; 3], ClassKey), f32>) {
        let mut places = BTreeSet::new();
        for (cell, key) in cells.keys() {
            let block = IVec3::from_array(*cell).div_euclid(IVec3::splat(BLOCK));
            for i in 0..27 {
                let about = block + IVec3::new(i / 9, i / 3 % 3, i % 3) - 1;
                places.insert((about.to_array(), *key));
                places.insert((about.to_array(), ClassKey::FIRST));
            }
        }
        self.layout.slots = places.into_iter().map(|(block, key)| Place { block: IVec3::from_array(block), key }).collect();
        self.index.rebuild(&self.layout.slots);
        self.layout.find_neighbours(&self.index);
    }

    /// All seats, with where they stand.
    fn seats(&self) -> Vec<(Seat, IVec3, ClassKey)> {
        let of = |(slot, place): (usize, &Place)| {
            let Place { block, key } = *place;
            (0..64).map(move |node| ((slot as u32, node as u8), block * BLOCK + offset(node), key))
        };
        self.layout.slots.iter().enumerate().flat_map(of).collect()
    }

    /// Columns at the wall first; then classes with what they move with: clay behind the cut with that which
    /// has no side, or the other way round, clay before it apart within a cell of it.
    fn link(&mut self, cut: Option<i32>, wall: Option<i32>) {
        let mut ties = vec![];
        for (seat, node, key) in self.seats() {
            if Some(node.x + 1) == wall {
                let inner = (seat.0, seat.1 + 2 * 16);
                self.layout.links.push(Link { from: seat, to: inner, image: [-1.0, 1.0, 1.0] });
                self.followed.insert(seat, None);
                continue;
            }
            let Some(cut) = cut else { continue };
            let is_divided = (node.y - cut).abs() <= 1;
            let (untagged, owner) = (ClassKey::FIRST, side(-1));
            let is_owners = is_divided && node.z < 0;
            let to = match (is_divided, is_owners) {
                (true, true) => (key == untagged).then_some(owner),
                (true, false) => (key == owner).then_some(untagged),
                (false, _) => (key != untagged).then_some(untagged),
            };
            let block = self.layout.slots[seat.0 as usize].block;
            if let Some(to) = to.and_then(|key| self.index.find(block, key)) {
                ties.push(Link { from: seat, to: (to, seat.1), image: [1.0; 3] });
                self.followed.insert(seat, Some((to, seat.1)));
            }
        }
        self.layout.links.extend(ties);
    }

    /// Fill, and an unknown wherever clay reaches.
    fn fill(&mut self, cells: &BTreeMap<([i32; 3], ClassKey), f32>, wall: Option<i32>) {
        let count = self.layout.slots.len();
        self.fill = vec![[0.0; 64]; count];
        for vector in [&mut self.diagonal, &mut self.extra, &mut self.cross, &mut self.live] {
            vector.resize(count, Block3::ZERO);
        }
        let mut reached = BTreeMap::new();
        for ((cell, key), fill) in cells {
            let cell = IVec3::from_array(*cell);
            let (slot, n) = self.seat(cell, *key).expect("a slot");
            self.fill[slot as usize][usize::from(n)] = *fill;
            for i in 0..64 {
                let node = cell + IVec3::new(i / 16, i / 4 % 4, i % 4) - 1;
                if let Some(root) = self.seat(node, *key).and_then(|seat| self.root(seat)) {
                    reached.insert(root, node);
                }
            }
        }
        for ((slot, n), node) in reached {
            for a in 0..3 {
                let value = |vector: &mut Vector, value: f32| vector[slot as usize].0[a][usize::from(n)] = value;
                value(&mut self.diagonal, 8.0 * noise(node, 1 + a as u32));
                value(&mut self.extra, 0.5 + noise(node, 4 + a as u32));
                value(&mut self.cross, 0.5 * (noise(node, 30 + a as u32) - 0.5));
                let is_held = noise(node, 7) < 0.05 || (a == 0 && Some(node.x) == wall);
                value(&mut self.live, if is_held { -1.0 } else { 1.0 });
            }
        }
        let outer: Vec<Seat> = self.followed.iter().filter(|(_, to)| to.is_none()).map(|(from, _)| *from).collect();
        for (slot, n) in outer {
            // What the wall holds of the image of clay.
            let inner = self.live[slot as usize].0[0][usize::from(n) + 2 * 16];
            self.live[slot as usize].0[0][usize::from(n)] = -inner.abs();
        }
    }

    /// The seat of a class at a node.
    fn seat(&self, node: IVec3, key: ClassKey) -> Option<Seat> {
        let block = node.div_euclid(IVec3::splat(BLOCK));
        let at = node - block * BLOCK;
        Some((self.index.seen(block, key)?, local(at.x, at.y, at.z) as u8))
    }

    /// The seat that is the unknown of a seat.
    fn root(&self, mut seat: Seat) -> Option<Seat> {
        while let Some(to) = self.followed.get(&seat) {
            seat = (*to)?;
        }
        Some(seat)
    }

    fn finest(&self) -> Finest<'_> {
        let Self { layout, fill, diagonal, extra, cross, live, .. } = self;
        Finest { layout, fill, diagonal, extra, cross, live, mu: MU, lambda: LAMBDA }
    }

    fn multigrid(&self) -> Multigrid {
        let mut multigrid = Multigrid::default();
        multigrid.set_up(&self.finest());
        multigrid
    }

    /// A vector of noise, 0 where nothing is free.
    fn vector(&self, purpose: u32) -> Vector {
        let mut vector = self.live.clone();
        vector.iter_mut().for_each(|of_slot| of_slot.flat_mut().iter_mut().for_each(|live| *live = live.max(0.0)));
        for ((slot, n), node, key) in self.seats() {
            for a in 0..3 {
                let purpose = purpose + 3 * u32::from(key.side(3).unsigned_abs()) + a as u32;
                vector[slot as usize].0[a][usize::from(n)] *= noise(node, purpose) - 0.5;
            }
        }
        vector
    }

    fn cycle(&self, r: &[Block3]) -> Vector {
        let mut z = vec![Block3([[7.0; 64]; 3]); r.len()];
        self.multigrid().cycle(r, &mut z);
        z
    }

    /// The seats that the oracle has as unknowns.
    fn unknowns(&self) -> Vec<(Seat, IVec3, ClassKey)> {
        let is_some = |((slot, n), ..): &(Seat, IVec3, ClassKey)| self.extra[*slot as usize].0[0][usize::from(*n)] > 0.0;
        self.seats().into_iter().filter(is_some).collect()
    }

    /// The oracle's cycle, and on how many levels.
    fn judged(&self, r: &[Block3]) -> (Vec<(Seat, DVec3)>, usize) {
        let unknowns = self.unknowns();
        let of: BTreeMap<Seat, usize> = unknowns.iter().enumerate().map(|(i, unknown)| (unknown.0, i)).collect();
        let find = |node: IVec3, key: ClassKey| of.get(&self.root(self.seat(node, key)?)?).copied();
        let taken = |vector: &[Block3]| -> Vec<DVec3> {
            let value = |seat: &Seat| [0, 1, 2].map(|a| f64::from(vector[seat.0 as usize].0[a][usize::from(seat.1)]));
            unknowns.iter().map(|unknown| DVec3::from_array(value(&unknown.0))).collect()
        };
        let mut fill = BTreeMap::new();
        for ((slot, n), node, key) in self.seats() {
            let full = self.fill[slot as usize][usize::from(n)];
            if full > 0.0 {
                fill.insert((node.to_array(), key), f64::from(full));
            }
        }
        let at_wall = |(seat, ..): &(Seat, IVec3, ClassKey)| self.followed.get(seat) == Some(&None);
        let held = |seat: Seat| f64::from(self.live[seat.0 as usize].0[0][usize::from(seat.1)]);
        let outer = self.seats().into_iter().filter(at_wall).map(|(seat, node, key)| ((node, key), DVec3::X * held(seat)));
        let outer = outer.filter(|(_, held)| *held != DVec3::ZERO).collect();
        let finest = oracle::Finest {
            places: unknowns.iter().map(|(_, node, key)| (*node, *key)).collect(),
            live: taken(&self.live),
            outer,
            find: Box::new(find),
            fill,
            diagonal: taken(&self.diagonal),
            extra: taken(&self.extra).into_iter().zip(taken(&self.cross)).map(symmetric).collect(),
            mu: MU.into(),
            lambda: LAMBDA.into(),
            cell_width: 1.0,
        };
        let multigrid = oracle::Multigrid::new(finest);
        let z = multigrid.cycle(&taken(r));
        (unknowns.iter().map(|unknown| unknown.0).zip(z).collect(), multigrid.level_count())
    }
}

/// A symmetric matrix by its diagonal and by yz, zx and xy.
fn symmetric((diagonal, cross): (DVec3, DVec3)) -> DMat3 {
    let [yz, zx, xy] = cross.to_array();
    DMat3::from_cols(DVec3::new(diagonal.x, xy, zx), DVec3::new(xy, diagonal.y, yz), DVec3::new(zx, yz, diagonal.z))
}

/// A ball with holes and cells that are full in part, about a place with negative coordinates.
fn ball(radius: f32) -> impl Fn(IVec3) -> f32 {
    move |cell| {
        let distance = (cell.as_vec3() - glam::Vec3::new(1.3, -2.0, 0.5)).length();
        let is_in = distance < radius && noise(cell, 20) > 0.1;
        f32::from(is_in) * (radius - distance).min(1.0) * (0.5 + noise(cell, 21))
    }
}

/// Crumbs far from each other.
fn crumbs(cell: IVec3) -> f32 {
    let is_in = noise(cell.div_euclid(IVec3::splat(5)), 22) < 0.03 && noise(cell, 23) < 0.5;
    f32::from(is_in) * (0.1 + noise(cell, 24))
}

/// A lump about every coarse node of one plane, and crumbs above where, at a cut, their class reaches far
/// corners of coarse cells in a block that it has no slot of its own in.
fn lumps(cell: IVec3) -> f32 {
    let is_lump = (cell + 1).rem_euclid(IVec3::splat(8)).max_element() < 2 && (-1..1).contains(&cell.y);
    let is_crumb = (24..28).contains(&cell.x) && (3..5).contains(&cell.y) && noise(cell, 25) < 0.1;
    f32::from(is_lump || is_crumb) * (0.1 + noise(cell, 24))
}

fn cases() -> [(&'static str, Case); 8] {
    [
        ("a few cells", Case::new(4, ball(1.2), None, None)),
        ("a ball", Case::new(12, ball(9.0), None, None)),
        ("a ball at a wall", Case::new(12, ball(9.0), None, Some(-7))),
        ("a ball with a cut", Case::new(12, ball(9.0), Some(-1), None)),
        ("a ball with a cut at a wall", Case::new(12, ball(9.0), Some(2), Some(5))),
        ("crumbs", Case::new(32, crumbs, None, None)),
        ("lumps with a cut", Case::new(64, lumps, Some(4), None)),
        ("crumbs with a cut", Case::new(32, crumbs, Some(5), Some(-11))),
    ]
}

#[test]
fn cycle_is_the_oracles() {
    for (name, case) in cases() {
        let r = case.vector(30);
        let (mut z, (judged, levels)) = (case.cycle(&r), case.judged(&r));
        assert!(case.multigrid().count == levels && (levels > 2 || name == "a few cells"), "{name}: {levels}");
        let greatest = judged.iter().map(|(_, z)| z.abs().max_element()).fold(0.0, f64::max);
        let mut error = 0f64;
        for ((slot, n), judged) in judged {
            for a in 0..3 {
                let z = std::mem::take(&mut z[slot as usize].0[a][usize::from(n)]);
                error = error.max((f64::from(z) - judged[a]).abs());
            }
        }
        assert!(error < 1e-6 * greatest, "{name}: {error}, {greatest}");
        assert!(z.iter().all(|z| *z == Block3::ZERO), "{name}: something where nothing is free");
    }
}

/// `a . P b = b . P a`, and `a . P a > 0`: what L-BFGS takes it for.
#[test]
fn cycle_is_symmetric_and_positive() {
    for (name, case) in cases() {
        let (a, b) = (case.vector(40), case.vector(50));
        let (pa, pb) = (case.cycle(&a), case.cycle(&b));
        let norm = vectors::dot(&a, &pa) * vectors::dot(&b, &pb);
        assert!(vectors::dot(&a, &pa) > 0.0 && vectors::dot(&b, &pb) > 0.0, "{name}");
        let (one, other) = (vectors::dot(&a, &pb), vectors::dot(&b, &pa));
        assert!((one - other).abs() < 1e-6 * norm.sqrt(), "{name}: {one}, {other}");
    }
}

/// Neither threads nor what was there before change a bit.
#[test]
fn bits_are_the_same_on_any_threads_and_after_any_step() {
    let (_, mut before) = cases().into_iter().next_back().expect("a case");
    for (name, case) in cases() {
        let r = case.vector(30);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| (case.cycle(&r), vectors::dot(&r, &r).to_bits()))
        };
        let one = on(1);
        assert!([2, 4, 8].iter().all(|threads| on(*threads) == one), "{name}");
        let mut multigrid = before.multigrid();
        let mut z = vec![Block3([[7.0; 64]; 3]); before.layout.slots.len()];
        multigrid.cycle(&vec![Block3([[f32::NAN; 64]; 3]); z.len()], &mut z);
        multigrid.set_up(&case.finest());
        z.resize(r.len(), Block3::ZERO);
        multigrid.cycle(&r, &mut z);
        assert!(one.0 == z, "{name}: other bits after another step");
        before = case;
    }
}

/// What is folded is what expanding would have done work on: `a . expand b = fold a . b`.
#[test]
fn folding_is_the_transpose_of_expanding() {
    let case = Case::new(12, ball(9.0), Some(2), Some(5));
    let mut a: Vector = case.vector(70);
    for (slot, a) in a.iter_mut().enumerate() {
        a.flat_mut().iter_mut().enumerate().for_each(|(i, a)| *a += noise(IVec3::new(slot as i32, i as i32, 0), 71));
    }
    let b = case.vector(80);
    let (mut folded, mut expanded) = (a.clone(), b.clone());
    case.layout.fold(&mut folded);
    case.layout.expand(&mut expanded);
    assert!(expanded != b && folded != a);
    for d in 0..3 {
        let component = |vector: &[Block3]| vector.iter().map(|of_slot| Block1(of_slot.0[d])).collect::<Vec<_>>();
        let (mut one, mut other) = (component(&a), component(&b));
        case.layout.fold_component(d, &mut one);
        case.layout.expand_component(d, &mut other);
        for (got, whole) in [(one, &folded), (other, &expanded)] {
            assert!(got.iter().zip(whole).all(|(got, whole)| got.0 == whole.0[d]), "component {d} alone");
        }
    }
    let (one, other) = (vectors::dot(&a, &expanded), vectors::dot(&folded, &b));
    assert!((one - other).abs() < 1e-6 * vectors::dot(&a, &a), "{one}, {other}");
}

/// `a + 2 b - a - 2 b = 0`, and `a . b` is the plain sum but for the rounding of f32 within a slot, as is
/// that of what comes back for each slot.
#[test]
fn vectors_are_added_and_multiplied() {
    let case = Case::new(12, ball(9.0), None, None);
    let (a, b) = (case.vector(70), case.vector(80));
    let mut sum = a.clone();
    let [norm] = vectors::sum_each(&mut sum, |slot, sum| {
        vectors::add(sum, 2.0, &b[slot]);
        [vectors::dot_of(sum, sum)]
    });
    assert!(sum != a && norm == vectors::dot(&sum, &sum));
    sum.iter_mut().zip(&a).for_each(|(sum, a)| vectors::add(sum, -1.0, a));
    sum.iter_mut().zip(&b).for_each(|(sum, b)| vectors::add(sum, -2.0, b));
    assert!(vectors::dot(&sum, &sum) < 1e-12 * vectors::dot(&a, &a));
    let products = a.iter().zip(&b).flat_map(|(a, b)| a.flat().iter().zip(b.flat()));
    let plain: f64 = products.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
    assert!((vectors::dot(&a, &b) - plain).abs() < 1e-7 * vectors::dot(&a, &a));
}
