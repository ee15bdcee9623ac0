//! Bodies that are found at a frame's end, on the host: in what is handed out and in what the device goes on
//! with.

use super::siblings;
use bevy_clay::prelude::*;
use bevy_clay::sim::oracle::Oracle;
use bevy_clay::sim::prelude::*;
use clay_acceptance::agreement::{self, Case, assert_close};
use clay_acceptance::restart;
use libtest_mimic::Failed;

fn case() -> Result<Case, Failed> {
    agreement::found_bodies().pop().map(|agreement| agreement.case).ok_or_else(|| "a case".into())
}

/// The case joins two bodies, of which a cut stays, and makes two of a third of which none stays.
pub(crate) fn found_bodies_agree(engine: &mut GpuEngine) -> Result<(), Failed> {
    let Case { snapshot, plan } = case()?;
    let report = Oracle::new(&snapshot).run(&plan);
    let [cut, seam] = [7, 238].map(|sheet| report.sheets.contains(sheet));
    assert!(report.welded > 100 && report.body_max == 1 && seam && !cut, "{} {}", report.welded, report.body_max);
    for agreement in agreement::found_bodies() {
        assert_close(engine, &agreement);
    }
    Ok(())
}

/// The surface is of the bodies and sides that were found, also where nobody asks for the state; and a frame
/// submitted at once behind starts from them.
pub(crate) fn found_bodies_are_handed_out(engine: &mut GpuEngine) -> Result<(), Failed> {
    let Case { snapshot, plan } = case()?;
    let tell = |e: EngineError| e.to_string();
    engine.load(&snapshot).map_err(tell)?;
    let outputs = FrameOutputs { surface: true, ..FrameOutputs::NOTHING };
    engine.submit(FramePlan { outputs, ..plan.clone() }).map_err(tell)?;
    engine.submit(FramePlan { outputs, finds_bodies: false, ..plan }).map_err(tell)?;
    let first = engine.wait().map_err(tell)?;
    let surface = engine.surface().ok_or("a surface")?;
    let counts = [0, 1].map(|body| surface.particles.iter().filter(|p| p.body == body).count());
    assert!(counts[0] > counts[1] && counts[1] > 1000 && counts[0] + counts[1] == snapshot.particles.len(), "{counts:?}");
    assert!(surface.particles.iter().all(|p| [p.tags, p.tags >> 16].iter().all(|tag| tag & 255 != 7)), "the cut is done");
    let second = engine.wait().map_err(tell)?;
    assert_eq!((first.body_max, second.body_max), (1, 1));
    assert!(first.sheets.contains(238) && second.sheets.contains(238) && !second.sheets.contains(7));
    Ok(())
}

/// What the device goes on with is what it has handed out.
pub(crate) fn restarted_bodies_have_the_same_bits(engine: &mut GpuEngine) -> Result<(), Failed> {
    let Case { snapshot, plan } = case()?;
    let last = FramePlan { finds_bodies: false, ..plan.clone() };
    restart::assert_plans_restart(siblings(engine), &snapshot, &[plan.clone(), plan, last], &[1, 2]);
    Ok(())
}
