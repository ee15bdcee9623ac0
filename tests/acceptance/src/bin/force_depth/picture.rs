//! A panel per mode: the force felt over the hand's depth, and the clay's own in grey.

use clay_acceptance::cases::haptics::Curve;
use clay_acceptance::plot::{Area, Painted, Picture, text};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

/// Size of a panel \[pixels\]; panels stand in rows of three.
const PANEL: (i32, i32) = (400, 340);
const COLUMNS: usize = 3;
/// Size of the picture \[pixels\].
pub(crate) const SIZE: (u32, u32) = (1200, 680);
/// Ends of the axes: depth [mm], force \[N\].
const DEPTHS: (f64, f64) = (-2.0, 9.0);
const FORCES: (f64, f64) = (-0.2, 2.1);
/// Told apart by every eye (Okabe and Ito 2008).
const FELT: RGBColor = RGBColor(0, 114, 178);
const CLAY: RGBColor = RGBColor(150, 150, 150);
const FAINT: RGBColor = RGBColor(228, 228, 228);

/// What is drawn.
pub(crate) struct Curves<'a>(pub(crate) &'a [Curve]);

/// The corners of a panel's axes, and where a point is in them.
struct Frame {
    low: (i32, i32),
    high: (i32, i32),
}

impl Frame {
    fn new(index: usize) -> Self {
        let corner = (PANEL.0 * (index % COLUMNS) as i32, PANEL.1 * (index / COLUMNS) as i32);
        Self { low: (corner.0 + 52, corner.1 + PANEL.1 - 50), high: (corner.0 + PANEL.0 - 14, corner.1 + 34) }
    }

    fn at(&self, depth: f64, force: f64) -> (i32, i32) {
        let share = |value: f64, (from, to): (f64, f64)| (value.clamp(from, to) - from) / (to - from);
        let across = share(depth, DEPTHS) * f64::from(self.high.0 - self.low.0);
        let up = share(force, FORCES) * f64::from(self.low.1 - self.high.1);
        (self.low.0 + across.round() as i32, self.low.1 - up.round() as i32)
    }

    fn axes<B: DrawingBackend>(&self, area: &Area<B>, title: &str) -> Painted<B> {
        for depth in [0.0, 2.0, 4.0, 6.0, 8.0] {
            let (x, _) = self.at(depth, 0.0);
            area.draw(&PathElement::new(vec![(x, self.low.1), (x, self.high.1)], FAINT))?;
            area.draw(&Text::new(format!("{depth}"), (x, self.low.1 + 5), text(13, BLACK, HPos::Center, VPos::Top)))?;
        }
        for force in [0.0, 0.5, 1.0, 1.5, 2.0] {
            let (_, y) = self.at(0.0, force);
            area.draw(&PathElement::new(vec![(self.low.0, y), (self.high.0, y)], FAINT))?;
            area.draw(&Text::new(format!("{force}"), (self.low.0 - 6, y), text(13, BLACK, HPos::Right, VPos::Center)))?;
        }
        area.draw(&Rectangle::new([(self.low.0, self.high.1), (self.high.0, self.low.1)], BLACK))?;
        let middle = (self.low.0 + self.high.0) / 2;
        area.draw(&Text::new(title.to_owned(), (middle, self.high.1 - 8), text(17, BLACK, HPos::Center, VPos::Bottom)))?;
        let below = text(14, BLACK, HPos::Center, VPos::Top);
        area.draw(&Text::new("depth of the hand [mm]", (middle, self.low.1 + 24), below))
    }
}

impl Picture for Curves<'_> {
    fn paint<B: DrawingBackend>(&self, area: &Area<B>) -> Painted<B> {
        for (index, curve) in self.0.iter().enumerate() {
            let frame = Frame::new(index);
            frame.axes(area, &format!("{}: force on the hand [N]", curve.name))?;
            let line = |force: usize| curve.points.iter().map(|p| frame.at(p[1], p[force])).collect::<Vec<_>>();
            area.draw(&PathElement::new(line(3), CLAY.stroke_width(4)))?;
            area.draw(&PathElement::new(line(2), FELT.stroke_width(2)))?;
        }
        let corner = Frame::new(self.0.len());
        let lines = [(FELT, "force felt: 5 mm/s down, 0.2 s still, 5 mm/s up"), (CLAY, "the clay's own force on its tool")];
        for ((color, name), row) in lines.into_iter().zip(0..) {
            let y = corner.high.1 + 30 + 26 * row;
            area.draw(&PathElement::new(vec![(corner.low.0 - 30, y), (corner.low.0, y)], color.stroke_width(3)))?;
            area.draw(&Text::new(name, (corner.low.0 + 8, y), text(15, BLACK, HPos::Left, VPos::Center)))?;
        }
        Ok(())
    }
}
