//! Strips and balls pressed into clay by implicit steps: force, ways, volume and passes.

use super::compare::Reference;
use super::stroke::{Pace, Pressed, SAMPLE, Shape, Stroke, Way, frame_travel, of_small_cells};
use crate::lab::Size;
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use rayon::prelude::*;

/// What a frame may take, and what has to come of it.
pub struct Budget {
    /// Speed of the tool [m/s].
    pub speed: f64,
    /// How fine the steps are.
    pub pace: Pace,
    /// Passes in a frame, at most.
    pub passes: f64,
    /// Error of the force [%], at most.
    pub force: f64,
    /// Error of the particles' ways [%], at most, if it is judged.
    pub way: Option<f64>,
}

/// One step a 90 Hz frame at 20 mm/s, and steps as long at 100 mm/s; then half of them.
pub const BUDGETS: [Budget; 4] = [
    Budget { speed: 0.02, pace: Pace { travel: SAMPLE, passes: 15 }, passes: 15.0, force: 3.0, way: None },
    Budget { speed: 0.02, pace: Pace { travel: 0.5 * SAMPLE, passes: 12 }, passes: 25.0, force: 2.5, way: Some(3.0) },
    Budget { speed: 0.1, pace: Pace { travel: SAMPLE, passes: 12 }, passes: 60.0, force: 3.0, way: None },
    Budget { speed: 0.1, pace: Pace { travel: 0.5 * SAMPLE, passes: 12 }, passes: 120.0, force: 2.5, way: Some(3.0) },
];

/// The same of a blade.
const BLADE_BUDGETS: [Budget; 2] = [
    Budget { speed: 0.02, pace: Pace { travel: 0.5 * SAMPLE, passes: 15 }, passes: 30.0, force: 3.0, way: None },
    Budget { speed: 0.1, pace: Pace { travel: 0.5 * SAMPLE, passes: 12 }, passes: 120.0, force: 3.0, way: None },
];

/// Greatest change of the clay's volume off that of the reference [%], at most.
const SWELLING: f64 = 0.5;
/// Jitter of the force from frame to frame [%], at most.
const JITTER: f64 = 3.0;

/// A row that is judged only where the reference is three times as good as the limit.
fn judged(case: String, value: f64, limit: f64, uncertainty: f64) -> Row {
    if 3.0 * uncertainty > limit { Row::figure(case, value, "%") } else { Row::at_most(case, value, "%", limit) }
}

/// A stroke by its budgets.
struct Job {
    name: String,
    stroke: Stroke,
    /// Part of the way on which the force is judged \[cells\].
    range: [f64; 2],
    budgets: Vec<&'static Budget>,
    /// Whether its errors have limits, or are told only.
    is_judged: bool,
}

impl Job {
    fn rows(&self) -> Vec<Row> {
        let run = |budget: &&Budget| self.stroke.press(Way::Implicit(budget.pace));
        let (reference, runs) =
            rayon::join(|| Reference::new(&self.stroke), || self.budgets.par_iter().map(run).collect::<Vec<_>>());
        let mut rows = vec![];
        let own = reference.uncertainty(&runs[0].forces, self.range).map(|e| 100.0 * e);
        for (what, own) in ["force", "ways"].iter().zip(own) {
            rows.push(Row::figure(format!("{}: the reference's own error of {what}", self.name), own, "%"));
        }
        for (budget, run) in self.budgets.iter().zip(&runs) {
            rows.extend(self.rows_of(budget, run, &reference, own));
        }
        rows
    }

    fn rows_of(&self, budget: &Budget, run: &Pressed, reference: &Reference, own: [f64; 2]) -> Vec<Row> {
        let name = format!("{}, {} passes a frame", self.name, budget.passes);
        // A frame that went wrong is no answer.
        let percent = |value: f64| if run.is_sound { 100.0 * value } else { f64::NAN };
        let force = percent(reference.force_error(&run.forces, self.range));
        let way = percent(reference.way_error(&run.ways));
        let (force_name, way_name) = (format!("{name}: force off by"), format!("{name}: ways off by"));
        let mut rows = vec![Row::at_most(format!("{name}: taken"), run.passes, "passes", budget.passes)];
        if self.is_judged {
            rows.push(judged(force_name, force, budget.force, own[0]));
        } else {
            rows.push(Row::figure(force_name, force, "%"));
        }
        rows.push(match budget.way.filter(|_| self.is_judged) {
            Some(limit) => judged(way_name, way, limit, own[1]),
            None => Row::figure(way_name, way, "%"),
        });
        // Clay that is pressed gives way in volume too.
        let volume = percent((run.swelling - reference.fine.swelling).abs());
        rows.push(Row::at_most(format!("{name}: volume off by"), volume, "%", SWELLING));
        // Of frames: at higher speeds they are few.
        if frame_travel(self.stroke.speed) <= SAMPLE {
            let [own, of_reference, beside] = reference.jitters(&run.forces, self.range).map(percent);
            rows.push(Row::at_most(format!("{name}: jitter of the force"), own, "%", JITTER));
            rows.push(Row::figure(format!("{name}: jitter of the reference's force"), of_reference, "%"));
            rows.push(Row::figure(format!("{name}: jitter of the force less the reference's"), beside, "%"));
        }
        rows
    }
}

/// The budgets at `speed` [m/s].
fn budgets(speed: f64) -> Vec<&'static Budget> {
    BUDGETS.iter().filter(|b| b.speed == speed).collect()
}

