//! What things are drawn with: standard materials, and plain ones where a processor draws.

use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy::render::renderer::RenderAdapterInfo;
use bevy_clay::prelude::*;
use wgpu::DeviceType;

/// Where materials are kept, and which kind is wanted.
#[derive(SystemParam)]
pub(crate) struct Looks<'w> {
    adapter: Res<'w, RenderAdapterInfo>,
    standard: ResMut<'w, Assets<StandardMaterial>>,
    plain: ResMut<'w, Assets<PlainLook>>,
}

/// What a thing is drawn with.
pub(crate) type Worn<'a> = (Option<&'a MeshMaterial3d<StandardMaterial>>, Option<&'a MeshMaterial3d<PlainLook>>);

impl Looks<'_> {
    /// Has a thing drawn with `material`, or what a processor makes of it.
    pub(crate) fn put(&mut self, thing: &mut EntityCommands, material: StandardMaterial) {
        if self.adapter.device_type == DeviceType::Cpu {
            thing.insert(MeshMaterial3d(self.plain.add(PlainLook::from(&material))));
        } else {
            thing.insert(MeshMaterial3d(self.standard.add(material)));
        }
    }

    /// Has clay drawn with what a processor can afford; elsewhere the plugin sees to it.
    pub(crate) fn put_on_clay(&mut self, clay: &mut EntityCommands) {
        if self.adapter.device_type == DeviceType::Cpu {
            clay.insert(MeshMaterial3d(self.plain.add(PlainLook::clay())));
        }
    }

    /// Gives a thing another colour.
    pub(crate) fn recolour(&mut self, (standard, plain): Worn, colour: Color) {
        if let Some(mut material) = standard.and_then(|worn| self.standard.get_mut(&worn.0)) {
            material.base_color = colour;
        }
        if let Some(mut material) = plain.and_then(|worn| self.plain.get_mut(&worn.0)) {
            material.colour = colour;
        }
    }
}
