//! Inputs that validation cases need and an application must not use: damping, clamped walls, a growing ball,
//! a manufactured solution's body force, and nodes that follow an affine motion.

use super::material::ClayMaterial;
use super::tool::ToolShape;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// What a validation case asks of a frame beyond the plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Validation {
    /// Decay rate of node velocities [1/s]: finds equilibria.
    pub damping: f64,
    /// Wall nodes and those behind lose their normal (stick: every; separate: only that into the wall)
    /// velocity in place of reflection: the negative control, first order at best.
    pub clamped_walls: bool,
    /// Speed at which the radius of every ball tool grows from the frame's start [m/s].
    pub sphere_growth: f64,
    /// Body force of a manufactured solution.
    pub manufactured: Option<Manufactured>,
    /// Nodes that follow an affine motion.
    pub affine_drive: Option<AffineDrive>,
}

impl Validation {
    /// The first input beyond damping that is in use, by name: an engine that has only damping refuses it.
    pub fn input_beyond_damping(&self) -> Option<&'static str> {
        let inputs = [
            (self.clamped_walls, "clamped_walls"),
            (self.sphere_growth != 0.0, "sphere_growth"),
            (self.manufactured.is_some(), "manufactured"),
            (self.affine_drive.is_some(), "affine_drive"),
        ];
        inputs.into_iter().find_map(|(is_used, name)| is_used.then_some(name))
    }

    /// A tool's shape at `time` \[s\] of the frame: a ball has grown.
    pub(super) fn grown(&self, shape: ToolShape, time: f64) -> ToolShape {
        shape.grown_ball(self.sphere_growth * time).unwrap_or(shape)
    }
}

/// Nodes outside a box move at `gradient (x - about)`: homogeneous deformation through the whole step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AffineDrive {
    /// Velocity gradient [1/s].
    pub gradient: DMat3,
    /// Where the velocity is 0 \[m\].
    pub about: DVec3,
    /// Corners of the box inside which nodes are free \[m\]; an empty box drives every node.
    pub free: [DVec3; 2],
}

impl AffineDrive {
    /// The velocity [m/s] forced on a node at `x` \[m\], if it is driven.
    pub fn velocity_at(&self, x: DVec3) -> Option<DVec3> {
        let is_free = x.cmpgt(self.free[0]).all() && x.cmplt(self.free[1]).all();
        (!is_free).then(|| self.gradient * (x - self.about))
    }
}

/// The manufactured solution `u_i = A_i L sin(pi X_i / L) sin(omega t + phi_i)`, `omega = pi c / L`, in a box
/// of edge L between slip walls, for Hencky's law (after Wallstedt and Guilkey 2008, who take a neo-Hookean
/// one). X is the place at rest, from the box's low corner. Along an axis of amplitude 0 nothing moves, and
/// the box may have any width.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manufactured {
    /// Amplitudes A over L of the axes [-], below 1 / pi.
    pub amplitudes: DVec3,
    /// Edge L of the box \[m\].
    pub length: f64,
    /// Its low corner \[m\].
    pub low: DVec3,
    /// Phases phi of the axes \[rad\].
    pub phases: DVec3,
    /// Time t at the frame's start \[s\].
    pub time: f64,
}

impl Manufactured {
    /// Angular frequency omega [rad/s].
    pub fn frequency(&self, material: &ClayMaterial) -> f64 {
        PI * material.wave_speed(material.density) / self.length
    }

    /// Displacement u \[m\] and velocity [m/s] at time `t` \[s\] of the clay that rests at `rest` \[m\] from the
    /// low corner.
    pub fn motion(&self, material: &ClayMaterial, rest: DVec3, t: f64) -> (DVec3, DVec3) {
        let omega = self.frequency(material);
        let shape = (rest * (PI / self.length)).map(f64::sin) * self.amplitudes * self.length;
        let phase = self.phases + omega * t;
        (shape * phase.map(f64::sin), shape * phase.map(f64::cos) * omega)
    }

    /// Principal stretches [-] along the axes.
    pub fn stretches(&self, material: &ClayMaterial, rest: DVec3, t: f64) -> DVec3 {
        let phase = self.phases + self.frequency(material) * t;
        DVec3::ONE + PI * self.amplitudes * (rest * (PI / self.length)).map(f64::cos) * phase.map(f64::sin)
    }

    /// Where the clay at `x` \[m\] of time `t` \[s\] rests, from the low corner \[m\].
    pub fn rest_place(&self, material: &ClayMaterial, x: DVec3, t: f64) -> DVec3 {
        let place = x - self.low;
        let mut rest = place;
        // Newton's method on `X + u(X) = x`: the map's slope is a stretch, between 1 - A pi and 1 + A pi. An
        // error of 1e-8 is squared by its step.
        for _ in 0..50 {
            let error = rest + self.motion(material, rest, t).0 - place;
            rest -= error / self.stretches(material, rest, t);
            if error.abs().max_element() < 1e-8 * self.length {
                break;
            }
        }
        rest
    }

    /// Body acceleration [m/s^2] at `x` \[m\] and time `t` \[s\]: `b = u'' - Div P / rho` with
    /// `P_ii = tau_i / l_i`.
    pub fn acceleration(&self, material: &ClayMaterial, x: DVec3, t: f64) -> DVec3 {
        let rest = self.rest_place(material, x, t);
        let (u, _) = self.motion(material, rest, t);
        let stretch = self.stretches(material, rest, t);
        let log = stretch.map(f64::ln);
        let (mu2, lambda) = (2.0 * material.lame_mu(), material.lame_lambda());
        let tau = mu2 * log + lambda * log.element_sum();
        // d l_i / d X_i.
        let bend = u * -(PI / self.length).powi(2);
        let divergence = bend / (stretch * stretch) * (mu2 + lambda - tau);
        -self.frequency(material).powi(2) * u - divergence / material.density
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The body force against differences of the closed form: `rho u'' = Div P + rho b`.
    #[test]
    fn manufactured_force_balances_momentum() {
        let material = ClayMaterial { yield_stress: f64::INFINITY, ..ClayMaterial::default() };
        let (low, phases) = (DVec3::new(0.3, -0.1, 0.2), DVec3::new(0.0, 1.0, 2.2));
        let case = Manufactured { amplitudes: DVec3::new(0.1, 0.05, 0.1), length: 0.4, low, phases, time: 0.0 };
        let t = 0.37 / case.frequency(&material);
        let rest = DVec3::new(0.11, 0.23, 0.31);
        let stress = |rest: DVec3, axis: usize| {
            let l = case.stretches(&material, rest, t);
            let log = l.map(f64::ln);
            (2.0 * material.lame_mu() * log[axis] + material.lame_lambda() * log.element_sum()) / l[axis]
        };
        let (h, k) = (1e-5, 1e-7);
        let at = |t: f64| case.motion(&material, rest, t).0;
        let acceleration = (at(t + k) - 2.0 * at(t) + at(t - k)) / (k * k);
        let force = case.acceleration(&material, low + rest + at(t), t);
        for axis in 0..3 {
            let step = DVec3::AXES[axis] * h;
            let divergence = (stress(rest + step, axis) - stress(rest - step, axis)) / (2.0 * h);
            let error = acceleration[axis] - divergence / material.density - force[axis];
            assert!(error.abs() < 1e-4 * force.length(), "{axis}: {error} of {force}");
        }
        assert!((case.rest_place(&material, low + rest + at(t), t) - rest).length() < 1e-14);
    }
}
