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
use bevy::ecs::archetype::Archetypes;
use bevy::ecs::component::Components;
use bevy::ecs::entity::Entities;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy::reflect::TypePath;
use std::any::TypeId;

/// Colour of clay where the app gives no material: worked pottery clay.
const CLAY_COLOUR: Color = Color::srgb(0.72, 0.45, 0.32);

/// Keeps the plugin from giving a [`Clay`] without a `MeshMaterial3d` a material of its own: for clay that
/// the app draws in another way.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Default)]
pub struct NoAutoMaterial;

fn clay_material() -> StandardMaterial {
    StandardMaterial { base_color: CLAY_COLOUR, perceptual_roughness: 0.8, ..default() }
}

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

/// All types of `MeshMaterial3d` that the app has, but that of [`StandardMaterial`].
fn material_types(registry: &AppTypeRegistry) -> Vec<TypeId> {
    type Standard = MeshMaterial3d<StandardMaterial>;
    let name = (Standard::module_path(), Standard::type_ident());
    let registry = registry.read();
    let types = registry.iter().filter(|registration| {
        let path = registration.type_info().type_path_table();
        (path.module_path(), path.ident()) == name
    });
    types.map(|registration| registration.type_id()).filter(|id| *id != TypeId::of::<Standard>()).collect()
}

/// What a clay that is shown has for a material.
type Worn<'a> = (Option<&'a MeshMaterial3d<StandardMaterial>>, Option<&'a AutoMaterial>, Has<NoAutoMaterial>);

/// Gives clay that is shown the plugin's material where the app has none, and takes it away where it has.
pub(super) fn dress(
    clays: Query<(Entity, Worn), (With<Clay>, With<ShownMesh>)>,
    mut others: OtherMaterials,
    mut materials: Option<ResMut<Assets<StandardMaterial>>>,
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let Some(materials) = &mut materials else { return };
    for (entity, (standard, auto, is_left_alone)) in &clays {
        let is_own = standard.zip(auto).is_some_and(|(present, own)| own.is(present));
        if is_left_alone || (standard.is_some() && !is_own) || others.are_on(entity) {
            if auto.is_some() {
                commands.entity(entity).queue_silenced(undress);
            }
        } else if standard.is_none() {
            let own = materials.add(clay_material());
            commands.entity(entity).queue_silenced(wear(own));
        }
    }
}
