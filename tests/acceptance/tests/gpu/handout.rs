//! What frames hand out: as much as was asked for, and the state to whoever asks without a frame.

use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use clay_acceptance::agreement::{self, Case};
use glam::IVec3;
use libtest_mimic::Failed;

/// Bytes of a particle in the surface and in the state.
const SURFACE_BYTES: u64 = 28;
const STATE_BYTES: u64 = 156;

fn case() -> Case {
    let s = agreement::block(IVec3::new(4, 4, 4), 1.0, Walls::default(), agreement::soft());
    let plan = agreement::plan(&s, 0.25, 12, vec![]);
    Case { snapshot: s, plan }
}

fn run(engine: &mut GpuEngine, case: &Case, outputs: FrameOutputs) -> Result<FrameReport, Failed> {
    engine.submit(FramePlan { outputs, ..case.plan.clone() }).map_err(|e| e.to_string())?;
    Ok(engine.wait().map_err(|e| e.to_string())?)
}

fn state(engine: &GpuEngine) -> Result<Snapshot, Failed> {
    Ok(engine.state_deferred().map_err(|e| e.to_string())?()?)
}

/// Nothing is copied back that the plan does not ask for, and what was handed out before stays readable.
pub(crate) fn frames_hand_out_what_was_asked_for(engine: &mut GpuEngine) -> Result<(), Failed> {
    let case = case();
    let count = case.snapshot.particles.len() as u64;
    engine.load(&case.snapshot).map_err(|e| e.to_string())?;
    let nothing = run(engine, &case, FrameOutputs::NOTHING)?.bytes_read_back;
    assert!(state(engine)?.particles == case.snapshot.particles, "a state that nobody asked for");
    assert!(engine.surface().is_some_and(|s| s.particles.len() as u64 == count));
    let surface = run(engine, &case, FrameOutputs { surface: true, ..FrameOutputs::NOTHING })?.bytes_read_back;
    let most = run(engine, &case, FrameOutputs { support: false, ..FrameOutputs::ALL })?.bytes_read_back;
    let all = run(engine, &case, FrameOutputs::ALL)?.bytes_read_back;
    assert_eq!((surface - nothing, most - nothing), (SURFACE_BYTES * count, (SURFACE_BYTES + STATE_BYTES) * count));
    // Of blocks four words each.
    assert!(all > most && (all - most) % 16 == 0 && all - most < 64 * count, "{most} {all}");
    let after = state(engine)?;
    assert!(after.time > case.snapshot.time && after.particles != case.snapshot.particles);
    // The same clay, whether its state was asked for on the way or at its end alone.
    let mut other = engine.sibling();
    other.load(&case.snapshot).map_err(|e| e.to_string())?;
    for _ in 0..4 {
        run(&mut other, &case, FrameOutputs::NOTHING)?;
    }
    assert!(other.save().map_err(|e| e.to_string())?.to_bytes() == after.to_bytes(), "asking changed the clay");
    Ok(())
}

/// The state is there for the asking: as loaded, at rest and while frames run, also where one is run again.
pub(crate) fn state_is_there_for_the_asking(engine: &mut GpuEngine) -> Result<(), Failed> {
    let mut case = case();
    case.plan.outputs = FrameOutputs::NOTHING;
    engine.load(&case.snapshot).map_err(|e| e.to_string())?;
    assert!(engine.save().map_err(|e| e.to_string())?.particles == case.snapshot.particles, "as loaded");
    let mut asked = vec![];
    for frame in 0..6 {
        engine.submit(case.plan.clone()).map_err(|e| e.to_string())?;
        asked.push((frame, engine.request_state().map_err(|e| e.to_string())?));
        if frame % 2 == 1 {
            asked.push((frame, engine.request_state().map_err(|e| e.to_string())?));
            engine.wait().map_err(|e| e.to_string())?;
            engine.wait().map_err(|e| e.to_string())?;
        }
    }
    let last = engine.save().map_err(|e| e.to_string())?;
    let duration = case.plan.duration();
    for (frame, mut ticket) in asked {
        let state = ticket.take().map_err(|e| e.to_string())?.ok_or(format!("no state for frame {frame}"))?()?;
        let frames = (state.time / duration).round() as i32;
        // That of the last frame reported, or of one under way.
        assert!((frame / 2 * 2..=frame + 1).contains(&frames), "frame {frame}: state after {frames}");
        assert!((state.particles == last.particles) == (frames == 6), "frame {frame}");
    }
    // A ticket of clay that is gone says so.
    let mut lost = engine.request_state().map_err(|e| e.to_string())?;
    engine.load(&case.snapshot).map_err(|e| e.to_string())?;
    assert!(matches!(lost.take(), Err(_) | Ok(Some(_))));
    engine.submit(case.plan.clone()).map_err(|e| e.to_string())?;
    let mut lost = engine.request_state().map_err(|e| e.to_string())?;
    engine.load(&case.snapshot).map_err(|e| e.to_string())?;
    assert!(lost.take().is_err(), "a state of clay that is gone");
    Ok(())
}
