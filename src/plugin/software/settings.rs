//! What an app says of its drawing, and what it finds.

use bevy::prelude::*;

/// When windows are drawn for a processor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
#[reflect(Default)]
pub enum SoftwareDrawingUse {
    /// Where the app renders on a software adapter.
    #[default]
    Auto,
    /// On any adapter.
    Always,
    /// Not at all.
    Never,
}

/// How windows are drawn for a processor; may change at any time.
///
/// What changes in a view are transforms, visibility, meshes, standard and plain materials, cameras, clay and
/// these settings; touch them (`set_changed`) where it changes by something else.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Resource, Default)]
pub struct SoftwareDrawing {
    /// Whether they are.
    pub when: SoftwareDrawingUse,
    /// Pixels of the window's side per pixel of the picture's while a view changes, at least 1.
    pub shrink: u32,
    /// The same of the picture that is drawn once nothing has changed for half a second, for four seconds
    /// while clay is worked on, at least 1.
    pub still_shrink: u32,
    /// Whether lights keep their shadows.
    pub shadows: bool,
    /// Greatest share of the time that goes to drawing what changes, above 0 and up to 1. The rest is the
    /// clay's.
    pub share: f32,
    /// Least time \[s\] between two drawings of panels and texts while a view changes: they cost as much as the
    /// view. Where no view does they are drawn as soon as they ask for it.
    pub panel_interval: f32,
    /// Longest time \[s\] after which panels and texts are drawn anew even though nobody asked for it by a
    /// [`RequestRedraw`](bevy::window::RequestRedraw) message.
    pub refresh: f32,
}

impl Default for SoftwareDrawing {
    fn default() -> Self {
        Self {
            when: SoftwareDrawingUse::Auto,
            shrink: 3,
            still_shrink: 1,
            shadows: false,
            share: 0.75,
            panel_interval: 0.2,
            refresh: 0.5,
        }
    }
}

/// A camera that is drawn as it is, software adapter or not.
#[derive(Component, Clone, Copy, Debug, Default, Reflect)]
#[reflect(Component, Default)]
pub struct FullDrawing;

/// The camera that shows a window what the window's other cameras have drawn; made and removed by the plugin.
/// It draws nothing else but what is given to it: panels, texts.
#[derive(Component, Clone, Copy, Debug, Reflect)]
#[reflect(Component)]
pub struct ScreenCamera {
    /// The window that it draws into.
    pub window: Entity,
    /// Pictures that were drawn so far of the cameras that it shows.
    pub picture_count: u64,
}
