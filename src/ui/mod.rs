//! Panels on the clay: egui windows that read and write the plugin's components. Feature `inspector`.
//!
//! | file          | takes                | makes                                                          |
//! |---------------|----------------------|----------------------------------------------------------------|
//! | [`notice`]    | answers of the clay  | the last one in a line                                         |
//! | [`plots`]     | reports              | the last seconds of tool force and frame time                  |
//! | [`material`]  | [`ClayMaterial`]     | its rows: names, units, ranges                                 |
//! | [`panel`]     | settings             | the window that changes the clay                               |
//! | [`status`]    | status, history      | the window that shows how it is doing                          |
//! | `haptics`     | the hand's session   | the window of a tool in an arm's hand                          |
//! | [`inspector`] | reflected components | every field of them, in a third window                         |
//!
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

mod haptics;
pub mod inspector;
pub mod material;
pub mod notice;
pub mod panel;
pub mod plots;
pub mod status;

use crate::plugin::schedule::ClaySystems;
use bevy::prelude::*;
use bevy_egui::{EguiPlugin, EguiPrimaryContextPass};
use bevy_inspector_egui::DefaultInspectorConfigPlugin;
use std::path::PathBuf;

/// What most programs need.
pub mod prelude {
    pub use super::ClayPanelPlugin;
    pub use super::notice::ClayNotice;
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
        app.insert_resource(panel::ExportFolder(self.export_folder.clone()))
            .init_resource::<notice::ClayNotice>()
            .init_resource::<panel::PanelState>()
            .init_resource::<plots::RecentFrames>()
            .add_observer(notice::changed)
            .add_observer(notice::exported)
            .add_observer(notice::trouble)
            .add_observer(notice::lost)
            .add_systems(Update, plots::record.after(ClaySystems::Report))
            .add_systems(EguiPrimaryContextPass, (panel::window, status::window, haptics::window, inspector::window).chain());
    }
}
