//! The panels of the desktop in the support hand: an egui context on a plate in the world, and the tool
//! hand's ray on it. Feature `inspector`.
//!
//! Sizes are those of text for eyes: 1 dmm is what 1 mm is at 1 m. A point of egui is 0.7 mm; at the half
//! metre where a hand holds the panel, body text of 14.3 points is 20 dmm high, and what is pressed
//! 64 dmm. Windows that do not fit are scrolled; the foot of the panel is the app's own.

use super::hand::{Side, XrControllers, XrHand, XrHands};
use super::schedule::XrSystems;
use super::tool::{HeldBy, ToolMute};
use crate::plugin::feel::HapticSession;
use bevy::asset::RenderAssetUsages;
use bevy::camera::RenderTarget;
use bevy::camera::visibility::RenderLayers;
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages};
use bevy_egui::input::{EguiInputEvent, FocusedNonWindowEguiContext};
use bevy_egui::{EguiContext, EguiInput, EguiInputSet, PrimaryEguiContext, egui};
use bevy_mod_openxr::resources::OxrInstance;

/// Size of the panel [points of egui, pixels of its picture].
pub const SIZE: UVec2 = UVec2::new(680, 800);
/// Size of a point \[m\].
pub const POINT: f32 = 7e-4;
/// Height that windows leave to what an app has of its own, at the lower edge \[points\]: rows that are always
/// at hand, anchored in [`egui::Context::viewport_rect`].
pub const FOOT: f32 = 184.0;
/// Height of body text, of what is pressed, and what that has to the left and right of its text [points].
const TEXT: f32 = 14.3;
const PRESSED: f32 = 46.0;
const PADDING: f32 = 9.0;
/// Where its middle is from the hand that holds it \[m\]: above the hand, its lower edge at the thumb.
const ABOVE: Vec3 = Vec3::new(0.0, 0.32, -0.06);
/// A trigger is pressed from here on, and let go below.
const CLICK: (f32, f32) = (0.6, 0.4);
/// Points that a stick scrolls in a second.
const SCROLL: f32 = 900.0;

/// The panel.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub struct XrPanel {
    /// Whether it is there.
    pub is_open: bool,
    /// The entity with the egui context: the primary one, so that what is drawn in a window is drawn here.
    pub context: Entity,
    /// The plate that shows it.
    pub plate: Entity,
    /// Where the tool hand's ray meets it [points from its upper left corner].
    pub pointer: Option<Vec2>,
}

/// The panel of an app that has panels: `ClayPanelPlugin`, and its own. Added after
/// [`XrSculptPlugin`](super::XrSculptPlugin); without a runtime it does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct XrPanelPlugin;

impl Plugin for XrPanelPlugin {
    fn build(&self, app: &mut App) {
        if !app.world().contains_resource::<OxrInstance>() {
            return;
        }
        let send = send.after(EguiInputSet::InitReading).before(EguiInputSet::WriteEguiEvents);
        app.add_systems(PreStartup, spawn).add_systems(PreUpdate, send).add_systems(
            Update,
            (open, place, point).chain().run_if(resource_exists::<XrPanel>).after(XrSystems::Read).before(XrSystems::Hold),
        );
    }
}

