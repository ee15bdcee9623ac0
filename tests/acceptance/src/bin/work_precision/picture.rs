//! Errors over passes and over time, in decades: a column per speed, a row per tool and error; under them
//! clay without a tool, a column each.

use super::sweep::{self, Family, Point};
use super::table::Table;
use bevy_clay::sim::prelude::*;
use clay_acceptance::cases::implicit::{BUDGETS, Budget, Free, SAMPLE, Way, frame_travel};
use clay_acceptance::plot::{self, Area, Axis, Painted, Picture, PlotError, number, text};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// The pictures, without ending: over passes, and over time.
pub(crate) const NAMES: [&str; 2] = ["work_precision_passes", "work_precision_time"];
/// Size of a panel's frame, and the gaps between frames [pixels].
const PANEL: (i32, i32) = (290, 230);
const GAP: (i32, i32) = (14, 16);
/// More of a gap above the panels of clay without a tool, with numbers and names in it [pixels].
const BREAK: i32 = 60;
/// Room about all frames: left, top, right [pixels].
const MARGIN: (i32, i32, i32) = (86, 62, 20);
/// Height of numbers, legend and provenance under the frames [pixels].
const FOOT: i32 = 176;
/// Errors of which each panel shows [%], and the numbers at them: greater ones stand at the upper edge.
const ERRORS: (f64, f64) = (0.1, 100.0);
const INK: RGBColor = RGBColor(40, 40, 40);
const FAINT: RGBColor = RGBColor(228, 228, 228);
/// What the reference does not resolve.
const OWN: RGBColor = RGBColor(222, 222, 222);
/// Limits of the implicit step's cases.
const LIMIT: RGBColor = RGBColor(0, 140, 100);

/// What the runs are drawn over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cost {
    Passes,
    Time,
}

impl Cost {
    fn of(self, point: &Point) -> f64 {
        match self {
            Self::Passes => point.passes,
            Self::Time => point.time,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Passes => "passes over the particles in a frame of 1/90 s",
            Self::Time => "time of one core in a frame of 1/90 s [ms]",
        }
    }
}

/// Which of the planner's accuracies has the run's setting.
pub(crate) fn accuracy_of(point: &Point) -> Option<StepAccuracy> {
    let Way::Implicit(pace) = point.way else { return None };
    [StepAccuracy::Interactive, StepAccuracy::Fine].into_iter().find(|accuracy| {
        let travel = match point.free() {
            None => accuracy.travel().min(frame_travel(1e-3 * point.speed)),
            // The planner has flight in explicit steps; else as many steps a frame as at a tool of 20 mm/s.
            Some(Free::Flight) => return false,
            Some(_) => accuracy.travel() / StepAccuracy::Interactive.travel(),
        };
        accuracy.passes() == pace.passes && (pace.travel / travel - 1.0).abs() < 0.02
    })
}

/// Whether the run has the density that the planner scales to, for speed.
pub(crate) fn is_fast(point: &Point) -> bool {
    let scale = InertiaScaling::Fast.density_scale(&Preset::SoftClay.material(), 1e-3 * point.speed);
    point.free().is_none() && matches!(point.way, Way::Scaled(s) if (s / scale - 1.0).abs() < 0.01)
}

/// SVG and PNG of each picture.
///
/// # Errors
/// A picture that cannot be painted.
pub(crate) fn draw(table: &Table) -> Result<[[Vec<u8>; 2]; 2], PlotError> {
    let [passes, time] = [Cost::Passes, Cost::Time].map(|cost| {
        let chart = Chart::new(table, cost);
        plot::draw(&chart, chart.size())
    });
    Ok([passes?, time?])
}

struct Chart<'a> {
    table: &'a Table,
    cost: Cost,
    speeds: Vec<f64>,
    tools: Vec<&'a str>,
    /// What clay does without a tool.
    free: Vec<Free>,
    /// Lowest and highest cost.
    range: (f64, f64),
}

/// Where a panel is, and what it shows.
struct Place {
    row: usize,
    column: usize,
    /// Index of the error.
    error: usize,
}

impl<'a> Chart<'a> {
    fn new(table: &'a Table, cost: Cost) -> Self {
        let (mut speeds, mut tools): (Vec<f64>, Vec<&str>) = (vec![], vec![]);
        let is_free = |tool: &str| Free::ALL.iter().any(|free| free.name() == tool);
        for (tool, speed) in table.strokes().into_iter().filter(|(tool, _)| !is_free(tool)) {
            if !speeds.contains(&speed) {
                speeds.push(speed);
            }
            if !tools.contains(&tool) {
                tools.push(tool);
            }
        }
        let free = Free::ALL.into_iter().filter(|free| !table.of(free.name(), 0.0).is_empty()).collect();
        let costs = || table.points.iter().map(|p| cost.of(p)).filter(|c| *c > 0.0);
        let range = (costs().fold(f64::INFINITY, f64::min), costs().fold(0.0, f64::max));
        Self { table, cost, speeds, tools, free, range }
    }

