//! A program outside the repository: a block of clay, pressed by a ball.
use bevy_clay::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = "(clay: [Box(size: (0.04, 0.02, 0.04), center: (0, 0.01, 0))], cell_width: 0.0025, duration: 0.08, frame_time: 0.01,
        tools: [(shape: Sphere(radius: 0.008), keyframes: [(time: 0, position: (0, 0.029, 0)), (time: 0.08, position: (0, 0.021, 0))])])";
    let scene = Scene::from_ron(scene)?.build(std::path::Path::new("."))?;
    let mut engine = NativeEngine::new();
    engine.load(&scene.snapshot)?;
    let mut report = FrameReport::default();
    for frame in 0..scene.frame_count() {
        engine.submit(scene.frame_plan(frame, &report))?;
        report = engine.wait()?;
    }
    let force = report.tools[0].force.y;
    let carved = engine.save()?.particles.iter().filter(|p| p.hardening > 0.05).count();
    println!("{} particles, {carved} carved, {force:.2} N on the ball", scene.snapshot.particles.len());
    if carved > 0 && force > 0.0 { Ok(()) } else { Err("nothing was carved".into()) }
}
