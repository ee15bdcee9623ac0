//! Deals sheets to blades: each visit of a blade to the clay is a cut of its own.
//!
//! A blade that leaves the clay, or is taken away, and comes back somewhere else, across its first cut
//! perhaps, must not take the sides of that cut for its own. A plate, which leaves no cut behind, keeps its
//! sheet until it is taken away; no other plate gets it in the next plan, so that the clay loses its sides
//! of the one before it takes those of the other.

use super::super::cut::{JOINT_SHEET, PLATE_SHEET, SheetSet};
use super::super::frame::{FramePlan, FrameReport, ToolReport};
use super::super::health::Health;
use super::super::snapshot::Snapshot;
use super::super::tool::{Pose, ToolPath, ToolShape};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// How far a blade goes without touching anything before it counts as out of the clay \[cells\]. One that
/// rests in a gape of its cut touches nothing either, and cuts on; on its way through uncut clay its edge
/// meets a particle every half cell. A wire touches nothing but what it tags.
const REACH: f64 = 2.0;

/// Which sheet each blade cuts, and which are in use. Whoever plans frames passes every plan through
/// [`Self::deal`] and every report to [`Self::note`]. The plan of frame n depends on the reports up to that
/// of frame n - 2, however early others come. [`Self::new`] knows the clay's cells; by default they have no
/// width, and a blade that moves without touching anything is out of the clay.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sheets {
    /// Cell width \[m\].
    cell_width: f64,
    blades: Vec<BladeSheet>,
    /// Ids of the plan's plates, none of one that was taken away, and the sheet of each.
    plates: Vec<(Option<u32>, u8)>,
    used: SheetSet,
    /// Sheets in the order in which they were last dealt.
    dealt: Vec<u8>,
    /// Plans in which a blade got a sheet that was in use.
    reused: Vec<u64>,
    /// Reports whose turn has not come.
    noted: VecDeque<Noted>,
    /// Whether bodies are to be found: a cut may have gone through, or bodies have grown together.
    is_asked: bool,
    /// The last plan that finds bodies.
    found_in: Option<u64>,
}

/// The sheet of one visit of a blade.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct BladeSheet {
    id: u32,
    sheet: u8,
    /// The last plan with it.
    plan_id: u64,
    /// Whether the blade has touched clay since it got the sheet.
    is_in_clay: bool,
    /// Whether it touched some in the last frame known.
    is_touching: bool,
    /// Whether the visit is over: the sheet is kept until the reports of all its frames are known, the blade
    /// gets another.
    is_over: bool,
    shape: ToolShape,
    /// Where it was when the frames n and n - 1 ended, by the parity of their plans' ids.
    poses: [Pose; 2],
    /// Where it was in the last frame known in which it touched clay.
    touched: Pose,
}

/// What a report says of cuts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Noted {
    plan_id: u64,
    used: SheetSet,
    /// Each tool's id, and whether it touched clay.
    tools: Vec<(u32, bool)>,
    /// Whether bodies have grown together.
    joins: bool,
}

impl BladeSheet {
    /// Takes in whether the blade touched clay in a frame; returns whether it has ceased to, so that its cut
    /// may have gone through, or its visit is over, so that a cut that has is finished.
    fn note(&mut self, plan_id: u64, is_touching: bool, cell_width: f64) -> bool {
        let pose = self.poses[parity(plan_id)];
        let has_ceased = std::mem::replace(&mut self.is_touching, is_touching) && !is_touching;
        if is_touching {
            (self.is_in_clay, self.touched) = (true, pose);
        }
        self.is_over |= self.is_in_clay && self.way_to(pose) > REACH * cell_width;
        has_ceased || self.is_over
    }

    /// How far it is at `pose` from where it touched clay last \[m\]; a wire may be drawn along itself.
    fn way_to(&self, pose: Pose) -> f64 {
        let Some(half_length) = self.shape.wire() else {
            return self.touched.way(pose, self.shape.bounding_radius());
        };
        let ends = |pose: Pose| [-half_length, half_length].map(|x| pose.to_world(DVec3::X * x));
        let (from, to) = (ends(self.touched), ends(pose));
        let axis = (from[1] - from[0]).normalize_or_zero();
        let way = |i: usize| (to[i] - from[i]).reject_from_normalized(axis).length();
        way(0).max(way(1))
    }
}

fn parity(plan_id: u64) -> usize {
    usize::from(plan_id % 2 == 1)
}

