//! The tool's entity: its shape, its look, and where the clay has it in slow motion.

use crate::hand::Hand;
use crate::looks::{Looks, Worn};
use crate::stroke;
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use bevy_clay::prelude::*;

/// Spawns the tool, gives it the hand's shape, shows what the clay makes of it.
pub(crate) struct ToolPlugin;

impl Plugin for ToolPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Startup, spawn)
            .add_systems(Update, shape.before(stroke::hover).in_set(ClaySystems::Tool))
            .add_systems(Update, (tint, late).after(ClaySystems::Show));
    }
}

/// The entity of the tool in hand.
#[derive(Component)]
#[require(SculptTool, NotShadowCaster)]
pub(crate) struct InHand;

/// The tool as the clay has it: in slow motion it is behind the hand.
#[derive(Component)]
#[require(NotShadowCaster)]
struct InClay;

const FREE: Color = Color::srgba(0.35, 0.55, 0.75, 0.40);
const TOUCHING: Color = Color::srgba(0.95, 0.62, 0.20, 0.50);
const LATE: Color = Color::srgba(0.95, 0.62, 0.20, 0.25);

/// Makes the tool's entity, and that of the tool as the clay has it.
fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut looks: Looks) {
    let hand = Hand::default();
    let material = StandardMaterial {
        base_color: FREE,
        alpha_mode: AlphaMode::Blend,
        perceptual_roughness: 0.4,
        double_sided: true,
        ..default()
    };
    let mesh = meshes.add(hand.mesh());
    let mut late = commands.spawn((InClay, Name::new("tool as the clay has it"), Mesh3d(mesh.clone()), Visibility::Hidden));
    looks.put(&mut late, StandardMaterial { base_color: LATE, ..material.clone() });
    let mut tool = commands.spawn((
        InHand,
        Name::new("tool"),
        SculptTool { is_active: false, ..default() },
        Mesh3d(mesh),
        Visibility::Hidden,
    ));
    looks.put(&mut tool, material);
}

/// Gives the entity the shape of the tool in hand.
fn shape(hand: Res<Hand>, tool: Single<(&mut SculptTool, &Mesh3d), With<InHand>>, mut meshes: ResMut<Assets<Mesh>>) {
    let (mut tool, mesh) = tool.into_inner();
    let wanted = hand.shape();
    if tool.shape != wanted {
        tool.shape = wanted;
        // Fails only for a mesh that is gone, which its handle rules out.
        let _ = meshes.insert(&mesh.0, hand.mesh());
    }
}

/// The tool in hand, and not its picture.
type HandOnly = (With<InHand>, Without<InClay>);

/// Draws the tool where the clay has it, while that is elsewhere than in the hand.
fn late(
    hand: Single<(Entity, &Transform), HandOnly>,
    late: Single<(&mut Transform, &mut Visibility), With<InClay>>,
    clay: Query<(&ClayEngine, &GlobalTransform)>,
) {
    /// Less is not seen \[m\].
    const APART: f32 = 0.0005;
    let (tool, held) = *hand;
    let (mut late, mut visibility) = late.into_inner();
    let pose = clay.single().ok().and_then(|(engine, place)| Some((engine.tool_pose(tool)?, place)));
    let is_seen = pose.is_some_and(|(pose, place)| {
        let position = place.transform_point(pose.position.as_vec3());
        let rotation = place.rotation() * pose.rotation.as_quat();
        late.set_if_neq(Transform { translation: position, rotation, scale: held.scale });
        position.distance(held.translation) > APART
    });
    visibility.set_if_neq(if is_seen { Visibility::Visible } else { Visibility::Hidden });
}

/// Tints the tool while it touches clay.
fn tint(tool: Single<(&ToolForce, Worn), With<InHand>>, mut looks: Looks, mut was_touching: Local<bool>) {
    let (force, worn) = tool.into_inner();
    let is_touching = force.contacts > 0;
    if is_touching != *was_touching {
        looks.recolour(worn, if is_touching { TOUCHING } else { FREE });
        *was_touching = is_touching;
    }
}
