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
#[derive(Resource, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Resource, Default)]
pub struct SoftwareDrawing {
    /// Whether they are.
    pub when: SoftwareDrawingUse,
    /// Pixels of the window's side per pixel of the picture's, at least 1.
    pub shrink: u32,
    /// Whether lights keep their shadows.
    pub shadows: bool,
    /// Greatest share of the time that goes to drawing, above 0 and up to 1. The rest is the clay's.
    pub share: f32,
    /// Longest time \[s\] after which a window is drawn anew even though nothing is seen to have changed: what
    /// changes are seen are those of transforms, visibility, meshes, materials, cameras and clay, and
    /// [`RequestRedraw`](bevy::window::RequestRedraw) messages.
    pub refresh: f32,
}

impl Default for SoftwareDrawing {
    fn default() -> Self {
        Self { when: SoftwareDrawingUse::Auto, shrink: 2, shadows: false, share: 0.5, refresh: 0.5 }
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
    /// Pictures that were drawn of it so far.
    pub picture_count: u64,
}
