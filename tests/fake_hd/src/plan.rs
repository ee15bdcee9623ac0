//! Faults by plan: items apart by `;` or blanks, each `NAME[=VALUE][@FROM[..[TO]]]`, times in seconds of the
//! device.
//!
//! | item               | what                                                                       |
//! |--------------------|----------------------------------------------------------------------------|
//! | `virtual`          | the clock goes by `fakehd_advance` alone                                   |
//! | `no_device`        | the device does not open                                                   |
//! | `busy`             | another program has it                                                     |
//! | `uncalibrated`     | from then on the arm's place is not known                                  |
//! | `auto`             | it can find out by itself                                                  |
//! | `inkwell`          | the stylus is in the inkwell                                               |
//! | `error=0x0302`     | that error in each tick                                                    |
//! | `unplug`           | the cable is out; in again, the device has to be opened anew               |
//! | `warm`             | the motors are too hot                                                     |
//! | `nan_pose`         | its place is no number; `nan_transform`: its turn                          |
//! | `silent`           | the scheduler calls nobody                                                 |
//! | `speed=1.5`        | the hand goes on to the right with so many m/s                             |
//! | `button=1`         | buttons held, as bits                                                      |
//! | `full`             | the scheduler has no room                                                  |
//! | `max_speed=500`    | the driver's own limit of speed, mm/s                                      |
//!
//! Without times an item is for ever; with `@FROM` alone it is for one tick.

/// An item.
#[derive(Clone, Debug, PartialEq)]
struct Item {
    name: String,
    value: f64,
    from: f64,
    to: f64,
}

/// All of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Plan(Vec<Item>);

/// Every item there is.
const NAMES: [&str; 15] = [
    "virtual",
    "no_device",
    "busy",
    "uncalibrated",
    "auto",
    "inkwell",
    "error",
    "unplug",
    "warm",
    "nan_pose",
    "nan_transform",
    "silent",
    "speed",
    "button",
    "full",
];
/// Items that are limits.
const LIMITS: [&str; 1] = ["max_speed"];
/// A tick, for items at one time \[s\].
const TICK: f64 = 1e-3;

impl Plan {
    /// Reads a plan.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        let words = text.split(|c: char| c == ';' || c.is_whitespace()).filter(|word| !word.is_empty());
        words.map(Item::read).collect::<Result<_, _>>().map(Self)
    }

    /// The value of an item that is on at `time`; 1 where it has none.
    pub(crate) fn value(&self, name: &str, time: f64) -> Option<f64> {
        // Times of ticks are sums of ticks: half a tick apart they are told apart.
        let is_on = |item: &&Item| item.name == name && time >= item.from - 0.5 * TICK && time < item.to - 0.5 * TICK;
        self.0.iter().find(is_on).map(|item| item.value)
    }

    pub(crate) fn has(&self, name: &str, time: f64) -> bool {
        self.value(name, time).is_some()
    }
}

impl Item {
    fn read(word: &str) -> Result<Self, String> {
        let (head, times) = word.split_once('@').map_or((word, None), |(head, times)| (head, Some(times)));
        let (name, value) = head.split_once('=').map_or((head, None), |(name, value)| (name, Some(value)));
        if !NAMES.contains(&name) && !LIMITS.contains(&name) {
            return Err(format!("{word}: there is no {name}"));
        }
        let number = |text: &str| {
            let hex = text.strip_prefix("0x").and_then(|hex| u32::from_str_radix(hex, 16).ok()).map(f64::from);
            hex.or_else(|| text.parse().ok()).ok_or_else(|| format!("{word}: {text} is no number"))
        };
        let value = value.map_or(Ok(1.0), number)?;
        let (from, to) = match times.map(|times| times.split_once("..").map_or((times, None), |(from, to)| (from, Some(to)))) {
            None => (f64::NEG_INFINITY, f64::INFINITY),
            Some((from, None)) => (number(from)?, number(from)? + TICK),
            Some((from, Some(""))) => (number(from)?, f64::INFINITY),
            Some((from, Some(to))) => (number(from)?, number(to)?),
        };
        Ok(Self { name: name.into(), value, from, to })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_are_read_and_wrong_ones_are_told() {
        let plan = Plan::read("virtual; error=0x0302@0.5;speed=1.5@1..2  unplug@3..").unwrap();
        assert!(plan.has("virtual", -9.0) && !plan.has("busy", 0.0));
        assert_eq!([0.499, 0.5, 0.501].map(|t| plan.value("error", t)), [None, Some(770.0), None]);
        assert_eq!([0.9, 1.0, 1.999, 2.0].map(|t| plan.value("speed", t)), [None, Some(1.5), Some(1.5), None]);
        assert!(plan.has("unplug", 1e9) && !plan.has("unplug", 2.9));
        for wrong in ["unplugged", "speed=fast", "warm@x", "warm@1..y"] {
            assert!(Plan::read(wrong).unwrap_err().starts_with(wrong));
        }
    }
}
