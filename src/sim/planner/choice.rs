//! Which integrator a frame is planned with.

use super::super::cut::SheetSet;
use super::super::frame::{FramePlan, FrameReport};
use super::super::implicit::IDLE_GRAVITY;
use super::super::material::ClayMaterial;
use super::super::params::Walls;
use super::super::snapshot::Snapshot;
use super::super::support::{bearing_walls, pieces};
use super::implicit::REFINEMENT_MAX;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Speed of clay [cells/s] from which on it may count as in flight: slower is creep, or noise.
const FLIGHT_SPEED: f64 = 1.0;
/// Forces out of balance over those that clay bears [-] beyond which an implicit frame is poor: the next has
/// more steps. A ball that was pressed in at once and held bears 4 % less than in explicit steps where frames
/// beyond 0.4 are refined, and 34 % less where those beyond 1 are.
pub const RESIDUAL_MAX: f64 = 0.4;
/// The same below which it had steps enough for the next to have half as many: what is left out of balance
/// grows with the root of a step's length or so, from 0.25 to 0.36 about a ball dragged at 0.2 cells a step.
const RESIDUAL_MIN: f64 = 0.65 * RESIDUAL_MAX;
/// The same of clay with cuts or in pieces, whose faces' forces on each other are no part of what is out of
/// balance: with 0.65 a cut that plates close bore 0.042 k of what it should not, with this 0.011.
const RESIDUAL_MIN_PARTED: f64 = 0.5 * RESIDUAL_MAX;

/// What is left out of balance at a node over a cell's face of the clay's strength k [-], beyond which a
/// frame is poor where no tool touches clay and it hardly moves. By weight alone, of which a cell of 2 mm of
/// soft clay has 0.7 % of that, the stresses that a blade had left took 300 to 480 passes a frame.
const STRESS_MAX: f64 = 0.01;

/// Least mass [full cells] that implicit steps are short enough to follow: that of a full particle. Of what
/// is lighter, the rim of clay that a blade has left, single nodes swing for a dozen frames, at .3 m/s with
/// all the energy that a cell has at 7 mm/s: by their speed a frame had 24 steps.
const FOLLOWED_MASS: f64 = 0.125;

/// Kinetic over elastic energy [-] below which clay hardly moves: 5e-6 and less once a blade has left it,
/// 1e-3 about one that comes out.
const STILL_RATIO_MAX: f64 = 1e-3;

/// Kinetic over elastic energy [-] up to which clay that a tool moves, and walls bear, is led by it: 0.005
/// about a ball dragged at 50 mm/s, 1 to 7 of a column that topples beside one, from the first frame on.
const LED_RATIO_MAX: f64 = 0.05;

/// Which integrator frames are planned with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum IntegratorChoice {
    /// Explicit steps: every engine knows them.
    Explicit,
    /// Implicit ones under tools and where clay rests; explicit ones where no tool touches clay and some of
    /// it falls or has more energy in its motion than in its strain (implicit steps would have to be short),
    /// where a tool stops so sharply that the clay's inertia takes a part of its force, and where they are no
    /// more than the passes of the implicit ones. Only the native engine knows both.
    #[default]
    Auto,
    /// Implicit ones, whatever clay does.
    Implicit,
}

/// What the frames before say of the choice.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Course {
    /// Whether clay flew in frames n and n - 1, by the parity of their ids; none before they were reported.
    flies: [Option<bool>; 2],
    /// The walls at each [piece](pieces) of clay, as it was at first.
    #[serde(default)]
    pieces: Vec<u32>,
    /// Whether tools led all that moved in these frames.
    #[serde(default)]
    is_led: [bool; 2],
    /// How many times as many steps as travel asks for these frames had, or would have had; 0 is once.
    refinement: [u32; 2],
    /// Whether the clay stood at their ends.
    stands: [bool; 2],
    /// Of the frame before: what would wake clay that stands.
    given: Option<(ClayMaterial, DVec3)>,
    /// The first frame that was given this.
    since: u64,
}

impl Course {
    /// Of clay as it stands in `snapshot`.
    pub(super) fn new(snapshot: &Snapshot) -> Self {
        let speed_min = FLIGHT_SPEED * snapshot.domain.cell_width;
        let is_fast = snapshot.particles.iter().any(|p| DVec3::from_array(p.velocity.map(f64::from)).length() > speed_min);
        Self { flies: [is_fast.then_some(true); 2], pieces: pieces(snapshot), ..Self::default() }
    }

