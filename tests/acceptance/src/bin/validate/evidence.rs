//! What the table of acceptance cases says beside the figures of a run: the exact answer, and what codes and
//! papers of the field reach.

/// Of the rows of a case whose names start with `rows`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence {
    /// The case.
    pub(crate) case: &'static str,
    /// How the rows' names start; empty for all of the case. The longest that fits counts.
    pub(crate) rows: &'static str,
    /// The closed form, the law or the exact answer; empty where there is none.
    pub(crate) exact: &'static str,
    /// The like elsewhere: codes and papers of the field, or the same clay without the method that is judged.
    pub(crate) published: &'static str,
}

const fn exact(case: &'static str, rows: &'static str, exact: &'static str) -> Evidence {
    compared(case, rows, exact, "")
}

const fn compared(case: &'static str, rows: &'static str, exact: &'static str, published: &'static str) -> Evidence {
    Evidence { case, rows, exact, published }
}

/// The evidence of a row, if any: that of the longest name it starts with.
pub(crate) fn of<'a>(all: &'a [Evidence], case: &str, row: &str) -> Option<&'a Evidence> {
    let (case, row) = (case_of(case), row.strip_prefix("in implicit steps, ").unwrap_or(row));
    all.iter().filter(|e| e.case == case && row.starts_with(e.rows)).max_by_key(|e| e.rows.len())
}

/// The case that one in implicit steps repeats: what judges it is the same.
pub(crate) fn case_of(case: &str) -> &str {
    case.strip_suffix(" in implicit steps").unwrap_or(case)
}