/// Draws the panel's egui into a picture, and the picture on a plate.
fn spawn(
    mut images: ResMut<Assets<Image>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut commands: Commands,
) {
    let size = Extent3d { width: SIZE.x, height: SIZE.y, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba8UnormSrgb;
    let mut image = Image::new_fill(size, TextureDimension::D2, &[0; 4], format, RenderAssetUsages::default());
    image.texture_descriptor.usage |= TextureUsages::RENDER_ATTACHMENT;
    let image = images.add(image);
    let camera = Camera { order: -10, clear_color: ClearColorConfig::Custom(Color::srgba(0.05, 0.06, 0.07, 0.85)), ..default() };
    let mut egui_context = EguiContext::default();
    egui_context.get_mut().all_styles_mut(enlarge);
    let foot = egui::epaint::MarginF32 { bottom: FOOT, ..egui::epaint::MarginF32::ZERO };
    let input = egui::RawInput { safe_area_insets: Some(egui::SafeAreaInsets(foot)), ..default() };
    let context = commands.spawn((
        Name::new("panel"),
        Camera2d,
        camera,
        RenderLayers::none(),
        RenderTarget::Image(image.clone().into()),
        egui_context,
        EguiInput(input),
        PrimaryEguiContext,
    ));
    let context = context.id();
    let half = SIZE.as_vec2() * POINT / 2.0;
    let look = StandardMaterial {
        base_color_texture: Some(image),
        unlit: true,
        alpha_mode: AlphaMode::Blend,
        cull_mode: None,
        ..default()
    };
    let plate = commands.spawn((
        Name::new("panel's plate"),
        Mesh3d(meshes.add(Plane3d::new(Vec3::Z, half))),
        MeshMaterial3d(materials.add(look)),
        Visibility::Hidden,
        NotShadowCaster,
    ));
    let plate = plate.id();
    let tip = StandardMaterial { base_color: Color::srgb(1.0, 0.75, 0.2), unlit: true, ..default() };
    commands.spawn((
        Name::new("ray's end"),
        RayEnd,
        Mesh3d(meshes.add(Sphere::new(0.004))),
        MeshMaterial3d(materials.add(tip)),
        Visibility::Hidden,
        NotShadowCaster,
    ));
    commands.insert_resource(XrPanel { is_open: false, context, plate, pointer: None });
}

/// Text and buttons of a size for hands that point from half a metre.
fn enlarge(style: &mut egui::Style) {
    for font in style.text_styles.values_mut() {
        font.size = font.size.max(TEXT);
    }
    style.spacing.interact_size.y = PRESSED;
    style.spacing.button_padding.x = PADDING;
    style.spacing.item_spacing.y = 5.0;
    style.interaction.tooltip_delay = 1.0;
}

/// Shows where the ray ends.
#[derive(Component)]
struct RayEnd;

/// Opens the panel in the hand whose menu button is pressed, and closes it there. That hand is the support
/// hand then: the other one has the tool.
fn open(
    controllers: Res<XrControllers>,
    (mut hands, mut panel): (ResMut<XrHands>, ResMut<XrPanel>),
    mut haptics: Option<ResMut<HapticSession>>,
    mut was: Local<[bool; 2]>,
) {
    for (side, was) in Side::ALL.into_iter().zip(&mut *was) {
        let is_pressed = controllers.get(side).menu;
        if is_pressed && !std::mem::replace(was, is_pressed) {
            let is_support = hands.side(XrHand::Support) == side;
            panel.is_open = !(panel.is_open && is_support);
            // The mind is off the clay: an arm's force goes, and comes back slowly.
            if let Some(haptics) = &mut haptics {
                haptics.restart_force();
            }
            if !is_support {
                hands.tool = side.other();
            }
        }
        *was = is_pressed;
    }
}

/// Keeps the plate in the support hand, upright and facing along it.
fn place(
    (controllers, hands): (Res<XrControllers>, Res<XrHands>),
    panel: Res<XrPanel>,
    mut cameras: Query<&mut Camera>,
    mut plates: Query<(&mut Transform, &mut Visibility)>,
) {
    let grip = controllers.get(hands.side(XrHand::Support)).grip;
    if let Ok(mut camera) = cameras.get_mut(panel.context)
        && camera.is_active != panel.is_open
    {
        // A panel that is not there costs no picture.
        camera.is_active = panel.is_open;
    }
    let Ok((mut transform, mut visibility)) = plates.get_mut(panel.plate) else { return };
    visibility.set_if_neq(if panel.is_open { Visibility::Visible } else { Visibility::Hidden });
    if let Some(grip) = grip {
        let at = grip * Isometry3d::from_translation(ABOVE);
        transform.set_if_neq(Transform::from_isometry(at));
    }
}

/// Where a ray along -z of `aim` meets a plate that faces along its z, from the front [points from its upper
/// left corner]; none beside it.
fn meet(aim: Isometry3d, plate: Isometry3d) -> Option<Vec2> {
    let to_plate = plate.inverse() * aim;
    let (from, way) = (Vec3::from(to_plate.translation), to_plate.rotation * Vec3::NEG_Z);
    if from.z <= 0.0 || way.z >= -1e-3 {
        return None;
    }
    let at = (from + way * (from.z / -way.z)).truncate() * Vec2::new(1.0, -1.0) / POINT + SIZE.as_vec2() / 2.0;
    (at.cmpge(Vec2::ZERO).all() && at.cmple(SIZE.as_vec2()).all()).then_some(at)
}

/// What the tool hand does to the panel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Pointing {
    is_pressed: bool,
    /// Whether it was pressed on the panel: then it has the panel until it is let go.
    is_dragging: bool,
}

