// What every pass sees. Lengths in cells, times in substeps; masses in units of `Params` (near 1 for an eighth of a cell).
// The constants above this text (WORKGROUP, CLASSES, ...) are generated from Rust.

struct Params {
    blocks: vec3i, // of the grid along each axis
    particle_count: u32,
    wall_low: vec3i, // wall nodes
    slot_capacity: u32,
    wall_high: vec3i,
    tool_count: u32,
    gravity: vec3f, // over inertia scaling [cells/substep^2]
    damping: f32, // velocity kept by validation damping [-]
    centre: vec3i, // the cell that angular momentum is summed about
    wall_kinds: u32, // 2 bits each: low x y z, high x y z
    mass_scale: f32, // fixed point: mass and momentum to i32, powers of two
    momentum_scale: f32,
    reach_limit: f32, // greatest |v + A d| [cells/substep] that momentum_scale serves
    cell_count_limit: u32, // greatest number of particles in a cell that both scales serve
    mu2: f32, // 2 mu 4 h^2 / (rho_s dx^2)
    lambda: f32, // lambda 4 h^2 / (rho_s dx^2)
    yield_norm: f32, // greatest |dev H| of unworked clay
    softening: f32, // s of Eq. 5; 0 turns it off
    softening_length: f32,
    velocity_unit: f32, // one cell per substep [m/s]
    rate_unit: f32, // 1 / h [1/s]
    mass_unit: f32, // rest volume of mass 1, a power of two [m^3]
    travel_limit: f32, // greatest node speed [cells/substep]
    density_unit: f32, // mass 1 over the mass of a full cell [-]
    starts_frame: u32, // whether this submission is a frame's first
    softens: u32, // whether Eq. 5 is on
    node_mass_limit: f32, // greatest mass of a node that momentum_scale serves
    hardening: f32, // what flow stress gains per shortening of the Hencky deviator
    viscous: f32, // what viscosity adds to it: viscous * shortening ^ flow_index
    flow_index: f32,
    hardening_norm: f32, // what the yield norm gains per plastic strain
    work_loss: f32, // share of the yield norm that fully worked clay loses
    work_rate: f32, // working per plastic strain
    work_kept: f32, // working that a substep's rest leaves
    averaging: f32, // share of its difference to its cell's mean that a flowing particle's ln J loses
    averaging_last: f32, // the same at the frame's last averaging, which stands for fewer substeps
    averaging_last_at: u32, // the substep of this submission, from 1, that it is in
    adhesion: f32, // velocity that the clay's shear strength gives to clay one cell deep, k h / (rho_s dx) [cells/substep]
    blades: u32, // which tools are blades that hold clay off, a bit each
    solids: u32, // which tools are solid, a bit each
    weld_stress: f32, // compression across a cut at which its sides grow together, as the stress is scaled
    weld_step: u32, // what a frame adds to the count of a pressed tag
    profiles: array<array<vec4f, 17>, PROFILES_MAX>, // of bent blades: two points (x, z) of the XZ plane each
}

struct ToolCount {
    tagged: atomic<u32>,
    pushed_back: atomic<u32>,
    depth: atomic<u32>, // f32 bits, not negative
    displaced: atomic<u32>,
}

// Flags stop every later pass until the host has acted on them; counters are of one frame.
struct Status {
    flags: atomic<u32>,
    speed: atomic<u32>, // greatest node speed, f32 bits
    clamped: atomic<u32>,
    cell_count: atomic<u32>, // most particles in a cell
    slot_count: atomic<u32>, // blocks with nodes
    substep: atomic<u32>, // of the present submission, from 1
    node_mass: atomic<u32>, // greatest of a node and class, fixed point
    reach_met: atomic<u32>, // whether the bound on speed was
    crowded: atomic<u32>, // whether a key found no room in a block
    welded: atomic<u32>, // sides of cuts that grew together
    sheets: array<atomic<u32>, 8>, // that particles have a side of, a bit each
    tools: array<ToolCount, TOOLS_MAX>,
}

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
