//! The same clay in a headset: on its board before the viewer, a tool in each hand that wants one.

mod bar;

pub(crate) use bar::BarPlaces;

use crate::args::Args;
use crate::arm::ArmPlugin;
use crate::hand::{Hand, ToolKind, UNITS};
use crate::looks::{Looks, Worn};
use crate::stage::{Board, StagePlugin};
use crate::start::{Extent, Start, StartPlugin};
use crate::{check, log, say};
use bevy::app::ScheduleRunnerPlugin;
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_clay::prelude::*;
use bevy_clay::scene::export::free_file;
use bevy_clay::xr;
use bevy_egui::{EguiGlobalSettings, EguiPrimaryContextPass};
use bevy_mod_xr::session::XrState;
use std::f32::consts::FRAC_PI_2;
use std::path::PathBuf;
use std::time::Duration;

/// How much larger than it is the clay begins: a lump of a few centimetres for hands that work at arm's
/// length.
const SCALE: f32 = 4.0;
/// Part of a tool's size in the window that it has in a hand: that is large enough as it is.
const TOOL: f32 = 0.5;

/// What a hand's tool is made by.
#[derive(Component, Deref, DerefMut)]
pub(crate) struct InHand(pub(crate) Hand);

/// The app. It has no window: what is drawn is drawn for the headset.
pub(crate) fn app(start: Start, args: Args) -> App {
    let arm = ArmPlugin::of(&args, SCALE);
    let windows = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let plugins = DefaultPlugins.set(windows).set(log()).disable::<WinitPlugin>();
    let mut app = App::new();
    app.add_plugins((xr::runtime::plugins(plugins), ScheduleRunnerPlugin::run_loop(Duration::ZERO)))
        .add_plugins((ClayPlugins, SoftwareDrawingPlugin, XrSculptPlugin))
        .add_plugins((ClayPanelPlugin { export_folder: args.out.clone() }, XrPanelPlugin))
        .insert_resource(EguiGlobalSettings { auto_create_primary_context: false, ..default() })
        .add_plugins((StartPlugin(start), StagePlugin))
        .init_resource::<BarPlaces>()
        .add_systems(EguiPrimaryContextPass, bar::bar)
        .add_systems(PostStartup, (set_up, give_tools))
        .add_systems(Update, shape.before(ClaySystems::Report))
        .add_systems(Update, tint.after(ClaySystems::Show))
        .add_systems(Last, rest);
    if let Some(arm) = arm {
        app.add_plugins(arm);
    }
    if args.check.is_on {
        app.add_plugins(check::HandsPlugin { has_arm: arm.is_some(), args: args.check });
    } else {
        app.insert_resource(ExportFolder(args.out))
            .add_observer(save)
            .add_observer(leave)
            .add_observer(lament)
            .add_observer(quit);
    }
    app
}

/// Where the clay goes if the headset does.
#[derive(Resource)]
struct ExportFolder(PathBuf);

/// Saves the clay when the runtime goes: nobody sees the app any more.
fn save(_: On<RuntimeLost>, clay: Single<Entity, With<Clay>>, folder: Res<ExportFolder>, mut commands: Commands) {
    match free_file(&folder.0, ExportFormat::default()) {
        Ok(path) => commands.trigger(ExportClay { entity: *clay, path, options: ExportOptions::default() }),
        Err(error) => {
            say::error(&error.to_string());
            commands.write_message(AppExit::error());
        }
    }
}

/// Ends the app that nobody sees, when the clay is saved.
fn leave(saved: On<ClayExported>, state: Res<XrState>, mut exit: MessageWriter<AppExit>) {
    if *state == XrState::Unavailable {
        saved.files.iter().for_each(|file| say::line(&format!("sculpt: the clay is in {}", file.display())));
        exit.write(AppExit::error());
    }
}

/// Ends it too when the clay cannot be saved: nobody is there to try again.
fn lament(trouble: On<ClayTrouble>, state: Res<XrState>, mut exit: MessageWriter<AppExit>) {
    if *state == XrState::Unavailable && matches!(trouble.error, ClayError::Operation(_)) {
        say::error(&format!("the clay is not saved: {}", trouble.error));
        exit.write(AppExit::error());
    }
}

/// Ends the app with the session that the viewer has ended.
fn quit(_: On<SessionEnded>, mut exit: MessageWriter<AppExit>) {
    exit.write(AppExit::Success);
}

