//! When the windows are drawn, and what of them: not while the last picture is still being drawn, for no more
//! than a share of the time, and when there is something new to see. Views that have not changed stay as they
//! are, and are drawn once more in full when they have not for a while and no clay is worked on; panels come
//! less often while a view changes. Between two pictures the app goes on: input is taken, clay is worked on.

use super::super::clay::{ClaySettings, MeshQuality};
use super::super::engine::ClayEngine;
use super::super::show::ClaySurface;
use super::super::status::ClayMetrics;
use super::plain::PlainLook;
use super::screens::{Due, Screens};
use super::settings::{ScreenCamera, SoftwareDrawing};
use bevy::prelude::*;
use bevy::render::view::screenshot::{Captured, Screenshot};
use bevy::window::RequestRedraw;
use std::time::{Duration, Instant};

pub(super) fn build(app: &mut App) {
    app.add_message::<RequestRedraw>()
        .add_message::<AssetEvent<Mesh>>()
        .add_message::<AssetEvent<StandardMaterial>>()
        .add_message::<AssetEvent<PlainLook>>()
        .add_systems(Last, decide);
}

/// What the eye sees change.
type Moved = Or<(Changed<GlobalTransform>, Changed<InheritedVisibility>, Changed<Mesh3d>, Changed<Camera>, Changed<Projection>)>;

/// Messages of something new to see.
type News<'w, 's> = (
    MessageReader<'w, 's, RequestRedraw>,
    MessageReader<'w, 's, AssetEvent<Mesh>>,
    MessageReader<'w, 's, AssetEvent<StandardMaterial>>,
    MessageReader<'w, 's, AssetEvent<PlainLook>>,
);

/// Least time between two pictures of what changes: more of them would take time from the clay and show
/// little.
const PERIOD: Duration = Duration::from_millis(45);
/// How long nothing has changed before the views are drawn in full.
const STILL: Duration = Duration::from_millis(500);
/// The same while clay is worked on. A frame of it may take longer than [`STILL`]; a picture in full between
/// every two would take the time that the next one needs: with them a knife was 127 s on its way, not 49.
const WORKED: Duration = Duration::from_secs(4);

/// What is new since the last picture.
#[derive(Debug, Default)]
pub(super) struct Stale {
    /// Clay.
    is_clay: bool,
    /// Anything in a view.
    is_view: bool,
    /// Panels or texts ask for it.
    is_asked: bool,
    /// When a view changed last.
    moved: Option<Instant>,
    /// Whether clay is worked on.
    is_worked: bool,
    /// When panels were drawn last.
    panels: Option<Instant>,
}

impl Stale {
    /// Whether nothing has changed for a while.
    fn is_still(&self, now: Instant) -> bool {
        let patience = if self.is_worked { WORKED } else { STILL };
        self.moved.is_none_or(|moved| now.saturating_duration_since(moved) >= patience)
    }

    /// What is worth drawing after a picture that was `before`, of what is asked for and allowed.
    fn due(&self, before: Due, now: Instant, settings: &SoftwareDrawing) -> Due {
        let since = self.panels.map_or(f32::INFINITY, |panels| now.saturating_duration_since(panels).as_secs_f32());
        let is_still = self.is_still(now);
        let is_view = self.is_view || is_still && !before.is_still;
        let is_panels = since >= settings.refresh || if is_view { since >= settings.panel_interval } else { self.is_asked };
        Due { is_any: is_view || is_panels, is_view, is_panels, is_still: if is_view { is_still } else { before.is_still } }
    }
}

/// Pictures that are asked for.
type Wanted = (With<Screenshot>, Without<Captured>);

