//! Sculpting in a headset, through an OpenXR runtime. Feature `xr`.
//!
//! | file        | takes                    | makes                                                       |
//! |-------------|--------------------------|-------------------------------------------------------------|
//! | [`runtime`] | -                        | whether there is a runtime; an app's plugins on it          |
//! | [`schedule`] | -                       | the stages of all this                                      |
//! | [`hand`]    | -                        | sides, hands, what a controller says                        |
//! | `profiles`  | -                        | the buttons of each kind of controller                      |
//! | [`session`] | events of the runtime    | [`XrStatus`](session::XrStatus); eyes that see what is near |
//! | `frames`    | the session              | frames for the headset; its end where the runtime goes      |
//! | `actions`   | profiles, the session    | [`XrControllers`](hand::XrControllers), late in the frame   |
//! | [`tool`]    | controllers              | poses of tools in hands                                     |
//! | [`grab`]    | controllers              | the work, moved and scaled                                  |
//! | [`place`]   | the head                 | the work, before it                                         |
//! | `undo`      | controllers              | strokes taken back                                          |
//! | [`panel`]   | controllers, egui        | the desktop's panels in a hand; tools mute before them      |
//! | [`vibration`] | forces on tools        | vibration of the controllers                                |
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_clay::prelude::*;
//! use bevy_clay::xr;
//!
//! App::new()
//!     .add_plugins((xr::runtime::plugins(DefaultPlugins), ClayPlugins, XrSculptPlugin))
//!     .add_systems(Startup, |mut commands: Commands| {
//!         commands.spawn((Clay::default(), ClayHistory::default(), WorkRoot));
//!         commands.spawn((SculptTool::ball(0.008), HeldBy::default()));
//!     })
//!     .run();
//! ```

mod actions;
mod frames;
pub mod grab;
pub mod hand;
#[cfg(feature = "inspector")]
pub mod panel;
pub mod place;
mod profiles;
pub mod runtime;
pub mod schedule;
pub mod session;
pub mod tool;
mod undo;
pub mod vibration;

use crate::plugin::schedule::ClaySystems;
use bevy::prelude::*;
use bevy_mod_openxr::action_binding::OxrSendActionBindings;
use bevy_mod_openxr::action_set_syncing::OxrActionSetSyncSet;
use bevy_mod_openxr::poll_events::OxrEventHandlerExt;
use bevy_mod_openxr::resources::OxrInstance;
use bevy_mod_openxr::{openxr_session_available, openxr_session_running};
use bevy_mod_xr::session::{XrPreDestroySession, XrSessionCreated};
use schedule::XrSystems;

/// What most programs need.
pub mod prelude {
    pub use super::XrSculptPlugin;
    pub use super::grab::WorkRoot;
    pub use super::hand::{Side, XrControllers, XrHand, XrHands};
    #[cfg(feature = "inspector")]
    pub use super::panel::XrPanelPlugin;
    pub use super::place::RecentreWork;
    pub use super::session::{RuntimeLost, SessionEnded, XrPhase, XrStatus};
    pub use super::tool::HeldBy;
}

/// Hands for clay: tools in them ([`HeldBy`](tool::HeldBy)), work that they move and scale
/// ([`WorkRoot`](grab::WorkRoot)), strokes that they take back. Added after [`runtime::plugins`] and
/// `ClayPlugins`; in an app without a runtime it does nothing but say so.
///
/// An app with actions of its own attaches them as it would without this plugin, by
/// `OxrAttachActionSet` in the schedule `XrSessionCreated`: a session takes all sets at once.
#[derive(Clone, Copy, Debug, Default)]
pub struct XrSculptPlugin;

impl Plugin for XrSculptPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<hand::XrHands>()
            .init_resource::<hand::XrControllers>()
            .init_resource::<grab::GrabSettings>()
            .init_resource::<place::WorkPlace>()
            .init_resource::<place::Awaited>()
            .init_resource::<session::XrStatus>()
            .init_resource::<session::IsLoss>()
            .init_resource::<vibration::VibrationSettings>()
            .init_resource::<vibration::VibrationCount>()
            .register_type::<vibration::VibrationSettings>()
            .register_type::<hand::XrHands>()
            .register_type::<grab::GrabSettings>()
            .register_type::<place::WorkPlace>()
            .register_type::<session::XrStatus>()
            .register_type::<tool::HeldBy>()
            .register_type::<grab::WorkRoot>()
            .add_observer(place::ask);
        if !app.world().contains_resource::<OxrInstance>() {
            return;
        }
        let hold = (grab::grab, place::press, place::recentre, tool::hold, undo::push).chain().in_set(XrSystems::Hold);
        app.init_schedule(XrSessionCreated)
            .init_schedule(XrPreDestroySession)
            .configure_sets(Update, (XrSystems::Read, XrSystems::Hold).chain().in_set(ClaySystems::Tool))
            .add_oxr_event_handler(session::listen)
            .add_observer(session::bring_near)
            .add_observer(session::lose)
            .add_systems(Startup, (session::set_window, actions::create.run_if(openxr_session_available)))
            .add_systems(OxrSendActionBindings, actions::suggest)
            .add_systems(XrSessionCreated, (actions::attach, place::begin))
            .add_systems(XrPreDestroySession, (actions::detach, session::end))
            .add_systems(PreUpdate, session::come_back)
            .add_systems(PreUpdate, actions::sync.before(OxrActionSetSyncSet).run_if(openxr_session_running))
            .add_systems(Update, (actions::read.run_if(openxr_session_running).in_set(XrSystems::Read), hold))
            .add_systems(Update, vibration::give_motors.in_set(XrSystems::Hold));
    }

    fn finish(&self, app: &mut App) {
        if !app.world().contains_resource::<OxrInstance>() {
            info!("no OxrInstance: the app draws without a headset, and XrSculptPlugin has nothing to do");
        }
    }
}
