// The clay law, as in the native engine: Hencky elasticity and von Mises return on E = b_e - I. Series for
// small strain, eigenvalues beyond. Stress is scaled: tau 4 h^2 / (rho_s dx^2).

struct Sym { d: vec3f, o: vec3f } // xx yy zz, xy xz yz
struct Update { stress: Sym, strain: Sym, plastic: f32, clamped: bool }

fn norm2(x: Sym) -> f32 {
    return dot(x.d, x.d) + 2.0 * dot(x.o, x.o);
}

fn trace(x: Sym) -> f32 {
    return x.d.x + x.d.y + x.d.z;
}

fn scaled(x: Sym, s: f32) -> Sym {
    return Sym(x.d * s, x.o * s);
}

// Product of commuting symmetric matrices.
fn product(a: Sym, b: Sym) -> Sym {
    let s = a.o * b.o;
    return Sym(
        a.d * b.d + vec3f(s.x + s.y, s.x + s.z, s.y + s.z),
        vec3f(a.d.x * b.o.x + a.o.x * b.d.y + a.o.y * b.o.z,
            a.d.x * b.o.y + a.o.x * b.o.z + a.o.y * b.d.z,
            a.o.x * b.o.y + a.d.y * b.o.z + a.o.z * b.d.z));
}

// ln(I + X) / 2, Pade [3/3].
fn hencky_series(x: Sym) -> Sym {
    let x2 = product(x, x);
    let x3 = product(x2, x);
    let n = Sym(30.0 * (x.d + x2.d) + 5.5 * x3.d, 30.0 * (x.o + x2.o) + 5.5 * x3.o);
    let q = Sym(60.0 + 90.0 * x.d + 36.0 * x2.d + 3.0 * x3.d, 90.0 * x.o + 36.0 * x2.o + 3.0 * x3.o);
    let a = Sym(
        vec3f(q.d.y * q.d.z - q.o.z * q.o.z, q.d.x * q.d.z - q.o.y * q.o.y, q.d.x * q.d.y - q.o.x * q.o.x),
        vec3f(q.o.y * q.o.z - q.o.x * q.d.z, q.o.x * q.o.z - q.o.y * q.d.y, q.o.x * q.o.y - q.o.z * q.d.x));
    return scaled(product(n, a), 1.0 / (q.d.x * a.d.x + q.o.x * a.o.x + q.o.y * a.o.y));
}

// exp(2 h) - I by Taylor to the 6th order.
fn expm1_series(h: Sym) -> Sym {
    let y = scaled(h, 2.0);
    var t = scaled(y, 1.0 / 720.0);
    t.d += 1.0 / 120.0;
    t = product(y, t);
    t.d += 1.0 / 24.0;
    t = product(y, t);
    t.d += 1.0 / 6.0;
    t = product(y, t);
    t.d += 0.5;
    t = product(y, t);
    t.d += 1.0;
    return product(y, t);
}

// (I + L)(I + E)(I + L)^T - I without forming I + E; l[c][r] = h d v_r / d x_c.
fn trial(l: mat3x3f, e: Sym) -> Sym {
    let em = mat3x3f(vec3f(e.d.x, e.o.x, e.o.y), vec3f(e.o.x, e.d.y, e.o.z), vec3f(e.o.y, e.o.z, e.d.z));
    let m = l + em + l * em;
    return Sym(
        vec3f(m[0].x + l[0].x + m[0].x * l[0].x + m[1].x * l[1].x + m[2].x * l[2].x,
            m[1].y + l[1].y + m[0].y * l[0].y + m[1].y * l[1].y + m[2].y * l[2].y,
            m[2].z + l[2].z + m[0].z * l[0].z + m[1].z * l[1].z + m[2].z * l[2].z),
        vec3f(m[1].x + l[0].y + m[0].x * l[0].y + m[1].x * l[1].y + m[2].x * l[2].y,
            m[2].x + l[0].z + m[0].x * l[0].z + m[1].x * l[1].z + m[2].x * l[2].z,
            m[2].y + l[1].z + m[0].y * l[0].z + m[1].y * l[1].z + m[2].y * l[2].z));
}

// ln(1 + w) and exp(x) - 1 to a unit in the last place of 1: the built-in ones may be off by 5e-7.
fn ln_1p(w: f32) -> f32 {
    let a = 1.0 + w;
    let e = i32(bitcast<u32>(a) >> 23u) - 127;
    let large = ((bitcast<u32>(a) & 0x7fffffu) | 0x3f800000u) > 0x3fb504f3u; // mantissa beyond sqrt 2
    let k = select(e, e + 1, large);
    let m = bitcast<f32>(bitcast<u32>(a) - (u32(k) << 23u));
    // While nothing is shifted, w itself has the digits that 1 + w lost.
    let s = select((m - 1.0) / (m + 1.0), w / (2.0 + w), k == 0);
    let s2 = s * s;
    let p = 2.0 * s * (1.0 + s2 * (1.0 / 3.0 + s2 * (0.2 + s2 * (1.0 / 7.0 + s2 * (1.0 / 9.0 + s2 / 11.0)))));
    return p + f32(k) * 0.6931472;
}

fn expm1(x: f32) -> f32 {
    let k = round(x * 1.442695);
    let r = (x - k * 0.69314575) - k * 1.4286068e-6;
    let p = r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r / 5040.0))))));
    let two_k = bitcast<f32>(u32(i32(k) + 127) << 23u);
    return select(two_k * p + (two_k - 1.0), p, k == 0.0);
}

struct Eigen { w: vec3f, q: mat3x3f } // q[k] belongs to w[k]

