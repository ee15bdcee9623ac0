//! What the same error costs one way and another.

use super::sweep::{ERRORS, Family, Point, named};
use super::table::Table;
use clay_acceptance::cases::implicit::Free;
use clay_acceptance::report::Row;

/// Errors at which times are compared [%]: the limit of the implicit step's cases, and one above.
pub(crate) const LEVELS: [f64; 2] = [3.0, 5.0];
/// Speed at which the ratios have limits [mm/s], and the limits.
const JUDGED: (f64, [(Family, f64); 2]) = (20.0, [(Family::Scaled, 3.0), (Family::Real, 20.0)]);

/// Errors and costs of which no other has both less, by rising cost.
fn front(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0])));
    let mut front: Vec<[f64; 2]> = vec![];
    for point in sorted {
        if front.last().is_none_or(|last| point[0] < last[0]) {
            front.push(point);
        }
    }
    front
}

/// The cost at which runs of `[error, cost]` reach an error: between neighbours of the front on a straight
/// line in decades, and the cheapest run's for all errors above its own. None below the least error.
fn cost_at(points: &[[f64; 2]], error: f64) -> Option<f64> {
    let front = front(points);
    let after = front.iter().position(|p| p[0] <= error)?;
    if after == 0 {
        return Some(front[0][1]);
    }
    let [[e0, c0], [e1, c1]] = [front[after - 1], front[after]];
    let share = (error / e0).ln() / (e1 / e0).ln();
    Some(c0 * (c1 / c0).powf(share))
}

/// The time of a family over that of implicit steps at the same `level` of an error \[-\]: without end where
/// these alone reach it, none where they do not.
pub(crate) fn gain(points: &[&Point], family: Family, error: usize, level: f64) -> Option<f64> {
    let of = |is_in: &dyn Fn(&Point) -> bool| -> Vec<[f64; 2]> {
        points.iter().filter(|p| is_in(p)).filter_map(|p| Some([p.errors?[error], p.time])).collect()
    };
    let others = match family {
        // Inertia scaled by one is inertia that is not scaled.
        Family::Scaled => of(&|p| p.family() != Family::Implicit),
        family => of(&|p| p.family() == family),
    };
    let implicit = cost_at(&of(&|p| p.family() == Family::Implicit), level)?;
    Some(cost_at(&others, level).map_or(f64::INFINITY, |cost| cost / implicit))
}

/// What each explicit family takes at the same error of the force, as rows: with limits at one speed.
pub(crate) fn rows(table: &Table) -> Vec<Row> {
    let mut rows = vec![];
    for (tool, speed) in table.strokes() {
        let points = table.of(tool, speed);
        for (family, limit) in JUDGED.1 {
            for level in LEVELS {
                let (scene, what) = (named(tool, speed), points[0].free().map_or(ERRORS[0], Free::measure));
                let name = format!("{scene}, {what} off by {level} %: time of {} over implicit", family.name());
                let ratio = gain(&points, family, 0, level).unwrap_or(f64::NAN);
                let is_judged = speed == JUDGED.0 && points.iter().all(|p| 3.0 * p.uncertainty[0] <= level);
                rows.push(if is_judged { Row::at_least(name, ratio, "-", limit) } else { Row::figure(name, ratio, "-") });
            }
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In decades the half-way error has the mean cost; worse errors cost no less than the cheapest run, and
    /// better ones than any are not to be had.
    #[test]
    fn cost_lies_between_runs() {
        let runs = [[10.0, 1.0], [0.1, 100.0], [20.0, 5.0], [1.0, 200.0]];
        assert_eq!(front(&runs), [[10.0, 1.0], [0.1, 100.0]]);
        let near = |cost: Option<f64>, expected: f64| (cost.expect("a cost") / expected - 1.0).abs() < 1e-12;
        assert!(near(cost_at(&runs, 1.0), 10.0) && near(cost_at(&runs, 0.1), 100.0));
        assert_eq!((cost_at(&runs, 50.0), cost_at(&runs, 0.05), cost_at(&[], 1.0)), (Some(1.0), None, None));
    }
}
