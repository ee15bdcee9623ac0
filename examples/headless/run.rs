//! The frames of a scene, one after the other.

use crate::args::Args;
use crate::progress::Progress;
use crate::record::Record;
use crate::tally::Tally;
use crate::{interrupt, pictures};
use bevy_clay::prelude::*;
use bevy_clay::scene::prelude::*;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::prelude::*;

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum End {
    /// It has not.
    Running,
    /// With its last frame.
    Whole,
    /// By Ctrl+C.
    Interrupted,
    /// Early, for the reason given: scene, frame, tool, field.
    Stopped(String),
}

/// A run and what it left.
pub(crate) struct Run {
    /// Frames to run.
    pub(crate) frames: u64,
    /// The frames, from 1, after which pictures are taken.
    pub(crate) pictured: Vec<u64>,
    pub(crate) tally: Tally,
    /// The last report.
    pub(crate) last: FrameReport,
    /// What the pictures show.
    pub(crate) moments: Vec<pictures::Moment>,
    pub(crate) end: End,
    pub(crate) record: Record,
    /// The hand that leads a tool, where one does.
    pub(crate) hand: Option<SceneHand>,
}

impl Run {
    pub(crate) fn new(built: &BuiltScene, args: &Args, record: Record) -> Self {
        let (frames, pictured) = (args.frames_of(built), args.pictured(built));
        let (tally, last) = (Tally::new(), FrameReport::default());
        Self { frames, pictured, tally, last, moments: vec![], end: End::Running, record, hand: SceneHand::of(built) }
    }

    /// Runs the frames, to the last of them or to where something ends the run.
    pub(crate) fn run(&mut self, built: &BuiltScene, engine: &mut dyn Engine) {
        let cell_width = built.snapshot.domain.cell_width;
        let mut planner = built.planner();
        let mut progress = Progress::new(self.frames);
        self.end = End::Whole;
        for frame in 0..self.frames {
            if interrupt::is_requested() {
                self.end = End::Interrupted;
                break;
            }
            let next = match &mut self.hand {
                Some(hand) => hand.next(built, frame, &mut planner),
                None => built.next(frame, &mut planner),
            };
            let Decision::Run(plan) = next else { continue };
            let report = engine.submit(plan.clone()).and_then(|()| engine.wait());
            planner.sent();
            match report {
                Ok(report) => self.last = report,
                Err(error) => {
                    self.end = End::Stopped(stopped(built, &plan, &self.last, &error.to_string()));
                    break;
                }
            }
            planner.note(&mut self.last);
            self.hand.iter_mut().for_each(|hand| hand.note(&self.last));
            self.tally.add(&self.last, cell_width);
            if self.last.health.contains(Health::GIVEN_UP) {
                self.end = End::Stopped(stopped(built, &plan, &self.last, &self.last.health.to_string()));
                break;
            }
            self.look(engine, &plan);
            let (steps, ratio) = (self.last.steps, self.last.volume_ratio);
            progress.step(&format!("{steps} steps, J {:.2}..{:.2}", ratio.0, ratio.1));
        }
        progress.finish();
    }

    /// Volume of the particles at the end [m^3]; of `clay` before the first frame.
    pub(crate) fn volume(&self, clay: &Snapshot) -> f64 {
        if self.tally.frames == 0 { clay.rest_volume() } else { self.last.volume }
    }

    /// Keeps what a picture shows, after the frames of which one is taken.
    fn look(&mut self, engine: &dyn Engine, plan: &FramePlan) {
        let frame = plan.id + 1;
        if !pictures::ARE_DRAWN || self.pictured.binary_search(&frame).is_err() {
            return;
        }
        let Some(source) = engine.surface() else { return };
        let surface = extract_with_grains(&source, &SurfaceSettings::default()).drawn();
        let tools = plan.tools.iter().map(|path| (path.tool.shape, path.pose_at(plan.duration()))).collect();
        self.moments.push(pictures::Moment { frame, surface, tools });
    }
}

/// Why a run stopped in the frame of `plan`, in a line that names the scene, the frame, and what moves
/// fastest: a tool by its place in the scene, or the clay, as of the report before.
fn stopped(built: &BuiltScene, plan: &FramePlan, before: &FrameReport, reason: &str) -> String {
    let scene = &built.scene;
    let start = plan.id as f64 * scene.frame_time;
    let fastest = plan.tools.iter().max_by(|a, b| a.speed_max().total_cmp(&b.speed_max()));
    let tool = fastest.map_or("no tool is there".into(), |path| {
        let index = path.id as usize - 1;
        format!("the fastest tool is {}, whose keyframes give {:.3e} m/s", scene.tools[index].title(index), path.speed_max())
    });
    let clay = before.speed(built.snapshot.domain.cell_width);
    format!("{}: frame {}, from {start:.6} s: {reason}; {tool}; the clay moved at {clay:.3e} m/s", scene.file, plan.id)
}
