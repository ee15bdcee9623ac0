//! The runs, and their file.

use super::sweep::Point;
use clay_acceptance::cases::implicit::Way;
use clay_acceptance::data::{self, Run};
use clay_acceptance::lab::{EngineKind, Size};
use clay_acceptance::machine;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::Path;

/// The table's file in the folder of the documents.
pub(crate) const FILE: &str = "data/work_precision.json";

/// A run on record.
#[derive(Serialize, Deserialize)]
struct Record {
    #[serde(flatten)]
    point: Point,
    #[serde(flatten)]
    run: Run,
}

/// Everything that was measured, and on what.
pub(crate) struct Table {
    /// With what.
    pub(crate) run: Run,
    /// The runs.
    pub(crate) points: Vec<Point>,
}

impl Table {
    /// An empty table of this program on this machine.
    pub(crate) fn new(size: Size) -> Self {
        let (engine, adapter) = (Some(EngineKind::Native), Some(machine::processor()));
        Self { run: Run { size, engine, adapter, date: machine::today(), commit: machine::commit() }, points: vec![] }
    }

    /// The table on record in the folder of the documents; its rows are of one run.
    pub(crate) fn read(docs: &Path) -> Result<Self, String> {
        let file = docs.join(FILE);
        let mut records: Vec<Record> = data::read(&file)?;
        let run = records.first().map(|r| r.run.clone()).ok_or_else(|| format!("{}: no row", file.display()))?;
        if records.iter().any(|r| r.run != run) {
            return Err(format!("{}: rows of more than one run, whose times do not compare", file.display()));
        }
        Ok(Self { run, points: records.drain(..).map(|r| r.point).collect() })
    }

    /// The text of the table's file in the folder of the documents.
    pub(crate) fn record(&self) -> Result<String, String> {
        let record = |point: &Point| Record { point: point.clone(), run: self.run.clone() };
        data::text(&self.points.iter().map(record).collect::<Vec<_>>())
    }

    /// Where the figures come from, in a line.
    pub(crate) fn provenance(&self) -> String {
        format!("Measured {}, one core", self.run.words())
    }

    /// Tools and speeds [mm/s], in order.
    pub(crate) fn strokes(&self) -> Vec<(&str, f64)> {
        let mut strokes: Vec<(&str, f64)> = vec![];
        for p in &self.points {
            if !strokes.contains(&(&*p.tool, p.speed)) {
                strokes.push((&*p.tool, p.speed));
            }
        }
        strokes
    }

    /// The runs of a tool at a speed [mm/s].
    pub(crate) fn of(&self, tool: &str, speed: f64) -> Vec<&Point> {
        self.points.iter().filter(|p| p.tool == tool && p.speed == speed).collect()
    }

    /// All runs, a line each.
    pub(crate) fn csv(&self) -> String {
        let mut text = String::from(
            "tool,speed_mm_per_s,family,step_over_limit,density_scale,travel_cells,passes_per_step,passes_per_frame,core_ms_per_frame,\
             force_error_percent,ways_error_percent,own_force_error_percent,own_ways_error_percent,run\n",
        );
        for p in &self.points {
            let setting = match p.way {
                Way::Explicit(part) => format!("{},1,,", part * bevy_clay::sim::planner::STEP_FRACTION),
                Way::Scaled(scale) => format!("{},{scale},,", bevy_clay::sim::planner::STEP_FRACTION),
                Way::Implicit(pace) => format!(",1,{},{}", pace.travel, pace.passes),
            };
            let errors = p.errors.map_or_else(|| ",".into(), |[force, ways]| format!("{force},{ways}"));
            let [force, ways] = p.uncertainty;
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{},{},\"{}\",{setting},{},{},{errors},{force},{ways},\"{}\"",
                p.tool,
                p.speed,
                p.family().name(),
                p.passes,
                p.time,
                self.run.words()
            );
        }
        text
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use bevy_clay::sim::prelude::*;
    use clay_acceptance::cases::implicit::Pace;

    /// A table of a strip at 20 mm/s.
    pub(crate) fn table() -> Table {
        let point = |way, passes: f64, errors| Point {
            tool: "strip".into(),
            speed: 20.0,
            way,
            passes,
            time: 2.0 * passes,
            errors,
            uncertainty: [0.2, 0.3],
        };
        let run = Run { size: Size::Full, engine: None, adapter: None, date: "a day".into(), commit: None };
        let fast = InertiaScaling::Fast.density_scale(&Preset::SoftClay.material(), 0.02);
        let pace = |passes| Way::Implicit(Pace { travel: 0.225, passes });
        let points = vec![
            point(Way::Explicit(1.0), 400.0, Some([0.5, 1.0])),
            point(Way::Scaled(fast), 50.0, Some([4.0, 9.0])),
            point(pace(10), 10.0, Some([4.0, 9.0])),
            point(pace(5), 5.0, None),
        ];
        Table { run, points }
    }

    #[test]
    fn csv_has_as_many_fields_in_every_row() {
        let text = table().csv();
        // No name holds a comma between its quotes but the run and the explicit families, one each.
        let fields: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
        assert_eq!(fields, [14, 16, 16, 15, 15], "{text}");
    }
}