/// In the order of the cases.
pub(crate) const EVIDENCE: &[Evidence] = &[
    exact("free fall", "", "`y = g t (t + dt) / 2`"),
    exact("free fall", "free fall: momentum balance", "conserved"),
    exact("rotation", "", "conserved"),
    compared("rotation", "rotation: angular momentum over", "conserved", "PIC loses all of it"),
    compared("rotation", "rotation: kinetic", "conserved", "PIC loses all of it"),
    exact("rotation", "rotation: place", "the turn of a rigid body"),
    compared(
        "bar",
        "",
        "`f = c / 2 L`, undamped",
        "PIC damps 3.1 %; this scheme in 2-D, f64, 32 cells: frequency 0.10 %, damping 0.003 %",
    ),
    compared(
        "column",
        "",
        "Hencky, 1-D integral: `M ln(l) / l = -rho g (H - X)`",
        "clamped walls: stress 17-19 % off at the floor at any resolution",
    ),
    exact("finite strain", "", "Hencky: `F = A E ln(l) / l`, sides `l^-nu`"),
    exact("finite strain", "bar pressed by 15 %: its length", ""),
    exact("finite strain", "bar stretched by 15 %: its length", ""),
    exact("strain paths", "", "`tau = 2 mu H + lambda tr(H) I`, `|dev tau| <= sqrt(2/3) sY`"),
    exact("cone", "", "exponent 2"),
    exact("cavity", "", "1-D integral of the shell"),
    exact("full step", "full step: elastic stretch", "`tau = E eps`"),
    exact("full step", "full step: elastic simple shear", "`4 mu asinh(g/2) / sqrt(4 + g^2)`"),
    exact("full step", "full step: plastic", "ODE of the stress angle"),
    exact("full step", "full step: plastic shear, error over", "first order: 10"),
    exact("full step", "full step: viscous", "`sY + eta (gdot / sqrt 3)^n`"),
    exact("full step", "full step: hardening", "slope `E H / (E + H)`"),
    exact("full step", "full step: hardening stretch, force within", ""),
    exact("manufactured solution", "", "`u_i = A sin(pi X_i) sin(c pi t + phi_i)`, order 2"),
    exact("momentum", "", "Newton's third law"),
    exact("momentum", "momentum: all tools", "Newton's third law; what a change of inertia gives is reported"),
    exact("tool offset", "", "0"),
    exact("punch", "", ""),
    compared("punch", "punch: least F", "`2 + pi`", "plain MPM 6.04 (nu .45), 6.63 (.49) in 2-D"),
    compared("punch", "punch: greatest F", "`2 + pi`", "plain MPM 6.04 (nu .45), 6.63 (.49) in 2-D"),
    compared("punch", "punch: in-cell rms of pressure,", "0", "plain MPM 2.9 k in 2-D"),
    exact("punch", "punch: width", "0"),
    compared("punch", "punch: F at nu", "0", "plain MPM .093 here"),
    compared("cut slope", "", "`k / (rho g H) = 1 / 3.78 = .2645`", "limit analysis .2643-.2648"),
    exact("cut slope", "cut slope, damped: elastic", ""),
    compared(
        "cylinder slump",
        "",
        "`1 - 2 t (1 - ln 2 t)`, 2 t = sY / (rho g H)",
        "discrepancies remain in print (Roussel and Coussot 2005)",
    ),
    exact("sudden slump", "", "the weight's work is in motion, strain and flow"),
    exact("work of tools", "", "a tool's work is in motion, strain, flow and friction"),
    exact("blade force", "blade force: slope, sticking", "`F = 2 alpha k L h`, alpha 1"),
    exact("blade force", "blade force: slope, frictionless", "`F = 2 alpha k L h`, alpha 0"),
    exact("blade force", "blade force: exponent", "1"),
    exact("blade force", "blade force: loop", "rigid and plastic: 2"),
    exact("strips", "", "1"),
    exact("strips", "strips: F / (B k)", "`2 + pi`"),
    exact("held ball", "", "an inviscid force stays: 1"),
    exact("time steps", "", "no effect: 0"),
    exact("squeezed ball", "", "0"),
    exact("elastic balls", "", "`d = (F / (4/3 E* sqrt(R)))^(2/3) - F f(a) / (pi E)`: with the far plate's share (Tatara 1991)"),
    exact("nothing inside", "", "0"),
    exact("parted clay", "", "0"),
    exact("dragged plate", "", "Coulomb: 0"),
    exact("scaled inertia", "", "conserved, but for what the report names"),
    exact("scaled inertia", "cube falling", "`g`"),
    exact("knife", "", "`R A`, R the toughness"),
    exact("knife", "knife: flanks", "`2 k L h`"),
    exact("knife", "knife: work when", "0: nothing new is cut"),
    exact("knife", "knife: work in", "0: nothing new is cut"),
    exact("knife", "knife: work of another", "0: nothing new is cut"),
    exact("knife", "knife: the same, a tenth", "0: nothing new is cut"),
    exact("knife", "knife: force", "`R L`"),
    exact("step with a tool", "", "no less than without a tool"),
    compared(
        "step limit",
        "",
        "one particle: `dt = dx sqrt(rho / (3 K))`; more of them no less",
        "boundaries are less stable (Bai and Schroeder 2022)",
    ),
    exact("energy", "", "conserved"),
    exact("cell crossing", "", "uniform stress"),
    exact("pressed clay", "", ""),
    exact("separating floor", "", "no tension; momentum conserved"),
    exact("rest", "rest: gap", "0"),
    exact("rest", "rest: speed", "0"),
    compared("blade leak", "", "", "tags without memory: 4-97 % pass through, kept tags without the sweep: 1-94 %, in 2-D"),
    exact("blade leak", "blade leak: least J", ""),
    exact("blade leak", "blade leak: greatest J", ""),
    exact("blade withdrawn", "", "a cut bears no tension"),
    exact("cut methods", "", ""),
    exact("cut methods", "cut methods, ours: swept", "nothing passes"),
    exact("cut methods", "cut methods, ours: greatest depth", "nothing passes"),
    exact("blade at rest", "", "nothing changes sides"),
    exact("closed cut", "", ""),
    exact("opened cut", "", "what is apart bears nothing, what touches as whole clay"),
    exact("bodies", "", "what is apart bears nothing, what touches as whole clay"),
    exact("three planes", "", "three planes through one point make eight"),
    exact("welded cut", "", ""),
    exact("cut slopes", "", "`g (sin - mu cos)`, 0 below the angle of friction"),
    exact("rolled cut", "", "a cut bears no tension"),
    exact("ended cut", "", "what was not cut is whole"),
    compared("creep", "", "`u = v t`", "positions from the grid's origin in f32: does not move at all"),
    exact("shift", "", "the same bits"),
    exact("crowded cells", "", ""),
    exact("determinism", "", "the same bits"),
    exact("health", "", ""),
    exact("bad input", "", ""),
    exact("random strains", "", "`F F^T - I`"),
    exact("as published", "as published, tau 0.3 cells", "free fall `g t^2 / 2`"),
    exact("as published", "as published, tau 3 cells", "energy is conserved"),
    exact("as published", "softened", "energy is conserved"),
    exact("implicit strip", "", "the explicit step at real density, extrapolated in dt"),
    exact("implicit ball", "", "the explicit step at real density, extrapolated in dt"),
    exact("implicit blade", "", "a strip as wide by the explicit step; its own blades hold nodes"),
    exact("implicit board", "", "the explicit step"),
    exact("implicit stop", "", "the explicit step"),
    exact("implicit pads", "", "the explicit step"),
    exact("implicit clays", "", "the explicit step at real density, extrapolated in dt"),
    exact("implicit hold", "", "an inviscid force stays: 1"),
    exact("implicit unloading", "", "the explicit step"),
    exact("implicit release", "", "the explicit step, damped"),
    exact("implicit own weight", "", "the explicit step, damped"),
    exact("implicit toss", "", "conserved"),
    exact("implicit landing", "", "touches it: half a particle's cube above it"),
    exact("implicit mirror", "", "the whole strip"),
    exact("implicit sparse", "", "the explicit step"),
    exact("implicit determinism", "", "the same bits"),
    exact("implicit scenes", "", "work of tools and weight is all the energy there is"),
    compared(
        "force limits",
        "",
        "",
        "a loop whose wall is in the servo: bare 566, 177, 107, pinch 4476, 1496, 909, stylus 3205, 1971 N/m; \
         `(b + B) / (T / 2 + t_d)` (Gil et al. 2009)",
    ),
    exact("force by default", "", ""),
    exact("force start", "", "no kick"),
    exact("proxy", "", "the nearest of all sets of up to three planes"),
    exact("proxy", "proxy: places changed", "a scalar in K does not change the argmin"),
    compared("force strokes", "", "the clay's own force on the same way", "the paper: r = 0.983, which a ramp reaches too"),
    exact("force of erring models", "", "the clay's own force on the same way"),
    exact("held force", "", "an inviscid force stays"),
    exact("held force of an engine's clay", "", "an inviscid force stays"),
    exact("knife in the hand", "", "what the clay's frames give the blade"),
    exact("knife in the hand", "force, knife that slips at 5 mm/s: mean force out", "0: nothing new is cut, nothing clings"),
    exact("knife in the hand", "force, knife that slips at 50 mm/s: mean force out", "0: nothing new is cut, nothing clings"),
    exact("force of slow clay", "", "the clay's own force on the same way"),
    compared(
        "force of an engine's clay",
        "",
        "the clay's own force on the same way, in fine steps; that of half the cells",
        "the paper: r = 0.983, which a ramp reaches too",
    ),
    exact("force of particles", "", "`C(x) >= 0`, Eq. 7"),
    exact("force shapes", "force, flat punch", "`F = 2 E* a d`"),
    exact("force shapes", "force, ball, Hertz", "`F = 4/3 E* sqrt(R) d^1.5`"),
    exact("force shapes", "force, ball between plates", "`d = (F / (4/3 E* sqrt(R)))^(2/3) - F f(a) / (pi E)` (Tatara 1991)"),
    exact("force shapes", "force, cone", "`F = H pi tan^2(alpha) d^2`"),
    compared("proxy time", "", "", "the paper's whole solver: 19-27 us"),
    exact("random fields", "", "closed, manifold, oriented"),
    compared("cuts", "", "balls: two, or one where the cut ends in the cube", "Eq. 9 as published: 44 %"),
    exact("cuts", "cuts: gap", "no gap"),
    exact("cuts", "cuts: open edges", "closed"),
    exact("cuts", "cuts: right bodies by Eq. 9", "balls"),
    exact("meeting cuts", "", "balls"),
    exact("meeting cuts", "meeting cuts: open edges", "closed"),
    compared("cut faces", "", "the blade's plane, the whole block", "faces .12 cells off, 2.2 % of the volume, before bodies"),
    exact("sphere", "", "the sphere"),
    exact("clusters", "", "the particles' volume"),
    exact("surface in motion", "", "moves with the clay"),
    exact("surface in motion", "the same clay twice", "the same bits"),
    exact("clay at rest", "", "nothing moves"),
    exact("surface on the device", "", "the processor's mesh of the same fields"),
    exact("surface on the device", "on the device: a dent", "all blocks anew"),
    exact("files", "", "the displayed mesh"),
    exact("files", "file to clay to file", "the mesh of the file"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longest_name_counts() {
        let all = [exact("a", "", "any"), exact("a", "a: x", "x"), exact("b", "a: x y", "other case")];
        let of = |row| of(&all, "a", row).map(|e| e.exact);
        assert_eq!((of("a: x y"), of("a: z")), (Some("x"), Some("any")));
        assert!(super::of(&all, "c", "a: x").is_none());
    }
}
