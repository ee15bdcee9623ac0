//! WGSL text of a pass: generated constants, the parts it names, the pass itself. Plain WGSL, no import
//! directives.

use super::super::ahead::{PARTED_MAX, WHOLE_MIN};
use super::super::carry::{CARRY_COSINE, CARRY_SHARE};
use super::super::cut::{JOINT_SHEET, PLATE_SHEET};
use super::super::facing::{DISPLACEMENT, FACE_DISTANCE, NORMAL_REGULARISATION, OBLIQUE_GAP, SLOPE_MIN};
use super::super::limits::{DIVISIONS_MAX, FLOW_STEPS, SERIES_MAX, STRETCH_MAX, STRETCH_MIN};
use super::super::material::{SOFTENING_REACH, SQRT_2_3};
use super::super::params::Wall;
use super::super::penalty::{ARRIVAL_GAP, BOND_REACH, EJECTION_SPEED, FOUND_DEPTH, STICK_FRICTION};
use super::super::snapshot::ANCHORS_MAX;
use super::super::tool::{
    BAND, CONTACT_OFFSET, CUT_FRICTION, Contact, EDGE_RAMP, EDGE_REACH, SET_BACK, TRACTION_REACH_MIN, ToolShape,
};
use super::super::weld::{LEFT_PRESSED, LEFT_SHARE, MEETING_SHARE, WELD_PARTS};
use super::layout::{
    AHEAD_PLACES, FIELDS, PROFILE_PAIRS, PROFILES_MAX, RECORD, SURFACE_PARTICLE, Status, TOOLS_MAX, ToolCount, Total, Twin, flag,
};
use super::params::Params;
use super::pass::Pass;
use super::tool::GpuTool;

/// Invocations in a workgroup: 64 nodes of a block; two or one subgroups of today's adapters.
pub(super) const WORKGROUP: u32 = 64;
/// Numbers that one workgroup of a prefix sum takes.
pub(super) const SCAN_CHUNK: u32 = 1024;

/// Classes of clay in one block's reach that passes are compiled for: of one body without cuts, about one cut
/// (none, front, back) or of three bodies, about two cuts that cross, and about three (19) with some room.
pub(super) const CLASSES: [u32; 4] = [1, 3, 9, 25];

/// What may stand on two sides of something in one block, for each of [`CLASSES`]: a cut or two bodies; three
/// bodies each beside the other two, four and some cuts, eight.
const BETWEEN_MAX: [u32; 4] = [0, 3, 12, 28];

/// How many of them clay of so many classes has room for in a block.
fn between_max(classes: u32) -> u32 {
    CLASSES.iter().zip(BETWEEN_MAX).find(|(c, _)| **c == classes).map_or(0, |(_, most)| most)
}

/// Words that a node finds of two sides.
const FOUND: u32 = 5;

/// Words of a block's classes: the keys of all but class 0, the masses of all at its nodes, what stands on
/// two sides of something, and what the nodes find of it.
pub(super) fn cut_words(classes: u32) -> u32 {
    if classes > 1 { classes - 1 + 64 * classes + between_max(classes) * (1 + 64 * FOUND) } else { 0 }
}

/// The whole text of `pass` for so many [classes](CLASSES) of clay.
pub(super) fn compose(pass: &Pass, classes: u32) -> String {
    let mut text = constants(classes);
    for declaration in [Params::TEXT, GpuTool::TEXT, ToolCount::TEXT, Status::TEXT, Total::TEXT] {
        text.push_str(declaration);
    }
    text.push_str(include_str!("prelude.wgsl"));
    pass.parts.iter().chain([&pass.text]).for_each(|part| text.push_str(part));
    text
}