/// Whether the trigger is pressed, and whether that is the panel's.
fn press(was: Pointing, trigger: f32, is_over: bool) -> Pointing {
    let is_pressed = trigger > if was.is_pressed { CLICK.1 } else { CLICK.0 };
    let begins = is_pressed && !was.is_pressed && is_over;
    Pointing { is_pressed, is_dragging: is_pressed && (was.is_dragging || begins) }
}

/// Points at the panel; a tool whose hand does touches no clay, unless it was in it before.
fn point(
    (controllers, hands): (Res<XrControllers>, Res<XrHands>),
    mut panel: ResMut<XrPanel>,
    plates: Query<&Transform, Without<RayEnd>>,
    mut ends: Query<(&mut Transform, &mut Visibility), With<RayEnd>>,
    mut tools: Query<(&HeldBy, &mut ToolMute)>,
    mut was: Local<Pointing>,
) {
    let controller = controllers.get(hands.side(XrHand::Tool));
    let plate = plates.get(panel.plate).ok().map(Transform::to_isometry);
    let met = controller.aim.zip(plate).filter(|_| panel.is_open).and_then(|(aim, plate)| meet(aim, plate));
    let now = press(*was, controller.trigger, met.is_some());
    // A stroke goes on though the ray comes over the panel.
    let is_stroke = now.is_pressed && !now.is_dragging;
    let is_mute = now.is_dragging || (met.is_some() && !is_stroke);
    panel.pointer = met.filter(|_| is_mute);
    for (_, mut mute) in tools.iter_mut().filter(|(held, _)| held.hand == XrHand::Tool) {
        mute.set_if_neq(ToolMute(is_mute));
    }
    *was = now;
    let end = met.zip(plate).filter(|_| is_mute).map(|(at, plate)| {
        let on_plate = (at - SIZE.as_vec2() / 2.0) * Vec2::new(1.0, -1.0) * POINT;
        plate * on_plate.extend(0.0)
    });
    for (mut transform, mut visibility) in &mut ends {
        visibility.set_if_neq(if end.is_some() { Visibility::Visible } else { Visibility::Hidden });
        transform.translation = end.unwrap_or(transform.translation);
    }
}

