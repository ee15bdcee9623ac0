//! Cuts as particles carry them: the side of each cut that a particle stands at, the body that it is of, and
//! what follows from both.
//!
//! A particle has room for two cuts. Particles of one body with the same sides of the same cuts, a
//! [`ClassKey`], move together everywhere; two particles are *compatible* (delta of Eq. 2-3) unless they are
//! of two [bodies](super::body), or on opposite sides of the same cut.

use super::snapshot::Tag;
use glam::{DMat3, DVec3, DVec4, IVec3};
use serde::{Deserialize, Serialize};

/// The first of the sheets, up to 255, that plates part the clay by: solid tools thinner than two cells. A
/// side of one lasts while its plate is near; those below are cuts that stay.
pub const PLATE_SHEET: u8 = 240;

/// The sheet of no cut, by whose tags particles count how far they have grown together with another
/// [body](super::body); cuts that stay have those below.
pub const JOINT_SHEET: u8 = PLATE_SHEET - 1;

/// Which body a particle is of and which sides of which cuts it is on, and nothing else: the sides by sheet,
/// the higher first, so that equal sides make equal keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClassKey {
    body: u16,
    sides: [(u8, i8); 2],
}

impl ClassKey {
    /// The key of clay of the first body that is near no cut.
    pub const FIRST: Self = Self { body: 0, sides: [(0, 0); 2] };

    /// The key of clay of a body, as a particle has it, with these tags; of two tags of one sheet the first
    /// counts, and those that count how bodies grow together do not.
    #[expect(clippy::cast_possible_truncation, reason = "bodies are numbered up to BODY_MAX, which `admit` sees to")]
    pub fn new(body: u32, tags: [Tag; 2]) -> Self {
        let is_side = |tag: Tag| tag.side != 0 && tag.sheet != 0 && tag.sheet != JOINT_SHEET;
        let side = |tag: Tag| if is_side(tag) { (tag.sheet, tag.sign()) } else { (0, 0) };
        let [a, b] = tags.map(side);
        let b = if a.0 == b.0 { (0, 0) } else { b };
        Self { body: body as u16, sides: if a.0 >= b.0 { [a, b] } else { [b, a] } }
    }

    /// The number of the body.
    pub fn body(self) -> u16 {
        self.body
    }

    /// Whether the clay is of the first body and near no cut.
    pub fn is_first(self) -> bool {
        self == Self::FIRST
    }

    /// The key of clay of the same body that is near no cut.
    pub fn without_sides(self) -> Self {
        Self { body: self.body, ..Self::FIRST }
    }

    /// Whether clay of both keys is of one body and on opposite sides of no cut (delta of Eq. 2-3).
    pub fn is_compatible(self, other: Self) -> bool {
        self.body == other.body && self.sides().all(|(sheet, side)| other.side(sheet) != -side)
    }

    /// The side (+1, -1) of `sheet`; 0 for clay that is not near it.
    pub fn side(self, sheet: u8) -> i8 {
        self.sides().find(|s| s.0 == sheet).map_or(0, |s| s.1)
    }

    /// Whether clay of a body is in front of a sheet, or behind it; none for other clay.
    pub(crate) fn is_front(self, body: u16, sheet: u8) -> Option<bool> {
        let side = if self.body == body { self.side(sheet) } else { 0 };
        (side != 0).then_some(side > 0)
    }

    /// The sheets with the side of each.
    pub fn sides(self) -> impl Iterator<Item = (u8, i8)> {
        self.sides.into_iter().filter(|s| s.0 != 0)
    }
}

/// A set of sheets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SheetSet([u64; 4]);

impl SheetSet {
    /// Adds a sheet.
    pub fn insert(&mut self, sheet: u8) {
        self.0[usize::from(sheet / 64)] |= 1 << (sheet % 64);
    }

    /// Whether the sheet is in it.
    pub fn contains(&self, sheet: u8) -> bool {
        self.0[usize::from(sheet / 64)] >> (sheet % 64) & 1 == 1
    }

    /// Its sheets, in order.
    pub fn iter(&self) -> impl Iterator<Item = u8> {
        (1..=u8::MAX).filter(|sheet| self.contains(*sheet))
    }
}

