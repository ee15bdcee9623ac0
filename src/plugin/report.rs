//! Hands out what came of frames: messages, forces on tools, status, trouble named once per clay.

use super::base::Base;
use super::clay::{Clay, ClayReport};
use super::draw::{Declined, Drawn};
use super::engine::{self, ClayEngine, EngineStart};
use super::events::{ClayEngineLost, ClayTrouble};
use super::follow::Following;
use super::held::HeldTime;
use super::run::Ended;
use super::schedule::{ClaySystems, schedule};
use super::show::{self, ClaySurface};
use super::space::ClaySpace;
use super::status::{ClayError, ClayMetrics, ClayStatus};
use super::tool::{SculptTool, ToolForce};
use bevy::ecs::entity::EntityHashMap;
use bevy::prelude::*;
use glam::DVec3;

/// Takes in reports, writes forces, status and metrics. Without it there are no [`ClayReport`]s, forces and
/// status stay empty, and clay stands still after two frames, as no report makes room for the next.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReportPlugin;

impl Plugin for ReportPlugin {
    fn build(&self, app: &mut App) {
        let reports = (report, feel).chain().in_set(ClaySystems::Report).after(engine::admit).before(engine::keep);
        let schedule = schedule(app);
        app.add_message::<ClayReport>()
            .add_systems(schedule, reports)
            .add_systems(Update, status.in_set(ClaySystems::Show).after(show::request));
    }
}

/// Hands out the reports of frames that have ended; names each kind of trouble once per clay.
pub(super) fn report(
    mut clays: Query<(Entity, &mut ClayEngine, &mut ClayStatus, &mut ClayMetrics), With<Clay>>,
    mut reports: MessageWriter<ClayReport>,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    for (entity, mut clay, mut status, mut metrics) in &mut clays {
        let clay = clay.bypass_change_detection();
        let ended = {
            let mut run = clay.run.lock();
            if !run.is_driven {
                run.poll(entity, |_, _| ());
            }
            run.take_ended()
        };
        for Ended { report, tools } in ended {
            // What rests looks as it did.
            clay.revision += u64::from(!report.is_resting());
            metrics.note(&report);
            let (health, particle_count) = (report.health, report.particle_count);
            if (status.health, status.particle_count) != (health, particle_count) {
                (status.health, status.particle_count) = (health, particle_count);
            }
            reports.write(ClayReport { clay: entity, report, tools });
        }
        clay.heed(entity);
    }
}

/// Writes what each tool feels of all clays.
pub(super) fn feel(
    clays: Query<(Entity, &ClayEngine), With<Clay>>,
    mut tools: Query<(Entity, &SculptTool, &mut ToolForce)>,
    transforms: TransformHelper,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let mut felt: EntityHashMap<Felt> = EntityHashMap::default();
    for (clay, engine) in &clays {
        let Ok(transform) = transforms.compute_global_transform(clay) else { continue };
        let Ok(space) = ClaySpace::new(&transform) else { continue };
        for (tool, report) in &engine.run.lock().plans.felt {
            let [force, torque] = [report.force, report.torque].map(|v| space.vector_to_world(v));
            felt.entry(*tool).or_default().add(clay, force, torque, report.contacts + report.tagged);
        }
    }
    for (entity, tool, mut force) in &mut tools {
        let now = felt.remove(&entity).filter(|_| tool.is_active).unwrap_or_default();
        force.set_if_neq(now.into());
    }
}

/// What a tool feels, in the world.
#[derive(Default)]
struct Felt {
    force: DVec3,
    torque: DVec3,
    contacts: u64,
    /// The clay that presses hardest, and how hard \[N\].
    hardest: Option<(Entity, f64)>,
}

impl Felt {
    fn add(&mut self, clay: Entity, force: DVec3, torque: DVec3, contacts: u64) {
        self.force += force;
        self.torque += torque;
        self.contacts += contacts;
        let size = force.length();
        if contacts > 0 && self.hardest.is_none_or(|(_, most)| size > most) {
            self.hardest = Some((clay, size));
        }
    }
}

impl From<Felt> for ToolForce {
    fn from(felt: Felt) -> Self {
        let Felt { force, torque, contacts, hardest } = felt;
        Self { force: force.as_vec3(), torque: torque.as_vec3(), contacts, clay: hardest.map(|(clay, _)| clay) }
    }
}

/// What a status is written from.
type Sources<'a> = (
    (&'a Base, &'a EngineStart),
    Option<&'a mut ClayEngine>,
    (Option<&'a ClaySurface>, Option<&'a Drawn>, Option<&'a Declined>),
    Option<&'a Following>,
);

/// Says how each clay is doing.
pub(super) fn status(
    mut clays: Query<(Entity, &mut ClayStatus, &mut ClayMetrics, Sources), With<Clay>>,
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let longest = held.longest_ms();
    let _watch = held.watch();
    for (entity, mut status, mut metrics, ((base, start), engine, (surface, drawn, declined), following)) in &mut clays {
        let (mesh_ms, triangle_count) = surface.map_or((0.0, 0), |s| (s.extract_ms(), s.triangle_count()));
        let triangle_count = drawn.map_or(triangle_count, Drawn::triangle_count);
        let before = *metrics;
        let mut now = ClayMetrics { main_thread_ms: longest, mesh_ms, triangle_count, ..before };
        let mut error = base.error.clone().map(ClayError::Source).or_else(|| start.error());
        let mut new = ClayStatus { error: None, ..status.clone() };
        if let Some(mut engine) = engine {
            let engine = engine.bypass_change_detection();
            new.engine.clone_from(&engine.name);
            let refused = {
                let run = engine.run.lock();
                let planner = &run.plans.planner;
                new.cell_width = planner.cell_width();
                (now.given_up, now.lag) = (planner.given_up(), planner.lag());
                run.plans.refused.clone()
            };
            now.rate = engine.pace.rate(now.time);
            if let Some(reason) = engine.stopped.as_ref().filter(|_| !engine.is_loss_said).map(ToString::to_string) {
                engine.is_loss_said = true;
                commands.trigger(ClayEngineLost { entity, reason });
            }
            let stopped = engine.stopped.as_ref().map(|error| ClayError::Stopped(error.to_string()));
            error = error.or(stopped).or(refused.map(ClayError::Parameter));
        }
        let (fault, warnings) = following.map_or((None, &[][..]), |f| (f.error.clone(), f.warnings.as_slice()));
        let declined = declined.map(|d| ClayError::Surface(d.reason().to_string()));
        new.error = error.or(fault.map(ClayError::MaterialFile)).or(declined);
        new.warnings = warnings.to_vec();
        new.rest_volume = base.rest_volume;
        if let Some(error) = new.error.clone().filter(|error| status.error.as_ref() != Some(error)) {
            commands.trigger(ClayTrouble { entity, error });
        }
        status.set_if_neq(new);
        metrics.set_if_neq(now);
    }
}
