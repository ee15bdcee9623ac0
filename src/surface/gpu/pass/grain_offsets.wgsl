// Grains before those of each workgroup; how many there are in all. Workgroups of the pass that draws them:
// none if there is nothing to draw.

@group(0) @binding(17) var<storage, read_write> dispatch: array<u32>;
@group(0) @binding(21) var<storage, read_write> grain_counts: array<u32>;

const GROUPS_ALONG: u32 = 32768u; // of a dispatch, along an axis: a device takes 65,535 at least

var<workgroup> partial: array<u32, 256>;

@compute @workgroup_size(256)
fn grain_offsets(@builtin(local_invocation_index) k: u32) {
    let groups = (params.particle_count + 63u) / 64u;
    let each = (groups + 255u) / 256u;
    let first = min(k * each, groups);
    let last = min(first + each, groups);
    var sum = 0u;
    for (var j = first; j < last; j++) { sum += grain_counts[j]; }
    partial[k] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var j = 0u; j < k; j++) { before += partial[j]; }
    for (var j = first; j < last; j++) {
        let own = grain_counts[j];
        grain_counts[j] = before;
        before += own;
    }
    if k == 255u {
        status.found_grains = before;
        // Those that are gone are to be forgotten.
        let count = select(0u, groups, before > 0u || status.grain_count > 0u || status.is_all != 0u);
        dispatch[20] = min(count, GROUPS_ALONG);
        dispatch[21] = (count + GROUPS_ALONG - 1u) / GROUPS_ALONG;
        dispatch[22] = 1u;
    }
}
