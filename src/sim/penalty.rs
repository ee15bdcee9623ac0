//! The law of contact: clay against what is solid, particle by particle.
//!
//! A particle of rest volume `V_p` reaches [`reach`] about its centre, so that its gap to a surface of signed
//! distance `s` is `g = s(x_p) - r_p`. Contact is the potential `A_p (kappa / dx) max(0, -g_p)^2 / 2` with
//! `A_p` = [`area`]: its force goes to the nodes with the particle's own weights, and the surface feels the
//! exact opposite at the particle. Where the other side moves too, or within an implicit step, the same term
//! takes `g_p + n . (u_own - u_other)` as its gap, normal and gap frozen for one evaluation.
//!
//! What can not part from the clay ([`Contact::Stick`], [`Contact::Slip`]) also pulls, once it has touched:
//! by the same stiffness, at most by the clay's shear strength k on `A_p`, until the gap is [`BOND_REACH`].
//!
//! Friction is a spring of `A_p k_t / dx` to an anchor on the surface, which slides where the spring would
//! bear more than `mu N` ([`Contact::Separate`]), or k on `A_p` and [`STICK_FRICTION`] N, the push alone,
//! beside it ([`Contact::Stick`]; a blade holds clay by k alone, however it is pressed). No velocity enters:
//! a bound on the particle's velocity slips by about `2 k h / (rho dx)`, as fast as tools move.
//!
//! The edge of a blade, or a wire, presses on clay that has no side of its cut yet, along its outward normal
//! m alone, by a spring of `A_p k_t / dx` to an anchor as friction has it. It slides where the spring would
//! bear more than the particle's part of the toughness R, `R V_p K / dx^2` with K its
//! [`share`](super::tool::edge_share) as the step begins: over whole clay they sum to R per length of edge,
//! so that the work is R times the area cut. The anchor stays where the edge draws back: what has been borne
//! is not borne again.
//!
//! Clay that a surface is found to stand in, by [`FOUND_DEPTH`] deeper than either can have come in a
//! substep and untouched before, was not pressed: a tool has been put there. It comes out at
//! [`EJECTION_SPEED`] at most, where the springs would fling it off, and clings to nothing until then. In
//! implicit steps that is as stiff as contact is: against the particle's inertia alone, which is nothing
//! beside what clay bears in such a step, clay that a moving tool was found in stood ever deeper in it, by up
//! to .37 cells beneath a plate, and a plate that it should have stuck to had a third of its bonds.
//!
//! Separating walls are such a surface, without friction. Walls that hold clay do so at nodes; they do from
//! when it has come as near as [`arrival`] says.
//!
//! Why not at nodes: which nodes are inside a shape changes as its face passes planes of nodes, and the force
//! with it, by a third within a tenth of a cell. Penalty at the particles of
//! GIMP: Bird et al. 2024; contact at particles as one variational term: Li et al. 2021, BFEMP (arXiv
//! 2108.03349).

use super::tool::Contact;
use glam::{DMat3, DVec3};

/// Normal stiffness kappa over the clay's P-wave modulus `M = lambda + 2 mu` [-]: under three times the yield
/// stress, a bearing tool's, clay with E = 55 sY stands in the tool by less than a hundredth of a cell.
pub const NORMAL_STIFFNESS: f64 = 4.0;

/// Tangential stiffness k_t over M [-].
pub const TANGENTIAL_STIFFNESS: f64 = 2.0;

/// Friction of a sticking surface [-], beside its adhesion: clay under pressure yields before it slides. With
/// adhesion alone it slid off the edge of a sticking punch that friction of 0.3 kept it on.
pub const STICK_FRICTION: f64 = 2.0;

/// Gap \[cells\] at which clay lets go of a surface that it can not part from: half a full particle's edge.
pub const BOND_REACH: f64 = 0.25;

/// How much deeper \[cells\] in a surface that it has not touched before clay stands than it can have come in
/// the substep, if it is found there.
pub const FOUND_DEPTH: f64 = 0.02;

/// Speed [cells/substep] at which clay found in a surface comes out.
pub const EJECTION_SPEED: f64 = 0.02;

/// Gap \[cells\] at which clay has arrived at a wall that holds it: what fills and cells leave between a face
/// and its particles, with room.
pub const ARRIVAL_GAP: f64 = 0.05;

