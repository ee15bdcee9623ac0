// Particles: field f of particle i stands at state[f * particle_count + i].

const POSITION: u32 = 0u; // offset from the cell's low corner [cells], packed cell
const VELOCITY: u32 = 1u; // [cells/substep], packed tags
const AFFINE: u32 = 2u; // 3 columns of C h; w: mass, working, plastic strain since volumes were last averaged
const STRAIN: u32 = 5u; // xx yy zz xy | xz yz, hardening, index of the particle's record
const STRESS: u32 = 7u; // scaled: xx yy zz xy | xz yz, walls that it touches or has arrived at, its body
const WAY: u32 = 9u; // of the last substep [cells], 0; from `penalty` to `g2p` velocity that tools give, and 1 or, from FRESH on, what is lost of the strength
const ANCHORS: u32 = FIELDS - ANCHORS_MAX; // while tools press: place in a tool's frame [cells], its id + 1

@group(0) @binding(2) var<storage, read_write> state: array<vec4f>;

fn at(field: u32, i: u32) -> u32 {
    return field * params.particle_count + i;
}

// Base node and offset from it.
struct Stencil { base: vec3i, f: vec3f }

fn stencil(position: vec4f) -> Stencil {
    let b = floor(position.xyz - 0.5);
    return Stencil(unpack_cell(bitcast<u32>(position.w)) + vec3i(b), position.xyz - b);
}

// Weight of the k-th node along an axis. Computed, not looked up: arrays indexed at run time are slow on
// every adapter.
fn weight(f: f32, k: i32) -> f32 {
    let d = f - f32(k);
    let e = 1.5 - abs(d);
    return select(0.5 * e * e, 0.75 - d * d, k == 1);
}

// Where the packed tags (sheet, side, sheet, side) hold a side of this sheet: 0 or 16, the shift of the tag;
// NONE if they do not.
const NONE: u32 = 32u;

fn place_of(tags: u32, sheet: u32) -> u32 {
    for (var shift = 0u; shift < NONE; shift += 16u) {
        let tag = tags >> shift;
        if (tag & 255u) == sheet && ((tag >> 8u) & 255u) != 0u { return shift; }
    }
    return NONE;
}

// One tag (sheet, side): 0 for none, else the sheet and whether it is the front.
fn side_code(tag: u32) -> u32 {
    let side = (tag >> 8u) & 255u;
    let sheet = tag & 255u;
    return select((sheet << 1u) | u32(side < 128u), 0u, side == 0u || sheet == 0u || sheet == JOINT_SHEET);
}

fn body_at(i: u32) -> u32 {
    return bitcast<u32>(state[at(STRESS + 1u, i)].w);
}

// Of which body and on which sides of which cuts, from the packed tags (sheet, side, sheet, side): the body,
// then the codes of both sides in 9 bits each, the higher sheet first; 0 for the first body near no cut.
fn key_of(body: u32, tags: u32) -> u32 {
    if CLASSES == 1u { return 0u; }
    let a = side_code(tags & 0xffffu);
    let b = side_code(tags >> 16u);
    let sides = select((max(a, b) << 9u) | min(a, b), a << 9u, (a >> 1u) == (b >> 1u));
    return (body << 18u) | sides;
}
