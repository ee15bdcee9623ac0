//! The chart: per panel the error over the time of a simulated second, both in decades, with real time, the
//! front, and a value beside each point.

use super::knobs::Knob;
use super::table::{Row, Table};
use clay_acceptance::plot::{Area, Axis, Painted, Picture, number, text};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// Size of a panel with its axes [pixels].
const PANEL: (i32, i32) = (520, 520);
/// Room about a panel's frame for title and axes: left, top, right, bottom [pixels].
const MARGIN: (i32, i32, i32, i32) = (78, 44, 32, 62);
/// Height of the legend and the provenance under the panels [pixels].
const FOOT: i32 = 92;
const INK: RGBColor = RGBColor(40, 40, 40);
const FAINT: RGBColor = RGBColor(228, 228, 228);
const FRONT: RGBColor = RGBColor(150, 150, 150);
const REAL_TIME: RGBColor = RGBColor(200, 30, 30);
/// Wall time per simulated second in real time [ms/s].
const REAL: f64 = 1000.0;

/// A point in pixels.
type Pixel = (i32, i32);

/// Size of the whole picture [pixels].
pub(crate) fn size(table: &Table) -> (u32, u32) {
    // The legend needs the width of two panels.
    let panels = table.panels().len().max(2) as i32;
    ((panels * PANEL.0).cast_unsigned(), (PANEL.1 + FOOT).cast_unsigned())
}

/// The picture of a table.
pub(crate) struct Chart<'a>(pub(crate) &'a Table);

impl Picture for Chart<'_> {
    fn paint<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        for (i, name) in self.0.panels().iter().enumerate() {
            let rows = self.0.panel(name);
            if !rows.is_empty() {
                Frame::new(i as i32 * PANEL.0, &rows).paint(area, name, &rows)?;
            }
        }
        legend(area, self.0)
    }
}

fn color(knob: Knob) -> RGBColor {
    // Okabe and Ito 2008: told apart by every eye.
    match knob {
        Knob::Default => RGBColor(0, 0, 0),
        Knob::Cells => RGBColor(0, 114, 178),
        Knob::Particles => RGBColor(230, 120, 0),
        Knob::Step => RGBColor(0, 140, 100),
        Knob::Walls => RGBColor(190, 70, 0),
        Knob::Averaging => RGBColor(180, 90, 150),
    }
}

/// The mark of a knob.
fn mark<B: DrawingBackend>(area: &Area<B>, knob: Knob, (x, y): Pixel) -> Painted<B> {
    let color = color(knob);
    let filled = color.filled();
    match knob {
        Knob::Default => {
            area.draw(&Circle::new((x, y), 8, color.stroke_width(2)))?;
            area.draw(&Circle::new((x, y), 4, filled))
        }
        Knob::Cells => area.draw(&Circle::new((x, y), 5, filled)),
        Knob::Particles => area.draw(&Polygon::new(vec![(x, y - 6), (x + 6, y + 5), (x - 6, y + 5)], filled)),
        Knob::Step => area.draw(&Rectangle::new([(x - 5, y - 5), (x + 5, y + 5)], filled)),
        Knob::Walls => {
            area.draw(&PathElement::new(vec![(x - 5, y - 5), (x + 5, y + 5)], color.stroke_width(3)))?;
            area.draw(&PathElement::new(vec![(x - 5, y + 5), (x + 5, y - 5)], color.stroke_width(3)))
        }
        Knob::Averaging => area.draw(&Polygon::new(vec![(x, y - 7), (x + 7, y), (x, y + 7), (x - 7, y)], filled)),
    }
}

/// One panel.
struct Frame {
    left: i32,
    x: Axis,
    y: Axis,
}

impl Frame {
    fn new(left: i32, rows: &[&Row]) -> Self {
        let across = (left + MARGIN.0, left + PANEL.0 - MARGIN.2);
        let down = (PANEL.1 - MARGIN.3, MARGIN.1);
        let costs = rows.iter().flat_map(|r| r.cost).filter(|c| *c > 0.0).chain([REAL]);
        Self { left, x: Axis::about(costs, (0.25, 0.35), across), y: Axis::about(rows.iter().map(|r| r.error), (0.2, 0.2), down) }
    }

    fn at(&self, row: &Row) -> Pixel {
        (self.x.pixel(row.median()), self.y.pixel(row.error))
    }

    /// Ends of the bar of a row.
    fn quartiles(&self, row: &Row) -> (i32, i32) {
        let [low, _, high] = row.cost.map(|c| self.x.pixel(c.max(f64::MIN_POSITIVE)).max(self.x.pixels.0));
        (low, high)
    }

