//! The picture of the methods of cutting: per figure a panel, over the way of the blade in a substep, a line
//! per method.

use clay_acceptance::data::Record;
use clay_acceptance::lab::Size;
use clay_acceptance::plot::{self, Area, FONT, Painted, Picture};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;

/// The picture's file in docs/images, without its ending.
pub(crate) const NAME: &str = "cut_methods";
/// What it shows.
pub(crate) const TITLE: &str = "Methods of cutting: what goes through the blade, how deep, and the clay's volume ratios";

/// How the rows name the methods, with a colour and a mark for each (Okabe and Ito 2008: told apart by every
/// eye).
const METHODS: [(&str, RGBColor); 4] = [
    ("ours", RGBColor(0, 0, 0)),
    ("as published", RGBColor(213, 94, 0)),
    ("rigid particles", RGBColor(0, 114, 178)),
    ("interactive particles", RGBColor(0, 158, 115)),
];
/// The panels: title, the figures in it as the rows name them, with the range of the axis, which has decades
/// if it begins above 0.
const PANELS: [(&str, &[&str], Range<f64>); 3] = [
    ("swept particles that go through [%]", &["swept particles that go through"], 0.0..100.0),
    (
        "depth behind the blade: greatest, 95 % [cells]",
        &["greatest depth behind the blade", "P95 depth behind the blade"],
        0.0..16.5,
    ),
    ("volume ratio J: least, greatest", &["least J", "greatest J"], 1e-4..100.0),
];
/// Ways of the blade in a substep [cells].
const WAYS: Range<f64> = 0.015..4.0;
/// Size of a panel, and height of the legend under them [pixels].
const PANEL: (u32, u32) = (430, 360);
const LEGEND: u32 = 120;

/// What is drawn: rows of the full run of the case `cut methods`.
struct Methods<'a>(Vec<&'a Record>);

/// The PNG of the rows on record.
///
/// # Errors
/// A picture that cannot be painted.
pub(crate) fn draw(records: &[Record]) -> Result<Vec<u8>, String> {
    let is_shown = |r: &&Record| r.group == "cut methods" && r.run.size == Size::Full;
    let methods = Methods(records.iter().filter(is_shown).collect());
    let size = (PANEL.0 * PANELS.len() as u32, PANEL.1 + LEGEND);
    let [_, png] = plot::draw(&methods, size).map_err(|e| e.to_string())?;
    Ok(png)
}

