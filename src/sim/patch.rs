//! What a tool meets at a frame's end: the numbers of first order that a force between two frames needs.
//!
//! Lengths are in cells unless said. A particle stands before the tool by the gap `g_p` of the law of
//! [contact](super::penalty), `n_p` the tool's outward normal there. It touches if it clings by an anchor.
//! With n out of the clay, `-sum A_p n_p` of unit length, the particle's *way* `w_p` is how far the tool
//! would go against n until it touches it, 0 where it does. `A(w)` is the [area](area_of) across n of the
//! particles of ways up to w, g the least way of all:
//!
//! | number                | touching, g = 0                | before touch                |
//! |-----------------------|--------------------------------|-----------------------------|
//! | area A                | `A(FIRST)`                     | `A(g + FIRST)`              |
//! | growth A'             | `(A(BAND) - A) / (BAND - FIRST)` | the same of `A(g + BAND)` |
//! | stiffness             | `K_n = 2 E* sqrt(A / pi)`, `K_t = K_n 2 (1 - nu) / (2 - nu)` | the same |
//! | yield force F         | the force along n where the patch yields | `(2 + pi) k (A - FIRST A')` |
//! |                       | else at least `(2 + pi) k A`   |                             |
//! | its growth with depth | `max(F / A, (2 + pi) k) A'`    | `(2 + pi) k A'`             |
//!
//! `E* = E / (1 - nu^2)`: a rigid tool on an elastic half space, as if A were round (Sneddon 1965); K_t is
//! Mindlin's of full stick (1949). `(2 + pi) k` is what a flat punch bears (Prandtl 1920). Clay that flows
//! under a tool bears a pressure that stays while the patch grows: hence the growth. Before touch `F` goes
//! back to the touch itself: of a ball, whose area grows from nothing, it is about 0, of a flat face all.
//! A patch yields where the mean over its particles of the stress deviator over the yield surface's is
//! [`YIELDING`].
//!
//! A flat blade has clay on both flanks, each a half space of its own: `K_n` and `K_t` are sums over the two,
//! their areas with the edges' own. What it yields at is by direction:
//! [`BladeTouch`](super::touch::BladeTouch).

mod blade;

use super::cut::ClassKey;
use super::frame::{FramePlan, ToolReport};
use super::integrator::Integrator;
use super::material::ClayMaterial;
use super::params::{BLOCK, Domain};
use super::penalty::{STICK_FRICTION, area, reach};
use super::tool::{Contact, Pose, ToolPath, ToolShape};
use super::touch::{NEAR_MAX, ToolTouch, TouchParticle};
use blade::{About, Beside};
use glam::{DMat3, DVec2, DVec3, IVec2, IVec3};
use std::f64::consts::PI;

/// Gap \[cells\] up to which particles are looked at.
const NEAR_REACH: f64 = 4.0;

/// Depth \[cells\] over which an area grows, of the order of a fast hand's way in a frame: the force on a
/// ball of 3 cells, foretold over .4 in its place, was off by 4.8 % of its range at 5 mm/s and 16 at 200, so
/// by 3.0 and 10.6.
const BAND: f64 = 1.0;

/// Depth \[cells\] at which a tool counts as having come to the clay: what fills leave a face uneven by.
const FIRST: f64 = 0.1;

/// Share [-] of its yield stress at which a patch yields: of clay under a tool a little is always unloaded by
/// noise. A ball's has 0.988 while it goes in, 0.95 once it bears an eighth less, 0.88 with a third less.
const YIELDING: f64 = 0.97;

/// Radius \[cells\] of the ball in which the fill is a mean: nodes see as far as 1.5.
const FILL_RADIUS: f64 = 2.0;

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
    /// Where it clings to the tool, in the tool's frame \[cells\].
    pub(crate) anchor: Option<DVec3>,
    /// Its class, if it has no side of the tool's cut.
    pub(crate) whole: Option<ClassKey>,
}

