//! Plans a frame for each clay from the clock and the tools, and hands it to the engine. Never waits.

use super::clay::{Clay, ClaySettings};
use super::engine::ClayEngine;
use super::held::HeldTime;
use super::schedule::ClaySystems;
use super::tool::{Placement, SculptTool, Ways};
use crate::sim::engine::{Engine, EngineError};
use crate::sim::frame::FrameReport;
use crate::sim::health::Health;
use crate::sim::material::ClayMaterial;
use crate::sim::params::ParamsError;
use crate::sim::plan::{InertiaScaling, StepLimits};
use crate::sim::sheets::Sheets;
use crate::sim::snapshot::Snapshot;
use bevy::prelude::*;
use glam::DVec3;

/// The longest frame that is planned [s]: what an app falls behind by more is given up, so that a slow machine shows slow motion.
pub const FRAME_MAX: f64 = 1.0 / 30.0;
/// Wall time that a frame of clay may take [s], as far as it can be told: that of a frame of the app, within these bounds. On a slow machine frames of
/// clay are shorter, not later, and the clay answers a tool as soon.
pub const FRAME_WALL: (f64, f64) = (1.0 / 60.0, 0.1);
/// The shortest frame that is planned for that [s].
const FRAME_MIN: f64 = 1e-4;
/// Frames that may be under way. The plan of frame n is made from the report of frame n - 2.
pub const FRAMES_UNDER_WAY: usize = 2;

/// What is planned for an engine, and from what.
#[derive(Default)]
pub(super) struct Planner {
    cell_width: f64,
    /// Greatest speed [m/s] at the end of frames n and n - 1, by the parity of their ids, with what gravity adds in a frame.
    speeds: [f64; 2],
    /// Whether a tool engaged supported clay in these frames.
    engaged: [bool; 2],
    next_id: u64,
    owed: f64,
    /// Wall time per simulated time, of the last frame; none until one has ended.
    cost: Option<f64>,
    pub(super) given_up: f64,
    ways: Ways,
    sheets: Sheets,
    /// Kinds of trouble that were logged.
    pub(super) logged: Health,
    /// Why the last plan was not taken.
    pub(super) refused: Option<ParamsError>,
}

impl Planner {
    pub(super) fn new(snapshot: &Snapshot) -> Self {
        let speed = snapshot.particles.iter().map(|p| DVec3::from_array(p.velocity.map(f64::from)).length()).fold(0.0, f64::max);
        Self { cell_width: snapshot.domain.cell_width, speeds: [speed; 2], sheets: Sheets::new(snapshot), ..Self::default() }
    }

    /// Cell width [m].
    pub(super) fn cell_width(&self) -> f64 {
        self.cell_width
    }

    /// Goes on where `old`, the planner of the same clay on another engine, stands.
    pub(super) fn take_over(&mut self, old: Self) {
        *self = Self { cell_width: self.cell_width, speeds: self.speeds, engaged: [false; 2], ..old };
        // What was under way there is lost.
        self.ways.lose_all();
    }

    /// Lets `time` [s] of the app's clock pass with the tools where they are now; a frame lasts at most `most` [s].
    fn pass(&mut self, time: f64, most: f64, tools: &[(Entity, SculptTool, Placement)]) {
        for id in self.ways.observe(time, tools) {
            self.sheets.lift(id);
        }
        self.owed += time;
        self.given_up += (self.owed - most).max(0.0);
        self.owed = self.owed.min(most);
    }

    /// The longest frame that the engine affords [s]; a short one before anything is known of it.
    fn frame_max(&self, wall: f64) -> f64 {
        const FIRST: f64 = 1e-3;
        self.cost.map_or(FIRST, |cost| {
            (wall.clamp(FRAME_WALL.0, FRAME_WALL.1) / cost.max(f64::MIN_POSITIVE)).clamp(FRAME_MIN, FRAME_MAX)
        })
    }

    /// Submits a frame of the time owed, if there is any and the engine takes one.
    fn step(
        &mut self,
        engine: &mut dyn Engine,
        settings: &ClaySettings,
        material: &ClayMaterial,
        tools: &[(Entity, SculptTool, Placement)],
    ) -> Result<(), EngineError> {
        if self.owed <= 0.0 || engine.pending() >= FRAMES_UNDER_WAY || self.ways.is_mending() {
            return Ok(());
        }
        let duration = std::mem::take(&mut self.owed);
        let slot = usize::from(self.next_id % 2 == 1);
        let inertia = if self.engaged[slot] { settings.inertia } else { InertiaScaling::Off };
        let limits = StepLimits { speed: self.speeds[slot], inertia, gravity: settings.gravity, ..StepLimits::default() };
        let mut plan = limits.frame(material, self.cell_width, duration, &self.ways.paths(duration, tools));
        plan.id = self.next_id;
        self.sheets.deal(&mut plan);
        engine.submit(plan)?;
        self.ways.send();
        self.next_id += 1;
        self.refused = None;
        Ok(())
    }

