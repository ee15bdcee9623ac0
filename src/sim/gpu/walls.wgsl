// Walls that hold clay fold outer nodes onto inner ones, axis by axis, each class apart. One workgroup a
// block, one invocation a node: a wall's three nodes (outer, wall, inner) stand in one block.

@group(0) @binding(7) var<storage, read> blocks: array<u32>;
@group(0) @binding(8) var<storage, read> sums: array<vec4i>; // impulse and mass, momentum and what is lost of the strength: two of each node and class

struct Sums { c: array<vec4f, CLASSES> } // momentum with the impulse, and mass, of each class

var<workgroup> exchanged: array<vec4f, 64>; // one class after the other

fn own_sums(slot: u32, k: u32) -> Sums {
    var own: Sums;
    for (var c = 0u; c < CLASSES; c++) {
        let place = 2u * ((slot * CLASSES + c) * 64u + k);
        let q = sums[place];
        own.c[c] = vec4f((vec3f(sums[place + 1u].xyz) + vec3f(q.xyz)) / params.momentum_scale, f32(q.w) / params.mass_scale);
    }
    return own;
}

// What the clay of the classes with this leader has lost of its strength at tools, in the mean.
fn strength_lost(leader: array<u32, CLASSES>, f: u32, slot: u32, k: u32) -> f32 {
    if params.remembers == 0u { return 0.0; }
    var mass = 0.0;
    var lost = 0.0;
    for (var c = 0u; c < CLASSES; c++) {
        if leader[c] != f { continue; }
        let place = 2u * ((slot * CLASSES + c) * 64u + k);
        mass += f32(sums[place].w);
        lost += f32(sums[place + 1u].w);
    }
    return LOST_MAX * lost / max(mass, 1.0);
}

// A node's place in a column across a wall.
struct Column {
    is_wall: bool, // whether there is a wall and the node stands in its column
    kind: u32,
    role: u32, // 0 outer, 1 wall, 2 inner
    outer: u32,
    wall: u32,
    inner: u32,
}

fn is_at_wall(block: vec3i) -> bool {
    return any((params.wall_low >> vec3u(2u)) == block) || any((params.wall_high >> vec3u(2u)) == block);
}

fn column(axis: u32, block: vec3i, k: u32) -> Column {
    let is_low = (params.wall_low[axis] >> 2u) == block[axis];
    let is_high = (params.wall_high[axis] >> 2u) == block[axis];
    let stride = array<u32, 3>(16u, 4u, 1u)[axis];
    let c = (k / stride) % 4u;
    let line = k - c * stride;
    let kind = (params.wall_kinds >> (2u * (axis + select(0u, 3u, is_high)))) & 3u;
    let role = select(c, 2u - min(c, 2u), is_high);
    let outer = line + select(0u, 2u * stride, is_high);
    let inner = line + select(2u * stride, 0u, is_high);
    return Column((is_low || is_high) && c < 3u, kind, role, outer, line + stride, inner);
}

// The components that the image of clay in a wall has reversed.
fn reflected(kind: u32, axis: u32, v: vec3f) -> vec3f {
    if kind == WALL_STICK { return -v; }
    var r = v;
    r[axis] = -r[axis];
    return r;
}

// Whether clay that has arrived gives mass to the wall node of a column: see `penalty.wgsl`.
fn is_held(slot: u32, axis: u32, k: u32) -> bool {
    let across = array<vec2u, 3>(vec2u(k / 4u % 4u, k % 4u), vec2u(k % 4u, k / 16u), vec2u(k / 16u, k / 4u % 4u))[axis];
    let bit = 16u * axis + 4u * across.x + across.y;
    return ((blocks[params.slot_capacity + 2u * slot + bit / 32u] >> (bit % 32u)) & 1u) == 1u;
}

struct Folding { sums: Sums, folds: u32 } // bit a: the node's column along axis a is folded

// All invocations of the workgroup call it together.
fn fold(own: Sums, slot: u32, block: vec3i, k: u32) -> Folding {
    var here = own;
    var folds = 0u;
    for (var axis = 0u; axis < 3u; axis++) {
        let w = column(axis, block, k);
        let is_folded = w.is_wall && w.kind != WALL_SEPARATE && is_held(slot, axis, k);
        folds |= u32(is_folded) << axis;
        for (var c = 0u; c < CLASSES; c++) {
            exchanged[k] = here.c[c];
            workgroupBarrier();
            let outer = exchanged[w.outer];
            if is_folded && w.role == 2u { here.c[c] += vec4f(reflected(w.kind, axis, outer.xyz), outer.w); }
            if is_folded && w.role == 0u { here.c[c] = vec4f(0.0); }
            workgroupBarrier();
        }
    }
    return Folding(here, folds);
}