impl Seen {
    /// Whether it clings to the tool.
    fn touches(&self) -> bool {
        self.anchor.is_some()
    }
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
            mean_position: mean_position(self.path, self.plan),
            latter_way: latter_way(self.path, self.plan.duration()),
            force: tool.force,
            friction: friction(self.path.tool.contact),
            near: self.found.iter().take(NEAR_MAX).map(|f| self.particle(&f.seen)).collect(),
            ..ToolTouch::default()
        };
        if self.shape.is_blade() {
            self.describe_blade(&mut touch);
        } else if let Some(patch) = self.patch() {
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
        let [normal, across] = stiffnesses(material, touch.area);
        let across = if touch.friction == 0.0 { 0.0 } else { across };
        touch.stiffness = about(patch.normal, normal, across);
        let growth = patch.growth * cell;
        let mean = |of: &dyn Fn(&Seen) -> f64| {
            let holds = |f: &&Found| if patch.touches { f.seen.touches() } else { f.gap < patch.gap + BAND };
            let weights = self.found.iter().filter(holds).map(|f| (f, f.area));
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
        // A frame in which the tool came to the clay has a mean force that says little.
        let pressure = if patch.touches { bound.max(force / touch.area) } else { bound };
        touch.yield_slope = pressure * growth;
    }

    /// Stiffness and yield of a flat blade.
    fn describe_blade(&self, touch: &mut ToolTouch) {
        let Some((corners, count)) = self.shape.outline().and_then(|outline| outline.corners()) else { return };
        let (cell, material) = (self.domain.cell_width, &self.plan.material);
        let (fresh, loss) = (material.shear_strength_at_tool(), material.strength_loss());
        let beside = |f: &Found| Beside {
            at: f.local,
            volume: f.seen.volume,
            whole: f.seen.whole,
            anchor: f.seen.anchor,
            strengths: [
                fresh * (1.0 - loss.of(f.seen.structure, f.seen.hardening)).max(0.0),
                flow_stress(material, &f.seen, cell) / 3f64.sqrt(),
            ],
        };
        let found: Vec<Beside> = self.found.iter().map(beside).collect();
        let about_it = About::new(&corners[..count], &found);
        let contact = self.path.tool.contact;
        touch.friction = if contact.sticks() { 0.0 } else { friction(contact) };
        touch.blade = about_it.touch(material.toughness, contact.sticks(), cell);
        if touch.blade.is_some() {
            let sides = about_it.bearing_areas().map(|area| stiffnesses(material, area * cell * cell));
            touch.normal = self.pose.rotation * DVec3::Z;
            touch.area = about_it.area().max(0.0) * cell * cell;
            touch.stiffness = about(touch.normal, sides[0][0] + sides[1][0], sides[0][1] + sides[1][1]);
        }
    }

    /// Middle of what touches, else the nearest particle's place, else the tool's own.
    fn centre(&self, is_touching: bool) -> DVec3 {
        let touching = self.found.iter().filter(|f| is_touching && f.seen.touches());
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

impl Gather<'_> {
    /// None where no clay is near, none has a side, or the tool would meet none.
    fn patch(&self) -> Option<Patch> {
        let touches = self.found.iter().any(|f| f.seen.touches());
        let first = self.found.first()?.gap;
        // Before touch the nearer, the more: what lies by the side of a face comes in without a step.
        let weight = |f: &Found| match touches {
            true => f64::from(u8::from(f.seen.touches())) * f.area,
            false => f.area * (BAND - f.gap + first).max(0.0),
        };
        let normal = self.found.iter().map(|f| -weight(f) * f.normal).sum::<DVec3>().try_normalize()?;
        let ways: Vec<(f64, DVec3)> = self.found.iter().filter_map(|f| Some((self.way(f, normal)?, f.seen.position))).collect();
        let gap = if touches { 0.0 } else { ways.iter().map(|w| w.0).reduce(f64::min)? };
        let area_at = |depth| area_of(ways.iter().filter(|w| w.0 <= gap + depth).map(|w| w.1), normal);
        let area = area_at(FIRST);
        let growth = (area_at(BAND) - area).max(0.0) / (BAND - FIRST);
        Some(Patch { touches, normal, gap, area, growth })
    }

    /// How far the tool goes against the normal until it touches a particle \[cells\], by steps of its
    /// distance; none where it passes by or with its side, or is further off than what is looked at.
    fn way(&self, found: &Found, normal: DVec3) -> Option<f64> {
        if found.seen.touches() {
            return (-found.normal.dot(normal) > FACING).then_some(0.0);
        }
        let (on, reach) = (self.pose.rotation.conjugate() * normal, reach(found.seen.volume));
        let mut way = 0.0;
        for _ in 0..WAY_STEPS {
            let there = found.local + on * way;
            let gap = self.shape.distance(there) - reach;
            if gap < WAY_ERROR {
                return (-self.shape.normal(there).dot(on) > FACING).then_some(way);
            }
            way += gap;
            if way > NEAR_REACH {
                return None;
            }
        }
        None
    }
}

/// Cosine [-] between a tool's face and the patch up to which clay by its side bears nothing: that of a
/// cone of 14 degrees from its axis.
const FACING: f64 = 0.25;

/// Steps to a way, at most: what is passed closely is found to be passed, or met so late that it is no part.
const WAY_STEPS: u32 = 24;

/// Error of a way \[cells\].
const WAY_ERROR: f64 = 1e-3;

/// How far [cells] particles of one patch are apart at most, over 2: full ones are half a cell apart, and
/// pressed clay spreads.
const APART: f64 = 0.6;

/// Edge [cells] of the raster that areas are counted on, and how many of them a patch has across, at most.
const RASTER: (f64, f64) = (0.125, 160.0);

/// The area [cells^2] across `normal` of a patch of particles: of all that is within [`APART`] of one of
/// them, less a rim such that the last ones stick out of it by half of what full particles are apart. What
/// lies under another, or has spread, counts by the place that it takes.
fn area_of(places: impl Iterator<Item = DVec3>, normal: DVec3) -> f64 {
    let (x, y) = normal.any_orthonormal_pair();
    let points: Vec<DVec2> = places.map(|p| DVec2::new(p.dot(x), p.dot(y))).collect();
    let Some(low) = points.iter().copied().reduce(DVec2::min) else { return 0.0 };
    let high = points.iter().copied().fold(low, DVec2::max);
    let edge = RASTER.0.max((high - low).max_element() / RASTER.1);
    let origin = low - APART - edge;
    let size = ((high - low + 2.0 * (APART + edge)) / edge).ceil().as_ivec2() + 1;
    let mut is_in = vec![false; (size.x * size.y) as usize];
    let around = |radius: f64| {
        let n = (radius / edge) as i32;
        let all = (-n..=n).flat_map(move |j| (-n..=n).map(move |i| IVec2::new(i, j)));
        all.filter(move |d| d.as_dvec2().length() * edge <= radius).collect::<Vec<_>>()
    };
    let at = |cell: IVec2| (cell.x + size.x * cell.y) as usize;
    let grown = around(APART);
    for point in &points {
        let cell = ((point - origin) / edge).round().as_ivec2();
        grown.iter().for_each(|d| is_in[at(cell + *d)] = true);
    }
    let rim = around(APART - 0.25);
    let inner = |cell: IVec2| rim.iter().all(|d| is_in[at(cell + *d)]);
    let margin = (APART / edge) as i32;
    let cells = (margin..size.y - margin).flat_map(|j| (margin..size.x - margin).map(move |i| IVec2::new(i, j)));
    cells.filter(|cell| is_in[at(*cell)] && inner(*cell)).count() as f64 * edge * edge
}

/// Stiffness along a normal and across it, as a matrix.
fn about(n: DVec3, normal: f64, across: f64) -> DMat3 {
    let along = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
    along * (normal - across) + DMat3::from_diagonal(DVec3::splat(across))
}

/// Of an area \[m^2\] that clay clings to, K_n and K_t \[N/m\].
fn stiffnesses(material: &ClayMaterial, area: f64) -> [f64; 2] {
    let poisson = material.poisson_ratio;
    let normal = 2.0 * material.young_modulus / (1.0 - poisson * poisson) * (area / PI).sqrt();
    [normal, normal * 2.0 * (1.0 - poisson) / (2.0 - poisson)]
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

/// A tool's way in the latter half of a frame \[m\].
fn latter_way(path: &ToolPath, duration: f64) -> DVec3 {
    path.pose_at(duration).position - path.pose_at(0.5 * duration).position
}

/// Mean of a tool's position over a frame \[m\], by its samples' straight ways: of implicit steps at their
/// ends, where each bears what it bears.
fn mean_position(path: &ToolPath, plan: &FramePlan) -> DVec3 {
    let duration = plan.duration();
    if let Integrator::Implicit { .. } = plan.integrator {
        let end = |step: u32| path.pose_at(f64::from(step) * plan.dt).position;
        return (1..=plan.steps).map(end).sum::<DVec3>() / f64::from(plan.steps);
    }
    let turns = path.samples.iter().map(|s| s.time).filter(|t| *t > 0.0 && *t < duration);
    let times: Vec<f64> = std::iter::once(0.0).chain(turns).chain([duration]).collect();
    let at = |time| path.pose_at(time).position;
    let part = |t: &[f64]| 0.5 * (t[1] - t[0]) * (at(t[0]) + at(t[1]));
    times.windows(2).map(part).sum::<DVec3>() / duration
}

#[cfg(test)]
mod tests;
