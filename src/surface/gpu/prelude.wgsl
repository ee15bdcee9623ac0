// What every pass sees. Lengths in node spacings of the level's lattice, values in those of the inside of
// clay. Two levels: the cell grid, for densities, and the visual grid. The constants above this text and the
// structs that the host shares (Params, Status, ...) are generated from Rust.

const ANEW: u32 = 2u;

// Bits of `values`.
const NEW: u32 = 1u;
const TAKEN: u32 = 2u;
// Change of a value that is taken over, where some value of the block has changed by more than HYSTERESIS.
const CHANGE_MIN: f32 = HYSTERESIS / 100.0;

const NONE: u32 = 0xffffffffu; // no block, no slot
const MARK: u32 = 0x80000000u; // in a block's entry while slots are dealt: some clay reaches it

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> status: Status;

// Number of the invocation, or workgroup, in a dispatch of any shape.
fn group_number(group: vec3u, groups: vec3u) -> u32 {
    return group.y * groups.x + group.x;
}

fn plane_count() -> u32 {
    return 1u + 2u * min(status.sheet_count, params.sheet_capacity);
}

// Whether cuts or bodies part the clay.
fn has_parts() -> bool {
    return status.sheet_count != 0u || status.has_bodies != 0u;
}

fn planes_stored() -> u32 {
    return 1u + 2u * params.sheet_capacity;
}

// Entry of a block in the table; blocks beyond it have none.
fn has_entry(block: vec3i) -> bool {
    return all(block >= vec3i(-1)) && all(block < params.blocks - 1);
}

fn entry_of(block: vec3i) -> u32 {
    let b = block + 1;
    return u32((b.z * params.blocks.y + b.y) * params.blocks.x + b.x);
}

fn block_of(entry: u32) -> vec3i {
    let n = vec3u(params.blocks);
    return vec3i(vec3u(entry % n.x, (entry / n.x) % n.y, entry / (n.x * n.y))) - 1;
}

// Node in its block, x fastest.
fn local_index(node: vec3i) -> u32 {
    let l = vec3u(node & vec3i(7));
    return l.x + 8u * (l.y + 8u * l.z);
}

fn local_node(k: u32) -> vec3i {
    return vec3i(vec3u(k & 7u, (k >> 3u) & 7u, k >> 6u));
}
