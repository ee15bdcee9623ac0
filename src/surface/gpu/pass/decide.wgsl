// What has changed is extracted, the rest not run at all.

@group(0) @binding(17) var<storage, read_write> dispatch: array<u32>;

@compute @workgroup_size(1)
fn decide() {
    if atomicLoad(&status.flags) != 0u {
        atomicStore(&status.is_changed, 0u);
        status.is_stale = 1u;
    }
    if atomicLoad(&status.is_changed) == 0u {
        for (var i = 4u; i < 24u; i += 4u) { dispatch[i] = 0u; }
        return;
    }
    status.kept_slots = status.slot_limits[1];
    status.kept_sheets = status.sheet_count;
    status.kept_bodies = status.has_bodies;
}
