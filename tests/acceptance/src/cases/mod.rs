//! The acceptance cases, by what they judge.

pub mod blade;
pub mod cavity;
pub mod collapse;
pub mod cone;
pub mod contact;
pub mod cut;
pub mod edge;
pub mod elastic;
pub mod files;
pub mod handout;
pub mod hertz;
pub mod input;
pub mod law;
pub mod manufactured;
pub mod methods;
pub mod motion;
pub mod paths;
pub mod prandtl;
pub mod published;
pub mod robust;
pub mod slump;
pub mod stability;
pub mod storage;
pub mod surface;

use crate::lab::Size;
use crate::report::Row;
use clap::ValueEnum;
use serde::Serialize;

/// Cases of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Suite {
    /// The solver: motion, elasticity, contact.
    Physics,
    /// What must not break: step limits, energy, cuts, determinism, bad input.
    Stability,
    /// The surface.
    Surface,
    /// Times, for a machine that has nothing else to do, and what frames read back from a device.
    Speed,
    /// Every suite but `speed`, whose figures are the machine's.
    All,
    /// None: with `--docs`, the documents anew from what is on record.
    None,
}

/// A group of rows computed together.
pub struct Case {
    /// The suite it is part of.
    pub suite: Suite,
    /// Its name.
    pub name: &'static str,
    /// Runs it.
    pub run: fn(Size) -> Vec<Row>,
    /// Uses inputs that only the native engine has.
    pub is_native_only: bool,
}

const fn physics(name: &'static str, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Physics, name, run, is_native_only: false }
}

const fn native_physics(name: &'static str, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Physics, name, run, is_native_only: true }
}

const fn stability(name: &'static str, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Stability, name, run, is_native_only: false }
}

const fn speed(name: &'static str, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Speed, name, run, is_native_only: false }
}

const fn surface_case(name: &'static str, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Surface, name, run, is_native_only: false }
}

/// Every case, in the order of the table.
pub const CASES: &[Case] = &[
    physics("free fall", motion::free_fall),
    physics("rotation", motion::rotation),
    physics("bar", elastic::bar),
    physics("column", elastic::column),
    physics("strain paths", law::paths),
    physics("cone", cone::indentation),
    native_physics("Hertz", hertz::contact),
    native_physics("cavity", cavity::expansion),
    native_physics("full step", paths::paths),
    native_physics("manufactured solution", manufactured::solution),
    physics("momentum", contact::momentum),
    physics("tool offset", contact::tool_offset),
    physics("punch", prandtl::punch),
    physics("cut slope", slump::cut_slope),
    physics("cylinder slump", slump::cylinder),
    physics("blade force", edge::force),
    stability("step limit", stability::step_limit),
    stability("energy", stability::energy),
    stability("cell crossing", stability::crossing),
    stability("pressed clay", stability::pressed),
    stability("separating floor", contact::separating_floor),
    stability("rest", stability::rest),
    stability("blade leak", blade::leak),
    stability("blade withdrawn", blade::withdrawn),
    stability("blade at rest", blade::at_rest),
    Case { is_native_only: true, ..stability("cut methods", methods::compared) },
    stability("closed cut", cut::closed),
    stability("welded cut", cut::welded),
    stability("creep", storage::creep),
    stability("shift", storage::shift),
    stability("crowded cells", storage::crowded),
    stability("determinism", robust::determinism),
    stability("health", robust::health),
    stability("bad input", input::bad),
    stability("random strains", input::strains),
    Case { is_native_only: true, ..stability("as published", published::published) },
    surface_case("random fields", surface::random_fields),
    surface_case("cuts", surface::cuts),
    surface_case("meeting cuts", surface::meeting_cuts),
    surface_case("settled cuts", surface::settled_cuts),
    surface_case("sphere", surface::sphere),
    surface_case("clusters", surface::clusters),
    surface_case("surface in motion", surface::motion),
    surface_case("clay at rest", surface::at_rest),
    surface_case("surface on the device", surface::on_device),
    surface_case("files", files::round_trips),
    speed("bytes read back", handout::bytes),
    speed("surface time", surface::speed::extraction),
    speed("ray time", surface::speed::rays),
    speed("surface time on the device", surface::speed::on_device),
];
