// Particles: place [cells], volume ratio, rest volume over a cell's, tags (sheet, side, sheet, side), body.

@group(0) @binding(2) var<storage, read> particles: array<u32>;

fn place_of(i: u32) -> vec3f {
    let at = SURFACE_PARTICLE_WORDS * i + SURFACE_PARTICLE_POSITION;
    return vec3f(bitcast<f32>(particles[at]), bitcast<f32>(particles[at + 1u]), bitcast<f32>(particles[at + 2u]));
}

// Present volume [cells].
fn volume_of(i: u32) -> f32 {
    let at = SURFACE_PARTICLE_WORDS * i;
    return bitcast<f32>(particles[at + SURFACE_PARTICLE_DENSITY_WEIGHT]) * bitcast<f32>(particles[at + SURFACE_PARTICLE_VOLUME_RATIO]);
}

fn body_of(i: u32) -> u32 {
    return particles[SURFACE_PARTICLE_WORDS * i + SURFACE_PARTICLE_BODY];
}

// By its bits: comparisons with NaN may be optimised away.
fn is_finite(v: f32) -> bool {
    return (bitcast<u32>(v) & 0x7f800000u) != 0x7f800000u;
}

fn is_usable(i: u32) -> bool {
    let x = place_of(i);
    let finite = is_finite(x.x) && is_finite(x.y) && is_finite(x.z) && is_finite(volume_of(i));
    return finite && all(x >= vec3f(0.0)) && all(x <= params.usable);
}

// Sheet and side (1 front, -1 back) of one of a particle's two tags; sheet 0 for none.
struct Tag { sheet: u32, side: i32 }

fn tag_of(i: u32, slot: u32) -> Tag {
    let bits = particles[SURFACE_PARTICLE_WORDS * i + SURFACE_PARTICLE_TAGS];
    let tag = raw_tag(bits, slot);
    // Twice the same sheet counts once.
    if slot == 1u && raw_tag(bits, 0u).sheet == tag.sheet { return Tag(0u, 0); }
    return tag;
}

fn raw_tag(bits: u32, slot: u32) -> Tag {
    let tag = bits >> (16u * slot);
    // The size of a side is a counter of the engine's.
    let side = i32(tag << 16u) >> 24u;
    if side == 0 || (tag & 255u) == JOINT_SHEET { return Tag(0u, 0); }
    return Tag(tag & 255u, sign(side));
}

// First node of a particle's stencil on the level's lattice, and the particle's place from it.
struct Stencil { base: vec3i, f: vec3f }

fn stencil_of(i: u32) -> Stencil {
    let point = place_of(i) * params.scale - params.shift;
    let base = floor(point - 0.5);
    return Stencil(vec3i(base), point - base);
}

// Quadratic B-spline of the k-th node along an axis.
fn weight(f: f32, k: i32) -> f32 {
    let d = f - f32(k);
    let e = 1.5 - abs(d);
    return select(0.5 * e * e, 0.75 - d * d, k == 1);
}
