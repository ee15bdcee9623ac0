// The yield norm of a particle, Eq. 5 with the nearest tool, thixotropy, hardening; and its history.

// Distance to the nearest tool at the substep's end.
fn nearest_tool(cell: vec3i, offset: vec3f) -> f32 {
    var nearest = NOWHERE;
    for (var t = 0u; t < params.tool_count; t++) {
        let tool = tool_now(t);
        nearest = min(nearest, abs(distance_to(tool, local_end(tool, cell, offset))));
    }
    return nearest;
}

// Greatest |dev H| at rest of a particle with plastic strain a.
fn yield_norm_at(cell: vec3i, offset: vec3f, a: f32, structure: f32) -> f32 {
    var norm = params.yield_norm;
    if params.softens != 0u {
        let beyond = max(nearest_tool(cell, offset) - SOFTENING_REACH, 0.0) / params.softening_length;
        norm *= 1.0 - params.softening * (1.0 + expm1(-min(beyond, 80.0)));
    }
    return norm * (1.0 - params.work_loss * structure) + params.hardening_norm * a;
}

// The working of a particle after a substep with so much more plastic strain.
fn structure_after(structure: f32, plastic: f32) -> f32 {
    return (structure + (1.0 - structure) * -expm1(-min(params.work_rate * plastic, 80.0))) * params.work_kept;
}
