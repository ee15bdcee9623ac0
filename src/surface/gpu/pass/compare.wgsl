// Which blocks have other values than at their last extraction, and on which sides of them. A block that is
// not there has zeros.

@group(0) @binding(4) var<storage, read> blocks: array<u32>;
@group(0) @binding(8) var<storage, read> fields: array<f32>;
@group(0) @binding(9) var<storage, read> cells: array<u32>;
@group(0) @binding(10) var<storage, read> kept: array<f32>; // fields of the last extraction
@group(0) @binding(11) var<storage, read> kept_blocks: array<u32>;
@group(0) @binding(24) var<storage, read_write> changes: array<atomic<u32>>; // by entry: bit 0, and for each axis that the block before, the block behind sees it

// A block sees 2 nodes of the one behind it, its face's and those that slopes there need, and 1 of the one
// before; of parted clay all of both, which say how closed it is.
fn sides_of(j: u32) -> u32 {
    if has_parts() { return 126u; }
    let n = vec3u(j & 7u, (j >> 3u) & 7u, j >> 6u);
    let sides = select(vec3u(0u), vec3u(1u), n < vec3u(2u)) | select(vec3u(0u), vec3u(2u), n == vec3u(7u));
    return (sides.x << 1u) | (sides.y << 3u) | (sides.z << 5u);
}

fn note(entry: u32, sides: u32) {
    if entry == NONE || sides == 0u { return; }
    atomicOr(&changes[entry], sides);
    if (sides & 1u) != 0u { atomicStore(&status.is_changed, 1u); }
}

@compute @workgroup_size(256)
fn compare(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    if status.is_all != 0u { return; }
    let slot = group.x;
    let entry = blocks[slot];
    let before = kept_blocks[slot];
    if (entry == NONE && before == NONE) || group.y >= plane_count() + page_count(slot) { return; }
    var sides = 0u;
    var sides_before = 0u;
    for (var j = k; j < 512u; j += 256u) {
        let at = values_first(slot, group.y) + j;
        let was = select(0.0, kept[at], entry == before);
        let change = abs(fields[at] - was);
        if change > CHANGE_MIN { sides |= sides_of(j) | u32(change > HYSTERESIS); }
        if entry != before && kept[at] != 0.0 { sides_before |= 1u | sides_of(j); }
    }
    note(entry, sides);
    note(before, sides_before);
}
