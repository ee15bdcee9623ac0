//! What the hand holds: chosen by keys and the wheel, and how it stands on the clay.

use crate::pointer::{Hit, Pointer};
use crate::start::Extent;
use crate::stroke::Stroke;
use crate::view::lines;
use bevy::input::common_conditions::input_pressed;
use bevy::input::mouse::AccumulatedMouseScroll;
use bevy::prelude::*;
use bevy_clay::prelude::*;
use bevy_egui::input::egui_wants_any_keyboard_input;

/// Length of the clay's ball over a unit of the tools.
pub(crate) const UNITS: f32 = 4.0;

/// Owns the [`Hand`].
pub(crate) struct HandPlugin;

impl Plugin for HandPlugin {
    fn build(&self, app: &mut App) {
        let by_keys = (choose.run_if(not(resource_exists::<Stroke>)), resize);
        let by_wheel = deepen.run_if(input_pressed(MouseButton::Left));
        app.init_resource::<Hand>()
            .add_systems(Startup, fit)
            .add_systems(Update, (by_keys.run_if(not(egui_wants_any_keyboard_input)), by_wheel).before(ClaySystems::Report));
    }
}

/// What the hand can hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ToolKind {
    #[default]
    Ball,
    Rod,
    Block,
    Board,
    Knife,
}

impl ToolKind {
    /// In the order of their keys, 1 to 5.
    pub(crate) const ALL: [Self; 5] = [Self::Ball, Self::Rod, Self::Block, Self::Board, Self::Knife];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Ball => "ball",
            Self::Rod => "rod",
            Self::Block => "block",
            Self::Board => "board",
            Self::Knife => "knife",
        }
    }

    pub(crate) fn hover(self) -> &'static str {
        match self {
            Self::Ball => "Presses hollows and draws grooves.",
            Self::Rod => "Lies on the surface: presses long grooves, smooths.",
            Self::Block => "Presses flat-bottomed hollows with corners.",
            Self::Board => "A wide plate that flattens.",
            Self::Knife => "Cuts along the line you draw, from the surface away from you.",
        }
    }
}

/// The tool in hand: the mouse's, or one of a hand in a headset.
#[derive(Resource, Clone, Debug, PartialEq)]
pub(crate) struct Hand {
    pub(crate) kind: ToolKind,
    /// 1 is the size that suits the clay.
    pub(crate) size: f32,
    /// How deep the tool goes in the end, over its depth by habit.
    pub(crate) depth: f32,
    /// A length that suits the clay \[m\].
    pub(crate) unit: f32,
}

/// Least and greatest size and depth of a tool.
pub(crate) const SIZES: std::ops::RangeInclusive<f32> = 0.4..=3.0;
pub(crate) const DEPTHS: std::ops::RangeInclusive<f32> = 0.2..=4.0;

impl Default for Hand {
    fn default() -> Self {
        Self { kind: ToolKind::Ball, size: 1.0, depth: 1.0, unit: 0.008 }
    }
}

impl Hand {
    pub(crate) fn resize(&mut self, factor: f32) {
        self.size = (self.size * factor).clamp(*SIZES.start(), *SIZES.end());
    }

    pub(crate) fn deepen(&mut self, factor: f32) {
        self.depth = (self.depth * factor).clamp(*DEPTHS.start(), *DEPTHS.end());
    }

    /// Half the tool's extents \[m\], its own y standing on the surface; of the knife: along the stroke, along
    /// the view, nothing.
    pub(crate) fn half(&self) -> Vec3 {
        let s = self.unit * self.size;
        match self.kind {
            ToolKind::Ball => Vec3::splat(s),
            ToolKind::Rod => Vec3::new(1.8 * s, 0.5 * s, 0.5 * s),
            ToolKind::Block => Vec3::splat(0.8 * s),
            ToolKind::Board => Vec3::new(2.0 * s, 0.4 * s, 2.0 * s),
            ToolKind::Knife => Vec3::new(0.5 * s, 4.6 * self.unit, 0.0),
        }
    }

