// Takes the values of blocks that have others.

@group(0) @binding(8) var<storage, read> fields: array<f32>;
@group(0) @binding(9) var<storage, read> cells: array<u32>;
@group(0) @binding(10) var<storage, read_write> kept: array<f32>;
@group(0) @binding(23) var<storage, read> work: array<Work>;

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
fn take(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = work[group.x].slot;
    let values = work[group.x].values;
    if values == 0u || work[group.x].entry == NONE { return; }
    for (var j = k; j < 512u; j += 256u) { take_values(slot, j, values); }
}
