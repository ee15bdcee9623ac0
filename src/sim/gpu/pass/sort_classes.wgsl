// Each block's keys into their order, so that nothing depends on who entered first.

@compute @workgroup_size(WORKGROUP)
fn sort_classes(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = invocation(group, groups, k);
    if is_halted() || slot >= atomicLoad(&status.slot_count) { return; }
    let first = keys_place(slot);
    for (var i = 1u; i < KEYS; i++) {
        let key = cuts[first + i];
        if key == 0u { break; }
        var at = i;
        for (; at > 0u && cuts[first + at - 1u] > key; at--) {
            cuts[first + at] = cuts[first + at - 1u];
        }
        cuts[first + at] = key;
    }
}
