//! The strokes and the clay that no tool drives, the ways in which each is integrated, and how far each run
//! is from the reference.

use bevy_clay::sim::planner::STEP_FRACTION;
use bevy_clay::sim::prelude::*;
use clay_acceptance::cases::implicit::{Free, Pace, Pressed, Reference, SAMPLE, Shape, Stroke, Way, frame_travel};
use clay_acceptance::lab::Size;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A step over the planner's own that is still within the limit [-].
const LONG_STEP: f64 = 0.91 / STEP_FRACTION;
/// Inertia numbers of scaled density, `rho_s V^2 / k` [-], the planner's two among them.
const INERTIA: [f64; 8] = [0.0005, 0.001, 0.002, 0.004, 0.0075, 0.015, 0.03, 0.06];
/// Scales of density that the sweep goes through [-].
const SCALES: std::ops::RangeInclusive<f64> = 1.3..=2048.0;
/// Lengths of implicit steps over those of interactive ones [-], and their passes.
const PACES: [(f64, &[u32]); 3] =
    [(1.0, &[6, 8, 10, 12, 15, 20, 30]), (0.5, &[5, 6, 8, 10, 12, 15, 20]), (0.25, &[4, 5, 6, 8, 10, 12])];

/// Scales of density of clay that no tool drives [-].
const FREE_SCALES: [f64; 3] = [4.0, 16.0, 64.0];
/// Implicit steps in a frame of it, and their passes; a flight goes up to 6 cells in one.
const FREE_STEPS: [u32; 3] = [1, 2, 4];
const FLIGHT_STEPS: [u32; 3] = [4, 8, 16];
const FREE_PASSES: [u32; 7] = [3, 4, 6, 8, 10, 15, 20];

/// What is compared: the errors of a stroke, in their order. Of clay that no tool drives the first is of
/// [`Free::measure`].
pub(crate) const ERRORS: [&str; 2] = ["force", "displacements"];

/// One run against the reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Point {
    /// The tool: strip, ball or blade; or what clay does without one.
    pub(crate) tool: Cow<'static, str>,
    /// Its speed [mm/s]; 0 without one.
    pub(crate) speed: f64,
    /// How the run was integrated; travel in cells.
    pub(crate) way: Way,
    /// Passes over the particles in a frame of 1/90 s.
    pub(crate) passes: f64,
    /// Time of one core in a frame \[ms\].
    pub(crate) time: f64,
    /// Errors of the force, or of what else counts, and of the particles' ways [%]; none where a frame was
    /// not sound.
    pub(crate) errors: Option<[f64; 2]>,
    /// What the reference itself may be off by [%], in the same order.
    pub(crate) uncertainty: [f64; 2],
}

/// How a run is integrated, as families of points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// Explicitly at the clay's own density.
    Real,
    /// Explicitly at a greater one.
    Scaled,
    /// Implicitly.
    Implicit,
}

impl Family {
    /// All, in the order of the legend.
    pub(crate) const ALL: [Self; 3] = [Self::Real, Self::Scaled, Self::Implicit];

    /// In text and legend.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Real => "explicit, real density",
            Self::Scaled => "explicit, scaled inertia",
            Self::Implicit => "implicit",
        }
    }
}

impl Point {
    /// Its family.
    pub(crate) fn family(&self) -> Family {
        match self.way {
            Way::Explicit(_) => Family::Real,
            Way::Scaled(_) => Family::Scaled,
            Way::Implicit(_) => Family::Implicit,
        }
    }

    /// Clay that no tool drives, if it is that.
    pub(crate) fn free(&self) -> Option<Free> {
        Free::ALL.into_iter().find(|free| free.name() == self.tool)
    }

    /// The run in the program's output.
    pub(crate) fn line(&self) -> String {
        let first = self.free().map_or(ERRORS[0], Free::measure);
        let errors = self.errors.map_or_else(|| "not sound".into(), |[f, w]| format!("{first} {f:6.2} %  ways {w:6.2} %"));
        let Self { passes, time, .. } = self;
        format!("{:15} {:34} {passes:>8.1} passes {time:>9.2} ms  {errors}", named(&self.tool, self.speed), self.setting())
    }

