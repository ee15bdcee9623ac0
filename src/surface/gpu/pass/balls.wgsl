// A ball for each grain, behind the surface's vertices and indices, in the order of the particles: the
// polyhedra of balls.rs. Remembers the grains.

@group(0) @binding(13) var<storage, read_write> vertices: array<u32>;
@group(0) @binding(14) var<storage, read_write> indices: array<u32>;
@group(0) @binding(19) var<storage, read> grains: array<f32>;
@group(0) @binding(20) var<storage, read_write> kept_grains: array<vec4f>; // of the last extraction: place [cells], share
@group(0) @binding(21) var<storage, read> grain_counts: array<u32>;

const GOLDEN_RATIO: f32 = 1.618034;

var<workgroup> is_grain: array<u32, 64>;

fn sign_of(bit: u32) -> f32 {
    return 1.0 - 2.0 * f32(bit & 1u);
}

fn direction(vertex: u32, is_round: bool) -> vec3f {
    var d = vec3f(0.0);
    if is_round {
        let axis = vertex / 4u;
        d[(axis + 1u) % 3u] = sign_of(vertex);
        d[(axis + 2u) % 3u] = sign_of(vertex >> 1u) * GOLDEN_RATIO;
        return d / sqrt(1.0 + GOLDEN_RATIO * GOLDEN_RATIO);
    }
    d[vertex / 2u] = sign_of(vertex);
    return d;
}

// Corners of the triangles, 4 bits each.
fn icosahedron_word(n: u32) -> u32 {
    var words = array<u32, 8>(1075184656u, 427845896u, 2870698314u, 2188583762u, 949131045u, 3124212645u, 2522499156u, 46951u);
    return words[n];
}

fn octahedron_word(n: u32) -> u32 {
    var words = array<u32, 3>(1076167712u, 306270979u, 890515794u);
    return words[n];
}

fn write_ball(i: u32, rank: u32, share: f32) {
    let count = status.grain_count;
    let size = ball_size(count);
    let is_round = count <= ROUND_MAX;
    let centre = params.origin + params.cell_width * place_of(i);
    // (3 V / 4 pi)^(1/3), to the corners of a polyhedron of that volume.
    let radius = params.cell_width * pow(0.238732415 * share * volume_of(i), 1.0 / 3.0) * select(OCTAHEDRON_SCALE, ICOSAHEDRON_SCALE, is_round);
    let vertex_first = status.vertex_count - size.x * (count - rank);
    for (var v = 0u; v < size.x; v++) {
        let normal = direction(v, is_round);
        let position = centre + radius * normal;
        let at = params.vertex_start + VERTEX_WORDS * (vertex_first + v);
        for (var d = 0u; d < 3u; d++) {
            vertices[at + d] = bitcast<u32>(position[d]);
            vertices[at + 3u + d] = bitcast<u32>(normal[d]);
        }
        // Above the numbers of edges.
        vertices[at + 6u] = 0x80000000u | (12u * i + v);
    }
    let index_first = params.index_start + status.index_count - 3u * size.y * (count - rank);
    for (var j = 0u; j < 3u * size.y; j++) {
        var word = 0u;
        if is_round { word = icosahedron_word(j >> 3u); } else { word = octahedron_word(j >> 3u); }
        indices[index_first + j] = vertex_first + ((word >> (4u * (j & 7u))) & 15u);
    }
}

@compute @workgroup_size(64)
fn balls(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let chunk = group_number(group, groups);
    let i = chunk * 64u + k;
    var share = 0.0;
    if i < params.particle_count {
        share = grains[i];
        kept_grains[i] = vec4f(place_of(i), share);
    }
    is_grain[k] = u32(share > 0.0);
    workgroupBarrier();
    if share == 0.0 { return; }
    var rank = grain_counts[chunk];
    for (var j = 0u; j < k; j++) { rank += is_grain[j]; }
    write_ball(i, rank, share);
}
