//! What the plugin puts on a clay's entity, and takes away again: nothing of what the app put there.

use super::clay::Clay;
use super::look::ClayLookMaterial;
use bevy::camera::primitives::Aabb;
use bevy::camera::visibility::{NoAutoAabb, VisibilityClass};
use bevy::prelude::*;
use std::any::TypeId;

/// Puts components on an entity that is still clay when the command runs: it may have gone since it was
/// queued.
pub(super) fn put(bundle: impl Bundle) -> impl EntityCommand {
    move |mut entity: EntityWorldMut| {
        if entity.contains::<Clay>() {
            entity.insert(bundle);
        }
    }
}

/// The mesh that the plugin shows on an entity.
#[derive(Component)]
pub(super) struct ShownMesh {
    mesh: Handle<Mesh>,
    /// Whether the app had put [`NoAutoAabb`] there.
    is_bounded_by_app: bool,
}

impl ShownMesh {
    /// Its mesh, unless the app has put another in its place.
    pub(super) fn own<'a>(&'a self, present: Option<&Mesh3d>) -> Option<&'a Handle<Mesh>> {
        present.is_some_and(|present| present.0 == self.mesh).then_some(&self.mesh)
    }
}

/// The material that the plugin put there.
#[derive(Component, Clone, PartialEq)]
pub(super) enum AutoMaterial {
    /// Where the app has no look of clay.
    Plain(Handle<StandardMaterial>),
    Look(Handle<ClayLookMaterial>),
}

impl AutoMaterial {
    /// Whether it is still what the entity has.
    fn is_on(&self, entity: &EntityWorldMut) -> bool {
        match self {
            Self::Plain(own) => entity.get::<MeshMaterial3d<StandardMaterial>>().is_some_and(|present| present.0 == *own),
            Self::Look(own) => entity.get::<MeshMaterial3d<ClayLookMaterial>>().is_some_and(|present| present.0 == *own),
        }
    }
}

/// Shows a mesh on an entity that is still clay.
pub(super) fn show(mesh: Handle<Mesh>, bounds: Aabb) -> impl EntityCommand {
    move |mut entity: EntityWorldMut| {
        if !entity.contains::<Clay>() {
            return;
        }
        let is_bounded_by_app =
            entity.get::<ShownMesh>().map_or(entity.contains::<NoAutoAabb>(), |shown| shown.is_bounded_by_app);
        entity.insert((Mesh3d(mesh.clone()), bounds, NoAutoAabb, ShownMesh { mesh, is_bounded_by_app }));
    }
}

/// Forgets that the entity is seen as a mesh, as Bevy does not: with the next mesh it would be listed twice.
fn unclass(entity: &mut EntityWorldMut) {
    let Some(mut class) = entity.get_mut::<VisibilityClass>() else { return };
    class.retain(|id| *id != TypeId::of::<Mesh3d>());
    if class.is_empty() {
        entity.remove::<VisibilityClass>();
    }
}

/// Takes away the mesh that is shown, and the material that goes with it.
pub(super) fn hide(mut entity: EntityWorldMut) {
    if let Some(shown) = entity.take::<ShownMesh>() {
        if shown.own(entity.get()).is_some() {
            entity.remove::<Mesh3d>();
            unclass(&mut entity);
        }
        entity.remove::<Aabb>();
        if !shown.is_bounded_by_app {
            entity.remove::<NoAutoAabb>();
        }
    }
    undress(entity);
}

/// Puts the plugin's material on an entity that is still clay without a material.
pub(super) fn wear(own: AutoMaterial) -> impl EntityCommand {
    move |mut entity: EntityWorldMut| {
        let is_bare =
            !entity.contains::<MeshMaterial3d<StandardMaterial>>() && !entity.contains::<MeshMaterial3d<ClayLookMaterial>>();
        if entity.contains::<Clay>() && is_bare {
            match own.clone() {
                AutoMaterial::Plain(own) => entity.insert(MeshMaterial3d(own)),
                AutoMaterial::Look(own) => entity.insert(MeshMaterial3d(own)),
            };
            entity.insert(own);
        }
    }
}

/// Takes away the plugin's material.
pub(super) fn undress(mut entity: EntityWorldMut) {
    if let Some(auto) = entity.take::<AutoMaterial>()
        && auto.is_on(&entity)
    {
        match auto {
            AutoMaterial::Plain(_) => entity.remove::<MeshMaterial3d<StandardMaterial>>(),
            AutoMaterial::Look(_) => entity.remove::<MeshMaterial3d<ClayLookMaterial>>(),
        };
    }
}