/// Decides what of the windows is drawn in this frame.
fn decide(
    settings: Res<SoftwareDrawing>,
    (moved, wanted): (Query<(), Moved>, Query<(), Wanted>),
    surfaces: Query<(), Changed<ClaySurface>>,
    clays: Query<(&ClayEngine, &ClaySettings, &ClayMetrics, Option<&ClaySurface>)>,
    mut news: News,
    mut stale: Local<Stale>,
    (mut screens, mut cameras): (ResMut<Screens>, Query<&mut ScreenCamera>),
) {
    /// Longest time for which a picture waits for clay that is being worked on.
    const PATIENCE: Duration = Duration::from_millis(100);
    let now = Instant::now();
    let assets = news.1.read().count() + news.2.read().count() + news.3.read().count();
    let is_new = !surfaces.is_empty() || !moved.is_empty() || assets > 0 || settings.is_changed();
    if is_new || screens.are_resized || screens.meter.is_incomplete() {
        stale.is_view = true;
        stale.moved = Some(now);
    }
    stale.is_worked = clays.iter().any(|clay| is_under_way(clay) && !clay.2.is_resting);
    stale.is_clay |= !surfaces.is_empty();
    stale.is_asked |= news.0.read().count() > 0;
    let age = screens.meter.age(now);
    // Between a press and its answer what moves beside the clay is not worth a picture: it would hold the
    // answer up.
    let is_awaited = !stale.is_clay && age.is_some_and(|age| age < PATIENCE) && clays.iter().any(is_under_way);
    let is_free = age.is_none_or(|age| age >= PERIOD) && screens.meter.has_time(now, settings.share);
    let before = Due { is_any: false, ..screens.due };
    screens.due = match stale.due(before, now, &settings) {
        _ if !wanted.is_empty() => Due { is_any: true, is_view: true, is_panels: true, is_still: stale.is_still(now) },
        due if is_free && !is_awaited => due,
        _ => before,
    };
    let due = screens.due;
    if due.is_any && !screens.windows.is_empty() {
        screens.meter.begin(now, !(due.is_view && due.is_still));
        screens.are_resized = false;
        stale.is_clay &= !due.is_view;
        stale.is_view &= !due.is_view;
        if due.is_panels {
            (stale.is_asked, stale.panels) = (false, Some(now));
        }
        cameras.iter_mut().for_each(|mut camera| camera.picture_count += u64::from(due.is_view));
    }
}

/// Whether there will soon be another surface.
fn is_under_way((engine, settings, _, surface): (&ClayEngine, &ClaySettings, &ClayMetrics, Option<&ClaySurface>)) -> bool {
    let is_shown = settings.mesh != MeshQuality::Off;
    is_shown && (engine.pending() > 0 || surface.is_some_and(|surface| surface.revision() != engine.revision()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A view that changes is drawn at once, panels beside it now and then; once nothing has changed for a
    /// while it is drawn in full, one time, and panels alone from then on, when they ask for it.
    #[test]
    fn views_are_drawn_when_they_change() {
        let (settings, start) = (SoftwareDrawing::default(), Instant::now());
        let at = |ms: u64| start + Duration::from_millis(ms);
        let due = |is_view, is_panels, is_still| Due { is_any: is_view || is_panels, is_view, is_panels, is_still };
        let mut stale = Stale { is_view: true, is_asked: true, moved: Some(start), ..Stale::default() };
        let first = stale.due(Due::default(), start, &settings);
        assert_eq!(first, due(true, true, false));
        stale.panels = Some(start);
        assert_eq!(stale.due(first, at(100), &settings), due(true, false, false), "panels wait, though they ask");
        assert_eq!(stale.due(first, at(201), &settings), due(true, true, false));
        stale = Stale { is_view: false, is_asked: false, ..stale };
        assert_eq!(stale.due(first, at(499), &settings), due(false, false, false), "nothing is new");
        stale.is_worked = true;
        assert_eq!(stale.due(first, at(510), &settings), due(false, true, false), "clay is worked on");
        assert!(stale.is_still(at(4000)), "it looks the same for long");
        stale.is_worked = false;
        let still = stale.due(first, at(510), &settings);
        assert_eq!(still, due(true, true, true), "all pixels");
        stale.panels = Some(at(510));
        assert_eq!(stale.due(still, at(900), &settings), due(false, false, true), "it stays");
        assert_eq!(stale.due(still, at(1011), &settings), due(false, true, true), "panels are looked after");
        stale.is_asked = true;
        assert_eq!(stale.due(still, at(520), &settings), due(false, true, true), "panels ask");
        stale = Stale { is_view: true, moved: Some(at(2000)), ..stale };
        assert_eq!(stale.due(still, at(2000), &settings), due(true, true, false), "it moves again");
    }
}
