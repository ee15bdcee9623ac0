// Planes for the cuts with clay on both sides, by number; workgroups of the passes that go by blocks: 0
// fields, and of what is left out if nothing has changed 4 all slots, 8 blocks to be extracted, 12 once, 16
// blocks to be written if there is room for the mesh; 20, particles if there are grains, by another pass.

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
    let is_anew = params.is_forced != 0u || status.is_stale != 0u;
    var is_all = is_anew;
    for (var sheet = 1u; sheet < 256u; sheet++) {
        let word = sheet >> 5u;
        let both = atomicLoad(&status.sides[word]) & atomicLoad(&status.sides[8u + word]);
        planes[sheet] = 0u;
        if ((both >> (sheet & 31u)) & 1u) == 0u { continue; }
        count++;
        if count <= params.sheet_capacity {
            planes[sheet] = count;
            is_all = is_all || status.sheets[count - 1u] != sheet;
            status.sheets[count - 1u] = sheet;
        } else {
            atomicOr(&status.flags, SHEETS_FULL);
        }
    }
    status.sheet_count = count;
    is_all = is_all || count != status.kept_sheets;
    status.is_all = select(u32(is_all), ANEW, is_anew);
    if is_all { atomicStore(&status.is_changed, 1u); }
    status.slot_span = max(status.slot_limits[1], status.kept_slots);
    put(0u, status.slot_span, plane_count());
    put(4u, (status.slot_span + 63u) / 64u, 1u);
    put(8u, 0u, 1u);
    put(12u, 1u, 1u);
    put(16u, 0u, 1u);
}
