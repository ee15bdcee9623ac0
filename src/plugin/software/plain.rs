//! A material that a processor shades several times as fast as a standard one: see [`PlainLook`].

use super::super::look::ClayLook;
use bevy::asset::embedded_asset;
use bevy::pbr::Material;
use bevy::prelude::*;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{AsBindGroup, AsBindGroupShaderType, ShaderType};
use bevy::render::texture::GpuImage;
use bevy::shader::ShaderRef;

/// A material for apps that a processor draws: one colour, lit by directional lights and by what is all
/// around, a soft shine, and a damp tone in hollows, as [`ClayLook`] has it. It knows no other lights, no
/// shadows and no textures.
///
/// Made available by [`SoftwareDrawingPlugin`](super::SoftwareDrawingPlugin); which of its things wear it is
/// the app's to say. A block of clay on a board takes llvmpipe 34 ms of processor time in place of the 169 of
/// [`ClayLook`] and a standard material (640 x 400 pixels, no shadows, one sample a pixel).
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug, PartialEq)]
#[uniform(0, PlainUniform)]
pub struct PlainLook {
    /// Its own colour.
    pub colour: Color,
    /// The second tone, that of hollows.
    pub damp: Color,
    /// How strongly the tones differ, from 0, one tone, to 1.
    pub tone: f32,
    /// Radius \[m\] of a hollow that is wholly damp, in the world.
    pub crevice: f32,
    /// Strength of the shine, 0 for a dull surface.
    pub shine: f32,
}

impl PlainLook {
    /// A dull surface of one colour.
    pub fn new(colour: Color) -> Self {
        Self { colour, damp: colour, tone: 0.0, crevice: 0.0, shine: 0.0 }
    }

    /// Clay that looks like [`ClayLook`], without its grain.
    pub fn clay() -> Self {
        let ClayLook { damp, tone, crevice, .. } = ClayLook::default();
        Self { damp, tone, crevice, shine: 0.02, ..Self::new(ClayLook::base().base_color) }
    }
}

impl From<&StandardMaterial> for PlainLook {
    /// Its colour, and a shine by its roughness.
    fn from(material: &StandardMaterial) -> Self {
        Self { shine: 0.06 * (1.0 - material.perceptual_roughness), ..Self::new(material.base_color) }
    }
}

/// As in the shader.
#[derive(Clone, Copy, Debug, ShaderType)]
struct PlainUniform {
    colour: Vec4,
    damp: Vec4,
    crevice: f32,
    tone: f32,
    shine: f32,
}

impl AsBindGroupShaderType<PlainUniform> for PlainLook {
    fn as_bind_group_shader_type(&self, _: &RenderAssets<GpuImage>) -> PlainUniform {
        let &Self { colour, damp, tone, crevice, shine } = self;
        PlainUniform { colour: colour.to_linear().to_vec4(), damp: damp.to_linear().to_vec4(), crevice, tone, shine }
    }
}

impl Material for PlainLook {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_clay/plugin/software/plain.wgsl".into()
    }

    fn alpha_mode(&self) -> AlphaMode {
        if self.colour.alpha() < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque }
    }
}

/// Has Bevy draw [`PlainLook`] where it draws standard materials.
pub(super) fn build(app: &mut App) {
    if app.world().contains_resource::<Assets<StandardMaterial>>() {
        embedded_asset!(app, "plain.wgsl");
        app.add_plugins(MaterialPlugin::<PlainLook>::default());
    }
}
