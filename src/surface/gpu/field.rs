//! Fields to and from the device, for tests that compare it with the processor.

use super::super::field::{Field, SheetField};
use super::super::grid::{BLOCK_NODES, BlockGrid, NodeValues};
use super::GpuSurface;
use super::layout::SurfaceStatus;
use bytemuck::Zeroable;
use glam::{DVec3, IVec3};

impl GpuSurface {
    /// Puts fields there instead of a clay's. The grid's blocks must begin at -1 and be as many as this surface's domain has, or fewer.
    #[doc(hidden)]
    pub fn load_field(&mut self, queue: &wgpu::Queue, field: &Field) {
        let extent = IVec3::from_array(self.params[1].blocks);
        let mut table = vec![0u32; extent.element_product() as usize];
        let mut entries = vec![];
        let planes = 1 + 2 * self.room.sheets as usize;
        let slots = field.grid.blocks().len();
        let mut values = vec![0.0f32; slots * planes * BLOCK_NODES];
        for (slot, block) in field.grid.blocks().iter().enumerate() {
            let b = *block + 1;
            let entry = (b.z * extent.y + b.y) * extent.x + b.x;
            table[entry as usize] = slot as u32 + 1;
            entries.push(entry.cast_unsigned());
            let sheets = field.sheets.iter().flat_map(|s| [&s.front, &s.back]);
            for (plane, from) in std::iter::once(&field.total).chain(sheets).enumerate() {
                if let Some(block) = from.block(slot) {
                    values[(slot * planes + plane) * BLOCK_NODES..][..BLOCK_NODES].copy_from_slice(block);
                }
            }
        }
        let count = slots as u32;
        let mut status =
            SurfaceStatus { sheet_count: field.sheets.len() as u32, slot_counts: [0, count], ..SurfaceStatus::zeroed() };
        field.sheets.iter().zip(&mut status.sheets).for_each(|(s, number)| *number = u32::from(s.sheet));
        let dispatch = [count, 1, 1, 0, count, 1, 1, 0, count, 1, 1, 0, 1, 1, 1, 0, count, 1, 1, 0];
        queue.write_buffer(&self.buffers.tables[1], 0, bytemuck::cast_slice(&table));
        queue.write_buffer(&self.buffers.blocks[1], 0, bytemuck::cast_slice(&entries));
        queue.write_buffer(&self.buffers.fields, 0, bytemuck::cast_slice(&values));
        queue.write_buffer(&self.buffers.status, 0, bytemuck::bytes_of(&status));
        queue.write_buffer(&self.buffers.dispatch, 0, bytemuck::cast_slice(&dispatch));
        for params in &mut self.params {
            (params.origin, params.spacing) = (field.origin.as_vec3().to_array(), field.spacing as f32);
        }
    }

    /// The buffers that [`Self::field_of`] reads: blocks, fields.
    #[doc(hidden)]
    pub fn field_buffers(&self) -> [&wgpu::Buffer; 2] {
        [&self.buffers.blocks[1], &self.buffers.fields]
    }

    /// The fields of the last run, from the status and the bytes of the buffers.
    #[doc(hidden)]
    pub fn field_of(&self, status: &SurfaceStatus, blocks: &[u32], values: &[f32]) -> Field {
        let extent = IVec3::from_array(self.params[1].blocks);
        let slots = status.slot_counts[1] as usize;
        let stored: std::collections::HashSet<u32> = blocks[..slots].iter().copied().collect();
        let grid = BlockGrid::new(IVec3::splat(-1), extent, |entry| stored.contains(&(entry as u32)));
        let planes = 1 + 2 * self.room.sheets as usize;
        let plane = |plane: usize| {
            NodeValues::new(
                slots,
                |_| true,
                |slot, out| {
                    out.copy_from_slice(&values[(slot * planes + plane) * BLOCK_NODES..][..BLOCK_NODES]);
                },
            )
        };
        let sheet = |s: usize| SheetField { sheet: status.sheets[s] as u8, front: plane(2 * s + 1), back: plane(2 * s + 2) };
        Field {
            grid,
            total: plane(0),
            sheets: (0..status.sheet_count as usize).map(sheet).collect(),
            origin: DVec3::from_array(self.params[1].origin.map(f64::from)),
            spacing: f64::from(self.params[1].spacing),
        }
    }
}