    /// Whether clay is in flight, as frame `slot` had it; at first what no wall bears, under `gravity`.
    pub(super) fn flies(&self, slot: usize, walls: &Walls, gravity: DVec3) -> bool {
        let bearing = bearing_walls(walls, gravity);
        let falls = || gravity != DVec3::ZERO && self.pieces.iter().any(|walls| walls & bearing == 0);
        self.flies[slot].unwrap_or_else(falls)
    }

    /// Whether what moved in frame `slot` was led by tools, and does not fall.
    pub(super) fn is_led(&self, slot: usize) -> bool {
        self.is_led[slot]
    }

    /// How many times as many steps as travel asks for the next frame of `slot` has.
    pub(super) fn refinement(&self, slot: usize) -> u32 {
        self.refinement[slot].max(1)
    }

    /// Whether frame `plan`, of `slot`, finds clay that stood two frames before, and what could wake it but
    /// tools is as it was.
    pub(super) fn may_rest(&mut self, slot: usize, plan: &FramePlan) -> bool {
        let given = Some((plan.material, plan.gravity));
        if self.given != given {
            (self.given, self.since) = (given, plan.id);
        }
        self.stands[slot] && self.since + 2 <= plan.id
    }

    /// Takes what a report says.
    pub(super) fn note(&mut self, slot: usize, report: &FrameReport, cell_width: f64) {
        let speed = report.speed(cell_width) / cell_width;
        let is_touched = report.tools.iter().any(|t| t.contacts > 0);
        let is_fast = speed > FLIGHT_SPEED && report.kinetic_ratio() > 1.0;
        // What hangs on nothing falls, unless there is no gravity.
        let has_gravity = self.given.is_none_or(|(_, gravity)| gravity != DVec3::ZERO);
        self.flies[slot] = Some(!is_touched && (is_fast || has_gravity && report.has_loose_clay == Some(true)));
        self.is_led[slot] = report.is_engaged() && report.kinetic_ratio() <= LED_RATIO_MAX;
        self.stands[slot] = report.is_standing;
        if report.passes > 0 {
            let now = self.refinement(slot);
            let is_parted = report.body_max > 0 || report.sheets != SheetSet::default();
            let enough = if is_parted { RESIDUAL_MIN_PARTED } else { RESIDUAL_MIN };
            let residual = if is_touched { report.residual } else { self.residual_untouched(report, cell_width) };
            self.refinement[slot] = if residual > RESIDUAL_MAX || report.redone > 0 {
                (2 * now).min(REFINEMENT_MAX)
            } else if residual < enough {
                now / 2
            } else {
                now
            };
        }
    }

    /// Speed [m/s] at which [`FOLLOWED_MASS`] has all the energy of motion that a frame ended with.
    pub(super) fn speed_followed(&self, report: &FrameReport, cell_width: f64) -> f64 {
        let Some((material, _)) = self.given else { return f64::INFINITY };
        (2.0 * report.energies.kinetic / (FOLLOWED_MASS * material.density * cell_width.powi(3))).sqrt()
    }

