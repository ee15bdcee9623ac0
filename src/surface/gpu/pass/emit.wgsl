// Vertices and indices of each block. Vertices on a block's faces stand in each block that has them, with the
// same bits.

@group(0) @binding(10) var<storage, read> kept: array<f32>;
@group(0) @binding(12) var<storage, read> regions: array<Region>;
@group(0) @binding(13) var<storage, read_write> vertices: array<u32>;
@group(0) @binding(14) var<storage, read_write> indices: array<u32>;

var<workgroup> used: array<atomic<u32>, 137>;
var<workgroup> used_before: array<u32, 137>;
var<workgroup> cell_first: array<u32, 512>; // triangles of each cell, then of those before it
var<private> found: u32;
var<private> is_writing: bool;
var<private> next: u32; // where the next index goes
var<private> vertex_first: u32;

fn mark_used(place: u32) {
    atomicOr(&used[place >> 5u], 1u << (place & 31u));
}

fn vertex_index(place: u32) -> u32 {
    let word = place >> 5u;
    let below = atomicLoad(&used[word]) & ((1u << (place & 31u)) - 1u);
    return vertex_first + used_before[word] + countOneBits(below);
}

fn triangle(a: u32, b: u32, c: u32) {
    if !is_writing {
        mark_used(a);
        mark_used(b);
        mark_used(c);
        found++;
        return;
    }
    indices[next] = vertex_index(a);
    indices[next + 1u] = vertex_index(b);
    indices[next + 2u] = vertex_index(c);
    next += 3u;
}

@compute @workgroup_size(256)
fn emit(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let region = regions[work[group.x].slot];
    empty(region.left.x, region.left.y, k);
    empty(region.first.y + region.count.y, region.room.y - region.count.y, k);
    // With nothing in it, perhaps without a block.
    if region.count.y == 0u { return; }
    let block = block_of(work[group.x].entry);
    find_neighbours(block, k);
    for (var j = k; j < 512u; j += 256u) {
        found = 0u;
        walk(local_node(j));
        cell_first[j] = found;
    }
    workgroupBarrier();
    if k == 0u {
        var sum = 0u;
        for (var j = 0u; j < 137u; j++) {
            used_before[j] = sum;
            sum += countOneBits(atomicLoad(&used[j]));
        }
    } else if k == 1u {
        var sum = 0u;
        for (var j = 0u; j < 512u; j++) {
            let own = cell_first[j];
            cell_first[j] = sum;
            sum += own;
        }
    }
    workgroupBarrier();
    is_writing = true;
    vertex_first = region.first.x;
    for (var j = k; j < 512u; j += 256u) {
        next = params.index_start + 3u * (region.first.y + cell_first[j]);
        walk(local_node(j));
    }
    for (var word = k; word < 137u; word += 256u) {
        var bits = atomicLoad(&used[word]);
        var at = vertex_first + used_before[word];
        while bits != 0u {
            write_vertex(block, 32u * word + countTrailingZeros(bits), at);
            bits &= bits - 1u;
            at++;
        }
    }
}

// So many triangles without a size.
fn empty(first: u32, count: u32, k: u32) {
    for (var i = k; i < 3u * count; i += 256u) { indices[params.index_start + 3u * first + i] = 0u; }
}

fn write_vertex(block: vec3i, place: u32, at: u32) {
    let edge = place >> 1u;
    let axis = edge % 3u;
    let tile = edge / 3u;
    let low = vec3i(vec3u(tile % 9u, (tile / 9u) % 9u, tile / 81u));
    let is_plain = !is_split(low, axis);
    let variant = select(1u + (place & 1u), 0u, is_plain);
    let t = crossing(low, axis);
    let node = 8 * block + low;
    let position = params.origin + params.spacing * (vec3f(node) + point_of(low, axis, t));
    let slope = normal_at(low, axis, variant, t);
    let size = length(slope);
    let normal = select(vec3f(0.0, 1.0, 0.0), slope / size, size > 1e-20);
    let extent = vec3u(params.blocks) * 8u;
    let n = vec3u(node + 8);
    let number = ((n.x + extent.x * (n.y + extent.y * n.z)) * 3u + axis) * 3u + variant;
    let first = params.vertex_start + VERTEX_WORDS * at;
    for (var d = 0u; d < 3u; d++) {
        vertices[first + d] = bitcast<u32>(position[d]);
        vertices[first + 3u + d] = bitcast<u32>(normal[d]);
    }
    vertices[first + 6u] = number;
}
