//! What the figures say: what buys accuracy cheapest, in a sentence per panel.

use super::knobs::Knob;
use super::table::{Row, Table};
use std::fmt::Write as _;

/// A change of the error below this counts as none [-]: the difference of two errors is real, that of two
/// times is not always.
const GAIN: f64 = 0.05;

/// A row against the default.
struct Step<'a> {
    row: &'a Row,
    /// Error over the default's.
    error: f64,
    /// Time over the default's.
    cost: f64,
}

impl Step<'_> {
    /// By what the time grows for half the error, as if on a straight line in the chart.
    fn cost_of_halving(&self) -> f64 {
        self.cost.powf(-1.0 / self.error.log2())
    }

    /// What it gains, and at what rate unless it saves time too.
    fn text(&self) -> String {
        let mut text = format!("{:.2} of its error for {} the time", self.error, times(self.cost));
        if self.cost > 1.0 {
            let _ = write!(text, ", {} the time for each halving", times(self.cost_of_halving()));
        }
        text
    }
}

/// One sentence per panel.
pub(crate) fn sentences(table: &Table) -> Vec<String> {
    table.panels().iter().map(|panel| sentence(table, panel)).collect()
}

/// Errors of the same scene that the row's setting makes greater than the default does.
fn losses(table: &Table, row: &Row, base: &Row) -> Vec<String> {
    let others = table.rows.iter().filter(|r| r.scene == row.scene && r.panel != row.panel && r.point == row.point);
    let loss = |other: &Row| {
        let before = table.rows.iter().find(|r| r.panel == other.panel && r.point == base.point)?;
        let ratio = other.error / before.error;
        (ratio > 1.0 + GAIN).then(|| format!("{} the {}", times(ratio), other.axis.trim_end_matches(" [%]")))
    };
    others.filter_map(loss).collect()
}

fn sentence(table: &Table, panel: &str) -> String {
    let rows = table.panel(panel);
    let Some(base) = rows.iter().find(|r| r.point.knob == Knob::Default) else {
        return format!("{panel}: the default could not be measured.");
    };
    let steps: Vec<Step<'_>> = rows
        .iter()
        .filter(|r| r.point.knob != Knob::Default)
        .map(|row| Step { row, error: row.error / base.error, cost: row.median() / base.median() })
        .collect();
    let of = |knob: Knob| steps.iter().filter(move |s| s.row.point.knob == knob);
    let mut gains: Vec<&Step<'_>> = Knob::ALL
        .iter()
        .filter_map(|&knob| {
            of(knob).filter(|s| s.error < 1.0 - GAIN).min_by(|a, b| a.cost_of_halving().total_cmp(&b.cost_of_halving()))
        })
        .collect();
    gains.sort_by(|a, b| a.cost_of_halving().total_cmp(&b.cost_of_halving()));
    let mut text = format!("{panel}: from {}, ", base.point.label());
    match gains.split_first() {
        None => text.push_str("nothing that was turned lessens the error"),
        Some((best, others)) => {
            let _ = write!(text, "{} buys accuracy cheapest: {}", best.row.point.label(), best.text());
            for loss in losses(table, best.row, base) {
                let _ = write!(text, " (but {loss})");
            }
            for other in others {
                let _ = write!(text, "; {}: {}", other.row.point.label(), other.text());
            }
        }
    }
    let idle: Vec<&str> = Knob::ALL
        .iter()
        .filter(|&&knob| of(knob).count() > 0 && of(knob).all(|s| (s.error - 1.0).abs() <= GAIN))
        .map(|knob| knob.name())
        .collect();
    if !idle.is_empty() {
        let _ = write!(text, "; turning {} changes it by less than 5 %", idle.join(" or "));
    }
    // Walls at the default's own cells: what reflection has bought already.
    if let Some(clamped) = of(Knob::Walls).find(|s| s.row.point.setting.cells == base.point.setting.cells && s.error > 1.0 + GAIN)
    {
        let _ = write!(text, "; clamped walls would make {} the error at {} the time", times(clamped.error), times(clamped.cost));
    }
    text.push('.');
    text
}

/// "1.8 times".
fn times(value: f64) -> String {
    if value < 9.95 { format!("{value:.1} times") } else { format!("{value:.0} times") }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::knobs::Setting;
    use super::super::table::tests::{row, table};
    use super::*;

    /// A default and a step of each knob but averaging.
    pub(crate) fn rows() -> Vec<Row> {
        let base = Setting::new(16);
        vec![
            row(Knob::Default, base, 1.0, 100.0),
            // Half the error for 4 times the time, a quarter for 32 times.
            row(Knob::Cells, Setting { cells: 24, ..base }, 0.5, 400.0),
            row(Knob::Cells, Setting { cells: 32, ..base }, 0.25, 3200.0),
            row(Knob::Particles, Setting { per_axis: 3, ..base }, 0.25, 300.0),
            row(Knob::Step, Setting { fraction: 0.2, ..base }, 1.01, 350.0),
            row(Knob::Walls, Setting { clamped_walls: true, ..base }, 20.0, 90.0),
        ]
    }

    #[test]
    fn cheapest_knob_is_named_first_and_the_idle_one_too() {
        let sentences = sentences(&table(rows()));
        let expected = "Self weight, stress: from 16 cells, 27 per cell buys accuracy cheapest: 0.25 of its error for 3.0 times the time, \
                        1.7 times the time for each halving; 24 cells: 0.50 of its error for 4.0 times the time, \
                        4.0 times the time for each halving; turning time step changes it by less than 5 %; \
                        clamped walls would make 20 times the error at 0.9 times the time.";
        assert_eq!(sentences, [expected]);
    }

    /// What helps one error and spoils another of the same scene is said.
    #[test]
    fn loss_in_another_panel_is_said() {
        let other = |row: &Row, error: f64| Row {
            panel: "Self weight, displacement".into(),
            axis: "L2 error [%]".into(),
            error,
            ..row.clone()
        };
        let rows = rows();
        let mut all = vec![rows[0].clone(), rows[3].clone()];
        all.extend([other(&rows[0], 0.1), other(&rows[3], 0.6)]);
        let sentence = &sentences(&table(all))[0];
        assert!(sentence.ends_with("for each halving (but 6.0 times the L2 error)."), "{sentence}");
    }

    #[test]
    fn nothing_gained_is_said() {
        let base = Setting::new(16);
        let worse = row(Knob::Cells, Setting { cells: 8, ..base }, 2.0, 10.0);
        let sentences = sentences(&table(vec![row(Knob::Default, base, 1.0, 100.0), worse]));
        assert_eq!(sentences, ["Self weight, stress: from 16 cells, nothing that was turned lessens the error."]);
    }
}
