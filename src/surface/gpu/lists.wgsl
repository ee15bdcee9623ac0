// The bodies near each block: see bodies.rs. A list for each slot, behind its cells: number of its first
// page, how many they are, their numbers in order; room for those found in this run. Where several are near,
// each has a page: 512 values behind the planes of all slots. Clay of one body in all has no lists.

const NOBODY: u32 = 0xffffffffu;

fn cells_first(slot: u32) -> u32 {
    return slot * (LIST_FIRST + 2u + 2u * params.body_capacity);
}

fn list_first(slot: u32) -> u32 {
    return cells_first(slot) + LIST_FIRST;
}

fn plane_first(slot: u32, plane: u32) -> u32 {
    return (slot * planes_stored() + plane) * 512u;
}

fn page_first(page: u32) -> u32 {
    return plane_first(params.slot_capacity, 0u) + page * 512u;
}
