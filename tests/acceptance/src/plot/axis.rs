//! Logarithmic axes and what is written at them.

use super::FONT;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A logarithmic axis.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    /// Decades at the ends.
    pub decades: (f64, f64),
    /// Pixels at the ends.
    pub pixels: (i32, i32),
}

impl Axis {
    /// An axis about positive values, with room at either end.
    pub fn about(values: impl Iterator<Item = f64>, room: (f64, f64), pixels: (i32, i32)) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v.log10()), h.max(v.log10())));
        Self { decades: (low - room.0, high + room.1), pixels }
    }

    /// Where a value is.
    pub fn pixel(&self, value: f64) -> i32 {
        let share = (value.log10() - self.decades.0) / (self.decades.1 - self.decades.0);
        self.pixels.0 + (share * f64::from(self.pixels.1 - self.pixels.0)).round() as i32
    }

    /// Where lines go, and whether a number goes with them: decades, and 2 and 5 where there is room.
    pub fn ticks(&self) -> Vec<(f64, bool)> {
        let has_room = f64::from((self.pixels.1 - self.pixels.0).abs()) > 170.0 * (self.decades.1 - self.decades.0);
        let decades = self.decades.0.floor() as i32..=self.decades.1.ceil() as i32;
        let ticks = decades.flat_map(|d| (1..10).map(move |m| (f64::from(m) * 10f64.powi(d), m)));
        ticks
            .filter(|(v, _)| (self.decades.0..=self.decades.1).contains(&v.log10()))
            .map(|(v, m)| (v, m == 1 || (has_room && matches!(m, 2 | 5))))
            .collect()
    }
}

/// A number of a tick, rid of rounding.
pub fn number(value: f64) -> String {
    let digits = (-value.log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}

/// Text of a size and colour, anchored.
pub fn text(size: i32, color: RGBColor, across: HPos, down: VPos) -> TextStyle<'static> {
    let style = TextStyle::from((FONT, size).into_font()).pos(Pos::new(across, down));
    TextStyle { color: color.to_backend_color(), ..style }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axis_is_logarithmic_and_numbered() {
        let axis = Axis::about([1.0, 1000.0].into_iter(), (0.0, 0.0), (100, 400));
        assert_eq!([1.0, 10.0, 1000.0].map(|v| axis.pixel(v)), [100, 200, 400]);
        let numbers = |axis: Axis| -> Vec<String> { axis.ticks().iter().filter(|t| t.1).map(|t| number(t.0)).collect() };
        assert_eq!(numbers(axis), ["1", "10", "100", "1000"]);
        let short = Axis::about([0.02, 0.6].into_iter(), (0.0, 0.0), (0, 300));
        assert_eq!(numbers(short), ["0.02", "0.05", "0.1", "0.2", "0.5"]);
    }
}
