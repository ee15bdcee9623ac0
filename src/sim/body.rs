//! Bodies: pieces of clay that nothing holds together, by number.
//!
//! Bodies press on each other as the two sides of a cut do, and never pull. Clay is told apart where it is
//! filled, and at the end of a frame whose plan [asks for it](super::frame::FramePlan::finds_bodies): after a
//! cut has gone through, or where bodies have grown together. It is the same in every engine, by the
//! particles' places, ids, bodies and tags alone:
//!
//! 1. **Joints.** Two bodies are one from now on where a particle of the one has grown together with the
//!    other (tag of sheet [`JOINT_SHEET`] without a side), which is that of the particle nearest to it within
//!    `SEAM_REACH`. The rest of their faces is a cut: of a sheet that is free, every particle of the one
//!    within `SEAM_REACH` of the other takes a side if it has room for one and has not grown together; what
//!    it has counted counts on.
//! 2. **Parts.** Particles of a body hang together within `LINK_REACH` unless they are on opposite sides of
//!    a cut. The part with most particles, of equal ones that with the lowest id, keeps the number of the
//!    body; every other of `PART_MIN` particles or more gets the lowest that is free, in the order of
//!    their lowest ids, up to [`BODY_MAX`]. Smaller ones stay with the body.
//! 3. **Finished cuts.** Of a cut both sides of which are no longer in one body, the tags are taken away,
//!    unless a blade of the plan cuts it. What it left pressed stays marked as pressed, by the tag of
//!    [`JOINT_SHEET`] that counts how the bodies grow together.

use super::carry;
use super::cut::{self, ClassKey, JOINT_SHEET, SheetSet};
use super::disjoint::DisjointSets;
use super::snapshot::{Snapshot, Tag};
use super::weld::{self, LEFT_PRESSED};
use glam::{DVec3, IVec3};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// The greatest number of a body: what is left of the devices' keys of classes beside two sides.
pub const BODY_MAX: u32 = (1 << 14) - 1;

/// How far apart particles of one body hang together, over their spacing [-]: jittered and deformed clay
/// keeps to it, and pieces a spacing and more apart are two.
pub(crate) const LINK_REACH: f64 = 1.8;

/// How far from another body the clay takes a side of the cut that is left between them \[cells\]: as far as
/// splines reach.
pub(crate) const SEAM_REACH: f64 = 1.5;

/// Particles of the smallest part that becomes a body: a cell's worth. Less are crumbs of a cut.
pub(crate) const PART_MIN: usize = 8;

/// What bodies are found by, of a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Member {
    /// Grid coordinate \[cells\].
    pub(crate) at: DVec3,
    pub(crate) id: u32,
    pub(crate) body: u32,
    pub(crate) tags: [Tag; 2],
}

/// Tells the bodies apart of particles whose largest fills a cube of edge `spacing` \[cells\]. Cuts of the
/// sheets `spared`, whose blades are in the clay, are not finished.
pub(crate) fn find(members: &mut [Member], spacing: f64, spared: SheetSet) {
    let cells = Cells::new(members);
    join(members, &cells, spared);
    part(members, &cells, LINK_REACH * spacing);
    finish_cuts(members, spared);
}

impl Snapshot {
    /// Tells the bodies of the clay apart, as a frame does at its end that is asked to. Particles that are
    /// not finite stay what they are.
    pub fn find_bodies(&mut self, spared: SheetSet) {
        let (finite, mut members) = self.members();
        find(&mut members, self.greatest_spacing(), spared);
        for (i, Member { body, tags, .. }) in finite.into_iter().zip(members) {
            (self.particles[i].body, self.particles[i].tags) = (body, tags);
        }
    }