impl FromIterator<u8> for SheetSet {
    fn from_iter<I: IntoIterator<Item = u8>>(sheets: I) -> Self {
        let mut set = Self::default();
        sheets.into_iter().filter(|sheet| *sheet != 0).for_each(|sheet| set.insert(sheet));
        set
    }
}

/// Where the two sides of a cut face each other at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Facing {
    /// Unit normal of the cut, from back to front.
    pub(crate) normal: DVec3,
    /// Gap between the two faces along it \[cells\]; negative where they overlap.
    pub(crate) gap: f64,
}

impl Facing {
    /// How far the two sides may come together before they bear \[cells\].
    pub(crate) fn room(&self) -> f64 {
        self.gap.max(0.0)
    }

    /// Where two cuts lie between two fields: across the mean of their normals, by the wider gap.
    pub(crate) fn across(facings: impl Iterator<Item = Self>) -> Option<Self> {
        let (normal, gap) =
            facings.fold((DVec3::ZERO, f64::NEG_INFINITY), |(normal, gap), m| (normal + m.normal, gap.max(m.gap)));
        Some(Self { normal: normal.try_normalize()?, gap })
    }

    /// The same seen from the other side.
    pub(crate) fn turned(self, side: i8) -> Self {
        Self { normal: f64::from(side) * self.normal, ..self }
    }
}

/// What faces what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Faces {
    /// The sides of a cut, by the clay that is tagged: a layer on either side.
    Sides,
    /// Two bodies, by all of their clay.
    Bodies,
}

impl Faces {
    /// The gap between two faces at these distances from a node \[cells\].
    fn gap(self, front: f64, back: f64) -> f64 {
        match self {
            Self::Sides => front + back + GAP_ALLOWANCE * (0.5 * (front - back)).powi(2),
            Self::Bodies => front + back - BODY_NEARNESS,
        }
    }
}

/// How the two sides of a cut, or two bodies, face each other at a node. `nodes` gives the offset \[cells\] of
/// each of the 27 nodes about it and the masses m_F, m_B of the clay of either side there, each of the weight
/// `k = 1/2` for every axis along which it is off. None where one side is missing.
///
/// The normal is the slope of the front's share `s = m_F / (m_F + m_B)`, fitted to them, each by the weight
/// `k m_F m_B / (m_F + m_B)`. Where that slope is less than [`SHARE_SLOPE_MIN`], as of nodes with both sides
/// that stand in one plane, it is the way from the back's centre of mass, weighted by k, to the front's.
/// Central differences of the share, which is no linear function of the distance, turn the normal of a plane
/// at 10 degrees to the grid by 2.2 degrees on average, up to 4.7; the fit by 0.4, up to 1.6. Friction
/// follows: by 0.04 for every 2.2 degrees.
///
/// The gap is `d_F + d_B + a ((d_F - d_B) / 2)^2` with the distances of both faces from the node, each by how
/// far that side's centre of mass, weighted by k, stands before the node ([`face_distance`]), and a =
/// [`GAP_ALLOWANCE`]: nodes further off the cut know less of it, and what little clay they share bears as a
/// rigid body would. Between bodies, all of whose clay is known, it is `d_F + d_B` less [`BODY_NEARNESS`].
pub(crate) fn facing(faces: Faces, nodes: impl Iterator<Item = (IVec3, f64, f64)>) -> Option<Facing> {
    let (mut weight, mut share_sum, mut offset_sum, mut slope_sum, mut moment) =
        (0.0, 0.0, DVec3::ZERO, DVec3::ZERO, DMat3::ZERO);
    let mut centres = [DVec4::ZERO; 2];
    for (offset, front, back) in nodes {
        let near = 1.0 / f64::from(1 << offset.abs().element_sum());
        let offset = offset.as_dvec3();
        centres[0] += near * front * offset.extend(1.0);
        centres[1] += near * back * offset.extend(1.0);
        if front.min(back) <= 0.0 {
            continue;
        }
        let share = front / (front + back);
        let w = share * back * near;
        weight += w;
        share_sum += w * share;
        offset_sum += w * offset;
        slope_sum += w * share * offset;
        moment += DMat3::from_cols(offset * offset.x, offset * offset.y, offset * offset.z) * w;
    }
    if weight == 0.0 {
        return None;
    }
    let mean = offset_sum / weight;
    moment -= DMat3::from_cols(mean * mean.x, mean * mean.y, mean * mean.z) * weight;
    // Nodes of one plane alone say nothing of the slope across it.
    let trace = moment.x_axis.x + moment.y_axis.y + moment.z_axis.z;
    moment += DMat3::IDENTITY * (NORMAL_REGULARISATION * trace);
    let slope = moment.inverse() * (slope_sum - mean * share_sum);
    let [front, back] = centres.map(|sum| sum.truncate() / sum.w);
    // That of a single node is no number.
    let along = if slope.length() >= SHARE_SLOPE_MIN { slope } else { front - back };
    let normal = along.try_normalize()?;
    let [front, back] = [front.dot(normal), -back.dot(normal)].map(face_distance);
    Some(Facing { normal, gap: faces.gap(front, back) })
}

