//! Sums that came back from the device -> a frame's report, in f64 and SI.

use super::super::cut::JOINT_SHEET;
use super::super::frame::{FramePlan, FrameReport, SurfaceParticle, ToolReport};
use super::super::health::Health;
use super::super::material::ClayMaterial;
use super::super::params::Domain;
use super::super::snapshot::{Forecast, Particle, Tag};
use super::super::sums::ParticleSums;
use super::super::support::Support;
use super::layout::{Status, Total, flag};
use super::params::centre;
use super::wgsl::CLASSES;
use glam::{DMat3, DVec3, IVec3};

/// Adds up the workgroups' partial sums of a frame with substeps of `dt` \[s\] over `count` particles of
/// `volume` [m^3] at rest; beside them the greatest
/// |v + A d| [cells/substep].
pub(super) fn sums(
    domain: &Domain,
    mass_unit: f64,
    totals: &[Total],
    dt: f64,
    (count, volume): (usize, f64),
) -> (ParticleSums, f64) {
    let speed_unit = domain.cell_width / dt;
    let mut s = ParticleSums { count, volume, ..ParticleSums::ZERO };
    let mut reach = 0.0f64;
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    for t in totals {
        s.momentum += vector(t.momentum);
        s.speed += f64::from(t.momentum_size);
        s.angular += vector(t.angular);
        s.kinetic += f64::from(t.kinetic);
        let [norm, trace, volume] = t.strain.map(f64::from);
        s.strain = (s.strain.0 + norm, s.strain.1 + trace);
        s.present_volume += volume;
        s.ratio = (s.ratio.0.min(t.ratio[0].into()), s.ratio.1.max(t.ratio[1].into()));
        reach = reach.max(t.reach.into());
    }
    s.momentum *= mass_unit * speed_unit;
    s.speed *= mass_unit * speed_unit;
    s.kinetic *= mass_unit * speed_unit * speed_unit;
    let middle = domain.to_world(centre(domain).as_dvec3());
    s.angular = s.angular * (mass_unit * speed_unit * domain.cell_width) + middle.cross(s.momentum);
    s.strain = (s.strain.0 * mass_unit, s.strain.1 * mass_unit);
    s.present_volume *= mass_unit;
    (s, reach)
}

/// Sums over particles as loaded, by the host.
pub(super) fn start_sums(domain: &Domain, particles: &[Particle]) -> ParticleSums {
    let mut s = ParticleSums { count: particles.len(), ..ParticleSums::ZERO };
    let inertia = domain.cell_width * domain.cell_width / 4.0;
    for p in particles {
        let volume = f64::from(p.rest_volume);
        let v = DVec3::from_array(p.velocity.map(f64::from));
        let a = DMat3::from_cols_array_2d(&p.affine.map(|c| c.map(f64::from)));
        let curl = DVec3::new(a.y_axis.z - a.z_axis.y, a.z_axis.x - a.x_axis.z, a.x_axis.y - a.y_axis.x);
        let square: f64 = a.to_cols_array().iter().map(|c| c * c).sum();
        let j = p.volume_ratio();
        s.momentum += volume * v;
        s.angular += volume * (domain.to_world(p.grid()).cross(v) + inertia * curl);
        s.speed += volume * v.length();
        s.kinetic += 0.5 * volume * (v.length_squared() + inertia * square);
        s.ratio = (s.ratio.0.min(j), s.ratio.1.max(j));
        s.volume += volume;
        s.present_volume += volume * j;
        // To first order; replaced by the device's at the first frame's end.
        let [xx, yy, zz, xy, xz, yz] = p.elastic_strain.map(|e| 0.5 * f64::from(e));
        s.strain.0 += volume * (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz));
        s.strain.1 += volume * (xx + yy + zz).powi(2);
    }
    s
}

/// Rest volume of mass 1 [m^3]: the power of two at or below an eighth of a cell, so that scaling by it is
/// exact.
pub(super) fn mass_unit(domain: &Domain) -> f64 {
    (domain.cell_width.powi(3) / 8.0).log2().floor().exp2()
}

