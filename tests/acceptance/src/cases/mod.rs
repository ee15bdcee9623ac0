//! The acceptance cases, by what they judge.

pub mod blade;
mod bodies;
pub mod cavity;
pub mod collapse;
pub mod cone;
pub mod contact;
pub mod cut;
mod cut_time;
pub mod edge;
pub mod elastic;
pub mod files;
pub mod handout;
pub mod haptics;
pub mod implicit;
pub mod inertia;
pub mod input;
pub mod knife;
pub mod law;
pub mod manufactured;
pub mod methods;
pub mod motion;
pub mod paths;
pub mod prandtl;
pub mod press;
pub mod published;
pub mod robust;
mod rolled;
pub mod slide;
mod slope;
pub mod slump;
pub mod stability;
pub mod storage;
pub mod strip;
pub mod surface;
pub mod tatara;
pub mod undo;
pub mod work;

use crate::lab::{EngineKind, Size, in_implicit_steps};
use crate::report::Row;
use clap::ValueEnum;
use serde::Serialize;

/// Cases of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Suite {
    /// The solver: motion, elasticity, contact.
    Physics,
    /// Tools that press, slide, hold and pass.
    Contact,
    /// What must not break: step limits, energy, cuts, determinism, bad input.
    Stability,
    /// The implicit step: against the explicit one, and what must not break it.
    Implicit,
    /// The force on a hand, in virtual time.
    Haptics,
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
    /// Rows of its quick run on the native engine.
    pub quick_rows: usize,
    /// Uses inputs that only the native engine has.
    pub is_native_only: bool,
}

impl Case {
    /// What is wrong with the number of its rows, if anything: rows must not come or go unseen.
    pub fn count_fault(&self, size: Size, engine: EngineKind, rows: usize) -> Option<String> {
        let is_known = size == Size::Quick && engine == EngineKind::Native;
        let of = self.quick_rows;
        (is_known && rows != of).then(|| format!("{}: {rows} rows, and tests/acceptance/src/cases/mod.rs has {of}", self.name))
    }
}

const fn physics(name: &'static str, quick_rows: usize, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Physics, name, run, quick_rows, is_native_only: false }
}

const fn native_physics(name: &'static str, quick_rows: usize, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Physics, name, run, quick_rows, is_native_only: true }
}

const fn contact_case(name: &'static str, quick_rows: usize, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Contact, name, run, quick_rows, is_native_only: false }
}

const fn stability(name: &'static str, quick_rows: usize, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Stability, name, run, quick_rows, is_native_only: false }
}

const fn implicit_case(name: &'static str, quick_rows: usize, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Implicit, name, run, quick_rows, is_native_only: true }
}

const fn haptic_case(name: &'static str, quick_rows: usize, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Haptics, name, run, quick_rows, is_native_only: true }
}

/// A case of another suite, with the frames that it runs in implicit steps.
macro_rules! implicitly {
    ($name:literal, $quick_rows:literal, $case:path) => {
        implicit_case(concat!($name, " in implicit steps"), $quick_rows, |size| in_implicit_steps($case, size))
    };
}

const fn speed(name: &'static str, quick_rows: usize, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Speed, name, run, quick_rows, is_native_only: false }
}

const fn surface_case(name: &'static str, quick_rows: usize, run: fn(Size) -> Vec<Row>) -> Case {
    Case { suite: Suite::Surface, name, run, quick_rows, is_native_only: false }
}

