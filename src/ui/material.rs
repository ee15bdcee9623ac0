//! The rows of the material: what each number is called, its unit, its range and what it does.

use crate::sim::material::{ClayLaw, ClayMaterial, Preset, Weld};
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

    /// Name and slider in two cells of a grid. `value` \[SI\] changes only by the user's hand, and only to
    /// numbers of the range.
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

const HARDENING: Row = Row {
    zero: Some("none"),
    ..Row::logarithmic(
        "hardening",
        "Hardening modulus: how much the yield stress gains as the clay is deformed, per doubling or so of its length.",
        (1e3, " kPa"),
        0.0..=1000.0,
        1,
    )
};
const VISCOSITY: Row = Row {
    zero: Some("none"),
    ..Row::logarithmic(
        "viscosity",
        "How much firmer the clay is when it is pressed fast: what it withstands beyond its yield stress at a strain rate of 1/s.",
        (1e3, " kPa s^n"),
        0.0..=100.0,
        2,
    )
};
const FLOW_INDEX: Row = Row::linear(
    "flow index",
    "Exponent n of the viscosity: at 1 what the clay withstands grows with the speed, at 0.3 it doubles for ten times the speed.",
    (1.0, ""),
    0.05..=1.0,
    2,
);
const TOUGHNESS: Row = Row {
    zero: Some("none"),
    ..Row::logarithmic(
        "toughness",
        "What the edge of a blade has to do for each area that it cuts: its force per length of edge.",
        (1.0, " J/m^2"),
        0.0..=1000.0,
        0,
    )
};
const LOSS: Row =
    Row::linear("loss", "Share of its yield stress that clay loses by being worked, at most.", (0.01, " %"), 0.0..=95.0, 0);
const RATE: Row = Row::linear(
    "rate",
    "How fast working softens: at 1, clay that was deformed to twice its length or so has lost two thirds of what it can lose.",
    (1.0, ""),
    0.0..=20.0,
    1,
);
const REST_TIME: Row = Row::logarithmic(
    "rest time",
    "Time in which clay that rests gets back two thirds of what it lost.",
    (60.0, " min"),
    0.05..=1440.0,
    2,
);

/// The rows of the laws' numbers, by the names that these have in files.
const LAW_ROWS: [(&str, &Row); 3] = [("loss", &LOSS), ("rate", &RATE), ("rest_time", &REST_TIME)];

/// The law, and the numbers of the one that has some.
fn law_rows(ui: &mut egui::Ui, law: &mut ClayLaw) {
    let hover =
        "What softens the clay. As published, the paper's equations to the letter, is unstable and runs on the CPU alone.";
    ui.label("law").on_hover_text(hover);
    let chosen = *law;
    let short = if law.is_as_published() { "Eq. 4-5 (unstable)" } else { law.name() };
    let combo = egui::ComboBox::from_id_salt("clay law").width(170.0).selected_text(short);
    combo.show_ui(ui, |ui| {
        for other in ClayLaw::ALL {
            let choice = if other.number() == chosen.number() { chosen } else { other };
            ui.selectable_value(law, choice, choice.name());
        }
    });
    ui.end_row();
    for (name, number) in law.numbers_mut() {
        match LAW_ROWS.iter().find(|row| row.0 == name) {
            Some((_, row)) => {
                row.show(ui, number);
            }
            None => {
                ui.label(name);
                ui.add(egui::DragValue::new(number));
                ui.end_row();
            }
        }
    }
}

/// How cuts grow together.
fn weld_row(ui: &mut egui::Ui, weld: &mut Weld) {
    let name = |weld| match weld {
        Weld::Pressed => "when pressed firmly",
        Weld::Sticky => "almost at a touch",
        Weld::Off => "never",
    };
    let hover = "When the two sides of a cut grow together again: pressed at half the clay's shear strength for 0.3 s, at a twentieth for 0.05 s, or never.";
    ui.label("cuts heal").on_hover_text(hover);
    let combo = egui::ComboBox::from_id_salt("clay weld").width(170.0).selected_text(name(*weld));
    combo.show_ui(ui, |ui| {
        for choice in Weld::ALL {
            ui.selectable_value(weld, choice, name(choice));
        }
    });
    ui.end_row();
}

/// `material` with the clay of `preset`; the softening about tools, which belongs to the hand and not to the
/// clay, stays.
fn with_preset(material: &ClayMaterial, preset: Preset) -> ClayMaterial {
    ClayMaterial { softening: material.softening, softening_length: material.softening_length, ..preset.material() }
}

