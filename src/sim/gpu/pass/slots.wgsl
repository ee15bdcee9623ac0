// Marked blocks get slots in the order of their place in the table: the same in every run.

@group(0) @binding(7) var<storage, read_write> blocks: array<u32>;
@group(0) @binding(12) var<storage, read_write> prefix: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn slots(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= arrayLength(&table) || is_halted() { return; }
    let is_marked = table[i] != 0u;
    if i == arrayLength(&table) - 1u {
        let count = prefix[i] + u32(is_marked);
        // The host grows to it.
        atomicStore(&status.slot_count, count);
        if count > params.slot_capacity { halt(CAPACITY); }
    }
    if !is_marked { return; }
    let slot = prefix[i];
    if slot >= params.slot_capacity {
        table[i] = 0u;
        return;
    }
    table[i] = slot + 1u;
    let extent = vec3u(params.blocks);
    blocks[slot] = pack_cell(vec3i(vec3u(i % extent.x, (i / extent.x) % extent.y, i / extent.x / extent.y)));
}
