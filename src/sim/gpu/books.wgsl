// What tools take from the clay of a block, one invocation a node or a particle, into the frame's sums.

@group(0) @binding(17) var<storage, read_write> impulses: array<vec4f>; // sums of a frame, by slot: walls, damping, 2 for each tool

// What one tool took from one node or particle: impulse and contacts, angular impulse and |impulse|.
struct Taken { impulse: vec4f, angular: vec4f }

var<workgroup> partial: array<vec4f, WORKGROUP>;

// Sum over the workgroup, in a fixed order; only invocation 0 has it.
fn workgroup_sum(k: u32, v: vec4f) -> vec4f {
    workgroupBarrier();
    partial[k] = v;
    for (var step = WORKGROUP / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if k < step { partial[k] += partial[k + step]; }
    }
    return partial[0];
}

// The first of a slot's sums.
fn books_of(slot: u32) -> u32 {
    return slot * (2u + 2u * params.tool_count);
}

// Books what a tool took in this block.
fn book(row: u32, t: u32, k: u32, taken: Taken) {
    let impulse = workgroup_sum(k, taken.impulse);
    let angular = workgroup_sum(k, taken.angular);
    if k == 0u {
        impulses[row + 2u + 2u * t] += impulse;
        impulses[row + 3u + 2u * t] += angular;
    }
}