    /// Takes what a report says about the speed of the clay, of its cuts, and whether the tools' ways were swept; adds what only the planner knows of the cuts.
    pub(super) fn note(&mut self, report: &mut FrameReport, gravity: DVec3) {
        let slot = usize::from(report.plan_id % 2 == 1);
        let is_given_up = report.health.contains(Health::GIVEN_UP);
        // The frame between this one and the one planned from it is not longer than the longest.
        let speed = report.speed(self.cell_width) + gravity.length() * FRAME_MAX;
        // A frame given up says nothing of the speed; the clay stands as before it.
        self.speeds[slot] = if is_given_up { self.speeds[slot].max(speed) } else { speed };
        self.engaged[slot] = report.is_engaged();
        self.sheets.note(report);
        let duration = report.dt * f64::from(report.steps);
        if duration > 0.0 && report.timings.total > 0.0 {
            self.cost = Some(report.timings.total / duration);
        }
        self.ways.end(is_given_up);
    }

    /// Leaves the clay as it stands and says why, once for each reason.
    fn refuse(&mut self, entity: Entity, error: ParamsError) {
        if self.refused.as_ref() != Some(&error) {
            error!("clay {entity} stands still: {error}");
            self.refused = Some(error);
        }
    }
}

/// Plans frames.
pub(super) struct StepPlugin;

impl Plugin for StepPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(Update, step.in_set(ClaySystems::Step));
    }
}

/// Plans a frame for each clay that runs.
#[expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]
fn step(
    (time, real): (Res<Time>, Res<Time<Real>>),
    mut clays: Query<(Entity, &ClaySettings, &ClayMaterial, &mut ClayEngine), With<Clay>>,
    tools: Query<(Entity, &SculptTool)>,
    transforms: TransformHelper,
    mut held: ResMut<HeldTime>,
) {
    let _watch = held.watch();
    for (entity, settings, material, mut clay) in &mut clays {
        let clay = clay.bypass_change_detection();
        if clay.stopped.is_some() || clay.is_leaving {
            continue;
        }
        let (engine, planner) = clay.parts();
        if settings.is_paused {
            planner.ways.lift();
            continue;
        }
        let result = placed(entity, &tools, &transforms).map_err(EngineError::Params).and_then(|tools| {
            let most = if settings.is_responsive { planner.frame_max(real.delta_secs_f64()) } else { FRAME_MAX };
            planner.pass(time.delta_secs_f64(), most, &tools);
            planner.step(engine, settings, material, &tools)
        });
        match result {
            Ok(()) => {}
            Err(EngineError::Params(error)) => planner.refuse(entity, error),
            Err(error) => {
                error!("clay {entity} lost its engine: {error}");
                clay.stopped = Some(error);
            }
        }
    }
}

