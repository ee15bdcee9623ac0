//! The compiled passes, and one surface with its buffers.

use super::super::field::{Filter, SurfaceSettings};
use super::super::labels::CutMethod;
use super::buffers::{Buffers, Level, SurfaceRoom};
use super::layout::Params;
use super::wgsl::{Id, PASSES, Pass, compose};
use crate::sim::gpu::kernel::Kernel;
use crate::sim::gpu::{GpuError, guarded};
use crate::sim::params::Domain;
use glam::IVec3;
use std::sync::Arc;

/// The compiled passes, for any number of surfaces on a device.
#[derive(Clone, Debug)]
pub struct SurfaceKernels {
    pub(super) device: wgpu::Device,
    kernels: Arc<Vec<Kernel>>,
}

impl SurfaceKernels {
    /// Compiles the passes; seconds on software adapters.
    ///
    /// # Errors
    /// What the device refused.
    pub fn new(device: &wgpu::Device) -> Result<Self, GpuError> {
        let compile =
            |pass: &Pass| guarded(device, &format!("pass {}", pass.name), || Kernel::new(device, pass.entry, compose(pass)));
        let kernels = PASSES.iter().map(compile).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { device: device.clone(), kernels: Arc::new(kernels) })
    }

    pub(super) fn get(&self, id: Id) -> &Kernel {
        &self.kernels[id as usize]
    }
}

/// The surface of one clay: its buffers on the device.
#[derive(Debug)]
pub struct GpuSurface {
    pub(super) kernels: SurfaceKernels,
    pub(super) buffers: Buffers,
    pub(super) params: [Params; 2],
    pub(super) room: SurfaceRoom,
    pub(super) has_grains: bool,
    /// Particles of the last run; none yet.
    pub(super) count_before: Option<u32>,
}

impl GpuSurface {
    /// A surface for up to `particle_count` particles in `domain`. `settings.normals` is taken for granted.
    ///
    /// # Errors
    /// More memory than the device has, or than one buffer may have.
    pub fn new(
        kernels: &SurfaceKernels,
        domain: &Domain,
        particle_count: u32,
        settings: &SurfaceSettings,
        room: SurfaceRoom,
    ) -> Result<Self, GpuError> {
        Self::make(kernels, domain, particle_count, settings, room, false)
    }

    /// [`Self::new`], with a ball behind the mesh for each particle that the surface does not show: what
    /// [`Extraction::drawn`](super::super::grains::Extraction::drawn) is on the processor.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn with_grains(
        kernels: &SurfaceKernels,
        domain: &Domain,
        particle_count: u32,
        settings: &SurfaceSettings,
        room: SurfaceRoom,
    ) -> Result<Self, GpuError> {
        Self::make(kernels, domain, particle_count, settings, room, true)
    }

    fn make(
        kernels: &SurfaceKernels,
        domain: &Domain,
        particle_count: u32,
        settings: &SurfaceSettings,
        room: SurfaceRoom,
        has_grains: bool,
    ) -> Result<Self, GpuError> {
        let params = [Level::Cells, Level::Visual].map(|level| params(domain, settings, room, level));
        let params = params.map(|p| Params { has_grains: u32::from(has_grains), ..p });
        let entries = params.map(|p| p.blocks.iter().product::<i32>().cast_unsigned());
        let make = || Buffers::new(&kernels.device, particle_count, entries, room, has_grains);
        let buffers = guarded(&kernels.device, "the surface's buffers", make)??;
        Ok(Self { kernels: kernels.clone(), buffers, params, room, has_grains, count_before: None })
    }

    /// How much there is room for.
    pub fn room(&self) -> SurfaceRoom {
        self.room
    }

    /// Holds a [`SurfaceStatus`](super::SurfaceStatus) after each run; may be copied from.
    pub fn status_buffer(&self) -> &wgpu::Buffer {
        &self.buffers.status
    }
}

/// What the passes know of the clay's room and the settings; particles and mesh are filled in for each run.
fn params(domain: &Domain, settings: &SurfaceSettings, room: SurfaceRoom, level: Level) -> Params {
    let lattice = settings.lattice();
    let (scale, shift, reach) = match level {
        Level::Cells => (1.0, 0.0, (0, 2)),
        Level::Visual => (lattice.scale, lattice.shift, lattice.reach()),
    };
    let cells = domain.grid_cells();
    // Blocks of the nodes that a particle anywhere in the grid reaches, the first one at -1.
    let highest = cells.as_vec3() * scale + reach.1 as f32 + 2.0;
    let blocks = highest.map(f32::ceil).as_ivec3().map(|n| n.div_euclid(8)) + IVec3::splat(3);
    let filter: &Filter = &lattice.filter;
    let mut taps = [0.0; 8];
    taps[..filter.taps.len()].copy_from_slice(&filter.taps);
    let (slot_capacity, number) = match level {
        Level::Cells => (room.cell_blocks, 0),
        Level::Visual => (room.blocks, 1),
    };
    Params {
        blocks: blocks.to_array(),
        particle_count: 0,
        usable: cells.as_vec3().to_array(),
        spacing: (domain.cell_width / f64::from(lattice.scale)) as f32,
        origin: domain.origin.as_vec3().to_array(),
        iso: settings.iso_threshold,
        scale,
        shift,
        reach_low: reach.0,
        reach_high: reach.1,
        density_exponent: settings.density_exponent,
        first: filter.first,
        tap_count: filter.taps.len() as u32,
        slot_capacity,
        taps,
        sheet_capacity: room.sheets,
        vertex_start: 0,
        vertex_capacity: 0,
        index_start: 0,
        index_capacity: 0,
        is_forced: 0,
        level: number,
        method: u32::from(settings.method == CutMethod::Equation9),
        has_grains: 0,
        cell_width: domain.cell_width as f32,
        body_capacity: room.bodies,
        page_capacity: room.pages,
    }
}