    /// The parts of bodies that hang together, of whatever size: one particle of the part that each is in.
    /// Particles that are not finite are a part each.
    pub(crate) fn parts(&self) -> Vec<u32> {
        let (finite, members) = self.members();
        let mut sets = hanging_together(&members, &Cells::new(&members), LINK_REACH * self.greatest_spacing());
        let mut roots: Vec<u32> = (0..self.particles.len() as u32).collect();
        for (k, i) in (0..).zip(&finite) {
            roots[*i] = finite[sets.root(k) as usize] as u32;
        }
        roots
    }

    /// The finite particles: which they are, and what bodies are found by.
    fn members(&self) -> (Vec<usize>, Vec<Member>) {
        let finite = self.particles.iter().enumerate().filter(|(_, p)| p.is_finite());
        finite.map(|(i, p)| (i, Member { at: p.grid(), id: p.id, body: p.body, tags: p.tags })).unzip()
    }

    /// Edge of the cube that the largest finite particle fills \[cells\].
    fn greatest_spacing(&self) -> f64 {
        let volumes = self.particles.iter().filter(|p| p.is_finite()).map(|p| f64::from(p.rest_volume));
        volumes.fold(0.0, f64::max).cbrt() / self.domain.cell_width
    }
}

/// Particles by cell.
struct Cells {
    /// Indices of particles, those of a cell together.
    order: Vec<u32>,
    ranges: HashMap<IVec3, (u32, u32)>,
}

impl Cells {
    fn new(members: &[Member]) -> Self {
        let cell = |i: &u32| members[*i as usize].at.floor().as_ivec3();
        let mut order: Vec<u32> = (0..members.len() as u32).collect();
        order.sort_by_cached_key(|i| cell(i).to_array());
        let mut ranges = HashMap::new();
        let mut start = 0;
        for run in order.chunk_by(|a, b| cell(a) == cell(b)) {
            let end = start + run.len() as u32;
            ranges.insert(cell(&run[0]), (start, end));
            start = end;
        }
        Self { order, ranges }
    }

    /// The particles in the cells that a ball of `reach` \[cells\] about `at` meets.
    fn about(&self, at: DVec3, reach: f64) -> impl Iterator<Item = usize> + '_ {
        let (low, high) = ((at - reach).floor().as_ivec3(), (at + reach).floor().as_ivec3());
        let size = high - low + 1;
        let cells =
            (0..size.element_product()).map(move |i| low + IVec3::new(i % size.x, i / size.x % size.y, i / size.x / size.y));
        let runs = cells.filter_map(|cell| self.ranges.get(&cell));
        runs.flat_map(|(start, end)| &self.order[*start as usize..*end as usize]).map(|i| *i as usize)
    }

    /// The particles other than the `i`-th within `reach` \[cells\] of it, with their distance.
    fn near<'a>(&'a self, members: &'a [Member], i: usize, reach: f64) -> impl Iterator<Item = (usize, f64)> + 'a {
        let at = members[i].at;
        let near = self.about(at, reach).map(move |other| (other, members[other].at.distance(at)));
        near.filter(move |(other, distance)| *other != i && *distance < reach)
    }
}

/// Makes bodies one that have grown together, and a cut of what of their faces has not.
fn join(members: &mut [Member], cells: &Cells, spared: SheetSet) {
    let marked = (0..members.len()).filter(|i| is_joint(&members[*i]));
    let pair = |i: usize| {
        let own = members[i].body;
        let others = cells.near(members, i, SEAM_REACH).filter(|(other, _)| members[*other].body != own);
        let nearest = others.min_by(|a, b| a.1.total_cmp(&b.1).then(members[a.0].id.cmp(&members[b.0].id)));
        nearest.map(|(other, _)| (own.min(members[other].body), own.max(members[other].body)))
    };
    let pairs: BTreeSet<(u32, u32)> = marked.filter_map(pair).collect();
    // What has grown together with clay that is out of reach by now has not.
    members.iter_mut().filter(|m| !pairs.iter().any(|(low, high)| m.body == *low || m.body == *high)).for_each(|m| {
        drop_joint(&mut m.tags, |tag| tag.side == 0);
    });
    if pairs.is_empty() {
        return;
    }
    let mut used = members.iter().flat_map(|m| m.tags).map(|tag| tag.sheet).chain(spared.iter()).collect::<SheetSet>();
    for &(low, high) in &pairs {
        // Without a free sheet all of the faces grows together.
        let Some(sheet) = (1..JOINT_SHEET).rev().find(|sheet| !used.contains(*sheet)) else { break };
        used.insert(sheet);
        seam(members, cells, (low, high), sheet);
    }
    let mut sets = DisjointSets::new(BODY_MAX as usize + 1);
    pairs.iter().for_each(|(low, high)| sets.join(*low, *high));
    let joined: BTreeSet<u32> = pairs.iter().flat_map(|(low, high)| [*low, *high]).collect();
    for member in members.iter_mut().filter(|m| joined.contains(&m.body)) {
        drop_joint(&mut member.tags, |_| true);
        member.body = sets.root(member.body);
    }
}