    /// Half the knife's length \[m\].
    pub(crate) fn knife_reach(&self) -> f32 {
        4.6 * self.unit
    }

    /// How deep the tool goes in the end \[m\].
    pub(crate) fn depth_max(&self) -> f32 {
        match self.kind {
            ToolKind::Ball => 0.6 * self.unit * self.size * self.depth,
            // Through and through, unless it is told otherwise.
            ToolKind::Knife => 8.0 * self.unit * self.depth,
            _ => 0.5 * self.unit * self.depth,
        }
    }

    pub(crate) fn shape(&self) -> ToolShape {
        let half = self.half().as_dvec3();
        match self.kind {
            ToolKind::Ball => ToolShape::Sphere { radius: half.x },
            ToolKind::Rod => ToolShape::Capsule { radius: half.y, half_length: half.x - half.y },
            ToolKind::Block | ToolKind::Board => ToolShape::Box { half_size: half },
            ToolKind::Knife => ToolShape::Blade { half_width: half.x, half_height: half.y },
        }
    }

    /// The tool on the surface, `depth` \[m\] below it (above it if negative), one of its axes along `right` as
    /// seen from the camera.
    pub(crate) fn pose(&self, hit: &Hit, right: Vec3, depth: f32) -> Transform {
        let up = hit.normal;
        let along = (right - up * right.dot(up)).normalize_or(up.any_orthonormal_vector());
        let frame = match self.kind {
            // A rod's own y is its axis.
            ToolKind::Rod => Mat3::from_cols(up, along, up.cross(along)),
            _ => Mat3::from_cols(along, up, along.cross(up)),
        };
        Transform { translation: hit.point + up * (self.half().y - depth), rotation: Quat::from_mat3(&frame), scale: Vec3::ONE }
    }

    pub(crate) fn mesh(&self) -> Mesh {
        /// Thickness of the knife as drawn \[m\]; it has none.
        const KNIFE: f32 = 0.0004;
        let half = self.half();
        match self.kind {
            ToolKind::Ball => Sphere::new(half.x).mesh().uv(48, 24),
            ToolKind::Rod => Capsule3d::new(half.y, 2.0 * (half.x - half.y)).mesh().build(),
            ToolKind::Block | ToolKind::Board => Cuboid::from_size(2.0 * half).mesh().build(),
            ToolKind::Knife => Cuboid::new(2.0 * half.x, 2.0 * half.y, KNIFE).mesh().build(),
        }
    }
}

/// Tools that suit the clay.
fn fit(extent: Res<Extent>, mut hand: ResMut<Hand>) {
    hand.unit = extent.radius / UNITS;
}

/// Takes another tool. The one in the clay stays what it is until it is lifted.
fn choose(keys: Res<ButtonInput<KeyCode>>, mut hand: ResMut<Hand>) {
    let digits = [KeyCode::Digit1, KeyCode::Digit2, KeyCode::Digit3, KeyCode::Digit4, KeyCode::Digit5];
    for (key, kind) in digits.into_iter().zip(ToolKind::ALL) {
        if keys.just_pressed(key) {
            hand.kind = kind;
        }
    }
}

/// Makes the tool larger or smaller.
fn resize(keys: Res<ButtonInput<KeyCode>>, mut hand: ResMut<Hand>) {
    const STEP: f32 = 1.15;
    let is_shifted = keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
    let is_b = keys.just_pressed(KeyCode::KeyB);
    if keys.just_pressed(KeyCode::BracketRight) || (is_b && !is_shifted) {
        hand.resize(STEP);
    }
    if keys.just_pressed(KeyCode::BracketLeft) || (is_b && is_shifted) {
        hand.resize(1.0 / STEP);
    }
}

/// Lets the tool that is pressed go deeper or less deep.
fn deepen(pointer: Res<Pointer>, scroll: Res<AccumulatedMouseScroll>, mut hand: ResMut<Hand>) {
    const STEP: f32 = 1.15;
    if pointer.is_down && scroll.delta.y != 0.0 {
        hand.deepen(STEP.powf(lines(&scroll)));
    }
}
