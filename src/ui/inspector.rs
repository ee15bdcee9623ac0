//! Every reflected component of the clay and its tools, field by field.

use crate::plugin::clay::Clay;
use crate::plugin::tool::SculptTool;
use bevy::prelude::*;
use bevy_egui::{EguiContext, PrimaryEguiContext, egui};
use bevy_inspector_egui::bevy_inspector::ui_for_entity;

/// What the window shows.
type Shown = Or<(With<Clay>, With<SculptTool>)>;

/// The inspector's window, closed at first.
pub(super) fn window(world: &mut World) {
    let Ok(mut context) = world.query_filtered::<&EguiContext, With<PrimaryEguiContext>>().single(world).cloned() else {
        return;
    };
    // The clay before its tools.
    let mut entities: Vec<Entity> = world.query_filtered::<Entity, Shown>().iter(world).collect();
    entities.sort_by_key(|entity| !world.entity(*entity).contains::<Clay>());
    // Below the clay's window, however many rows that has.
    let corner = context.get_mut().content_rect().left_bottom() + egui::vec2(8.0, -8.0);
    egui::Window::new("Inspector")
        .default_open(false)
        .default_pos(corner)
        .pivot(egui::Align2::LEFT_BOTTOM)
        .default_width(320.0)
        .max_height(160.0)
        .vscroll(true)
        .show(context.get_mut(), |ui| {
            ui.label("Every component as it is, in SI units. What the clay cannot use it refuses by name.");
            for entity in entities {
                ui.separator();
                ui.push_id(entity, |ui| ui_for_entity(world, entity, ui));
            }
        });
}