    /// Columns of panels: the legend needs the width of four.
    fn columns(&self) -> i32 {
        self.speeds.len().max(self.free.len()).max(4) as i32
    }

    /// Rows of panels: of strokes, and of all.
    fn rows(&self) -> [usize; 2] {
        let strokes = 2 * self.tools.len();
        [strokes, strokes + if self.free.is_empty() { 0 } else { 2 }]
    }

    /// Size of the whole picture [pixels].
    fn size(&self) -> (u32, u32) {
        let width = MARGIN.0 + self.columns() * (PANEL.0 + GAP.0) + MARGIN.2;
        (width.cast_unsigned(), (self.foot() + FOOT).cast_unsigned())
    }

    /// Lower edge of a row's frames [pixels].
    fn bottom(&self, row: usize) -> i32 {
        let beyond = if row >= self.rows()[0] && row > 1 { BREAK } else { 0 };
        MARGIN.1 + (row as i32 + 1) * (PANEL.1 + GAP.1) - GAP.1 + beyond
    }

    /// Lower edge of the last row [pixels].
    fn foot(&self) -> i32 {
        self.bottom(self.rows()[1] - 1)
    }

    fn panel<B: DrawingBackend>(&self, area: &Area<B>, place: &Place, points: &[&Point]) -> Painted<B> {
        let Place { row, column, error } = *place;
        let left = MARGIN.0 + column as i32 * (PANEL.0 + GAP.0);
        let frame = Frame {
            x: Axis::about([self.range.0, self.range.1].into_iter(), (0.12, 0.12), (left, left + PANEL.0)),
            y: Axis::about([ERRORS.0, ERRORS.1].into_iter(), (0.0, 0.0), (self.bottom(row), self.bottom(row) - PANEL.1)),
            cost: self.cost,
            error,
        };
        frame.ground(area, points)?;
        if let (Cost::Passes, Some(point)) = (self.cost, points.first()) {
            frame.limits(area, point.speed)?;
        }
        frame.runs(area, points)?;
        if column == 0 {
            frame.numbers_left(area)?;
        }
        if row + 1 == self.rows()[0] || row + 1 == self.rows()[1] { frame.numbers_below(area) } else { Ok(()) }
    }

    /// Writes beside a row.
    fn beside<B: DrawingBackend>(&self, area: &Area<B>, row: usize, words: String) -> Painted<B> {
        let upright = text(17, INK, HPos::Center, VPos::Top).transform(FontTransform::Rotate270);
        area.draw(&Text::new(words, (12, self.bottom(row) - PANEL.1 / 2), upright))
    }

    /// Writes above a panel.
    fn above<B: DrawingBackend>(&self, area: &Area<B>, row: usize, column: usize, words: String) -> Painted<B> {
        let middle = MARGIN.0 + column as i32 * (PANEL.0 + GAP.0) + PANEL.0 / 2;
        let at = (middle, self.bottom(row) - PANEL.1 - 8);
        area.draw(&Text::new(words, at, text(19, INK, HPos::Center, VPos::Bottom)))
    }

