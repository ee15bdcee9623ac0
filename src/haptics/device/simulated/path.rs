//! Where an operator means to go.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A way through points at times, straight from each to the next, at rest before the first and after the
/// last. Written as its points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<(f64, DVec3)>", into = "Vec<(f64, DVec3)>")]
pub struct HandPath {
    points: Vec<(f64, DVec3)>,
}

impl From<Vec<(f64, DVec3)>> for HandPath {
    fn from(points: Vec<(f64, DVec3)>) -> Self {
        Self::new(points)
    }
}

impl From<HandPath> for Vec<(f64, DVec3)> {
    fn from(path: HandPath) -> Self {
        path.points
    }
}

impl HandPath {
    /// The way through these points, of time \[s\] and place \[m\]. Times that do not grow are left out;
    /// without a point, the origin.
    pub fn new(points: impl IntoIterator<Item = (f64, DVec3)>) -> Self {
        let mut kept: Vec<(f64, DVec3)> = vec![];
        for point in points {
            if kept.last().is_none_or(|last| last.0 < point.0) && point.1.is_finite() {
                kept.push(point);
            }
        }
        Self { points: kept }
    }

    /// Place \[m\] and velocity \[m/s\] at a time.
    pub fn at(&self, time: f64) -> [DVec3; 2] {
        let next = self.points.partition_point(|point| point.0 <= time);
        match (next.checked_sub(1).map(|i| self.points[i]), self.points.get(next)) {
            (Some(a), Some(b)) => {
                let velocity = (b.1 - a.1) / (b.0 - a.0);
                [a.1 + velocity * (time - a.0), velocity]
            }
            (Some(end), None) => [end.1, DVec3::ZERO],
            (None, Some(start)) => [start.1, DVec3::ZERO],
            (None, None) => [DVec3::ZERO; 2],
        }
    }

    /// When the last point is reached \[s\].
    pub fn duration(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.0)
    }
}
