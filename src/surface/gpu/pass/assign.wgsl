// Planes for the cuts with clay on both sides, by number; workgroups of the passes that go by blocks: 0 fields, and of what is left out if
// nothing has changed 4 fields, 8 blocks, 12 once, 16 blocks if there is room for the mesh; 20, particles if there are grains, by another pass.

@group(0) @binding(17) var<storage, read_write> dispatch: array<u32>;
@group(0) @binding(18) var<storage, read_write> planes: array<u32>; // sheet -> 1 + its number among those with fields

fn put(at: u32, x: u32, y: u32) {
    dispatch[at] = x;
    dispatch[at + 1u] = y;
    dispatch[at + 2u] = 1u;
}

@compute @workgroup_size(1)
fn assign() {
    var count = 0u;
    for (var sheet = 1u; sheet < 256u; sheet++) {
        let word = sheet >> 5u;
        let both = atomicLoad(&status.sides[word]) & atomicLoad(&status.sides[8u + word]);
        planes[sheet] = 0u;
        if ((both >> (sheet & 31u)) & 1u) == 0u { continue; }
        count++;
        if count <= params.sheet_capacity {
            planes[sheet] = count;
            if status.sheets[count - 1u] != sheet { atomicStore(&status.is_changed, 1u); }
            status.sheets[count - 1u] = sheet;
        } else {
            atomicOr(&status.flags, SHEETS_FULL);
        }
    }
    status.sheet_count = count;
    let slots = min(status.slot_counts[1], params.slot_capacity);
    if slots != status.kept_slots || count != status.kept_sheets || params.is_forced != 0u { atomicStore(&status.is_changed, 1u); }
    put(0u, slots, plane_count());
    put(4u, slots, plane_count());
    put(8u, slots, 1u);
    put(12u, 1u, 1u);
    put(16u, slots, 1u);
}