    fn paint<B: DrawingBackend>(&self, area: &Area<B>, title: &str, rows: &[&Row]) -> Painted<B> {
        self.axes(area, title, &rows[0].axis)?;
        self.real_time(area)?;
        area.draw(&PathElement::new(self.front_path(rows), FRONT.stroke_width(3)))?;
        for row in rows {
            let (x, y) = self.at(row);
            let (low, high) = self.quartiles(row);
            area.draw(&PathElement::new(vec![(low, y), (high, y)], color(row.point.knob).mix(0.6)))?;
            mark(area, row.point.knob, (x, y))?;
        }
        self.values(area, rows)
    }

    /// Grid, frame, numbers and names.
    fn axes<B: DrawingBackend>(&self, area: &Area<B>, title: &str, error: &str) -> Painted<B> {
        let ((left, right), (bottom, top)) = (self.x.pixels, self.y.pixels);
        for (value, has_number) in self.x.ticks() {
            let x = self.x.pixel(value);
            let width = if has_number { 2 } else { 1 };
            area.draw(&PathElement::new(vec![(x, bottom), (x, top)], FAINT.stroke_width(width)))?;
            if has_number {
                area.draw(&Text::new(number(value), (x, bottom + 7), text(16, INK, HPos::Center, VPos::Top)))?;
            }
        }
        for (value, has_number) in self.y.ticks() {
            let y = self.y.pixel(value);
            let width = if has_number { 2 } else { 1 };
            area.draw(&PathElement::new(vec![(left, y), (right, y)], FAINT.stroke_width(width)))?;
            if has_number {
                area.draw(&Text::new(number(value), (left - 7, y), text(16, INK, HPos::Right, VPos::Center)))?;
            }
        }
        area.draw(&Rectangle::new([(left, top), (right, bottom)], INK.stroke_width(1)))?;
        let middle = ((left + right) / 2, (top + bottom) / 2);
        area.draw(&Text::new(title.to_owned(), (middle.0, top - 12), text(20, INK, HPos::Center, VPos::Bottom)))?;
        let below = (middle.0, bottom + 34);
        area.draw(&Text::new("wall time per simulated second [ms/s]", below, text(17, INK, HPos::Center, VPos::Top)))?;
        let upright = text(17, INK, HPos::Center, VPos::Top).transform(FontTransform::Rotate270);
        area.draw(&Text::new(error.to_owned(), (self.left + 14, middle.1), upright))
    }

    fn real_time<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        let (x, (bottom, top)) = (self.x.pixel(REAL), self.y.pixels);
        for y in (top..bottom).step_by(10) {
            area.draw(&PathElement::new(vec![(x, y), (x, (y + 6).min(bottom))], REAL_TIME.stroke_width(2)))?;
        }
        area.draw(&Text::new("real time", (x + 5, bottom - 6), text(15, REAL_TIME, HPos::Left, VPos::Bottom)))
    }

    /// The rows that no other betters, joined in steps: what can be had for a time is at the corner.
    fn front_path(&self, rows: &[&Row]) -> Vec<Pixel> {
        let mut front: Vec<Pixel> = rows.iter().filter(|r| r.on_front).map(|r| self.at(r)).collect();
        front.sort_unstable();
        let mut path: Vec<Pixel> = vec![];
        for (i, &at) in front.iter().enumerate() {
            if i > 0 {
                path.push((at.0, front[i - 1].1));
            }
            path.push(at);
        }
        path
    }

    /// Each point's value where it covers nothing, tied to the point if far.
    fn values<B: DrawingBackend>(&self, area: &Area<B>, rows: &[&Row]) -> Painted<B> {
        let mut taken: Vec<[Pixel; 2]> = rows.iter().map(|r| box_about(self.at(r), (16, 16))).collect();
        taken.extend(rows.iter().map(|r| {
            let ((low, high), (_, y)) = (self.quartiles(r), self.at(r));
            [(low, y - 1), (high, y + 1)]
        }));
        taken.push(box_about((self.x.pixel(REAL) + 35, self.y.pixels.0 - 14), (80, 22)));
        taken.push([(self.x.pixel(REAL) - 2, self.y.pixels.1), (self.x.pixel(REAL) + 2, self.y.pixels.0)]);
        taken.extend(self.front_path(rows).windows(2).map(|w| {
            let (low, high) = ((w[0].0.min(w[1].0), w[0].1.min(w[1].1)), (w[0].0.max(w[1].0), w[0].1.max(w[1].1)));
            [(low.0 - 2, low.1 - 2), (high.0 + 2, high.1 + 2)]
        }));
        for row in rows {
            let at = self.at(row);
            let style = text(15, color(row.point.knob), HPos::Center, VPos::Center);
            let value = if row.point.knob == Knob::Walls { row.point.setting.cells.to_string() } else { row.point.value() };
            let (w, h) = area.estimate_text_size(&value, &style)?;
            let size = (w.cast_signed() + 4, h.cast_signed() + 2);
            let (place, radius) = self.free_place(at, size, &taken);
            if radius > 1 {
                area.draw(&PathElement::new(vec![at, place], color(row.point.knob).mix(0.5)))?;
                let [low, high] = box_about(place, (size.0 - 2, size.1 - 2));
                area.draw(&Rectangle::new([low, high], WHITE.mix(0.85).filled()))?;
            }
            area.draw(&Text::new(value, place, style))?;
            taken.push(box_about(place, size));
        }
        Ok(())
    }

    /// The nearest place about `at` for a box that meets the fewest others, and how many rings away it is.
    fn free_place(&self, at: Pixel, size: (i32, i32), taken: &[[Pixel; 2]]) -> (Pixel, i32) {
        let ((left, right), (bottom, top)) = (self.x.pixels, self.y.pixels);
        let directions = [(1, 0), (0, -1), (0, 1), (-1, 0), (1, -1), (1, 1), (-1, -1), (-1, 1)];
        let places = (1..=6).flat_map(|ring| {
            let reach = (size.0 / 2 + 10 + 16 * (ring - 1), size.1 / 2 + 9 + 16 * (ring - 1));
            directions.map(|(x, y)| ((at.0 + x * reach.0, at.1 + y * reach.1), ring))
        });
        let met = |(place, _): &(Pixel, i32)| {
            let [low, high] = box_about(*place, size);
            let is_outside = low.0 < left || high.0 > right || low.1 < top || high.1 > bottom;
            let meets = |b: &&[Pixel; 2]| low.0 < b[1].0 && b[0].0 < high.0 && low.1 < b[1].1 && b[0].1 < high.1;
            100 * usize::from(is_outside) + taken.iter().filter(meets).count()
        };
        places.min_by_key(met).unwrap_or((at, 1))
    }
}

