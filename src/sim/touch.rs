//! What a tool meets at a frame's end: the numbers of first order that a force between two frames needs.
//!
//! Lengths are in cells unless said. A particle with the area `A_p` of [`area`] stands before the tool by the
//! gap `g_p` of the law of [contact](super::penalty), `n_p` the tool's outward normal there. It touches if it
//! clings by an anchor. With n out of the clay, `-sum A_p n_p` of unit length, `c_p = -n_p . n`, and `A(d)`
//! the `sum A_p c_p` of what the tool would hold moved on against n by d:
//!
//! | number                | touching                               | before touch, by the gap g                  |
//! |-----------------------|----------------------------------------|---------------------------------------------|
//! | area A                | `sum A_p c_p` of what touches          | `A(g + FIRST)`                              |
//! | growth A'             | what of `A(BAND)` does not touch yet, over BAND | `(A(g + BAND) - A) / (BAND - FIRST)` |
//! | stiffness             | `K_n = 2 E* sqrt(A / pi)`, `K_t = K_n 2 (1 - nu) / (2 - nu)` | the same              |
//! | yield force F         | where the patch yields the force along n, else at least `(2 + pi) k A` | `(2 + pi) k (A - FIRST A')` |
//! | its growth with depth | `(F / A) A'`                           | `(2 + pi) k A'`                             |
//!
//! `E* = E / (1 - nu^2)`: a rigid tool on an elastic half space, as if A were round (Sneddon 1965); K_t is
//! Mindlin's of full stick (1949). `(2 + pi) k` is what a flat punch bears (Prandtl 1920). Clay that flows
//! under a tool bears a pressure that stays while the patch grows: hence the growth. Before touch `F` goes
//! back to the touch itself: of a ball, whose area grows from nothing, it is about 0, of a flat face all.
//! A patch yields where the mean over A of its stress deviator over the yield surface's is [`YIELDING`].

use super::frame::{FramePlan, ToolReport};
use super::material::ClayMaterial;
use super::params::{BLOCK, Domain};
use super::penalty::{STICK_FRICTION, area, reach};
use super::tool::{Contact, Pose, ToolPath, ToolShape};
use glam::{DMat3, DVec3, IVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Particles that a touch holds, at most: as many as a loop of a thousand times a second can look at.
pub const NEAR_MAX: usize = 256;

/// Gap \[cells\] up to which particles are looked at.
pub const NEAR_REACH: f64 = 4.0;

/// Depth \[cells\] over which an area grows: less than what full particles are apart, so that no layer counts
/// that lies under another.
const BAND: f64 = 0.4;

/// Depth \[cells\] at which a tool counts as having come to the clay: what fills leave a face uneven by.
const FIRST: f64 = 0.1;

/// Share [-] of its yield stress at which a patch yields: of clay under a tool a little is always unloaded by
/// noise.
pub const YIELDING: f64 = 0.9;

/// Radius \[cells\] of the ball in which the fill is a mean: nodes see as far as 1.5.
const FILL_RADIUS: f64 = 2.0;

/// A particle near a tool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TouchParticle {
    /// Stable identity.
    pub id: u32,
    /// Place \[m\].
    pub position: DVec3,
    /// Radius of a ball of its rest volume \[m\].
    pub radius: f64,
}

/// What a tool meets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToolTouch {
    /// The tool's id.
    pub id: u32,
    /// Its pose at the frame's end.
    pub pose: Pose,
    /// Mean of its position over the frame \[m\]: where the mean force belongs.
    pub mean_position: DVec3,
    /// Mean force on it over the frame \[N\].
    pub force: DVec3,
    /// Out of the clay, of unit length; zero where no clay is near, and of blades.
    pub normal: DVec3,
    /// Way against the normal before it touches \[m\]; 0 where it does.
    pub gap: f64,
    /// Area of what touches across the normal, or will \[m^2\].
    pub area: f64,
    /// Fall of the force with the tool's place \[N/m\].
    pub stiffness: DMat3,
    /// Whether the clay that it touches flows.
    pub is_yielding: bool,
    /// Force along the normal beyond which clay gives way \[N\]; none of clay that does not yield.
    pub yield_force: Option<f64>,
    /// Growth of that with depth \[N/m\].
    pub yield_slope: f64,
    /// Coefficient of friction [-].
    pub friction: f64,
    /// Fill about the patch, 1 within the clay [-].
    pub fill: f64,
    /// Its gradient \[1/m\].
    pub fill_gradient: DVec3,
    /// The particles nearest to it, the nearest first.
    pub near: Vec<TouchParticle>,
}

