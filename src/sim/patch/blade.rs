//! What clay bears of a flat blade at a frame's end; in cells, by the blade's frame.
//!
//! A particle of rest volume V, by z in front of the blade's plane and outside edge e by `s_e`, counts by the
//! part `c = prod_e clamp(1/2 - 2 s_e, 0, 1)` of its width that is within the outline: layers of particles half
//! a cell apart come in evenly. On either side
//!
//! | number | what |
//! |---|---|
//! | area A | `sum V c` over `0 < abs z <= 1`: a layer of one cell |
//! | its growth | `sum_e m_e L_e`, `L_e = sum 2 V c_e` over `abs s_e < 1/4`, c_e that of the other edges |
//! | strength k | mean of the particles', by V c |
//! | edge's length at whole clay | `L_e(a) = sum V c_e w(s_e - a, z)`, w the edge's the share that an edge gives clay |
//!
//! A growth is the derivative of its area by the blade's place, by the divergence theorem: where clay's face
//! crosses the blade, its normal's integral is less that over the edges within clay. Whole clay is what has no
//! side of the blade's cut; the gap of an edge is the least a of which `L_e` is half its greatest, its length
//! the mean over the cell beyond. A blade that touches nothing has the areas that it comes to, less the way.

use super::super::touch::{BladeTouch, EdgeTouch};
use super::super::tool::{EDGE_REACH, edge_share};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// How far from the plane clay is looked at \[cells\].
const LAYER: f64 = 1.0;

/// How far ahead of an edge whole clay is looked for, and in what steps \[cells\].
const AHEAD: f64 = 2.5;
const STEP: f64 = 0.125;

/// Steps of them in a cell.
const CELL_STEPS: usize = (1.0 / STEP) as usize;

/// A particle near a blade.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beside {
    /// In the blade's frame \[cells\].
    pub(super) at: DVec3,
    /// Rest volume [cells^3].
    pub(super) volume: f64,
    /// Whether it has no side of the blade's cut.
    pub(super) is_whole: bool,
    /// What it bears of a flank that slides along it, and of one that presses: shear strengths \[Pa\].
    pub(super) strengths: [f64; 2],
}

/// What is found on one side of the plane, in cells.
#[derive(Clone, Copy, Debug, Default)]
struct Flank {
    area: f64,
    growth: DVec3,
}

/// Sum of weights, and of the strengths by them \[Pa\].
type Strengths = (f64, [f64; 2]);

/// The clay about a blade, in cells.
#[derive(Clone, Debug)]
pub(super) struct About {
    flanks: [Flank; 2],
    /// Outward normal, gap and length at whole clay of each edge.
    edges: Vec<(DVec3, f64, f64)>,
    /// Of what is on the flanks, and of all that is beside the blade's plane.
    strengths: [Strengths; 2],
}

/// The edges of a polygon in the XY plane, anticlockwise: a point of each, and its outward normal.
fn edges(corners: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
    pairs.map(|(a, b)| (*a, -(*b - *a).perp().normalize()))
}

/// The part of a particle's width within an edge that it is outside by `s` \[cells\].
fn within(s: f64) -> f64 {
    (0.5 - 2.0 * s).clamp(0.0, 1.0)
}

