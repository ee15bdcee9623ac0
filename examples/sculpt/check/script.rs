//! A stroke made by itself, with the pointer that the mouse moves. It goes by the clay's own time, however
//! slow the machine.

use super::strokes::Strokes;
use crate::pointer::{Aim, Pointer, ball, point};
use crate::view::Orbit;
use bevy::prelude::*;
use bevy_clay::prelude::*;

/// How long the tool stays pressed once it is as deep as it goes, in the clay's own time \[s\]: soft clay has
/// made way and is at rest by then.
const HOLDING: f64 = 0.01;

/// Presses the middle of the clay.
pub(super) struct ScriptPlugin;

impl Plugin for ScriptPlugin {
    fn build(&self, app: &mut App) {
        // What the mouse says is written over.
        app.init_resource::<Script>().add_systems(Update, play.after(point).before(ClaySystems::Report));
    }
}

/// Where the script is.
#[derive(Resource, Debug, Default)]
enum Script {
    #[default]
    Waiting,
    Pressing(Aim),
    /// The tool is as deep as it goes since this time of the clay \[s\].
    Holding(Aim, f64),
    LetGo,
}

/// Points at the middle of the clay, presses, lets go.
fn play(
    eyes: Query<(Entity, &GlobalTransform), With<Orbit>>,
    clay: Query<(&ClaySurface, &ClayMetrics)>,
    strokes: Res<Strokes>,
    mut script: ResMut<Script>,
    mut pointer: ResMut<Pointer>,
) {
    *pointer = Pointer::default();
    let (Some((camera, place)), Ok((surface, metrics))) = (eyes.iter().next(), clay.single()) else { return };
    match *script {
        Script::Waiting => {
            let Some((middle, _)) = ball(surface) else { return };
            let origin = place.translation();
            let Ok(direction) = Dir3::new(middle - origin) else { return };
            let ray = Ray3d { origin, direction };
            *script = Script::Pressing(Aim { ray, right: *place.right(), forward: *place.forward() });
        }
        Script::Pressing(aim) if strokes.is_deep() => *script = Script::Holding(aim, metrics.time),
        Script::Holding(_, since) if metrics.time > since + HOLDING => *script = Script::LetGo,
        _ => {}
    }
    if let Script::Pressing(aim) | Script::Holding(aim, _) = *script {
        *pointer = Pointer { camera: Some(camera), aim: Some(aim), is_down: true };
    }
}
