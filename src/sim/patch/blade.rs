//! What clay bears of a flat blade at a frame's end; in cells, by the blade's frame.
//!
//! A particle of rest volume V, by z in front of the blade's plane and outside edge e by `s_e`, counts by the
//! part `c = prod_e clamp(1/2 - 2 s_e, 0, 1)` of its width that is within the outline: layers of particles
//! half a cell apart come in evenly. On either side
//!
//! | number | what |
//! |---|---|
//! | area A | `sum V c` over `0 < abs z <= 1`: a layer of one cell |
//! | its growth | `sum_e m_e L_e`, `L_e = sum V c_e` over `abs s_e < 1/2`, c_e of the other edges |
//! | strength k | mean of the particles', by V c |
//! | edge's length ahead | `L_e(a) = sum V c_e w(s_e - a, z)` of whole clay, w the edge's share |
//!
//! A growth is the derivative of its area by the blade's place, over a cell: each edge brings in the clay
//! that it comes to. Whole clay is what has no side of the blade's cut, by how much of its class there is [to
//! part](super::super::ahead) as far as is looked; the gap of an edge is the least a of which `L_e` is half
//! its greatest, its length the mean over the cell beyond. Where that is none, it is how far the edge is
//! drawn back from what clings to it, by the mean of their anchors. A blade that touches nothing has the
//! areas that it comes to, less the way.

use super::super::ahead::ClayAhead;
use super::super::cut::ClassKey;
use super::super::tool::{EDGE_REACH, edge_share};
use super::super::touch::{BladeTouch, EdgeTouch};
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
    /// Its class, if it has no side of the blade's cut.
    pub(super) whole: Option<ClassKey>,
    /// Where it clings to the blade, in the blade's frame \[cells\].
    pub(super) anchor: Option<DVec3>,
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

/// How far a particle is outside each edge \[cells\], and its part beside that edge's ends [cells^3].
fn parts(edges: &[(DVec2, DVec2)], particle: &Beside) -> Vec<(f64, f64)> {
    let outside: Vec<f64> = edges.iter().map(|edge| edge.1.dot(particle.at.truncate() - edge.0)).collect();
    let others = |index: usize| outside.iter().enumerate().filter(move |other| other.0 != index);
    let beside = |index: usize| particle.volume * others(index).map(|(_, s)| within(*s)).product::<f64>();
    outside.iter().enumerate().map(|(index, s)| (*s, beside(index))).collect()
}

/// What the edges have ahead, as far as is looked.
fn look_ahead(edges: &[(DVec2, DVec2)], particles: &[Beside]) -> ClayAhead {
    let mut ahead = ClayAhead::default();
    for (particle, key) in particles.iter().filter_map(|p| Some((p, p.whole?))).filter(|(p, _)| p.at.z.abs() <= LAYER) {
        for (index, (s, beside)) in parts(edges, particle).into_iter().enumerate() {
            if (0.0..AHEAD + 1.0).contains(&s) {
                ahead.see((index, key), beside, 1.0 - particle.at.z.abs(), particle.at.z);
            }
        }
    }
    ahead
}

