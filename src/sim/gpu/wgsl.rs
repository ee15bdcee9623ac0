//! WGSL text of a pass: generated constants, the parts it names, the pass itself. Plain WGSL, no import directives.

use super::super::cut::{MEETING_SHARE, NORMAL_REGULARISATION, WELD_PARTS};
use super::super::params::WALL_TOUCH;
use super::super::tool::{BAND, CONTACT_OFFSET, CUT_FRICTION, TOUCH_FADE, TOUCH_OFFSET, TOUCH_SHARE};
use super::layout::{FIELDS, PROFILES_MAX, TOOLS_MAX, flag};
use super::pass::Pass;
use crate::sim::snapshot::Particle;
use std::fmt::Write;

/// Invocations in a workgroup: 64 nodes of a block; two or one subgroups of today's adapters.
pub(super) const WORKGROUP: u32 = 64;
/// Numbers that one workgroup of a prefix sum takes.
pub(super) const SCAN_CHUNK: u32 = 1024;

/// Classes of clay in one block's reach that passes are compiled for: without cuts, about one (none, front, back), about two that cross, and about three
/// (19) with some room.
pub(super) const CLASSES: [u32; 4] = [1, 3, 9, 25];

/// Texts shared by passes.
pub(super) mod part {
    pub(in super::super) const STATE: &str = include_str!("state.wgsl");
    pub(in super::super) const TABLE: &str = include_str!("table.wgsl");
    pub(in super::super) const LAW: &str = include_str!("law.wgsl");
    pub(in super::super) const TOOL: &str = concat!(include_str!("tool.wgsl"), include_str!("blade.wgsl"));
    pub(in super::super) const CONTACT: &str = include_str!("contact.wgsl");
    pub(in super::super) const TOUCH: &str = include_str!("touch.wgsl");
    pub(in super::super) const YIELD: &str = include_str!("yield.wgsl");
    pub(in super::super) const FOLD: &str = include_str!("fold.wgsl");
    /// The classes of each block, read.
    pub(in super::super) const CUTS: &str =
        concat!("@group(0) @binding(16) var<storage, read> cuts: array<u32>;\n", include_str!("cuts.wgsl"));
    /// The same, written.
    pub(in super::super) const CUTS_WRITTEN: &str =
        concat!("@group(0) @binding(16) var<storage, read_write> cuts: array<u32>;\n", include_str!("cuts.wgsl"));
}

/// The whole text of `pass` for so many [classes](CLASSES) of clay.
pub(super) fn compose(pass: &Pass, classes: u32) -> String {
    let mut text = String::new();
    let unsigned = [
        ("WORKGROUP", WORKGROUP),
        ("CLASSES", classes),
        ("TOOLS_MAX", TOOLS_MAX),
        ("PROFILES_MAX", PROFILES_MAX),
        ("SCAN_CHUNK", SCAN_CHUNK),
        ("RECORD_WORDS", (size_of::<Particle>() / 4) as u32),
        ("FIELDS", FIELDS),
        ("SPEED", flag::SPEED),
        ("NON_FINITE", flag::NON_FINITE),
        ("MARGIN", flag::MARGIN),
        ("OVERFLOW", flag::OVERFLOW),
        ("CAPACITY", flag::CAPACITY),
        ("CROWDED", flag::CROWDED),
        ("WELD_PARTS", WELD_PARTS as u32),
        ("CLASSES_MAX", CLASSES[CLASSES.len() - 1]),
    ];
    for (name, value) in unsigned {
        // Writing to a string does not fail.
        let _ = writeln!(text, "const {name}: u32 = {value}u;");
    }
    let lengths = [
        ("BAND", BAND),
        ("CONTACT_OFFSET", CONTACT_OFFSET),
        ("CUT_FRICTION", CUT_FRICTION),
        ("MEETING_SHARE", MEETING_SHARE),
        ("NORMAL_REGULARISATION", NORMAL_REGULARISATION),
        ("TOUCH_FADE", TOUCH_FADE),
        ("TOUCH_OFFSET", TOUCH_OFFSET),
        ("TOUCH_SHARE", TOUCH_SHARE),
        ("WALL_TOUCH", WALL_TOUCH),
    ];
    for (name, value) in lengths {
        let _ = writeln!(text, "const {name}: f32 = {value:?}f;");
    }
    text.push_str(include_str!("prelude.wgsl"));
    pass.parts.iter().chain([&pass.text]).for_each(|part| text.push_str(part));
    text
}

#[cfg(test)]
mod tests {
    use super::super::kernel::{Binding, bindings};
    use super::super::layout::{GpuTool, Params, Status, ToolCount, Total};
    use super::super::pass::PASSES;
    use super::*;
    use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
    use std::mem::offset_of;

    fn validated(name: &str, text: &str) -> (naga::Module, ModuleInfo) {
        let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let info = validator.validate(&module).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        (module, info)
    }

    /// Every pass of both kinds is valid WGSL with one entry point of its own name, in the workgroup size dispatches count on.
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
                    let is_read_only = match v.space {
                        naga::AddressSpace::Storage { access } => !access.contains(naga::StorageAccess::STORE),
                        _ => false,
                    };
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

    macro_rules! twin {
        ($text:expr, $type:ident, $name:literal, [$($field:ident),* $(,)?]) => {
            let ours = vec![$((stringify!($field).to_string(), offset_of!($type, $field))),*];
            assert_eq!((ours, size_of::<$type>()), layout_of($text, $name), $name);
        };
    }

    /// Every struct that host and device share has the same members at the same offsets.
    #[test]
    fn structs_are_laid_out_as_their_twins() {
        let text = |name: &str| compose(PASSES.iter().find(|p| p.name == name).expect("pass"), 3);
        let grid = text("grid");
        twin!(
            &grid,
            Params,
            "Params",
            [
                blocks,
                particle_count,
                wall_low,
                slot_capacity,
                wall_high,
                tool_count,
                gravity,
                damping,
                centre,
                wall_kinds,
                mass_scale,
                momentum_scale,
                reach_limit,
                cell_count_limit,
                mu2,
                lambda,
                yield_norm,
                softening,
                softening_length,
                velocity_unit,
                rate_unit,
                mass_unit,
                travel_limit,
                density_unit,
                starts_frame,
                softens,
                node_mass_limit,
                hardening,
                viscous,
                flow_index,
                hardening_norm,
                work_loss,
                work_rate,
                work_kept,
                averaging,
                averaging_last,
                averaging_last_at,
                adhesion,
                blades,
                solids,
                weld_stress,
                weld_step,
                profiles,
            ]
        );
        twin!(
            &grid,
            GpuTool,
            "Tool",
            [
                end_cell,
                shape,
                end_offset,
                contact,
                start_cell,
                sheet,
                start_offset,
                friction,
                end_rotation,
                start_rotation,
                turn,
                travel,
                radius,
                size,
                profile,
            ]
        );
        twin!(&grid, ToolCount, "ToolCount", [tagged, pushed_back, depth, displaced]);
        twin!(
            &grid,
            Status,
            "Status",
            [flags, speed, clamped, cell_count, slot_count, substep, node_mass, reach_met, crowded, welded, sheets, tools]
        );
        twin!(&text("total"), Total, "Total", [momentum, momentum_size, angular, kinetic, strain, mass, ratio, reach, spare,]);
    }
}
