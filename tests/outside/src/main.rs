//! An app outside the repository: a ball drops into a block of clay and is felt.
use bevy::{app::ScheduleRunnerPlugin, prelude::*};
use bevy_clay::prelude::*;

fn main() -> AppExit {
    let often = ScheduleRunnerPlugin::run_loop(std::time::Duration::from_millis(5));
    App::new().add_plugins((MinimalPlugins.set(often), ClayPlugins)).add_systems(Startup, spawn).add_systems(Update, press).run()
}

fn spawn(mut commands: Commands) -> Result {
    let scene = ClayScene::from_ron("(clay: [Box(size: (0.04, 0.02, 0.04), center: (0, 0.01, 0))], cell_width: 0.0025)")?;
    commands.spawn(Clay::snapshot(scene.build(std::path::Path::new("."))?.snapshot));
    commands.spawn((SculptTool::default(), Transform::from_xyz(0.0, 0.029, 0.0)));
    Ok(())
}

fn press(mut ball: Single<&mut Transform, With<SculptTool>>, mut reports: MessageReader<ClayReport>, mut exit: MessageWriter<AppExit>) {
    for report in reports.read().map(|r| &r.report) {
        ball.translation.y -= 0.0005;
        if report.time > 1.0 || report.tools.iter().any(|t| t.force.y > 1.0) {
            println!("{} particles after {:.3} s: {:?}", report.particle_count, report.time, report.tools.first().map(|t| t.force));
            exit.write(if report.time > 1.0 { AppExit::error() } else { AppExit::Success });
        }
    }
}