/// The active tools as the clay sees them.
fn placed(
    clay: Entity,
    tools: &Query<(Entity, &SculptTool)>,
    transforms: &TransformHelper,
) -> Result<Vec<(Entity, SculptTool, Placement)>, ParamsError> {
    let place = |name, entity| {
        let transform = transforms.compute_global_transform(entity);
        Placement::new(name, &transform.map_err(|e| ParamsError::new(name, entity, e.to_string()))?)
    };
    let clay = place("clay transform", clay)?;
    let active = tools.iter().filter(|(_, tool)| tool.is_active);
    active.map(|(entity, tool)| Ok((entity, *tool, clay.seen(&place("tool transform", entity)?)))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::engine::{Deferred, StateTicket};
    use crate::sim::frame::{FramePlan, SurfaceSource};
    use crate::sim::material::Preset;
    use crate::sim::tool::Pose;
    use std::collections::VecDeque;

    /// What an engine does with a plan.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Fate {
        Run,
        GiveUp,
        Refuse,
    }

    /// An engine that does with its plans as told, and takes its time for the reports.
    struct Scripted {
        fates: VecDeque<Fate>,
        under_way: VecDeque<(FramePlan, bool)>,
        is_failing: bool,
        swept: Vec<(DVec3, DVec3)>,
    }

    impl Engine for Scripted {
        fn describe(&self) -> String {
            "scripted".into()
        }
        fn load(&mut self, _: &Snapshot) -> Result<(), EngineError> {
            Ok(())
        }
        fn submit(&mut self, plan: FramePlan) -> Result<(), EngineError> {
            let fate = self.fates.pop_front().unwrap_or(Fate::Run);
            if fate == Fate::Refuse {
                return Err(ParamsError::new("scripted", 0, "refused").into());
            }
            self.is_failing |= fate == Fate::GiveUp;
            self.under_way.push_back((plan, self.is_failing));
            Ok(())
        }
        fn poll(&mut self) -> Result<Option<FrameReport>, EngineError> {
            let Some((plan, is_given_up)) = self.under_way.pop_front() else { return Ok(None) };
            if is_given_up {
                self.is_failing &= !self.under_way.is_empty();
            } else if let Some(path) = plan.tools.first() {
                let ends = path.samples.iter().map(|s| s.pose.position);
                self.swept.extend(ends.clone().zip(ends.skip(1)));
            }
            let health = if is_given_up { Health::GIVEN_UP } else { Health::OK };
            Ok(Some(FrameReport { plan_id: plan.id, health, ..FrameReport::default() }))
        }
        fn surface_deferred(&self) -> Option<Deferred<SurfaceSource>> {
            None
        }
        fn state_deferred(&self) -> Result<Deferred<Snapshot>, EngineError> {
            Err(EngineError::NotLoaded)
        }
        fn request_state(&mut self) -> Result<StateTicket, EngineError> {
            Err(EngineError::NotLoaded)
        }
        fn pending(&self) -> usize {
            self.under_way.len()
        }
    }

    /// Runs a tool along x, a step per frame of the app, through frames with these fates; a report comes every `lag` frames. Returns what was swept.
    fn sweep(fates: &[Fate], lag: u32) -> Vec<(DVec3, DVec3)> {
        let fates = VecDeque::from(fates.to_vec());
        let mut engine = Scripted { fates, under_way: VecDeque::new(), is_failing: false, swept: vec![] };
        let mut planner = Planner { cell_width: 0.01, ..Planner::default() };
        let (settings, material) = (ClaySettings::default(), Preset::SoftClay.material());
        let entity = Entity::PLACEHOLDER;
        for frame in 0..60 {
            let pose = Pose { position: DVec3::X * 1e-3 * f64::from(frame.min(40)), ..Pose::default() };
            let tools = [(entity, SculptTool::default(), Placement { pose, scale: 1.0 })];
            planner.pass(0.01, FRAME_MAX, &tools);
            match planner.step(&mut engine, &settings, &material, &tools) {
                Ok(()) => {}
                Err(EngineError::Params(error)) => planner.refuse(entity, error),
                Err(error) => panic!("{error}"),
            }
            if frame % lag == 0
                && let Some(mut report) = engine.poll().expect("report")
            {
                planner.note(&mut report, settings.gravity);
            }
        }
        while let Some(mut report) = engine.poll().expect("report") {
            planner.note(&mut report, settings.gravity);
        }
        engine.swept
    }

    /// Whatever frames fail, the clay sees the tool's whole way, each piece once and in order.
    #[test]
    fn tool_never_jumps_over_a_frame() {
        let fates = [Fate::Run, Fate::GiveUp, Fate::Refuse];
        for script in 0..3usize.pow(6) {
            let script: Vec<Fate> = (0..6).map(|i| fates[script / 3usize.pow(i) % 3]).collect();
            for lag in [1, 2, 5] {
                let swept = sweep(&script, lag);
                assert_eq!(swept[0].0.x, 0.0, "{script:?}, {lag}");
                assert!(swept.windows(2).all(|w| w[0].1 == w[1].0), "{script:?}, {lag}: {swept:?}");
                assert!(swept.iter().all(|(a, b)| a.x <= b.x), "{script:?}, {lag}: {swept:?}");
                assert_eq!(swept[swept.len() - 1].1.x, 0.04, "{script:?}, {lag}");
            }
        }
    }

    /// A slow engine gets frames as short as it needs to answer soon, a fast one frames of a thirtieth of a second; the rest of the clock is given up.
    #[test]
    fn frames_are_as_long_as_the_engine_affords() {
        for (wall, longest) in [(0.5, 1e-2 / 10.0), (1e-3, FRAME_MAX), (1e3, FRAME_MIN)] {
            let mut planner = Planner { cell_width: 0.01, ..Planner::default() };
            let mut report = FrameReport { dt: 1e-3, steps: 10, ..FrameReport::default() };
            report.timings.total = wall;
            planner.note(&mut report, DVec3::ZERO);
            planner.pass(1.0, planner.frame_max(0.05), &[]);
            assert!((planner.owed - longest).abs() < 1e-12, "{wall}: {}", planner.owed);
            assert!((planner.owed + planner.given_up - 1.0).abs() < 1e-12);
        }
    }
}
