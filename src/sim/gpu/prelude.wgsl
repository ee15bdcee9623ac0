// What every pass sees. Lengths in cells, times in substeps; masses in units of `Params` (near 1 for an
// eighth of a cell). The constants above this text (WORKGROUP, CLASSES, ...) and the structs that the host
// shares (Params, Tool, ...) are generated from Rust.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> status: Status;

fn is_halted() -> bool {
    return atomicLoad(&status.flags) != 0u;
}

fn halt(flag: u32) {
    atomicOr(&status.flags, flag);
}

// By its bits: comparisons with NaN may be optimised away.
fn is_finite(v: f32) -> bool {
    return (bitcast<u32>(v) & 0x7f800000u) != 0x7f800000u;
}

// Number of the invocation in a dispatch of up to 65535 workgroups along x and any number along y.
fn invocation(group: vec3u, groups: vec3u, local: u32) -> u32 {
    return (group.y * groups.x + group.x) * WORKGROUP + local;
}

fn unpack_cell(k: u32) -> vec3i {
    return vec3i(i32(k & 1023u), i32((k >> 10u) & 1023u), i32(k >> 20u));
}

fn pack_cell(c: vec3i) -> u32 {
    return u32(c.x) | (u32(c.y) << 10u) | (u32(c.z) << 20u);
}

fn block_index(b: vec3i) -> u32 {
    return u32((b.z * params.blocks.y + b.y) * params.blocks.x + b.x);
}

// Node in its block, z fastest.
fn local_index(n: vec3i) -> u32 {
    let l = vec3u(n & vec3i(3));
    return (l.x * 4u + l.y) * 4u + l.z;
}

fn local_node(k: u32) -> vec3i {
    return vec3i(vec3u(k / 16u, (k / 4u) % 4u, k % 4u));
}

// What a particle's WAY notes of fresh clay where blades have to know what it has lost of its strength; the
// most that it may have gained, which is the unit of sums of what is lost.
const FRESH: f32 = 64.0;
const LOST_MAX: f32 = 32.0;
