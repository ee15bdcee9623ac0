//! Deals sheets to blades: each visit of a blade to the clay is a cut of its own.
//!
//! A blade that leaves the clay and comes back somewhere else, across its first cut perhaps, must not take the sides of that cut for its own.

use super::cut::SheetSet;
use super::engine::{FramePlan, FrameReport};
use super::health::Health;
use super::snapshot::Snapshot;
use std::collections::VecDeque;

/// Which sheet each blade cuts, and which are in use. Whoever plans frames passes every plan through [`Self::deal`] and every report to [`Self::note`]. The
/// plan of frame n depends on the reports up to that of frame n - 2, however early others come.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheets {
    blades: Vec<BladeSheet>,
    used: SheetSet,
    /// Reports whose turn has not come.
    noted: VecDeque<Noted>,
}

/// A blade's present sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct BladeSheet {
    id: u32,
    sheet: u8,
    /// Whether the blade has touched clay since it got the sheet.
    is_in_clay: bool,
}

/// What a report says of cuts.
#[derive(Clone, Debug, PartialEq)]
struct Noted {
    plan_id: u64,
    used: SheetSet,
    /// Each tool's id, and whether it touched clay.
    tools: Vec<(u32, bool)>,
}

impl Sheets {
    /// For clay that may have cuts already.
    pub fn new(snapshot: &Snapshot) -> Self {
        let tags = snapshot.particles.iter().flat_map(|p| p.tags);
        Self { used: tags.filter(|tag| tag.side != 0).map(|tag| tag.sheet).collect(), ..Self::default() }
    }

    /// Gives every blade of a plan its sheet: the one it has, or, when it is new, one that is free.
    pub fn deal(&mut self, plan: &mut FramePlan) {
        while let Some(noted) = self.noted.pop_front_if(|noted| noted.plan_id + 2 <= plan.id) {
            self.apply(&noted);
        }
        for path in plan.tools.iter_mut().filter(|path| path.tool.shape.is_blade()) {
            let held = self.blades.iter().find(|blade| blade.id == path.id).map(|blade| blade.sheet);
            path.sheet = held.unwrap_or_else(|| {
                let sheet = self.free(path.sheet_id());
                self.blades.push(BladeSheet { id: path.id, sheet, is_in_clay: false });
                sheet
            });
        }
    }

    /// Takes note of what a report says of cuts; a frame given up says nothing.
    pub fn note(&mut self, report: &FrameReport) {
        if report.health.contains(Health::GIVEN_UP) {
            return;
        }
        let tools = report.tools.iter().map(|tool| (tool.id, tool.contacts + tool.tagged > 0)).collect();
        self.noted.push_back(Noted { plan_id: report.plan_id, used: report.sheets, tools });
    }

    /// Blades that have left the clay get another sheet for their next visit.
    fn apply(&mut self, noted: &Noted) {
        self.used = noted.used;
        for i in 0..self.blades.len() {
            let BladeSheet { id, sheet, is_in_clay } = self.blades[i];
            match noted.tools.iter().find(|tool| tool.0 == id) {
                Some((_, true)) => self.blades[i].is_in_clay = true,
                Some((_, false)) if is_in_clay => {
                    self.blades[i] = BladeSheet { id, sheet: self.free(sheet), is_in_clay: false };
                }
                _ => {}
            }
        }
    }

    /// The first sheet from `first` on, and around, that is neither in use nor a blade's; `first` itself if there is none.
    fn free(&self, first: u8) -> u8 {
        let is_free = |sheet: &u8| !self.used.contains(*sheet) && self.blades.iter().all(|blade| blade.sheet != *sheet);
        (first.max(1)..=u8::MAX).chain(1..first).find(is_free).unwrap_or(first)
    }
}

#[cfg(test)]
mod tests {
    use super::super::engine::ToolReport;
    use super::super::material::ClayMaterial;
    use super::super::plan::StepLimits;
    use super::super::tool::{Contact, Pose, Tool, ToolPath, ToolShape};
    use super::*;

    /// The sheets that frame `id` of three blades gets.
    fn dealt(sheets: &mut Sheets, id: u64) -> Vec<u8> {
        let shape = ToolShape::Blade { half_width: 0.1, half_height: 0.1 };
        let blade = |id| ToolPath::still(id, Tool { shape, contact: Contact::Slip }, Pose::default());
        let tools = [1, 2, 257].map(blade);
        let mut plan = FramePlan { id, ..StepLimits::default().frame(&ClayMaterial::default(), 0.01, 0.01, &tools) };
        sheets.deal(&mut plan);
        assert_eq!(plan.validate(), Ok(()));
        plan.tools.iter().map(|path| path.sheet).collect()
    }

    /// Frame `plan_id`, in which the first blade had these contacts.
    fn report(plan_id: u64, contacts: u64, sheets: &[u8]) -> FrameReport {
        let tools = [(1, contacts), (2, 0), (257, 0)].map(|(id, contacts)| ToolReport { id, contacts, ..ToolReport::default() });
        FrameReport { plan_id, tools: tools.into(), sheets: sheets.iter().copied().collect(), ..FrameReport::default() }
    }

    /// A blade keeps its sheet while it is in the clay and until it touches clay; out of it, it gets one that nobody has.
    #[test]
    fn each_visit_has_a_sheet_of_its_own() {
        let mut sheets = Sheets::default();
        assert_eq!(dealt(&mut sheets, 0), [1, 2, 3], "257 has the low byte of 1");
        sheets.note(&report(0, 9, &[1]));
        assert_eq!(dealt(&mut sheets, 2), [1, 2, 3]);
        sheets.note(&report(1, 0, &[1, 4]));
        assert_eq!(dealt(&mut sheets, 2), [1, 2, 3], "the report of frame n - 1 has no part in frame n");
        assert_eq!(dealt(&mut sheets, 3), [5, 2, 3], "1 is cut, 2 and 3 are blades', 4 is cut");
        sheets.note(&report(2, 0, &[4]));
        assert_eq!(dealt(&mut sheets, 4), [5, 2, 3], "kept until it cuts");
        sheets.note(&FrameReport { health: Health::GIVEN_UP, ..report(3, 0, &[]) });
        let all: Vec<u8> = (1..=255).collect();
        sheets.note(&report(3, 3, &all));
        sheets.note(&report(4, 0, &all));
        assert_eq!(dealt(&mut sheets, 6), [5, 2, 3], "none is free: it goes on with its own");
    }
}
