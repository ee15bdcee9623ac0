//! Shows the clay: its surface is extracted away from the main thread, which only swaps the finished mesh in.
//! The field that it was made of stays, to point at.

use super::bridge::DeviceNumber;
use super::clay::{Clay, ClaySettings, MeshQuality};
use super::engine::ClayEngine;
use super::entity::{self, ShownMesh};
use super::held::HeldTime;
use super::material::{self, NoAutoMaterial};
use super::schedule::ClaySystems;
use crate::sim::engine::{Deferred, StateLost};
use crate::sim::frame::SurfaceSource;
use crate::surface::extract::extract_by;
use crate::surface::field::{Field, SurfaceSettings, Tier};
use crate::surface::grains::{self, Grain};
use crate::surface::labels::Rules;
use crate::surface::mesh::Mesh as Surface;
use crate::surface::ray::{RayHit, cast_ray};
use bevy::asset::RenderAssetUsages;
use bevy::camera::primitives::Aabb;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use glam::DVec3;
use std::sync::Arc;
use std::time::Instant;

/// The surface as apps may read it and point at it. A clone shares all of it, and stays as it is when the
/// clay moves on.
#[derive(Component, Clone, Debug)]
pub struct ClaySurface {
    mesh: Option<Arc<Surface>>,
    grains: Arc<[Grain]>,
    field: Arc<Field>,
    settings: SurfaceSettings,
    bounds: Option<(DVec3, DVec3)>,
    state: State,
    extract_ms: f64,
}

impl ClaySurface {
    /// The closed mesh in the clay's own frame \[m\], with smooth normals: the data of the [`Mesh3d`], whose
    /// asset lives in the render world alone and has balls for the grains behind it. None where the graphics
    /// device makes what is shown ([`SurfaceBackend`](super::clay::SurfaceBackend)): it stays there, and
    /// [`extract_field`](crate::surface::extract::extract_field) makes one of [`field`](Self::field).
    pub fn mesh(&self) -> Option<&Arc<Surface>> {
        self.mesh.as_ref()
    }

    /// The particles that the mesh does not show, in the clay's own frame: drawn as balls. Those of a surface
    /// that the graphics device makes stay there.
    pub fn grains(&self) -> &[Grain] {
        &self.grains
    }

    /// Triangles of mesh and balls.
    pub(super) fn triangle_count(&self) -> usize {
        self.mesh().map_or(0, |m| m.triangles.len()) + grains::ball_triangles(self.grains.len())
    }

    /// The field that the surface is made of; where the graphics device makes what is shown, one with nodes
    /// every cell, to point at. With 8 particles per cell it takes about 12 bytes per particle with nodes
    /// every half cell, 2.5 with nodes every cell; each cut adds up to twice as much in its reach.
    pub fn field(&self) -> &Arc<Field> {
        &self.field
    }

    /// Where a ray in the clay's own frame first meets the surface from outside, in microseconds: see
    /// [`cast_ray`].
    pub fn cast(&self, ray: Ray3d) -> Option<RayHit> {
        cast_ray(&self.field, &self.settings, ray.origin.as_dvec3(), ray.direction.as_dvec3())
    }

    /// Low and high corner of a box around the surface \[m\]; none where there is none.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds
    }

    /// Counts the states of the clay: greater is newer.
    pub fn revision(&self) -> (u64, u64) {
        (self.state.generation, self.state.revision)
    }

    /// Wall time of its extraction \[ms\].
    pub fn extract_ms(&self) -> f64 {
        self.extract_ms
    }

    /// Whether this surface stands for another state of the same clay, with these fields and grains: it does
    /// while nothing has moved by what could be seen.
    fn is_still(&self, field: &Field, grains: &[Grain], state: State, cell_width: f64) -> bool {
        let is_same_kind = State { revision: state.revision, ..self.state } == state;
        // A hundredth of a cell, as for the fields.
        let by = 0.01 * cell_width as f32;
        let is_still = |(a, b): (&Grain, &Grain)| {
            let [p, q] = [a, b].map(|g| Vec3::from_array(g.position).extend(g.radius));
            (p - q).abs().max_element() <= by
        };
        is_same_kind
            && field.is_still(&self.field)
            && grains.len() == self.grains.len()
            && grains.iter().zip(&self.grains[..]).all(is_still)
    }
}