impl Sheets {
    /// For clay that may have cuts already.
    pub fn new(snapshot: &Snapshot) -> Self {
        let tags = snapshot.particles.iter().flat_map(|p| p.tags);
        let used: SheetSet = tags.filter(|tag| tag.side != 0).map(|tag| tag.sheet).collect();
        let is_asked = used.iter().next().is_some();
        Self { cell_width: snapshot.domain.cell_width, used, is_asked, ..Self::default() }
    }

    /// Gives every blade of a plan its sheet: the one it has, or, when it is new or was not in the plan
    /// before, one that is free. Where none is, it is the one that was dealt longest ago, and the frame's
    /// report will say so ([`Self::note`]).
    pub fn deal(&mut self, plan: &mut FramePlan) {
        while let Some(noted) = self.noted.pop_front_if(|noted| noted.plan_id + 2 <= plan.id) {
            self.apply(&noted);
        }
        // The reports up to a blade's last frame are known when a frame without it has been planned, and its
        // sheet is free or in use.
        let is_kept = |blade: &BladeSheet| plan.id < blade.plan_id + 2;
        self.is_asked |= self.blades.iter().any(|blade| !is_kept(blade) && blade.is_touching && !blade.is_over);
        self.blades.retain(is_kept);
        self.reused.retain(|reused| plan.id < reused + 2);
        self.deal_plates(plan);
        let duration = plan.duration();
        for path in plan.tools.iter_mut().filter(|path| path.tool.shape.is_blade()) {
            let held = self.blades.iter().position(|blade| blade.id == path.id && !blade.is_over);
            let at = held.unwrap_or_else(|| self.begin_visit(path, plan.id));
            let blade = &mut self.blades[at];
            (blade.plan_id, blade.shape) = (plan.id, path.tool.shape);
            blade.poses[parity(plan.id)] = path.pose_at(duration);
            path.sheet = blade.sheet;
        }
        // A plan that was refused is made once more.
        plan.finds_bodies = self.is_asked || self.found_in == Some(plan.id);
        if plan.finds_bodies {
            (self.is_asked, self.found_in) = (false, Some(plan.id));
        }
    }

    /// Gives every plate the sheet that it has, or the first that no other plate of the plan has, if there is
    /// one none of the plan before had either; the last ones beyond that many are no plates.
    fn deal_plates(&mut self, plan: &mut FramePlan) {
        let before: Vec<u8> = self.plates.iter().map(|plate| plate.1).collect();
        self.plates.retain(|plate| plan.tools.iter().any(|path| Some(path.id) == plate.0));
        let cell_width = self.cell_width;
        for path in plan.tools.iter_mut().filter(|path| path.tool.shape.is_plate(cell_width)) {
            let held = self.plates.iter().find(|plate| plate.0 == Some(path.id)).map(|plate| plate.1);
            let all = || PLATE_SHEET..=u8::MAX;
            let is_free = |sheet: &u8| self.plates.iter().all(|plate| plate.1 != *sheet);
            let new = || all().find(|sheet| is_free(sheet) && !before.contains(sheet)).or_else(|| all().find(is_free));
            let Some(sheet) = held.or_else(new) else { continue };
            if held.is_none() {
                self.plates.push((Some(path.id), sheet));
            }
            path.sheet = sheet;
        }
    }

    /// Takes note of what a report says of cuts; a frame given up says nothing. Marks the report as
    /// [`Health::CROWDED`] if a blade got a sheet of its frame that another cut has.
    pub fn note(&mut self, report: &mut FrameReport) {
        if self.reused.contains(&report.plan_id) {
            report.health.insert(Health::CROWDED);
        }
        if report.health.contains(Health::GIVEN_UP) {
            self.is_asked |= self.found_in == Some(report.plan_id);
            return;
        }
        // Clay that runs ahead of a fast blade presses on it at no node; what lags behind is put back.
        let is_touching = |tool: &ToolReport| tool.contacts + tool.tagged + tool.pushed_back > 0;
        let tools = report.tools.iter().map(|tool| (tool.id, is_touching(tool))).collect();
        let joins = report.joined > 0;
        self.noted.push_back(Noted { plan_id: report.plan_id, used: report.sheets, tools, joins });
    }

    /// The blade or plate of this id was taken away: if there is one in the next plan, it has been put down
    /// anew. Those that are missing from a plan need no telling.
    pub fn lift(&mut self, id: u32) {
        for blade in self.blades.iter_mut().filter(|blade| blade.id == id && !blade.is_over) {
            blade.is_over = true;
            self.is_asked |= blade.is_in_clay;
        }
        self.plates.iter_mut().filter(|plate| plate.0 == Some(id)).for_each(|plate| plate.0 = None);
    }

