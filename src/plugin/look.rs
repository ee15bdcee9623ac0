//! Clay that looks like clay: a material with a fine grain and two tones, in place of smooth plastic.
//!
//! [`ClayLook`] extends a [`StandardMaterial`], which keeps the say on colour, roughness and light. The grain
//! is noise in the clay's own frame, so that it needs neither texture coordinates nor files, and fades where
//! it is finer than the picture's pixels. The second tone goes by the surface's curvature: hollows, grooves
//! and cuts are damp and dark, ridges dry and light. Positions and normals are all that it needs of a mesh,
//! whoever makes it.
//!
//! Clay for which the app has no material gets this one, with [`LookPlugin`]. It costs a processor 6 % of a
//! frame more than a smooth standard material (451 and 476 ms of its time, 960 x 720 pixels with shadows, 4
//! samples a pixel).
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_clay::prelude::*;
//!
//! fn spawn_clay(mut commands: Commands, mut materials: ResMut<Assets<ClayLookMaterial>>) {
//!     let base = StandardMaterial { base_color: Color::srgb(0.35, 0.42, 0.38), ..ClayLook::base() };
//!     let look = ClayLook { grain_size: 0.003, ..default() };
//!     commands.spawn((Clay::default(), MeshMaterial3d(materials.add(ClayLookMaterial { base, extension: look }))));
//! }
//!
//! App::new().add_plugins((DefaultPlugins, ClayPlugins)).add_systems(Startup, spawn_clay).run();
//! ```

use bevy::asset::embedded_asset;
use bevy::pbr::{ExtendedMaterial, MaterialExtension};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::render_asset::RenderAssets;
use bevy::render::render_resource::{AsBindGroup, AsBindGroupShaderType, ShaderType};
use bevy::render::texture::GpuImage;
use bevy::shader::ShaderRef;

/// A standard material that looks like clay.
pub type ClayLookMaterial = ExtendedMaterial<StandardMaterial, ClayLook>;

/// Colour of clay where the app gives no material: worked pottery clay.
const CLAY_COLOUR: Color = Color::srgb(0.72, 0.45, 0.32);

/// Plain clay.
pub(super) fn clay_material() -> StandardMaterial {
    StandardMaterial { base_color: CLAY_COLOUR, perceptual_roughness: 0.8, ..default() }
}

/// What makes a surface look like clay. Lengths are in the clay's own frame.
#[derive(Asset, AsBindGroup, Clone, Debug, PartialEq, Reflect)]
#[reflect(Default)]
#[uniform(100, LookUniform)]
pub struct ClayLook {
    /// The second tone, that of damp hollows; the first is the base material's colour.
    pub damp: Color,
    /// How strongly the tones differ, from 0, one tone, to 1.
    pub tone: f32,
    /// Radius \[m\] of a hollow that is wholly damp.
    pub crevice: f32,
    /// Size \[m\] of the coarsest bumps of the grain.
    pub grain_size: f32,
    /// Slope of the grain, 0 for a smooth surface.
    pub grain: f32,
}

impl Default for ClayLook {
    /// Worked pottery clay of a few centimetres.
    fn default() -> Self {
        Self { damp: Color::srgb(0.38, 0.21, 0.14), tone: 0.8, crevice: 0.006, grain_size: 0.0022, grain: 0.05 }
    }
}

impl ClayLook {
    /// What the plugin gives clay that has no material.
    pub fn material() -> ClayLookMaterial {
        ClayLookMaterial { base: Self::base(), extension: Self::default() }
    }

    /// The base material that goes with it: the plugin's own for clay.
    pub fn base() -> StandardMaterial {
        StandardMaterial { perceptual_roughness: 0.62, reflectance: 0.4, ..clay_material() }
    }
}

/// As in the shader.
#[derive(Clone, Copy, Debug, ShaderType)]
struct LookUniform {
    damp: Vec4,
    grain_size: f32,
    grain: f32,
    crevice: f32,
    tone: f32,
}

impl AsBindGroupShaderType<LookUniform> for ClayLook {
    fn as_bind_group_shader_type(&self, _: &RenderAssets<GpuImage>) -> LookUniform {
        let &Self { damp, tone, crevice, grain_size, grain } = self;
        LookUniform { damp: damp.to_linear().to_vec4(), grain_size, grain, crevice, tone }
    }
}

impl MaterialExtension for ClayLook {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_clay/plugin/look/look.wgsl".into()
    }
}

/// Gives clay without a material a [`ClayLookMaterial`]; does nothing in an app that draws no standard
/// materials. Without it such clay is plain.
#[derive(Clone, Copy, Debug, Default)]
pub struct LookPlugin;

impl Plugin for LookPlugin {
    fn build(&self, app: &mut App) {
        if app.get_sub_app(RenderApp).is_none() || !app.world().contains_resource::<Assets<StandardMaterial>>() {
            return;
        }
        embedded_asset!(app, "look/look.wgsl");
        app.add_plugins(MaterialPlugin::<ClayLookMaterial>::default()).register_type::<ClayLook>();
    }
}
