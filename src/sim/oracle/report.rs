//! What a frame did: momentum and who gave it, energy, volume.
//!
//! Walls are accounted last: their impulse is what the columns they fold gained beyond gravity, damping and
//! contact. Everywhere else nothing is left over, so that `change = gravity + walls + damping - tools` is a
//! check of every pass and not a definition.

use super::super::frame::{Energies, FramePlan, FrameReport, ToolReport};
use super::super::health::Health;
use super::super::params::Domain;
use super::super::patch::{Gather, Seen};
use super::super::support::{Support, bearing_walls};
use super::super::tool::ToolPath;
use super::super::touch::ToolTouch;
use super::grid::Grid;
use super::law;
use super::particle::Particle;
use super::tools::Surroundings;
use glam::{DMat3, DVec3};

/// The report of a frame that begins.
pub(super) fn begin(particles: &[Particle], plan: &FramePlan) -> FrameReport {
    FrameReport {
        plan_id: plan.id,
        dt: plan.dt,
        steps: plan.steps,
        particle_count: particles.len(),
        density_scale: plan.density_scale(),
        momentum_before: momentum(particles, plan),
        tools: plan.tools.iter().map(|path| ToolReport { id: path.id, ..ToolReport::default() }).collect(),
        ..FrameReport::default()
    }
}

fn mass(particle: &Particle, plan: &FramePlan) -> f64 {
    plan.inertial_density() * particle.rest_volume
}

fn momentum(particles: &[Particle], plan: &FramePlan) -> DVec3 {
    particles.iter().map(|p| mass(p, plan) * p.velocity).sum()
}

/// Adds what one substep's nodes tell.
pub(super) fn add_grid(frame: &mut FrameReport, grid: &Grid, around: &Surroundings) {
    let per_substep = around.plan.dt / around.domain.cell_width;
    frame.grid_mass = 0.0;
    for (coordinate, node) in grid.coordinates().zip(&grid.nodes) {
        let gravity = around.gravity_step(coordinate);
        let contact: DVec3 = node.fields.iter().map(|field| field.contact_impulse).sum();
        let mut unexplained = -contact;
        for (key, own) in node.classes.iter() {
            let Some(field) = node.field(key) else { continue };
            let weight = own.mass * gravity;
            let damping = own.mass * field.damped;
            frame.grid_mass += own.mass;
            frame.gravity_impulse += weight;
            frame.damping_impulse += damping;
            unexplained += own.mass * field.velocity - own.momentum - weight - damping;
            if own.mass > 0.0 {
                frame.speed_max = frame.speed_max.max(field.velocity.length() * per_substep);
            }
        }
        frame.impulse_scale += node.fields.iter().map(|field| field.contact_impulse.length()).sum::<f64>();
        if node.is_at_wall {
            frame.wall_impulse += unexplained;
            frame.impulse_scale += unexplained.length();
        }
    }
}

/// Completes the report at the frame's end.
pub(super) fn end(frame: &mut FrameReport, particles: &[Particle], domain: &Domain, plan: &FramePlan) {
    frame.particle_mass = particles.iter().map(|p| mass(p, plan)).sum();
    frame.momentum = momentum(particles, plan);
    frame.momentum_scale = particles.iter().map(|p| mass(p, plan) * p.velocity.length()).sum();
    frame.angular_momentum = particles.iter().map(|p| angular_momentum(p, domain, plan)).sum();
    frame.energies = energies(particles, domain, plan);
    let ratios = particles.iter().map(|p| law::volume_ratio(p.elastic_strain));
    frame.volume_ratio = ratios.clone().fold((f64::INFINITY, 0.0), |(low, high), j| (low.min(j), high.max(j)));
    frame.volume = ratios.zip(particles).map(|(ratio, p)| ratio * p.rest_volume).sum();
    frame.sheets = particles.iter().flat_map(|p| p.key().sides().collect::<Vec<_>>()).map(|side| side.0).collect();
    frame.body_max = particles.iter().map(|p| p.body).max().unwrap_or(0);
    frame.has_loose_clay = plan.outputs.support.then(|| has_loose_clay(particles, domain, plan));
    for tool in &mut frame.tools {
        tool.force = tool.impulse / plan.duration();
        tool.torque = tool.angular_impulse / plan.duration();
    }
    if plan.outputs.touch {
        frame.touches =
            plan.tools.iter().zip(&frame.tools).map(|(path, tool)| touch(particles, domain, plan, path, tool)).collect();
    }
    if frame.clamped > 0 {
        frame.health.insert(Health::STRAIN);
    }
    if !frame.momentum.is_finite() {
        frame.health.insert(Health::NON_FINITE);
    }
    if (frame.grid_mass - frame.particle_mass).abs() > 1e-9 * frame.particle_mass {
        frame.health.insert(Health::MASS_LOST);
    }
}

/// Whether walls bear no clay that some of it hangs together with, see [`support`](super::super::support).
fn has_loose_clay(particles: &[Particle], domain: &Domain, plan: &FramePlan) -> bool {
    let (mut support, bearing) = (Support::default(), bearing_walls(&domain.walls, plan.gravity));
    particles.iter().for_each(|p| support.add(p.position.floor().as_ivec3(), p.walls & bearing != 0));
    support.has_loose()
}

/// What a tool meets, see [`patch`](super::super::patch).
fn touch(particles: &[Particle], domain: &Domain, plan: &FramePlan, path: &ToolPath, tool: &ToolReport) -> ToolTouch {
    let mut gather = Gather::new(path, plan, domain);
    for p in particles {
        gather.see(Seen {
            id: p.id,
            position: p.position,
            volume: p.rest_volume / domain.cell_width.powi(3),
            strain: p.elastic_strain,
            hardening: p.hardening,
            structure: p.structure,
            anchor: p.anchors.iter().flatten().find(|anchor| anchor.0 == path.id).map(|anchor| anchor.1),
            whole: Some(p.key()).filter(|key| key.side(path.sheet_id()) == 0),
        });
    }
    gather.finish(tool)
}

/// Second moment `dx^2 / 4` [m^2] of the quadratic spline: the inertia that the affine velocity carries, per
/// mass.
fn spline_inertia(domain: &Domain) -> f64 {
    0.25 * domain.cell_width * domain.cell_width
}

/// About the world's origin, with the spin `m dx^2 / 4` times twice the axial vector of C (Jiang et al.
/// 2015).
fn angular_momentum(particle: &Particle, domain: &Domain, plan: &FramePlan) -> DVec3 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = particle.affine;
    let spin = DVec3::new(y.z - z.y, z.x - x.z, x.y - y.x) * spline_inertia(domain);
    mass(particle, plan) * (domain.to_world(particle.position).cross(particle.velocity) + spin)
}

fn energies(particles: &[Particle], domain: &Domain, plan: &FramePlan) -> Energies {
    let kinetic = |p: &Particle| {
        let affine: f64 = p.affine.to_cols_array().iter().map(|c| c * c).sum();
        0.5 * mass(p, plan) * (p.velocity.length_squared() + spline_inertia(domain) * affine)
    };
    Energies {
        kinetic: particles.iter().map(kinetic).sum(),
        elastic: particles.iter().map(|p| p.rest_volume * law::energy_density(&plan.material, p.elastic_strain)).sum(),
    }
}