    /// Tools at their speeds.
    fn strokes<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        for (tool, name) in self.tools.iter().enumerate() {
            for (error, what) in sweep::ERRORS.iter().enumerate() {
                let row = 2 * tool + error;
                for (column, speed) in self.speeds.iter().enumerate() {
                    self.panel(area, &Place { row, column, error }, &self.table.of(name, *speed))?;
                }
                self.beside(area, row, format!("{name}: {what} off by [%]"))?;
            }
        }
        for (column, speed) in self.speeds.iter().enumerate() {
            self.above(area, 0, column, format!("{speed} mm/s"))?;
        }
        Ok(())
    }

    /// Clay without a tool.
    fn without_tool<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        let [first, _] = self.rows();
        for (column, free) in self.free.iter().enumerate() {
            for error in 0..sweep::ERRORS.len() {
                self.panel(area, &Place { row: first + error, column, error }, &self.table.of(free.name(), 0.0))?;
            }
            self.above(area, first, column, format!("{}: {}", free.name(), free.measure()))?;
        }
        if !self.free.is_empty() {
            self.beside(area, first, "as named, off by [%]".into())?;
            self.beside(area, first + 1, format!("{} off by [%]", sweep::ERRORS[1]))?;
        }
        Ok(())
    }

    /// What the marks stand for, and where the figures come from.
    fn legend<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        let top = self.foot();
        let middle = (MARGIN.0 + self.columns() * (PANEL.0 + GAP.0) / 2, top + 30);
        area.draw(&Text::new(self.cost.name(), middle, text(17, INK, HPos::Center, VPos::Top)))?;
        let style = text(16, INK, HPos::Left, VPos::Center);
        let put = |(x, y): (i32, i32), words: &str, paint: &dyn Fn((i32, i32)) -> Painted<B>| -> Painted<B> {
            paint((x, y))?;
            area.draw(&Text::new(words.to_owned(), (x + 20, y), style.clone()))
        };
        let (left, second) = (MARGIN.0, MARGIN.0 + 300);
        let (y, step) = (top + 68, 24);
        for (family, row) in Family::ALL[..2].iter().zip(0..) {
            put((left, y + row * step), family.name(), &|at| mark(area, color(*family, 0), at, *family, 0))?;
        }
        let words =
            ["implicit, steps of 0.22 cells, or a frame (toss: a quarter)", "implicit, half as long", "implicit, a quarter"];
        for (words, row) in words.iter().zip(0..) {
            let paint = |at| mark(area, color(Family::Implicit, row), at, Family::Implicit, row);
            put((second, y + row as i32 * step), words, &paint)?;
        }
        put((left, y + 2 * step), "ring: as the planner sets it", &|at| ring(area, at))?;
        let third = second + 430;
        let own = |(x, y): (i32, i32)| area.draw(&Rectangle::new([(x - 10, y - 7), (x + 10, y + 7)], OWN.filled()));
        put((third, y), "less than the reference's own error", &own)?;
        if self.cost == Cost::Passes {
            let line = |(x, y): (i32, i32)| area.draw(&PathElement::new(vec![(x - 10, y), (x + 10, y)], LIMIT.stroke_width(2)));
            put((third, y + step), "limits of the implicit step's cases", &line)?;
        }
        let small = text(14, INK, HPos::Left, VPos::Center);
        area.draw(&Text::new(self.table.provenance(), (MARGIN.0 - 10, y + 3 * step + 10), small))
    }
}

impl Picture for Chart<'_> {
    fn paint<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        self.strokes(area)?;
        self.without_tool(area)?;
        self.legend(area)
    }
}

/// One panel.
struct Frame {
    x: Axis,
    y: Axis,
    cost: Cost,
    /// Index of the error.
    error: usize,
}

impl Frame {
    /// Where a value of the error is, at the edges if it is beyond them.
    fn height(&self, error: f64) -> i32 {
        self.y.pixel(error.clamp(ERRORS.0, ERRORS.1))
    }

    /// What the reference does not resolve, the grid, the frame.
    fn ground<B: DrawingBackend>(&self, area: &Area<B>, points: &[&Point]) -> Painted<B> {
        let ((left, right), (bottom, top)) = (self.x.pixels, self.y.pixels);
        let own = points.iter().map(|p| p.uncertainty[self.error]).fold(0.0, f64::max);
        area.draw(&Rectangle::new([(left, self.height(own)), (right, bottom)], OWN.filled()))?;
        for (value, is_numbered) in self.x.ticks() {
            let width = if is_numbered { 2 } else { 1 };
            area.draw(&PathElement::new(
                vec![(self.x.pixel(value), bottom), (self.x.pixel(value), top)],
                FAINT.stroke_width(width),
            ))?;
        }
        for (value, is_numbered) in self.y.ticks() {
            let width = if is_numbered { 2 } else { 1 };
            area.draw(&PathElement::new(
                vec![(left, self.y.pixel(value)), (right, self.y.pixel(value))],
                FAINT.stroke_width(width),
            ))?;
        }
        area.draw(&Rectangle::new([(left, top), (right, bottom)], INK.stroke_width(1)))
    }