/// Takes away the tag that counts how a particle grows together with another body, if it is such a one.
fn drop_joint(tags: &mut [Tag; 2], is_one: impl Fn(&Tag) -> bool) {
    let joint = tags.iter_mut().filter(|tag| tag.sheet == JOINT_SHEET && is_one(tag));
    joint.for_each(|tag| *tag = Tag::default());
}

/// Whether a particle has grown together with another body.
fn is_joint(member: &Member) -> bool {
    member.tags.contains(&Tag { sheet: JOINT_SHEET, side: 0 })
}

/// Makes the faces of two bodies the sides of a cut, the lower number's in front.
fn seam(members: &mut [Member], cells: &Cells, (low, high): (u32, u32), sheet: u8) {
    let faces = |i: &usize| {
        let own = members[*i].body;
        let other = if own == low { high } else { low };
        (own == low || own == high) && cells.near(members, *i, SEAM_REACH).any(|(near, _)| members[near].body == other)
    };
    for i in (0..members.len()).filter(faces).collect::<Vec<_>>() {
        let Member { body, tags, .. } = &mut members[i];
        let side = if *body == low { 1 } else { -1 };
        if let Some(joint) = tags.iter_mut().find(|tag| tag.sheet == JOINT_SHEET) {
            // What has been counted counts on.
            *joint = Tag { sheet, side: side * joint.side };
        } else if carry::is_open(tags, sheet) {
            cut::take(tags, sheet, side);
        }
    }
}

/// Particles of a body within `reach` \[cells\] of each other and not on opposite sides of a cut.
fn hanging_together(members: &[Member], cells: &Cells, reach: f64) -> DisjointSets {
    let mut sets = DisjointSets::new(members.len());
    let keys: Vec<ClassKey> = members.iter().map(|m| ClassKey::new(m.body, m.tags)).collect();
    for i in 0..members.len() {
        for (other, _) in cells.near(members, i, reach).filter(|(other, _)| *other > i) {
            if keys[i].is_compatible(keys[other]) {
                sets.join(i as u32, other as u32);
            }
        }
    }
    sets
}

/// Numbers the parts of every body that hang together.
fn part(members: &mut [Member], cells: &Cells, reach: f64) {
    let mut sets = hanging_together(members, cells, reach);
    let mut parts: BTreeMap<u32, Part> = BTreeMap::new();
    for (i, member) in (0..).zip(&*members) {
        let part = parts.entry(sets.root(i)).or_insert(Part { body: member.body, count: 0, first_id: u32::MAX });
        (part.count, part.first_id) = (part.count + 1, part.first_id.min(member.id));
    }
    let numbers = numbered(&parts);
    for (i, member) in (0..).zip(members) {
        member.body = numbers.get(&sets.root(i)).copied().unwrap_or(member.body);
    }
}

/// Clay of a body that hangs together.
struct Part {
    body: u32,
    count: usize,
    first_id: u32,
}