/// What is shown, or is going to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct State {
    /// Which engine of the clay.
    generation: u64,
    /// Which state of it.
    revision: u64,
    quality: MeshQuality,
    /// Whether this is the surface that is drawn; else the device makes that one.
    is_shown: bool,
    /// The mesh is lost with the device.
    device: Option<DeviceNumber>,
}

/// Marks clay whose mesh the graphics device makes: what is made here is to point at.
#[derive(Component)]
pub(super) struct DrawnByDevice;

/// The surface on its way, if there is one.
#[derive(Component, Default)]
pub(super) struct Extracting {
    under_way: Option<(State, Task<Result<Extracted, StateLost>>)>,
}

/// A surface as it comes from its task, ready to be swapped in.
struct Extracted {
    surface: ClaySurface,
    drawn: Draw,
}

/// What becomes of the mesh that is drawn from here.
enum Draw {
    /// It stays: clay at rest, or clay that the device draws.
    Same,
    /// It goes: there is no clay.
    Nothing,
    /// Another takes its place.
    New(Box<Mesh>, Aabb),
}

impl Extracted {
    /// The surface of a state; the one `before` goes on where it stands for that.
    ///
    /// # Errors
    /// The state is lost with its device.
    fn new(make: Deferred<SurfaceSource>, tier: Tier, state: State, before: Option<ClaySurface>) -> Result<Self, StateLost> {
        let began = Instant::now();
        let settings = SurfaceSettings::new(tier);
        let source = make()?;
        let (field, grains) = match state.is_shown {
            true => grains::field_and_grains(&source, &settings),
            false => (Field::of_particles(&source, &settings), vec![]),
        };
        if let Some(before) = before.filter(|b| b.is_still(&field, &grains, state, source.domain.cell_width)) {
            return Ok(Self { surface: ClaySurface { state, ..before }, drawn: Draw::Same });
        }
        let mesh =
            state.is_shown.then(|| extract_by(&field, settings.iso_threshold, &Rules::new(settings.method), settings.normals));
        let bounds = mesh.as_ref().map_or_else(|| field.bounds(settings.iso_threshold), Surface::bounds);
        let all = mesh.map(|mesh| grains::Extraction { mesh, grains: grains.clone() });
        let drawn = all.as_ref().map_or(Draw::Same, |all| {
            let all = all.drawn();
            match all.bounds() {
                Some((low, high)) => Draw::New(Box::new(asset(all)), Aabb::from_min_max(low.as_vec3(), high.as_vec3())),
                None => Draw::Nothing,
            }
        });
        let (mesh, field) = (all.map(|all| Arc::new(all.mesh)), Arc::new(field));
        let extract_ms = began.elapsed().as_secs_f64() * 1e3;
        let surface = ClaySurface { mesh, grains: grains.into(), field, settings, bounds, state, extract_ms };
        Ok(Self { surface, drawn })
    }
}

/// The asset of a surface. The copy on the graphics device is enough; apps read [`ClaySurface`].
fn asset(drawn: Surface) -> Mesh {
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, drawn.positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, drawn.normals.unwrap_or_default())
        .with_inserted_indices(Indices::U32(drawn.triangles.into_flattened()))
}

/// Has surfaces made on the processor, and shows them in apps that have meshes. Without it there is no
/// [`ClaySurface`] to point at, and clay is drawn only where the graphics device makes its surface, without a
/// material unless the app gives one.
#[derive(Clone, Copy, Debug, Default)]
pub struct ShowPlugin;

impl Plugin for ShowPlugin {
    fn build(&self, app: &mut App) {
        app.register_required_components::<Clay, Extracting>();
        app.register_type::<NoAutoMaterial>()
            .add_observer(end)
            .add_systems(Update, (swap, request, material::dress).chain().in_set(ClaySystems::Show));
    }
}

