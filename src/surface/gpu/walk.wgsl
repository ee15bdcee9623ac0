// The triangles of one cell, in their order: of each body, then the caps towards the next cells. The pass
// that walks gives `triangle`.

@group(0) @binding(15) var<uniform> cases: array<vec4u, 128>; // by case, 2 words: count in the top 4 bits, edges of 4 bits from the lowest

fn axis_vector(axis: u32) -> vec3i {
    return vec3i(vec3u(vec3u(0u, 1u, 2u) == vec3u(axis)));
}

// Whether two corners of a cell are inside and of different bodies of it.
fn are_parted(cell: vec3i, a: u32, b: u32) -> bool {
    let bodies = bodies_at(cell);
    if ((bodies >> (3u * a)) & 7u) == ((bodies >> (3u * b)) & 7u) { return false; }
    return (label_at(cell + corner_of(a)) & label_at(cell + corner_of(b)) & 1u) == 1u;
}

// 6.
fn is_split(low: vec3i, axis: u32) -> bool {
    let u = (axis + 1u) % 3u;
    let v = (axis + 2u) % 3u;
    for (var i = 0u; i < 4u; i++) {
        let corner = ((i & 1u) << u) | ((i >> 1u) << v);
        if !are_parted(low - corner_of(corner), corner, corner | (1u << axis)) { return false; }
    }
    return true;
}

// Place of a vertex among those that a block can have: edge, and whether a split edge's high end is kept.
fn place_of_vertex(low: vec3i, axis: u32, keeps_low: bool) -> u32 {
    let edge = u32(low.x + 9 * (low.y + 9 * low.z)) * 3u + axis;
    return 2u * edge + u32(!keeps_low && is_split(low, axis));
}

// Edge of the table: low corner | axis << 3.
fn edge_of(e: u32) -> u32 {
    var packed = array<u32, 12>(0u, 8u, 16u, 9u, 17u, 2u, 18u, 19u, 4u, 12u, 13u, 6u);
    return packed[e];
}

fn case_word(case_: u32, word: u32) -> u32 {
    let at = 2u * case_ + word;
    return cases[at >> 2u][at & 3u];
}

fn case_edge(case_: u32, i: u32) -> u32 {
    return (case_word(case_, i >> 3u) >> (4u * (i & 7u))) & 15u;
}

fn body_vertex(cell: vec3i, case_: u32, i: u32) -> u32 {
    let edge = edge_of(case_edge(case_, i));
    let low = edge & 7u;
    return place_of_vertex(cell + corner_of(low), edge >> 3u, ((case_ >> low) & 1u) == 1u);
}

fn body(cell: vec3i, case_: u32) {
    let count = case_word(case_, 1u) >> 28u;
    for (var t = 0u; t < count; t++) {
        triangle(body_vertex(cell, case_, 3u * t), body_vertex(cell, case_, 3u * t + 1u), body_vertex(cell, case_, 3u * t + 2u));
    }
}

fn walk(cell: vec3i) {
    let mask = inside_of(cell);
    let bodies = bodies_at(cell);
    if bodies == 0u {
        if mask != 0u && mask != 255u { body(cell, mask); }
    } else {
        for (var first = 0u; first < 8u; first++) {
            var case_ = 0u;
            for (var i = 0u; i < 8u; i++) {
                case_ |= u32(((bodies >> (3u * i)) & 7u) == first) << i;
            }
            case_ &= mask;
            if case_ != 0u { body(cell, case_); }
        }
    }
    for (var axis = 0u; axis < 3u; axis++) {
        if (bodies | bodies_at(cell + axis_vector(axis))) != 0u { caps(cell, axis); }
    }
}

// Caps: see caps.rs. Corners of the face as this cell sees it from outside; edge i joins corners i and i + 1.
struct Face { cell: vec3i, axis: u32, inside: u32, split: u32, here: u32, across: u32 }

fn face_corner(axis: u32, i: u32) -> u32 {
    let u = 1u << ((axis + 1u) % 3u);
    let v = 1u << ((axis + 2u) % 3u);
    return (1u << axis) | select(0u, u, i == 1u || i == 2u) | select(0u, v, i >= 2u);
}

// Low corner of edge i.
fn face_edge_corner(axis: u32, i: u32) -> u32 {
    return min(face_corner(axis, i), face_corner(axis, (i + 1u) & 3u));
}

