// Planes for the cuts with clay on both sides, by body and sheet; workgroups of the passes that go by blocks:
// 0 fields, and of what is left out if nothing has changed 4 all slots, 8 blocks to be extracted, 12 once, 16
// blocks to be written if there is room for the mesh; 20, particles if there are grains, by another pass.

@group(0) @binding(17) var<storage, read_write> dispatch: array<u32>;
@group(0) @binding(18) var<storage, read> pairs: array<u32>; // see survey

var<private> cuts: array<u32, SHEETS_MAX>;

fn put(at: u32, x: u32, y: u32) {
    dispatch[at] = x;
    dispatch[at + 1u] = y;
    dispatch[at + 2u] = 1u;
}

// Puts those with both sides in order, as many as there is room for; how many there are.
fn find_cuts() -> u32 {
    var count = 0u;
    for (var i = 0u; i < PAIRS_MAX; i++) {
        let pair = pairs[2u * i];
        if pair == 0u || pairs[2u * i + 1u] != 3u { continue; }
        var at = min(count, params.sheet_capacity);
        count++;
        while at > 0u && cuts[at - 1u] > pair {
            if at < params.sheet_capacity { cuts[at] = cuts[at - 1u]; }
            at--;
        }
        if at < params.sheet_capacity { cuts[at] = pair; }
    }
    return count;
}

@compute @workgroup_size(1)
fn assign() {
    let is_anew = params.is_forced != 0u || status.is_stale != 0u;
    var is_all = is_anew || status.is_relisted != 0u || status.has_bodies != status.kept_bodies;
    let count = find_cuts();
    if count > params.sheet_capacity { atomicOr(&status.flags, SHEETS_FULL); }
    for (var i = 0u; i < min(count, params.sheet_capacity); i++) {
        is_all = is_all || status.sheets[i] != cuts[i];
        status.sheets[i] = cuts[i];
    }
    status.sheet_count = count;
    is_all = is_all || count != status.kept_sheets;
    status.is_all = select(u32(is_all), ANEW, is_anew);
    if is_all { atomicStore(&status.is_changed, 1u); }
    status.slot_span = max(status.slot_limits[1], status.kept_slots);
    put(0u, status.slot_span, plane_count() + status.body_most);
    put(4u, (status.slot_span + 63u) / 64u, 1u);
    put(8u, 0u, 1u);
    put(12u, 1u, 1u);
    put(16u, 0u, 1u);
}
