// The law of contact (`sim::penalty`), in a tool's own frame: cells, substeps and eighths of a full cell's
// mass.

// A particle's contact springs.
struct Springs { normal: f32, tangential: f32, strength: f32, inertia: f32 }

// A surface before a particle: its gap, its normal towards the particle, the speed at which that leaves it.
struct Surface { gap: f32, normal: vec3f, leaving: f32 }

// Where a particle clings to the tool, if it does.
struct Anchor { is_there: bool, place: vec3f }

// What a surface does to a particle, if they touch.
struct Touch { is_there: bool, force: vec3f, anchor: Anchor }

// The edge of a cube of this volume: `pow` may be off by more than a unit in the last place.
fn edge_of(volume: f32) -> f32 {
    let edge = pow(volume, 1.0 / 3.0);
    return edge - (edge - volume / (edge * edge)) / 3.0;
}

// How far a particle of this rest volume [cells^3] reaches, and its springs: up to an eighth of a cell a
// slab, a cube beyond.
fn reach_of(volume: f32) -> f32 {
    if volume <= 0.125 { return 2.0 * volume; }
    return 0.5 * edge_of(volume);
}

fn springs_of(volume: f32) -> Springs {
    var area = 2.0 * volume;
    if volume > 0.125 {
        let edge = edge_of(volume);
        area = edge * edge;
    }
    return Springs(params.normal_spring * area, params.tangential_spring * area, params.contact_strength * area, 8.0 * volume);
}

// Whether a surface was put where the particle is, and what it then gives at most of its push.
fn is_found(was_touched: bool, gap: f32, leaving: f32) -> bool {
    return !was_touched && gap - leaving < -FOUND_DEPTH;
}

fn ejection(springs: Springs, push: f32, leaving: f32) -> f32 {
    return min(push, springs.inertia * max(EJECTION_SPEED - leaving, 0.0));
}

// What the tool does to a particle at q that clings to it by an anchor, if it touched it before.
fn touch(t: Tool, springs: Springs, surface: Surface, q: vec3f, before: Anchor) -> Touch {
    var none: Touch;
    let is_bonded = before.is_there && !can_part(t);
    if surface.gap >= select(0.0, BOND_REACH, is_bonded) { return none; }
    let push = max(-springs.normal * surface.gap, -springs.strength);
    if is_found(before.is_there, surface.gap, surface.leaving) {
        return Touch(true, ejection(springs, push, surface.leaving) * surface.normal, none.anchor);
    }
    var anchor = q;
    if before.is_there { anchor = before.place; }
    let way = q - anchor;
    var slip = way - dot(way, surface.normal) * surface.normal;
    let wanted = springs.tangential * length(slip);
    let most = friction_limit(t, springs.strength, push);
    if wanted > most {
        slip *= most / wanted;
        anchor = q - slip;
    }
    return Touch(true, push * surface.normal - springs.tangential * slip, Anchor(true, anchor));
}

// The force along its normal with which an edge holds off a particle that bears `share` of it, having come
// `advance` towards it since that was anchored; and the advance that is left (`Springs::cut`).
fn cut(springs: Springs, volume: f32, share: f32, advance: f32) -> vec2f {
    let wanted = springs.tangential * advance;
    let most = params.toughness * volume * share;
    if wanted > most { return vec2f(most, most / springs.tangential); }
    return vec2f(max(wanted, 0.0), advance);
}
