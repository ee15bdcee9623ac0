//! Fields to and from the device, for tests that compare it with the processor.

use super::super::bodies::BodyField;
use super::super::closure::Closure;
use super::super::field::Field;
use super::super::grid::{BLOCK_NODES, BlockGrid, NodeValues};
use super::super::sheets::SheetField;
use super::layout::{LIST_FIRST, SurfaceStatus, cell_words};
use super::surface::GpuSurface;
use bytemuck::Zeroable;
use glam::{DVec3, IVec3};
use std::collections::BTreeSet;

impl GpuSurface {
    /// Puts fields there instead of a clay's. The grid's blocks must begin at -1 and be as many as this
    /// surface's domain has, or fewer.
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
        let sheet_count = field.sheets.len() as u32;
        let (slot_counts, kept_slots, is_all) = ([0, count], count, 1);
        let mut status = SurfaceStatus { sheet_count, slot_counts, kept_slots, is_all, ..SurfaceStatus::zeroed() };
        field.sheets.iter().zip(&mut status.sheets).for_each(|(s, number)| *number = u32::from(s.sheet));
        let dispatch = [0, 1, 1, 0, 0, 1, 1, 0, count, 1, 1, 0, 1, 1, 1, 0, 0, 1, 1, 0];
        // 2: with these values.
        let work: Vec<[u32; 3]> = entries.iter().zip(0..).map(|(entry, slot)| [slot, *entry, 2]).collect();
        let regions = vec![0u8; self.buffers.regions.size() as usize];
        queue.write_buffer(&self.buffers.tables[1], 0, bytemuck::cast_slice(&table));
        queue.write_buffer(&self.buffers.blocks[1], 0, bytemuck::cast_slice(&entries));
        queue.write_buffer(&self.buffers.work, 0, bytemuck::cast_slice(&work));
        queue.write_buffer(&self.buffers.regions, 0, &regions);
        queue.write_buffer(&self.buffers.fields, 0, bytemuck::cast_slice(&values));
        queue.write_buffer(&self.buffers.status, 0, bytemuck::bytes_of(&status));
        queue.write_buffer(&self.buffers.dispatch, 0, bytemuck::cast_slice(&dispatch));
        for params in &mut self.params {
            (params.origin, params.spacing) = (field.origin.as_vec3().to_array(), field.spacing as f32);
        }
    }

    /// The buffers that [`Self::field_of`] reads, of the last run: blocks, cells, fields.
    #[doc(hidden)]
    pub fn field_buffers(&self) -> [&wgpu::Buffer; 3] {
        [&self.buffers.blocks[1], &self.buffers.cells, &self.buffers.fields]
    }

    /// [`Self::field_buffers`] of the mesh: each block's values are those of its last extraction.
    #[doc(hidden)]
    pub fn kept_field_buffers(&self) -> [&wgpu::Buffer; 3] {
        [&self.buffers.kept_blocks, &self.buffers.cells, &self.buffers.kept]
    }

    /// Fields, from the status and the words of the buffers.
    #[doc(hidden)]
    pub fn field_of(&self, status: &SurfaceStatus, [blocks, cells, values]: [&[u32]; 3]) -> Field {
        let extent = IVec3::from_array(self.params[1].blocks);
        // By entry, as the grid has them.
        let mut stored: Vec<(u32, usize)> = blocks.iter().copied().zip(0..).filter(|(entry, _)| *entry != u32::MAX).collect();
        stored.sort_unstable();
        let is_stored = |entry: usize| stored.binary_search_by_key(&(entry as u32), |block| block.0).is_ok();
        let grid = BlockGrid::new(IVec3::splat(-1), extent, is_stored);
        let planes = 1 + 2 * self.room.sheets as usize;
        let plane = |plane: usize| {
            NodeValues::new(
                stored.len(),
                |_| true,
                |block, out| {
                    let values = &values[(stored[block].1 * planes + plane) * BLOCK_NODES..][..BLOCK_NODES];
                    out.copy_from_slice(bytemuck::cast_slice(values));
                },
            )
        };
        let slots: Vec<usize> = stored.iter().map(|block| block.1).collect();
        let bodies = if status.has_bodies == 0 { vec![] } else { self.bodies_of(&slots, cells, values) };
        let sheet = |s: usize| {
            let (body, sheet) = (status.sheets[s] >> 8, status.sheets[s] as u8);
            SheetField { body, sheet, front: plane(2 * s + 1), back: plane(2 * s + 2) }
        };
        let total = plane(0);
        let sheets: Vec<_> = (0..status.sheet_count as usize).map(sheet).collect();
        let is_fine = self.params[1].scale > 1.0;
        let closure = if is_fine { Closure::new(&grid, &total, &bodies, &sheets) } else { Closure::default() };
        let origin = DVec3::from_array(self.params[1].origin.map(f64::from));
        Field { grid, total, bodies, sheets, closure, origin, spacing: f64::from(self.params[1].spacing) }
    }

    /// The bodies near the slots of some blocks.
    fn bodies_of(&self, slots: &[usize], cells: &[u32], values: &[u32]) -> Vec<BodyField> {
        let room = self.room;
        let each = cell_words(room.bodies) as usize;
        // First page and numbers.
        let list = |slot: usize| {
            let list = &cells[slot * each + LIST_FIRST as usize..];
            (list[0] as usize, &list[2..][..list[1] as usize])
        };
        let numbers: BTreeSet<u32> = slots.iter().flat_map(|slot| list(*slot).1).copied().collect();
        let pages = room.blocks as usize * (1 + 2 * room.sheets as usize);
        let field = |body: u32| {
            let near = |block: usize| list(slots[block]).1.contains(&body);
            let is_alone = |block: usize| list(slots[block]).1 == [body];
            let fill = |block: usize, out: &mut [f32]| {
                let (first, bodies) = list(slots[block]);
                let page = pages + first + bodies.partition_point(|b| *b < body);
                out.copy_from_slice(bytemuck::cast_slice(&values[page * BLOCK_NODES..][..BLOCK_NODES]));
            };
            let values = NodeValues::new(slots.len(), |block| near(block) && !is_alone(block), fill);
            BodyField { body, is_alone: (0..slots.len()).map(is_alone).collect(), values }
        };
        numbers.into_iter().map(field).collect()
    }
}
