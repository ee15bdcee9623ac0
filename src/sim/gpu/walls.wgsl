// Walls fold outer nodes onto inner ones, axis by axis, each class apart. One workgroup a block, one
// invocation a node: a wall's three nodes (outer, wall, inner) stand in one block.

@group(0) @binding(7) var<storage, read> blocks: array<u32>;
@group(0) @binding(8) var<storage, read> sums: array<vec4i>;

struct Sums { c: array<vec4f, CLASSES> } // momentum and mass of each class

var<workgroup> totals: array<vec4f, 64>; // of all classes
var<workgroup> exchanged: array<vec4f, 64>; // one class after the other

fn own_sums(slot: u32, k: u32) -> Sums {
    var own: Sums;
    for (var c = 0u; c < CLASSES; c++) {
        let q = sums[(slot * CLASSES + c) * 64u + k];
        own.c[c] = vec4f(vec3f(q.xyz) / params.momentum_scale, f32(q.w) / params.mass_scale);
    }
    return own;
}

// A node's place in a column across a wall.
struct Column {
    is_wall: bool, // whether there is a wall and the node stands in its column
    kind: u32,
    role: u32, // 0 outer, 1 wall, 2 inner
    inward: f32,
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
    return Column((is_low || is_high) && c < 3u, kind, role, select(1.0, -1.0, is_high), outer, line + stride, inner);
}

// The components that the image of clay in a wall has reversed.
fn reflected(kind: u32, axis: u32, v: vec3f) -> vec3f {
    if kind == WALL_STICK { return -v; }
    var r = v;
    r[axis] = -r[axis];
    return r;
}

// Momentum along the inward normal and mass of all classes.
fn total_at(k: u32, axis: u32, inward: f32) -> vec2f {
    return vec2f(totals[k][axis] * inward, totals[k].w);
}

// Normal impulse of the wall on the clay if it folded this column; 0 while no clay reaches the outer node.
fn reaction(column_: Column, axis: u32) -> f32 {
    let outer = total_at(column_.outer, axis, column_.inward);
    let wall = total_at(column_.wall, axis, column_.inward);
    let inner = total_at(column_.inner, axis, column_.inward);
    // Clay further than half a cell from the wall only shares the wall's node with its image: it does not
    // touch yet.
    if outer.y <= WALL_TOUCH * (outer.y + wall.y + inner.y) { return 0.0; }
    let gravity = params.gravity[axis] * column_.inward;
    let mass = inner.y + outer.y;
    var velocity = 0.0;
    if mass > 0.0 { velocity = (inner.x - outer.x) / mass + gravity; }
    return (inner.y - outer.y) * velocity - (inner.x + wall.x + outer.x) - (mass + wall.y) * gravity;
}

struct Folding { sums: Sums, folds: u32 } // bit a: the node's column along axis a is folded

// All invocations of the workgroup call it together.
fn fold(own: Sums, block: vec3i, k: u32) -> Folding {
    var here = own;
    var folds = 0u;
    for (var axis = 0u; axis < 3u; axis++) {
        var total = vec4f(0.0);
        for (var c = 0u; c < CLASSES; c++) {
            total += here.c[c];
        }
        totals[k] = total;
        workgroupBarrier();
        let w = column(axis, block, k);
        let is_folded = w.is_wall && (w.kind != WALL_SEPARATE || reaction(w, axis) > 0.0);
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