/// A particle as a touch sees it, whichever engine has it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub(crate) id: u32,
    /// \[cells\]
    pub(crate) position: DVec3,
    /// Rest volume [cells^3].
    pub(crate) volume: f64,
    /// E = b_e - I.
    pub(crate) strain: DMat3,
    pub(crate) hardening: f64,
    pub(crate) structure: f64,
    /// Whether it clings to the tool.
    pub(crate) touches: bool,
}

/// A particle with what was found of it.
#[derive(Clone, Copy, Debug)]
struct Found {
    seen: Seen,
    gap: f64,
    /// Its place in the tool's frame.
    local: DVec3,
    /// The tool's outward normal.
    normal: DVec3,
    area: f64,
}

/// A tool at a frame's end that gathers what is near it.
#[derive(Clone, Debug)]
pub(crate) struct Gather<'a> {
    path: &'a ToolPath,
    plan: &'a FramePlan,
    domain: &'a Domain,
    /// \[cells\]
    pose: Pose,
    shape: ToolShape,
    found: Vec<Found>,
}

impl<'a> Gather<'a> {
    pub(crate) fn new(path: &'a ToolPath, plan: &'a FramePlan, domain: &'a Domain) -> Self {
        let pose = path.pose_at(plan.duration());
        let shape = plan.validation.grown(path.tool.shape, plan.duration()).scaled(1.0 / domain.cell_width);
        let pose = Pose { position: domain.to_grid(pose.position), ..pose };
        Self { path, plan, domain, pose, shape, found: vec![] }
    }

    /// The tool's id.
    pub(crate) fn id(&self) -> u32 {
        self.path.id
    }

    /// Whether a particle whose cell is in `block` can be near; it may have strayed from there by a cell.
    pub(crate) fn is_near(&self, block: IVec3) -> bool {
        let side = f64::from(BLOCK);
        let centre = (block.as_dvec3() + 0.5) * side;
        let around = 0.5 * side * 3f64.sqrt() + 1.0 + NEAR_REACH + reach(1.0);
        self.shape.distance(self.pose.to_local(centre)) < around
    }

    /// Takes a particle in if it is near.
    pub(crate) fn see(&mut self, seen: Seen) {
        let local = self.pose.to_local(seen.position);
        let gap = self.shape.distance(local) - reach(seen.volume);
        if gap < NEAR_REACH {
            let normal = self.pose.rotation * self.shape.normal(local);
            self.found.push(Found { seen, gap, local, normal, area: area(seen.volume) });
        }
    }

    /// The touch, with the `tool`'s mean force.
    pub(crate) fn finish(mut self, tool: &ToolReport) -> ToolTouch {
        // By id where gaps are equal: the order of particles in memory is not the same in every engine.
        self.found.sort_unstable_by(|a, b| a.gap.total_cmp(&b.gap).then(a.seen.id.cmp(&b.seen.id)));
        let mut touch = ToolTouch {
            id: self.path.id,
            pose: self.path.pose_at(self.plan.duration()),
            mean_position: mean_position(self.path, self.plan.duration()),
            force: tool.force,
            friction: friction(self.path.tool.contact),
            near: self.found.iter().take(NEAR_MAX).map(|f| self.particle(&f.seen)).collect(),
            ..ToolTouch::default()
        };
        if !self.shape.is_blade()
            && let Some(patch) = self.patch()
        {
            self.describe(&patch, &mut touch);
        }
        let centre = self.centre(touch.area > 0.0 && touch.gap == 0.0);
        (touch.fill, touch.fill_gradient) = self.fill(centre);
        touch
    }

