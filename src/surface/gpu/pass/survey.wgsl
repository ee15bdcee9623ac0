// Which cuts there are, and on which sides of them there is clay.

@compute @workgroup_size(64)
fn survey(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count || particles[SURFACE_PARTICLE_WORDS * i + SURFACE_PARTICLE_TAGS] == 0u || !is_usable(i) { return; }
    for (var slot = 0u; slot < 2u; slot++) {
        let tag = tag_of(i, slot);
        if tag.sheet != 0u {
            atomicOr(&status.sides[select(8u, 0u, tag.side > 0) + (tag.sheet >> 5u)], 1u << (tag.sheet & 31u));
        }
    }
}