/// The tool of a case and how deep it goes \[cells\]: strips and blades to half their width, a ball to half
/// its radius.
fn tool(shape: Shape, size: Size) -> (&'static str, f64) {
    match shape {
        Shape::Strip(width) => ("strip", size.pick(0.15, 0.15, 0.5) * f64::from(width)),
        Shape::Ball(radius) => ("ball", size.pick(0.3, 0.3, 0.5) * radius),
        Shape::Blade(width) => ("blade", size.pick(0.3, 0.3, 0.5) * f64::from(width)),
    }
}

/// Soft clay under a tool, with friction and sticking, slowly and fast.
fn soft(shape: Shape, size: Size) -> Vec<Row> {
    let (name, depth) = tool(shape, size);
    let speeds: &[f64] = size.pick(&[0.1], &[0.1], &[0.02, 0.1]);
    let contacts = [("friction 0.3", Contact::default()), ("stick", Contact::Stick)];
    let mut jobs = vec![];
    for (contact_name, contact) in &contacts[..size.pick(1, 1, 2)] {
        for &speed in speeds {
            let material = Preset::SoftClay.material();
            jobs.push(Job {
                name: format!("{name}, {contact_name}, {} mm/s", 1e3 * speed),
                stroke: Stroke { shape, contact: *contact, material, speed, depth },
                range: [0.1 * depth, depth],
                budgets: budgets(speed),
                is_judged: true,
            });
        }
    }
    jobs.par_iter().flat_map_iter(Job::rows).collect()
}

/// A strip in plane strain.
pub fn strips(size: Size) -> Vec<Row> {
    soft(Shape::Strip(size.pick(4, 8, 8)), size)
}

/// A ball.
pub fn balls(size: Size) -> Vec<Row> {
    soft(Shape::Ball(size.pick(2.0, 4.0, 4.0)), size)
}

/// A blade that goes flat into clay, which closes over it: against the explicit step, whose blades hold
/// nodes, and against a strip as wide, which goes into the clay as it does.
pub fn blades(size: Size) -> Vec<Row> {
    let shape = Shape::Blade(size.pick(4, 4, 8));
    let (name, depth) = tool(shape, size);
    let (contact, material) = (Contact::default(), Preset::SoftClay.material());
    let job = |budget: &'static Budget| Job {
        name: format!("{name}, friction 0.3, {} mm/s", 1e3 * budget.speed),
        stroke: Stroke { shape, contact, material, speed: budget.speed, depth },
        range: [0.1 * depth, depth],
        budgets: vec![budget],
        is_judged: true,
    };
    let [slow, fast] = &BLADE_BUDGETS;
    let jobs: Vec<Job> = size.pick(vec![fast], vec![fast], vec![slow, fast]).into_iter().map(job).collect();
    let rows: Vec<Row> = jobs.par_iter().flat_map_iter(Job::rows).collect();
    rows.into_iter().chain(jobs.iter().map(beside_strip)).collect()
}

/// The force on a blade against that on a strip of its width.
fn beside_strip(job: &Job) -> Row {
    let (stroke, budget) = (&job.stroke, job.budgets[0]);
    let (strip, blade) = rayon::join(|| Reference::new(&stroke.solid()), || stroke.press(Way::Implicit(budget.pace)));
    // Clay reaches out to a strip by half a particle, and not to a blade: until that is made up for they
    // differ.
    let range = [0.25 * stroke.depth, stroke.depth];
    let own = 100.0 * strip.uncertainty(&blade.forces, range)[0];
    let off = if blade.is_sound { 100.0 * strip.force_error(&blade.forces, range) } else { f64::NAN };
    judged(format!("{}, {} passes a frame: force off that on a strip by", job.name, budget.passes), off, budget.force, own)
}

/// Clays other than soft clay: whether their errors have limits.
fn clays(size: Size) -> Vec<(String, ClayMaterial, bool)> {
    let soft = Preset::SoftClay.material();
    let presets: &[Preset] = size.pick(&[Preset::Plasticine], &[Preset::Plasticine], &Preset::ALL[1..]);
    let mut clays: Vec<_> = presets.iter().map(|p| (p.name().to_owned(), of_small_cells(p.material()), true)).collect();
    if size == Size::Full {
        clays.push(("hardening".into(), ClayMaterial { hardening_modulus: 10.0 * soft.yield_stress, ..soft }, true));
        clays.push(("nu 0.49".into(), ClayMaterial { poisson_ratio: 0.49, ..soft }, false));
        clays.push(("E / yield 500".into(), ClayMaterial { young_modulus: 500.0 * soft.yield_stress, ..soft }, false));
    }
    clays
}

/// A strip in clays that harden, creep, and hardly change volume.
pub fn presets(size: Size) -> Vec<Row> {
    let width = size.pick(4, 4, 8);
    let depth = 0.25 * f64::from(width);
    let speed = 0.1;
    let job = |(name, material, is_judged)| Job {
        name: format!("strip, {name}"),
        stroke: Stroke { shape: Shape::Strip(width), contact: Contact::default(), material, speed, depth },
        range: [0.1 * depth, depth],
        budgets: budgets(speed).into_iter().take(size.pick(1, 1, 2)).collect(),
        is_judged,
    };
    let jobs: Vec<Job> = clays(size).into_iter().map(job).collect();
    jobs.par_iter().flat_map_iter(Job::rows).collect()
}
