//! The clay solver: explicit MLS-MPM/APIC with quadratic B-splines, Hencky elasticity, von Mises plasticity and persistent cuts.
//!
//! A frame is a [`FramePlan`](frame::FramePlan) run by an [`Engine`](engine::Engine). One substep of it, in the words of every engine:
//!
//! | pass    | does                                                                                  | equation          |
//! |---------|---------------------------------------------------------------------------------------|-------------------|
//! | `averaging` | flowing particles share their cell's volume ratio, now and then (anti-locking)      | -                 |
//! | `tags`  | particles that a blade came near, or swept over, take their side of it                | Eq. 1, swept      |
//! | `p2g`   | mass and momentum of each side class to the nodes, with the stress impulse            | Eq. 2-4           |
//! | `grid`  | momentum -> velocity, gravity, contact of the two sides, tools, walls                 | -                 |
//! | `g2p`   | velocity and affine from the particle's own side, advection, elastic strain, flow     | Eq. 5 (softening) |
//! | `weld`  | sides of a cut that are pressed on each other grow together; once, at the frame's end | -                 |
//!
//! # The substep, exactly
//!
//! Every engine and the oracle do this, in this order; `t` is the substep's start, `h` its length, lengths in cells unless said.
//! Nodes stand at integers; the stencil of a particle at `x` is nodes `b .. b + 2` with `b = floor(x - 1/2)` and the quadratic
//! weights `(1.5 - f)^2 / 2, 3/4 - (f - 1)^2, (f - 1/2)^2 / 2` of `f = x - b`. `rho_s` is the inertial density, `m_p = rho_s V_p`.
//!
//! 0. `average`, before substeps 0, 8, 16 .. of the frame where [`volume_averaging`](frame::FramePlan::volume_averaging) `q > 0`: of each cell `floor(x)` and class, the particles at
//!    yield (`|d| >= 0.99 y`, 4. below, without the viscous part, tools at their poses of `t`) take `1 - (1 - q)^k` of the difference to their mean `ln J`, weighted by
//!    rest volume: `b *= exp(2 (change of ln J) / 3)`. k is the number of substeps up to the next averaging or the frame's end.
//! 1. `tags`, for each blade of the plan in order with its motion from `t` to `t + h`: a particle at `x`, come from
//!    `x - h v`, for which [`Near::takes`](tool::Near::takes) names a side gets the tag (sheet, side): in the slot that has the sheet already, else in slot 0, whose tag
//!    moves to slot 1; what stood there is given up, and counted if it was a side of a third cut. Then a particle with a tag of this sheet that
//!    [`Near::is_behind`](tool::Near::is_behind) is put back along the normal to `side * 1e-3` cells from the plane, and counted.
//! 2. `p2g`: Kirchhoff stress `tau = 2 mu H + lambda tr(H) I` with `H = ln(I + E) / 2`; affine impulse per mass
//!    `A = C - 4 h tau / (rho_s dx^2)` [1/s]; node mass `w m_p` and momentum `w m_p (v + A (x_i - x_p) dx)`, summed apart for
//!    each class of particles: those on the same sides of the same cuts ([`CutKey`](cut::CutKey)). The laws as published multiply tau by
//!    [`stress_factor_at`](material::ClayMaterial::stress_factor_at) the distance to the nearest tool at its pose of `t`.
//! 3. `grid`, per node, with the tools at their poses of `t + h`:
//!    1. **Fold.** Walls fold the ghost node `w - 1` (high walls: `w + 1`) onto its mirror on the other side of the wall node, axis by axis, x
//!       first, each class apart: mass adds, the normal momentum subtracts, the tangential adds (slip, separate) or subtracts (stick).
//!       A separating wall folds a column of three nodes only while clay reaches its ghost, within half a cell of the wall (more than [`WALL_TOUCH`](params::WALL_TOUCH) of the column's mass), and its reaction, of the classes' totals,
//!       `R = (m+ - m-) v - (p+ + p0 + p-) - (m+ + m0 + m-) g'` with `v = (p+ - p-) / (m+ + m-) + g'` is positive: `+` mirror, `0` wall node, `-` ghost, `p`
//!       the normal momenta away from the wall, `g' = g h (rho / rho_s)` along it; else that column has no wall in this substep.
//!    2. **Sides.** Each sheet divides a node or not, apart from the others. Within the band of its blade ([`Blade::within_band`](tool::Blade::within_band))
//!       it does, and the node's owner is the sign of the distance (0 counts as front). Else it does where `m_F + m_B > m / 2`, with `m_F` and `m_B` the masses of the
//!       classes with its side +1 and -1, `m` that of all (folded masses here and below), and the owner is front if `m_F >= m_B`. A class is *beyond* a division if it has the side
//!       that its owner has not; clay without a side of the sheet moves with the owner. A field is all clay that is beyond the same divisions: one at a whole
//!       node, up to two where one cut runs, four where two cross. A folded ghost is divided as its mirror is.
//!    3. **Velocity** `v = p / m + g h (rho / rho_s)` (g with the body acceleration at the node and `t` of a manufactured solution) of folded sums, times `exp(-damping h)`. (Gravity folded too, as the image of falling clay
//!       has it, was measured worse under self weight: displacement 6.0e-4 against 5.2e-4 at 32 cells.)
//!    4. **Between sides.** Blades in the plan's order: in a blade's band each field, on one side of it or the other, is bounded by it where it reaches beyond it: one in
//!       front at nodes with distance <= [`CONTACT_OFFSET`](tool::CONTACT_OFFSET), normal +n; one behind at distance >= -[`CONTACT_OFFSET`](tool::CONTACT_OFFSET), normal -n
//!       (the contact of the tool). A blade that sticks holds these nodes across its plane; along it, it takes each field of
//!       every node of the band along, by at most [`traction_share`](tool::traction_share) of `k h / (rho_s dx)`, k the fresh clay's shear strength: a
//!       traction of k, shared out as the stress of clay at yield is. (Nodes that stick up to the offset alone bear 1.0 to 1.75 k on two flanks, by where the
//!       plane lies between them.) Then each two fields a, b of a node, in the order of the divisions they are beyond (bit i for the i-th sheet), exchange momentum while they
//!       approach along n, unless a blade stands between them: n the normal from a to b of the sheet between them, or the mean of the normals of two,
//!       each the slope of the front's share of the tagged mass, fitted to the 27 nodes about the node ([`cut`]; no exchange where one vanishes): with
//!       `u = (v_b - v_a) . n < 0` and reduced mass `m = m_a m_b / (m_a + m_b)`, impulse `-m u` on field b along n
//!       and, against sliding, at most [`CUT_FRICTION`](tool::CUT_FRICTION) times that (never more than stops the sliding).
//!    5. **Solid tools** in the plan's order: nodes closer to the shape than [`CONTACT_OFFSET`](tool::CONTACT_OFFSET), of a separating tool
//!       [`TOUCH_OFFSET`](tool::TOUCH_OFFSET), get, in each field, the tool's contact with its velocity at the node
//!       ([`Motion::velocity_at`](tool::Motion::velocity_at)) and the shape's outward normal. Contact: stick `v = v_t`; slip removes the relative
//!       normal velocity; separate removes it only if negative and reduces the relative tangential speed by at most friction times the
//!       normal change. Of that change a separating tool makes the share that the gap is closed, [`closed_share`](tool::closed_share) of the clay that
//!       touches at the node, `sum w m_p touch_p` over a full cell's mass and of all classes, unfolded: [`particle_touch`](tool::particle_touch) of the particle's
//!       distance, with its place of `t`, from the nearest separating solid tool at its pose of `t + h`. Impulses `m (v_before - v_after)` sum up on
//!       the tool. Ghost nodes of folded columns take no part in 4 and 5.
//!    6. **Walls.** At wall nodes the normal (stick: every) component is 0; each ghost of a folded column takes its mirror's velocity, field by field,
//!       with the folded components reversed (last fold first). The wall's impulse is what the unfolded masses of wall nodes and folded
//!       columns gained beyond gravity, damping, tools and the other side; all other nodes give it nothing.
//!    7. **[Validation](validation) cases.** With clamped walls nothing is folded; instead nodes at and behind a wall lose their normal component (stick:
//!       every; separate: one into the wall). A growing ball has its radius of `t + h` throughout the substep, and its surface the growth along the
//!       normal. Last, every field of an affine drive's nodes takes the drive's velocity. What clamped and driven nodes gain is a wall's impulse.
//! 4. `g2p`, from the particle's own class's field: `v = sum w v_i`, `C = 4 / dx^2 sum w v_i (x_i - x_p)^T dx`; `x += h v / dx`; the room's walls stop `x`;
//!    `b = (I + h C)(I + E)(I + h C)^T`; Hencky strain `H = ln b / 2`, deviator `d`; if `|d| > y = sqrt(2/3) sY / (2 mu)` it is shortened to `d (1 - g / |d|)` where
//!    `2 mu (|d| - y - g) = sqrt(2/3) (H_mod a + eta (a / h)^n)`, `a = sqrt(2/3) g` (Herschel-Bulkley, hardening modulus H_mod; without both `d *= y / |d|`), hardening
//!    `+= a`, `E = exp(2 H) - I`. `sY = sY0 (1 - s zeta) (1 - loss D) + H_mod hardening` with the distance of zeta from the new `x` to the nearest tool at `t + h` and the working
//!    `D` before; then `1 - D *= exp(-rate a)`, `D *= exp(-h / rest_time)`. Eigenvalues of `b` are clamped to
//!    `[0.05^2, 20^2]` and counted.
//! 5. `weld`, after the frame's last substep, unless [`weld`](material::ClayMaterial::weld) is off: for each tag of a particle at its new `x` whose sheet is that of no blade of the plan, with the unfolded node masses
//!    of 2. of the last substep: `M = sum w m`, `G = sum w m (x_i - x)` of the classes with either side of the sheet. Both sides meet if each has more than
//!    [`MEETING_SHARE`](cut) `= 1e-3` of `M_F + M_B`; else, and where `n = (M_B G_F - M_F G_B) / |..|` vanishes, the tag is left alone. The sides are pressed if `n . sigma n < -c k` with the particle's
//!    Cauchy stress `sigma = tau / J` and k the fresh clay's shear strength. A tag counts, in the magnitude of its side from 1 on: pressed,
//!    `floor(100 (t0 + T) / t_w) - floor(100 t0 / t_w)`, 100 at most, is added (t0 the clay's time when the frame starts, T its length), and above 100 the tag is gone and counted;
//!    not pressed, it is 1 again. c and t_w are 0.5 and 0.3 s, sticky 0.05 and 0.05 s.
//!
//! # The methods of others
//!
//! For comparison, [`cutting`](frame::FramePlan::cutting) replaces parts of the above, on the native engine and the oracle. None keeps a cut without its blade and none knows wires;
//! sides of a blade stand in the tags while they last. What is not named here stays: walls, gravity, law and, but for the last method, solid tools.
//!
//! - **As published and by rigid particles** ([`CuttingMethod::Published`](cutting::CuttingMethod), `RigidParticles`).
//!   1. Sides of nodes: as published, as in 3.2 within the band of a blade. By rigid particles: the blade at its pose of `t + h` is a layer of points at most half a cell apart, its rim among
//!      them; a node that is among the 3^3 about a point has the distance of the nearest, and its sign along that point's normal.
//!   2. Sides of particles, in place of 1.: as published, the sign of `Blade::within_band` of `x` at `t + h`, none outside. By rigid particles: `sign(sum w T |d|)` over the nodes of `x` that
//!      have a side, kept from then on as long as any of them has one.
//!   3. A class that a blade divides from a node (side against side, Eq. 1) is *incompatible* with it: of its mass and momentum the node gets nothing (Eq. 2-3). The other classes are one field; blades
//!      do not act on it, nor does 3.4.
//!   4. In 4. a particle gathers at an incompatible node its ghost velocity, the contact of 3.5 of `v + g h (rho / rho_s)` with the blade: its velocity at the node, its normal there towards the
//!      particle. Of several blades between them, the first of the plan.
//!   5. The blade feels `w m_p (v + A (x_i - x_p) dx) + w m_p g h (rho / rho_s) - w m_p v_ghost` at each of them. At folded columns a ghost node's blade is its mirror's.
//! - **Interactive particles** (`InteractiveParticles`). Every tool is points, a blade one layer of them and a solid a lattice with half a cell between them, of `rho_s dx^3 / 8` each, where it
//!   is at `t`, moving to where it is at `t + h`. In place of 3.4 and 3.5, all tools at once: `v = (p + P_tool) / (m + M_tool)` at nodes that are no folded ghosts, p and m the clay's of folded
//!   sums after 3.3. A tool gives `P_tool - M_tool v`. Its points are not folded at walls.
//!
//! Files in data-flow order: [`params`] and [`material`] say what the clay is, [`tool`] what touches it, [`snapshot`] holds its
//! state, [`plan`] chooses steps, [`cut`] the sides of cuts, [`cutting`] the method, [`engine`] is the seam, [`native`] the CPU engine, [`gpu`] the one of compute passes, [`oracle`] the readable f64 judge of both.

