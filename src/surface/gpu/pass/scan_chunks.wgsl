// New blocks before each chunk; slots for them, from the lowest; how many blocks there are in all.

@group(0) @binding(4) var<storage, read> blocks: array<u32>;
@group(0) @binding(5) var<storage, read_write> free: array<u32>;
@group(0) @binding(16) var<storage, read_write> chunks: array<u32>;

var<workgroup> partial: array<u32, 64>;
var<workgroup> limit: atomic<u32>;

// The sum of the lanes before this one, and that of all.
fn before_and_all(k: u32, own: u32) -> vec2u {
    workgroupBarrier();
    partial[k] = own;
    workgroupBarrier();
    var sums = vec2u(0u);
    for (var j = 0u; j < 64u; j++) { sums += vec2u(select(0u, partial[j], j < k), partial[j]); }
    return sums;
}

@compute @workgroup_size(64)
fn scan_chunks(@builtin(local_invocation_index) k: u32) {
    let count = arrayLength(&chunks);
    let each = (count + 63u) / 64u;
    let first = min(k * each, count);
    let last = min(first + each, count);
    var sum = 0u;
    for (var j = first; j < last; j++) { sum += chunks[j]; }
    let new_ = before_and_all(k, sum);
    var before = new_.x;
    for (var j = first; j < last; j++) {
        let own = chunks[j];
        chunks[j] = before;
        before += own;
    }

    let slots = params.slot_capacity;
    let each_slot = (slots + 63u) / 64u;
    let first_slot = min(k * each_slot, slots);
    let last_slot = min(first_slot + each_slot, slots);
    var free_count = 0u;
    for (var slot = first_slot; slot < last_slot; slot++) { free_count += u32(blocks[slot] == NONE); }
    let all_free = before_and_all(k, free_count);
    var rank = all_free.x;
    for (var slot = first_slot; slot < last_slot; slot++) {
        if blocks[slot] != NONE {
            atomicMax(&limit, slot + 1u);
        } else {
            if rank < new_.y {
                free[rank] = slot;
                atomicMax(&limit, slot + 1u);
            }
            rank++;
        }
    }
    workgroupBarrier();
    if k == 0u {
        if new_.y > all_free.y { atomicOr(&status.flags, BLOCKS_FULL); }
        status.slot_counts[params.level] = slots - all_free.y + new_.y;
        status.free_counts[params.level] = all_free.y;
        status.slot_limits[params.level] = atomicLoad(&limit);
    }
}
