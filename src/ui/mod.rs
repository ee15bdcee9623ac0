//! Panels on the clay: egui windows that read and write the plugin's components. Feature `inspector`.
//!
//! | file          | takes                | makes                                                          |
//! |---------------|----------------------|----------------------------------------------------------------|
//! | [`request`]   | [`ClayRequest`]s     | the clay reset, on another grid, exported; off the main thread |
//! | [`history`]   | reports              | the last seconds of tool force and frame time                  |
//! | [`material`]  | [`ClayMaterial`]     | its rows: names, units, ranges                                 |
//! | [`panel`]     | settings, requests   | the window that changes the clay                               |
//! | [`status`]    | status, history      | the window that shows how it is doing                          |
//! | [`inspector`] | reflected components | every field of them, in a third window                         |
//!
//! [`ClayRequest`]: request::ClayRequest
//! [`ClayMaterial`]: crate::sim::material::ClayMaterial
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_clay::prelude::*;
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, ClayPlugins, ClayPanelPlugin::default()))
//!     .add_systems(Startup, |mut commands: Commands| {
//!         commands.spawn(Clay::default());
//!         commands.spawn((Camera3d::default(), Transform::from_xyz(0.0, 0.08, 0.15).looking_at(Vec3::Y * 0.02, Vec3::Y)));
//!     })
//!     .run();
//! ```

pub mod history;
pub mod inspector;
pub mod material;
pub mod panel;
pub mod request;
pub mod status;

use crate::plugin::schedule::ClaySystems;
use bevy::prelude::*;
use bevy_egui::{EguiPlugin, EguiPrimaryContextPass};
use bevy_inspector_egui::DefaultInspectorConfigPlugin;
use std::path::PathBuf;

/// What most programs need.
pub mod prelude {
    pub use super::ClayPanelPlugin;
    pub use super::request::{ClayChange, ClayNotice, ClayRequest, ClayStart, ExportFormat};
}

/// The windows, and what their buttons ask for. Adds [`EguiPlugin`] if the app has not.
#[derive(Clone, Debug)]
pub struct ClayPanelPlugin {
    /// Where exported files go; made when the first one is written.
    pub export_folder: PathBuf,
}

impl Default for ClayPanelPlugin {
    /// Exports into `out`.
    fn default() -> Self {
        Self { export_folder: "out".into() }
    }
}

impl Plugin for ClayPanelPlugin {
    fn build(&self, app: &mut App) {
        if !app.is_plugin_added::<EguiPlugin>() {
            app.add_plugins(EguiPlugin::default());
        }
        if !app.is_plugin_added::<DefaultInspectorConfigPlugin>() {
            app.add_plugins(DefaultInspectorConfigPlugin);
        }
        app.add_message::<request::ClayRequest>()
            .insert_resource(request::ExportFolder(self.export_folder.clone()))
            .init_resource::<request::ClayNotice>()
            .init_resource::<panel::PanelState>()
            .init_resource::<history::ClayHistory>()
            .add_systems(Update, (request::remember_start, request::answer, request::take).chain().before(ClaySystems::Report))
            .add_systems(Update, history::record.after(ClaySystems::Report))
            .add_systems(EguiPrimaryContextPass, (panel::window, status::window, inspector::window).chain());
    }
}