/// The new numbers of parts that are bodies of their own from now on, by their roots.
fn numbered(parts: &BTreeMap<u32, Part>) -> HashMap<u32, u32> {
    let mut keeper: BTreeMap<u32, (usize, Reverse<u32>)> = BTreeMap::new();
    for part in parts.values() {
        let rank = (part.count, Reverse(part.first_id));
        keeper.entry(part.body).and_modify(|kept| *kept = rank.max(*kept)).or_insert(rank);
    }
    let is_new = |part: &Part| keeper[&part.body].1 != Reverse(part.first_id) && part.count >= PART_MIN;
    let mut new: Vec<(u32, u32)> = parts.iter().filter(|p| is_new(p.1)).map(|(root, part)| (part.first_id, *root)).collect();
    new.sort_unstable();
    let free = (0..=BODY_MAX).filter(|number| !keeper.contains_key(number));
    new.into_iter().zip(free).map(|((_, root), number)| (root, number)).collect()
}

/// Takes the tags of cuts away that only lie between bodies now: of whose sides a body has the one alone, but
/// for crumbs.
fn finish_cuts(members: &mut [Member], spared: SheetSet) {
    let is_side = |tag: &Tag| tag.side != 0 && tag.sheet < JOINT_SHEET && !spared.contains(tag.sheet);
    let mut counts: HashMap<(u32, u8), [usize; 2]> = HashMap::new();
    for member in &*members {
        for tag in member.tags.iter().filter(|tag| is_side(tag)) {
            counts.entry((member.body, tag.sheet)).or_default()[usize::from(tag.side < 0)] += 1;
        }
    }
    for Member { body, tags, .. } in members {
        for sheet in tags.map(|tag| if is_side(&tag) { tag.sheet } else { 0 }).into_iter().filter(|sheet| *sheet != 0) {
            let [front, back] = counts[&(*body, sheet)];
            if front.min(back) < PART_MIN {
                finish(tags, sheet);
            }
        }
    }
}

/// Takes the side of a finished cut from the tags; pressed since the blade left, they say so on.
fn finish(tags: &mut [Tag; 2], sheet: u8) {
    let is_left = tags.iter().any(|tag| tag.sheet == sheet && weld::is_left_pressed(*tag));
    cut::drop(tags, sheet);
    let is_grown = tags.contains(&Tag { sheet: JOINT_SHEET, side: 0 });
    if is_left && !is_grown {
        cut::take(tags, JOINT_SHEET, LEFT_PRESSED.cast_signed());
    }
}

#[cfg(test)]
mod tests {
    use super::super::material::ClayMaterial;
    use super::super::params::{Domain, WALL_NODE, Walls};
    use super::super::snapshot::Particle;
    use super::*;

    fn tag(sheet: u8, side: i8) -> Tag {
        Tag { sheet, side }
    }

    /// Particles half a cell apart in a box of so many, the first at `low` \[cells\].
    fn block(low: DVec3, count: IVec3, first_id: u32) -> Vec<Member> {
        let place = |i: i32| IVec3::new(i % count.x, i / count.x % count.y, i / count.x / count.y).as_dvec3();
        let member = |i: i32| Member { at: low + 0.5 * place(i), id: first_id + i.cast_unsigned(), ..Member::default() };
        (0..count.element_product()).map(member).collect()
    }

    /// Gives clay within 1.5 cells of a plane sides of it, the newest first.
    fn slice(members: &mut [Member], sheet: u8, point: DVec3, normal: DVec3) {
        for member in members {
            let distance = (member.at - point).dot(normal.normalize());
            if distance.abs() < 1.5 {
                cut::take(&mut member.tags, sheet, if distance < 0.0 { -1 } else { 1 });
            }
        }
    }

    fn found(members: &mut [Member]) -> BTreeMap<u32, usize> {
        find(members, 0.5, SheetSet::default());
        members.iter().fold(BTreeMap::new(), |mut counts, m| {
            *counts.entry(m.body).or_default() += 1;
            counts
        })
    }

