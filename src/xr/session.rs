//! The session: whether the headset is on, and what an app needs for it.

use super::hand::XrControllers;
use bevy::prelude::*;
use bevy::window::{PresentMode, PrimaryWindow};
use bevy::winit::{UpdateMode, WinitSettings};
use bevy_mod_openxr::poll_events::OxrEventIn;
use bevy_mod_xr::camera::{XrCamera, XrProjection};
use bevy_mod_xr::session::{XrCreateSessionMessage, XrSessionDestroyedMessage};

/// How far the session is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
pub enum XrPhase {
    /// There is none.
    #[default]
    None,
    /// It begins or ends: nothing is shown.
    Idle,
    /// Frames go to the headset, which does not show them yet.
    Synchronized,
    /// The headset shows the app, and its hands belong to somebody else: a system menu is open.
    Visible,
    /// The headset and its hands are the app's.
    Focused,
}

/// The session as the runtime tells of it.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource)]
pub struct XrStatus {
    /// How far it is.
    pub phase: XrPhase,
    /// Sessions that have come so far to [`XrPhase::Focused`].
    pub focused_count: u32,
}

/// Whether the session goes because the runtime loses it: a headset that was unplugged, or another screen.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub(super) struct IsLoss(bool);

/// Listens to the runtime.
pub(super) fn listen(event: OxrEventIn, mut status: ResMut<XrStatus>, mut is_loss: ResMut<IsLoss>) {
    let openxr::Event::SessionStateChanged(change) = *event else { return };
    let state = change.state();
    let phase = match state {
        openxr::SessionState::SYNCHRONIZED => XrPhase::Synchronized,
        openxr::SessionState::VISIBLE => XrPhase::Visible,
        openxr::SessionState::FOCUSED => XrPhase::Focused,
        openxr::SessionState::EXITING | openxr::SessionState::LOSS_PENDING => XrPhase::None,
        _ => XrPhase::Idle,
    };
    is_loss.0 |= state == openxr::SessionState::LOSS_PENDING;
    if phase == XrPhase::Focused {
        status.focused_count += 1;
        info!("the headset and its hands are the app's");
    }
    status.phase = phase;
}

/// The runtime went away in the midst of a session: there is no headset any more, and the clay is as it was.
#[derive(Event, Clone, Copy, Debug, Default)]
pub struct RuntimeLost;

/// A session that its runtime left behind.
pub(super) fn lose(_: On<RuntimeLost>, mut status: ResMut<XrStatus>, mut controllers: ResMut<XrControllers>) {
    status.phase = XrPhase::None;
    *controllers = XrControllers::default();
}

/// A session has ended because its viewer or the app wanted it to. Another begins when the app writes
/// `XrCreateSessionMessage`.
#[derive(Event, Clone, Copy, Debug, Default)]
pub struct SessionEnded;

/// Begins anew where the runtime lost the session, and says so where it ended.
pub(super) fn come_back(
    mut destroyed: MessageReader<XrSessionDestroyedMessage>,
    mut is_loss: ResMut<IsLoss>,
    mut create: MessageWriter<XrCreateSessionMessage>,
    mut commands: Commands,
) {
    for _ in destroyed.read() {
        if std::mem::take(&mut is_loss.0) {
            create.write_default();
        } else {
            commands.trigger(SessionEnded);
        }
    }
}

/// The session is gone.
pub(super) fn end(mut status: ResMut<XrStatus>) {
    status.phase = XrPhase::None;
}

/// A window is drawn without waiting for its screen, and as often though the headset has the eyes: frames are
/// the headset's.
pub(super) fn set_window(mut windows: Query<&mut Window, With<PrimaryWindow>>, winit: Option<ResMut<WinitSettings>>) {
    for mut window in &mut windows {
        window.present_mode = PresentMode::AutoNoVsync;
    }
    if let Some(mut winit) = winit {
        *winit = WinitSettings { focused_mode: UpdateMode::Continuous, unfocused_mode: UpdateMode::Continuous };
    }
}

/// Nearest that an eye sees \[m\]: whoever sculpts leans in.
const NEAR: f32 = 0.02;

/// Lets eyes see what is near.
pub(super) fn bring_near(eye: On<Add, XrCamera>, mut cameras: Query<&mut Projection>) {
    let Ok(mut projection) = cameras.get_mut(eye.entity) else { return };
    if let Projection::Custom(custom) = &mut *projection
        && let Some(eye) = custom.get_mut::<XrProjection>()
    {
        eye.near = NEAR;
    }
}
