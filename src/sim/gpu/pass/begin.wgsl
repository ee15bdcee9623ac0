// One invocation: counts the substeps anew in each submission and, where a frame starts, clears its counters.
// Flags stay.

@compute @workgroup_size(1)
fn begin() {
    atomicStore(&status.substep, 0u);
    if is_halted() || params.starts_frame == 0u { return; }
    atomicStore(&status.speed, 0u);
    atomicStore(&status.clamped, 0u);
    atomicStore(&status.cell_count, 0u);
    atomicStore(&status.node_mass, 0u);
    atomicStore(&status.reach_met, 0u);
    atomicStore(&status.crowded, 0u);
    atomicStore(&status.welded, 0u);
    atomicStore(&status.joined, 0u);
    atomicStore(&status.carried, 0u);
    atomicStore(&status.body_max, 0u);
    for (var i = 0u; i < 8u; i++) {
        atomicStore(&status.sheets[i], 0u);
    }
    for (var i = 0u; i < TOOLS_MAX; i++) {
        atomicStore(&status.tools[i].tagged, 0u);
        atomicStore(&status.tools[i].pushed_back, 0u);
        atomicStore(&status.tools[i].depth, 0u);
        atomicStore(&status.tools[i].displaced, 0u);
    }
}