    fn numbers_left<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        for (value, _) in self.y.ticks().into_iter().filter(|t| t.1) {
            let at = (self.x.pixels.0 - 7, self.y.pixel(value));
            area.draw(&Text::new(number(value), at, text(16, INK, HPos::Right, VPos::Center)))?;
        }
        Ok(())
    }

    fn numbers_below<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        for (value, _) in self.x.ticks().into_iter().filter(|t| t.1) {
            let at = (self.x.pixel(value), self.y.pixels.0 + 7);
            area.draw(&Text::new(number(value), at, text(16, INK, HPos::Center, VPos::Top)))?;
        }
        Ok(())
    }

    /// The corner in which a run of implicit steps has to be, by each budget of the speed.
    fn limits<B: DrawingBackend>(&self, area: &Area<B>, speed: f64) -> Painted<B> {
        let is_meant = |b: &&Budget| (1e3 * b.speed - speed).abs() < 1e-9;
        for budget in BUDGETS.iter().filter(is_meant) {
            let Some(limit) = [Some(budget.force), budget.way][self.error] else { continue };
            let corner = (self.x.pixel(budget.passes), self.height(limit));
            let path = vec![(self.x.pixels.0, corner.1), corner, (corner.0, self.y.pixels.0)];
            area.draw(&PathElement::new(path, LIMIT.stroke_width(2)))?;
        }
        Ok(())
    }

    /// Each family's runs, joined by cost; implicit ones by length of step.
    fn runs<B: DrawingBackend>(&self, area: &Area<B>, points: &[&Point]) -> Painted<B> {
        for family in Family::ALL {
            for fineness in 0..3 {
                let is_in = |p: &&&Point| p.family() == family && fineness_of(p) == fineness && p.errors.is_some();
                let mut runs: Vec<&&Point> = points.iter().filter(is_in).collect();
                runs.sort_by(|a, b| self.cost.of(a).total_cmp(&self.cost.of(b)));
                let at = |p: &Point| (self.x.pixel(self.cost.of(p)), self.height(p.errors.map_or(ERRORS.1, |e| e[self.error])));
                let color = color(family, fineness);
                area.draw(&PathElement::new(runs.iter().map(|p| at(p)).collect::<Vec<_>>(), color.stroke_width(1)))?;
                for run in runs {
                    mark(area, color, at(run), family, fineness)?;
                    if accuracy_of(run).is_some() || is_fast(run) || run.way == Way::Explicit(1.0) {
                        ring(area, at(run))?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Of implicit runs how often steps of interactive length have been halved; 0 of others.
fn fineness_of(point: &Point) -> usize {
    let Way::Implicit(pace) = point.way else { return 0 };
    let most = match point.free() {
        None => frame_travel(1e-3 * point.speed).min(SAMPLE),
        Some(free) => 1.0 / f64::from(sweep::free_steps(free)[0]),
    };
    (most / pace.travel).log2().round().clamp(0.0, 2.0) as usize
}

/// The colour of a family; of finer implicit steps a darker one. Okabe and Ito 2008, told apart by every eye.
fn color(family: Family, fineness: usize) -> RGBColor {
    match (family, fineness) {
        (Family::Real, _) => RGBColor(0, 0, 0),
        (Family::Scaled, _) => RGBColor(213, 94, 0),
        (Family::Implicit, 0) => RGBColor(86, 180, 233),
        (Family::Implicit, 1) => RGBColor(0, 114, 178),
        (Family::Implicit, _) => RGBColor(20, 40, 120),
    }
}

/// The mark of a run.
fn mark<B: DrawingBackend>(area: &Area<B>, color: RGBColor, (x, y): (i32, i32), family: Family, fineness: usize) -> Painted<B> {
    let fill = color.filled();
    match (family, fineness) {
        (Family::Real, _) => area.draw(&Circle::new((x, y), 4, fill)),
        (Family::Scaled, _) => area.draw(&Polygon::new(vec![(x, y - 6), (x + 5, y + 4), (x - 5, y + 4)], fill)),
        (Family::Implicit, 0) => area.draw(&Rectangle::new([(x - 4, y - 4), (x + 4, y + 4)], fill)),
        (Family::Implicit, 1) => area.draw(&Polygon::new(vec![(x, y - 6), (x + 6, y), (x, y + 6), (x - 6, y)], fill)),
        (Family::Implicit, _) => area.draw(&Polygon::new(vec![(x, y + 6), (x + 5, y - 4), (x - 5, y - 4)], fill)),
    }
}

fn ring<B: DrawingBackend>(area: &Area<B>, at: (i32, i32)) -> Painted<B> {
    // Two thin circles: a thick one is drawn with corners.
    area.draw(&Circle::new(at, 9, INK))?;
    area.draw(&Circle::new(at, 10, INK))
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::table;
    use super::*;

    /// Errors beyond the panel stand at its edges; the planner's settings are known.
    #[test]
    fn marks_stay_in_their_panel() {
        let frame = Frame {
            x: Axis::about([1.0, 100.0].into_iter(), (0.0, 0.0), (0, 200)),
            y: Axis::about([ERRORS.0, ERRORS.1].into_iter(), (0.0, 0.0), (300, 0)),
            cost: Cost::Passes,
            error: 0,
        };
        assert_eq!([0.001, 1.0, 1e4].map(|e| frame.height(e)), [300, 200, 0]);
        let table = table();
        let own: Vec<bool> = table.points.iter().map(|p| accuracy_of(p).is_some() || is_fast(p)).collect();
        assert_eq!(own.iter().filter(|o| **o).count(), 1, "{own:?}");
    }
}