/// Distance \[cells\] from a node, outwards, of the face of clay whose centre of mass over the 27 nodes about
/// it, each by 1/2 for every axis along which it is off, stands `centre` \[cells\] in that direction: for clay
/// that ends in a plane, however much of it there is beside, a function of the distance alone. Fitted to a
/// plane along the grid, whose centre is `(S(1 - d) - S(-1 - d)) / (S(1 - d) + 2 S(-d) + S(-1 - d))`, S the
/// spline's integral, to 0.03 cells from -1.2 to 1.3, and put 0.015 nearer: of an even lattice a closed cut
/// is shut. At any angle and place, of jittered clay, both faces together are known to 0.09 cells on average,
/// up to 0.17. Clay of less than 1.5 cells stands farther back than it seems.
pub(crate) fn face_distance(centre: f64) -> f64 {
    let c = centre.clamp(0.0, 1.0);
    FACE_DISTANCE.iter().fold(0.0, |sum, a| sum * c + a)
}

/// Coefficients of [`face_distance`], the highest power first.
pub(crate) const FACE_DISTANCE: [f64; 6] = [8.932_776, -20.629_426, 19.289_938, -10.516_657, 5.929_993, -1.703_848];

/// Allowance for what nodes off the cut do not know of its gap [1/cell]. With it the halves of a jittered
/// block bear 0.2 k at 0.1 cells, and a cut that was never open 0.07 % less than whole clay at 0.5 % strain;
/// with none 0.4 k, with 0.25 0.03 k and 3.6 %: then nodes beside the cut bear only once it is shut tight.
pub(crate) const GAP_ALLOWANCE: f64 = 0.1;

/// By how much bodies are taken to be nearer than they are found \[cells\]: where jitter has the faces of a
/// closed cut apart at some nodes they bear, too. With it a cut that was never open bears 0.4 to 3.6 % less
/// than whole clay at 0.5 % strain, by where its plane stands on the grid, and bodies 0.06 k at 0.1 cells;
/// with half of it 0.9 to 8 % and 0.04 k, with none 4 to 24 % and 0.02 k.
pub(crate) const BODY_NEARNESS: f64 = 0.04;

/// Least slope of the front's share that says where a cut faces [1/cell]: across a closed cut it goes from 0
/// to 1 within 3 cells. What is less is rounding, and turned the normals of a cut that opens into its plane:
/// in implicit steps its sides stuck to each other.
pub(crate) const SHARE_SLOPE_MIN: f64 = 0.05;

/// What is added to the diagonal of the fit's matrix, of its trace.
pub(crate) const NORMAL_REGULARISATION: f64 = 1e-3;

/// The place of `sheet` among the tags, if it has one.
pub(crate) fn place(tags: &[Tag; 2], sheet: u8) -> Option<usize> {
    tags.iter().position(|t| t.sheet == sheet && t.side != 0)
}

/// Gives the tags a side of `sheet`. A new sheet comes first and moves the others back; returns whether an
/// older one is given up for it.
pub(crate) fn take(tags: &mut [Tag; 2], sheet: u8, side: i8) -> bool {
    if let Some(at) = place(tags, sheet) {
        tags[at].side = side;
        return false;
    }
    let gives_up = tags.iter().all(|t| t.side != 0);
    if tags[0].side != 0 {
        tags[1] = tags[0];
    }
    tags[0] = Tag { sheet, side };
    gives_up
}

