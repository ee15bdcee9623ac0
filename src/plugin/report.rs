//! Hands out what came of frames: messages, status, trouble named once per clay.

use super::clay::{Clay, ClayReport, ClayStatus};
use super::draw::{Declined, Drawn};
use super::engine::{self, ClayEngine, EngineStart};
use super::follow::Following;
use super::held::HeldTime;
use super::schedule::ClaySystems;
use super::show::{self, ClaySurface};
use bevy::prelude::*;

/// Takes in reports and writes the status.
pub(super) struct ReportPlugin;

impl Plugin for ReportPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<ClayReport>()
            .add_systems(Update, report.in_set(ClaySystems::Report).after(engine::admit).before(engine::keep))
            .add_systems(Update, status.in_set(ClaySystems::Show).after(show::request));
    }
}

/// Hands out the reports of frames that have ended; names each kind of trouble once per clay.
fn report(
    mut clays: Query<(Entity, &mut ClayEngine, &mut ClayStatus), With<Clay>>,
    mut reports: MessageWriter<ClayReport>,
    mut held: ResMut<HeldTime>,
) {
    let _watch = held.watch();
    for (entity, mut clay, mut status) in &mut clays {
        while clay.stopped.is_none() {
            let (engine, plans) = clay.parts();
            match engine.poll() {
                Ok(Some(mut report)) => {
                    plans.planner.note(&mut report);
                    let news = report.health.without(plans.logged);
                    if !news.is_ok() {
                        warn!("clay {entity}, frame {}: {news}", report.plan_id);
                        plans.logged.insert(news);
                    }
                    clay.revision += 1;
                    status.note(&report);
                    reports.write(ClayReport { clay: entity, report });
                }
                Ok(None) => break,
                Err(error) => {
                    error!("clay {entity} lost its engine: {error}");
                    clay.stopped = Some(error);
                }
            }
        }
    }
}

/// What a status is written from.
type Sources<'a> = (
    &'a EngineStart,
    Option<&'a mut ClayEngine>,
    (Option<&'a ClaySurface>, Option<&'a Drawn>, Option<&'a Declined>),
    Option<&'a Following>,
);

/// Says how each clay is doing.
pub(super) fn status(mut clays: Query<(&mut ClayStatus, Sources), With<Clay>>, mut held: ResMut<HeldTime>) {
    let longest = held.longest_ms();
    let _watch = held.watch();
    for (mut status, (start, engine, (surface, drawn, declined), following)) in &mut clays {
        status.main_thread_ms = longest;
        (status.mesh_ms, status.triangle_count) = surface.map_or((0.0, 0), |s| (s.extract_ms(), s.triangle_count()));
        if let Some(drawn) = drawn {
            status.triangle_count = drawn.triangle_count();
        }
        let mut error = start.error().cloned();
        if let Some(mut engine) = engine {
            let engine = engine.bypass_change_detection();
            if status.engine != engine.name {
                status.engine.clone_from(&engine.name);
            }
            status.cell_width = engine.plans.planner.cell_width();
            status.given_up = engine.plans.planner.given_up();
            status.lag = engine.plans.planner.lag();
            status.rate = engine.pace.rate(status.time);
            let stopped = engine.stopped.as_ref().map(ToString::to_string);
            error = error.or(stopped).or(engine.plans.refused.as_ref().map(ToString::to_string));
        }
        let (fault, warnings) = following.map_or((None, &[][..]), |f| (f.error.clone(), f.warnings.as_slice()));
        let declined = declined.map(|d| format!("the surface is made on the processor: {}", d.reason()));
        status.error = error.or(fault).or(declined);
        if status.warnings != warnings {
            status.warnings = warnings.to_vec();
        }
    }
}