    fn particle(&self, seen: &Seen) -> TouchParticle {
        let radius = (0.75 * seen.volume / PI).cbrt() * self.domain.cell_width;
        TouchParticle { id: seen.id, position: self.domain.to_world(seen.position), radius }
    }

    /// Stiffness and yield of a patch.
    fn describe(&self, patch: &Patch, touch: &mut ToolTouch) {
        let (cell, material) = (self.domain.cell_width, &self.plan.material);
        touch.normal = patch.normal;
        touch.gap = patch.gap * cell;
        touch.area = patch.area * cell * cell;
        let poisson = material.poisson_ratio;
        let normal = 2.0 * material.young_modulus / (1.0 - poisson * poisson) * (touch.area / PI).sqrt();
        let slides = touch.friction == 0.0;
        let across = if slides { 0.0 } else { normal * 2.0 * (1.0 - poisson) / (2.0 - poisson) };
        touch.stiffness = along(patch.normal) * (normal - across) + DMat3::from_diagonal(DVec3::splat(across));
        let growth = patch.growth * cell;
        let mean = |of: &dyn Fn(&Seen) -> f64| {
            let weights = self.found.iter().filter(|f| patch.holds(f)).map(|f| (f, patch.facing(f)));
            let (sum, weight) = weights.fold((0.0, 0.0), |s, (f, w)| (s.0 + w * of(&f.seen), s.1 + w));
            if weight > 0.0 { sum / weight } else { 0.0 }
        };
        let strength = mean(&|seen| flow_stress(material, seen, cell)) / 3f64.sqrt();
        if !strength.is_finite() {
            return;
        }
        let bound = (2.0 + PI) * strength;
        let pressed = touch.force.dot(patch.normal).max(0.0);
        touch.is_yielding = patch.touches && pressed > 0.0 && mean(&|seen| utilisation(material, seen, cell)) >= YIELDING;
        let force = match patch.touches {
            true if touch.is_yielding => pressed,
            true => pressed.max(bound * touch.area),
            false => bound * (touch.area - FIRST * cell * growth).max(0.0),
        };
        touch.yield_force = Some(force);
        let pressure = if patch.touches && touch.area > 0.0 { force / touch.area } else { bound };
        touch.yield_slope = pressure * growth;
    }

    /// Middle of what touches, else the nearest particle's place, else the tool's own.
    fn centre(&self, is_touching: bool) -> DVec3 {
        let touching = self.found.iter().filter(|f| is_touching && f.seen.touches);
        let (sum, weight) = touching.fold((DVec3::ZERO, 0.0), |s, f| (s.0 + f.area * f.seen.position, s.1 + f.area));
        let nearest = || self.found.first().map_or(self.pose.position, |f| f.seen.position);
        if weight > 0.0 { sum / weight } else { nearest() }
    }

    /// Fill [-] and its gradient \[1/m\] at a place \[cells\], by a kernel `315 / (64 pi R^9) (R^2 - r^2)^3`.
    fn fill(&self, centre: DVec3) -> (f64, DVec3) {
        let scale = 315.0 / (64.0 * PI * FILL_RADIUS.powi(9));
        let add = |sum: (f64, DVec3), f: &Found| {
            let way = centre - f.seen.position;
            let left = (FILL_RADIUS * FILL_RADIUS - way.length_squared()).max(0.0);
            let weight = f.seen.volume * scale;
            (sum.0 + weight * left.powi(3), sum.1 - 6.0 * weight * left * left * way)
        };
        let (fill, gradient) = self.found.iter().fold((0.0, DVec3::ZERO), add);
        (fill, gradient / self.domain.cell_width)
    }
}

/// What touches, or will first; in cells.
#[derive(Clone, Copy, Debug)]
struct Patch {
    touches: bool,
    /// Out of the clay.
    normal: DVec3,
    gap: f64,
    area: f64,
    /// Of the area, with depth.
    growth: f64,
}