/// Gives the tags the side of a plate's `sheet` that clay which the plate holds off takes there, unless sides
/// of other sheets leave no room for it; takes it from clay that is not beside the plate any more. Returns
/// whether a side was taken.
pub(crate) fn beside_plate(tags: &mut [Tag; 2], sheet: u8, is_held: bool, takes: Option<i8>) -> bool {
    let has_room = place(tags, sheet).is_some() || tags.iter().any(|t| t.side == 0);
    match takes.filter(|_| is_held && has_room) {
        Some(side) => {
            take(tags, sheet, side);
            true
        }
        None if is_held => false,
        None => {
            drop(tags, sheet);
            false
        }
    }
}

/// Takes the side of `sheet` from the tags.
pub(crate) fn drop(tags: &mut [Tag; 2], sheet: u8) {
    match place(tags, sheet) {
        Some(0) => *tags = [tags[1], Tag::default()],
        Some(_) => tags[1] = Tag::default(),
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tag(sheet: u8, side: i8) -> Tag {
        Tag { sheet, side }
    }

    #[test]
    fn equal_sides_make_equal_keys() {
        let of = |tags| ClassKey::new(2, tags);
        let key = of([tag(3, 1), tag(7, -1)]);
        assert_eq!(key, of([tag(7, -40), tag(3, 9)]));
        assert_eq!((key.side(3), key.side(7), key.side(5), key.body()), (1, -1, 0, 2));
        assert_eq!(of([tag(3, 0), tag(7, -1)]), of([tag(7, -1), Tag::default()]));
        assert_eq!(of([tag(7, 1), tag(7, -1)]), of([tag(7, 1), Tag::default()]));
        assert!(key != ClassKey::new(1, [tag(3, 1), tag(7, -1)]));
        assert_eq!(of([tag(3, 1), tag(JOINT_SHEET, 50)]), of([tag(3, 1), Tag::default()]));
        assert!(key.is_compatible(of([tag(7, -1), tag(9, 1)])) && !key.is_compatible(of([tag(7, 1), tag(3, 1)])));
        assert!(key.is_compatible(key.without_sides()) && !key.is_compatible(ClassKey::new(1, [tag(3, 1); 2])));
        let none = [Tag::default(); 2];
        assert!(ClassKey::new(0, none).is_first() && !ClassKey::new(1, none).is_first() && !key.is_first());
    }

    /// Shares that grow along a direction, as those of a plane do, have that normal; one node alone, or
    /// shares all alike, have none.
    #[test]
    fn normal_is_that_of_the_share() {
        let offsets = || (0..27).map(|i| IVec3::new(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1));
        let n = DVec3::new(1.0, -0.3, 0.2).normalize();
        // Total masses that vary from node to node, as at a free surface.
        let node = |o: IVec3| {
            let (share, mass) = (0.5 + 0.2 * n.dot(o.as_dvec3()), 2.0 + f64::from(o.y));
            (o, mass * share, mass * (1.0 - share))
        };
        let found = facing(Faces::Sides, offsets().map(node)).expect("a normal").normal;
        assert!(found.angle_between(n) < 2e-3, "{found}");
        assert_eq!(facing(Faces::Sides, offsets().take(1).map(|o| (o, 1.0, 1.0))), None);
        let alike = facing(Faces::Sides, offsets().map(|o| (o, 1.0, 0.0)));
        assert_eq!(alike, None);
    }

    /// A cut that opens has both sides at the nodes of one plane alone, with shares alike but for rounding:
    /// it faces where the rest of its sides are.
    #[test]
    fn opening_cut_faces_its_sides() {
        let offsets = (0..27).map(|i| IVec3::new(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1));
        let masses = |o: IVec3| {
            let noise = 1.0 + 1e-7 * f64::from(3 * o.y - o.z);
            match o.x {
                -1 => (o, 0.0, 1.0),
                0 => (o, 0.1 * noise, 0.1),
                _ => (o, 1.0, 0.0),
            }
        };
        let found = facing(Faces::Sides, offsets.map(masses)).expect("a normal").normal;
        assert!(found.angle_between(DVec3::X) < 1e-6, "{found}");
    }

    /// The gap between two half spaces of clay, wherever the plane stands between the nodes and however the
    /// clay ends beside them, is found to a few hundredths of a cell.
    #[test]
    fn gap_is_that_between_the_faces() {
        // Share of a node's spline on the low side of a plane `d` cells above it.
        let within = |d: f64| match d.clamp(-1.5, 1.5) {
            d if d < -0.5 => (1.5 + d).powi(3) / 6.0,
            d if d > 0.5 => 1.0 - (1.5 - d).powi(3) / 6.0,
            d => 0.5 + 0.75 * d - d.powi(3) / 3.0,
        };
        for at in [-0.5, -0.3, 0.0, 0.17, 0.5] {
            for gap in [0.0, 0.1, 0.5, 1.0] {
                let beside = |o: IVec3| if o.y > 0 { 0.3 } else { 1.0 };
                let back = |o: IVec3| beside(o) * within(at - 0.5 * gap - f64::from(o.x));
                let front = |o: IVec3| beside(o) * within(f64::from(o.x) - at - 0.5 * gap);
                let offsets = || (0..27).map(|i| IVec3::new(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1));
                let masses = |o: IVec3| (o, front(o), back(o));
                let found = facing(Faces::Sides, offsets().map(masses)).expect("two sides");
                assert!((found.gap - gap - GAP_ALLOWANCE * at * at).abs() < 0.07, "{gap} at {at}: {}", found.gap);
                let bodies = facing(Faces::Bodies, offsets().map(masses)).expect("two bodies");
                assert!((bodies.gap - gap + BODY_NEARNESS).abs() < 0.07 && bodies.normal == found.normal, "{gap} at {at}");
            }
        }
    }

    /// What is known of two cuts between two fields: the mean of their normals, and the wider gap; faces that
    /// overlap leave no room.
    #[test]
    fn fields_beyond_two_cuts_meet_by_the_wider_gap() {
        let [a, b] = [(DVec3::X, 0.3), (DVec3::NEG_Y, -0.2)].map(|(normal, gap)| Facing { normal, gap });
        let both = Facing::across([a, b.turned(-1)].into_iter()).expect("a normal");
        assert!((both.normal - DVec3::new(0.5, 0.5, 0.0).normalize()).length() < 1e-15);
        assert!((both.room() - 0.3).abs() < 1e-15 && b.room() == 0.0);
        assert_eq!(Facing::across([a, a.turned(-1)].into_iter()), None);
    }

    /// Clay takes the side of a plate where it has room for one, leaves it when it is away, and gives up no
    /// cut for it.
    #[test]
    fn side_of_a_plate_lasts_while_it_is_near() {
        let after = |mut tags: [Tag; 2], is_held, takes| (beside_plate(&mut tags, 240, is_held, takes), tags);
        let (none, plate) = (Tag::default(), tag(240, 1));
        assert_eq!(after([none; 2], true, Some(1)), (true, [plate, none]));
        assert_eq!(after([tag(3, -1), none], true, Some(1)), (true, [plate, tag(3, -1)]));
        assert_eq!(after([tag(3, -1), plate], true, Some(-1)), (true, [tag(3, -1), tag(240, -1)]));
        assert_eq!(after([tag(3, -1), tag(4, 1)], true, Some(1)), (false, [tag(3, -1), tag(4, 1)]));
        assert_eq!(after([plate, tag(3, -1)], true, None), (false, [plate, tag(3, -1)]));
        assert_eq!(after([plate, tag(3, -1)], false, Some(1)), (false, [tag(3, -1), none]));
        assert_eq!(after([tag(3, -1), plate], false, None), (false, [tag(3, -1), none]));
        assert_eq!(after([tag(3, -1), tag(4, 1)], false, None), (false, [tag(3, -1), tag(4, 1)]));
    }

    #[test]
    fn sheet_set_holds_what_was_put_in() {
        let set: SheetSet = [0, 1, 64, 255, 64].into_iter().collect();
        assert_eq!(set.iter().collect::<Vec<_>>(), [1, 64, 255]);
    }

    /// Two cuts find room, a third takes the place of the older one, and a sheet that is there already
    /// changes its side where it stands.
    #[test]
    fn newest_sheets_are_kept() {
        let mut tags = [Tag::default(); 2];
        assert!(!take(&mut tags, 3, 1) && !take(&mut tags, 7, -1));
        assert_eq!(tags, [tag(7, -1), tag(3, 1)]);
        assert!(!take(&mut tags, 3, -1));
        assert_eq!(tags, [tag(7, -1), tag(3, -1)]);
        assert!(take(&mut tags, 9, 1));
        assert_eq!(tags, [tag(9, 1), tag(7, -1)]);
    }
}
