//! Clay as a component: an engine behind the seam, run from Bevy's clock, never waited for.

use super::schedule::ClaySystems;
use crate::sim::engine::{Engine, EngineError, FrameReport};
use crate::sim::health::Health;
use crate::sim::material::ClayMaterial;
use crate::sim::native::NativeEngine;
use crate::sim::plan::{InertiaScaling, StepLimits};
use crate::sim::snapshot::Snapshot;
use crate::sim::tool::{Pose, PoseSample, Tool, ToolPath};
use bevy::ecs::component::{Mutable, StorageType};
use bevy::platform::cell::SyncCell;
use bevy::prelude::*;
use glam::DVec3;
use std::collections::HashMap;

/// The longest frame that is planned [s]: what an app falls behind by more is given up, so that a slow machine shows slow motion.
pub const FRAME_MAX: f64 = 1.0 / 30.0;
/// Frames that may be under way. The plan of frame n is made from the report of frame n - 2.
pub const FRAMES_UNDER_WAY: usize = 2;

impl Component for ClayMaterial {
    const STORAGE_TYPE: StorageType = StorageType::Table;
    type Mutability = Mutable;
}

/// A piece of clay: an engine and what is planned for it. A [`ClayMaterial`] beside it replaces the snapshot's from the next frame on.
#[derive(Component)]
pub struct Clay {
    /// Gravity, step fraction and inertia scaling (while a tool moves); `speed` is set by the plugin.
    pub limits: StepLimits,
    engine: SyncCell<Box<dyn Engine>>,
    cell_width: f64,
    material: ClayMaterial,
    /// Greatest speed [m/s] at the end of frames n and n - 1, by the parity of their ids, with what gravity adds in a frame.
    speeds: [f64; 2],
    /// Whether a tool engaged supported clay in these frames.
    engaged: [bool; 2],
    next_id: u64,
    owed: f64,
    given_up: f64,
    /// Where each tool was at the end of the last plan.
    poses: HashMap<Entity, Pose>,
    logged: Health,
    error: Option<EngineError>,
}

impl Clay {
    /// Clay on the CPU engine, from a snapshot.
    ///
    /// # Errors
    /// A snapshot that the engine cannot use.
    pub fn new(snapshot: &Snapshot) -> Result<Self, EngineError> {
        Self::with_engine(Box::new(NativeEngine::new()), snapshot)
    }

    /// Clay on an engine of the caller's choice.
    ///
    /// # Errors
    /// A snapshot that the engine cannot use.
    pub fn with_engine(mut engine: Box<dyn Engine>, snapshot: &Snapshot) -> Result<Self, EngineError> {
        engine.load(snapshot)?;
        let speed = snapshot.particles.iter().map(|p| DVec3::from_array(p.velocity.map(f64::from)).length()).fold(0.0, f64::max);
        Ok(Self {
            limits: StepLimits::default(),
            engine: SyncCell::new(engine),
            cell_width: snapshot.domain.cell_width,
            material: snapshot.material,
            speeds: [speed; 2],
            engaged: [false; 2],
            next_id: 0,
            owed: 0.0,
            given_up: 0.0,
            poses: HashMap::new(),
            logged: Health::OK,
            error: None,
        })
    }

    /// The engine, for its surface and its state. Plans submitted past the plugin confuse it.
    pub fn engine(&mut self) -> &mut dyn Engine {
        self.engine.get().as_mut()
    }

    /// Time of the app's clock [s] that the clay did not follow because the engine was busy.
    pub fn given_up(&self) -> f64 {
        self.given_up
    }

    /// Why the clay stands still: the engine refused the last plan (a parameter of the material or a tool; the clay goes on when that is
    /// mended) or stopped.
    pub fn error(&self) -> Option<&EngineError> {
        self.error.as_ref()
    }

    /// Whether the engine is gone, and with it any hope of a next frame.
    fn is_stopped(&self) -> bool {
        self.error.as_ref().is_some_and(|e| !matches!(e, EngineError::Params(_)))
    }

    /// A path from where the tool was at the end of the last plan to where it is now.
    fn path(&mut self, entity: Entity, tool: &SculptTool, duration: f64) -> ToolPath {
        let from = self.poses.insert(entity, tool.pose).unwrap_or(tool.pose);
        let samples = [(0.0, from), (duration, tool.pose)].map(|(time, pose)| PoseSample { time, pose });
        ToolPath { id: tool.id, tool: tool.tool, samples: samples.to_vec() }
    }

