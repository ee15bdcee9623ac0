//! Sculpts clay in a window: `cargo demo sculpt [-- --scene FILE --clay FILE --engine auto|native|gpu
//! --surface auto|cpu|gpu --arm simulated|touch --placement FILE --record FILE --out DIR]`, or in a headset:
//! `cargo demo sculpt --features xr -- --xr`. Each module is a plugin:
//!
//! | file      | shows                                                                     |
//! |-----------|---------------------------------------------------------------------------|
//! | `args`    | the command line                                                          |
//! | `start`   | clay from a scene file, settings that suit the machine                    |
//! | `stage`   | a board and lights that suit things of a few centimetres                  |
//! | `looks`   | standard materials, plain ones where a processor draws                    |
//! | `view`    | a camera that the mouse turns, moves and zooms                            |
//! | `pointer` | which camera the pointer is in, and where its ray meets the clay          |
//! | `hand`    | what the hand holds, chosen by keys and the wheel                         |
//! | `tools`   | a tool's entity: shape, look, force; where the clay has it in slow motion |
//! | `stroke`  | a tool that follows the pointer into the clay, no faster than a hand      |
//! | `arm`     | a haptic arm's tool, beside the others                                    |
//! | `pace`    | the clay's clock and the tool's speed, so that a slow machine keeps up    |
//! | `keys`    | undo, redo, reset, export, pause                                          |
//! | `hud`     | egui beside the clay's own panels                                         |
//! | `headset` | the same clay and tools in a headset's hands (`--xr`)                     |
//! | `check`   | for tests alone: strokes without a mouse, figures, pictures (`--check`)   |
//! | `say`     | lines for the terminal; as in `headless`                                  |
//!
//! Exit code 2: bad arguments or scene, in one line; 1: a check failed; 0: all is well.

mod args;
mod arm;
mod check;
mod hand;
#[cfg(feature = "xr")]
mod headset;
mod hud;
mod keys;
mod looks;
mod pace;
mod pointer;
#[path = "../headless/say.rs"]
mod say;
mod stage;
mod start;
mod stroke;
mod tools;
mod view;

use args::Args;
use arm::ArmPlugin;
use bevy::log::LogPlugin;
use bevy::prelude::*;
use bevy::window::WindowResolution;
use bevy_clay::prelude::*;
use start::Start;

fn main() -> AppExit {
    let prepared = Args::read().and_then(|args| Ok((Start::load(&args)?, args)));
    let (start, args) = match prepared {
        Ok(prepared) => prepared,
        Err(error) => {
            say::error(&error);
            return AppExit::from_code(2);
        }
    };
    #[cfg(feature = "xr")]
    if args.xr && has_headset() {
        return headset::app(start, args).run();
    }
    #[cfg(not(feature = "xr"))]
    if args.xr {
        say::warning("in a window: this program was built without the feature xr");
    }
    if let Err(error) = args::display() {
        say::error(&error);
        return AppExit::from_code(2);
    }
    window(start, args).run()
}

/// Whether there is a headset to sculpt in; if not, one line says why, and a window takes its place.
#[cfg(feature = "xr")]
fn has_headset() -> bool {
    let found = bevy_clay::xr::runtime::find();
    match &found {
        Ok(runtime) => say::line(&format!("sculpt: in the headset of {runtime}")),
        Err(none) => say::warning(&format!("in a window: {none}")),
    }
    found.is_ok()
}

/// The log that is worth a line.
fn log() -> LogPlugin {
    LogPlugin { filter: "warn,bevy_clay=info".into(), ..default() }
}

/// Sculpting in a window.
fn window(start: Start, args: Args) -> App {
    let arm = ArmPlugin::of(&args, 1.0);
    let window = Window { title: "bevy_clay".into(), resolution: WindowResolution::new(1280, 800), ..default() };
    let mut app = App::new();
    app.add_plugins(DefaultPlugins.set(WindowPlugin { primary_window: Some(window), ..default() }).set(log()))
        .add_plugins((ClayPlugins, SoftwareDrawingPlugin, ClayPanelPlugin { export_folder: args.out.clone() }))
        .add_plugins((start::StartPlugin(start), stage::StagePlugin, view::ViewPlugin, pointer::PointerPlugin))
        .add_plugins((hand::HandPlugin, tools::ToolPlugin, stroke::StrokePlugin, pace::PacePlugin))
        .add_plugins((keys::KeysPlugin { export_folder: args.out }, hud::HudPlugin));
    if let Some(arm) = arm {
        app.add_plugins(arm);
    }
    if args.check.is_on {
        app.add_plugins(check::CheckPlugin { has_arm: arm.is_some(), args: args.check });
    }
    app
}
