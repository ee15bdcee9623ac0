//! A haptic arm's tool: a ball beside the mouse's tool, where the hand leads it.

use crate::looks::Looks;
use crate::start::Extent;
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath, Operator};
use bevy_clay::haptics::servo::{ForceScale, Placement};
use bevy_clay::prelude::*;
use clap::ValueEnum;
use glam::DVec3;

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
pub(crate) struct ArmPlugin(pub(crate) ArmArg);

impl Plugin for ArmPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(Chosen(self.0)).add_systems(Startup, spawn).add_systems(Update, show.after(ClaySystems::Show));
    }
}

#[derive(Resource)]
struct Chosen(ArmArg);

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
    (chosen, extent): (Res<Chosen>, Res<Extent>),
    mut looks: Looks,
    mut meshes: ResMut<Assets<Mesh>>,
    mut commands: Commands,
) {
    let radius = RADIUS * f64::from(extent.radius);
    // The device's origin lies on the clay.
    let top = 2.0 * extent.middle.y - extent.floor;
    let position = extent.middle.with_y(top).as_dvec3();
    let hand = SimulatedHand { arm: ArmSettings { operator: Operator::STYLUS, ..default() }, path: path(radius) };
    let settings = HapticSettings {
        device: if chosen.0 == ArmArg::Touch { ArmChoice::Touch } else { ArmChoice::Simulated },
        simulated: hand,
        force: ForceScale { gain: GAIN, ..default() },
        placement: Placement { position, ..default() },
        ..default()
    };
    let mut tool = commands.spawn((
        Name::new("tool of the arm"),
        SculptTool::new(ToolShape::Sphere { radius }),
        settings,
        Transform::from_translation(extent.middle.with_y(top + extent.radius)),
        Mesh3d(meshes.add(Sphere::new(radius as f32))),
        NotShadowCaster,
        Visibility::Hidden,
    ));
    let colour = Color::srgba(0.35, 0.65, 0.45, 0.5);
    looks.put(&mut tool, StandardMaterial { base_color: colour, alpha_mode: AlphaMode::Blend, ..default() });
}

/// Shows the tool once it is in a hand.
fn show(session: Res<HapticSession>, mut tools: Query<&mut Visibility>) {
    let is_held = matches!(session.phase(), HapticPhase::Arm | HapticPhase::StandIn);
    if let Some(mut visibility) = session.tool().and_then(|tool| tools.get_mut(tool).ok()) {
        visibility.set_if_neq(if is_held { Visibility::Inherited } else { Visibility::Hidden });
    }
}