    /// What it was run with.
    pub(crate) fn setting(&self) -> String {
        match self.way {
            Way::Explicit(part) => format!("explicit, {:.2} of the limit", part * STEP_FRACTION),
            Way::Scaled(scale) => format!("explicit, density x {scale:.1}"),
            Way::Implicit(pace) if self.speed == 0.0 => {
                format!("implicit, {:.0} steps, {} passes", 1.0 / pace.travel, pace.passes)
            }
            Way::Implicit(pace) => format!("implicit, {:.3} cells, {} passes", pace.travel, pace.passes),
        }
    }
}

/// A tool at a speed [mm/s], or what clay does without one.
pub(crate) fn named(tool: &str, speed: f64) -> String {
    if speed == 0.0 { tool.to_owned() } else { format!("{tool}, {speed} mm/s") }
}

/// What is run.
enum Scene {
    /// A tool at a speed.
    Stroke(Stroke),
    /// Clay without one.
    Free(Free),
}

/// A scene in all its ways.
pub(crate) struct Job {
    /// Its name.
    pub(crate) tool: &'static str,
    scene: Scene,
    size: Size,
}

/// Every tool at every speed, and clay without one, in the order of the picture.
pub(crate) fn jobs(size: Size) -> Vec<Job> {
    let (width, radius) = (size.pick(4, 4, 8), size.pick(2.0, 2.0, 4.0));
    let depth = size.pick(1.0, 1.0, 1.2);
    let tools = [("strip", Shape::Strip(width)), ("ball", Shape::Ball(radius)), ("blade", Shape::Blade(width))];
    let speeds: &[f64] = size.pick(&[200.0], &[5.0, 20.0, 100.0, 200.0], &[5.0, 20.0, 100.0, 200.0]);
    let mut jobs = vec![];
    for (tool, shape) in tools {
        for &speed in speeds {
            // Slow strokes take the most time: they go half as deep.
            let depth = if speed < 10.0 { 0.5 * depth } else { depth };
            let (contact, material) = (Contact::default(), Preset::SoftClay.material());
            let stroke = Stroke { shape, contact, material, speed: 1e-3 * speed, depth };
            jobs.push(Job { tool, scene: Scene::Stroke(stroke), size });
        }
    }
    jobs.extend(Free::ALL.map(|free| Job { tool: free.name(), scene: Scene::Free(free), size }));
    jobs
}

impl Job {
    /// Steps of explicit runs over the planner's; the last two are those of a stroke's reference.
    fn parts(&self) -> &'static [f64] {
        if self.size == Size::Test { &[1.0, 0.5] } else { &[LONG_STEP, 1.0, 0.5] }
    }

    /// Runs everything, one after the other so that times are each run's own, and tells of each run.
    pub(crate) fn measure(&self, tell: &mut dyn FnMut(&Point)) -> Vec<Point> {
        let mut points = vec![];
        let mut keep = |point: Point| {
            tell(&point);
            points.push(point);
        };
        match &self.scene {
            Scene::Stroke(stroke) => self.press(stroke, &mut keep),
            Scene::Free(free) => self.let_go(*free, &mut keep),
        }
        points
    }

    fn press(&self, stroke: &Stroke, keep: &mut dyn FnMut(Point)) {
        let runs: Vec<(Way, Pressed)> =
            self.parts().iter().map(|part| Way::Explicit(*part)).map(|way| (way, stroke.press(way))).collect();
        let solid = stroke.solid();
        let last = |i: usize| {
            let (way, run) = &runs[runs.len() - i];
            if solid == *stroke { run.clone() } else { solid.press(*way) }
        };
        let reference = Reference { coarse: last(2), fine: last(1) };
        runs.iter().for_each(|(way, run)| keep(self.pressed(stroke, *way, run, &reference)));
        let scales = scales(stroke).into_iter().map(Way::Scaled);
        for way in scales.chain(paces(stroke, self.size).into_iter().map(Way::Implicit)) {
            keep(self.pressed(stroke, way, &stroke.press(way), &reference));
        }
    }

    fn pressed(&self, stroke: &Stroke, way: Way, run: &Pressed, reference: &Reference) -> Point {
        let depth = stroke.depth;
        let range = [0.1 * depth, depth];
        // Forces over the same parts of the way, however finely a run knows them.
        let forces = if let Way::Explicit(_) = way { run.over(&stroke.parts()) } else { run.forces.clone() };
        let errors = [reference.force_error(&forces, range), reference.way_error(&run.ways)].map(|e| 100.0 * e);
        Point {
            tool: self.tool.into(),
            speed: (1e3 * stroke.speed).round(),
            way,
            passes: run.passes,
            time: run.time,
            errors: Some(errors).filter(|e| run.is_sound && e.iter().all(|e| e.is_finite())),
            uncertainty: reference.uncertainty(&forces, range).map(|e| 100.0 * e),
        }
    }

    fn let_go(&self, free: Free, keep: &mut dyn FnMut(Point)) {
        let reference = free.reference(self.size);
        let uncertainty = reference[1].errors(&reference).map(|e| 100.0 * e);
        let explicit = self.parts().iter().copied().map(Way::Explicit);
        // What flies has no more inertia than its own.
        let scales = FREE_SCALES.into_iter().filter(|_| free != Free::Flight).map(Way::Scaled);
        let pace = |steps: u32| FREE_PASSES.map(|passes| Way::Implicit(Pace { travel: 1.0 / f64::from(steps), passes }));
        for way in explicit.chain(scales).chain(free_steps(free).into_iter().take(self.size.pick(1, 3, 3)).flat_map(pace)) {
            let run = free.run(way, self.size);
            let errors = Some(run.errors(&reference).map(|e| 100.0 * e));
            keep(Point {
                tool: self.tool.into(),
                speed: 0.0,
                way,
                passes: run.passes,
                time: run.time,
                errors: errors.filter(|e| run.is_sound && e.iter().all(|e| e.is_finite())),
                uncertainty,
            });
        }
    }
}

