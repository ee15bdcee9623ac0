//! The results: each file is written for itself, and what could not be written is said.

use crate::args::Args;
use crate::places::Places;
use crate::run::{End, Run};
use crate::{Exit, pictures, say};
use bevy_clay::prelude::*;
use bevy_clay::scene::line::named;
use bevy_clay::scene::prelude::*;
use bevy_clay::sim::frame::SurfaceSource;
use bevy_clay::surface::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;

/// Greatest difference [-] of the volume within the surface and the particles', where clay is many cells
/// thick.
const VOLUME_ERROR_MAX: f64 = 0.03;

/// The same where clay is a few cells thick, for each square of the share of the clay that is within a cell
/// of its surface [-]: a surface of nodes rounds what is curved, which is an error of the second order in the
/// cells and says how coarse a scene is, not whether it ran well. Balls, boxes, tori, a plate and the bunny
/// of 200 to 35,000 particles err by up to 0.10 times that square on the fine grid and 0.19 times on the
/// coarse. The share is of the clay's rest volume: crushed clay is not coarser.
fn skin_error(tier: Tier) -> f64 {
    match tier {
        Tier::Fine => 0.12,
        Tier::Coarse => 0.2,
    }
}

/// The most that it may be [-], however much surface there is: balls, boxes, tori and cylinders of 1.5 cells
/// radius or more err by up to 0.24 on the fine grid, a plate of one cell and a ball pressed to one by 0.27
/// and 0.30. What errs by more is no picture of its clay: it is crushed, splashed, or thinner than its cells.
const COARSE_ERROR_MAX: f64 = 0.3;

/// Bodies of which something is said, each for itself.
const BODIES_SAID: usize = 8;

/// The results of a run.
pub(crate) struct Results<'a> {
    built: &'a BuiltScene,
    places: &'a Places,
    engine: String,
    began: Instant,
    /// The clay at the end, as far as the engine still has it.
    clay: Option<Snapshot>,
    /// What the summary says of the surface.
    surface: Value,
    /// What is wrong, one line each.
    faults: Vec<String>,
}

impl<'a> Results<'a> {
    pub(crate) fn new(built: &'a BuiltScene, places: &'a Places, engine: String, began: Instant) -> Self {
        Self { built, places, engine, began, clay: None, surface: Value::Null, faults: vec![] }
    }

    fn fault(&mut self, fault: String) {
        say::error(&fault);
        self.faults.push(fault);
    }

    /// Writes all but the pictures, and checks the run; with its engine the recording ends.
    pub(crate) fn write(&mut self, mut engine: Box<dyn Engine>, run: &Run) {
        match &run.end {
            End::Stopped(reason) => self.fault(reason.clone()),
            End::Interrupted => say::line(&format!("interrupted after {} of {} frames", run.tally.frames, run.frames)),
            End::Whole | End::Running => {}
        }
        run.tally.faults().into_iter().for_each(|fault| self.fault(format!("check failed: {fault}")));
        // The small files first: they find room where the large ones do not.
        if let Some(path) = &self.places.metrics {
            self.wrote(write_text(path, &run.tally.metrics));
        }
        if let (Some(path), Some(hand)) = (&self.places.force, &run.hand) {
            let mut text = vec![];
            // Writing into memory does not fail.
            let _ = hand.write_trace(&mut text);
            self.wrote(write_text(path, &String::from_utf8_lossy(&text)));
        }
        match engine.save() {
            Ok(clay) => self.clay = Some(clay),
            Err(error) => self.fault(format!("no particles: {error}")),
        }
        let surface = self.places.surface.as_ref().and_then(|_| engine.surface());
        drop(engine);
        run.record.fault().into_iter().for_each(|fault| self.fault(format!("the recording ends early: {fault}")));
        self.write_surface(surface, run);
        if let (Some(path), Some(clay)) = (&self.places.particles, &self.clay) {
            self.wrote(write_particles(path, clay));
        }
        self.write_summary(run);
    }

