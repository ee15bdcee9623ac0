//! When the windows are drawn: not while the last picture is still being drawn, for no more than a share of
//! the time, and when there is something new to see. Between two pictures the app goes on: input is taken,
//! clay is worked on.

use super::super::clay::{ClaySettings, MeshQuality};
use super::super::engine::ClayEngine;
use super::super::show::ClaySurface;
use super::screens::Screens;
use super::settings::{ScreenCamera, SoftwareDrawing};
use bevy::prelude::*;
use bevy::render::view::screenshot::{Captured, Screenshot};
use bevy::window::RequestRedraw;
use std::time::{Duration, Instant};

pub(super) fn build(app: &mut App) {
    app.add_message::<RequestRedraw>()
        .add_message::<AssetEvent<Mesh>>()
        .add_message::<AssetEvent<StandardMaterial>>()
        .add_systems(Last, decide);
}

/// What the eye sees change.
type Moved = Or<(Changed<GlobalTransform>, Changed<InheritedVisibility>, Changed<Mesh3d>, Changed<Camera>, Changed<Projection>)>;

/// Messages of something new to see.
type News<'w, 's> = (
    MessageReader<'w, 's, RequestRedraw>,
    MessageReader<'w, 's, AssetEvent<Mesh>>,
    MessageReader<'w, 's, AssetEvent<StandardMaterial>>,
);

/// What is new since the last picture.
#[derive(Debug, Default)]
pub(super) struct Stale {
    is_any: bool,
    is_clay: bool,
}

/// Pictures that are asked for.
type Wanted = (With<Screenshot>, Without<Captured>);

/// Decides whether the windows are drawn in this frame.
fn decide(
    settings: Res<SoftwareDrawing>,
    (moved, wanted): (Query<(), Moved>, Query<(), Wanted>),
    surfaces: Query<(), Changed<ClaySurface>>,
    clays: Query<(&ClayEngine, &ClaySettings, Option<&ClaySurface>)>,
    mut news: News,
    mut stale: Local<Stale>,
    (mut screens, mut cameras): (ResMut<Screens>, Query<&mut ScreenCamera>),
) {
    /// Longest time for which a picture waits for clay that is being worked on.
    const PATIENCE: Duration = Duration::from_millis(250);
    let now = Instant::now();
    stale.is_clay |= !surfaces.is_empty();
    stale.is_any |= !moved.is_empty() | (news.0.read().count() + news.1.read().count() + news.2.read().count() > 0);
    let age = screens.meter.age(now);
    let is_old = age.is_none_or(|age| age.as_secs_f32() >= settings.refresh);
    // Between a press and its answer what moves beside the clay is not worth a picture: it would hold the
    // answer up.
    let is_awaited = !stale.is_clay && age.is_some_and(|age| age < PATIENCE) && clays.iter().any(is_under_way);
    let is_new = stale.is_clay || stale.is_any || is_old;
    screens.is_due = !wanted.is_empty() || is_new && !is_awaited && screens.meter.has_time(now, settings.share);
    if screens.is_due && !screens.windows.is_empty() {
        screens.meter.begin(now);
        *stale = Stale::default();
        cameras.iter_mut().for_each(|mut camera| camera.picture_count += 1);
    }
}

/// Whether there will soon be another surface.
fn is_under_way((engine, settings, surface): (&ClayEngine, &ClaySettings, Option<&ClaySurface>)) -> bool {
    let is_shown = settings.mesh != MeshQuality::Off;
    is_shown && (engine.pending() > 0 || surface.is_some_and(|surface| surface.revision() != engine.revision()))
}