impl Methods<'_> {
    /// The figures of a method over the blade's way in a substep.
    fn points(&self, method: &str, figure: &str) -> Vec<(f64, f64)> {
        let start = format!("cut methods, {method}: {figure}, ");
        let point = |r: &&Record| {
            let (_, way) = r.row.case.strip_prefix(&start)?.strip_suffix(" a substep")?.split_once(" at ")?;
            Some((way.parse().ok()?, r.row.value))
        };
        self.0.iter().filter_map(point).collect()
    }

    /// A figure of a method that has one value.
    fn value(&self, method: &str, figure: &str) -> Option<&Record> {
        let case = format!("cut methods, {method}: {figure}");
        self.0.iter().find(|r| r.row.case == case).copied()
    }

    fn lines<B: DrawingBackend>(&self, area: &Area<B>, figures: &[&str], at: impl Fn(f64, f64) -> (i32, i32)) -> Painted<B> {
        for (i, figure) in figures.iter().enumerate() {
            for (method, color) in METHODS {
                let points: Vec<(i32, i32)> = self.points(method, figure).into_iter().map(|(x, y)| at(x, y)).collect();
                // The second figure of a panel is drawn thin, with open marks.
                let stroke = color.stroke_width(if i == 0 { 3 } else { 1 });
                area.draw(&PathElement::new(points.clone(), stroke))?;
                for point in points {
                    let fill = if i == 0 { color.filled() } else { color.stroke_width(1) };
                    area.draw(&Circle::new(point, 5, fill))?;
                }
            }
        }
        Ok(())
    }

    fn panel<B: DrawingBackend>(&self, area: &Area<B>, left: i32, index: usize) -> Painted<B> {
        let (title, figures, range) = &PANELS[index];
        let (low, high) = ((left + 62, PANEL.1 as i32 - 54), (left + PANEL.0 as i32 - 14, 44));
        let share = |value: f64, range: &Range<f64>| {
            if range.start > 0.0 {
                (value.max(range.start) / range.start).ln() / (range.end / range.start).ln()
            } else {
                value / range.end
            }
        };
        let x = |v: f64| low.0 + (share(v, &WAYS) * f64::from(high.0 - low.0)).round() as i32;
        let y = |v: f64| low.1 - (share(v, range) * f64::from(low.1 - high.1)).round() as i32;
        write_at(area, title, ((low.0 + high.0) / 2, 14), 17, (HPos::Center, VPos::Top))?;
        let ticks: Vec<f64> = if range.start > 0.0 {
            (-4..=2).map(|d| 10f64.powi(d)).collect()
        } else {
            (0..=5).map(|i| f64::from(i) * if range.end > 50.0 { 20.0 } else { 3.0 }).collect()
        };
        let faint = RGBColor(228, 228, 228);
        for tick in ticks.into_iter().filter(|t| (range.start..=range.end).contains(t)) {
            area.draw(&PathElement::new(vec![(low.0, y(tick)), (high.0, y(tick))], faint))?;
            write_at(area, &format!("{tick}"), (low.0 - 6, y(tick)), 14, (HPos::Right, VPos::Center))?;
        }
        for tick in [0.02, 0.1, 0.5, 1.0, 3.0] {
            area.draw(&PathElement::new(vec![(x(tick), low.1), (x(tick), high.1)], faint))?;
            write_at(area, &format!("{tick}"), (x(tick), low.1 + 6), 14, (HPos::Center, VPos::Top))?;
        }
        area.draw(&Rectangle::new([(low.0, high.1), (high.0, low.1)], BLACK))?;
        let middle = ((low.0 + high.0) / 2, low.1 + 28);
        write_at(area, "way of the blade in a substep [cells]", middle, 14, (HPos::Center, VPos::Top))?;
        self.lines(area, figures, |a, b| (x(a), y(b)))
    }

    /// Colours, and the figures that each method has one of.
    fn legend<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        for ((method, color), line) in METHODS.into_iter().zip(0..) {
            let y = PANEL.1 as i32 + 16 + 24 * line;
            area.draw(&PathElement::new(vec![(62, y), (92, y)], color.stroke_width(3)))?;
            area.draw(&Circle::new((77, y), 5, color.filled()))?;
            write_at(area, method, (104, y), 16, (HPos::Left, VPos::Center))?;
            for (figure, column) in
                [("momentum that crosses the cut after the blade", 280), ("time per particle and substep", 700)]
            {
                if let Some(record) = self.value(method, figure) {
                    let text = format!("{figure}: {} {}", super::document::figure(record.row.value), record.row.unit);
                    write_at(area, &text, (column, y), 16, (HPos::Left, VPos::Center))?;
                }
            }
        }
        Ok(())
    }
}

impl Picture for Methods<'_> {
    fn paint<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        for index in 0..PANELS.len() {
            self.panel(area, (PANEL.0 * index as u32) as i32, index)?;
        }
        self.legend(area)
    }
}

fn write_at<B: DrawingBackend>(area: &Area<B>, text: &str, at: (i32, i32), size: i32, (h, v): (HPos, VPos)) -> Painted<B> {
    let style = (FONT, size).into_font().color(&BLACK).pos(Pos::new(h, v));
    area.draw(&Text::new(text.to_owned(), at, style))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clay_acceptance::data::Run;
    use clay_acceptance::report::Row;

    #[test]
    fn rows_are_points_over_the_way() {
        let run = Run { size: Size::Full, engine: None, adapter: None, date: String::new(), commit: None };
        let row = |what: &str, value| Record {
            group: "cut methods".into(),
            row: Row::figure(format!("cut methods, {what}"), value, "-"),
            run: run.clone(),
        };
        let rows = [
            row("ours: least J, 5 sweeps at 0.5 a substep", 0.2),
            row("ours: least J, 5 sweeps at 3 a substep", 0.1),
            row("rigid particles: least J, 5 sweeps at 3 a substep", 0.3),
            row("ours: time per particle and substep", 640.0),
        ];
        let methods = Methods(rows.iter().collect());
        assert_eq!(methods.points("ours", "least J"), [(0.5, 0.2), (3.0, 0.1)]);
        assert_eq!(methods.value("ours", "time per particle and substep").map(|r| r.row.value), Some(640.0));
    }
}
