//! What can be turned, and the points at which it is.

use bevy_clay::sim::planner::{STEP_FRACTION, VOLUME_AVERAGING};
use serde::{Deserialize, Serialize};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effort {
    /// Two points.
    Smoke,
    /// A few minutes.
    Quick,
    /// All.
    Full,
}

/// Everything that a scene can be run with.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Setting {
    /// Cells along the scene's length: the column's height, the punch's width.
    pub(crate) cells: i32,
    /// Particles along each axis of a cell.
    pub(crate) per_axis: i32,
    /// Time step over its limit [-].
    pub(crate) fraction: f64,
    /// Whether walls are clamped in place of reflecting.
    pub(crate) clamped_walls: bool,
    /// Plastic strain within which volumes are averaged [-]; 0 for none.
    pub(crate) volume_averaging: f64,
}

impl Setting {
    /// The engine's defaults on `cells`.
    pub(crate) fn new(cells: i32) -> Self {
        Self { cells, per_axis: 2, fraction: STEP_FRACTION, clamped_walls: false, volume_averaging: VOLUME_AVERAGING }
    }
}

/// What is turned at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Knob {
    /// Nothing.
    Default,
    /// The cell width.
    Cells,
    /// Particles per cell.
    Particles,
    /// The time step.
    Step,
    /// The walls; with them the cells, for the order.
    Walls,
    /// Volume averaging.
    Averaging,
}

impl Knob {
    /// All, in the order of the legend.
    pub(crate) const ALL: [Self; 6] = [Self::Default, Self::Cells, Self::Particles, Self::Step, Self::Walls, Self::Averaging];

    /// Its name in the table.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Cells => "cells",
            Self::Particles => "particles per cell",
            Self::Step => "time step",
            Self::Walls => "walls",
            Self::Averaging => "volume averaging",
        }
    }
}

/// A setting and what is particular about it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Point {
    /// What is turned.
    pub(crate) knob: Knob,
    /// The setting.
    #[serde(flatten)]
    pub(crate) setting: Setting,
}

impl Point {
    /// The knob's value.
    pub(crate) fn value(&self) -> String {
        let s = &self.setting;
        match self.knob {
            Knob::Default | Knob::Cells => s.cells.to_string(),
            Knob::Particles => s.per_axis.pow(3).to_string(),
            Knob::Step => s.fraction.to_string(),
            Knob::Walls => format!("clamped {}", s.cells),
            Knob::Averaging => s.volume_averaging.to_string(),
        }
    }

    /// What stands beside it in the picture and the table.
    pub(crate) fn label(&self) -> String {
        let value = self.value();
        match self.knob {
            Knob::Default | Knob::Cells => format!("{value} cells"),
            Knob::Particles => format!("{value} per cell"),
            Knob::Step => format!("step {value}"),
            Knob::Walls => value,
            Knob::Averaging => format!("averaging {value}"),
        }
    }
}

/// One knob at a time from the defaults on `default` cells, then `cells` with the defaults and `clamped` with
/// clamped walls.
pub(crate) fn points(default: i32, cells: &[i32], clamped: &[i32], averaging: &[f64]) -> Vec<Point> {
    let base = Setting::new(default);
    let mut points = vec![Point { knob: Knob::Default, setting: base }];
    let mut add = |knob, setting: Setting| {
        if setting != base {
            points.push(Point { knob, setting });
        }
    };
    for &cells in cells {
        add(Knob::Cells, Setting { cells, ..base });
    }
    for per_axis in 1..=3 {
        add(Knob::Particles, Setting { per_axis, ..base });
    }
    for fraction in [0.2, 0.5, 0.7, 0.95] {
        add(Knob::Step, Setting { fraction, ..base });
    }
    for &cells in clamped {
        add(Knob::Walls, Setting { cells, clamped_walls: true, ..base });
    }
    for &volume_averaging in averaging {
        add(Knob::Averaging, Setting { volume_averaging, ..base });
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The default stands once, first, and each other point differs from it by its own knob only, walls by
    /// their cells too.
    #[test]
    fn points_turn_one_knob_at_a_time() {
        let points = points(16, &[8, 16, 32], &[16, 32], &[0.0, 5e-5, 5e-3]);
        let base = points[0].setting;
        assert_eq!((points[0].knob, points[0].label()), (Knob::Default, "16 cells".to_owned()));
        assert_eq!(points.iter().filter(|p| p.setting == base).count(), 1);
        for p in &points[1..] {
            let mut back = p.setting;
            match p.knob {
                Knob::Default => panic!("{p:?}"),
                Knob::Cells => back.cells = base.cells,
                Knob::Particles => back.per_axis = base.per_axis,
                Knob::Step => back.fraction = base.fraction,
                Knob::Walls => (back.clamped_walls, back.cells) = (base.clamped_walls, base.cells),
                Knob::Averaging => back.volume_averaging = base.volume_averaging,
            }
            assert_eq!(back, base, "{p:?}");
        }
        let labels: Vec<String> = points.iter().map(Point::label).collect();
        for label in ["32 cells", "27 per cell", "step 0.95", "clamped 32", "averaging 0.005"] {
            assert!(labels.iter().any(|l| l == label), "{label} in {labels:?}");
        }
    }
}
