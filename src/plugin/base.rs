//! The clay that engines start from: made of its source away from the main thread, or put in its place by
//! what is asked of it.

use super::clay::Clay;
use super::held::HeldTime;
use super::schedule::{ClaySystems, schedule};
use super::source::{ClaySource, imported};
use crate::sim::material::ClayMaterial;
use crate::sim::snapshot::Snapshot;
use bevy::asset::{AssetServer, LoadState};
use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use std::sync::Arc;

/// What the engines of a clay start from.
#[derive(Component, Default)]
pub(super) struct Base {
    /// What the next engine starts from; its address tells one start from another.
    pub(super) snapshot: Option<Arc<Snapshot>>,
    /// What the clay's source made: where it goes back to.
    pub(super) start: Option<Arc<Snapshot>>,
    /// The clay that was taken up last.
    taken: Option<Clay>,
    /// Whether it is still to be made: its mesh is not there yet.
    is_waiting: bool,
    making: Option<Task<Result<Snapshot, String>>>,
    /// Volume of the start \[m^3\].
    pub(super) rest_volume: f64,
    /// Why there is no new clay.
    pub(super) error: Option<String>,
    /// The material that was put beside the clay, until somebody puts another one there.
    material: Option<ClayMaterial>,
}

impl Base {
    /// Takes up a clay that is new.
    fn take_up(&mut self, clay: &Clay) {
        if self.taken.as_ref() == Some(clay) {
            return;
        }
        (self.taken, self.making, self.error) = (Some(clay.clone()), None, None);
        match &clay.source {
            ClaySource::Snapshot(saved) => self.begin(saved.0.clone()),
            ClaySource::Mesh(_) => self.is_waiting = true,
            source => self.make(source.clone(), clay.cell_width, None),
        }
    }

    fn make(&mut self, source: ClaySource, cell_width: Option<f64>, mesh: Option<Mesh>) {
        let make = async move {
            let mesh = mesh.as_ref().map(imported).transpose()?;
            source.build(cell_width, mesh)
        };
        self.making = Some(AsyncComputeTaskPool::get().spawn(make));
        self.is_waiting = false;
    }

    /// Starts from `snapshot`.
    fn begin(&mut self, snapshot: Arc<Snapshot>) {
        self.rest_volume = snapshot.rest_volume();
        self.start = Some(snapshot.clone());
        self.snapshot = Some(snapshot);
        (self.is_waiting, self.error) = (false, None);
    }

    /// The mesh that the clay waits for, once it is there.
    fn await_mesh(&mut self, meshes: Option<&Assets<Mesh>>, assets: Option<&AssetServer>) {
        let Some(Clay { source: source @ ClaySource::Mesh(handle), cell_width }) = &self.taken else { return };
        if let Some(mesh) = meshes.and_then(|meshes| meshes.get(handle)) {
            let (source, cell_width, mesh) = (source.clone(), *cell_width, mesh.clone());
            self.make(source, cell_width, Some(mesh));
        } else if let Some(LoadState::Failed(error)) = assets.and_then(|assets| assets.get_load_state(handle)) {
            (self.is_waiting, self.error) = (false, Some(format!("the mesh: {error}")));
        } else if meshes.is_none() {
            (self.is_waiting, self.error) = (false, Some("the app has no meshes: it lacks MeshPlugin".into()));
        }
    }
}

/// Makes clay of sources. Without it no clay gets an engine.
#[derive(Clone, Copy, Debug, Default)]
pub struct SourcePlugin;

impl Plugin for SourcePlugin {
    fn build(&self, app: &mut App) {
        let schedule = schedule(app);
        app.register_required_components::<Clay, Base>();
        app.add_observer(|gone: On<Remove, Clay>, mut commands: Commands| {
            commands.entity(gone.entity).try_remove::<Base>();
        });
        app.add_systems(schedule, build.in_set(ClaySystems::Report));
    }
}

/// Clay that is new or on its way.
type Sources<'a> = (Entity, Ref<'a, Clay>, &'a mut Base, Option<&'a mut ClayMaterial>);

/// Takes up clay that is new, away from the main thread, and puts its material beside it unless the app has
/// put another one there.
pub(super) fn build(
    mut clays: Query<Sources>,
    (meshes, assets): (Option<Res<Assets<Mesh>>>, Option<Res<AssetServer>>),
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    for (entity, clay, mut base, material) in &mut clays {
        let before = base.start.clone();
        if clay.is_changed() {
            base.take_up(&clay);
        }
        if base.is_waiting {
            base.await_mesh(meshes.as_deref(), assets.as_deref());
        }
        if let Some(made) = base.making.as_mut().and_then(check_ready) {
            base.making = None;
            match made {
                Ok(snapshot) => base.begin(Arc::new(snapshot)),
                Err(error) => {
                    error!("clay {entity}: {error}");
                    base.error = Some(error);
                }
            }
        }
        let Some(start) = base.start.clone().filter(|start| before.is_none_or(|before| !Arc::ptr_eq(&before, start))) else {
            continue;
        };
        match material {
            None => {
                commands.entity(entity).insert(start.material);
                base.material = Some(start.material);
            }
            Some(mut material) if base.material == Some(*material) => {
                material.set_if_neq(start.material);
                base.material = Some(start.material);
            }
            Some(_) => base.material = None,
        }
    }
}