    /// Takes note of what could not be written.
    fn wrote<T>(&mut self, written: Result<T, ExportError>) -> Option<T> {
        written.map_err(|error| self.fault(error.to_string())).ok()
    }

    fn write_surface(&mut self, source: Option<SurfaceSource>, run: &Run) {
        let outputs = &self.built.scene.outputs;
        let Some(path) = &self.places.surface else { return };
        let Some(source) = source else {
            return self.fault("no surface: the engine has none".into());
        };
        // Grains are no solid: they are left out of what is written.
        let Extraction { mesh, grains } = extract_with_grains(&source, &SurfaceSettings::new(outputs.tier));
        let written = match write_bodies(path, &mesh, &outputs.export) {
            Err(ExportError::Bodies { first, others, written }) => {
                self.missed_bodies(*first, others);
                Some(*written)
            }
            written => self.wrote(written),
        };
        let (mesh, repairs) = print_ready(&mesh);
        let (defects, volume) = (MeshCheck::of(&mesh), run.volume(&self.built.snapshot));
        let skin = mesh.area() * self.built.snapshot.domain.cell_width / self.built.snapshot.rest_volume();
        let error_max = (skin_error(outputs.tier) * skin * skin).clamp(VOLUME_ERROR_MAX, COARSE_ERROR_MAX);
        let error = mesh.volume() / volume - 1.0;
        if !defects.is_closed_manifold() {
            self.fault(format!("check failed: the surface is not a closed manifold: {defects:?}"));
        }
        // A NaN is in no range.
        if !(-error_max..=error_max).contains(&error) {
            let (error, error_max) = (error * 100.0, error_max * 100.0);
            self.fault(format!(
                "check failed: the surface encloses {error:+.1} % more than the particles' volume, and on these cells {error_max:.1} % is the most"
            ));
        }
        self.surface = json!({
            "volume_error": error, "volume_error_max": error_max, "grains": grains.len(),
            "closed_manifold": defects.is_closed_manifold(), "pillows_dropped": repairs.pillows, "crumbs_dropped": repairs.crumbs,
            "files": [],
        });
        if let Some(written) = written {
            self.add_bodies(&written);
        }
        if !grains.is_empty() {
            say::line(&format!("surface: without the {} particles that stand outside of it", grains.len()));
        }
    }

    /// Takes note of the bodies that could not be written, each in a line as far as lines are said of bodies.
    fn missed_bodies(&mut self, first: ExportError, others: Vec<ExportError>) {
        let unsaid = (others.len() + 1).saturating_sub(BODIES_SAID);
        for error in std::iter::once(first).chain(others).take(BODIES_SAID) {
            self.fault(error.to_string());
        }
        if unsaid > 0 {
            self.fault(format!("{unsaid} more bodies could not be written"));
        }
    }

    /// What the files hold.
    fn add_bodies(&mut self, written: &ExportReport) {
        let volumes: Vec<f64> = written.bodies.iter().map(|b| b.volume * 1e6).collect();
        let triangles: usize = written.bodies.iter().map(|b| b.triangles).sum();
        let sizes = volumes.iter().take(BODIES_SAID).map(|v| format!("{v:.3}")).collect::<Vec<_>>().join(", ");
        say::line(&format!("surface: {triangles} triangles, {} bodies of {sizes} cm^3", volumes.len()));
        if written.dropped_bodies > 0 {
            let (count, volume) = (written.dropped_bodies, written.dropped_volume * 1e6);
            say::warning(&format!("{count} bodies of {volume:.4} cm^3 together were left out, as `volume_min` asks for"));
        }
        for reason in written.bodies.iter().filter_map(|b| b.not_simplified.as_ref()) {
            say::warning(&format!("a body was written without simplification: {reason}"));
        }
        let file_name = |path: &Path| path.file_name().map(|f| f.to_string_lossy().into_owned());
        self.surface["files"] = written.files.iter().filter_map(|path| file_name(path)).collect();
        self.surface["triangles"] = triangles.into();
        self.surface["bodies_cm3"] = volumes.into();
        self.surface["bodies_dropped"] = written.dropped_bodies.into();
        self.surface["dropped_cm3"] = (written.dropped_volume * 1e6).into();
    }

