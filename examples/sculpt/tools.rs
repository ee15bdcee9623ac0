//! The tools of the hand: their shapes, how they stand on the clay, how they are drawn.

use crate::pick::Hit;
use bevy::light::NotShadowCaster;
use bevy::prelude::*;
use bevy_clay::prelude::*;

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

/// The tool in hand.
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
    fn half(&self) -> Vec3 {
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

    fn shape(&self) -> ToolShape {
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

    fn mesh(&self) -> Mesh {
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

/// The entity of the tool in hand.
#[derive(Component)]
pub(crate) struct InHand;

/// The tool as the clay has it: in slow motion it is behind the hand.
#[derive(Component)]
pub(crate) struct InClay;

const FREE: Color = Color::srgba(0.35, 0.55, 0.75, 0.40);
const TOUCHING: Color = Color::srgba(0.95, 0.62, 0.20, 0.50);

const LATE: Color = Color::srgba(0.95, 0.62, 0.20, 0.25);

/// Makes the tool's entity, and that of the tool as the clay has it.
pub(crate) fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    let hand = Hand::default();
    let material = StandardMaterial {
        base_color: FREE,
        alpha_mode: AlphaMode::Blend,
        perceptual_roughness: 0.4,
        double_sided: true,
        ..default()
    };
    let mesh = meshes.add(hand.mesh());
    commands.spawn((
        InClay,
        Name::new("tool as the clay has it"),
        Mesh3d(mesh.clone()),
        MeshMaterial3d(materials.add(StandardMaterial { base_color: LATE, ..material.clone() })),
        Visibility::Hidden,
        NotShadowCaster,
    ));
    commands.spawn((
        InHand,
        Name::new("tool"),
        SculptTool { is_active: false, ..default() },
        Mesh3d(mesh),
        MeshMaterial3d(materials.add(material)),
        Visibility::Hidden,
        NotShadowCaster,
    ));
}

/// Gives the entity the shape of the tool in hand.
pub(crate) fn shape(hand: Res<Hand>, tool: Single<(&mut SculptTool, &Mesh3d), With<InHand>>, mut meshes: ResMut<Assets<Mesh>>) {
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
pub(crate) fn late(
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
pub(crate) fn tint(
    tool: Single<(&ToolForce, &MeshMaterial3d<StandardMaterial>), With<InHand>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut was_touching: Local<bool>,
) {
    let (force, material) = tool.into_inner();
    let is_touching = force.contacts > 0;
    if is_touching != *was_touching
        && let Some(mut material) = materials.get_mut(&material.0)
    {
        material.base_color = if is_touching { TOUCHING } else { FREE };
        *was_touching = is_touching;
    }
}
