// What every pass sees. Lengths in node spacings of the level's lattice, values in those of the inside of
// clay. Two levels: the cell grid, for densities, and the visual grid. The constants above this text are
// generated from Rust.

struct Params {
    blocks: vec3i, // of 8^3 nodes along each axis, the first one at -1
    particle_count: u32,
    usable: vec3f, // greatest place of a particle [cells]
    spacing: f32, // of visual nodes [m]
    origin: vec3f, // of visual node 0 [m]
    iso: f32, // threshold
    scale: f32, // nodes per cell
    shift: f32, // of this level's lattice [nodes]
    reach_low: i32, // nodes in stored blocks before and behind the first node of a stencil
    reach_high: i32,
    density_exponent: f32,
    first: i32, // visual node i is sum_k taps[k] raw[i + first + k], along each axis
    tap_count: u32,
    slot_capacity: u32,
    taps: array<vec4f, 2>,
    sheet_capacity: u32, // sheets with room for their fields
    vertex_first: u32, // where vertices and indices begin in their buffers [vertices, indices]
    vertex_capacity: u32,
    index_first: u32,
    index_capacity: u32,
    is_forced: u32, // whether to extract whatever has changed or not
    level: u32, // 0 cell grid, 1 visual grid
    method: u32, // 0 two lips, 1 Equation 9
    has_grains: u32, // whether particles that the surface does not show are drawn as balls
    cell_width: f32, // [m]
    spare: vec2u,
}

// Counts are of the last run; those marked kept of the last extraction.
struct Status {
    flags: atomic<u32>,
    slot_counts: array<u32, 2>, // blocks in use, or needed, by level
    sheet_count: u32, // cuts with clay on both sides
    is_changed: atomic<u32>, // whether anything is extracted
    vertex_count: u32, // kept: up to the last one
    index_count: u32, // kept: up to the last one
    index_count_before: u32, // kept, of the extraction before
    kept_slots: u32, // kept: slots up to the last one in use, and cuts
    kept_sheets: u32,
    extraction_count: u32, // kept
    found_grains: u32, // particles that the surface does not show
    sides: array<atomic<u32>, 16>, // bit by sheet: clay in front, clay behind
    sheets: array<u32, SHEETS_MAX>, // numbers of the cuts with fields, in order
    grain_count: u32, // kept: grains that are drawn
    slot_limits: array<u32, 2>, // slots up to the last one in use, by level
    free_counts: array<u32, 2>, // slots for new blocks, by level
    slot_span: u32, // visual slots in use now or at the last extraction
    is_all: u32, // whether every block is extracted: 1, or ANEW where what stands in the mesh is not known
    is_stale: u32, // kept: whether the mesh is not the last run's, which found no room
    mesh_end: vec2u, // kept: vertices and triangles up to the end of the blocks' regions
    wanted: vec2u, // kept: vertices and triangles of a new layout
    least: vec2u, // kept: those in use
    block_count: u32, // kept: blocks extracted, and slots given back
    spare: u32,
}

// A block's part of the mesh, by slot; kept.
struct Region {
    first: vec2u, // vertex and triangle
    room: vec2u, // vertices and triangles
    count: vec2u, // of them in use
    left: vec2u, // first and number of triangles where it was before, which are to be emptied
}

// A block to be extracted; whether it had zeros before, and whether it takes this run's values.
struct Work { slot: u32, entry: u32, values: u32 }

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
