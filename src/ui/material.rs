//! The rows of the material: what each number is called, its unit, its range and what it does.

use crate::sim::material::{ClayMaterial, Preset};
use bevy_egui::egui;
use std::ops::RangeInclusive;

/// A number of a row.
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) hover: &'static str,
    /// SI units per unit shown.
    pub(super) unit: f64,
    pub(super) suffix: &'static str,
    /// In the unit shown.
    pub(super) range: RangeInclusive<f64>,
    pub(super) is_logarithmic: bool,
    pub(super) decimals: usize,
    /// What 0 is called, if it stands for something else.
    pub(super) zero: Option<&'static str>,
}

impl Row {
    /// A linear row.
    pub(super) const fn linear(
        name: &'static str,
        hover: &'static str,
        (unit, suffix): (f64, &'static str),
        range: RangeInclusive<f64>,
        decimals: usize,
    ) -> Self {
        Self { name, hover, unit, suffix, range, is_logarithmic: false, decimals, zero: None }
    }

    /// A logarithmic row.
    pub(super) const fn logarithmic(
        name: &'static str,
        hover: &'static str,
        unit: (f64, &'static str),
        range: RangeInclusive<f64>,
        decimals: usize,
    ) -> Self {
        Self { is_logarithmic: true, ..Self::linear(name, hover, unit, range, decimals) }
    }

    /// Name and slider in two cells of a grid. `value` [SI] changes only by the user's hand, and only to numbers of the range.
    pub(super) fn show(&self, ui: &mut egui::Ui, value: &mut f64) -> egui::Response {
        ui.label(self.name).on_hover_text(self.hover);
        let mut shown = *value / self.unit;
        let is_zero = shown == 0.0;
        let slider = egui::Slider::new(&mut shown, self.range.clone())
            .logarithmic(self.is_logarithmic)
            .clamping(egui::SliderClamping::Edits)
            .max_decimals(self.decimals)
            .suffix(self.suffix);
        let slider = match self.zero {
            Some(name) if is_zero => slider.custom_formatter(move |_, _| name.to_string()).suffix(""),
            _ => slider,
        };
        let response = ui.add(slider).on_hover_text(self.hover);
        ui.end_row();
        // What a user types may be no number at all.
        if response.changed() && self.range.contains(&shown) {
            *value = shown * self.unit;
        }
        response
    }
}

const YIELD_STRESS: Row = Row::logarithmic(
    "yield stress",
    "Stress at which the clay gives way for good, in uniaxial tension. Soft clay 8 kPa, plasticine 30 kPa, leather-hard 100 kPa.",
    (1e3, " kPa"),
    0.5..=300.0,
    1,
);
const STIFFNESS: Row = Row::logarithmic(
    "stiffness",
    "Young's modulus: how little the clay springs back. Four times as stiff takes twice as many substeps.",
    (1e3, " kPa"),
    10.0..=50_000.0,
    0,
);
const POISSON: Row = Row::linear(
    "Poisson's ratio",
    "How much the clay bulges when pressed: at 0.5, which cannot be reached, its volume would not change at all. Clay: 0.45.",
    (1.0, ""),
    0.0..=0.49,
    3,
);
const DENSITY: Row =
    Row::linear("density", "Mass per volume. Clay and plasticine: 1400 to 1900 kg/m³.", (1.0, " kg/m³"), 500.0..=5000.0, 0);
const SOFTENING: Row = Row::linear(
    "softening",
    "How much of its yield stress the clay loses close to a tool: 0 is uniform clay, 0.5 halves it there.",
    (1.0, ""),
    0.0..=0.95,
    2,
);
const SOFTENING_LENGTH: Row = Row { zero: Some("3 cells"), ..TAU };
const TAU: Row = Row::linear(
    "tau",
    "Softening length: how far from a tool the softening fades, beyond the first three cells. 0 stands for three cells.",
    (1e-3, " mm"),
    0.0..=30.0,
    1,
);

/// The presets and what to call them.
const PRESETS: [(Preset, &str); 3] =
    [(Preset::SoftClay, "soft clay"), (Preset::Plasticine, "plasticine"), (Preset::StiffClay, "leather-hard clay")];

/// `material` with the clay of `preset`; the softening about tools, which belongs to the hand and not to the clay, stays.
fn with_preset(material: &ClayMaterial, preset: Preset) -> ClayMaterial {
    ClayMaterial { softening: material.softening, softening_length: material.softening_length, ..preset.material() }
}

/// The rows; whatever they leave in `material` is a material.
pub(super) fn rows(ui: &mut egui::Ui, material: &mut ClayMaterial) {
    let before = *material;
    ui.label("clay").on_hover_text("Named clays. They set all but the softening.");
    let named = PRESETS.iter().find(|(preset, _)| with_preset(material, *preset) == *material);
    egui::ComboBox::from_id_salt("clay preset").width(170.0).selected_text(named.map_or("my own", |(_, name)| name)).show_ui(
        ui,
        |ui| {
            for (preset, name) in PRESETS {
                ui.selectable_value(material, with_preset(&before, preset), name);
            }
        },
    );
    ui.end_row();
    YIELD_STRESS.show(ui, &mut material.yield_stress);
    STIFFNESS.show(ui, &mut material.young_modulus);
    POISSON.show(ui, &mut material.poisson_ratio);
    DENSITY.show(ui, &mut material.density);
    SOFTENING.show(ui, &mut material.softening);
    SOFTENING_LENGTH.show(ui, &mut material.softening_length);
    if material.validate().is_err() {
        *material = before;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every end of every range, alone and all together, makes a material that an engine takes.
    #[test]
    fn ends_of_ranges_are_materials() {
        type Field = fn(&mut ClayMaterial) -> &mut f64;
        let fields: [(&Row, Field); 6] = [
            (&YIELD_STRESS, |m| &mut m.yield_stress),
            (&STIFFNESS, |m| &mut m.young_modulus),
            (&POISSON, |m| &mut m.poisson_ratio),
            (&DENSITY, |m| &mut m.density),
            (&SOFTENING, |m| &mut m.softening),
            (&SOFTENING_LENGTH, |m| &mut m.softening_length),
        ];
        for ends in 0..1 << fields.len() {
            let mut material = ClayMaterial::default();
            for (bit, (row, field)) in fields.iter().enumerate() {
                let end = if ends >> bit & 1 == 0 { row.range.start() } else { row.range.end() };
                *field(&mut material) = end * row.unit;
            }
            assert_eq!(material.validate(), Ok(()), "{material:?}");
        }
    }

    /// The panel's presets are within the ranges: a slider that is touched does not jump.
    #[test]
    fn presets_are_within_the_ranges() {
        for (preset, name) in PRESETS {
            let m = preset.material();
            let values = [
                (&YIELD_STRESS, m.yield_stress),
                (&STIFFNESS, m.young_modulus),
                (&POISSON, m.poisson_ratio),
                (&DENSITY, m.density),
            ];
            assert!(values.iter().all(|(row, value)| row.range.contains(&(value / row.unit))), "{name}");
        }
    }

    /// Shown and not touched, the rows change nothing, not even what is out of their ranges.
    #[test]
    fn rows_left_alone_change_nothing() {
        let ctx = egui::Context::default();
        for yield_stress in [8e3, 1e9, f64::INFINITY] {
            let before = ClayMaterial { yield_stress, ..ClayMaterial::default() };
            let mut material = before;
            for _ in 0..3 {
                let _ = ctx.run_ui(egui::RawInput::default(), |ui| {
                    egui::Grid::new("rows").show(ui, |ui| rows(ui, &mut material));
                });
            }
            assert_eq!(material, before);
        }
    }
}
