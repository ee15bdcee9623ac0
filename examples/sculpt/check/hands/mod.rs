//! Hands that a program moves, in a headset that is none: every step is done with them, and what it should
//! have done is looked at in the clay, the tools and the panels.
//!
//! | file      | does                                                          |
//! |-----------|---------------------------------------------------------------|
//! | `remote`  | moves the head and the hands                                  |
//! | `measure` | where dents and cuts lie                                      |
//! | `reference` | the same balls on the same clay without a headset           |
//! | `act`     | what steps are made of: hands to places on the clay           |
//! | `cut`     | steps: cuts                                                   |
//! | `sculpt`  | a dent, both hands at once                                    |
//! | `work`    | the work carried and scaled, strokes taken back, hands changed |
//! | `panel`   | a slider and a button by the ray                              |
//! | `eyes`    | pictures of what eyes see, and what an eye costs              |
//! | `arm`     | an arm's tool: one to one, scaled, with the clutch             |
//! | `own`     | actions of an app's own beside the plugin's                   |
//! | `session` | a session that ends, a runtime that goes                      |

mod act;
mod arm;
mod cut;
mod eyes;
mod measure;
mod own;
mod panel;
mod reference;
mod remote;
mod sculpt;
mod session;
mod work;

use super::{CheckArgs, say};
use crate::say as lines;
use bevy::prelude::*;
use bevy_clay::prelude::*;
use remote::Remote;
use std::time::Instant;
use std::vec;

/// A step that takes longer has failed \[s\].
const PATIENCE: f64 = 30.0;

/// Checks the run of an app in a headset: after some frames, or by the script of its hands.
pub(crate) struct HandsPlugin {
    pub(crate) args: CheckArgs,
    /// Whether an arm has a tool: the script looks at that then.
    pub(crate) has_arm: bool,
}

impl Plugin for HandsPlugin {
    fn build(&self, app: &mut App) {
        if self.args.is_scripted() {
            let (args, has_arm) = (self.args.clone(), self.has_arm);
            let start = move |commands: Commands, exit: MessageWriter<AppExit>| start(&args, has_arm, commands, exit);
            app.add_plugins((eyes::EyesPlugin, own::OwnActionsPlugin))
                .add_systems(Startup, start)
                .add_systems(Last, direct.run_if(resource_exists::<Script>));
        }
    }
}

/// Whether a step is over, so long after it began \[s\].
type IsOver = dyn FnMut(&mut World, f64) -> bool + Send + Sync;

/// What came of a step.
type Ending = dyn FnMut(&mut World) -> Result<String, String> + Send + Sync;

/// A step of the script.
pub(super) struct Step {
    name: &'static str,
    /// Begins it.
    begin: Box<dyn FnMut(&mut World) + Send + Sync>,
    /// Whether it is over.
    is_over: Box<IsOver>,
    /// What came of it, in a line.
    end: Box<Ending>,
}

/// The steps that are left.
#[derive(Resource)]
struct Script {
    steps: vec::IntoIter<Step>,
    under_way: Option<(Step, Instant)>,
    began: Instant,
    frames: u32,
}

/// Every step; or, where the runtime is to go or an arm is there, those that look at that.
fn steps(args: &CheckArgs, has_arm: bool) -> Vec<Step> {
    if let Some(file) = args.kill() {
        return session::lose(file);
    }
    if has_arm {
        return arm::steps(std::env::temp_dir().join("arm.placement.ron"));
    }
    let mut steps = sculpt::steps();
    if let Some(folder) = args.pictures() {
        steps.extend(eyes::pictures(folder, "eye"));
    }
    steps.extend(eyes::cost());
    steps.extend(own::steps());
    steps.extend(work::steps());
    steps.extend(panel::steps(args.pictures()));
    steps.push(eyes::once());
    steps.extend(session::restart());
    steps
}

fn start(args: &CheckArgs, has_arm: bool, mut commands: Commands, mut exit: MessageWriter<AppExit>) {
    match Remote::connect() {
        Ok(remote) => {
            commands.insert_resource(remote);
            let steps = steps(args, has_arm).into_iter();
            commands.insert_resource(Script { steps, under_way: None, began: Instant::now(), frames: 0 });
        }
        Err(error) => {
            lines::error(&error);
            exit.write(AppExit::error());
        }
    }
}

/// Goes on with the script.
fn direct(world: &mut World) {
    let Some(mut script) = world.remove_resource::<Script>() else { return };
    script.frames += 1;
    match advance(world, &mut script) {
        Ok(true) => world.insert_resource(script),
        Ok(false) => {
            let seconds = script.began.elapsed().as_secs_f64();
            say(&format!("all steps done in {seconds:.1} s, {:.1} frames a second", f64::from(script.frames) / seconds));
            world.write_message(AppExit::Success);
        }
        Err(fault) => {
            lines::error(&format!("check failed: {fault}"));
            world.write_message(AppExit::error());
        }
    }
}

/// Whether there is more to do.
fn advance(world: &mut World, script: &mut Script) -> Result<bool, String> {
    let Some((mut step, began)) = script.under_way.take() else {
        let Some(mut step) = script.steps.next() else { return Ok(false) };
        (step.begin)(world);
        script.under_way = Some((step, Instant::now()));
        return Ok(true);
    };
    let seconds = began.elapsed().as_secs_f64();
    if !(step.is_over)(world, seconds) {
        if seconds > PATIENCE {
            let metrics = world.query::<&ClayMetrics>().iter(world).next();
            return Err(format!("{}: not over after {PATIENCE} s: {metrics:?}", step.name));
        }
        script.under_way = Some((step, began));
        return Ok(true);
    }
    let said = (step.end)(world).map_err(|fault| format!("{}: {fault}", step.name))?;
    if !said.is_empty() {
        say(&format!("{}: {said}", step.name));
    }
    Ok(true)
}

/// The state of the session and the clay, for whoever waits for both.
fn is_ready(world: &mut World) -> bool {
    let is_focused = world.resource::<XrStatus>().phase == XrPhase::Focused;
    let are_seen = Side::ALL.iter().all(|side| world.resource::<XrControllers>().get(*side).tool.is_some());
    let is_shown = world.query::<&ClaySurface>().iter(world).next().is_some();
    is_focused && are_seen && is_shown
}