    /// Blocks half a cell apart are two, the larger the first, in whatever order they come; nearer ones are
    /// one, and crumbs are none.
    #[test]
    fn pieces_are_told_apart_by_their_distance() {
        for (gap, bodies) in [(0.35, 1), (0.45, 2)] {
            let mut clay = block(DVec3::splat(8.0), IVec3::new(4, 6, 6), 0);
            clay.extend(block(DVec3::new(8.0 + 1.5 + 0.5 + gap, 8.0, 8.0), IVec3::new(8, 6, 6), 144));
            clay.extend(block(DVec3::splat(20.0), IVec3::new(7, 1, 1), 900));
            let mut turned: Vec<Member> = clay.iter().rev().copied().collect();
            let counts = found(&mut clay);
            assert_eq!(counts.len(), bodies, "{gap}: {counts:?}");
            if bodies == 2 {
                assert_eq!((counts[&0], counts[&1]), (8 * 36 + 7, 4 * 36));
                assert!(clay[..144].iter().all(|m| m.body == 1));
            }
            found(&mut turned);
            assert!(turned.iter().rev().eq(&clay));
        }
    }

    /// A cut that has gone through leaves two bodies and none of its tags; one that ends inside, or whose
    /// blade is there, keeps them.
    #[test]
    fn cut_through_gives_way_to_bodies() {
        let middle = DVec3::new(10.1, 10.0, 10.0);
        let clay = || block(DVec3::splat(8.0), IVec3::splat(9), 0);
        let mut through = clay();
        slice(&mut through, 3, middle, DVec3::new(1.0, 0.1, 0.0));
        let mut spared = through.clone();
        let counts = found(&mut through);
        assert_eq!(counts.len(), 2, "{counts:?}");
        assert!(through.iter().all(|m| m.tags == [Tag::default(); 2]));
        assert!(through.iter().all(|m| (m.body == 1) == ((m.at - middle).dot(DVec3::new(1.0, 0.1, 0.0)) > 0.0)));
        find(&mut spared, 0.5, [3].into_iter().collect());
        assert_eq!(spared.iter().filter(|m| m.body == 1).count(), counts[&1]);
        assert!(spared.iter().filter(|m| m.tags[0] != Tag::default()).count() > 100);
        let mut partial = clay();
        slice(&mut partial[..400], 3, middle, DVec3::X);
        let before = partial.clone();
        assert_eq!((found(&mut partial).len(), partial), (1, before));
    }

    /// Where a finished cut was left pressed its bodies do not count how they grow together; but where they
    /// have, they have.
    #[test]
    fn finished_cut_was_left_pressed() {
        let mut clay = block(DVec3::splat(8.0), IVec3::splat(9), 0);
        slice(&mut clay, 3, DVec3::new(10.1, 10.0, 10.0), DVec3::X);
        let left = tag(JOINT_SHEET, 127);
        let is_low = |m: &Member| m.at.y < 9.0;
        let sides = clay.iter_mut().filter(|m| m.tags[0].side != 0);
        for (i, m) in sides.filter(|m| is_low(m)).enumerate() {
            m.tags[0].side *= 127;
            m.tags[1] = [Tag::default(), tag(JOINT_SHEET, 4)][i % 2];
        }
        assert_eq!(found(&mut clay).len(), 2);
        for m in &clay {
            let is_side = (m.at.x - 10.1).abs() < 1.5;
            assert_eq!(m.tags.contains(&left), is_side && is_low(m), "{m:?}");
            assert_eq!(m.tags.iter().filter(|tag| tag.side != 0).count(), usize::from(is_side && is_low(m)), "{m:?}");
        }
    }