/// Tells egui of the ray: where it is, the trigger as a button, the stick as a wheel.
fn send(
    (controllers, hands, time): (Res<XrControllers>, Res<XrHands>, Res<Time<Real>>),
    panel: Option<Res<XrPanel>>,
    mut events: MessageWriter<EguiInputEvent>,
    mut last: Local<(Option<Vec2>, bool, bool)>,
    mut commands: Commands,
) {
    let Some(panel) = panel else { return };
    let controller = controllers.get(hands.side(XrHand::Tool));
    let (before, was_trigger, was_pressed) = *last;
    let mut write = |event| {
        events.write(EguiInputEvent { context: panel.context, event });
    };
    let trigger = controller.trigger > if was_trigger { CLICK.1 } else { CLICK.0 };
    // Only what is pressed over the panel is a click on it.
    let is_pressed = trigger && (was_pressed || (!was_trigger && panel.pointer.is_some()));
    let to_pos = |at: Vec2| egui::pos2(at.x, at.y);
    if let Some(at) = panel.pointer {
        if before.is_none() {
            commands.insert_resource(FocusedNonWindowEguiContext(panel.context));
        }
        if before != panel.pointer {
            write(egui::Event::PointerMoved(to_pos(at)));
        }
        let scroll = controller.stick.y * SCROLL * time.delta_secs();
        if controller.stick.y.abs() > 0.2 {
            write(egui::Event::MouseWheel {
                unit: egui::MouseWheelUnit::Point,
                delta: egui::vec2(0.0, scroll),
                phase: egui::TouchPhase::Move,
                modifiers: egui::Modifiers::NONE,
            });
        }
    }
    if is_pressed != was_pressed {
        let pos = to_pos(panel.pointer.or(before).unwrap_or_default());
        let button = egui::PointerButton::Primary;
        write(egui::Event::PointerButton { pos, button, pressed: is_pressed, modifiers: egui::Modifiers::NONE });
    }
    if panel.pointer.is_none() && before.is_some() {
        write(egui::Event::PointerGone);
        commands.remove_resource::<FocusedNonWindowEguiContext>();
    }
    *last = (panel.pointer, trigger, is_pressed);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ray that meets the plate at a point, from the side and from afar.
    #[test]
    fn rays_meet_points() {
        let plate = Isometry3d::new(Vec3::new(0.3, 1.1, -0.4), Quat::from_euler(EulerRot::YXZ, 0.6, -0.3, 0.1));
        for at in [Vec2::new(1.0, 1.0), Vec2::new(320.0, 400.0), Vec2::new(679.0, 20.0), Vec2::new(100.0, 799.0)] {
            let on_plate = (at - SIZE.as_vec2() / 2.0) * Vec2::new(1.0, -1.0) * POINT;
            let target = plate * on_plate.extend(0.0);
            for eye in [Vec3::new(0.0, 0.0, 0.5), Vec3::new(0.4, -0.2, 0.2)] {
                let from = plate * eye;
                let aim = Transform::from_translation(from).looking_at(target, Vec3::Y).to_isometry();
                let met = meet(aim, plate).expect("a point");
                assert!(met.distance(at) < 0.05, "{met} for {at}");
            }
        }
        let front = plate * Isometry3d::from_translation(Vec3::Z * 0.5);
        assert!(meet(front, plate).is_some());
        assert_eq!(meet(front * Isometry3d::from_translation(Vec3::X * 0.3), plate), None, "beside it");
        assert_eq!(meet(front * Isometry3d::from_rotation(Quat::from_rotation_y(3.0)), plate), None, "away from it");
        assert_eq!(meet(plate * Isometry3d::from_translation(Vec3::NEG_Z * 0.5), plate), None, "from behind");
    }

    /// A press belongs to what it began on.
    #[test]
    fn presses_stay_with_what_they_began_on() {
        let mut pointing = Pointing::default();
        let mut step = |trigger, is_over| {
            pointing = press(pointing, trigger, is_over);
            (pointing.is_pressed, pointing.is_dragging)
        };
        assert_eq!(step(0.5, true), (false, false), "not enough");
        assert_eq!(step(0.7, true), (true, true));
        assert_eq!(step(0.5, false), (true, true), "dragged off the panel");
        assert_eq!(step(0.3, false), (false, false));
        assert_eq!(step(0.9, false), (true, false), "a stroke");
        assert_eq!(step(0.9, true), (true, false), "comes over the panel");
    }
}