/// How many classes of clay the passes have to know at least for these particles.
pub(super) fn classes_of(particles: &[Particle]) -> u32 {
    let is_apart = |p: &Particle| p.body != 0 || p.tags.iter().any(|tag| tag.side != 0);
    CLASSES[usize::from(particles.iter().any(is_apart))]
}

/// Greatest mass of a particle, in mass units.
pub(super) fn mass_max(particles: &[Particle], mass_unit: f64) -> f64 {
    particles.iter().map(|p| f64::from(p.rest_volume) / mass_unit).fold(1e-6, f64::max)
}

/// What the first frames of clay that no engine has run can count on: speeds from velocities, affine parts
/// and a bound on the stress.
pub(super) fn forecast(material: &ClayMaterial, domain: &Domain, particles: &[Particle], mass_max: f64) -> Forecast {
    let (mut speed, mut reach) = (0.0f64, 0.0f64);
    let modulus = 2.0 * material.lame_mu() + 3.0 * material.lame_lambda();
    for p in particles {
        let v = p.velocity.iter().map(|v| f64::from(v.abs())).fold(0.0, f64::max);
        let a = p.affine.iter().flatten().map(|a| f64::from(a.abs())).fold(0.0, f64::max);
        let e = p.elastic_strain.iter().map(|e| f64::from(e.abs())).fold(0.0, f64::max);
        // Stress over density and the speed at which it acts in a substep at the stability limit.
        let push = modulus * e / (material.density * material.wave_speed(material.density));
        speed = speed.max(v);
        reach = reach.max(v + 4.5 * a * domain.cell_width + push);
    }
    let mut counts = std::collections::HashMap::<[i32; 3], u32>::new();
    for p in particles {
        *counts.entry(p.cell).or_default() += 1;
    }
    let cell_count = counts.into_values().max().unwrap_or(1);
    Forecast { reach, speed, cell_count, node_mass: f64::from(cell_count) * mass_max }
}

/// Counters of the status word.
pub(super) fn add_status(report: &mut FrameReport, plan: &FramePlan, status: &Status) {
    report.speed_max = status.speed.into();
    report.clamped = status.clamped.into();
    (report.welded, report.joined, report.carried) = (status.welded.into(), status.joined.into(), status.carried.into());
    report.body_max = status.body_max;
    let has = |sheet: &u8| status.sheets[usize::from(sheet / 32)] >> (sheet % 32) & 1 == 1;
    report.sheets = (1..=u8::MAX).filter(|sheet| *sheet != JOINT_SHEET && has(sheet)).collect();
    if status.crowded != 0 {
        report.health.insert(Health::CROWDED);
    }
    report.tools = plan
        .tools
        .iter()
        .zip(&status.tools)
        .map(|(path, count)| ToolReport {
            id: path.id,
            tagged: count.tagged.into(),
            displaced: count.displaced.into(),
            pushed_back: count.pushed_back.into(),
            depth_max: count.depth.into(),
            ..ToolReport::default()
        })
        .collect();
}

/// Impulses of walls, damping and tools over the frame, summed by block on the device.
pub(super) fn add_impulses(
    report: &mut FrameReport,
    plan: &FramePlan,
    domain: &Domain,
    mass_unit: f64,
    impulses: &[[f32; 4]],
    tools: usize,
) {
    let mut sums = vec![[0.0f64; 4]; 2 + 2 * tools];
    for row in impulses.chunks_exact(sums.len()) {
        for (sum, part) in sums.iter_mut().zip(row) {
            for d in 0..4 {
                sum[d] += f64::from(part[d]);
            }
        }
    }
    let unit = plan.inertial_density() * mass_unit * domain.cell_width / report.dt;
    let vector = |s: [f64; 4]| DVec3::new(s[0], s[1], s[2]) * unit;
    report.wall_impulse = vector(sums[0]);
    report.impulse_scale = sums[0][3] * unit;
    report.damping_impulse = vector(sums[1]);
    let duration = report.dt * f64::from(report.steps);
    report.gravity_impulse = plan.gravity * (report.particle_mass / plan.density_scale()) * duration;
    for (tool, pair) in report.tools.iter_mut().zip(sums[2..].chunks_exact(2)) {
        tool.impulse = vector(pair[0]);
        tool.angular_impulse = vector(pair[1]) * domain.cell_width;
        tool.force = tool.impulse / duration;
        tool.torque = tool.angular_impulse / duration;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let contacts = pair[0][3] as u64;
        tool.contacts = contacts;
        report.impulse_scale += pair[1][3] * unit;
    }
}