/// The constants of host and device, from where they stand in Rust.
fn constants(classes: u32) -> String {
    let counts = [
        ("WORKGROUP", WORKGROUP),
        ("CLASSES", classes),
        ("CUT_WORDS", cut_words(classes)),
        ("BETWEEN_MAX", between_max(classes)),
        ("FOUND", FOUND),
        ("CLASSES_MAX", CLASSES[CLASSES.len() - 1]),
        ("TOOLS_MAX", TOOLS_MAX),
        ("PROFILES_MAX", PROFILES_MAX),
        ("PROFILE_PAIRS", PROFILE_PAIRS as u32),
        ("SCAN_CHUNK", SCAN_CHUNK),
        ("FIELDS", FIELDS),
        ("AHEAD_PLACES", AHEAD_PLACES as u32),
        ("ANCHORS_MAX", ANCHORS_MAX as u32),
        ("SPEED", flag::SPEED),
        ("NON_FINITE", flag::NON_FINITE),
        ("MARGIN", flag::MARGIN),
        ("OVERFLOW", flag::OVERFLOW),
        ("CAPACITY", flag::CAPACITY),
        ("CROWDED", flag::CROWDED),
        ("PLATE_SHEET", PLATE_SHEET.into()),
        ("JOINT_SHEET", JOINT_SHEET.into()),
        ("WELD_PARTS", WELD_PARTS as u32),
        ("LEFT_PRESSED", LEFT_PRESSED.into()),
        ("DIVISIONS_MAX", DIVISIONS_MAX),
        ("FLOW_STEPS", FLOW_STEPS),
    ];
    let shapes = ToolShape::ALL.map(|shape| (upper(shape.identifier()), shape.number()));
    let contacts = Contact::ALL.map(|contact| (upper(contact.identifier()), contact.number()));
    let walls = Wall::ALL.map(|wall| (format!("WALL_{}", upper(wall.identifier())), wall.number()));
    let counts = counts.into_iter().chain(RECORD).chain(SURFACE_PARTICLE);
    let unsigned = counts.map(|(name, value)| (name.to_string(), value)).chain(shapes).chain(contacts).chain(walls);
    let numbers = [
        ("ARRIVAL_GAP", ARRIVAL_GAP),
        ("BAND", BAND),
        ("BOND_REACH", BOND_REACH),
        ("CONTACT_OFFSET", CONTACT_OFFSET),
        ("CUT_FRICTION", CUT_FRICTION),
        ("EDGE_RAMP", EDGE_RAMP),
        ("EDGE_REACH", EDGE_REACH),
        ("EJECTION_SPEED", EJECTION_SPEED),
        ("FOUND_DEPTH", FOUND_DEPTH),
        ("LEFT_SHARE", LEFT_SHARE),
        ("MEETING_SHARE", MEETING_SHARE),
        ("CARRY_SHARE", CARRY_SHARE),
        ("CARRY_COSINE", CARRY_COSINE),
        ("NORMAL_REGULARISATION", NORMAL_REGULARISATION),
        ("OBLIQUE_GAP", OBLIQUE_GAP),
        ("SLOPE_MIN", SLOPE_MIN),
        ("WHOLE_MIN", WHOLE_MIN),
        ("PARTED_MAX", PARTED_MAX),
        // Of the elastic strain b - I.
        ("PRINCIPAL_MIN", STRETCH_MIN * STRETCH_MIN - 1.0),
        ("PRINCIPAL_MAX", STRETCH_MAX * STRETCH_MAX - 1.0),
        ("SERIES_MAX", SERIES_MAX),
        ("SET_BACK", SET_BACK),
        ("SOFTENING_REACH", SOFTENING_REACH),
        ("SQRT_2_3", SQRT_2_3),
        ("STICK_FRICTION", STICK_FRICTION),
        ("TRACTION_REACH_MIN", TRACTION_REACH_MIN),
    ];
    let numbers = numbers.map(|(name, value)| (name.to_string(), value)).into_iter();
    let series = |name: &'static str, of: &'static [f64]| of.iter().enumerate().map(move |(i, a)| (format!("{name}_{i}"), *a));
    let numbers = numbers.chain(series("DISPLACEMENT", &DISPLACEMENT)).chain(series("FACE_DISTANCE", &FACE_DISTANCE));
    let unsigned = unsigned.map(|(name, value)| format!("const {name}: u32 = {value}u;\n"));
    unsigned.chain(numbers.map(|(name, value)| format!("const {name}: f32 = {value:?}f;\n"))).collect()
}

/// `PointedBlade` -> `POINTED_BLADE`.
fn upper(identifier: &str) -> String {
    let mut name = String::new();
    for (i, letter) in identifier.chars().enumerate() {
        if i > 0 && letter.is_uppercase() {
            name.push('_');
        }
        name.push(letter.to_ascii_uppercase());
    }
    name
}

#[cfg(test)]
mod tests {
    use super::super::kernel::{Binding, bindings};
    use super::super::pass::{Id, PASSES};
    use super::*;
    use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
    use std::collections::BTreeSet;

    fn validated(name: &str, text: &str) -> (naga::Module, ModuleInfo) {
        let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let info = validator.validate(&module).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        (module, info)
    }

    /// Every pass of both kinds is valid WGSL with one entry point of its own name, in the workgroup size
    /// dispatches count on.
    #[test]
    fn passes_are_valid() {
        for pass in PASSES {
            for classes in CLASSES {
                if classes == 1 && pass.is_for_cuts {
                    continue;
                }
                let text = compose(pass, classes);
                let (module, _) = validated(pass.name, &text);
                let [entry] = &module.entry_points[..] else { panic!("{}: one entry point", pass.name) };
                assert_eq!(entry.name, pass.name);
                let size = if pass.name == "begin" { 1 } else { WORKGROUP };
                assert_eq!(entry.workgroup_size, [size, 1, 1], "{}", pass.name);
            }
        }
    }

