//! What the solver has of clay and tools, drawn over them with Bevy's gizmos: for those who look for what is
//! wrong.

mod sketch;
mod wires;

use super::clay::Clay;
use super::engine::ClayEngine;
use super::held::HeldTime;
use super::space::ClaySpace;
use super::tool::{SculptTool, ToolForce};
use crate::sim::engine::StateLost;
use crate::sim::tool::{Pose, ToolShape};
use bevy::color::palettes::tailwind;
use bevy::gizmos::GizmoPlugin;
use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use bevy::transform::TransformSystems;
use sketch::Sketch;
use std::time::{Duration, Instant};

/// Blocks and cuts of a clay that changes are looked at anew this often.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// What [`ClayGizmosPlugin`] draws, and in which colour; a kind without one is not drawn. All of it is
/// switched by [`GizmoConfig::enabled`] of this group in the [`GizmoConfigStore`], and lies in front of all
/// else unless [`GizmoConfig::depth_bias`] is changed.
#[derive(Clone, Debug, PartialEq, Reflect, GizmoConfigGroup)]
#[reflect(Clone, Debug, Default, PartialEq)]
pub struct ClayGizmos {
    /// Active tools, where the clay has them: in slow motion they are behind the hand.
    pub tools: Option<Color>,
    /// What the clays do to each tool, as an arrow: [`ToolForce::force`].
    pub forces: Option<Color>,
    /// Where that force pushes the tool: the point of its surface against the force, or a blade's origin.
    pub contacts: Option<Color>,
    /// Outer edges of the blocks of 4^3 cells that hold particles.
    pub blocks: Option<Color>,
    /// Nets through the particles at both sides of each cut that the clay keeps. This is the front of the
    /// first; others turn its hue, and backs are darker.
    pub cuts: Option<Color>,
    /// Length of an arrow in the world \[m/N\].
    pub metres_per_newton: f32,
}

impl Default for ClayGizmos {
    fn default() -> Self {
        Self {
            tools: Some(tailwind::SKY_300.into()),
            forces: Some(tailwind::RED_500.into()),
            contacts: Some(tailwind::YELLOW_300.into()),
            blocks: Some(tailwind::GRAY_400.with_alpha(0.35).into()),
            cuts: Some(tailwind::LIME_400.into()),
            metres_per_newton: 0.01,
        }
    }
}

/// Draws [`ClayGizmos`] in PostUpdate, in apps that ask for it: it is in no group. Needs Bevy's
/// [`GizmoPlugin`], which `DefaultPlugins` hold, before it, and [`ClayPlugins`](super::ClayPlugins); an app
/// without the first is told so once and goes on. For pictures Bevy's feature `bevy_gizmos_render` has to be
/// on.
///
/// While blocks or cuts are drawn, the particles of clay that changes are gone through on another thread,
/// four times a second at most.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClayGizmosPlugin;

impl Plugin for ClayGizmosPlugin {
    fn build(&self, app: &mut App) {
        if !app.is_plugin_added::<GizmoPlugin>() {
            warn!("ClayGizmosPlugin draws nothing: add Bevy's GizmoPlugin before it");
            return;
        }
        if app.world().get_resource::<GizmoConfigStore>().and_then(|store| store.get_config::<ClayGizmos>()).is_none() {
            // Most of what is drawn is inside the clay.
            let config = GizmoConfig { depth_bias: -1.0, ..default() };
            app.insert_gizmo_config(ClayGizmos::default(), config);
        }
        app.register_type::<ClayGizmos>().register_required_components::<Clay, Sketched>();
        app.add_observer(end).add_systems(PostUpdate, (look, draw).chain().after(TransformSystems::Propagate));
    }
}

/// Goes through the particles; of a state that went with its device nothing comes.
type Looking = Task<Result<Sketch, StateLost>>;

/// What is known of a clay's blocks and cuts.
#[derive(Component, Default)]
struct Sketched {
    /// The revision of the clay, and its lines.
    found: Option<((u64, u64), Sketch)>,
    under_way: Option<((u64, u64), Looking)>,
    looked: Option<Instant>,
}

/// Forgets a [`Clay`] that goes.
fn end(gone: On<Remove, Clay>, mut commands: Commands) {
    commands.entity(gone.entity).try_remove::<Sketched>();
}

/// Has the particles of clay that changed gone through away from the main thread, if they are to be drawn.
fn look(mut clays: Query<(&ClayEngine, &mut Sketched), With<Clay>>, store: Res<GizmoConfigStore>, held: Res<HeldTime>) {
    let _watch = held.watch();
    let (config, group) = store.config::<ClayGizmos>();
    let is_wanted = config.enabled && (group.blocks.is_some() || group.cuts.is_some());
    for (engine, mut sketched) in &mut clays {
        let sketched = sketched.bypass_change_detection();
        if !is_wanted {
            *sketched = Sketched::default();
            continue;
        }
        if let Some((revision, task)) = &mut sketched.under_way
            && let Some(sketch) = check_ready(task)
        {
            // What is lost with its device is looked for again.
            if let Ok(sketch) = sketch {
                sketched.found = Some((*revision, sketch));
            }
            sketched.under_way = None;
        }
        let revision = engine.revision();
        let is_due = sketched.looked.is_none_or(|at| at.elapsed() >= LOOK_EVERY);
        if is_due
            && sketched.under_way.is_none()
            && engine.is_readable()
            && sketched.found.as_ref().is_none_or(|(found, _)| *found != revision)
            && let Some(make) = engine.surface_deferred()
        {
            let task = AsyncComputeTaskPool::get().spawn(async move { make().map(|source| Sketch::new(&source)) });
            sketched.under_way = Some((revision, task));
            sketched.looked = Some(Instant::now());
        }
    }
}