/// Distance \[cells\] from a wall that holds clay at which a particle of rest volume `volume` [cells^3] has
/// arrived: where it touches, or a full one would, within [`ARRIVAL_GAP`]. What is carved moves with the clay
/// about it.
pub fn arrival(volume: f64) -> f64 {
    reach(volume.max(0.125)) + ARRIVAL_GAP
}

/// How far the clay of a particle of rest volume `volume` [cells^3] reaches about its centre \[cells\]:
/// what was carved from a full particle, an eighth of a cell, is a thinner slab, what is larger a cube.
pub fn reach(volume: f64) -> f64 {
    // Where the two meet: most particles need no root.
    if volume <= 0.125 { 2.0 * volume } else { 0.5 * volume.cbrt() }
}

/// The area [cells^2] with which a particle of rest volume `volume` [cells^3] bears: a cube's face, of what
/// is less than a full particle in proportion to its mass, so that its spring is as fast as a full one's.
pub fn area(volume: f64) -> f64 {
    if volume <= 0.125 { 2.0 * volume } else { volume.cbrt().powi(2) }
}

/// A particle's contact springs, in the caller's units of force and length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Springs {
    /// Force per gap, `A_p kappa / dx`.
    pub(crate) normal: f64,
    /// Force per slip, `A_p k_t / dx`.
    pub(crate) tangential: f64,
    /// The clay's shear strength on `A_p`, a force.
    pub(crate) strength: f64,
    /// What an edge gives at most per share of it, `R V_p / dx^2`, a force times cells^2.
    pub(crate) toughness: f64,
    /// Friction of a surface that sticks, beside the clay's strength [-]: [`STICK_FRICTION`]; none of blades.
    pub(crate) grip: f64,
    /// What viscosity adds to the strength where a surface that sticks slides at 1, and the power with which
    /// that goes; none but on blades.
    pub(crate) viscous: [f64; 2],
    /// The particle's mass over the substep, force per velocity.
    pub(crate) inertia: f64,
    /// A cell as a length.
    pub(crate) cell: f64,
    /// A cell a substep as a velocity.
    pub(crate) speed: f64,
}

/// A surface before a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Surface {
    /// How it acts.
    pub(crate) contact: Contact,
    /// The particle's gap to it; negative where it stands in it.
    pub(crate) gap: f64,
    /// Unit normal of the surface, towards the particle.
    pub(crate) normal: DVec3,
    /// Velocity of the particle against the surface, along the normal.
    pub(crate) leaving: f64,
}

/// What a surface does to a particle that it touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Touch {
    /// Force on the particle.
    pub(crate) force: DVec3,
    /// Where the anchor now is, in the frame of the particle's place; none of what was found in the surface.
    pub(crate) anchor: Option<DVec3>,
}

impl Springs {
    /// The same of a blade, whose flanks hold clay by its present `strength`, and what viscosity adds, alone,
    /// as at nodes.
    pub(crate) fn of_blade(self, strength: f64, viscous: [f64; 2]) -> Self {
        Self { grip: 0.0, strength, viscous, ..self }
    }

    /// The same in an implicit step, in which other clay presses on what is found in a surface, and its
    /// inertia is the least of what holds it there: it goes with the surface, and out of it, as stiffly as
    /// what touches.
    pub(crate) fn in_implicit_step(self) -> Self {
        Self { inertia: self.inertia.max(self.normal * self.cell / self.speed), ..self }
    }

