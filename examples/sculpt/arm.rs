//! A haptic arm's tool: a ball beside the mouse's tool or those of a headset's hands, where the arm's hand
//! leads it.

use crate::args::Args;
use crate::looks::Looks;
use crate::say;
use crate::start::Extent;
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath, Operator};
use bevy_clay::haptics::servo::{ForceScale, Placement};
use bevy_clay::prelude::*;
use bevy_clay::scene::placement::PlacementFile;
use clap::ValueEnum;
use glam::DVec3;
use std::path::PathBuf;

/// Which arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ArmArg {
    /// A hand that is calculated, and goes to and fro in the clay.
    Simulated,
    /// A 3D Systems Touch, if there is one; the simulated one else.
    Touch,
}

/// Radius of the ball over that of the clay's ball.
const RADIUS: f64 = 0.2;
/// Force felt over that of the clay: a ball of 7 mm meets 3 N where it is 3 mm deep in soft clay, more than
/// an arm gives.
const GAIN: f64 = 0.3;
/// How deep the simulated hand means to go, and how far to either side, over the ball's radius.
const DEPTH: f64 = 0.5;
const REACH: f64 = 1.5;
/// How long a groove takes \[s\], and how many there are.
const GROOVE: f64 = 2.0;
const GROOVES: u32 = 5;

/// Puts a tool into the arm's hand.
#[derive(Resource, Clone, Copy)]
pub(crate) struct ArmPlugin {
    pub(crate) arm: ArmArg,
    /// Where the device stands, if somebody said it.
    pub(crate) placement: Option<Placement>,
    /// How much larger than it is the clay is shown.
    pub(crate) scale: f32,
}

impl ArmPlugin {
    /// What the command line asks for, beside clay that is shown so much larger. A placement that cannot be
    /// read is told in a line, and the arm stands by the clay.
    pub(crate) fn of(args: &Args, scale: f32) -> Option<Self> {
        let arm = args.arm?;
        let read = |file: &PathBuf| {
            let told = |error| say::error(&format!("{error}; the arm stands by the clay"));
            PlacementFile::load(file).map_err(told).ok()
        };
        Some(Self { arm, placement: args.placement.as_ref().and_then(read), scale })
    }
}

impl Plugin for ArmPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(*self).add_systems(Startup, spawn).add_systems(Update, show.after(ClaySystems::Show));
        if self.placement.is_none() {
            app.add_systems(Update, stand_by.after(ClaySystems::Tool));
        }
    }
}

/// How long the simulated hand takes \[s\].
pub(crate) fn duration() -> f64 {
    GROOVE * f64::from(GROOVES)
}

/// Down beside the middle, along, up and back, again and again.
fn path(radius: f64) -> HandPath {
    let (reach, high, low) = (REACH * radius, 2.0 * radius, radius - DEPTH * radius);
    let groove = |i: u32| {
        let (start, z) = (f64::from(i) * GROOVE, (f64::from(i) / f64::from(GROOVES - 1) - 0.5) * radius);
        [(0.0, -reach, high), (0.5, -reach, low), (1.5, reach, low), (1.75, reach, high)]
            .map(|(time, x, y)| (start + time, DVec3::new(x, y, z)))
    };
    HandPath::new((0..GROOVES).flat_map(groove))
}

fn spawn(
    (chosen, extent): (Res<ArmPlugin>, Res<Extent>),
    mut looks: Looks,
    mut meshes: ResMut<Assets<Mesh>>,
    mut commands: Commands,
) {
    let radius = RADIUS * f64::from(extent.radius * chosen.scale);
    let hand = SimulatedHand { arm: ArmSettings { operator: Operator::STYLUS, ..default() }, path: path(radius) };
    let settings = HapticSettings {
        device: if chosen.arm == ArmArg::Touch { ArmChoice::Touch } else { ArmChoice::Simulated },
        simulated: hand,
        force: ForceScale { gain: GAIN, ..default() },
        placement: chosen.placement.unwrap_or_else(|| by(&extent, &Transform::from_scale(Vec3::splat(chosen.scale)), 1.0)),
        ..default()
    };
    let mut tool = commands.spawn((
        Name::new("tool of the arm"),
        SculptTool::new(ToolShape::Sphere { radius }),
        settings,
        Mesh3d(meshes.add(Sphere::new(radius as f32))),
        NotShadowCaster,
        Visibility::Hidden,
    ));
    let colour = Color::srgba(0.35, 0.65, 0.45, 0.5);
    looks.put(&mut tool, StandardMaterial { base_color: colour, alpha_mode: AlphaMode::Blend, ..default() });
}

/// A device whose origin lies on the clay, which is at `clay`.
fn by(extent: &Extent, clay: &Transform, scale: f64) -> Placement {
    let top = extent.middle.with_y(2.0 * extent.middle.y - extent.floor);
    Placement { position: clay.transform_point(top).as_dvec3(), rotation: clay.rotation.as_dquat().normalize(), scale }
}

/// How long work that was carried stays where it is before the arm's tool touches it again \[s\].
const STILL: f64 = 0.3;

/// An arm of which nobody has said where it stands goes with the clay, until the panel says it. Its tool is
/// off the clay meanwhile: device and clay are not moved in the same instant, and it would plough.
fn stand_by(
    (extent, time): (Res<Extent>, Res<Time<Real>>),
    clay: Single<Ref<Transform>, With<Clay>>,
    mut tools: Query<(&mut HapticSettings, &mut SculptTool)>,
    mut last: Local<Option<(Placement, f64)>>,
) {
    let now = time.elapsed_secs_f64();
    for (mut settings, mut tool) in &mut tools {
        let Placement { position, rotation, scale } = settings.placement;
        let is_ours = last.is_none_or(|(last, _)| (last.position, last.rotation) == (position, rotation));
        if clay.is_changed() && is_ours {
            settings.placement = by(&extent, &clay, scale);
            *last = Some((settings.placement, now));
        }
        let is_active = !is_ours || last.is_none_or(|(_, moved)| now - moved > STILL);
        if tool.is_active != is_active {
            tool.is_active = is_active;
        }
    }
}

/// Shows the tool once it is in a hand.
fn show(session: Res<HapticSession>, mut tools: Query<&mut Visibility>) {
    let is_held = matches!(session.phase(), HapticPhase::Arm | HapticPhase::StandIn);
    if let Some(mut visibility) = session.tool().and_then(|tool| tools.get_mut(tool).ok()) {
        visibility.set_if_neq(if is_held { Visibility::Inherited } else { Visibility::Hidden });
    }
}