#![deny(
    clippy::wildcard_enum_match_arm,
    reason = "a new law, shape, contact or method must not fall to what was meant for another"
)]

mod admit;
mod coefficients;
pub mod cut;
pub mod cutting;
pub mod engine;
pub mod frame;
pub mod gpu;
pub mod health;
pub mod limits;
pub mod material;
pub mod native;
#[cfg(feature = "reference")]
pub mod oracle;
pub mod params;
pub mod plan;
pub mod sheets;
pub mod snapshot;
mod sums;
pub mod tool;
#[cfg(feature = "reference")]
pub mod trace;
#[cfg(feature = "reference")]
pub mod validation;
#[cfg(not(feature = "reference"))]
#[expect(unreachable_pub, reason = "public with the feature `reference`")]
mod validation;
mod variants;

/// What most programs need.
pub mod prelude {
    pub use super::cutting::CuttingMethod;
    pub use super::engine::{Engine, EngineError};
    pub use super::frame::{FrameOutputs, FramePlan, FrameReport, Integrator, SurfaceParticle, SurfaceSource, ToolReport};
    pub use super::gpu::{GpuDevice, GpuEngine, GpuError, GpuLink, GpuMode};
    pub use super::health::Health;
    pub use super::material::{ClayLaw, ClayMaterial, Preset, Weld};
    pub use super::native::NativeEngine;
    pub use super::params::{Domain, ParamsError, Wall, Walls};
    pub use super::plan::{InertiaScaling, StepLimits};
    pub use super::sheets::Sheets;
    pub use super::snapshot::{Particle, Snapshot, SnapshotError, Tag};
    pub use super::tool::{Contact, Pose, PoseSample, Profile, Tool, ToolPath, ToolShape};
}
