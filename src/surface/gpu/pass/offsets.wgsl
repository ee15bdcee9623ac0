// Where the vertices and triangles of each block begin, and how many there are with the balls behind them; room for all, or none.

@group(0) @binding(12) var<storage, read_write> counts: array<vec2u>;
@group(0) @binding(17) var<storage, read_write> dispatch: array<u32>;

var<workgroup> partial: array<vec2u, 256>;

@compute @workgroup_size(256)
fn offsets(@builtin(local_invocation_index) k: u32) {
    let slots = min(status.slot_counts[1], params.slot_capacity);
    let each = (slots + 255u) / 256u;
    let first = min(k * each, slots);
    let last = min(first + each, slots);
    var sum = vec2u(0u);
    for (var j = first; j < last; j++) { sum += counts[j]; }
    partial[k] = sum;
    workgroupBarrier();
    var before = vec2u(0u);
    for (var j = 0u; j < k; j++) { before += partial[j]; }
    for (var j = first; j < last; j++) {
        let own = counts[j];
        counts[j] = before;
        before += own;
    }
    if k == 255u {
        before += status.grain_count * ball_size(status.grain_count);
        let has_room = before.x <= params.vertex_capacity && 3u * before.y <= params.index_capacity;
        if !has_room {
            atomicOr(&status.flags, MESH_FULL);
            dispatch[16] = 0u;
            dispatch[20] = 0u;
            // What is remembered was not drawn: the next run tries again.
            status.kept_slots = 0xffffffffu;
        }
        status.index_count_before = status.index_count;
        status.vertex_count = before.x;
        status.index_count = 3u * before.y;
    }
}
