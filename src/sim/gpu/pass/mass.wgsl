// Node masses of the last substep, one exact sum a block: high and low part of a 64 bit integer.

@group(0) @binding(8) var<storage, read_write> sums: array<vec4i>;
@group(0) @binding(19) var<storage, read_write> masses: array<vec2u>;

@compute @workgroup_size(WORKGROUP)
fn mass(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = invocation(group, groups, k);
    if slot >= arrayLength(&masses) || is_halted() { return; }
    var total = vec2u(0u);
    if slot < atomicLoad(&status.slot_count) {
        for (var n = slot * CLASSES * 64u; n < (slot + 1u) * CLASSES * 64u; n++) {
            let m = u32(sums[2u * n].w);
            total += vec2u(m >> 16u, m & 0xffffu);
        }
    }
    masses[slot] = total;
}
