//! Rows of a validation run, and the list of known misses they are judged against.

use crate::lab::Size;
use serde::{Deserialize, Deserializer, Serialize};
use std::borrow::Cow;

/// Which side of its limit a value has to be on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bound {
    /// At most the limit.
    Max,
    /// At least the limit.
    Min,
    /// There is no limit: the figure is reported, not judged.
    None,
}

/// One measured figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// What was measured.
    pub case: String,
    /// What came out; not finite where nothing could be measured.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// Unit of value and limit.
    pub unit: Cow<'static, str>,
    /// What it has to be.
    #[serde(deserialize_with = "number")]
    pub limit: f64,
    /// The side of the limit.
    pub bound: Bound,
    /// Whether it is.
    pub ok: bool,
}

/// A number; null is one that is not finite.
fn number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

impl Row {
    /// A figure that must not exceed `limit`. NaN does not pass.
    pub fn at_most(case: impl Into<String>, value: f64, unit: &'static str, limit: f64) -> Self {
        Self { case: case.into(), value, unit: unit.into(), limit, bound: Bound::Max, ok: value <= limit }
    }

    /// A figure that must reach `limit`. NaN does not pass.
    pub fn at_least(case: impl Into<String>, value: f64, unit: &'static str, limit: f64) -> Self {
        Self { case: case.into(), value, unit: unit.into(), limit, bound: Bound::Min, ok: value >= limit }
    }

    /// A figure that is reported and not judged.
    pub fn figure(case: impl Into<String>, value: f64, unit: &'static str) -> Self {
        Self { case: case.into(), value, unit: unit.into(), limit: f64::NAN, bound: Bound::None, ok: true }
    }

    /// Whether the value is on the wrong side of `reference` by more than 10 % of it.
    fn is_worse_than(&self, reference: f64) -> bool {
        let slack = 0.1 * reference.abs();
        match self.bound {
            Bound::Max => self.value > reference + slack,
            Bound::Min => self.value < reference - slack,
            Bound::None => false,
        }
    }
}

/// The list of known misses.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownMisses {
    /// Rows of `validate`.
    pub rows: Vec<KnownMiss>,
    /// Figures of other commands, which no program compares.
    pub by_hand: Vec<MissByHand>,
}

/// A figure that a person read off a command and found beyond its limit.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MissByHand {
    /// The command that prints it.
    pub command: String,
    /// What it is, with its unit.
    pub figure: String,
    /// What it has to be at most.
    pub limit: f64,
    /// What it was.
    pub value: f64,
    /// Why it is so.
    pub reason: String,
}

/// A miss that is known and written down.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownMiss {
    /// The name of the case that the row is of.
    pub group: String,
    /// The sizes in which the case has the row.
    pub sizes: Vec<Size>,
    /// The row's case.
    pub case: String,
    /// The limit it misses: a changed limit needs a new look.
    pub limit: f64,
    /// What was measured.
    pub value: f64,
    /// Why it is so.
    pub reason: String,
}

/// What a row means for the run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict<'a> {
    /// Within its limit.
    Pass,
    /// Reported, without a limit.
    Figure,
    /// A known miss, no worse than known.
    Miss(&'a str),
    /// The run fails, for this reason.
    Fail(&'static str),
}

/// Judges a row of a run of this size against the list.
pub fn judge<'a>(row: &Row, size: Size, known: &'a [KnownMiss]) -> Verdict<'a> {
    let listed = known.iter().find(|k| k.case == row.case && k.sizes.contains(&size));
    match (row.ok, listed) {
        _ if row.bound == Bound::None => Verdict::Figure,
        (true, None) => Verdict::Pass,
        (true, Some(_)) => Verdict::Fail("passes now: take it off docs/known_misses.ron"),
        (false, None) => Verdict::Fail("misses its limit"),
        (false, Some(k)) if k.limit != row.limit => Verdict::Fail("is listed with another limit"),
        (false, Some(k)) if !row.value.is_finite() || row.is_worse_than(k.value) => {
            Verdict::Fail("is more than 10 % worse than the known miss")
        }
        (false, Some(k)) => Verdict::Miss(&k.reason),
    }
}

/// The known misses of the case `group` in this size that are not among its rows; none where it has no rows,
/// as a case of the device has on the processor.
pub fn unmet<'a>(known: &'a [KnownMiss], group: &str, size: Size, rows: &[Row]) -> Vec<&'a KnownMiss> {
    let is_due = |k: &&KnownMiss| !rows.is_empty() && k.group == group && k.sizes.contains(&size);
    known.iter().filter(is_due).filter(|k| rows.iter().all(|row| row.case != k.case)).collect()
}

