// Vertices and triangles of each block.

@group(0) @binding(12) var<storage, read_write> regions: array<Region>;

var<workgroup> used: array<atomic<u32>, 137>; // a bit for each place of a vertex
var<workgroup> triangle_count: atomic<u32>;
var<private> found: u32;

fn mark_used(place: u32) {
    atomicOr(&used[place >> 5u], 1u << (place & 31u));
}

fn triangle(a: u32, b: u32, c: u32) {
    mark_used(a);
    mark_used(b);
    mark_used(c);
    found++;
}

@compute @workgroup_size(256)
fn count(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = work[group.x].slot;
    let entry = work[group.x].entry;
    if entry == NONE {
        if k == 0u { regions[slot].count = vec2u(0u); }
        return;
    }
    find_neighbours(block_of(entry), k);
    for (var j = k; j < 512u; j += 256u) { walk(local_node(j)); }
    atomicAdd(&triangle_count, found);
    workgroupBarrier();
    if k == 0u {
        var vertex_count = 0u;
        for (var j = 0u; j < 137u; j++) { vertex_count += countOneBits(atomicLoad(&used[j])); }
        regions[slot].count = vec2u(vertex_count, atomicLoad(&triangle_count));
    }
}
