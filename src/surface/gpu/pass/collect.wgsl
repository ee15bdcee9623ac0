// Blocks whose mesh may be another: those with other values, those beside them, those that came or went.

@group(0) @binding(4) var<storage, read> blocks: array<u32>;
@group(0) @binding(24) var<storage, read> changes: array<u32>;
@group(0) @binding(11) var<storage, read_write> kept_blocks: array<u32>;
@group(0) @binding(17) var<storage, read_write> dispatch: array<atomic<u32>>;
@group(0) @binding(23) var<storage, read_write> work: array<Work>; // in any order

// Whether values have changed that this block sees, its own or a neighbour's.
fn is_near_change(block: vec3i) -> bool {
    for (var n = 0; n < 27; n++) {
        let d = vec3i(n % 3, (n / 3) % 3, n / 9) - 1;
        if !has_entry(block + d) { continue; }
        // The neighbour ahead is seen at its low side.
        let side = select(vec3u(0u), vec3u(1u), d == vec3i(1)) | select(vec3u(0u), vec3u(2u), d == vec3i(-1));
        let sides = 1u | (side.x << 1u) | (side.y << 3u) | (side.z << 5u);
        if (changes[entry_of(block + d)] & sides) == sides { return true; }
    }
    return false;
}

@compute @workgroup_size(64)
fn collect(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.x;
    if slot >= status.slot_span { return; }
    let entry = blocks[slot];
    let is_new = entry != kept_blocks[slot];
    kept_blocks[slot] = entry;
    var values = select(0u, NEW, is_new);
    if entry != NONE {
        if status.is_all != 0u || (changes[entry] & 1u) != 0u { values |= TAKEN; }
        if values == 0u && !is_near_change(block_of(entry)) { return; }
    } else if !is_new {
        return;
    }
    work[atomicAdd(&dispatch[8], 1u)] = Work(slot, entry, values);
}
