// Sums over the particles, one partial sum a workgroup; the host adds them up in f64. In masses, cells and
// substeps.

@group(0) @binding(18) var<storage, read_write> totals: array<Total>;

var<workgroup> partial: array<Total, WORKGROUP>;

fn of_particle(i: u32) -> Total {
    let position = state[at(POSITION, i)];
    let v = state[at(VELOCITY, i)].xyz;
    let a0 = state[at(AFFINE, i)];
    let c1 = state[at(AFFINE + 1u, i)].xyz;
    let c2 = state[at(AFFINE + 2u, i)].xyz;
    let a = state[at(STRAIN, i)];
    let b = state[at(STRAIN + 1u, i)];
    let e = Sym(a.xyz, vec3f(a.w, b.xy));
    let h = hencky(e);
    let tau = stress_of(h);
    let c0 = a0.xyz;
    let m = a0.w;
    let x = vec3f(unpack_cell(bitcast<u32>(position.w)) - params.centre) + position.xyz;
    // A quadratic spline's inertia: sum of w (x_i - x_p)^2 = 1/4 along each axis.
    let curl = vec3f(c1.z - c2.y, c2.x - c0.z, c0.y - c1.x);
    let square = dot(v, v) + 0.25 * (dot(c0, c0) + dot(c1, c1) + dot(c2, c2));
    let ratio = 1.0 + expm1(trace(h));
    let given = abs(tau.d) + abs(tau.o.xxy) + abs(tau.o.yzz);
    let reach = max(abs(v) + 1.5 * (abs(c0) + abs(c1) + abs(c2)), 1.5 * given);
    return Total(m * v, m * length(v), m * (cross(x, v) + 0.25 * curl), 0.5 * m * square,
        m * vec3f(norm2(h), trace(h) * trace(h), ratio), m, vec2f(ratio), max(reach.x, max(reach.y, reach.z)), 0.0);
}

fn sum(a: Total, b: Total) -> Total {
    return Total(a.momentum + b.momentum, a.momentum_size + b.momentum_size, a.angular + b.angular, a.kinetic + b.kinetic,
        a.strain + b.strain, a.mass + b.mass, vec2f(min(a.ratio.x, b.ratio.x), max(a.ratio.y, b.ratio.y)), max(a.reach, b.reach), 0.0);
}

@compute @workgroup_size(WORKGROUP)
fn total(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    var here = Total(vec3f(0.0), 0.0, vec3f(0.0), 0.0, vec3f(0.0), 0.0, vec2f(1e30, -1e30), 0.0, 0.0);
    if i < params.particle_count && !is_halted() { here = of_particle(i); }
    partial[k] = here;
    for (var step = WORKGROUP / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if k < step { partial[k] = sum(partial[k], partial[k + step]); }
    }
    let place = group.y * groups.x + group.x;
    if k != 0u || place >= arrayLength(&totals) { return; }
    let all_ = partial[0];
    // A flag keeps the frame after this one off the records that this one started from.
    if !is_finite(dot(abs(all_.momentum) + abs(all_.angular) + abs(all_.strain), vec3f(1.0)) + all_.kinetic + all_.momentum_size + all_.reach) {
        halt(NON_FINITE);
    }
    totals[place] = all_;
}
