//! The map as a picture: one panel per law and tool speed, steps along x, stiffness along y.

use crate::{Axes, End, Law, Point};
use bevy_clay::sim::prelude::StepAccuracy;
use clay_acceptance::plot::{Area, FONT, Painted, Picture};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

const PANEL: (i32, i32) = (430, 300);
const MARGIN_LEFT: i32 = 62;
const MARGIN_TOP: i32 = 42;
const MARGIN: (i32, i32) = (18, 60);
const HEAD: i32 = 40;
const FOOT: i32 = 112;

/// What is sound, and what was flagged.
const SOUND: RGBColor = RGBColor(214, 232, 240);
const OTHERS: [(End, RGBColor); 5] = [
    (End::Flagged, RGBColor(250, 224, 140)),
    (End::Energy, RGBColor(214, 96, 77)),
    (End::Stretch, RGBColor(244, 165, 130)),
    (End::Speed, RGBColor(178, 24, 43)),
    (End::GivenUp, RGBColor(90, 10, 30)),
];

fn colour(end: End) -> RGBColor {
    OTHERS.iter().find(|(e, _)| *e == end).map_or(SOUND, |(_, c)| *c)
}

/// What is drawn.
pub(crate) struct Map<'a> {
    pub(crate) axes: &'a Axes,
    pub(crate) laws: [Law; 3],
    pub(crate) results: &'a [(Point, End, f64)],
}

impl Map<'_> {
    /// Width and height [pixels].
    pub(crate) fn size(&self) -> (u32, u32) {
        let columns = self.axes.speeds.len() as i32;
        ((PANEL.0 * columns).unsigned_abs(), (PANEL.1 * self.laws.len() as i32 + HEAD + FOOT).unsigned_abs())
    }

    fn panel<B: DrawingBackend>(&self, area: &Area<B>, law: usize, speed: usize) -> Painted<B> {
        let origin = (PANEL.0 * speed as i32, HEAD + PANEL.1 * law as i32);
        let (low, high) =
            ((origin.0 + MARGIN_LEFT, origin.1 + MARGIN_TOP), (origin.0 + PANEL.0 - MARGIN.0, origin.1 + PANEL.1 - MARGIN.1));
        let (steps, most) = self.axes.steps_of(law);
        let (columns, rows) = (steps.len() as i32, self.axes.stiffness.len() as i32);
        let x = |i: i32| low.0 + (high.0 - low.0) * i / columns;
        let y = |j: i32| high.1 - (high.1 - low.1) * j / rows;
        let title = format!("law {}, tool at {} c", self.laws[law].name, self.axes.speeds[speed]);
        text(area, &title, ((low.0 + high.0) / 2, low.1 - 8), 17, (HPos::Center, VPos::Bottom), &BLACK)?;
        for (p, end, _) in self.results.iter().filter(|(p, ..)| p.law == law && p.speed == speed) {
            let (i, j) = (p.step as i32, p.stiffness as i32);
            area.draw(&Rectangle::new([(x(i), y(j + 1)), (x(i + 1), y(j))], colour(*end).filled()))?;
            area.draw(&Rectangle::new([(x(i), y(j + 1)), (x(i + 1), y(j))], WHITE))?;
            let middle = ((x(i) + x(i + 1)) / 2, (y(j) + y(j + 1)) / 2);
            let ink = if matches!(end, End::Stretch | End::Flagged) { BLACK } else { WHITE };
            text(area, end.name().1, middle, 13, (HPos::Center, VPos::Center), &ink)?;
        }
        for i in 0..columns {
            let label = format!("{:.2}", steps[i as usize]);
            // Every other label where they stand close.
            if columns <= 9 || i % 2 == 0 {
                text(area, &label, ((x(i) + x(i + 1)) / 2, high.1 + 5), 13, (HPos::Center, VPos::Top), &BLACK)?;
            }
        }
        for j in 0..rows {
            let label = format!("{}", self.axes.stiffness[j as usize]);
            text(area, &label, (low.0 - 6, (y(j) + y(j + 1)) / 2), 13, (HPos::Right, VPos::Center), &BLACK)?;
        }
        text(
            area,
            if self.laws[law].is_implicit { "tool travel in a step [cells]" } else { "step / limit of an isolated particle" },
            ((low.0 + high.0) / 2, high.1 + 24),
            14,
            (HPos::Center, VPos::Top),
            &BLACK,
        )?;
        text(area, "E / yield", (origin.0 + 8, low.1 - 8), 14, (HPos::Left, VPos::Bottom), &BLACK)?;
        // Between the last step within the default fraction and the first beyond.
        let within = steps.iter().filter(|s| **s <= most + 1e-9).count() as i32;
        area.draw(&PathElement::new(vec![(x(within), low.1), (x(within), high.1)], BLACK.stroke_width(2)))
    }

    fn legend<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        let (_, height) = self.size();
        let y = height as i32 - FOOT + 12;
        let entries = [
            (End::Sound, "sound"),
            (End::Flagged, "R: sound, and flagged: forces out of balance"),
            (End::Energy, "E: energy from nothing, over 1.5 x"),
            (End::Stretch, "J: stretch beyond 0.05 .. 20"),
            (End::Speed, "V: a node too fast"),
            (End::GivenUp, "G: not finite, or given up"),
        ];
        for (i, (end, name)) in (0..).zip(entries) {
            let (x, y) = (MARGIN_LEFT + i % 2 * 400, y + i / 2 * 22);
            area.draw(&Rectangle::new([(x, y), (x + 18, y + 14)], colour(end).filled()))?;
            text(area, name, (x + 24, y + 7), 14, (HPos::Left, VPos::Center), &BLACK)?;
        }
        let passes = StepAccuracy::default().passes();
        let note =
            format!("black line: the planner's step; implicit steps of {passes} passes; c: speed of the dilatational wave");
        text(area, &note, (MARGIN_LEFT, y + 68), 14, (HPos::Left, VPos::Top), &BLACK)
    }
}

/// Text of `size` pixels at `at`.
fn text<B: DrawingBackend>(
    area: &Area<B>,
    text: &str,
    at: (i32, i32),
    size: i32,
    (h, v): (HPos, VPos),
    ink: &RGBColor,
) -> Painted<B> {
    let style = (FONT, size).into_font().color(ink).pos(Pos::new(h, v));
    area.draw(&Text::new(text.to_owned(), at, style))
}

impl Picture for Map<'_> {
    fn paint<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        let title = "Does a block of clay under a rod blow up?";
        text(area, title, (self.size().0 as i32 / 2, 12), 22, (HPos::Center, VPos::Top), &BLACK)?;
        for law in 0..self.laws.len() {
            for speed in 0..self.axes.speeds.len() {
                self.panel(area, law, speed)?;
            }
        }
        self.legend(area)
    }
}