// One Jacobi rotation in the plane of axes i and j; r is the third.
struct Turn { c: f32, s: f32, t: f32 }
fn turn(ii: f32, jj: f32, ij: f32) -> Turn {
    if ij == 0.0 { return Turn(1.0, 0.0, 0.0); }
    let theta = 0.5 * (jj - ii) / ij;
    let t = select(-1.0, 1.0, theta >= 0.0) / (abs(theta) + sqrt(theta * theta + 1.0));
    let c = 1.0 / sqrt(t * t + 1.0);
    return Turn(c, t * c, t);
}

fn eigen(x: Sym) -> Eigen {
    var d = x.d;
    var o = x.o;
    var q = mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    // Convergence is quadratic: 5 sweeps leave nothing in f32.
    for (var sweep = 0; sweep < 5; sweep++) {
        let a = turn(d.x, d.y, o.x);
        d = vec3f(d.x - a.t * o.x, d.y + a.t * o.x, d.z);
        o = vec3f(0.0, a.c * o.y - a.s * o.z, a.s * o.y + a.c * o.z);
        q = mat3x3f(a.c * q[0] - a.s * q[1], a.s * q[0] + a.c * q[1], q[2]);
        let b = turn(d.x, d.z, o.y);
        d = vec3f(d.x - b.t * o.y, d.y, d.z + b.t * o.y);
        o = vec3f(b.c * o.x - b.s * o.z, 0.0, b.s * o.x + b.c * o.z);
        q = mat3x3f(b.c * q[0] - b.s * q[2], q[1], b.s * q[0] + b.c * q[2]);
        let g = turn(d.y, d.z, o.z);
        d = vec3f(d.x, d.y - g.t * o.z, d.z + g.t * o.z);
        o = vec3f(g.c * o.x - g.s * o.y, g.s * o.x + g.c * o.y, 0.0);
        q = mat3x3f(q[0], g.c * q[1] - g.s * q[2], g.s * q[1] + g.c * q[2]);
    }
    return Eigen(d, q);
}

fn compose(e: Eigen, w: vec3f) -> Sym {
    let a = e.q[0];
    let b = e.q[1];
    let c = e.q[2];
    return Sym(w.x * a * a + w.y * b * b + w.z * c * c,
        w.x * a.xxy * a.yzz + w.y * b.xxy * b.yzz + w.z * c.xxy * c.yzz);
}

// H and whether a principal stretch was beyond its limits and was clamped.
struct Principal { e: Eigen, h: vec3f, clamped: bool }
fn principal(x: Sym) -> Principal {
    let e = eigen(x);
    let w = clamp(e.w, vec3f(PRINCIPAL_MIN), vec3f(PRINCIPAL_MAX));
    let clamped = any(w != e.w) && is_finite(norm2(x));
    return Principal(e, 0.5 * vec3f(ln_1p(w.x), ln_1p(w.y), ln_1p(w.z)), clamped);
}

fn stress_of(h: Sym) -> Sym {
    return Sym(params.mu2 * h.d + params.lambda * trace(h), params.mu2 * h.o);
}

fn is_beyond(x: Sym) -> bool {
    let n = norm2(x);
    return !is_finite(n) || n > SERIES_MAX * SERIES_MAX;
}

fn hencky(x: Sym) -> Sym {
    if is_beyond(x) {
        let p = principal(x);
        return compose(p.e, p.h);
    }
    return hencky_series(x);
}

fn stress(e: Sym) -> Sym {
    return stress_of(hencky(e));
}

// By how much flow shortens a Hencky deviator that is `excess` too long: root of (1 + hardening) g + viscous
// g^n = excess. Newton's method in z = g^n falls to it from above, as on the native engine.
fn shortening(excess: f32) -> f32 {
    let linear = 1.0 + params.hardening;
    if params.viscous == 0.0 { return excess / linear; }
    if params.flow_index == 1.0 { return excess / (linear + params.viscous); }
    let power = 1.0 / params.flow_index;
    var z = min(excess / params.viscous, pow(excess / linear, params.flow_index));
    for (var step = 0u; step < FLOW_STEPS; step++) {
        let g = linear * pow(z, power);
        z -= (g + params.viscous * z - excess) / (power * g / z + params.viscous);
    }
    return clamp(pow(z, power), 0.0, excess);
}

// Stress and strain after one substep.
fn update(l: mat3x3f, e: Sym, yield_norm: f32) -> Update {
    let x = trial(l, e);
    if is_beyond(x) {
        let p = principal(x);
        let third = (p.h.x + p.h.y + p.h.z) / 3.0;
        let d = p.h - third;
        let size = sqrt(dot(d, d));
        var shorter = 0.0;
        if size > yield_norm { shorter = shortening(size - yield_norm); }
        let h = d * select(1.0, (size - shorter) / size, shorter > 0.0) + third;
        let b = vec3f(expm1(2.0 * h.x), expm1(2.0 * h.y), expm1(2.0 * h.z));
        let tau = params.mu2 * h + params.lambda * (h.x + h.y + h.z);
        return Update(compose(p.e, tau), compose(p.e, b), SQRT_2_3 * shorter, p.clamped);
    }
    let h = hencky_series(x);
    let third = trace(h) / 3.0;
    let d = Sym(h.d - third, h.o);
    let size = sqrt(norm2(d));
    if size > yield_norm {
        let shorter = shortening(size - yield_norm);
        let ratio = (size - shorter) / size;
        let back = Sym(d.d * ratio + third, d.o * ratio);
        return Update(stress_of(back), expm1_series(back), SQRT_2_3 * shorter, false);
    }
    return Update(stress_of(h), x, 0.0, false);
}
