//! A stroke made by itself, on the way that the mouse takes: for checks where nobody holds a mouse. It goes
//! by the clay's own time, however slow the machine.

use crate::pick;
use crate::stroke::{Pointer, Work};
use crate::watch::Watch;
use bevy::prelude::*;
use bevy_clay::prelude::*;

/// How long the tool stays pressed once it is as deep as it goes, in the clay's own time [s]: soft clay has
/// made way and is at rest by then.
const HOLDING: f64 = 0.01;

/// Where the script is.
#[derive(Resource, Debug, Default)]
pub(crate) enum Script {
    #[default]
    Waiting,
    Pressing,
    /// The tool is as deep as it goes since this time of the clay \[s\].
    Holding(f64),
    Done,
}

/// Points at the middle of the clay, presses, lets go, ends the run.
pub(crate) fn play(
    camera: Single<&GlobalTransform, With<Camera3d>>,
    clay: Query<(&ClaySurface, &ClayMetrics)>,
    work: Res<Work>,
    mut script: ResMut<Script>,
    mut pointer: ResMut<Pointer>,
    mut watch: ResMut<Watch>,
) {
    pointer.is_scripted = true;
    let Ok((surface, metrics)) = clay.single() else { return };
    let Some((middle, _)) = pick::ball(surface) else { return };
    match *script {
        Script::Waiting => {
            let origin = camera.translation();
            pointer.ray = Dir3::new(middle - origin).ok().map(|direction| Ray3d { origin, direction });
            pointer.is_down = true;
            *script = Script::Pressing;
        }
        Script::Pressing if work.stroke.as_ref().is_some_and(|stroke| stroke.is_deep) => *script = Script::Holding(metrics.time),
        Script::Holding(since) if metrics.time > since + HOLDING => {
            pointer.is_down = false;
            *script = Script::Done;
        }
        Script::Done => watch.is_over |= !watch.strokes.is_empty(),
        _ => {}
    }
}