    /// What the text parser says of bindings is what naga says.
    #[test]
    fn bindings_are_those_of_the_text() {
        for pass in PASSES {
            let text = compose(pass, 3);
            let (module, _) = validated(pass.name, &text);
            let mut ours = bindings(&text);
            let mut theirs: Vec<Binding> = module
                .global_variables
                .iter()
                .filter_map(|(_, v)| {
                    let is_read_only =
                        matches!(v.space, naga::AddressSpace::Storage { access } if !access.contains(naga::StorageAccess::STORE));
                    let is_uniform = v.space == naga::AddressSpace::Uniform;
                    v.binding.as_ref().map(|b| Binding { index: b.binding, is_uniform, is_read_only })
                })
                .collect();
            ours.sort_by_key(|b| b.index);
            theirs.sort_by_key(|b| b.index);
            assert_eq!(ours, theirs, "{}", pass.name);
            assert!(ours.windows(2).all(|w| w[0].index < w[1].index), "{}: a binding twice", pass.name);
            let storage = ours.iter().filter(|b| !b.is_uniform).count();
            assert!(storage <= super::super::device::STORAGE_BUFFERS as usize, "{}: {storage} storage buffers", pass.name);
        }
    }

    /// Offsets and size of a struct as naga lays it out.
    fn layout_of(text: &str, name: &str) -> (Vec<(String, usize)>, usize) {
        let (module, _) = validated(name, text);
        let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).expect("the struct");
        let naga::TypeInner::Struct { members, span } = &found.1.inner else { panic!("{name} is no struct") };
        let member = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
        (members.iter().map(member).collect(), *span as usize)
    }

    /// Every struct that host and device share has the same members at the same offsets.
    #[test]
    fn structs_are_laid_out_as_their_twins() {
        fn same<T: Twin>(text: &str) {
            let ours = T::OFFSETS.iter().map(|(name, offset)| ((*name).to_string(), *offset)).collect();
            assert_eq!((ours, size_of::<T>()), layout_of(text, T::NAME), "{}", T::NAME);
        }
        let text = compose(Id::Grid.pass(), 3);
        same::<Params>(&text);
        same::<GpuTool>(&text);
        same::<ToolCount>(&text);
        same::<Status>(&text);
        same::<Total>(&text);
    }

    /// The numbers that the switches of a block have cases for, one set a switch.
    fn cases(block: &naga::Block, found: &mut Vec<BTreeSet<u32>>) {
        for statement in block {
            let naga::Statement::Switch { cases: arms, .. } = statement else { continue };
            let numbers = arms.iter().filter_map(|arm| match arm.value {
                naga::SwitchValue::U32(number) => Some(number),
                naga::SwitchValue::I32(_) | naga::SwitchValue::Default => None,
            });
            found.push(numbers.collect());
            arms.iter().for_each(|arm| cases(&arm.body, found));
        }
    }

    /// What the device does by a tool's shape or contact it does for every shape and contact that there is:
    /// none falls to what was meant for another.
    #[test]
    fn every_shape_and_contact_has_a_case() {
        let (module, _) = validated("penalty", &compose(Id::Penalty.pass(), 3));
        let shapes: BTreeSet<u32> = ToolShape::ALL.iter().map(ToolShape::number).collect();
        let parts = |shape: &&ToolShape| shape.is_blade() || matches!(shape, ToolShape::Box { .. });
        let dividers: BTreeSet<u32> = ToolShape::ALL.iter().filter(parts).map(ToolShape::number).collect();
        let contacts: BTreeSet<u32> = Contact::ALL.iter().map(Contact::number).collect();
        for (name, all) in [
            ("distance_to", &shapes),
            ("normal_at", &shapes),
            ("is_solid", &shapes),
            ("is_wire", &shapes),
            ("edge_before", &shapes),
            ("foot_on", &dividers),
            ("is_crossed", &dividers),
            ("band_of", &dividers),
            ("contact", &contacts),
            ("can_part", &contacts),
            ("friction_limit", &contacts),
            ("sticks", &contacts),
        ] {
            let (_, function) =
                module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(name)).expect("a function of the tools' text");
            let mut found = vec![];
            cases(&function.body, &mut found);
            assert_eq!(found, std::slice::from_ref(all), "{name}");
        }
    }
}