/// Corners of a box by its middle.
fn box_about((x, y): Pixel, (w, h): (i32, i32)) -> [Pixel; 2] {
    [(x - w / 2, y - h / 2), (x + w / 2, y + h / 2)]
}

/// What the marks stand for, and where the figures come from.
fn legend<B: DrawingBackend>(area: &Area<B>, table: &Table) -> Painted<B> {
    let entry = |knob: Knob| match knob {
        Knob::Default => "default",
        Knob::Cells => "cells",
        Knob::Particles => "particles per cell",
        Knob::Step => "time step over its limit",
        Knob::Walls => "clamped walls, cells",
        Knob::Averaging => "volume averaging",
    };
    let (mut x, y) = (MARGIN.0, PANEL.1 + 16);
    let style = text(16, INK, HPos::Left, VPos::Center);
    for knob in Knob::ALL.into_iter().filter(|k| table.rows.iter().any(|r| r.point.knob == *k)) {
        mark(area, knob, (x, y))?;
        area.draw(&Text::new(entry(knob), (x + 13, y), style.clone()))?;
        x += 13 + area.estimate_text_size(entry(knob), &style)?.0.cast_signed() + 26;
    }
    area.draw(&PathElement::new(vec![(x - 8, y), (x + 18, y)], FRONT.stroke_width(3)))?;
    area.draw(&Text::new("no point betters these", (x + 25, y), style))?;
    let small = text(14, INK, HPos::Left, VPos::Center);
    let base = table.rows.iter().find(|r| r.point.knob == Knob::Default).map(|r| r.point.setting);
    let defaults = base.map_or_else(String::new, |s| {
        format!("Default: {} particles per cell, step {} of the limit, reflecting walls, ", s.per_axis.pow(3), s.fraction)
            + &format!("averaging {}; the other points turn one knob. Bars: quartiles of the time.", s.volume_averaging)
    });
    area.draw(&Text::new(defaults, (MARGIN.0 - 6, y + 27), small.clone()))?;
    area.draw(&Text::new(table.provenance(), (MARGIN.0 - 6, y + 49), small))
}

#[cfg(test)]
mod tests {
    use super::super::knobs::Setting;
    use super::super::table::tests::row;
    use super::*;

    /// Values of many points in one place stand apart and inside the frame.
    #[test]
    fn values_do_not_cover_one_another() {
        let rows: Vec<Row> =
            (0..12).map(|i| row(Knob::Cells, Setting::new(8), 1.0 + 0.01 * f64::from(i), 300.0 + f64::from(i))).collect();
        let frame = Frame::new(0, &rows.iter().collect::<Vec<_>>());
        let mut taken = vec![];
        for row in &rows {
            let (place, _) = frame.free_place(frame.at(row), (30, 16), &taken);
            let new = box_about(place, (30, 16));
            let meets = |b: &[Pixel; 2]| new[0].0 < b[1].0 && b[0].0 < new[1].0 && new[0].1 < b[1].1 && b[0].1 < new[1].1;
            assert!(!taken.iter().any(meets), "{new:?} {taken:?}");
            assert!(new[0].0 >= frame.x.pixels.0 && new[1].0 <= frame.x.pixels.1, "{new:?}");
            taken.push(new);
        }
    }
}
