//! The quadratic B-spline: which nodes a particle touches, and how much.

use glam::{DVec3, IVec3};

/// One node of a particle's stencil.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// The node.
    pub(super) node: IVec3,
    /// Weight w [-].
    pub(super) weight: f64,
    /// From the particle to the node \[cells\].
    pub(super) arm: DVec3,
}

/// Lowest node of the stencil of a particle at `position` \[cells\].
pub(super) fn base(position: DVec3) -> IVec3 {
    (position - 0.5).floor().as_ivec3()
}

/// The 27 nodes `b .. b + 2` about `position` [cells]: `sum w = 1`, `sum w arm = 0`,
/// `sum w arm arm^T = I / 4`.
pub(super) fn stencil(position: DVec3) -> [Touch; 27] {
    let base = base(position);
    let f = position - base.as_dvec3();
    let weights = [0.5 * (1.5 - f) * (1.5 - f), 0.75 - (f - 1.0) * (f - 1.0), 0.5 * (f - 0.5) * (f - 0.5)];
    let offsets = [IVec3::ZERO, IVec3::ONE, IVec3::ONE * 2];
    std::array::from_fn(|i| {
        let (x, y, z) = (i / 9, i / 3 % 3, i % 3);
        let offset = IVec3::new(offsets[x].x, offsets[y].y, offsets[z].z);
        let weight = weights[x].x * weights[y].y * weights[z].z;
        Touch { node: base + offset, weight, arm: offset.as_dvec3() - f }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    /// The moments that make APIC exact: 1, 0 and I / 4, wherever the particle stands in its cell.
    #[test]
    fn moments_of_the_quadratic_spline_are_one_zero_and_a_quarter() {
        for i in 0..200 {
            let position = DVec3::new(7.0, 8.0, 9.0) + f64::from(i) * DVec3::new(0.0137, 0.0071, 0.0191);
            let (mut sum, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
            for Touch { weight, arm, .. } in stencil(position) {
                sum += weight;
                first += weight * arm;
                second += DMat3::from_cols(arm * arm.x, arm * arm.y, arm * arm.z) * weight;
            }
            assert!((sum - 1.0).abs() < 1e-14 && first.length() < 1e-14, "{position}: {sum} {first}");
            assert!(second.abs_diff_eq(DMat3::from_diagonal(DVec3::splat(0.25)), 1e-14), "{position}: {second}");
        }
    }
}