fn face_edge_axis(axis: u32, i: u32) -> u32 {
    return (axis + 1u + (i & 1u)) % 3u;
}

// The vertex on edge i that keeps corner `keeps`.
fn face_vertex(face: Face, i: u32, keeps: u32) -> u32 {
    let e = i & 3u;
    let low = face_edge_corner(face.axis, e);
    return place_of_vertex(face.cell + corner_of(low), face_edge_axis(face.axis, e), face_corner(face.axis, keeps & 3u) == low);
}

fn bit(bits: u32, i: u32) -> bool {
    return ((bits >> (i & 3u)) & 1u) == 1u;
}

fn is_joint(face: Face, i: u32) -> bool {
    return bit(face.inside, i) && bit(face.inside, i + 1u) && !bit(face.split, i);
}

fn caps(cell: vec3i, axis: u32) {
    var face = Face(cell, axis, 0u, 0u, 0u, 0u);
    let next = cell + axis_vector(axis);
    let behind = 7u & ~(1u << axis);
    for (var i = 0u; i < 4u; i++) {
        let a = face_corner(axis, i);
        let b = face_corner(axis, (i + 1u) & 3u);
        face.inside |= (label_at(cell + corner_of(a)) & 1u) << i;
        face.here |= u32(are_parted(cell, a, b)) << i;
        face.across |= u32(are_parted(next, a & behind, b & behind)) << i;
    }
    if face.here == face.across { return; }
    for (var i = 0u; i < 4u; i++) {
        face.split |= u32(is_split(cell + corner_of(face_edge_corner(axis, i)), face_edge_axis(axis, i))) << i;
    }
    var stop = 4u;
    for (var i = 0u; i < 4u; i++) {
        if stop == 4u && !is_joint(face, i) { stop = i; }
    }
    if stop == 4u { ring(face); return; }
    var first = stop + 1u;
    while first < stop + 5u {
        var last = first;
        while last < stop + 4u && is_joint(face, last) { last++; }
        if bit(face.inside, first) { run(face, first, last); }
        first = last + 1u;
    }
}

fn run(face: Face, first: u32, last: u32) {
    var path = Path(face_vertex(face, first + 3u, first), 0u, 0u, 0u, 0u);
    for (var edge = first; edge <= last; edge++) {
        let is_end = edge == last;
        path = pass_edge(path, face_vertex(face, edge, edge), is_end || bit(face.here, edge), is_end || bit(face.across, edge));
    }
}

fn ring(face: Face) {
    let both = face.here & face.across;
    if both == 0u {
        ring_of(face, face.here, false);
        ring_of(face, face.across, true);
        return;
    }
    let start = countTrailingZeros(both);
    var path = Path(face_vertex(face, start, start), 0u, 0u, 0u, 0u);
    // With only one edge that both pass, paths end where they began.
    let last = select(start + 4u, start + 3u, both == (1u << start));
    for (var edge = start + 1u; edge <= last; edge++) {
        path = pass_edge(path, face_vertex(face, edge, edge), bit(face.here, edge), bit(face.across, edge));
    }
}

fn ring_of(face: Face, parted: u32, is_across: bool) {
    var path = Path(0u, 0u, 0u, 0u, 0u);
    var is_begun = false;
    for (var edge = 0u; edge < 4u; edge++) {
        if !bit(parted, edge) { continue; }
        let v = face_vertex(face, edge, edge);
        if is_begun { path = pass_edge(path, v, !is_across, is_across); } else { path.start = v; }
        is_begun = true;
    }
}

// Paths of both cells since the last vertex that both pass: their start, and of each its last vertex and
// whether there is one.
struct Path { start: u32, here: u32, here_count: u32, across: u32, across_count: u32 }

// Fans over what each path has beside its chord: this cell's contour runs along its path, so its cap runs
// back.
fn pass_edge(before: Path, v: u32, is_here: bool, is_across: bool) -> Path {
    var path = before;
    if is_here {
        if path.here_count > 0u { triangle(path.start, v, path.here); }
        path.here = v;
        path.here_count++;
    }
    if is_across {
        if path.across_count > 0u { triangle(path.start, path.across, v); }
        path.across = v;
        path.across_count++;
    }
    if is_here && is_across { path = Path(v, 0u, 0u, 0u, 0u); }
    return path;
}
