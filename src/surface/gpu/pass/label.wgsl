// Takes the values of blocks that have others. Rules 1 to 3: who owns a node, its own value, whether it is
// inside.

@group(0) @binding(8) var<storage, read> fields: array<f32>;
@group(0) @binding(9) var<storage, read_write> cells: array<u32>;
@group(0) @binding(10) var<storage, read_write> kept: array<f32>;
@group(0) @binding(23) var<storage, read> work: array<Work>;

fn label_node(slot: u32, j: u32) {
    let first = slot * planes_stored() * 512u + j;
    let sheet_count = min(status.sheet_count, params.sheet_capacity);
    let total = kept[first];
    var least = total;
    for (var s = 0u; s < sheet_count; s++) {
        let front = kept[first + (2u * s + 1u) * 512u];
        let back = kept[first + (2u * s + 2u) * 512u];
        let owner = owner_of(total, front, back);
        if owner != 0u { least = min(least, side_value(total, front + back, select(front, back, owner == 1u))); }
    }
    var label = 0u;
    var count = 0u;
    var own = total;
    for (var s = 0u; s < sheet_count; s++) {
        let front = kept[first + (2u * s + 1u) * 512u];
        let back = kept[first + (2u * s + 2u) * 512u];
        let owner = owner_of(least, front, back);
        if owner == 0u || count == CUTS_MAX { continue; }
        label |= ((status.sheets[s] << 1u) | select(0u, 1u, owner == 1u)) << (1u + 9u * count);
        count++;
        own *= side_value(total, front + back, select(front, back, owner == 1u)) / total;
    }
    // To Equation 9 a cut makes values, and parts nothing.
    if params.method == 1u { label = 0u; }
    cells[slot * 1536u + j] = label | u32(own > params.iso);
    cells[slot * 1536u + 512u + j] = bitcast<u32>(own);
}

// All values of a node are of one frame: those of a cut's sides must not outlast the clay.
fn take_values(slot: u32, j: u32, values: u32) {
    var is_taken = status.is_all != 0u;
    for (var plane = 0u; plane < plane_count(); plane++) {
        let at = (slot * planes_stored() + plane) * 512u + j;
        if (values & NEW) != 0u { kept[at] = 0.0; }
        is_taken = is_taken || ((values & TAKEN) != 0u && abs(fields[at] - kept[at]) > CHANGE_MIN);
    }
    for (var plane = 0u; is_taken && plane < plane_count(); plane++) {
        let at = (slot * planes_stored() + plane) * 512u + j;
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
