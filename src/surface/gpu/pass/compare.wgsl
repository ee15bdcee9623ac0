// Whether a block, or a value in it, is another than at the last extraction.

@group(0) @binding(4) var<storage, read> blocks: array<u32>;
@group(0) @binding(8) var<storage, read> fields: array<f32>;
@group(0) @binding(10) var<storage, read> kept: array<f32>; // fields of the last extraction
@group(0) @binding(11) var<storage, read> kept_blocks: array<u32>;

@compute @workgroup_size(256)
fn compare(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.x;
    let plane = group.y;
    if atomicLoad(&status.is_changed) != 0u { return; }
    var is_other = blocks[slot] != kept_blocks[slot];
    for (var j = k; j < 512u; j += 256u) {
        let at = (slot * planes_stored() + plane) * 512u + j;
        is_other = is_other || abs(fields[at] - kept[at]) > HYSTERESIS;
    }
    if is_other { atomicStore(&status.is_changed, 1u); }
}