    /// Submits a frame of the time owed, if there is any and the engine takes one.
    fn step(&mut self, delta: f64, tools: &Query<(Entity, &SculptTool)>) -> Result<(), EngineError> {
        // A tool taken away and put down elsewhere does not sweep from where it was.
        self.poses.retain(|entity, _| tools.contains(*entity));
        self.owed += delta;
        self.given_up += (self.owed - FRAME_MAX).max(0.0);
        self.owed = self.owed.min(FRAME_MAX);
        if self.owed <= 0.0 || self.engine().pending() >= FRAMES_UNDER_WAY {
            return Ok(());
        }
        let duration = std::mem::take(&mut self.owed);
        let mut tools: Vec<_> = tools.iter().collect();
        tools.sort_by_key(|(_, tool)| tool.id);
        let paths: Vec<_> = tools.into_iter().map(|(entity, tool)| self.path(entity, tool, duration)).collect();
        let slot = usize::from(self.next_id % 2 == 1);
        let inertia = if self.engaged[slot] { self.limits.inertia } else { InertiaScaling::Off };
        let limits = StepLimits { speed: self.speeds[slot], inertia, ..self.limits };
        let mut plan = limits.frame(&self.material, self.cell_width, duration, &paths);
        plan.id = self.next_id;
        self.engine().submit(plan)?;
        self.next_id += 1;
        self.error = None;
        Ok(())
    }

    /// Takes what a report says about the speed of the clay.
    fn note(&mut self, report: &FrameReport) {
        let slot = usize::from(report.plan_id % 2 == 1);
        // The frame between this one and the one planned from it is not longer than the longest.
        let speed = report.speed(self.cell_width) + self.limits.gravity.length() * FRAME_MAX;
        // A frame given up says nothing of the speed; the clay stands as before it.
        self.speeds[slot] = if report.health.contains(Health::GIVEN_UP) { self.speeds[slot].max(speed) } else { speed };
        self.engaged[slot] = report.is_engaged();
    }
}

/// A tool that acts on every clay of the app. Its way from one frame's pose to the next is swept, never jumped.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct SculptTool {
    /// Names the tool in reports; a blade's sheet id is its low byte.
    pub id: u32,
    /// Shape and contact.
    pub tool: Tool,
    /// Where the tool is now [m].
    pub pose: Pose,
}

/// A frame of clay has ended.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct ClayReport {
    /// The entity with the [`Clay`].
    pub clay: Entity,
    /// What came of the frame: forces on tools, energies, health, timings.
    pub report: FrameReport,
}

/// Runs the clay.
pub(super) struct StepPlugin;

impl Plugin for StepPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<ClayReport>().add_systems(Update, (report.in_set(ClaySystems::Report), step.in_set(ClaySystems::Step)));
    }
}

/// Hands out the reports of frames that have ended; names each kind of trouble once per clay.
fn report(mut clays: Query<(Entity, &mut Clay)>, mut reports: MessageWriter<ClayReport>) {
    for (entity, mut clay) in &mut clays {
        while !clay.is_stopped() {
            match clay.engine().poll() {
                Ok(Some(report)) => {
                    clay.note(&report);
                    let news = report.health.without(clay.logged);
                    if !news.is_ok() {
                        warn!("clay {entity}, frame {}: {news}", report.plan_id);
                        clay.logged.insert(news);
                    }
                    reports.write(ClayReport { clay: entity, report });
                }
                Ok(None) => break,
                Err(error) => stop(entity, &mut clay, error),
            }
        }
    }
}

/// Plans a frame for each clay. Never waits.
#[expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]
fn step(time: Res<Time>, mut clays: Query<(Entity, &mut Clay, Option<&ClayMaterial>)>, tools: Query<(Entity, &SculptTool)>) {
    for (entity, mut clay, material) in &mut clays {
        if let Some(material) = material {
            clay.material = *material;
        }
        if !clay.is_stopped()
            && let Err(error) = clay.step(time.delta_secs_f64(), &tools)
        {
            stop(entity, &mut clay, error);
        }
    }
}

/// Leaves the clay as it stands and says why, once for each reason.
fn stop(entity: Entity, clay: &mut Clay, error: EngineError) {
    if clay.error.as_ref() != Some(&error) {
        error!("clay {entity} stands still: {error}");
    }
    clay.error = Some(error);
}
