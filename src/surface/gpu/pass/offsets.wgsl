// Where the vertices and triangles of each block stand, and how many there are with the balls behind them;
// room for all, or none. A block that outgrows its region gets another behind all others; when those left
// take too much, all are laid out anew, without slack if need be.

@group(0) @binding(4) var<storage, read> blocks: array<u32>;
@group(0) @binding(12) var<storage, read_write> regions: array<Region>;
@group(0) @binding(17) var<storage, read_write> dispatch: array<u32>;
@group(0) @binding(23) var<storage, read_write> work: array<Work>;

var<workgroup> grown_sums: array<vec2u, 256>;
var<workgroup> room_sums: array<vec2u, 256>;
var<workgroup> count_sums: array<vec2u, 256>;

// Room for so many: an eighth more, by 16 vertices and 32 triangles.
fn room_for(count: vec2u) -> vec2u {
    return (count + count / 8u + vec2u(15u, 31u)) & ~vec2u(15u, 31u);
}

fn is_outgrown(region: Region) -> bool {
    return any(region.count > region.room);
}

// Sums of a lane's blocks: of the regions for those that outgrew theirs, of those for all, of what is in
// them.
fn add_up(k: u32, first: u32, last: u32) {
    var grown = vec2u(0u);
    var room = vec2u(0u);
    var count = vec2u(0u);
    for (var j = first; j < last; j++) {
        let region = regions[j];
        if is_outgrown(region) { grown += room_for(region.count); }
        room += room_for(region.count);
        count += region.count;
    }
    grown_sums[k] = grown;
    room_sums[k] = room;
    count_sums[k] = count;
}

fn balls() -> vec2u {
    return status.found_grains * ball_size(status.found_grains);
}

fn fits(end: vec2u) -> bool {
    let all = end + balls();
    return all.x <= params.vertex_capacity && 3u * all.y <= params.index_capacity;
}

@compute @workgroup_size(256)
fn offsets(@builtin(local_invocation_index) k: u32) {
    let each = (params.slot_capacity + 255u) / 256u;
    let first = min(k * each, params.slot_capacity);
    let last = min(first + each, params.slot_capacity);
    add_up(k, first, last);
    workgroupBarrier();
    var grown = vec2u(0u);
    var room = vec2u(0u);
    var count = vec2u(0u);
    var grown_before = vec2u(0u);
    var room_before = vec2u(0u);
    var count_before = vec2u(0u);
    for (var j = 0u; j < 256u; j++) {
        if j == k {
            grown_before = grown;
            room_before = room;
            count_before = count;
        }
        grown += grown_sums[j];
        room += room_sums[j];
        count += count_sums[j];
    }
    // What is left behind takes no more than a new layout would.
    let end = status.mesh_end;
    let is_kept = status.is_all == 0u && all(end + grown <= 2u * room) && fits(end + grown);
    let has_slack = fits(room);
    let has_room = fits(count);
    // From here on the first lane writes the status, which no other reads.
    storageBarrier();
    if k == 0u {
        status.wanted = room + balls();
        status.least = count + balls();
    }
    if is_kept {
        append(first, last, end + grown_before);
        if k == 0u { finish(end + grown, dispatch[8]); }
    } else if has_slack {
        lay_out(first, last, room_before, true);
        if k == 0u { finish(room, status.kept_slots); }
    } else if has_room {
        lay_out(first, last, count_before, false);
        if k == 0u { finish(count, status.kept_slots); }
    } else if k == 0u {
        atomicOr(&status.flags, MESH_FULL);
        dispatch[20] = 0u;
        // What is remembered was not drawn: the next run tries again.
        status.is_stale = 1u;
    }
}

fn append(first: u32, last: u32, end: vec2u) {
    var next = end;
    for (var j = first; j < last; j++) {
        let region = regions[j];
        regions[j].left = vec2u(0u);
        if !is_outgrown(region) { continue; }
        regions[j].left = vec2u(region.first.y, region.room.y);
        regions[j].first = next;
        regions[j].room = room_for(region.count);
        next += regions[j].room;
    }
}

// All blocks are to be written then.
fn lay_out(first: u32, last: u32, end: vec2u, has_slack: bool) {
    var next = end;
    for (var j = first; j < last; j++) {
        let count = regions[j].count;
        let room = select(count, room_for(count), has_slack);
        regions[j] = Region(next, room, count, vec2u(0u));
        work[j] = Work(j, blocks[j], 0u);
        next += room;
    }
}

// The mesh up to `end`, of which so many blocks are to be written.
fn finish(end: vec2u, written: u32) {
    dispatch[16] = written;
    status.extraction_count++;
    status.grain_count = status.found_grains;
    status.is_stale = 0u;
    status.mesh_end = end;
    status.block_count = dispatch[8];
    status.index_count_before = status.index_count;
    status.vertex_count = end.x + balls().x;
    status.index_count = 3u * (end.y + balls().y);
}