/// Ends what is shown of a [`Clay`] that goes.
fn end(gone: On<Remove, Clay>, mut commands: Commands) {
    commands.entity(gone.entity).try_remove::<(Extracting, ClaySurface)>().queue_silenced(entity::hide);
}

/// What a clay shows now.
type Shown<'a> = (Option<&'a Mesh3d>, Option<&'a ShownMesh>, Has<DrawnByDevice>);

/// Swaps in the surfaces that are ready; drops those of a clay that has been replaced since.
pub(super) fn swap(
    mut clays: Query<(Entity, &ClaySettings, &ClayEngine, &mut Extracting, Shown), With<Clay>>,
    mut meshes: Option<ResMut<Assets<Mesh>>>,
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let Some(meshes) = &mut meshes else { return };
    for (entity, settings, engine, mut extraction, (mesh, shown, is_drawn)) in &mut clays {
        let Some((state, task)) = &mut extraction.under_way else { continue };
        let Some(new) = check_ready(task) else { continue };
        let state = *state;
        extraction.under_way = None;
        // What is lost with its device is asked for again, of the engine that goes on.
        let Ok(new) = new else { continue };
        // A clay about to be replaced keeps what it shows until the next one is there.
        if state.generation != engine.generation || engine.is_leaving() || settings.mesh == MeshQuality::Off {
            continue;
        }
        let mut entity = commands.entity(entity);
        entity.queue_silenced(entity::put(new.surface));
        if is_drawn {
            // The device makes what is shown; this is to point at.
            continue;
        }
        let (asset, bounds) = match new.drawn {
            Draw::New(asset, bounds) => (*asset, bounds),
            Draw::Same => continue,
            Draw::Nothing => {
                entity.queue_silenced(entity::hide);
                continue;
            }
        };
        let handle = match shown.and_then(|shown| shown.own(mesh)) {
            Some(own) => {
                // Fails only for an asset that is gone, which a strong handle rules out.
                let _ = meshes.insert(own.id(), asset);
                own.clone()
            }
            None => meshes.add(asset),
        };
        entity.queue_silenced(entity::show(handle, bounds));
    }
}

/// What is shown, and on its way.
type Showing<'a> = (&'a mut Extracting, Option<&'a ClaySurface>, Has<ShownMesh>, Has<DrawnByDevice>);

/// Asks for the surface of each clay that changed since the last one, one at a time; clay at rest asks for
/// nothing.
pub(super) fn request(
    mut clays: Query<(Entity, &ClaySettings, &ClayEngine, Showing), With<Clay>>,
    meshes: Option<Res<Assets<Mesh>>>,
    device: Option<Res<DeviceNumber>>,
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let device = device.map(|number| *number);
    if meshes.is_none() {
        return;
    }
    for (entity, settings, engine, (mut extraction, surface, has_mesh, is_drawn)) in &mut clays {
        let tier = match settings.mesh {
            MeshQuality::Off => {
                if surface.is_some() || has_mesh {
                    commands.entity(entity).try_remove::<ClaySurface>().queue_silenced(entity::hide);
                }
                continue;
            }
            // Good enough to point at.
            _ if is_drawn => Tier::Coarse,
            MeshQuality::Coarse => Tier::Coarse,
            MeshQuality::Fine => Tier::Fine,
        };
        let (generation, revision) = (engine.generation, engine.revision);
        let state = State { generation, revision, quality: settings.mesh, is_shown: !is_drawn, device };
        if extraction.under_way.is_none()
            && !engine.is_leaving()
            && engine.is_readable()
            && surface.is_none_or(|s| s.state != state)
            && let Some(make) = engine.surface_deferred()
        {
            let before = surface.cloned();
            let task = AsyncComputeTaskPool::get().spawn(async move { Extracted::new(make, tier, state, before) });
            extraction.under_way = Some((state, task));
        }
    }
}
