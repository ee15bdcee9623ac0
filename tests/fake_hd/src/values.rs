//! What can be read and set, by number, and of which type it is.

use crate::abi::{INVALID_ENUM, INVALID_INPUT_TYPE, INVALID_OPERATION, INVALID_VALUE};
use crate::world::{DAMPING, FORCE_CONTINUOUS, FORCE_MAX, RATE, STIFFNESS, WORKSPACE, World};
use std::ffi::CStr;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Boolean,
    Integer,
    Long,
    /// Floats and doubles.
    Real,
    /// Floats alone.
    Float,
}

/// The type of a value and how many of it there are.
fn kind(name: u32) -> Option<(Kind, usize)> {
    Some(match name {
        0x2001 | 0x2002 | 0x2201 | 0x2202 => (Kind::Boolean, 1),
        0x2000 | 0x2200 | 0x2553..=0x2555 | 0x2600 | 0x2601 | 0x2900 => (Kind::Integer, 1),
        0x2010 | 0x2210 => (Kind::Long, 6),
        0x2050 | 0x2051 | 0x2053 | 0x2100 | 0x2150 | 0x2250 | 0x2251 | 0x2253 | 0x2300 | 0x2350 => (Kind::Real, 3),
        0x2700..=0x2704 | 0x2800..=0x2803 => (Kind::Real, 3),
        0x2052 | 0x2252 => (Kind::Real, 16),
        0x2054 | 0x2254 | 0x2550 | 0x2551 | 0x2605 | 0x2750 => (Kind::Real, 6),
        0x2552 => (Kind::Float, 1),
        0x2011 | 0x2012 | 0x2602..=0x2604 | 0x2606..=0x2609 | 0x2620..=0x2623 => (Kind::Real, 1),
        _ => return None,
    })
}

impl World {
    /// The values of that name, asked for as that type; nothing, and an error, if there are none.
    pub(crate) fn read(&mut self, name: u32, asked: Kind, is_double: bool) -> Option<Vec<f64>> {
        if !self.has_device() {
            return None;
        }
        let Some((kind, count)) = kind(name) else {
            self.error(INVALID_ENUM);
            return None;
        };
        if kind != asked && !(kind == Kind::Float && asked == Kind::Real && !is_double) {
            self.error(INVALID_INPUT_TYPE);
            return None;
        }
        let mut values = self.values(name);
        values.resize(count, 0.0);
        Some(values)
    }

    fn values(&self, name: u32) -> Vec<f64> {
        let flag = |is: bool| vec![f64::from(u8::from(is))];
        let mm = |vector: [f64; 3]| vector.map(|v| 1e3 * v).to_vec();
        match name {
            0x2000 | 0x2200 => vec![self.plan.value("button", self.time).unwrap_or(0.0)],
            0x2001 | 0x2201 => flag(true),
            0x2002 | 0x2202 => flag(self.has("inkwell")),
            0x2050 | 0x2250 if self.has("nan_pose") => vec![f64::NAN; 3],
            0x2050 | 0x2250 => mm(self.arm.seen),
            0x2051 | 0x2251 => mm(self.arm.seen_velocity),
            0x2052 | 0x2252 => self.transform(),
            0x2550 | 0x2551 => WORKSPACE.to_vec(),
            0x2553 => vec![6.0],
            0x2554 => vec![3.0],
            0x2555 => vec![if self.has("auto") { 2.0 } else { 4.0 }],
            0x2600 | 0x2601 => vec![RATE],
            0x2602 => vec![STIFFNESS],
            0x2603 => vec![FORCE_MAX],
            0x2604 => vec![FORCE_CONTINUOUS],
            0x2605 => vec![self.temperature; 3],
            0x2606..=0x2608 => vec![self.limits[&name]],
            0x2609 => vec![DAMPING],
            0x2700 => self.asked.to_vec(),
            0x2800 => self.motors.to_vec(),
            _ => vec![],
        }
    }

    /// The stylus, turned a quarter to the left about Y: columns are axes.
    fn transform(&self) -> Vec<f64> {
        let [x, y, z] = self.arm.seen.map(|v| 1e3 * v);
        let turn = if self.has("nan_transform") { f64::NAN } else { 1.0 };
        vec![0.0, 0.0, -turn, 0.0, 0.0, 1.0, 0.0, 0.0, turn, 0.0, 0.0, 0.0, x, y, z, 1.0]
    }

    /// How many values are set by that name; nothing, and an error, if it cannot be.
    pub(crate) fn settable(&mut self, name: u32, asked: Kind) -> Option<usize> {
        if !self.has_device() {
            return None;
        }
        let error = match (kind(name), name) {
            (None, _) => INVALID_ENUM,
            (Some((kind, _)), _) if kind != asked => INVALID_INPUT_TYPE,
            (Some((_, count)), 0x2606..=0x2608 | 0x2700..=0x2704 | 0x2750 | 0x2900) => return Some(count),
            _ => INVALID_OPERATION,
        };
        self.error(error);
        None
    }

    pub(crate) fn set(&mut self, name: u32, values: &[f64]) {
        match (name, values) {
            (0x2700, [x, y, z]) => self.asked = [*x, *y, *z],
            (0x2606..=0x2608, [value]) if *value >= 0.0 => _ = self.limits.insert(name, *value),
            (0x2606..=0x2608, _) => self.error(INVALID_VALUE),
            // Torques, motor counts and the light have nothing here that they act on.
            _ => self.count("set_without_effect"),
        }
    }
}

pub(crate) fn string(name: u32) -> Option<&'static CStr> {
    Some(match name {
        0x2500 => c"3.4 (fake)",
        0x2501 => c"Fake Touch",
        0x2502 => c"0 (fake)",
        0x2503 => c"nobody",
        0x2504 => c"F4K3",
        0x2505 => c"0",
        _ => return None,
    })
}