/// Clay as it is drawn.
type Drawn<'a> = (Entity, &'a ClayEngine, &'a Sketched, &'a GlobalTransform);

/// Draws what there is.
fn draw(
    clays: Query<Drawn, With<Clay>>,
    tools: Query<(Entity, &SculptTool, &ToolForce, &GlobalTransform)>,
    mut gizmos: Gizmos<ClayGizmos>,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let group = gizmos.config_ext;
    for (_, engine, sketched, transform) in &clays {
        if let Some(((generation, _), sketch)) = &sketched.found
            && *generation == engine.revision().0
        {
            draw_sketch(sketch, transform, group, &mut gizmos);
        }
    }
    for (entity, tool, force, transform) in tools.iter().filter(|(_, tool, ..)| tool.is_active) {
        // What cannot be is said in the tool's status.
        let Ok(hand) = ClaySpace::named("tool transform", transform) else { continue };
        let shape = tool.shape.scaled(hand.scale);
        let in_clay = |(clay, engine, _, transform): (Entity, &ClayEngine, _, &GlobalTransform)| {
            Some((clay, ClaySpace::new(transform).ok()?.pose_to_world(engine.tool_pose(entity)?)))
        };
        let mut poses: Vec<(Entity, Pose)> = clays.iter().filter_map(in_clay).collect();
        // The first is where the force is drawn.
        poses.sort_by_key(|(clay, _)| (Some(*clay) != force.clay, *clay));
        let at = poses.first().map_or(hand.pose, |(_, pose)| *pose);
        poses.is_empty().then(|| draw_tool(&shape, at, group, &mut gizmos));
        poses.iter().for_each(|(_, pose)| draw_tool(&shape, *pose, group, &mut gizmos));
        if force.contacts > 0 {
            draw_force(&shape, at, force.force, group, &mut gizmos);
        }
    }
}

/// Draws blocks and cuts of a clay.
fn draw_sketch(sketch: &Sketch, transform: &GlobalTransform, group: &ClayGizmos, gizmos: &mut Gizmos<ClayGizmos>) {
    let mut lines = |lines: &[sketch::Line], colour: Color| {
        let to_world = |p: Vec3| transform.transform_point(p);
        lines.iter().for_each(|&[a, b]| gizmos.line(to_world(a), to_world(b), colour));
    };
    if let Some(colour) = group.blocks {
        lines(&sketch.blocks, colour);
    }
    if let Some(colour) = group.cuts {
        sketch.cuts.iter().for_each(|side| lines(&side.lines, side_colour(colour, side.sheet, side.is_front)));
    }
}

/// The colour of a side of a sheet.
fn side_colour(first: Color, sheet: u8, is_front: bool) -> Color {
    /// Far from those of the sheets before \[degrees\].
    const GOLDEN_ANGLE: f32 = 137.508;
    const BACK: f32 = 0.6;
    let first = Oklcha::from(first);
    let hue = (first.hue + GOLDEN_ANGLE * f32::from(sheet.saturating_sub(1))).rem_euclid(360.0);
    let lightness = if is_front { first.lightness } else { BACK * first.lightness };
    Oklcha { hue, lightness, ..first }.into()
}

/// Draws the wires of a shape in the world.
fn draw_tool(shape: &ToolShape, at: Pose, group: &ClayGizmos, gizmos: &mut Gizmos<ClayGizmos>) {
    let Some(colour) = group.tools else { return };
    for wire in wires::of_shape(shape) {
        gizmos.linestrip(wire.into_iter().map(|p| at.to_world(p).as_vec3()), colour);
    }
}

/// Draws a force on a shape in the world, and where it pushes.
fn draw_force(shape: &ToolShape, at: Pose, force: Vec3, group: &ClayGizmos, gizmos: &mut Gizmos<ClayGizmos>) {
    /// Of the shape's radius.
    const CROSS: f64 = 0.15;
    let touched = wires::touched(shape, at.rotation.inverse() * force.as_dvec3());
    let touched = at.to_world(touched).as_vec3();
    if let Some(colour) = group.contacts {
        gizmos.cross(touched, (CROSS * shape.bounding_radius()) as f32, colour);
    }
    if let Some(colour) = group.forces {
        let arrow = force * group.metres_per_newton;
        gizmos.arrow(touched, touched + arrow, colour).with_tip_length(0.2 * arrow.length());
    }
}