/// Every case, in the order of the table; the numbers are those of the rows of a quick run.
pub const CASES: &[Case] = &[
    physics("free fall", 3, motion::free_fall),
    physics("rotation", 5, motion::rotation),
    physics("bar", 3, elastic::bar),
    physics("column", 4, elastic::column),
    physics("finite strain", 6, elastic::finite),
    physics("strain paths", 8, law::paths),
    physics("cone", 0, cone::indentation),
    native_physics("cavity", 1, cavity::expansion),
    native_physics("full step", 7, paths::paths),
    native_physics("manufactured solution", 3, manufactured::solution),
    physics("momentum", 14, contact::momentum),
    physics("tool offset", 2, contact::tool_offset),
    physics("punch", 7, prandtl::punch),
    physics("cut slope", 3, slump::cut_slope),
    physics("cylinder slump", 0, slump::cylinder),
    physics("sudden slump", 4, slump::sudden),
    physics("blade force", 4, edge::force),
    physics("work of tools", 6, work::tools),
    contact_case("strips", 9, strip::forces),
    contact_case("held ball", 1, press::held_ball),
    contact_case("time steps", 3, press::time_steps),
    contact_case("squeezed ball", 1, press::directions),
    Case { is_native_only: true, ..contact_case("elastic balls", 2, press::elastic_balls) },
    contact_case("nothing inside", 4, press::nothing_inside),
    contact_case("parted clay", 3, press::parted),
    contact_case("dragged plate", 4, slide::sliding),
    contact_case("knife", 15, knife::forces),
    contact_case("step with a tool", 2, press::step_limit),
    contact_case("scaled inertia", 4, inertia::beside_a_press),
    stability("step limit", 6, stability::step_limit),
    stability("energy", 5, stability::energy),
    stability("cell crossing", 2, stability::crossing),
    stability("pressed clay", 2, stability::pressed),
    stability("separating floor", 6, contact::separating_floor),
    stability("rest", 6, stability::rest),
    stability("blade leak", 14, blade::leak),
    stability("blade withdrawn", 4, blade::withdrawn),
    stability("blade at rest", 2, blade::at_rest),
    Case { is_native_only: true, ..stability("cut methods", 48, methods::compared) },
    stability("closed cut", 4, cut::closed),
    stability("opened cut", 3, cut::opened),
    stability("bodies", 3, cut::bodies),
    stability("three planes", 4, bodies::pieces),
    stability("welded cut", 5, cut::welded),
    stability("cut slopes", 2, slope::slopes),
    stability("rolled cut", 1, rolled::rolled),
    stability("ended cut", 2, rolled::ended),
    stability("creep", 2, storage::creep),
    stability("shift", 3, storage::shift),
    stability("crowded cells", 7, storage::crowded),
    stability("determinism", 3, robust::determinism),
    stability("health", 6, robust::health),
    stability("bad input", 7, input::bad),
    stability("random strains", 8, input::strains),
    Case { is_native_only: true, ..stability("as published", 4, published::published) },
    implicit_case("implicit strip", 10, implicit::strips),
    implicit_case("implicit ball", 10, implicit::balls),
    implicit_case("implicit blade", 7, implicit::blades),
    implicit_case("implicit board", 4, implicit::boards),
    implicit_case("implicit stop", 6, implicit::stops),
    implicit_case("implicit pads", 2, implicit::pads),
    implicit_case("implicit clays", 6, implicit::presets),
    implicit_case("implicit hold", 2, implicit::held),
    implicit_case("implicit unloading", 1, implicit::unloading),
    implicit_case("implicit release", 2, implicit::released),
    implicit_case("implicit own weight", 2, implicit::self_weight),
    implicit_case("implicit toss", 4, implicit::tossed_block),
    implicit_case("implicit landing", 3, implicit::landings),
    implicit_case("implicit mirror", 2, implicit::mirrored),
    implicit_case("implicit sparse", 6, implicit::sparse),
    implicit_case("implicit determinism", 1, implicit::determinism),
    implicit_case("implicit scenes", 4, implicit::scenes),
    // Not those that judge the explicit step itself, that drive nodes or grow tools (implicit steps refuse
    // it), or that are about waves, flight and impact, for which explicit steps are there.
    implicitly!("column", 2, elastic::column),
    implicitly!("finite strain", 6, elastic::finite),
    implicitly!("cut slope", 3, slump::cut_slope),
    implicitly!("momentum", 14, contact::momentum),
    implicitly!("tool offset", 2, contact::tool_offset),
    implicitly!("punch", 7, prandtl::punch),
    implicitly!("blade force", 4, edge::force),
    implicitly!("work of tools", 6, work::tools),
    implicitly!("strips", 9, strip::forces),
    implicitly!("held ball", 1, press::held_ball),
    implicitly!("time steps", 3, press::time_steps),
    implicitly!("squeezed ball", 1, press::directions),
    implicitly!("nothing inside", 4, press::nothing_inside),
    implicitly!("parted clay", 3, press::parted),
    implicitly!("dragged plate", 4, slide::sliding),
    implicitly!("knife", 15, knife::forces),
    implicitly!("separating floor", 6, contact::separating_floor),
    implicitly!("rest", 6, stability::rest),
    implicitly!("energy", 5, stability::energy),
    implicitly!("cell crossing", 2, stability::crossing),
    implicitly!("pressed clay", 2, stability::pressed),
    implicitly!("blade leak", 3, blade::leak),
    implicitly!("blade withdrawn", 4, blade::withdrawn),
    implicitly!("blade at rest", 2, blade::at_rest),
    implicitly!("closed cut", 4, cut::closed),
    implicitly!("opened cut", 3, cut::opened),
    implicitly!("bodies", 3, cut::bodies),
    implicitly!("three planes", 4, bodies::pieces),
    implicitly!("welded cut", 5, cut::welded),
    implicitly!("cut slopes", 2, slope::slopes),
    implicitly!("rolled cut", 1, rolled::rolled),
    implicitly!("ended cut", 2, rolled::ended),
    implicitly!("creep", 2, storage::creep),
    implicitly!("shift", 3, storage::shift),
    implicitly!("crowded cells", 7, storage::crowded),
    implicitly!("random strains", 8, input::strains),
    haptic_case("force limits", 36, haptics::limits),
    haptic_case("force by default", 3, haptics::by_default),
    haptic_case("proxy", 4, haptics::exactness),
    haptic_case("force strokes", 45, haptics::strokes),
    haptic_case("force of erring models", 15, haptics::erring_models),
    haptic_case("held force", 2, haptics::held),
    haptic_case("force of slow clay", 3, haptics::slow_motion),
    haptic_case("force of an engine's clay", 6, haptics::clay_strokes),
    haptic_case("held force of an engine's clay", 3, haptics::clay_held),
    haptic_case("knife in the hand", 10, haptics::knife),
    haptic_case("force start", 2, haptics::start),
    haptic_case("force of particles", 4, haptics::particles),
    haptic_case("force shapes", 4, haptics::closed_forms),
    surface_case("random fields", 6, surface::random_fields),
    surface_case("cuts", 5, surface::cuts),
    surface_case("meeting cuts", 5, surface::meeting_cuts),
    surface_case("settled cuts", 4, surface::settled_cuts),
    surface_case("cut faces", 5, surface::moved_blade),
    surface_case("sphere", 9, surface::sphere),
    surface_case("clusters", 5, surface::clusters),
    surface_case("surface in motion", 2, surface::motion),
    surface_case("clay at rest", 3, surface::at_rest),
    surface_case("surface on the device", 0, surface::on_device),
    surface_case("files", 20, files::round_trips),
    speed("bytes read back", 3, handout::bytes),
    speed("proxy time", 4, haptics::times),
    speed("undo", 8, undo::history),
    speed("cut time", 4, cut_time::substeps),
    speed("surface time", 5, surface::speed::extraction),
    speed("ray time", 9, surface::speed::rays),
    speed("surface time on the device", 0, surface::speed::on_device),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// A row that came is told as one that went; of other runs no number is known.
    #[test]
    fn rows_that_come_or_go_are_told() {
        let case = physics("bar", 3, elastic::bar);
        let fault = |size, engine, rows| case.count_fault(size, engine, rows);
        assert_eq!(fault(Size::Quick, EngineKind::Native, 3), None);
        for rows in [2, 4] {
            let told = fault(Size::Quick, EngineKind::Native, rows).expect("a fault");
            assert!(told.starts_with(&format!("bar: {rows} rows, and ")) && told.ends_with(" has 3"), "{told}");
        }
        assert_eq!((fault(Size::Full, EngineKind::Native, 2), fault(Size::Quick, EngineKind::Gpu, 2)), (None, None));
    }
}
