//! The rows, which of them no other betters, and their file.

use super::knobs::Point;
use super::scenes::{Panel, Run, Scene};
use clay_acceptance::data::{self, Run as Provenance};
use clay_acceptance::lab::{self, EngineKind, Size};
use clay_acceptance::machine;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

/// One error of one run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Row {
    /// The scene.
    pub(crate) scene: Cow<'static, str>,
    /// The panel.
    pub(crate) panel: Cow<'static, str>,
    /// The name of its axis.
    pub(crate) axis: Cow<'static, str>,
    /// What was turned.
    #[serde(flatten)]
    pub(crate) point: Point,
    /// Particles.
    pub(crate) particles: usize,
    /// Substeps; not known of old rows.
    pub(crate) steps: Option<u64>,
    /// The error [%].
    pub(crate) error: f64,
    /// Quartiles of the wall time per simulated second [ms/s].
    pub(crate) cost: [f64; 3],
    /// Stretches that were timed.
    pub(crate) repeats: usize,
    /// Whether no other row of the panel is at least as good in both.
    pub(crate) on_front: bool,
}

impl Row {
    /// The row of one panel of a run.
    pub(crate) fn new(scene: &Scene, panel: &Panel, point: Point, error: f64, run: &Run) -> Self {
        let times: Vec<f64> = run.stretches.iter().map(|s| 1e3 * s / run.simulated).collect();
        Self {
            scene: scene.name.into(),
            panel: panel.name.into(),
            axis: panel.error.into(),
            point,
            particles: run.particles,
            steps: Some(run.steps),
            error,
            cost: quartiles(&times),
            repeats: times.len(),
            on_front: false,
        }
    }

    /// Median wall time per simulated second [ms/s].
    pub(crate) fn median(&self) -> f64 {
        self.cost[1]
    }

    /// The row in the program's output.
    pub(crate) fn line(&self) -> String {
        let [low, median, high] = self.cost;
        format!(
            "{:26} {:16} {:>8} particles {:>10.4} % {median:>10.1} ms/s ({low:.1} to {high:.1})",
            self.panel,
            self.point.label(),
            self.particles,
            self.error
        )
    }

    /// Whether the row has figures that can be compared.
    fn is_sound(&self) -> bool {
        self.error.is_finite() && self.error > 0.0 && self.median() > 0.0
    }
}

/// Lower quartile, median and upper quartile, between neighbours in proportion.
fn quartiles(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    [0.25, 0.5, 0.75].map(|share| {
        let at = share * (sorted.len() - 1) as f64;
        let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
        low + (high - low) * at.fract()
    })
}

/// The table's file in the folder of the documents.
pub(crate) const FILE: &str = "data/chart.json";

/// A row on record.
#[derive(Serialize, Deserialize)]
struct Record {
    #[serde(flatten)]
    row: Row,
    #[serde(flatten)]
    run: Provenance,
}

/// Everything that was measured, and on what.
pub(crate) struct Table {
    /// With what.
    pub(crate) run: Provenance,
    /// The rows.
    pub(crate) rows: Vec<Row>,
}

impl Table {
    /// An empty table of this program on this machine.
    pub(crate) fn new(engine: EngineKind, size: Size) -> Self {
        let adapter = Some(format!("{}; {}", machine::processor(), lab::engine(0).describe()));
        let (date, commit) = (machine::today(), machine::commit());
        Self { run: Provenance { size, engine: Some(engine), adapter, date, commit }, rows: vec![] }
    }

    /// The table on record in the folder of the documents; its rows are of one run.
    pub(crate) fn read(docs: &Path) -> Result<Self, String> {
        let file = docs.join(FILE);
        let mut records: Vec<Record> = data::read(&file)?;
        let run = records.first().map(|r| r.run.clone()).ok_or_else(|| format!("{}: no row", file.display()))?;
        if records.iter().any(|r| r.run != run) {
            return Err(format!("{}: rows of more than one run, whose times do not compare", file.display()));
        }
        Ok(Self { run, rows: records.drain(..).map(|r| r.row).collect() })
    }

    /// The text of the table's file in the folder of the documents.
    pub(crate) fn record(&self) -> Result<String, String> {
        let record = |row: &Row| Record { row: row.clone(), run: self.run.clone() };
        data::text(&self.rows.iter().map(record).collect::<Vec<_>>())
    }

    /// Where the figures come from, in a line.
    pub(crate) fn provenance(&self) -> String {
        format!("Measured {}", self.run.words())
    }

    /// The panels that have rows, in order.
    pub(crate) fn panels(&self) -> Vec<&str> {
        let mut panels = vec![];
        for row in &self.rows {
            if !panels.contains(&&*row.panel) {
                panels.push(&*row.panel);
            }
        }
        panels
    }