/// Implicit steps in a frame of clay that no tool drives.
pub(crate) fn free_steps(free: Free) -> [u32; 3] {
    if free == Free::Flight { FLIGHT_STEPS } else { FREE_STEPS }
}

/// Densities of explicit runs of a stroke over the clay's own.
fn scales(stroke: &Stroke) -> Vec<f64> {
    let Stroke { material, speed, .. } = stroke;
    let own = material.density * speed * speed / material.shear_strength();
    let scales: Vec<f64> = INERTIA.iter().map(|eta| eta / own).filter(|scale| SCALES.contains(scale)).collect();
    // The planner scales by no more than this, however slow a tool is.
    let most = InertiaScaling::Fast.density_scale(material, *speed);
    let has_most = scales.iter().any(|s| (s / most - 1.0).abs() < 0.01);
    if most > *SCALES.start() && !has_most { scales.into_iter().chain([most]).collect() } else { scales }
}

/// Steps of implicit runs of a stroke: of a frame at most, since each frame has one.
fn paces(stroke: &Stroke, size: Size) -> Vec<Pace> {
    let most = frame_travel(stroke.speed).min(SAMPLE);
    let of = |(part, passes): &(f64, &'static [u32])| {
        let travel = part * most;
        passes.iter().map(move |passes| Pace { travel, passes: *passes }).collect::<Vec<_>>()
    };
    PACES.iter().take(size.pick(1, 3, 3)).flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The planner's own settings are among those of the sweep, at each speed.
    #[test]
    fn sweep_holds_the_planners_settings() {
        for job in jobs(Size::Full) {
            let Scene::Stroke(stroke) = &job.scene else { continue };
            let (material, speed) = (&stroke.material, stroke.speed);
            for inertia in [InertiaScaling::Accurate, InertiaScaling::Fast] {
                let scale = inertia.density_scale(material, speed);
                let is_there = scales(stroke).iter().any(|s| (s / scale - 1.0).abs() < 0.01);
                assert!(is_there || scale < 1.3, "{} at {speed} m/s lacks {scale}", job.tool);
            }
            for accuracy in [StepAccuracy::Interactive, StepAccuracy::Fine] {
                let travel = accuracy.travel().min(frame_travel(speed));
                let is_own = |p: &Pace| (p.travel / travel - 1.0).abs() < 0.02 && p.passes == accuracy.passes();
                assert!(paces(stroke, job.size).iter().any(is_own), "{} at {speed} m/s", job.tool);
            }
        }
    }
}