    /// The force along a surface that has slid beyond what it bears at rest, `most`: the spring's, where what
    /// it leaves of the `slip` is slid in the step.
    fn sliding(&self, contact: Contact, most: f64, slip: f64) -> f64 {
        let [viscous, flow_index] = self.viscous;
        if viscous == 0.0 || contact != Contact::Stick {
            return most;
        }
        let speed = |force: f64| (slip - force / self.tangential).max(0.0) * self.speed / self.cell;
        let (mut low, mut high) = (most, self.tangential * slip);
        for _ in 0..48 {
            let middle = 0.5 * (low + high);
            if middle < most + viscous * speed(middle).powf(flow_index) { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// What a surface does to a particle at `at` that clings to it by `anchor`, if it touched it before.
    /// None where they do not touch: then there is no anchor any more.
    pub(crate) fn touch(&self, surface: &Surface, at: DVec3, anchor: Option<DVec3>) -> Option<Touch> {
        let is_bonded = anchor.is_some() && !surface.contact.can_part();
        if surface.gap >= if is_bonded { BOND_REACH * self.cell } else { 0.0 } {
            return None;
        }
        let push = self.push(surface.gap);
        let gap_before = surface.gap - surface.leaving * self.cell / self.speed;
        if anchor.is_none() && gap_before < -FOUND_DEPTH * self.cell {
            let most = self.inertia * (EJECTION_SPEED * self.speed - surface.leaving).max(0.0);
            return Some(Touch { force: push.min(most) * surface.normal, anchor: None });
        }
        let most = match surface.contact {
            Contact::Stick => self.strength + self.grip * push.max(0.0),
            Contact::Slip => 0.0,
            Contact::Separate { friction } => friction * push,
        };
        let slip = (at - anchor.unwrap_or(at)).reject_from_normalized(surface.normal);
        let wanted = self.tangential * slip.length();
        // The strength of elastic clay is infinite.
        let kept = if wanted > most { slip * (self.sliding(surface.contact, most, slip.length()) / wanted) } else { slip };
        let anchor = if wanted > most { at - kept } else { anchor.unwrap_or(at) };
        Some(Touch { force: push * surface.normal - self.tangential * kept, anchor: Some(anchor) })
    }

    /// The force along its normal with which an edge holds off a particle that bears `share` [1/cell^2] of
    /// it, having come `advance` towards it since that was anchored; and the advance that is left.
    pub(crate) fn cut(&self, share: f64, advance: f64) -> (f64, f64) {
        let (wanted, most) = (self.tangential * advance, self.toughness * share);
        if wanted > most { (most, most / self.tangential) } else { (wanted.max(0.0), advance) }
    }

    /// The stiffness of that, the force over the advance.
    pub(crate) fn cut_stiffness(direction: DVec3, force: f64, advance: f64) -> DMat3 {
        let along = if force > 0.0 { direction * (force / advance) } else { DVec3::ZERO };
        DMat3::from_cols(along * direction.x, along * direction.y, along * direction.z)
    }

    /// The stiffness with which a surface gives `force` to a particle at `at`: the spring across, along it
    /// the force over the slip.
    pub(crate) fn stiffness(&self, surface: &Surface, at: DVec3, anchor: Option<DVec3>, force: DVec3) -> DMat3 {
        let normal = surface.normal;
        let across = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        let slip = (at - anchor.unwrap_or(at)).reject_from_normalized(surface.normal).length();
        let along = force.reject_from_normalized(surface.normal).length();
        let tangential = if slip > 0.0 { along / slip } else { 0.0 };
        across * (self.normal - tangential) + DMat3::from_diagonal(DVec3::splat(tangential))
    }

    /// The force along the normal at a gap: the slope of the potential, downwards.
    fn push(&self, gap: f64) -> f64 {
        (-self.normal * gap).max(-self.strength)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPRINGS: Springs = Springs {
        normal: 40.0,
        tangential: 20.0,
        strength: 1.5,
        toughness: 3.0,
        viscous: [0.0, 1.0],
        grip: STICK_FRICTION,
        inertia: 2.0,
        cell: 1.0,
        speed: 1.0,
    };
    const SEPARATE: Contact = Contact::Separate { friction: 0.3 };

    fn floor(contact: Contact, at: DVec3) -> Surface {
        // It has come in within the substep.
        Surface { contact, gap: at.y, normal: DVec3::Y, leaving: at.y.min(0.0) }
    }

    fn touch(contact: Contact, at: DVec3, anchor: Option<DVec3>) -> Option<Touch> {
        SPRINGS.touch(&floor(contact, at), at, anchor)
    }

    /// The potential of the normal and of an unslipped anchor, by the book.
    fn energy(at: DVec3, anchor: DVec3) -> f64 {
        let (gap, slip) = (at.y, (at - anchor).reject_from_normalized(DVec3::Y));
        let give = SPRINGS.strength / SPRINGS.normal;
        let normal = if gap > give {
            0.5 * SPRINGS.normal * give * give + SPRINGS.strength * (gap - give)
        } else {
            0.5 * SPRINGS.normal * gap * gap
        };
        normal + 0.5 * SPRINGS.tangential * slip.length_squared()
    }

    /// The force is the potential's slope, by central differences: pressed, pulled, pulled beyond the
    /// strength.
    #[test]
    fn force_is_the_slope_of_the_potential() {
        for at in [DVec3::new(0.02, -0.3, 0.01), DVec3::new(0.02, 0.01, 0.01), DVec3::new(-0.03, 0.2, 0.01)] {
            let anchor = DVec3::new(0.01, 0.0, -0.01);
            let found = touch(Contact::Stick, at, Some(anchor)).expect("a touch");
            assert_eq!(found.anchor, Some(anchor), "it holds");
            let slope = |axis: DVec3| (energy(at - 1e-6 * axis, anchor) - energy(at + 1e-6 * axis, anchor)) / 2e-6;
            let by_differences = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
            assert!((found.force - by_differences).length() < 1e-6, "{at}: {} {by_differences}", found.force);
        }
    }

    /// A particle dragged over the surface bears mu N against its way, and its anchor comes along at the
    /// spring's length.
    #[test]
    fn anchor_slides_at_the_friction_of_coulomb() {
        let (mut anchor, mut forces) = (None, vec![]);
        for i in 0..=200 {
            let at = DVec3::new(1e-3 * f64::from(i), -0.05, 0.0);
            let found = touch(SEPARATE, at, anchor).expect("a touch");
            forces.push(found.force);
            anchor = found.anchor;
        }
        let (normal, give) = (2.0, 0.3 * 2.0 / 20.0);
        assert!((forces[20] - DVec3::new(-20.0 * 0.02, normal, 0.0)).length() < 1e-12, "it holds: {}", forces[20]);
        for force in &forces[31..] {
            assert!((force.x / force.y + 0.3).abs() < 1e-12 && (force.y - normal).abs() < 1e-12, "{force}");
        }
        assert!((anchor.expect("an anchor") - DVec3::new(0.2 - give, -0.05, 0.0)).length() < 1e-12);
        // Back by less than twice the give it turns without sliding.
        let back = touch(SEPARATE, DVec3::new(0.2 - 1.5 * give, -0.05, 0.0), anchor).expect("a touch");
        assert!((back.force.x - 0.5 * 0.3 * normal).abs() < 1e-12, "{}", back.force);
    }

    /// What can part lets go at gap 0; what can not pulls by the strength at most, and lets go where its
    /// reach ends; what never touched is not held.
    #[test]
    fn adhesion_is_capped_and_ends() {
        let anchor = Some(DVec3::ZERO);
        let lifted = |contact, gap: f64| touch(contact, DVec3::Y * gap, anchor).map(|t| t.force);
        assert_eq!(lifted(SEPARATE, 1e-9), None);
        for contact in [Contact::Stick, Contact::Slip] {
            assert_eq!(lifted(contact, 0.02), Some(DVec3::NEG_Y * 0.8));
            assert_eq!(lifted(contact, 0.1), Some(DVec3::NEG_Y * 1.5));
            assert_eq!(lifted(contact, 0.25), None);
            assert_eq!(touch(contact, DVec3::Y * 1e-9, None), None, "it never touched");
        }
        let along = |contact| touch(contact, DVec3::new(1.0, -0.1, 0.0), anchor).expect("a touch").force.x;
        assert_eq!([along(Contact::Stick), along(Contact::Slip)], [-1.5 - 2.0 * 4.0, 0.0]);
        let at = DVec3::new(1.0, -0.1, 0.0);
        let on_blade = SPRINGS.of_blade(1.5, [0.0, 1.0]).touch(&floor(Contact::Stick, at), at, anchor).expect("a touch");
        assert_eq!(on_blade.force, DVec3::new(-1.5, 4.0, 0.0));
        // The rest of the way, beyond what the spring gives, is slid.
        let viscous = Springs { tangential: 4.0, ..SPRINGS }.of_blade(1.5, [2.0, 0.5]);
        let force = viscous.touch(&floor(Contact::Stick, at), at, anchor).expect("a touch").force.x;
        assert!((-force - (1.5 + 2.0 * (1.0 + force / 4.0).sqrt())).abs() < 1e-9 && force < -2.0, "{force}");
        let pulled = touch(Contact::Stick, DVec3::new(1.0, 0.1, 0.0), anchor).expect("a touch");
        assert_eq!(pulled.force, DVec3::new(-1.5, -1.5, 0.0));
        let elastic = Springs { strength: f64::INFINITY, ..SPRINGS };
        let at = DVec3::new(1.0, 0.2, 0.0);
        let held = elastic.touch(&floor(Contact::Stick, at), at, anchor).expect("a touch");
        assert_eq!((held.force, held.anchor), (DVec3::new(-20.0, -8.0, 0.0), anchor));
    }

    /// What is found deep in a surface is pushed out at the speed of ejection, however it came there; what
    /// has touched it before, or is hardly in it, bears the spring.
    #[test]
    fn clay_found_in_a_surface_comes_out_slowly() {
        let depth = |gap, leaving, anchor| {
            let surface = Surface { leaving, ..floor(SEPARATE, DVec3::Y * gap) };
            let found = SPRINGS.touch(&surface, DVec3::Y * gap, anchor).expect("a touch");
            (found.force.y, found.anchor.is_some())
        };
        let speed_after = |leaving| leaving + depth(-3.0, leaving, None).0 / SPRINGS.inertia;
        assert_eq!(depth(-3.0, -0.2, None), (SPRINGS.inertia * 0.22, false));
        assert!((speed_after(-0.2) - EJECTION_SPEED).abs() < 1e-15 && speed_after(0.5) == 0.5);
        assert_eq!(depth(-0.031, -0.01, None), (SPRINGS.inertia * 0.03, false));
        // Come in within the substep, a tenth of a cell of it.
        assert_eq!(depth(-0.11, -0.1, None), (4.4, true));
        assert_eq!(depth(-0.12, 0.0, None), (0.04, false));
        assert_eq!(depth(-3.0, 0.5, Some(DVec3::ZERO)), (120.0, true));
        // In an implicit step against what presses on it, too: where the surface comes by 0.2, by that more.
        let surface = Surface { leaving: -0.2, ..floor(SEPARATE, DVec3::Y * -3.0) };
        let found = SPRINGS.in_implicit_step().touch(&surface, DVec3::Y * -3.0, None).expect("a touch");
        assert!((found.force.y - SPRINGS.normal * 0.22).abs() < 1e-12 && found.anchor.is_none(), "{found:?}");
    }

    /// An edge gives its clay as much as its share of the toughness at most, and that once for each way:
    /// drawn back it does not pull, and come again it gives nothing before it is where it was.
    #[test]
    fn edge_gives_its_toughness_once() {
        let (mut anchor, mut work) = (0.0, 0.0);
        let way = (0..=400).map(|i| 1e-3 * f64::from(i));
        // To 0.4, back to 0.1, to 0.6.
        let way = way.chain((0..300).map(|i| 0.399 - 1e-3 * f64::from(i))).chain((0..500).map(|i| 0.101 + 1e-3 * f64::from(i)));
        let mut before = 0.0;
        for at in way {
            let (force, left) = SPRINGS.cut(0.5, at - anchor);
            assert!((0.0..=1.5).contains(&force), "{force}");
            anchor = at - left;
            work += force * (at - before);
            before = at;
        }
        // Less what the spring holds.
        let give: f64 = 1.5 / 20.0;
        assert!((work - 1.5 * (0.6 - 0.5 * give)).abs() < 3e-3, "{work}");
        assert_eq!(SPRINGS.cut(0.0, 0.3), (0.0, 0.0));
        let stiffness = Springs::cut_stiffness(DVec3::Y, 1.0, 0.05);
        assert_eq!(stiffness * DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 40.0, 0.0));
        assert_eq!(Springs::cut_stiffness(DVec3::Y, 0.0, -0.1), DMat3::ZERO);
    }

    /// A full particle is a cube of half a cell; what is carved from it is thinner and bears less, in
    /// proportion.
    #[test]
    fn reach_follows_the_volume() {
        assert_eq!([reach(0.125), reach(0.0625), reach(1.0)], [0.25, 0.125, 0.5]);
        assert_eq!([area(0.125), area(0.0625), area(1.0)], [0.25, 0.125, 1.0]);
    }
}
