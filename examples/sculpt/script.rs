//! A stroke made by itself, on the way that the mouse takes: for checks where nobody holds a mouse.

use crate::pick;
use crate::stroke::Pointer;
use crate::watch::Watch;
use bevy::prelude::*;
use bevy_clay::prelude::ClaySurface;
use std::time::{Duration, Instant};

/// How long the pointer hovers, then presses.
const HOVERING: Duration = Duration::from_millis(500);
const PRESSING: Duration = Duration::from_millis(2500);

/// Where the script is.
#[derive(Resource, Debug, Default)]
pub(crate) enum Script {
    #[default]
    Waiting,
    Hovering(Instant),
    Pressing(Instant),
    Done,
}

/// Points at the middle of the clay, presses, lets go, ends the run.
#[expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]
pub(crate) fn play(
    camera: Single<&GlobalTransform, With<Camera3d>>,
    surface: Query<&ClaySurface>,
    mut script: ResMut<Script>,
    mut pointer: ResMut<Pointer>,
    mut watch: ResMut<Watch>,
) {
    pointer.is_scripted = true;
    let Some((middle, _)) = surface.single().ok().and_then(pick::ball) else { return };
    match *script {
        Script::Waiting => {
            let origin = camera.translation();
            pointer.ray = Dir3::new(middle - origin).ok().map(|direction| Ray3d { origin, direction });
            *script = Script::Hovering(Instant::now());
        }
        Script::Hovering(since) if since.elapsed() > HOVERING => {
            pointer.is_down = true;
            *script = Script::Pressing(Instant::now());
        }
        Script::Pressing(since) if since.elapsed() > PRESSING => {
            pointer.is_down = false;
            *script = Script::Done;
        }
        Script::Done => watch.is_over |= !watch.strokes.is_empty(),
        _ => {}
    }
}
