//! A session that ends and begins again, a runtime or a graphics device that goes in the midst of one: the
//! clay stays.

use super::act::{is_intact, state};
use super::{Step, is_ready, say};
use bevy::prelude::*;
use bevy::render::renderer::RenderDevice;
use bevy_clay::prelude::*;
use bevy_mod_xr::session::{XrCreateSessionMessage, XrRequestExitMessage, XrState};
use std::fs;
use std::path::PathBuf;

/// The clay before, and after.
#[derive(Resource)]
struct Kept(Snapshot);

#[derive(Resource)]
struct Left(Snapshot);

/// Waits for the state of the clay, and takes it down as `T`.
fn take_down<T: Resource>(name: &'static str, as_what: fn(Snapshot) -> T) -> Step {
    Step::wait(name, move |world| {
        let Some(clay) = state(world) else { return false };
        world.insert_resource(as_what(clay));
        true
    })
}

/// What became of the clay.
fn compared(world: &mut World) -> Result<String, String> {
    is_intact(&world.resource::<Kept>().0, &world.resource::<Left>().0)
}

/// The session ends and begins again.
pub(super) fn restart() -> Vec<Step> {
    vec![
        take_down("the clay before", Kept),
        Step::new("the session is to end", 0.0, |world| {
            world.write_message(XrRequestExitMessage);
        })
        .until(|world| *world.resource::<XrState>() == XrState::Available),
        Step::new("without a session", 1.0, |_| ()),
        Step::new("the session is to begin again", 0.0, |world| {
            world.write_message(XrCreateSessionMessage);
        })
        .until(is_ready),
        take_down("the clay after", Left),
        Step::check("the session ended and began again", |world| {
            let count = world.resource::<XrStatus>().focused_count;
            if count >= 2 {
                Ok(format!("focused {count} times; {}", compared(world)?))
            } else {
                Err(format!("focused {count} times"))
            }
        }),
    ]
}

/// Asks for the runtime's end by making `file`, and looks at what is left.
pub(super) fn lose(file: PathBuf) -> Vec<Step> {
    let mut steps = vec![Step::wait("the session is focused, both hands are seen, the clay is shown", is_ready)];
    steps.extend(without("the runtime went in the midst of the session", move |_| {
        if let Err(error) = fs::write(&file, "") {
            say(&format!("{}: {error}", file.display()));
        }
    }));
    steps
}

/// Loses the graphics device, and looks at what is left.
pub(super) fn lose_device() -> Vec<Step> {
    without("the graphics device was lost in the midst of the session", |world| {
        let device = world.resource::<RenderDevice>().wgpu_device();
        device.destroy();
        // Between two frames: in the midst of one Bevy's own systems map buffers that are none.
        let _ = device.poll(wgpu::PollType::Poll);
    })
}

/// What is left when `go` has taken away what the session is of.
fn without(name: &'static str, go: impl FnMut(&mut World) + Send + Sync + 'static) -> Vec<Step> {
    vec![
        take_down("the clay before", Kept),
        Step::new(name, 0.0, go).until(|world| *world.resource::<XrState>() == XrState::Unavailable),
        Step::new("without a session", 1.0, |_| ()),
        take_down("the clay after", Left),
        Step::check(name, |world| Ok(format!("the app goes on; {}", compared(world)?))),
    ]
}
