// Remembers the fields that are extracted.

@group(0) @binding(4) var<storage, read> blocks: array<u32>;
@group(0) @binding(8) var<storage, read> fields: array<f32>;
@group(0) @binding(10) var<storage, read_write> kept: array<f32>;
@group(0) @binding(11) var<storage, read_write> kept_blocks: array<u32>;

@compute @workgroup_size(256)
fn keep(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.x;
    let plane = group.y;
    if k == 0u && plane == 0u { kept_blocks[slot] = blocks[slot]; }
    for (var j = k; j < 512u; j += 256u) {
        let at = (slot * planes_stored() + plane) * 512u + j;
        kept[at] = fields[at];
    }
}
