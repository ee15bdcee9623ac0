//! Clay that follows a file: when the file changes on disk, the running clay is made of what it says now.

use super::engine;
use super::held::HeldTime;
use super::schedule::{ClaySystems, schedule};
use super::status::ClayStatus;
use crate::scene::clay::ClayFile;
use crate::scene::stamp::FileStamp;
use crate::sim::material::ClayMaterial;
use bevy::ecs::lifecycle::HookContext;
use bevy::ecs::world::DeferredWorld;
use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{IoTaskPool, Task};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between looks at a file. A change is taken at the second look that sees it, so that a file half
/// written is left alone.
const LOOK_EVERY: Duration = Duration::from_millis(150);

/// The `*.clay.ron` file that a [`Clay`](super::clay::Clay) follows. Its [`ClayMaterial`] becomes what the
/// file says, at first and whenever the file, or one that it extends, changes; softening that no file names
/// stays. A file that is bad or gone leaves the material as it is, and [`ClayStatus::error`] says why; what
/// is odd about it is in [`ClayStatus::warnings`].
#[derive(Component, Clone, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Default)]
#[require(Following)]
#[component(on_remove = end)]
pub struct MaterialFile {
    /// The file.
    pub path: PathBuf,
}

impl MaterialFile {
    /// Follows the file at `path`.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into() }
    }
}

/// What is known of the file.
#[derive(Component, Default)]
pub(super) struct Following {
    path: PathBuf,
    /// The files that the material was read from, as they were before; none before the first look.
    read: Vec<FileStamp>,
    /// The same files when they were last looked at.
    seen: Vec<FileStamp>,
    looked: Option<Instant>,
    look: Option<Task<Look>>,
    /// What is wrong with the file.
    pub(super) error: Option<String>,
    /// What is odd about it.
    pub(super) warnings: Vec<String>,
}

/// What a look at the file saw.
struct Look {
    seen: Vec<FileStamp>,
    /// The files read, and what came of it, if they had changed.
    found: Option<(Vec<FileStamp>, Result<ClayFile, String>)>,
}

impl Look {
    /// Looks at the file, and reads it when it has changed since `read` and not since `seen`. Takes its time.
    fn take(path: &Path, read: &[FileStamp], seen: &[FileStamp]) -> Self {
        let now: Vec<FileStamp> = read.iter().map(FileStamp::renewed).collect();
        let is_due = read.is_empty() || (now != read && now == seen);
        let found = is_due.then(|| {
            let mut stamps = vec![];
            let clay = ClayFile::load_stamped(path, &mut stamps).map_err(|error| error.to_string());
            (stamps, clay)
        });
        Self { seen: now, found }
    }
}

/// Forgets the file of a clay that no longer follows one.
fn end(mut world: DeferredWorld, context: HookContext) {
    world.commands().entity(context.entity).try_remove::<Following>();
}

/// Lets clay follow files. Without it a [`MaterialFile`] has no effect.
#[derive(Clone, Copy, Debug, Default)]
pub struct FollowPlugin;

impl Plugin for FollowPlugin {
    fn build(&self, app: &mut App) {
        let schedule = schedule(app);
        app.register_type::<MaterialFile>().add_systems(schedule, follow.in_set(ClaySystems::Report).after(engine::keep));
    }
}

/// Looks at files now and then, away from the main thread, and takes what was read.
fn follow(mut clays: Query<(Entity, &MaterialFile, &mut Following, &mut ClayMaterial), With<ClayStatus>>, held: Res<HeldTime>) {
    let _watch = held.watch();
    for (entity, file, mut following, mut material) in &mut clays {
        if following.path != file.path {
            *following = Following { path: file.path.clone(), ..default() };
        }
        if let Some(look) = following.look.as_mut().and_then(check_ready) {
            following.look = None;
            following.seen = look.seen;
            if let Some((stamps, result)) = look.found {
                following.read = stamps;
                (following.error, following.warnings) = taken(entity, &file.path, result, &mut material);
            }
        }
        let is_due = following.looked.is_none_or(|at| at.elapsed() >= LOOK_EVERY);
        if is_due && following.look.is_none() {
            let (path, read, seen) = (following.path.clone(), following.read.clone(), following.seen.clone());
            following.looked = Some(Instant::now());
            following.look = Some(IoTaskPool::get().spawn(async move { Look::take(&path, &read, &seen) }));
        }
    }
}

/// Makes the clay of what was read, or says why not: the error and the warnings to show.
fn taken(
    entity: Entity,
    path: &Path,
    result: Result<ClayFile, String>,
    material: &mut Mut<ClayMaterial>,
) -> (Option<String>, Vec<String>) {
    match result {
        Ok(clay) => {
            let new = clay.in_place_of(material);
            if material.set_if_neq(new) {
                info!("clay {entity} is now {} ({})", clay.name, path.display());
            }
            clay.warnings.iter().for_each(|warning| warn!("{warning}"));
            (None, clay.warnings)
        }
        Err(error) => {
            error!("clay {entity} stays as it is: {error}");
            (Some(error), vec![])
        }
    }
}
