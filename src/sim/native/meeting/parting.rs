//! The nodes of a block, away from walls and tools, at which sides of kept cuts or bodies meet: in f64, one
//! after the other, as [`update`](super::update) has them.

use super::super::super::cut::ClassKey;
use super::super::super::cutting::CuttingMethod;
use super::super::super::facing::{Between, Facing};
use super::super::super::params::BLOCK;
use super::super::super::tool::CUT_FRICTION;
use super::super::grid_step::{GridReport, GridStep};
use super::super::nodes::{ClassHere, Present, offset};
use super::bounds::Meeting;
use super::faces::{FacesAbout, FacesOf};
use super::sides::{Divisions, Fields};
use glam::{DVec3, IVec3};

/// Updates those nodes, in room that blocks after each other share.
#[derive(Default)]
pub(in super::super) struct Parting {
    sheets: Vec<u8>,
    about: Vec<FacesAbout>,
    /// What is at one node: the keys, masses and momenta of the classes, the field of each, and the fields'
    /// masses and velocities.
    keys: Vec<ClassKey>,
    sums: Vec<(f64, DVec3)>,
    leaders: Vec<u8>,
    fields: Vec<(f64, DVec3)>,
}

impl Parting {
    /// Updates the nodes of the classes that have clay in the block, in their order, where any are `shared`,
    /// a bit each.
    pub(in super::super) fn update<'a>(
        &mut self,
        present: &mut Present<'_>,
        block: IVec3,
        (step, meeting): (&GridStep, &Meeting<'_>),
        (shared, faces_of): (u64, &'a FacesOf<'a>),
    ) -> GridReport {
        self.about.clear();
        self.find_sheets(present.classes, meeting);
        let classes = present.classes;
        let (mut greatest, mut all) = (0.0, 0.0);
        for k in (0..64).filter(|k| shared >> k & 1 == 1) {
            let here = || classes.iter().enumerate().filter(|(_, class)| class.has >> k & 1 == 1);
            self.keys.clear();
            self.sums.clear();
            for (i, class) in here() {
                let [x, y, z, mass, ..] = present.nodes(i)[k].0.map(f64::from);
                self.keys.push(class.key);
                self.sums.push((mass, DVec3::new(x, y, z)));
            }
            let (divisions, fields) = self.divide(block * BLOCK + offset(k), step, meeting);
            if matches!(meeting.cutting, CuttingMethod::TwoFields) {
                self.meet(k, &divisions, &fields, (shared, faces_of));
            }
            for ((i, _), leader) in here().zip(&self.leaders) {
                let v = self.fields[usize::from(*leader)].1;
                let q = &mut present.nodes(i)[k].0;
                let inverse = if q[3] > 0.0 { 1.0 / q[3] } else { 0.0 };
                q[4..7].iter_mut().for_each(|before| *before *= inverse);
                q[..3].copy_from_slice(&v.as_vec3().to_array());
            }
            for (_, v) in &self.fields {
                (greatest, all) = (v.length_squared().max(greatest), all + v.length_squared());
            }
        }
        let speed_max = if all.is_finite() { greatest.sqrt() as f32 } else { f32::NAN };
        GridReport { speed_max, ..GridReport::default() }
    }

    /// The sheets of the classes and of the blades, each once, in order.
    fn find_sheets(&mut self, classes: &[ClassHere], meeting: &Meeting<'_>) {
        self.sheets.clear();
        self.sheets.extend(classes.iter().flat_map(|class| class.key.sides()).map(|side| side.0));
        self.sheets.extend(meeting.tools.iter().filter(|t| t.blade.is_some()).map(|t| t.sheet));
        self.sheets.sort_unstable();
        self.sheets.dedup();
    }

    /// Tells the fields of a node apart and makes momentum velocity; fields stand in the place of their first
    /// class.
    fn divide(&mut self, node: IVec3, step: &GridStep, meeting: &Meeting<'_>) -> (Divisions, Fields) {
        let divisions = Divisions::new(node, &self.keys, &self.sheets, |class| self.sums[class].0, meeting);
        let mut fields = Fields::default();
        self.leaders.clear();
        self.fields.clear();
        self.fields.resize(self.keys.len(), (0.0, DVec3::ZERO));
        for (class, (key, (mass, momentum))) in self.keys.iter().zip(&self.sums).enumerate() {
            let leader = fields.leader(divisions.place(*key), class as u8);
            let sum = &mut self.fields[usize::from(leader)];
            *sum = (sum.0 + mass, sum.1 + momentum);
            self.leaders.push(leader);
        }
        for &(_, field) in fields.as_slice() {
            let (mass, v) = &mut self.fields[usize::from(field)];
            *v = (*v / *mass + step.gravity) * step.damping;
        }
        (divisions, fields)
    }

    /// The fields of a node bound each other.
    fn meet<'a>(&mut self, k: usize, divisions: &Divisions, fields: &Fields, (shared, faces_of): (u64, &'a FacesOf<'a>)) {
        let (about, fields, found) = (&mut self.about, fields.as_slice(), &mut self.fields);
        let mut facing = |between: Between| {
            let at = about.iter().position(|about| about.between == between).unwrap_or_else(|| {
                about.push(FacesAbout::new(between, faces_of, shared));
                about.len() - 1
            });
            about[at].mean(k)
        };
        for b in 1..fields.len() {
            for a in 0..b {
                let [from, to] = [a, b].map(|i| (fields[i].0, usize::from(fields[i].1)));
                if let Some(facing) = divisions.pair_facing(from.0, to.0, &mut facing) {
                    let velocities = exchange([found[from.1], found[to.1]], facing);
                    [found[from.1].1, found[to.1].1] = velocities;
                }
            }
        }
    }
}

/// Velocities of two fields, of which masses and velocities are given, after they have exchanged momentum,
/// from the first to the second, if they approach each other by more than there is room for.
pub(super) fn exchange([(m_a, v_a), (m_b, v_b)]: [(f64, DVec3); 2], facing: Facing) -> [DVec3; 2] {
    if m_a <= 0.0 || m_b <= 0.0 {
        return [v_a, v_b];
    }
    let relative = v_b - v_a;
    let n = facing.normal;
    let approach = relative.dot(n);
    // Velocities are in cells a substep.
    let excess = approach + facing.room();
    if excess >= 0.0 {
        return [v_a, v_b];
    }
    let slide = relative - approach * n;
    let stop = slide.length().min(-excess * CUT_FRICTION);
    let impulse = m_a * m_b / (m_a + m_b) * (-excess * n - slide.normalize_or_zero() * stop);
    [v_a - impulse / m_a, v_b + impulse / m_b]
}