impl About {
    /// The clay about a blade of these corners \[cells\].
    pub(super) fn new(corners: &[DVec2], particles: &[Beside]) -> Self {
        let edges: Vec<(DVec2, DVec2)> = edges(corners).collect();
        let mut found = Self { flanks: [Flank::default(); 2], edges: vec![], strengths: Default::default() };
        let steps = ((AHEAD + 1.0) / STEP) as usize + 1;
        let unparted = look_ahead(&edges, particles);
        let mut whole = vec![Ahead { lengths: vec![0.0; steps], ..Ahead::default() }; edges.len()];
        for particle in particles.iter().filter(|p| p.at.z.abs() <= LAYER) {
            let parts = parts(&edges, particle);
            let flank = &mut found.flanks[usize::from(particle.at.z <= 0.0)];
            for (index, (edge, (s, beside))) in edges.iter().zip(&parts).enumerate() {
                if s.abs() < 0.5 {
                    flank.growth += *beside * edge.1.extend(0.0);
                }
                let wholeness = particle.whole.map_or(0.0, |key| unparted.wholeness(index, key));
                if beside * wholeness > 0.0 {
                    whole[index].see(particle, *s, beside * wholeness, edge.1.extend(0.0));
                }
            }
            let part = particle.volume * parts.iter().map(|(s, _)| within(*s)).product::<f64>();
            flank.area += part;
            for (sum, weight) in found.strengths.iter_mut().zip([part, particle.volume]) {
                *sum = (sum.0 + weight, std::array::from_fn(|i| sum.1[i] + weight * particle.strengths[i]));
            }
        }
        found.edges = edges.iter().zip(&whole).map(|(edge, ahead)| ahead.met(edge.1.extend(0.0))).collect();
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

    /// What clay of this toughness [J/m^2] bears in cells of this width \[m\]; none where no clay is near.
    /// What does not `cling` slides along the flanks.
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

/// The whole clay ahead of an edge.
#[derive(Clone, Debug, Default)]
struct Ahead {
    /// The length that meets it from [`STEP`] to step ahead \[cells\].
    lengths: Vec<f64>,
    /// Of what is anchored to it, by share: sum of shares, and of the ways that the edge has come on since.
    advance: [f64; 2],
}

impl Ahead {
    /// Takes in a particle `s` outside of the edge that counts by `part` \[cells^3\].
    fn see(&mut self, particle: &Beside, s: f64, part: f64, outward: DVec3) {
        let shares = self.lengths.iter_mut().enumerate();
        shares.for_each(|(i, sum)| *sum += part * edge_share(s - STEP * i as f64, particle.at.z));
        if let Some(anchor) = particle.anchor {
            let share = part * edge_share(s, particle.at.z);
            let come = outward.dot(anchor - particle.at);
            self.advance = [self.advance[0] + share, self.advance[1] + share * come];
        }
    }

    /// The edge's outward normal, its gap, and the length that it meets.
    fn met(&self, outward: DVec3) -> (DVec3, f64, f64) {
        let lengths = &self.lengths;
        let half = 0.5 * lengths.iter().copied().fold(0.0, f64::max);
        let first = lengths.iter().position(|length| *length >= half).filter(|_| half > 0.0);
        let Some(first) = first.filter(|first| *first as f64 * STEP <= AHEAD) else { return (outward, 0.0, 0.0) };
        let gap = match first.checked_sub(1) {
            Some(before) => {
                let [a, b] = [lengths[before], lengths[first]];
                STEP * (before as f64 + (half - a) / (b - a))
            }
            // Drawn back from what clings to it by less than a layer of particles.
            None if self.advance[0] > 0.0 => (-self.advance[1] / self.advance[0]).max(0.0),
            None => 0.0,
        };
        let from = if first > 0 { first + 1 } else { 0 };
        let beyond = &lengths[from..(from + CELL_STEPS).min(lengths.len())];
        (outward, gap, beyond.iter().sum::<f64>() / beyond.len().max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Full particles half a cell apart at and below y = 0, about the blade's plane at z = `beside`, whole
    /// below y = -`cut`.
    fn lattice(beside: f64, cut: f64) -> Vec<Beside> {
        let at = |i: i32| DVec3::new(f64::from(i % 24) - 11.5, -f64::from(i / 24 % 24) - 0.5, f64::from(i / 576) - 7.5) / 2.0;
        let particle = |at: DVec3| Beside {
            at: at + DVec3::Z * beside,
            volume: 0.125,
            whole: (at.y < -cut).then_some(ClassKey::FIRST),
            anchor: None,
            strengths: [3e3, 4e3],
        };
        (0..24 * 24 * 16).map(at).map(particle).collect()
    }

    /// A rectangle of 6 by 8 cells whose lower edge is `deep` below the clay's face, in a cut of depth `cut`.
    fn about(deep: f64, cut: f64, beside: f64) -> About {
        let low = -deep;
        let corners = [DVec2::new(-3.0, low), DVec2::new(3.0, low), DVec2::new(3.0, low + 8.0), DVec2::new(-3.0, low + 8.0)];
        About::new(&corners, &lattice(beside, cut))
    }

    fn close(found: f64, wanted: f64, within: f64) {
        assert!((found - wanted).abs() <= within, "{found} is not {wanted}");
    }

    /// In its cut a knife has clay on both flanks by its depth, wherever layers of particles are, which grows
    /// by its edge's length alone; edge and sides meet whole clay by their lengths in it.
    #[test]
    fn flanks_and_edges_are_those_in_clay() {
        for beside in [0.0, 0.1, 0.26, 0.4] {
            for deep in [2.0, 3.1, 4.3] {
                let found = about(deep, deep, beside);
                close(found.area(), 2.0 * 6.0 * deep, 1e-9);
                for flank in &found.flanks {
                    close(flank.area, 6.0 * deep, 1e-9);
                    assert!((flank.growth - DVec3::NEG_Y * 6.0).length() < 1e-9, "{}", flank.growth);
                }
                let lengths: Vec<[f64; 2]> = found.edges.iter().map(|edge| [edge.1, edge.2]).collect();
                let touch = found.touch(15.0, true, 1e-3).expect("clay");
                close(lengths[0][0], 0.0, 1e-12);
                close(touch.edges[0].force, 15.0 * 6e-3, 1e-9);
                close(touch.flank, 3e3 * 2.0 * 6.0 * deep * 1e-6, 1e-9);
                close(touch.bearing[1], (2.0 + PI) * 4e3 * 6.0 * deep * 1e-6, 1e-9);
                assert_eq!((lengths[2], touch.edges[2].outward), ([0.0; 2], DVec3::Y));
            }
        }
    }

    /// Before touch areas are less than none by the way that is left, and in its own cut an edge has the way
    /// to where that ends; without an edge's force and clinging there is the bearing alone.
    #[test]
    fn edges_have_the_way_to_whole_clay() {
        // Clay bears 0.35 cells before the middle of its first layer: 0.1 before its face.
        let above = about(-1.5, 0.0, 0.1);
        let gap = above.edges[0].1;
        close(gap, 1.5 - 0.3, STEP);
        let touch = above.touch(15.0, true, 1e-3).expect("clay");
        close(touch.flank, -gap * 1e-3 * 2.0 * 3e3 * 6e-3, 1e-9);
        assert!((touch.flank_growth - DVec3::NEG_Y * 36.0).length() < 1e-9, "{}", touch.flank_growth);
        let back = about(2.0, 4.0, 0.1);
        close(back.edges[0].1, 2.0, 0.35);
        close(back.edges[0].2, 6.0, 1e-9);
        let anchored = |p: Beside| Beside { anchor: Some(p.at + DVec3::Y * 0.15), ..p };
        let drawn: Vec<Beside> = lattice(0.1, 3.0).into_iter().map(anchored).collect();
        let corners = [DVec2::new(-3.0, -2.9), DVec2::new(3.0, -2.9), DVec2::new(3.0, 5.0), DVec2::new(-3.0, 5.0)];
        close(About::new(&corners, &drawn).edges[0].1, 0.15, 1e-9);
        let slips = back.touch(0.0, false, 1e-3).expect("clay");
        assert!(slips.flank == 0.0 && slips.flank_growth == DVec3::ZERO && slips.bearing[0] > 0.0);
        assert!(slips.edges.iter().all(|edge| edge.force == 0.0));
        assert!(About::new(&[DVec2::ZERO, DVec2::X, DVec2::Y], &[]).touch(15.0, true, 1e-3).is_none());
    }

    /// Between two bodies a knife's edge meets nothing, and its flanks both of them.
    #[test]
    fn edges_meet_nothing_between_bodies() {
        let of_two = |p: Beside| Beside { whole: Some(ClassKey::new(u32::from(p.at.z < 0.0), Default::default())), ..p };
        let clay: Vec<Beside> = lattice(0.1, 0.0).into_iter().map(of_two).collect();
        let corners = [DVec2::new(-3.0, -3.0), DVec2::new(3.0, -3.0), DVec2::new(3.0, 5.0), DVec2::new(-3.0, 5.0)];
        let found = About::new(&corners, &clay);
        assert!(found.edges.iter().all(|edge| edge.2 == 0.0), "{:?}", found.edges);
        close(found.area(), 2.0 * 6.0 * 3.0, 1e-9);
    }
}
