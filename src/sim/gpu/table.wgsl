// The dense block table: slot + 1 of each block with nodes, else 0.

@group(0) @binding(6) var<storage, read_write> table: array<u32>;

// Slot + 1 of the block that holds node n.
fn slot_of(n: vec3i) -> u32 {
    return table[block_index(n >> vec3u(2u))];
}

// Slots + 1 of the blocks of the three nodes from n on along z: of the first and of the last.
fn slots_along_z(n: vec3i) -> vec2u {
    return vec2u(slot_of(n), slot_of(n + vec3i(0, 0, 2)));
}

// What belongs to the z-th of them, of what belongs to the first and the last.
fn at_z(slots: vec2u, n: vec3i, z: i32) -> u32 {
    return select(slots.y, slots.x, ((n.z + z) >> 2u) == (n.z >> 2u));
}

// Place of a node among all nodes of its class, given its block's slot + 1.
fn node_place(slot: u32, class_: u32, n: vec3i) -> u32 {
    return ((slot - 1u) * CLASSES + class_) * 64u + local_index(n);
}