impl About {
    /// The clay about a blade of these corners \[cells\].
    pub(super) fn new(corners: &[DVec2], particles: &[Beside]) -> Self {
        let edges: Vec<(DVec2, DVec2)> = edges(corners).collect();
        let mut found = Self { flanks: [Flank::default(); 2], edges: vec![], strengths: Default::default() };
        let steps = ((AHEAD + 1.0) / STEP) as usize + 1;
        let mut whole = vec![vec![0.0; steps]; edges.len()];
        for particle in particles.iter().filter(|p| p.at.z.abs() <= LAYER) {
            let outside = |edge: &(DVec2, DVec2)| edge.1.dot(particle.at.truncate() - edge.0);
            let outside: Vec<f64> = edges.iter().map(outside).collect();
            let flank = &mut found.flanks[usize::from(particle.at.z <= 0.0)];
            for (index, (edge, s)) in edges.iter().zip(&outside).enumerate() {
                let others = outside.iter().enumerate().filter(|other| other.0 != index);
                let beside: f64 = particle.volume * others.map(|(_, s)| within(*s)).product::<f64>();
                if s.abs() < 0.25 {
                    flank.growth += 2.0 * beside * edge.1.extend(0.0);
                }
                if particle.is_whole && beside > 0.0 {
                    let shares = whole[index].iter_mut().enumerate();
                    shares.for_each(|(i, sum)| *sum += beside * edge_share(s - STEP * i as f64, particle.at.z));
                }
            }
            let part = particle.volume * outside.iter().map(|s| within(*s)).product::<f64>();
            flank.area += part;
            for (sum, weight) in found.strengths.iter_mut().zip([part, particle.volume]) {
                *sum = (sum.0 + weight, std::array::from_fn(|i| sum.1[i] + weight * particle.strengths[i]));
            }
        }
        found.edges = edges.iter().zip(&whole).map(|(edge, lengths)| met(edge.1.extend(0.0), lengths)).collect();
        found.come_to();
        found
    }

    /// What does not touch has the areas that its edges come to, less the way.
    fn come_to(&mut self) {
        if self.area() > 0.0 {
            return;
        }
        for (outward, gap, length) in &self.edges {
            for flank in &mut self.flanks {
                *flank = Flank { area: flank.area - gap * length, growth: flank.growth + *outward * *length };
            }
        }
    }

    /// Area of both flanks in clay [cells^2]; not above 0 where the blade does not touch.
    pub(super) fn area(&self) -> f64 {
        self.flanks.iter().map(|flank| flank.area).sum()
    }

    /// Areas for the blade's stiffness [cells^2]: of each flank, with half of what bears its edges.
    pub(super) fn bearing_areas(&self) -> [f64; 2] {
        let edges: f64 = self.edges.iter().map(|edge| edge.2 * EDGE_REACH).sum();
        self.flanks.map(|flank| flank.area.max(0.0) + 0.5 * edges)
    }

    /// What clay of this toughness [J/m^2] bears in cells of this width \[m\]; none where no clay is near. What
    /// does not `cling` slides along the flanks.
    pub(super) fn touch(&self, toughness: f64, cling: bool, cell: f64) -> Option<BladeTouch> {
        let mean = |of: &Strengths| (of.0 > 0.0).then(|| of.1.map(|sum| sum / of.0));
        let [strength, bearing] = self.strengths.iter().find_map(mean)?;
        let strength = if cling { strength } else { 0.0 };
        let pressure = (2.0 + PI) * bearing;
        let edge = |(outward, gap, length): &(DVec3, f64, f64)| EdgeTouch {
            outward: *outward,
            gap: gap * cell,
            force: toughness * length * cell,
        };
        Some(BladeTouch {
            flank: strength * self.area() * cell * cell,
            flank_growth: strength * cell * self.flanks.iter().map(|flank| flank.growth).sum::<DVec3>(),
            bearing: self.flanks.map(|flank| pressure * flank.area * cell * cell),
            bearing_growth: self.flanks.map(|flank| pressure * flank.growth * cell),
            edges: self.edges.iter().map(edge).collect(),
        })
    }
}

/// An edge of this outward normal, by the lengths of whole clay from [`STEP`] to step ahead: its gap, and the
/// length that it meets.
fn met(outward: DVec3, lengths: &[f64]) -> (DVec3, f64, f64) {
    let half = 0.5 * lengths.iter().copied().fold(0.0, f64::max);
    let first = lengths.iter().position(|length| *length >= half).filter(|_| half > 0.0);
    let Some(first) = first.filter(|first| *first as f64 * STEP <= AHEAD) else { return (outward, 0.0, 0.0) };
    let gap = match first.checked_sub(1) {
        Some(before) => {
            let [a, b] = [lengths[before], lengths[first]];
            STEP * (before as f64 + (half - a) / (b - a))
        }
        None => 0.0,
    };
    let from = if first > 0 { first + 1 } else { 0 };
    let beyond = &lengths[from..(from + CELL_STEPS).min(lengths.len())];
    (outward, gap, beyond.iter().sum::<f64>() / beyond.len().max(1) as f64)
}

#[cfg(test)]
mod tests;
