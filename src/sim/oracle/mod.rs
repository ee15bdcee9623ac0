//! The judge: the substep in f64, scalar, serial and plain, written from the text at the head of each pass
//! and not from an engine.
//!
//! Read [`substep`](mod@substep) first: it is the whole method in one page. Each pass is a file, in the order
//! in which it runs; the text at its head is exact, and engines are written from it:
//!
//! | file                   | does                                              | equation               |
//! |------------------------|---------------------------------------------------|------------------------|
//! | `averaging`            | what flowed shares its cell's volume ratio        | -                      |
//! | `tags`                 | particles take and keep their side of a blade     | Eq. 1, swept           |
//! | `penalty`              | solid tools and walls press on particles          | one potential          |
//! | `p2g`                  | particles to nodes                                | Eq. 2-4, MLS-MPM, APIC |
//! | `sides`                | which nodes cuts divide                           | Eq. 2-3, compatibility |
//! | `walls`                | what the room's walls do; momentum -> velocity    | method of images       |
//! | `contact`              | side against side, clay against blades            | Coulomb                |
//! | `g2p`                  | nodes to particles, advection                     | APIC, what fades of it |
//! | `law`                  | Hencky elasticity, von Mises return               | Eq. 5 scales the yield |
//! | `weld`                 | cuts grow together, once a frame                  | -                      |
//! | `carry`                | the sides of cuts are carried on, once a frame    | -                      |
//! | `implicit`             | the other integrator: one step as one potential   | backward Euler         |
//! | `ghost`, `interactive` | the methods of others, to compare with            | Eq. 1-3 to the letter  |
//! | `report`               | momentum, energy and volume                       | -                      |
//!
//! What it shares with the engines is what their comparison cannot judge: the material's yield stress
//! (`material`), shapes, the blade's sides, `stick` (`tool`), the law of contact (`penalty`), how sides face
//! each other (`facing`), tags' counts (`weld`), the tools' paths. Their own tests judge these, against
//! closed forms.
//!
//! Sources: MLS-MPM and CPIC, Hu et al. 2018 (ACM TOG 37:150); APIC, Jiang et al. 2015 (ACM TOG 34:51); Eq.
//! numbers are those of the paper named in [`sim`](super). Lengths are in cells, all else in SI units.

mod averaging;
mod carry;
mod contact;
mod faces;
mod g2p;
mod ghost;
mod grid;
pub(super) mod implicit;
mod interactive;
pub mod law;
mod p2g;
mod particle;
mod penalty;
mod report;
mod sides;
mod stencil;
pub mod substep;
mod tags;
mod tools;
mod walls;
mod weld;

pub use particle::Particle;

use super::body::{self, Member};
use super::cut::{ClassKey, SheetSet};
use super::frame::{FramePlan, FrameReport};
use super::integrator::Integrator;
use super::limits::TRAVEL_LIMIT;
use super::material::ClayMaterial;
use super::params::Domain;
use super::snapshot::{self, Snapshot};
use super::trace::TracedNode;
use glam::{DVec3, IVec3};
use grid::Sum;

/// The clay in f64 and the method that moves it. Serial, and the same in every run.
#[derive(Clone, Debug)]
pub struct Oracle {
    /// The room.
    pub domain: Domain,
    /// What the clay is made of: that of the last plan.
    pub material: ClayMaterial,
    /// Simulated time \[s\].
    pub time: f64,
    /// The particles in motion, in the snapshot's order.
    pub particles: Vec<Particle>,
    /// Particles that were not finite when loaded, as they came.
    frozen: Vec<snapshot::Particle>,
}

impl Oracle {
    /// Loads a snapshot. Particles that are not finite are set aside and named in every report.
    pub fn new(snapshot: &Snapshot) -> Self {
        let (finite, frozen): (Vec<_>, Vec<_>) = snapshot.particles.iter().partition(|p| p.is_finite());
        Self {
            domain: snapshot.domain,
            material: snapshot.material,
            time: snapshot.time,
            particles: finite.iter().map(Particle::from_snapshot).collect(),
            frozen,
        }
    }

    /// Runs one frame. The plan has to be [valid](FramePlan::validate); the step is taken as given and never
    /// halved.
    pub fn run(&mut self, plan: &FramePlan) -> FrameReport {
        tags::drop_plates(&mut self.particles, plan);
        let mut frame = report::begin(&self.particles, plan);
        self.begin_frame(plan);
        for step in 0..plan.steps {
            let (particles, domain) = (&mut self.particles, &self.domain);
            let grid = match plan.integrator {
                Integrator::Explicit { .. } => substep::substep(particles, domain, plan, step, &mut frame),
                Integrator::Implicit { passes } => implicit::step(particles, domain, plan, step, passes, &mut frame),
            };
            if step + 1 == plan.steps {
                weld::grow_together(&mut self.particles, &grid, plan, self.time, &mut frame);
                carry::carry_on(&mut self.particles, &grid, plan, &mut frame);
            }
        }
        if plan.averages() {
            averaging::average_volumes(&mut self.particles, plan.volume_averaging);
        }
        if plan.finds_bodies {
            self.find_bodies(plan.dividers());
        }
        self.time += plan.duration();
        self.material = plan.material;
        report::end(&mut frame, &self.particles, &self.domain, plan);
        frame.time = self.time;
        frame.quarantined = self.frozen.iter().map(|p| p.id).collect();
        if !self.frozen.is_empty() {
            frame.health.insert(super::health::Health::QUARANTINED);
        }
        frame
    }

    fn find_bodies(&mut self, spared: SheetSet) {
        let member = |p: &Particle| Member { at: p.position, id: p.id, body: p.body, tags: p.tags };
        let mut members: Vec<Member> = self.particles.iter().map(member).collect();
        let largest = self.particles.iter().map(|p| p.rest_volume).fold(0.0, f64::max);
        body::find(&mut members, largest.cbrt() / self.domain.cell_width, spared);
        for (particle, Member { body, tags, .. }) in self.particles.iter_mut().zip(members) {
            (particle.body, particle.tags) = (body, tags);
        }
    }

    /// What is counted and kept within a frame.
    fn begin_frame(&mut self, plan: &FramePlan) {
        for particle in &mut self.particles {
            let way = particle.velocity * (plan.dt / self.domain.cell_width);
            particle.way = way.clamp_length_max(f64::from(TRAVEL_LIMIT));
            particle.flowed = 0.0;
        }
    }

    /// The nodes of the plan's first substep, as it leaves them, and runs that substep.
    #[doc(hidden)]
    pub fn trace(&mut self, plan: &FramePlan) -> Vec<TracedNode> {
        let mut frame = report::begin(&self.particles, plan);
        self.begin_frame(plan);
        let grid = substep::substep(&mut self.particles, &self.domain, plan, 0, &mut frame);
        let traced = |(node, at): (IVec3, &grid::Node)| -> Vec<TracedNode> {
            let of_class = |(key, sum): (ClassKey, Sum)| {
                let velocity = at.field(key).map_or(DVec3::ZERO, |f| f.velocity);
                TracedNode { node, key, mass: sum.mass, momentum: sum.momentum, velocity }
            };
            at.classes.iter().map(of_class).collect()
        };
        grid.coordinates().zip(&grid.nodes).flat_map(traced).collect()
    }

    /// The state, rounded to f32 as engines store it; frozen particles come last.
    pub fn snapshot(&self) -> Snapshot {
        let particles = self.particles.iter().map(Particle::to_snapshot).chain(self.frozen.iter().copied()).collect();
        Snapshot { time: self.time, ..Snapshot::new(self.domain, self.material, particles) }
    }
}