    /// Blades that have left the clay get another sheet for their next visit.
    fn apply(&mut self, noted: &Noted) {
        self.used = noted.used;
        self.is_asked |= noted.joins;
        for blade in self.blades.iter_mut().filter(|blade| !blade.is_over) {
            if let Some((_, is_touching)) = noted.tools.iter().find(|tool| tool.0 == blade.id) {
                self.is_asked |= blade.note(noted.plan_id, *is_touching, self.cell_width);
            }
        }
    }

    /// Gives a blade a sheet for a visit that begins with this plan; returns its place among the blades.
    fn begin_visit(&mut self, path: &ToolPath, plan_id: u64) -> usize {
        let (sheet, is_free) = self.next(path.sheet_id());
        if !is_free {
            self.reused.push(plan_id);
        }
        self.dealt.retain(|dealt| *dealt != sheet);
        self.dealt.push(sheet);
        let visit = BladeSheet {
            id: path.id,
            sheet,
            plan_id,
            is_in_clay: false,
            is_touching: false,
            is_over: false,
            shape: path.tool.shape,
            poses: [Pose::default(); 2],
            touched: Pose::default(),
        };
        self.blades.push(visit);
        self.blades.len() - 1
    }

    /// The first sheet from `first` on, and around, that is free: neither in use nor a blade's. If there is
    /// none, of those in use the one dealt longest ago. Whether it is free.
    fn next(&self, first: u8) -> (u8, bool) {
        let is_held = |sheet: u8, is_over| self.blades.iter().any(|blade| blade.sheet == sheet && blade.is_over == is_over);
        let rank = |sheet: &u8| match self.dealt.iter().position(|dealt| dealt == sheet) {
            _ if !self.used.contains(*sheet) && !is_held(*sheet, true) => None,
            // Cuts that the clay came with are the oldest.
            age => Some((is_held(*sheet, true), age)),
        };
        let all = (first..JOINT_SHEET).chain(1..first).filter(|sheet| !is_held(*sheet, false));
        all.map(|sheet| (rank(&sheet), sheet))
            .min_by_key(|(rank, _)| *rank)
            .map_or((first, false), |(rank, sheet)| (sheet, rank.is_none()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::material::ClayMaterial;
    use super::super::super::params::{Domain, Walls};
    use super::super::super::snapshot::{Particle, Tag};
    use super::super::super::tool::{Contact, Tool, ToolPath};
    use super::super::StepLimits;
    use super::*;

    const BLADE: ToolShape = ToolShape::Blade { half_width: 0.1, half_height: 0.1 };
    const WIRE: ToolShape = ToolShape::Wire { half_length: 0.1 };

    fn domain() -> Domain {
        Domain::new(DVec3::ZERO, DVec3::splat(0.2), 0.01, Walls::default()).expect("a room")
    }

    /// Frame `id` with these tools, by id and place, as it is dealt.
    fn planned(sheets: &mut Sheets, id: u64, shape: ToolShape, tools: &[(u32, DVec3)]) -> FramePlan {
        let tool = |(id, position): &(u32, DVec3)| {
            ToolPath::still(*id, Tool { shape, contact: Contact::Slip }, Pose { position: *position, ..Pose::default() })
        };
        let tools: Vec<_> = tools.iter().map(tool).collect();
        let mut plan = FramePlan { id, ..StepLimits::default().frame(&ClayMaterial::default(), 0.01, 0.01, &tools) };
        sheets.deal(&mut plan);
        assert_eq!(plan.validate(), Ok(()));
        plan
    }

    /// The sheets that the blades `ids`, which move, get in frame `id`.
    fn dealt_to(sheets: &mut Sheets, id: u64, ids: &[u32]) -> Vec<u8> {
        let tools: Vec<_> = ids.iter().map(|blade| (*blade, DVec3::Y * id as f64)).collect();
        planned(sheets, id, BLADE, &tools).tools.iter().map(|path| path.sheet).collect()
    }

    /// The sheets that frame `id` of three blades gets.
    fn dealt(sheets: &mut Sheets, id: u64) -> Vec<u8> {
        dealt_to(sheets, id, &[1, 2, 239])
    }

    /// Frame `plan_id`, in which the first blade had these contacts.
    fn report(plan_id: u64, contacts: u64, sheets: &[u8]) -> FrameReport {
        let tools = [(1, contacts), (2, 0), (239, 0)].map(|(id, contacts)| ToolReport { id, contacts, ..ToolReport::default() });
        FrameReport { plan_id, tools: tools.into(), sheets: sheets.iter().copied().collect(), ..FrameReport::default() }
    }

    /// A blade keeps its sheet while it is in the clay and until it touches clay; out of it, it gets one that
    /// nobody has.
    #[test]
    fn each_visit_has_a_sheet_of_its_own() {
        let mut sheets = Sheets::default();
        for frame in 0..2 {
            assert_eq!(dealt(&mut sheets, frame), [1, 2, 3], "239 would have that of 1");
        }
        sheets.note(&mut report(0, 9, &[1]));
        assert_eq!(dealt(&mut sheets, 2), [1, 2, 3]);
        sheets.note(&mut report(1, 0, &[1, 4]));
        assert_eq!(dealt(&mut sheets, 2), [1, 2, 3], "the report of frame n - 1 has no part in frame n");
        assert_eq!(dealt(&mut sheets, 3), [5, 2, 3], "1 is cut, 2 and 3 are blades', 4 is cut");
        sheets.note(&mut report(2, 0, &[4]));
        assert_eq!(dealt(&mut sheets, 4), [5, 2, 3], "kept until it cuts");
    }

    /// Bodies are found once when a blade has left the clay, is missing or was taken away, when bodies have
    /// grown together, and in clay that comes with sides; again where the frame was given up or refused.
    #[test]
    fn bodies_are_found_after_each_visit() {
        let mut sheets = Sheets::default();
        let finds = |sheets: &mut Sheets, frame, ids: &[u32]| {
            let tools: Vec<_> = ids.iter().map(|id| (*id, DVec3::ZERO)).collect();
            planned(sheets, frame, BLADE, &tools).finds_bodies
        };
        // In the clay in the first frames, out of it in the third, of which the fifth knows.
        for frame in 0..7 {
            assert_eq!(finds(&mut sheets, frame, &[1, 2, 239]), frame == 4, "frame {frame}");
            sheets.note(&mut report(frame, if frame < 2 { 9 } else { 0 }, &[1]));
        }
        sheets.note(&mut FrameReport { joined: 3, ..report(7, 9, &[1]) });
        // Grown together in 7; the plan of 9 is refused, made once more, and then its frame is given up.
        let found = [8, 9, 9].map(|frame| finds(&mut sheets, frame, &[1, 2, 239]));
        assert_eq!(found, [false, true, true]);
        let mut given_up = FrameReport { health: Health::GIVEN_UP, ..report(9, 0, &[]) };
        sheets.note(&mut given_up);
        assert!(finds(&mut sheets, 10, &[1, 2, 239]));
        // In the clay since 7: missing for two plans.
        let found: Vec<u64> = (11..15).filter(|frame| finds(&mut sheets, *frame, &[2, 239])).collect();
        assert_eq!(found, [12]);
        let mut tagged = Snapshot::new(domain(), ClayMaterial::default(), vec![Particle::at(DVec3::splat(9.0), 1e-9, 0)]);
        assert!(!finds(&mut Sheets::new(&tagged), 0, &[]));
        tagged.particles[0].tags[1] = Tag { sheet: 7, side: 1 };
        let mut sheets = Sheets::new(&tagged);
        assert_eq!([0, 1].map(|frame| finds(&mut sheets, frame, &[])), [true, false]);
    }

    /// A blade that clay runs ahead of is in it as long as it puts particles back.
    #[test]
    fn blade_that_puts_clay_back_is_in_it() {
        let mut sheets = Sheets::default();
        for frame in 0..8 {
            assert_eq!(dealt(&mut sheets, frame), [1, 2, 3], "frame {frame}");
            let mut report = report(frame, u64::from(frame == 0), &[1]);
            report.tools[0].pushed_back = if frame < 6 { 7 } else { 0 };
            sheets.note(&mut report);
        }
        assert_eq!(dealt(&mut sheets, 8), [4, 2, 3], "out of the clay since frame 6");
    }

    /// Where every sheet is in use, a visit takes the one that was dealt longest ago, those of the clay as
    /// loaded first, and its frame's report says so.
    #[test]
    fn oldest_sheet_is_dealt_where_none_is_free() {
        let all: Vec<u8> = (1..JOINT_SHEET).collect();
        let mut sheets = Sheets::default();
        let mut health = vec![];
        let mut visits = vec![];
        // In and out again, frame by frame.
        for frame in 0..1200 {
            let [sheet, ..] = dealt(&mut sheets, frame)[..] else { panic!("three blades") };
            visits.push(sheet);
            let mut report = report(frame, (frame + 1) % 2, &all);
            sheets.note(&mut report);
            health.push(report.health);
        }
        assert_eq!((visits[0], health[0]), (1, Health::OK), "nothing is known to be in use");
        visits.dedup();
        assert!(visits.len() > 255 && health.contains(&Health::CROWDED), "{}", visits.len());
        // In turn, without the two that the other blades hold.
        let rounds: Vec<_> = visits.chunks_exact(236).collect();
        assert!(rounds.len() > 1 && rounds.iter().all(|round| *round == rounds[0]), "{visits:?}");
        assert!(visits.iter().all(|sheet| ![2, 3].contains(sheet)));
        let mut given_up = FrameReport { health: Health::GIVEN_UP, ..report(1200, 0, &[]) };
        sheets.note(&mut given_up);
        assert_eq!(sheets.noted.len(), 2, "says nothing");
    }

    /// A blade that is missing from a plan, or is said to have been taken away, has a sheet of its own when
    /// it is back, though it was never seen to leave the clay.
    #[test]
    fn blade_that_was_away_begins_anew() {
        let mut sheets = Sheets::default();
        let run = |sheets: &mut Sheets, frame, ids: &[u32], used: &[u8]| {
            let dealt = dealt_to(sheets, frame, ids);
            sheets.note(&mut report(frame, 9, used));
            dealt
        };
        assert_eq!(run(&mut sheets, 0, &[1], &[1]), [1]);
        assert_eq!(run(&mut sheets, 1, &[1], &[1]), [1]);
        run(&mut sheets, 2, &[], &[1]);
        assert_eq!(run(&mut sheets, 3, &[1], &[1, 2]), [2], "1 is cut");
        sheets.lift(1);
        assert_eq!(run(&mut sheets, 4, &[1], &[1, 2, 3]), [3], "2 may be cut: the report of frame 3 has not come");
        sheets.lift(1);
        run(&mut sheets, 5, &[], &[]);
        run(&mut sheets, 6, &[], &[]);
        assert_eq!(run(&mut sheets, 7, &[1], &[]), [1], "all has been kneaded together");
    }

    /// Boxes thinner than two cells along one edge are plates, with a sheet each that is theirs until they
    /// are taken away, and nobody's in the plan after, but where there is no other; what is thick, or thin
    /// all round, is none, nor is what comes when all are dealt.
    #[test]
    fn plates_have_sheets_of_their_own() {
        let cell_width = 0.1;
        let deal = |sheets: &mut Sheets, boxes: &[(u32, DVec3)]| -> Vec<u8> {
            let path = |(id, half_size): &(u32, DVec3)| {
                let shape = ToolShape::Box { half_size: *half_size };
                ToolPath::still(*id, Tool { shape, contact: Contact::Slip }, Pose::default())
            };
            let tools: Vec<_> = boxes.iter().map(path).collect();
            let mut plan = StepLimits::default().frame(&ClayMaterial::default(), 0.01, 0.01, &tools);
            sheets.deal(&mut plan);
            assert_eq!(plan.validate(), Ok(()));
            plan.tools.iter().map(|path| path.sheet).collect()
        };
        let (thin, thick, rod) = (DVec3::new(0.5, 0.09, 0.5), DVec3::splat(0.1), DVec3::new(0.09, 0.5, 0.09));
        let mut sheets = Sheets { cell_width, ..Sheets::default() };
        assert_eq!(deal(&mut sheets, &[(7, thin), (8, thick), (9, rod), (4, thin)]), [240, 0, 0, 241]);
        assert_eq!(deal(&mut sheets, &[(4, thin), (11, thin)]), [241, 242], "240 was the plate's that is gone");
        assert_eq!(deal(&mut sheets, &[(4, thin), (11, thin), (12, thin)]), [241, 242, 240]);
        sheets.lift(11);
        assert_eq!(deal(&mut sheets, &[(4, thin), (11, thin), (12, thin)]), [241, 243, 240]);
        assert!(deal(&mut sheets, &[]).is_empty());
        assert!(deal(&mut sheets, &[]).is_empty());
        let many: Vec<_> = (20..40).map(|id| (id, thin)).collect();
        let dealt = deal(&mut sheets, &many);
        assert!(dealt[..16].iter().copied().eq(240..=255) && dealt[16..] == [0; 4], "{dealt:?}");
        let others: Vec<_> = (60..62).chain(20..40).map(|id| (id, thin)).collect();
        assert_eq!(deal(&mut sheets, &others)[..3], [0, 0, 240], "held by those that are there");
        assert_eq!(deal(&mut sheets, &others[..2]), [240, 241], "no other is left");
    }

    /// A plan in which what is no box has a plate's sheet, or plates share one, is refused.
    #[test]
    fn sheets_that_clash_are_refused() {
        let plan = |shape, sheets: [u8; 2]| {
            let tool = Tool { shape, contact: Contact::Slip };
            let path = |(id, sheet)| ToolPath { sheet, ..ToolPath::still(id, tool, Pose::default()) };
            let tools: Vec<_> = (1..).zip(sheets).map(path).collect();
            StepLimits::default().frame(&ClayMaterial::default(), 0.01, 0.01, &tools).validate().map_err(|error| error.name)
        };
        let plate = ToolShape::Box { half_size: DVec3::new(0.1, 0.001, 0.1) };
        assert_eq!((plan(BLADE, [1, 238]), plan(plate, [240, 255])), (Ok(()), Ok(())));
        assert_eq!((plan(BLADE, [1, 240]), plan(BLADE, [7, 7])), (Err("sheet"), Err("tool id")));
        assert_eq!((plan(plate, [240, 240]), plan(plate, [0, 0])), (Err("tool id"), Ok(())));
        assert_eq!(plan(ToolShape::Sphere { radius: 0.1 }, [0, 240]), Err("sheet"));
    }

    /// An app may name its blades as it likes: ids that are gone hold no sheet.
    #[test]
    fn ids_that_are_gone_hold_no_sheet() {
        let mut sheets = Sheets::default();
        for frame in 0..2000 {
            let id = frame as u32;
            let mut dealt = dealt_to(&mut sheets, frame, &[id, id + 1]);
            dealt.dedup();
            assert_eq!(dealt.len(), 2);
            let mut report = report(frame, 0, &[]);
            sheets.note(&mut report);
            assert_eq!(report.health, Health::OK);
        }
        assert!(sheets.blades.len() < 8);
    }

    /// The sheet of a blade in each frame, which it ends at one of `rests`; it tags clay in the first frame
    /// alone.
    fn sheets_of(shape: ToolShape, rests: &[DVec3]) -> Vec<u8> {
        let mut sheets = Sheets { cell_width: 0.01, ..Sheets::default() };
        let mut dealt = vec![];
        for (frame, at) in (0..).zip(rests) {
            dealt.push(planned(&mut sheets, frame, shape, &[(1, *at)]).tools[0].sheet);
            let tagged = u64::from(frame == 0) * 40;
            let tools = vec![ToolReport { id: 1, tagged, ..ToolReport::default() }];
            let sheets_used = [1].into_iter().collect();
            sheets.note(&mut FrameReport { plan_id: frame, tools, sheets: sheets_used, ..FrameReport::default() });
        }
        dealt
    }

    /// A blade that rests in its cut, creeps or trembles goes on with the cut, and a wire that is drawn along
    /// itself too; one that is drawn out of the clay begins another.
    #[test]
    fn blades_keep_their_sheets_where_they_rest() {
        const KEPT: [u8; 20] = [1; 20];
        for shape in [BLADE, WIRE] {
            let way = |at: &dyn Fn(f64) -> DVec3| sheets_of(shape, &(0..20).map(|i| at(f64::from(i))).collect::<Vec<_>>());
            assert_eq!(way(&|_| DVec3::ZERO), KEPT, "rests");
            assert_eq!(way(&|i| DVec3::Y * 9e-4 * i), KEPT, "creeps by less than two cells");
            assert_eq!(way(&|i| DVec3::Z * 0.008 * (i % 2.0)), KEPT, "trembles");
            let along = way(&|i| DVec3::X * 0.02 * i);
            assert_eq!(along == KEPT, shape == WIRE, "is drawn along itself: {along:?}");
            let out = way(&|i| DVec3::Y * 0.007 * i);
            assert_eq!((out[4], out[5], out[19]), (1, 2, 2), "the report of frame 3 says that it is 2.1 cells away: {out:?}");
        }
    }
}
