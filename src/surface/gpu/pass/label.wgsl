// Takes the values of blocks that have others. Rules 0 to 3: which body a node is of, who owns it, its own
// value, whether it is inside.

@group(0) @binding(8) var<storage, read> fields: array<f32>;
@group(0) @binding(9) var<storage, read_write> cells: array<u32>;
@group(0) @binding(10) var<storage, read_write> kept: array<f32>;
@group(0) @binding(23) var<storage, read> work: array<Work>;

// 0.
fn body_at(slot: u32, j: u32) -> u32 {
    if status.has_bodies == 0u { return 0u; }
    let list = list_first(slot);
    var body = NOBODY;
    var greatest = 0.0;
    for (var i = 0u; i < cells[list + 1u]; i++) {
        let value = kept[body_first(slot, cells[list + 2u + i]) + j];
        if value > greatest {
            greatest = value;
            body = cells[list + 2u + i];
        }
    }
    return body;
}

fn label_node(slot: u32, j: u32) {
    let first = plane_first(slot, 0u) + j;
    let sheet_count = min(status.sheet_count, params.sheet_capacity);
    var body = body_at(slot, j);
    var total = kept[first];
    if body != NOBODY { total = kept[body_first(slot, body) + j]; }
    var least = total;
    for (var s = 0u; s < sheet_count; s++) {
        if !is_cut_in(s, body) { continue; }
        let front = kept[first + (2u * s + 1u) * 512u];
        let back = kept[first + (2u * s + 2u) * 512u];
        let owner = owner_of(total, front, back);
        if owner != 0u { least = min(least, side_value(total, front + back, select(front, back, owner == 1u))); }
    }
    var label = 0u;
    var count = 0u;
    var own = total;
    for (var s = 0u; s < sheet_count; s++) {
        if !is_cut_in(s, body) { continue; }
        let front = kept[first + (2u * s + 1u) * 512u];
        let back = kept[first + (2u * s + 2u) * 512u];
        let owner = owner_of(least, front, back);
        if owner == 0u || count == CUTS_MAX { continue; }
        label |= (((status.sheets[s] & 255u) << 1u) | select(0u, 1u, owner == 1u)) << (1u + 9u * count);
        count++;
        own *= side_value(total, front + back, select(front, back, owner == 1u)) / total;
    }
    // To Equation 9 a cut makes values, and parts nothing.
    if params.method == 1u {
        label = 0u;
        body = 0u;
    }
    let cell = cells_first(slot) + j;
    cells[cell] = label | u32(own > params.iso);
    cells[cell + 512u] = bitcast<u32>(own);
    cells[cell + 1536u] = body;
}

// All values of a node are of one frame: those of a cut's sides must not outlast the clay.
fn take_values(slot: u32, j: u32, values: u32) {
    var is_taken = status.is_all != 0u;
    let count = plane_count() + page_count(slot);
    for (var number = 0u; number < count; number++) {
        let at = values_first(slot, number) + j;
        if (values & NEW) != 0u { kept[at] = 0.0; }
        is_taken = is_taken || ((values & TAKEN) != 0u && abs(fields[at] - kept[at]) > CHANGE_MIN);
    }
    for (var number = 0u; is_taken && number < count; number++) {
        let at = values_first(slot, number) + j;
        kept[at] = fields[at];
    }
}

@compute @workgroup_size(256)
fn label(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = work[group.x].slot;
    let values = work[group.x].values;
    if values == 0u || work[group.x].entry == NONE { return; }
    for (var j = k; j < 512u; j += 256u) {
        take_values(slot, j, values);
        label_node(slot, j);
    }
}