    /// Three planes through one point leave eight bodies, cut one after the other.
    #[test]
    fn three_planes_leave_eight() {
        let mut clay = block(DVec3::splat(6.0), IVec3::splat(16), 0);
        let middle = DVec3::new(9.8, 9.7, 9.9);
        for (sheet, normal) in [(1, DVec3::new(1.0, 0.1, 0.0)), (2, DVec3::new(0.0, 1.0, -0.1)), (3, DVec3::new(0.1, 0.0, 1.0))] {
            slice(&mut clay, sheet, middle, normal);
            let bodies = found(&mut clay).len();
            assert_eq!(bodies, 1 << sheet);
        }
        assert!(clay.iter().all(|m| m.tags == [Tag::default(); 2]));
    }

    /// Bodies are one where particles say that they have grown together; the rest of the face is a cut, and
    /// what lies beyond it has no side of it.
    #[test]
    fn bodies_join_where_they_have_grown_together() {
        let mut clay = block(DVec3::splat(8.0), IVec3::splat(8), 0);
        clay.iter_mut().filter(|m| m.at.x > 10.0).for_each(|m| m.body = 4);
        let is_face = |m: &Member| (m.at.x - 10.25).abs() < 1.25;
        let is_spot = |m: &Member| (m.at.x - 10.25).abs() < 0.3 && m.at.y < 9.0;
        clay.iter_mut().filter(|m| is_spot(m)).for_each(|m| m.tags[0] = tag(JOINT_SHEET, 0));
        let counts = found(&mut clay);
        assert_eq!(counts.len(), 1, "{counts:?}");
        for m in &clay {
            let sides = ClassKey::new(m.body, m.tags);
            let expected = if is_face(m) && !is_spot(m) { if m.at.x > 10.0 { -1 } else { 1 } } else { 0 };
            assert_eq!(sides.side(JOINT_SHEET - 1), expected, "{m:?}");
            assert_eq!(m.tags.contains(&tag(JOINT_SHEET - 1, 0)), is_spot(m));
        }
        let before = clay.clone();
        assert_eq!((found(&mut clay).len(), clay), (1, before), "and stay so");
    }

    /// Joints beyond the other body's reach go with the bodies' joining; one that has no other body in reach
    /// joins nothing, and is forgotten.
    #[test]
    fn joints_are_forgotten() {
        let mut clay = block(DVec3::splat(8.0), IVec3::splat(8), 0);
        clay.iter_mut().filter(|m| m.at.x > 10.0).for_each(|m| m.body = 1);
        clay[0].tags[0] = tag(JOINT_SHEET, 7);
        let alone = clay.clone();
        clay[4].tags[1] = tag(JOINT_SHEET, 0);
        found(&mut clay);
        assert!(clay.iter().all(|m| m.body == 0 && m.tags.iter().all(|tag| tag.sheet != JOINT_SHEET)));
        let mut apart: Vec<Member> = alone.into_iter().filter(|m| m.body == 0).collect();
        apart[3].tags[1] = tag(JOINT_SHEET, 0);
        found(&mut apart);
        assert_eq!((apart[0].tags[0], apart[3].tags[1]), (tag(JOINT_SHEET, 7), Tag::default()));
    }

    /// Particles that are no numbers stay what they are.
    #[test]
    fn snapshot_finds_its_bodies() {
        let domain = Domain::new(DVec3::ZERO, DVec3::splat(0.2), 0.01, Walls::default()).expect("domain");
        let low = DVec3::splat(2.0 + f64::from(WALL_NODE));
        let members = [block(low, IVec3::splat(6), 0), block(low + DVec3::X * 5.0, IVec3::splat(4), 216)].concat();
        let particles = members.iter().map(|m| Particle::at(m.at, 1.25e-7, m.id)).collect();
        let mut clay = Snapshot::new(domain, ClayMaterial::default(), particles);
        clay.particles[0].offset[1] = f32::NAN;
        clay.particles[0].body = 9;
        clay.find_bodies(SheetSet::default());
        let bodies: Vec<u32> = clay.particles.iter().map(|p| p.body).collect();
        assert!(bodies[0] == 9 && bodies[1..216] == [0; 215] && bodies[216..] == [1; 64]);
    }
}
