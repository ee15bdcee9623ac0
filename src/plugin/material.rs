//! The material of clay for which the app has none.
//!
//! Clay is drawn with whatever [`MeshMaterial3d`] its entity has, of any type of material: then the plugin
//! puts none of its own there, and takes its own away when the app comes with one later. It need not know
//! these types: each material that Bevy draws has a `MaterialPlugin`, which registers its `MeshMaterial3d`
//! for reflection. So the app's type registry has them all, and an entity's archetype says whether it has one
//! of them. (Names of components would not do: Bevy keeps them only with its feature `debug`.) For what is
//! drawn in another way there is [`NoAutoMaterial`].

use super::clay::Clay;
use super::entity::{AutoMaterial, ShownMesh, undress, wear};
use super::held::HeldTime;
use super::look::{ClayLook, ClayLookMaterial, clay_material};
use bevy::ecs::archetype::Archetypes;
use bevy::ecs::component::Components;
use bevy::ecs::entity::Entities;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy::reflect::TypePath;
use std::any::TypeId;

/// Keeps the plugin from giving a [`Clay`] without a `MeshMaterial3d` a material of its own: for clay that
/// the app draws in another way.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Default)]
pub struct NoAutoMaterial;

/// The materials of the app on entities, of any type but [`StandardMaterial`].
#[derive(SystemParam)]
pub(super) struct OtherMaterials<'w, 's> {
    registry: Res<'w, AppTypeRegistry>,
    entities: &'w Entities,
    archetypes: &'w Archetypes,
    components: &'w Components,
    /// Looked up once, when all plugins of the app are there.
    types: Local<'s, Option<Vec<TypeId>>>,
}

impl OtherMaterials<'_, '_> {
    /// Whether `entity` has one.
    fn are_on(&mut self, entity: Entity) -> bool {
        let Ok(Some(location)) = self.entities.get(entity) else { return false };
        let Some(archetype) = self.archetypes.get(location.archetype_id) else { return false };
        let types = self.types.get_or_insert_with(|| material_types(&self.registry));
        types.iter().filter_map(|id| self.components.get_id(*id)).any(|id| archetype.contains(id))
    }
}

/// All types of `MeshMaterial3d` that the app has, but those that the plugin itself may put there.
fn material_types(registry: &AppTypeRegistry) -> Vec<TypeId> {
    type Standard = MeshMaterial3d<StandardMaterial>;
    let look = TypeId::of::<MeshMaterial3d<ClayLookMaterial>>();
    let name = (Standard::module_path(), Standard::type_ident());
    let registry = registry.read();
    let types = registry.iter().filter(|registration| {
        let path = registration.type_info().type_path_table();
        (path.module_path(), path.ident()) == name
    });
    types.map(|registration| registration.type_id()).filter(|id| ![TypeId::of::<Standard>(), look].contains(id)).collect()
}

/// What a clay that is shown has for a material.
type Worn<'a> = (
    Option<&'a MeshMaterial3d<StandardMaterial>>,
    Option<&'a MeshMaterial3d<ClayLookMaterial>>,
    Option<&'a AutoMaterial>,
    Has<NoAutoMaterial>,
);

/// Where the plugin's materials are kept.
type Store<'w> = (Option<ResMut<'w, Assets<StandardMaterial>>>, Option<ResMut<'w, Assets<ClayLookMaterial>>>);

/// Gives clay that is shown the plugin's material where the app has none, and takes it away where it has.
pub(super) fn dress(
    clays: Query<(Entity, Worn), (With<Clay>, With<ShownMesh>)>,
    mut others: OtherMaterials,
    (mut plain, mut looks): Store,
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    for (entity, (standard, look, auto, is_left_alone)) in &clays {
        let is_apps = standard.is_some_and(|present| auto != Some(&AutoMaterial::Plain(present.0.clone())))
            || look.is_some_and(|present| auto != Some(&AutoMaterial::Look(present.0.clone())));
        if is_left_alone || is_apps || others.are_on(entity) {
            if auto.is_some() {
                commands.entity(entity).queue_silenced(undress);
            }
        } else if standard.is_none() && look.is_none() {
            let own = match (&mut looks, &mut plain) {
                (Some(looks), _) => AutoMaterial::Look(looks.add(ClayLook::material())),
                (None, Some(plain)) => AutoMaterial::Plain(plain.add(clay_material())),
                (None, None) => continue,
            };
            commands.entity(entity).queue_silenced(wear(own));
        }
    }
}
