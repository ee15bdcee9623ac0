//! The carved bunny on both engines: two solvers that share no line of code tell the same story.

use bevy_clay::prelude::*;
use bevy_clay::scene::prelude::*;
use bevy_clay::sim::prelude::*;
use glam::DVec3;
use libtest_mimic::Failed;
use std::path::Path;

/// What a run leaves.
struct Outcome {
    snapshot: Snapshot,
    impulses: Vec<DVec3>,
    tagged: u64,
    balance: f64,
}

/// The scene, frame by frame.
fn carve(engine: &mut dyn Engine, built: &BuiltScene) -> Result<Outcome, Failed> {
    engine.load(&built.snapshot).map_err(|e| e.to_string())?;
    let mut planner = built.planner();
    // Both engines in steps that both have.
    planner.policy.integrator = IntegratorChoice::Explicit;
    let mut outcome = Outcome { snapshot: built.snapshot.clone(), impulses: vec![DVec3::ZERO; 3], tagged: 0, balance: 0.0 };
    for index in 0..built.frame_count() {
        let Decision::Run(plan) = built.next(index, &mut planner) else { return Err("the planner waits".into()) };
        engine.submit(plan).map_err(|e| e.to_string())?;
        planner.sent();
        let mut report = engine.wait().map_err(|e| e.to_string())?;
        planner.note(&mut report);
        assert!(report.health.without(Health::STRAIN).is_ok(), "frame {index}: {}", report.health);
        for tool in &report.tools {
            outcome.impulses[tool.id as usize] += tool.impulse;
            outcome.tagged += tool.tagged;
        }
        outcome.balance = outcome.balance.max(report.balance_error());
    }
    outcome.snapshot = engine.save().map_err(|e| e.to_string())?;
    outcome.snapshot.particles.sort_by_key(|p| p.id);
    Ok(outcome)
}

/// Centre of mass [cells] and volume [m^3].
fn whole(s: &Snapshot) -> (DVec3, f64) {
    let mass: f64 = s.particles.iter().map(|p| f64::from(p.rest_volume)).sum();
    let centre = s.particles.iter().map(|p| f64::from(p.rest_volume) * p.grid()).sum::<DVec3>() / mass;
    (centre, s.particles.iter().map(|p| f64::from(p.rest_volume) * p.volume_ratio()).sum())
}

/// In cells three times as wide, with tools five times as fast: a processor that stands in for a device has
/// few thousand substeps to take.
///
/// Stated: centre of mass within 1e-3 cells, volume within 1e-6, each tool's impulse within 1 %, every
/// particle within half a cell. Plastic flow and falling pieces amplify rounding, so the bits part; the shape
/// does not. (In cells of twice the scene's width, 8,965 particles: centre 2e-5 cells, particles 9e-5 rms,
/// impulses 2e-4.)
pub(crate) fn engines_carve_the_same_bunny(engine: &mut GpuEngine) -> Result<(), Failed> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/scenes/bunny_carve.ron");
    let mut scene = ClayScene::load(&file).map_err(|e| e.to_string())?;
    scene.cell_width *= 3.0;
    scene.duration /= 5.0;
    scene.tools.iter_mut().flat_map(|tool| &mut tool.keyframes).for_each(|keyframe| keyframe.time /= 5.0);
    let built = scene.build(file.parent().unwrap_or(Path::new("."))).map_err(|e| e.to_string())?;
    let ours = carve(engine, &built)?;
    let theirs = carve(&mut NativeEngine::new(), &built)?;
    let ((c, v), (d, w)) = (whole(&ours.snapshot), whole(&theirs.snapshot));
    let apart: Vec<f64> =
        ours.snapshot.particles.iter().zip(&theirs.snapshot.particles).map(|(a, b)| (a.grid() - b.grid()).length()).collect();
    let rms = (apart.iter().map(|d| d * d).sum::<f64>() / apart.len() as f64).sqrt();
    let strayed = apart.iter().filter(|d| **d > 0.5).count();
    let impulses: Vec<f64> =
        ours.impulses.iter().zip(&theirs.impulses).map(|(a, b)| (*a - *b).length() / b.length().max(1e-12)).collect();
    let told = format!(
        "{} particles: centre {:.2e} cells, volume {:.2e}, rms {rms:.2e} cells, strayed {strayed}, impulses {impulses:?}, balance {:.1e} and {:.1e}, tagged {} and {}",
        apart.len(),
        (c - d).length(),
        v / w - 1.0,
        ours.balance,
        theirs.balance,
        ours.tagged,
        theirs.tagged
    );
    assert!((c - d).length() < 1e-3 && (v / w - 1.0).abs() < 1e-6 && strayed == 0, "{told}");
    assert!(impulses[1..].iter().all(|e| *e < 0.01) && ours.balance < 1e-5, "{told}");
    Ok(())
}