    /// The rows of a panel that can be compared.
    pub(crate) fn panel(&self, name: &str) -> Vec<&Row> {
        self.rows.iter().filter(|r| r.panel == name && r.is_sound()).collect()
    }

    /// Marks in each panel the rows that no other betters.
    pub(crate) fn mark_fronts(&mut self) {
        let better = |a: &Row, b: &Row| {
            let no_worse = a.median() <= b.median() && a.error <= b.error;
            a.panel == b.panel && no_worse && (a.median() < b.median() || a.error < b.error)
        };
        let is_on_front = |r: &Row| r.is_sound() && !self.rows.iter().any(|other| other.is_sound() && better(other, r));
        let marks: Vec<bool> = self.rows.iter().map(is_on_front).collect();
        for (row, mark) in self.rows.iter_mut().zip(marks) {
            row.on_front = mark;
        }
    }

    /// All rows, a line each.
    pub(crate) fn csv(&self) -> String {
        let mut text = String::from(
            "scene,panel,knob,value,label,cells,particles_per_cell,step_fraction,clamped_walls,volume_averaging,particles,substeps,error_percent,\
             ms_per_simulated_s_median,ms_per_simulated_s_q1,ms_per_simulated_s_q3,repeats,seed,on_front,run\n",
        );
        let quoted = |s: &str| format!("\"{}\"", s.replace('"', "\"\""));
        for r in &self.rows {
            let (s, [q1, median, q3]) = (&r.point.setting, r.cost);
            let (panel, value, label) = (quoted(&r.panel), quoted(&r.point.value()), quoted(&r.point.label()));
            let _ = write!(text, "{},{panel},{},{value},{label},{},", r.scene, r.point.knob.name(), s.cells);
            let _ = write!(text, "{},{},{},{},", s.per_axis.pow(3), s.fraction, s.clamped_walls, s.volume_averaging);
            let _ = write!(
                text,
                "{},{},{},{median},{q1},{q3},{},0,{},",
                r.particles,
                r.steps.unwrap_or_default(),
                r.error,
                r.repeats,
                r.on_front
            );
            let _ = writeln!(text, "{}", quoted(&self.run.words()));
        }
        text
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::knobs::{Knob, Setting};
    use super::*;

    /// A row with a knob, cells, an error [%] and a cost [ms/s].
    pub(crate) fn row(knob: Knob, setting: Setting, error: f64, cost: f64) -> Row {
        Row {
            scene: "self weight".into(),
            panel: "Self weight, stress".into(),
            axis: "error [%]".into(),
            point: Point { knob, setting },
            particles: 1000,
            steps: Some(100),
            error,
            cost: [cost * 0.9, cost, cost * 1.1],
            repeats: 5,
            on_front: false,
        }
    }

    /// A table of rows.
    pub(crate) fn table(rows: Vec<Row>) -> Table {
        let date = "a day with \"quotes\"".into();
        let run = Provenance { size: Size::Full, engine: None, adapter: None, date, commit: Some("abc".into()) };
        let mut table = Table { rows, run };
        table.mark_fronts();
        table
    }

    #[test]
    fn quartiles_are_between_neighbours() {
        assert_eq!(quartiles(&[5.0, 1.0, 2.0, 4.0, 3.0]), [2.0, 3.0, 4.0]);
        assert_eq!(quartiles(&[1.0, 2.0]), [1.25, 1.5, 1.75]);
        assert_eq!(quartiles(&[7.0]), [7.0; 3]);
    }

    /// A row is off the front if another is better in one figure and no worse in the other; what is not
    /// finite is on no front and betters nothing.
    #[test]
    fn front_holds_what_no_other_betters() {
        let at = |error, cost| row(Knob::Cells, Setting::new(8), error, cost);
        let table = table(vec![
            at(4.0, 10.0),
            at(2.0, 20.0),
            at(2.0, 30.0),
            at(3.0, 25.0),
            at(1.0, 90.0),
            at(f64::NAN, 1.0),
            at(0.0, 2.0),
        ]);
        let marks: Vec<bool> = table.rows.iter().map(|r| r.on_front).collect();
        assert_eq!(marks, [true, true, false, false, true, false, false]);
    }

    #[test]
    fn csv_has_as_many_fields_in_every_row() {
        let text = table(vec![row(Knob::Default, Setting::new(16), 0.5, 300.0)]).csv();
        let lines: Vec<&str> = text.lines().collect();
        // No name holds a comma between its quotes but the panel and the run of this table: one and two.
        assert_eq!((lines.len(), lines[0].split(',').count() + 3), (2, lines[1].split(',').count()), "{text}");
        assert!(lines[1].contains("\"full, a day with \"\"quotes\"\", abc\"") && lines[1].contains(",0.5,300,270,330"), "{text}");
    }
}
