//! What hands need beside the clay's own panels: what each of them holds, and what a controller may have no
//! button for.

use super::InHand;
use crate::hand::{SIZES, ToolKind};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy_clay::prelude::*;
use bevy_egui::{EguiContexts, egui};

/// Where things stand on the panel [points], for whoever points at them: by their names.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct BarPlaces(pub(crate) HashMap<String, egui::Rect>);

/// The bar.
pub(super) fn bar(
    mut contexts: EguiContexts,
    mut tools: Query<(&mut HeldBy, &mut InHand)>,
    clay: Single<Entity, With<Clay>>,
    (mut hands, mut places): (ResMut<XrHands>, ResMut<BarPlaces>),
    mut commands: Commands,
) {
    let Ok(ctx) = contexts.ctx_mut() else { return };
    let mut note = |name: String, response: &egui::Response| {
        places.0.insert(name, response.rect);
    };
    let window = egui::Window::new("hands").title_bar(false).resizable(false).constrain_to(ctx.viewport_rect());
    window.anchor(egui::Align2::CENTER_BOTTOM, [0.0, -8.0]).show(ctx, |ui| {
        for wanted in [XrHand::Tool, XrHand::Support] {
            let Some((mut held, mut hand)) = tools.iter_mut().find(|(held, _)| held.hand == wanted) else { continue };
            ui.horizontal(|ui| hold(ui, &mut held, &mut hand, &mut note));
        }
        ui.horizontal(|ui| {
            let mut button = |text: &str| {
                let response = ui.button(text);
                note(text.into(), &response);
                response.clicked()
            };
            let entity = *clay;
            if button("undo") {
                commands.trigger(UndoClay { entity });
            }
            if button("redo") {
                commands.trigger(RedoClay { entity });
            }
            if button("recentre") {
                commands.trigger(RecentreWork);
            }
            if button("other hand") {
                hands.tool = hands.tool.other();
            }
        });
    });
}

/// What a hand holds: nothing, or a tool of a size.
fn hold(ui: &mut egui::Ui, held: &mut Mut<HeldBy>, hand: &mut Mut<InHand>, note: &mut impl FnMut(String, &egui::Response)) {
    let name = format!("{:?} hand", held.hand);
    ui.label(&name);
    let nothing = ui.selectable_label(held.is_away, "nothing");
    note(format!("{name}: nothing"), &nothing);
    if nothing.clicked() {
        held.is_away = true;
    }
    for kind in ToolKind::ALL {
        let response = ui.selectable_label(!held.is_away && hand.kind == kind, kind.name());
        note(format!("{name}: {}", kind.name()), &response);
        if response.clicked() {
            (hand.kind, held.is_away) = (kind, false);
        }
    }
    ui.spacing_mut().slider_width = 80.0;
    let mut size = hand.size;
    let slider = ui.add(egui::Slider::new(&mut size, SIZES).logarithmic(true).show_value(false));
    note(format!("{name}: size"), &slider);
    if slider.changed() {
        hand.size = size;
    }
}
