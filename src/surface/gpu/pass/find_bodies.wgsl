// Which bodies are near each block, if there are several in all: those of the particles that reach it.

@group(0) @binding(9) var<storage, read_write> cells: array<atomic<u32>>;

fn insert(slot: u32, body: u32) {
    let first = list_first(slot) + 2u + params.body_capacity;
    var i = 0u;
    while i < params.body_capacity {
        let there = atomicLoad(&cells[first + i]);
        if there == body + 1u { return; }
        if there != 0u {
            i++;
        } else if atomicCompareExchangeWeak(&cells[first + i], 0u, body + 1u).exchanged {
            return;
        }
    }
    atomicStore(&status.bodies_wanted, max(4u, 2u * params.body_capacity));
}

@compute @workgroup_size(64)
fn find_bodies(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count || atomicLoad(&status.has_others) == 0u || !is_usable(i) { return; }
    let base = stencil_of(i).base;
    let low = (base - params.reach_low) >> vec3u(3u);
    let high = (base + params.reach_high) >> vec3u(3u);
    for (var z = low.z; z <= high.z; z++) {
        for (var y = low.y; y <= high.y; y++) {
            for (var x = low.x; x <= high.x; x++) {
                let slot = slot_of(vec3i(x, y, z));
                if slot != 0u { insert(slot - 1u, body_of(i)); }
            }
        }
    }
}