impl Patch {
    /// Whether a particle is of what touches, or of the first layer that will.
    fn holds(&self, found: &Found) -> bool {
        if self.touches { found.seen.touches } else { found.gap - self.gap < BAND }
    }

    /// The area that a particle has across the patch.
    fn facing(&self, found: &Found) -> f64 {
        found.area * (-found.normal.dot(self.normal)).max(0.0)
    }
}

impl Gather<'_> {
    /// None where no clay is near, or none has a side.
    fn patch(&self) -> Option<Patch> {
        let first = self.found.first()?;
        let touches = self.found.iter().any(|f| f.seen.touches);
        let gap = if touches { 0.0 } else { first.gap.max(0.0) };
        let patch = Patch { touches, normal: DVec3::ZERO, gap, area: 0.0, growth: 0.0 };
        // The nearer, the more: what lies by the side of a face comes in without a step.
        let weight = |f: &Found| if touches { f.area } else { f.area * (BAND - f.gap + gap) };
        let sum: DVec3 = self.found.iter().filter(|f| patch.holds(f)).map(|f| -weight(f) * f.normal).sum();
        let patch = Patch { normal: sum.try_normalize()?, ..patch };
        let area = match touches {
            true => self.found.iter().filter(|f| patch.holds(f)).map(|f| patch.facing(f)).sum(),
            false => self.area_at(&patch, gap + FIRST),
        };
        let growth = match touches {
            true => self.area_at(&patch, BAND) / BAND,
            false => (self.area_at(&patch, gap + BAND) - area) / (BAND - FIRST),
        };
        Some(Patch { area, growth: growth.max(0.0), ..patch })
    }

    /// The area \[cells^2\] of what does not touch and would if the tool went on against the normal by `depth`.
    fn area_at(&self, patch: &Patch, depth: f64) -> f64 {
        let on = self.pose.rotation.conjugate() * (patch.normal * depth);
        let comes = |f: &&Found| !f.seen.touches && f.gap < depth && self.shape.distance(f.local + on) < reach(f.seen.volume);
        self.found.iter().filter(comes).map(|f| patch.facing(f)).sum()
    }
}

fn along(n: DVec3) -> DMat3 {
    DMat3::from_cols(n * n.x, n * n.y, n * n.z)
}

/// Present yield stress \[Pa\], not softened by tools.
fn flow_stress(material: &ClayMaterial, seen: &Seen, cell_width: f64) -> f64 {
    material.flow_stress_at(f64::INFINITY, cell_width, seen.structure, seen.hardening)
}

/// The stress deviator `mu dev E` over the yield surface's `sqrt(2 / 3) sY` [-].
fn utilisation(material: &ClayMaterial, seen: &Seen, cell_width: f64) -> f64 {
    let e = seen.strain;
    let mean = (e.x_axis.x + e.y_axis.y + e.z_axis.z) / 3.0;
    let deviator = e - DMat3::from_diagonal(DVec3::splat(mean));
    let norm = deviator.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
    material.lame_mu() * norm / ((2f64 / 3.0).sqrt() * flow_stress(material, seen, cell_width))
}

/// Coefficient of friction [-] of a contact.
fn friction(contact: Contact) -> f64 {
    match contact {
        Contact::Stick => STICK_FRICTION,
        Contact::Slip => 0.0,
        Contact::Separate { friction } => friction,
    }
}

/// Mean of a tool's position over `duration` \[s\], by its samples' straight ways.
fn mean_position(path: &ToolPath, duration: f64) -> DVec3 {
    let turns = path.samples.iter().map(|s| s.time).filter(|t| *t > 0.0 && *t < duration);
    let times: Vec<f64> = std::iter::once(0.0).chain(turns).chain([duration]).collect();
    let at = |time| path.pose_at(time).position;
    let part = |t: &[f64]| 0.5 * (t[1] - t[0]) * (at(t[0]) + at(t[1]));
    times.windows(2).map(part).sum::<DVec3>() / duration
}

#[cfg(test)]
mod tests;