    /// Draws the pictures. Those that were asked for and could not be drawn are a fault; others are missed in
    /// a line. An interrupt ends the drawing; of a run that was interrupted what there was is drawn.
    pub(crate) fn write_pictures(&mut self, run: &mut Run, args: &Args) {
        let moments = std::mem::take(&mut run.moments);
        let (count, was_interrupted) = (moments.len(), run.end == End::Interrupted);
        match pictures::draw(moments, &self.places.folder, !was_interrupted) {
            Ok(files) => {
                files.iter().for_each(|f| say::line(&format!("picture: {}", named(f))));
                if files.len() < count {
                    say::line(&format!("interrupted after {} of {count} pictures", files.len()));
                    if run.end == End::Whole {
                        run.end = End::Interrupted;
                    }
                    self.write_summary(run);
                }
            }
            Err(reason) if args.wants_pictures() => {
                self.fault(format!("no pictures: {reason}"));
                self.write_summary(run);
            }
            Err(reason) if !run.pictured.is_empty() => say::line(&format!("no pictures: {reason}")),
            Err(_) => {}
        }
    }

    /// Writes the summary as things stand; says whether it could.
    pub(crate) fn write_summary(&mut self, run: &Run) -> bool {
        let text = format!("{:#}\n", self.summary(run));
        self.wrote(write_text(&self.places.summary, &text)).is_some()
    }

    fn summary(&self, run: &Run) -> Value {
        let (tally, clay) = (&run.tally, self.clay.as_ref().unwrap_or(&self.built.snapshot));
        let force = |(force, tool): (&f64, &ToolTrack)| json!({"tool": tool.name, "force_max_N": force});
        let forces: Vec<_> = tally.force_max.iter().zip(&self.built.scene.tools).map(force).collect();
        let ended = match &run.end {
            End::Running => "not yet, or the run was killed",
            End::Whole => "with its last frame",
            End::Interrupted => "interrupted",
            End::Stopped(_) => "early",
        };
        let status = (run.end != End::Running).then(|| self.exit(run) as u8);
        json!({
            "scene": self.built.scene.file, "version": env!("CARGO_PKG_VERSION"), "ended": ended, "exit_status": status,
            "frames": {"planned": run.frames, "run": tally.frames}, "engine": self.engine, "particles": clay.particles.len(),
            "cell_width_m": clay.domain.cell_width, "simulated_s": clay.time, "substeps": tally.steps, "frames_redone": tally.redone,
            "wall_s": self.began.elapsed().as_secs_f64(), "engine_s": tally.engine_seconds, "health": tally.health.to_string(),
            "J": [tally.ratio.0, tally.ratio.1], "balance_error_max": tally.balance_max, "mass_error_max": tally.mass_error_max,
            "rest_volume_m3": clay.rest_volume(), "volume_m3": run.volume(clay), "tools": forces, "hand_force_max_N": run.hand.as_ref().map(SceneHand::force_max), "surface": self.surface,
            "faults": self.faults, "warnings": self.built.warnings,
        })
    }

    /// The run in a line, and how the program ends.
    pub(crate) fn conclude(&self, run: &Run) -> Exit {
        let tally = &run.tally;
        say::line(&format!(
            "{:.2} s of clay in {:.1} s, {} substeps, J {:.3} .. {:.3}, momentum kept to {:.0e}; results in {}",
            run.last.time,
            self.began.elapsed().as_secs_f64(),
            tally.steps,
            tally.ratio.0,
            tally.ratio.1,
            tally.balance_max,
            named(&self.places.folder)
        ));
        self.exit(run)
    }

    fn exit(&self, run: &Run) -> Exit {
        match run.end {
            End::Interrupted => Exit::Interrupted,
            End::Whole if self.faults.is_empty() => Exit::Well,
            End::Whole | End::Running | End::Stopped(_) => Exit::Fault,
        }
    }
}
