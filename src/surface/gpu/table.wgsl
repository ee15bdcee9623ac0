// The level's dense block table: slot + 1 of each stored block, else 0.

@group(0) @binding(3) var<storage, read> table: array<u32>;

fn slot_of(block: vec3i) -> u32 {
    if !has_entry(block) { return 0u; }
    return table[entry_of(block)];
}