/// Puts the clay and its board where hands can move them.
fn set_up(
    clay: Single<(Entity, &mut Transform), With<Clay>>,
    board: Single<Entity, With<Board>>,
    mut lights: Query<&mut DirectionalLight>,
    mut commands: Commands,
) {
    let (clay, mut transform) = clay.into_inner();
    transform.scale = Vec3::splat(SCALE);
    commands.entity(clay).insert(WorkRoot).add_child(*board);
    // They would be drawn for both eyes, and are made for a window's camera.
    lights.iter_mut().for_each(|mut light| light.shadow_maps_enabled = false);
}

/// A tool in each hand; that of the support hand is put away at first, and with an arm that of the hand which
/// holds it.
fn give_tools(
    (extent, arm): (Res<Extent>, Option<Res<ArmPlugin>>),
    mut meshes: ResMut<Assets<Mesh>>,
    mut looks: Looks,
    mut commands: Commands,
) {
    for in_hand in [XrHand::Tool, XrHand::Support] {
        let unit = SCALE * extent.radius / UNITS * TOOL;
        let hand = Hand { unit, ..default() };
        let is_away = in_hand == XrHand::Support || arm.is_some();
        let mut tool = commands.spawn((
            Name::new(format!("tool of the {in_hand:?} hand")),
            HeldBy { is_away, ..held(in_hand, &hand) },
            SculptTool::new(hand.shape()),
            Mesh3d(meshes.add(hand.mesh())),
            NotShadowCaster,
            InHand(hand),
        ));
        let material = StandardMaterial { base_color: FREE, alpha_mode: AlphaMode::Blend, double_sided: true, ..default() };
        looks.put(&mut tool, material);
    }
}

/// Before the hand, pointing where it points: a knife stands upright, its edge down.
fn held(in_hand: XrHand, hand: &Hand) -> HeldBy {
    /// Between the hand and what it holds \[m\].
    const HANDLE: f32 = 0.04;
    let half = hand.half();
    let offset = match hand.kind {
        ToolKind::Knife => {
            Isometry3d::new(Vec3::NEG_Z * (HANDLE + half.y), Quat::from_mat3(&Mat3::from_cols(Vec3::Y, Vec3::NEG_Z, Vec3::NEG_X)))
        }
        ToolKind::Rod => Isometry3d::new(Vec3::NEG_Z * (HANDLE + half.x), Quat::from_rotation_z(FRAC_PI_2)),
        _ => Isometry3d::from_translation(Vec3::NEG_Z * (HANDLE + half.z)),
    };
    HeldBy { offset, reach: 0.5 * hand.unit, ..HeldBy::new(in_hand) }
}

/// Gives a hand's tool its shape.
fn shape(mut tools: Query<(&InHand, &mut HeldBy, &mut SculptTool, &Mesh3d), Changed<InHand>>, mut meshes: ResMut<Assets<Mesh>>) {
    for (hand, mut place, mut tool, mesh) in &mut tools {
        tool.shape = hand.shape();
        tool.contact = if hand.kind == ToolKind::Knife { Contact::Slip } else { Contact::default() };
        *place = HeldBy { is_away: place.is_away, ..held(place.hand, hand) };
        // Fails only for a mesh that is gone, which its handle rules out.
        let _ = meshes.insert(&mesh.0, hand.mesh());
    }
}

const FREE: Color = Color::srgba(0.35, 0.55, 0.75, 0.45);
const TOUCHING: Color = Color::srgba(0.95, 0.62, 0.20, 0.55);

/// Tints tools that touch clay, and hides those that no hand holds.
fn tint(mut tools: Query<(Ref<ToolForce>, &HeldBy, &mut Visibility, Worn)>, mut looks: Looks) {
    for (force, held, mut visibility, worn) in &mut tools {
        visibility.set_if_neq(if held.is_away { Visibility::Hidden } else { Visibility::Inherited });
        if force.is_changed() {
            looks.recolour(worn, if force.contacts > 0 { TOUCHING } else { FREE });
        }
    }
}

/// Where no headset sets the pace, the app does not run as fast as it can.
fn rest(status: Res<XrStatus>) {
    if matches!(status.phase, XrPhase::None | XrPhase::Idle) {
        std::thread::sleep(Duration::from_millis(10));
    }
}