    /// What is left out of balance in clay that no tool touches [-]: where it hardly moves by weight or by
    /// strength, whichever is less.
    fn residual_untouched(&self, report: &FrameReport, cell_width: f64) -> f64 {
        let Some((material, gravity)) = self.given.filter(|_| report.kinetic_ratio() < STILL_RATIO_MAX) else {
            return report.residual;
        };
        let weight = material.density * gravity.length().max(IDLE_GRAVITY) * cell_width / material.shear_strength();
        report.residual * (weight * RESIDUAL_MAX / STRESS_MAX).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::frame::{Energies, ToolReport};
    use super::super::super::integrator::Integrator;
    use super::super::super::material::Preset;
    use super::super::super::params::{Domain, Walls};
    use super::super::super::snapshot::{Particle, Snapshot};
    use super::super::super::tool::{Contact, Pose, PoseSample, Tool, ToolPath, ToolShape};
    use super::super::{Decision, Planner, Policy};
    use super::*;

    const FRAME: f64 = 1.0 / 60.0;

    /// A planner of clay in cells of 2 mm.
    fn planner(integrator: IntegratorChoice) -> Planner {
        let domain = Domain::new(DVec3::ZERO, DVec3::ONE, 0.002, Walls::default()).expect("a room");
        let mut planner = Planner::new(&Snapshot::new(domain, Preset::SoftClay.material(), vec![]));
        planner.policy = Policy { integrator, ..Policy::default() };
        planner
    }

    /// Plans a frame and reports it as `change` has it.
    fn run(planner: &mut Planner, change: &dyn Fn(&mut FrameReport)) -> FramePlan {
        let Decision::Run(plan) = planner.frame(&Preset::SoftClay.material(), FRAME, &[]) else { panic!("a frame is owed") };
        planner.sent();
        let is_implicit = matches!(plan.integrator, Integrator::Implicit { .. });
        let mut report = FrameReport { steps: plan.steps, passes: 10 * u32::from(is_implicit), ..FrameReport::new(&plan) };
        change(&mut report);
        planner.note(&mut report);
        plan
    }

    fn is_implicit(plan: &FramePlan) -> bool {
        matches!(plan.integrator, Integrator::Implicit { .. })
    }

    /// Clay at 1 m/s, with more energy in its motion than in its strain.
    fn flying(report: &mut FrameReport) {
        report.speed_max = 500.0 * report.dt;
        report.energies = Energies { kinetic: 1.0, elastic: 0.1 };
    }

    /// A frame in which a tool stops sharply is explicit, and so is one before which it did; with a wall time
    /// to keep only where tools are known to touch clay.
    #[test]
    fn sharp_stops_are_explicit() {
        let tool = Tool { shape: ToolShape::Sphere { radius: 0.01 }, contact: Contact::default() };
        let at = |y: f64| Pose { position: DVec3::Y * y, ..Pose::default() };
        let path = |ys: &[f64], part: f64| {
            let sample = |(i, y): (usize, &f64)| PoseSample { time: [0.0, part, 1.0][i] * FRAME, pose: at(*y) };
            ToolPath { id: 1, tool, sheet: 0, samples: ys.iter().enumerate().map(sample).collect() }
        };
        let [moves, stops, stands] = [[0.005, 0.0025, 0.0], [0.005, 0.0, 0.0], [0.0; 3]].map(|ys| path(&ys, 0.5));
        let course = |wall: Option<f64>, is_engaged: bool, paths: &[&ToolPath]| {
            let mut auto = planner(IntegratorChoice::Auto);
            auto.policy.wall = wall;
            let mut frame = |path: Option<&ToolPath>| {
                let paths: Vec<ToolPath> = path.cloned().into_iter().collect();
                let Decision::Run(plan) = auto.frame(&Preset::SoftClay.material(), FRAME, &paths) else { panic!("a frame") };
                auto.sent();
                let mut report = FrameReport { steps: plan.steps, passes: 10, ..FrameReport::new(&plan) };
                if is_engaged {
                    (report.has_loose_clay, report.wall_impulse) = (Some(false), DVec3::Y);
                    report.tools = vec![ToolReport { contacts: 1, ..ToolReport::default() }];
                }
                auto.note(&mut report);
                is_implicit(&plan)
            };
            let begun = (0..2).map(|_| None).chain(paths.iter().copied().map(Some));
            begun.map(&mut frame).skip(2).collect::<Vec<_>>()
        };
        assert_eq!(course(None, false, &[&moves, &moves, &stands, &stands]), [true, true, false, true]);
        assert_eq!(course(None, false, &[&moves, &stops, &stands]), [true, false, true]);
        assert_eq!(course(Some(0.02), false, &[&moves, &stops, &stands]), [true; 3]);
        assert_eq!(course(Some(0.02), true, &[&moves, &stops, &stands]), [true, false, true]);
    }

    /// Clay that rests gets implicit steps; what flies, or hangs on nothing under gravity, explicit ones, two
    /// frames later, unless a tool touches it or the app wants it otherwise.
    #[test]
    fn flight_is_explicit() {
        let mut auto = planner(IntegratorChoice::Auto);
        assert!((0..2).all(|_| is_implicit(&run(&mut auto, &|_| {}))));
        assert!(is_implicit(&run(&mut auto, &flying)) && is_implicit(&run(&mut auto, &|_| {})));
        assert!(!is_implicit(&run(&mut auto, &|_| {})) && is_implicit(&run(&mut auto, &|_| {})));
        let hanging = |report: &mut FrameReport| report.has_loose_clay = Some(true);
        assert!((0..2).all(|_| is_implicit(&run(&mut auto, &hanging))));
        assert!((0..2).all(|_| !is_implicit(&run(&mut auto, &|_| {}))));
        auto.policy.gravity = DVec3::ZERO;
        assert!((0..4).all(|_| is_implicit(&run(&mut auto, &hanging))));
        auto.policy.gravity = Policy::default().gravity;
        let touched = |report: &mut FrameReport| {
            flying(report);
            report.tools = vec![ToolReport { contacts: 1, ..ToolReport::default() }];
        };
        assert!((0..4).all(|_| is_implicit(&run(&mut auto, &touched))));
        let mut implicit = planner(IntegratorChoice::Implicit);
        assert!((0..4).all(|_| is_implicit(&run(&mut implicit, &flying))));
        let mut explicit = planner(IntegratorChoice::Explicit);
        assert!((0..4).all(|_| !is_implicit(&run(&mut explicit, &|_| {}))));
    }

    /// At first clay flies that no wall bears, or that comes with a speed.
    #[test]
    fn clay_flies_at_first_as_it_stands() {
        let is_implicit_at_first = |height: f64, speed: f32, gravity: DVec3| {
            let domain = Domain::new(DVec3::ZERO, DVec3::ONE, 0.002, Walls::default()).expect("a room");
            let particle = Particle::at(domain.to_grid(DVec3::new(0.5, height, 0.5)), 1e-9, 0);
            let particle = Particle { velocity: [speed, 0.0, 0.0], ..particle };
            let mut planner = Planner::new(&Snapshot::new(domain, Preset::SoftClay.material(), vec![particle]));
            planner.policy.gravity = gravity;
            is_implicit(&run(&mut planner, &|_| {}))
        };
        let gravity = Policy::default().gravity;
        assert!(is_implicit_at_first(0.0005, 0.001, gravity) && is_implicit_at_first(0.1, 0.0, DVec3::ZERO));
        assert!(!is_implicit_at_first(0.1, 0.0, gravity) && !is_implicit_at_first(0.0005, 0.01, gravity));
    }

    /// Clay that a tool leads while walls bear it does not fall: what gravity would add to its speed asks for
    /// no steps. What topples falls.
    #[test]
    fn what_tools_lead_does_not_fall() {
        let steps = |contacts: u64, has_loose_clay: bool, kinetic: f64| {
            let mut planner = planner(IntegratorChoice::Implicit);
            let moved = move |report: &mut FrameReport| {
                report.speed_max = 50.0 * report.dt;
                report.tools = vec![ToolReport { contacts, ..ToolReport::default() }];
                (report.wall_impulse, report.has_loose_clay) = (DVec3::Y, Some(has_loose_clay));
                report.energies = Energies { kinetic, elastic: 1.0 };
            };
            (0..4).map(|_| run(&mut planner, &moved).steps).last()
        };
        assert_eq!(steps(1, false, 0.01), Some(2));
        assert_eq!([steps(0, false, 0.01), steps(1, true, 0.01), steps(1, false, 0.1)], [Some(5); 3]);
    }

    /// Where frames are as short as the engine affords, what was taken for a short one is not held against
    /// implicit steps; where they are as long as a scene has them, explicit ones may be the fewer.
    #[test]
    fn short_frames_are_explicit_only_where_that_is_cheaper() {
        let short = |wall| {
            let mut planner = planner(IntegratorChoice::Auto);
            planner.policy.wall = wall;
            let plans = (0..4).map(|_| {
                let Decision::Run(plan) = planner.frame(&Preset::SoftClay.material(), 1e-4, &[]) else { panic!("a frame") };
                planner.sent();
                planner.note(&mut FrameReport { steps: plan.steps, ..FrameReport::new(&plan) });
                plan
            });
            plans.map(|plan| is_implicit(&plan)).collect::<Vec<_>>()
        };
        assert_eq!(short(None), [false; 4]);
        assert_eq!(short(Some(0.02)), [true; 4]);
    }

    /// Where forces are left out of balance, the frame two later has more steps; fewer again where they are
    /// not.
    #[test]
    fn poor_frames_are_refined() {
        let mut planner = planner(IntegratorChoice::Implicit);
        let touched = || vec![ToolReport { contacts: 1, ..ToolReport::default() }];
        let residual = |residual| move |report: &mut FrameReport| (report.residual, report.tools) = (residual, touched());
        let poor: Vec<u32> = (0..8).map(|_| run(&mut planner, &residual(2.0 * RESIDUAL_MAX)).steps).collect();
        assert_eq!(poor, [1, 1, 2, 2, 4, 4, 4, 4]);
        let good: Vec<u32> = (0..8).map(|_| run(&mut planner, &residual(0.1 * RESIDUAL_MAX)).steps).collect();
        assert_eq!(good, [4, 4, 2, 2, 1, 1, 1, 1]);
        // What would be poor with half as many steps keeps them.
        let mut fairly = |of: f64| run(&mut planner, &residual(of * RESIDUAL_MAX)).steps;
        let fair: Vec<u32> = [2.0, 2.0, 0.75, 0.75, 0.75, 0.75, 0.6, 0.6, 0.9, 0.9].map(&mut fairly).to_vec();
        assert_eq!(fair, [1, 1, 2, 2, 2, 2, 2, 2, 1, 1]);
        // So do pieces of clay with somewhat less.
        let part = |of: f64| {
            move |report: &mut FrameReport| {
                residual(of * RESIDUAL_MAX)(report);
                report.body_max = 1;
            }
        };
        let parted: Vec<u32> = [2.0, 2.0, 0.6, 0.6, 0.4, 0.4, 0.9, 0.9].map(|of| run(&mut planner, &part(of)).steps).to_vec();
        assert_eq!(parted, [1, 1, 2, 2, 2, 2, 1, 1]);
    }

    /// Clay that no tool touches and that hardly moves is poor where more than a hundredth of its strength is
    /// out of balance, however little it weighs; what moves, falls into tools or has no strength beside its
    /// weight is poor by that.
    #[test]
    fn untouched_clay_is_judged_by_its_strength() {
        let still = Energies { kinetic: 1e-4, elastic: 1.0 };
        // Of soft clay in cells of 2 mm a cell's weight is .72 % of k.
        let refined = |residual: f64, energies: Energies, contacts: u64, material: Preset| {
            let mut planner = planner(IntegratorChoice::Implicit);
            let mut frame = || {
                let Decision::Run(plan) = planner.frame(&material.material(), FRAME, &[]) else { panic!("a frame is owed") };
                planner.sent();
                let tools = vec![ToolReport { contacts, ..ToolReport::default() }];
                let mut report = FrameReport { steps: 1, passes: 15, residual, energies, tools, ..FrameReport::new(&plan) };
                planner.note(&mut report);
                plan.steps
            };
            (0..3).map(|_| frame()).last() > Some(1)
        };
        let soft = Preset::SoftClay;
        assert!(!refined(1.3, still, 0, soft) && refined(1.5, still, 0, soft));
        assert!(refined(1.3, still, 1, soft), "a tool touches it");
        assert!(refined(1.3, Energies { kinetic: 0.1, ..still }, 0, soft), "it moves");
    }

    /// What is lighter than a full particle asks for no shorter steps, however fast it is.
    #[test]
    fn steps_follow_what_has_mass() {
        let mut planner = planner(IntegratorChoice::Implicit);
        // So much soft clay at 1 m/s, and what gravity adds in the frame between.
        let moving = |mass: f64| {
            move |report: &mut FrameReport| {
                let kinetic = 0.5 * mass * 1700.0 * 0.002f64.powi(3);
                (report.speed_max, report.energies) = (500.0 * report.dt, Energies { kinetic, elastic: 1.0 });
            }
        };
        let steps = |planner: &mut Planner, mass: f64| (0..3).map(|_| run(planner, &moving(mass)).steps).last();
        assert_eq!([1.0, 0.125, 0.001].map(|mass| steps(&mut planner, mass)), [Some(20), Some(20), Some(5)]);
    }

    /// Clay that stood may rest two frames later, as long as gravity is what it was.
    #[test]
    fn standing_clay_may_rest() {
        let mut planner = planner(IntegratorChoice::Auto);
        let stands = |report: &mut FrameReport| report.is_standing = true;
        let may: Vec<bool> = (0..4).map(|_| run(&mut planner, &stands).may_rest).collect();
        assert_eq!(may, [false, false, true, true]);
        planner.policy.gravity *= 0.5;
        let may: Vec<bool> = (0..4).map(|_| run(&mut planner, &stands).may_rest).collect();
        assert_eq!(may, [false, false, true, true]);
        let may: Vec<bool> = (0..3).map(|_| run(&mut planner, &|_| {}).may_rest).collect();
        assert_eq!(may, [true, true, false]);
    }
}
