//! Where a tool that may not enter the clay is: the place nearest to a target, outside all spheres of clay.
//!
//! Yu et al. Eq. 6-7: `min (x - x_t)' K (x - x_t) / 2` subject to `C(x) = |x + o_i - x_q| - (r_q + r_x) >= 0`
//! for each pair of a sphere i of the tool and a sphere q of clay. C is convex, so that a place outside all
//! of its tangent planes is outside the spheres: a whole step of Gauss-Newton never enters the clay.

mod active_set;
mod pairs;
mod projected;
mod solution;
mod step;

pub use active_set::{ActiveSet, PIVOT_MAX};
pub use pairs::{Constraint, PAIR_MAX, Pairs, SPHERE_MAX, Sphere, ToolSpheres};
pub use projected::{Multipliers, SWEEP_MAX};
pub use solution::{FEASIBLE, Solution};
pub use step::{CAUGHT, Proxy, ProxyStep, Solver, Surroundings};

#[cfg(test)]
mod tests;
