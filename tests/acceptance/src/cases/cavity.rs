//! A spherical cavity grows in an elastoplastic ball, as an octant between slip walls, against the 1-D
//! problem solved beside it.

use crate::lab::{DX, Lab, Mover, Size, carved, place, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DMat3, DQuat, DVec3, IVec3};

/// A spherical shell of Hencky clay with von Mises plasticity whose cavity was pushed from radius `inner` to
/// `grown`, lengths in any one unit. Symmetry keeps the principal axes and the direction of the deviator, so
/// the state follows from the deformation alone.
struct Shell {
    material: ClayMaterial,
    inner: f64,
    outer: f64,
    grown: f64,
}

/// A material point of the shell.
#[derive(Clone, Copy)]
struct Point {
    /// Radius at rest.
    rest: f64,
    /// Radius now.
    radius: f64,
    /// Radial Cauchy stress [Pa].
    stress: f64,
}

impl Shell {
    /// Radial stretch, volume ratio and stress difference `tau_tt - tau_rr` where the radial Cauchy stress is
    /// `stress`: `J sigma_rr = K ln J - 2/3 min(2 mu (ln l_t - ln l_r), sY)` by bisection, for it grows with
    /// `l_r` while the clay is far from the stress `K`.
    fn stretch(&self, at: Point) -> (f64, f64, f64) {
        let m = &self.material;
        let hoop = (at.radius / at.rest).ln();
        let state = |radial: f64| {
            let log_ratio = radial + 2.0 * hoop;
            let difference = (2.0 * m.lame_mu() * (hoop - radial)).clamp(-m.yield_stress, m.yield_stress);
            (log_ratio.exp(), difference, (m.bulk_modulus() * log_ratio - 2.0 / 3.0 * difference) / log_ratio.exp())
        };
        let (mut low, mut high) = (-2.0 * hoop - 0.5, -2.0 * hoop + 0.5);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *(if state(middle).2 < at.stress { &mut low } else { &mut high }) = middle;
        }
        let (ratio, difference, _) = state(low);
        (low.exp(), ratio, difference)
    }

    /// Rates per rest radius of radius and stress: `dr / dR = l_r`,
    /// `d sigma_rr / dr = 2 (sigma_tt - sigma_rr) / r`.
    fn slope(&self, at: Point) -> (f64, f64) {
        let (radial, ratio, difference) = self.stretch(at);
        (radial, radial * 2.0 * difference / (ratio * at.radius))
    }

    /// The shell from the cavity outward if its wall bears `pressure` [Pa]: the midpoint rule on 2000 pieces.
    fn integrate(&self, pressure: f64) -> Vec<Point> {
        const PIECES: u32 = 2000;
        let h = (self.outer - self.inner) / f64::from(PIECES);
        let mut at = Point { rest: self.inner, radius: self.grown, stress: -pressure };
        let mut points = vec![at];
        for _ in 0..PIECES {
            let on = |h: f64, (radius, stress): (f64, f64)| Point {
                rest: at.rest + h,
                radius: at.radius + h * radius,
                stress: at.stress + h * stress,
            };
            at = on(h, self.slope(on(0.5 * h, self.slope(at))));
            points.push(at);
        }
        points
    }

    /// The shell with a free outer face: the pressure by bisection.
    fn solve(&self) -> Vec<Point> {
        let (mut low, mut high) = (0.0, 10.0 * self.material.yield_stress);
        for _ in 0..50 {
            let pressure = 0.5 * (low + high);
            let outside = self.integrate(pressure)[2000].stress;
            *(if outside < 0.0 { &mut high } else { &mut low }) = pressure;
        }
        self.integrate(0.5 * (low + high))
    }
}

/// Mean of the radial stress over the rest volume of what stands between the radii `from` and `to`.
fn mean_stress(points: &[Point], from: f64, to: f64) -> f64 {
    let inside = points.iter().filter(|p| (from..to).contains(&p.radius));
    let (sum, weight) = inside.fold((0.0, 0.0), |(s, w), p| (s + p.stress * p.rest * p.rest, w + p.rest * p.rest));
    sum / weight
}

/// Radial Cauchy stress [Pa] of a particle about the low corner of the room.
fn radial_stress(material: &ClayMaterial, p: &Particle) -> f64 {
    let [xx, yy, zz, xy, xz, yz] = p.elastic_strain.map(f64::from);
    let e = DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz));
    // ln(I + E) / 2 by its series: the elastic strain is a few parts of a hundred, the fifth power below
    // 1e-7.
    let hencky = (e - e * e * 0.5 + e * e * e / 3.0 - e * e * e * e * 0.25) * 0.5;
    let normal = place(p).normalize();
    let trace = hencky.x_axis.x + hencky.y_axis.y + hencky.z_axis.z;
    let tau = 2.0 * material.lame_mu() * normal.dot(hencky * normal) + material.lame_lambda() * trace;
    tau / trace.exp()
}

/// A cavity of 3 cells grows to 6 in an octant of a ball.
pub fn expansion(size: Size) -> Vec<Row> {
    const START: f64 = 3.0;
    const END: f64 = 6.0;
    let outer: f64 = size.pick(16.0, 20.0, 48.0);
    let cells = outer as i32;
    let material = Preset::SoftClay.material();
    // Symmetry at the low walls; beyond the ball there is air.
    let walls = Walls { low: [Wall::Slip; 3], high: [Wall::Separate; 3] };
    let domain = room_with([cells + 4; 3], walls);
    let particles = carved(IVec3::splat(cells), &|x| (START..outer).contains(&x.length()));
    let inner = START;
    let mut lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
    // Growth at rho V^2 / k = 0.002: quasi-static to 1.5 % of the force.
    let speed = (0.002 * material.shear_strength() / material.density).sqrt();
    let frames = 100;
    let steps = ((END - START) * DX / speed / lab.plan.dt / f64::from(frames)).ceil() as u32;
    let time = f64::from(steps) * lab.plan.dt;
    let growth = (END - START) * DX / (f64::from(frames) * time);
    lab.plan.validation.sphere_growth = growth;
    // The slowest wave of the ball rings a few times only.
    lab.plan.validation.damping = 0.5 * material.wave_speed(material.density) / (outer * DX);
    let contact = Contact::Separate { friction: 0.0 };
    let mut health = Health::OK;
    for frame in 0..frames {
        let radius = START + growth * time * f64::from(frame) / DX;
        let ball = Mover::new(&domain, ToolShape::Sphere { radius }, contact, DVec3::ZERO, DQuat::IDENTITY);
        let path = ToolPath::still(1, ball.tool, ball.pose);
        let report = lab.frame_with(steps, &[path]);
        health.insert(report.health);
    }
    let (from, to) = (1.5 * END, 2.0 * END);
    let after = lab.particles();
    let inside: Vec<f64> =
        after.iter().filter(|p| (from..to).contains(&place(p).length())).map(|p| radial_stress(&material, p)).collect();
    let found = inside.iter().sum::<f64>() / inside.len() as f64;
    let exact = mean_stress(&Shell { material, inner, outer, grown: END }.solve(), from, to);
    let value = if health.is_ok() { (found / exact - 1.0).abs() } else { f64::NAN };
    vec![Row::at_most("cavity: radial stress at 1.5 to 2 radii", value, "relative", 0.05)]
}