/// Sum of node masses at the last substep.
pub(super) fn add_grid_mass(report: &mut FrameReport, plan: &FramePlan, mass_unit: f64, scale: f32, masses: &[[u32; 2]]) {
    let sum: u64 = masses.iter().map(|m| (u64::from(m[0]) << 16) + u64::from(m[1])).sum();
    report.grid_mass = sum as f64 / f64::from(scale) * mass_unit * plan.inertial_density();
}

/// Whether some clay hangs together with none that a wall bears, of the words of all blocks, if it is asked.
pub(super) fn has_loose_clay(plan: &FramePlan, blocks: &[u32], status: &Status) -> Option<bool> {
    if !plan.outputs.support {
        return None;
    }
    let slots = status.slot_count as usize;
    let mut support = Support::default();
    let at = |packed: u32| IVec3::new((packed & 1023) as i32, (packed >> 10 & 1023) as i32, (packed >> 20) as i32);
    let bits = &blocks[blocks.len() / 4 * 3..];
    blocks.iter().zip(bits).take(slots).for_each(|(packed, bits)| support.add_block(at(*packed), *bits));
    Some(support.has_loose())
}

/// Tags as the device has them.
pub(super) fn packed_tags([first, second]: [Tag; 2]) -> u32 {
    u32::from_le_bytes([first.sheet, first.side.cast_unsigned(), second.sheet, second.side.cast_unsigned()])
}

/// What the surface needs of a particle.
#[expect(clippy::cast_possible_truncation, reason = "the surface is f32")]
pub(super) fn surface_particle(p: &Particle, cell_width: f64) -> SurfaceParticle {
    SurfaceParticle {
        position: std::array::from_fn(|d| p.cell[d] as f32 + p.offset[d]),
        volume_ratio: p.volume_ratio() as f32,
        density_weight: (f64::from(p.rest_volume) / cell_width.powi(3)) as f32,
        tags: packed_tags(p.tags),
        body: p.body,
    }
}

/// What the flags of a frame that no retry has mended say of it.
pub(super) fn trouble(flags: u32) -> Health {
    let has = |bits| flags & bits != 0;
    match flags {
        _ if has(flag::SPEED | flag::MARGIN) => Health::SPEED,
        _ if has(flag::NON_FINITE) => Health::NON_FINITE,
        _ if has(flag::CAPACITY | flag::OVERFLOW) => Health::CAPACITY,
        _ if has(flag::CROWDED) => Health::CROWDED,
        // No flag, but sums that are not finite.
        _ => Health::NON_FINITE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame that asks for more room again and again is not said to have lost its numbers.
    #[test]
    fn trouble_is_called_what_it_is() {
        assert_eq!(trouble(flag::CAPACITY), Health::CAPACITY);
        assert_eq!(trouble(flag::OVERFLOW | flag::CROWDED), Health::CAPACITY);
        assert_eq!(trouble(flag::CROWDED), Health::CROWDED);
        assert_eq!(trouble(flag::MARGIN | flag::OVERFLOW), Health::SPEED);
        assert_eq!((trouble(flag::NON_FINITE), trouble(0)), (Health::NON_FINITE, Health::NON_FINITE));
    }
}