/// Reads the list of known misses.
///
/// # Errors
/// Text that is not such a list.
pub fn parse_known(text: &str) -> Result<KnownMisses, ron::error::SpannedError> {
    ron::from_str(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::CASES;

    fn known() -> Vec<KnownMiss> {
        parse_known(
            r#"(
                rows: [
                    (group: "tool", sizes: [quick, full], case: "offset", limit: 0.5, value: 0.8, reason: "nodes reach far"),
                    (group: "wave", sizes: [full], case: "order", limit: 1.8, value: 1.5, reason: "f32"),
                ],
                by_hand: [],
            )"#,
        )
        .expect("a sound list")
        .rows
    }

    #[test]
    fn unlisted_rows_pass_or_fail_by_their_limit() {
        assert_eq!(judge(&Row::at_most("fall", 1e-6, "-", 1e-5), Size::Full, &known()), Verdict::Pass);
        assert!(matches!(judge(&Row::at_most("fall", 1e-4, "-", 1e-5), Size::Full, &known()), Verdict::Fail(_)));
        assert!(matches!(judge(&Row::at_least("other order", 1.7, "-", 1.8), Size::Full, &known()), Verdict::Fail(_)));
    }

    /// A figure without a limit is none that could miss it.
    #[test]
    fn figures_are_not_judged() {
        let row = Row::figure("offset", f64::NAN, "cells");
        assert_eq!(judge(&row, Size::Full, &known()), Verdict::Figure);
        assert!(serde_json::to_string(&row).expect("a row").contains(r#""limit":null,"bound":"none""#));
    }

    #[test]
    fn listed_miss_is_let_through_until_it_is_a_tenth_worse() {
        assert_eq!(judge(&Row::at_most("offset", 0.87, "cells", 0.5), Size::Full, &known()), Verdict::Miss("nodes reach far"));
        assert!(matches!(judge(&Row::at_most("offset", 0.89, "cells", 0.5), Size::Full, &known()), Verdict::Fail(_)));
        assert_eq!(judge(&Row::at_least("order", 1.36, "-", 1.8), Size::Full, &known()), Verdict::Miss("f32"));
        assert!(matches!(judge(&Row::at_least("order", 1.34, "-", 1.8), Size::Full, &known()), Verdict::Fail(_)));
    }

    /// What is listed for one size says nothing of another.
    #[test]
    fn listed_miss_is_one_of_its_sizes() {
        assert_eq!(judge(&Row::at_least("order", 1.9, "-", 1.8), Size::Quick, &known()), Verdict::Pass);
        assert!(matches!(judge(&Row::at_least("order", 1.5, "-", 1.8), Size::Quick, &known()), Verdict::Fail(_)));
    }

    #[test]
    fn listed_miss_that_passes_fails_the_run() {
        assert!(matches!(judge(&Row::at_most("offset", 0.4, "cells", 0.5), Size::Full, &known()), Verdict::Fail(_)));
    }

    #[test]
    fn listed_miss_with_another_limit_fails_the_run() {
        assert!(matches!(judge(&Row::at_most("offset", 0.8, "cells", 0.6), Size::Full, &known()), Verdict::Fail(_)));
    }

    /// A miss whose row is gone is told by the runs that had the row, and by no others.
    #[test]
    fn listed_miss_that_no_row_meets_is_told() {
        let (known, rows) = (known(), [Row::at_most("offset", 0.8, "cells", 0.5)]);
        let other = [Row::at_most("force", 0.8, "N", 0.5)];
        let unmet = |group, size, rows| unmet(&known, group, size, rows).iter().map(|k| &*k.case).collect::<Vec<_>>();
        assert_eq!((unmet("tool", Size::Quick, &rows), unmet("tool", Size::Quick, &other)), (vec![], vec!["offset"]));
        assert_eq!(unmet("tool", Size::Quick, &[]), Vec::<&str>::new());
        assert_eq!((unmet("wave", Size::Quick, &rows), unmet("wave", Size::Full, &rows)), (vec![], vec!["order"]));
    }

    /// What is listed is of a case there is, in a size that `validate` runs.
    #[test]
    fn listed_misses_are_of_cases() {
        let known = parse_known(include_str!("../../../docs/known_misses.ron")).expect("a sound list");
        for miss in known.rows {
            assert!(CASES.iter().any(|case| case.name == miss.group), "{}: no case {}", miss.case, miss.group);
            assert!(!miss.sizes.is_empty() && !miss.sizes.contains(&Size::Test), "{}: {:?}", miss.case, miss.sizes);
        }
    }

    /// A value that could not be measured is neither a pass nor a known miss.
    #[test]
    fn nan_fails_the_run() {
        assert!(matches!(judge(&Row::at_most("fall", f64::NAN, "-", 1.0), Size::Full, &known()), Verdict::Fail(_)));
        assert!(matches!(judge(&Row::at_most("offset", f64::NAN, "cells", 0.5), Size::Full, &known()), Verdict::Fail(_)));
    }
}
