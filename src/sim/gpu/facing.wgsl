// How the two sides of a kept cut, or two bodies, face each other at a node.

// What two fields stand on either side of: a sheet, or, of sheet 0, two bodies.
struct Between { sheet: u32, back: u32, front: u32 }

// On which side of it the clay of a class is: 1 front, -1 back, 0 neither.
fn side_between(key: u32, between: Between) -> i32 {
    if between.sheet != 0u { return side_of(key, between.sheet); }
    return i32(body_of(key) == between.front) - i32(body_of(key) == between.back);
}

// Folded masses at a node, in any block, of the clay in front and behind.
fn masses_about(n: vec3i, between: Between) -> vec2f {
    var m = vec2f(0.0);
    let slot = slot_of(n);
    if slot == 0u { return m; }
    for (var c = 0u; c < CLASSES; c++) {
        let key = key_at(slot - 1u, c);
        if c > 0u && key == 0u { break; }
        let side = side_between(key, between);
        if side == 0 { continue; }
        let mass = bitcast<f32>(cuts[masses_place(slot - 1u, c, local_index(n))]);
        m += vec2f(select(0.0, mass, side > 0), select(0.0, mass, side < 0));
    }
    return m;
}

// How two sides face each other: the unit normal, from back to front, 0 where there is none, and
// the gap along it [cells].
struct Facing { normal: vec3f, gap: f32 }

// Distance of the face of clay whose weighted centre stands that far before a node (`cut::face_distance`).
fn face_distance(centre: f32) -> f32 {
    let c = clamp(centre, 0.0, 1.0);
    let high = (FACE_DISTANCE_0 * c + FACE_DISTANCE_1) * c + FACE_DISTANCE_2;
    return ((high * c + FACE_DISTANCE_3) * c + FACE_DISTANCE_4) * c + FACE_DISTANCE_5;
}

// That at a node, whose normal is the slope of the front's share of the mass on both sides, fitted to the
// nodes about it, or the way from the back's centre to the front's (`cut::facing`).
fn facing_at(n: vec3i, between: Between) -> Facing {
    var weight = 0.0;
    var share_sum = 0.0;
    var offset_sum = vec3f(0.0);
    var slope_sum = vec3f(0.0);
    var moment = mat3x3f();
    var front = vec4f(0.0);
    var back = vec4f(0.0);
    for (var i = 0; i < 27; i++) {
        let o = vec3i(i / 9, (i / 3) % 3, i % 3) - 1;
        let m = masses_about(n + o, between);
        let offset = vec3f(o);
        let off = abs(o);
        let near = 1.0 / f32(1u << u32(off.x + off.y + off.z));
        front += near * m.x * vec4f(offset, 1.0);
        back += near * m.y * vec4f(offset, 1.0);
        if min(m.x, m.y) <= 0.0 { continue; }
        let share = m.x / (m.x + m.y);
        let w = share * m.y * near;
        weight += w;
        share_sum += w * share;
        offset_sum += w * offset;
        slope_sum += w * share * offset;
        moment += mat3x3f(w * offset.x * offset, w * offset.y * offset, w * offset.z * offset);
    }
    if weight == 0.0 { return Facing(vec3f(0.0), 0.0); }
    let mean = offset_sum / weight;
    moment -= weight * mat3x3f(mean.x * mean, mean.y * mean, mean.z * mean);
    let more = NORMAL_REGULARISATION * (moment[0].x + moment[1].y + moment[2].z);
    moment += mat3x3f(vec3f(more, 0.0, 0.0), vec3f(0.0, more, 0.0), vec3f(0.0, 0.0, more));
    // The matrix is symmetric: its inverse is that of its cofactors, over its determinant.
    let sum = slope_sum - mean * share_sum;
    let cofactors = array(cross(moment[1], moment[2]), cross(moment[2], moment[0]), cross(moment[0], moment[1]));
    let slope = vec3f(dot(cofactors[0], sum), dot(cofactors[1], sum), dot(cofactors[2], sum));
    let determinant = dot(moment[0], cofactors[0]);
    let is_fit = determinant > 0.0 && length(slope) >= SHARE_SLOPE_MIN * determinant;
    let centres = array(front.xyz / front.w, back.xyz / back.w);
    let along = select(centres[0] - centres[1], slope, is_fit);
    let size = length(along);
    if size == 0.0 { return Facing(vec3f(0.0), 0.0); }
    let normal = along / size;
    let d = vec2f(face_distance(dot(centres[0], normal)), face_distance(-dot(centres[1], normal)));
    let off = 0.5 * (d.x - d.y);
    let more_ = select(GAP_ALLOWANCE * off * off, -BODY_NEARNESS, between.sheet == 0u);
    return Facing(normal, d.x + d.y + more_);
}