/// The rows; whatever they leave in `material` is a material.
pub(super) fn rows(ui: &mut egui::Ui, material: &mut ClayMaterial) {
    let before = *material;
    ui.label("clay").on_hover_text("Named clays. They set all but the softening.");
    let named = Preset::ALL.into_iter().find(|preset| with_preset(material, *preset) == *material);
    let combo = egui::ComboBox::from_id_salt("clay preset").width(170.0);
    combo.selected_text(named.map_or("my own", Preset::name)).show_ui(ui, |ui| {
        for preset in Preset::ALL {
            ui.selectable_value(material, with_preset(&before, preset), preset.name());
        }
    });
    ui.end_row();
    YIELD_STRESS.show(ui, &mut material.yield_stress);
    STIFFNESS.show(ui, &mut material.young_modulus);
    POISSON.show(ui, &mut material.poisson_ratio);
    DENSITY.show(ui, &mut material.density);
    SOFTENING.show(ui, &mut material.softening);
    SOFTENING_LENGTH.show(ui, &mut material.softening_length);
    HARDENING.show(ui, &mut material.hardening_modulus);
    VISCOSITY.show(ui, &mut material.viscosity);
    FLOW_INDEX.show(ui, &mut material.flow_index);
    TOUGHNESS.show(ui, &mut material.toughness);
    law_rows(ui, &mut material.law);
    weld_row(ui, &mut material.weld);
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
        fn worked(material: &mut ClayMaterial, index: usize) -> &mut f64 {
            material.law.numbers_mut().swap_remove(index).1
        }
        let fields: [(&Row, Field); 13] = [
            (&YIELD_STRESS, |m| &mut m.yield_stress),
            (&STIFFNESS, |m| &mut m.young_modulus),
            (&POISSON, |m| &mut m.poisson_ratio),
            (&DENSITY, |m| &mut m.density),
            (&SOFTENING, |m| &mut m.softening),
            (&SOFTENING_LENGTH, |m| &mut m.softening_length),
            (&HARDENING, |m| &mut m.hardening_modulus),
            (&VISCOSITY, |m| &mut m.viscosity),
            (&FLOW_INDEX, |m| &mut m.flow_index),
            (&TOUGHNESS, |m| &mut m.toughness),
            (&LOSS, |m| worked(m, 0)),
            (&RATE, |m| worked(m, 1)),
            (&REST_TIME, |m| worked(m, 2)),
        ];
        for ends in 0..1 << fields.len() {
            let mut material = ClayMaterial { law: Preset::Plasticine.material().law, ..ClayMaterial::default() };
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
        for preset in Preset::ALL {
            let m = preset.material();
            let mut values = vec![
                (&YIELD_STRESS, m.yield_stress),
                (&STIFFNESS, m.young_modulus),
                (&POISSON, m.poisson_ratio),
                (&DENSITY, m.density),
                (&HARDENING, m.hardening_modulus),
                (&VISCOSITY, m.viscosity),
                (&FLOW_INDEX, m.flow_index),
                (&TOUGHNESS, m.toughness),
            ];
            let mut law = m.law;
            for (name, number) in law.numbers_mut() {
                let (_, row) = LAW_ROWS.iter().find(|row| row.0 == name).expect("a row of every number");
                values.push((*row, *number));
            }
            for (row, value) in values {
                assert!(row.range.contains(&(value / row.unit)), "{}: {}", preset.name(), row.name);
            }
        }
    }

    /// Laws that are unstable say so where they are chosen, and plasticine is what worked clay begins as.
    #[test]
    fn laws_are_called_what_they_are() {
        for law in ClayLaw::ALL {
            assert_eq!(law.name().contains("unstable, for comparison"), law.is_as_published());
        }
        assert!(ClayLaw::ALL.contains(&Preset::Plasticine.material().law));
    }

    /// Shown and not touched, the rows change nothing, not even what is out of their ranges.
    #[test]
    fn rows_left_alone_change_nothing() {
        let ctx = egui::Context::default();
        let never = ClayLaw::Worked { loss: 0.99, rate: 1e3, rest_time: f64::INFINITY };
        for (yield_stress, law) in [
            (8e3, ClayLaw::Softened),
            (1e9, Preset::Plasticine.material().law),
            (f64::INFINITY, never),
            (8e3, ClayLaw::AsPublished),
            (8e3, ClayLaw::AsPublishedDefaultD),
        ] {
            let before = ClayMaterial { yield_stress, law, hardening_modulus: 1e9, viscosity: 1e7, ..ClayMaterial::default() };
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
