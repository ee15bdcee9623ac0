// Lists the particles by cell.

@group(0) @binding(12) var<storage, read_write> prefix: array<u32>;
@group(0) @binding(14) var<storage, read_write> keys: array<vec2u>;
@group(0) @binding(15) var<storage, read_write> list: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn place(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    list[prefix[keys[i].x] + keys[i].y] = i;
}
