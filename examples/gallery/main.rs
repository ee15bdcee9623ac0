//! Pictures of what the surface shows, drawn without a window:
//! `cargo demo gallery -- --out DIR [--only NAME] [--quick]`.
//!
//! Each clay is sculpted by the CPU engine first; then the plugin shows it as it does in an app, its surface
//! made on the graphics device. Exit code 1: a picture could not be made, or the clay is not in the pieces
//! that it was cut into.

mod clusters;
#[path = "../headless/say.rs"]
mod say;
mod scenes;
mod stage;
#[path = "../studio/mod.rs"]
mod studio;

use bevy::math::Vec3;
use bevy_clay::surface::prelude::*;
use clap::Parser;
use stage::{Shot, Subject};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Parser)]
#[command(about = "Pictures of what the surface shows, drawn without a window")]
struct Args {
    /// Folder for the pictures, made if missing.
    #[arg(long, default_value = "out/gallery")]
    out: PathBuf,
    /// Only pictures whose name contains NAME.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Cells of twice the width: to see whether it works, not how it looks.
    #[arg(long)]
    quick: bool,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let drawn = shots(&args).and_then(|shots| {
        std::fs::create_dir_all(&args.out).map_err(|e| format!("{}: {e}", args.out.display()))?;
        stage::draw(shots, &args.out)
    });
    match drawn {
        Ok(files) => {
            files.iter().for_each(|file| say::line(&format!("picture: {}", file.display())));
            ExitCode::SUCCESS
        }
        Err(error) => {
            say::error(&error);
            ExitCode::FAILURE
        }
    }
}

/// Way from the small clusters to the camera.
const CLUSTERS_VIEW: [Vec3; 1] = [Vec3::new(0.15, 0.8, 1.0)];

/// Runs the scenes that are asked for.
fn shots(args: &Args) -> Result<Vec<Shot>, String> {
    let is_asked = |name: &str| args.only.as_ref().is_none_or(|part| name.contains(part.as_str()));
    let mut shots = vec![];
    for scene in scenes::SCENES.iter().filter(|scene| scene.pictures.iter().any(|name| is_asked(name))) {
        let clay = scene.run(args.quick)?;
        for &name in scene.pictures.iter().filter(|name| is_asked(name)) {
            let subject = if name.ends_with("equation_9") {
                let mesh = extract(&clay.surface, &SurfaceSettings::equation_9());
                let shown = mesh.components().len();
                say::line(&format!("{name}: {shown} pieces as Equation 9 shows it, {} in truth", clay.pieces));
                Subject::Mesh(mesh)
            } else {
                say::line(&format!("{name}: {} pieces", clay.pieces));
                Subject::Clay(Box::new(clay.snapshot.clone()))
            };
            shots.push(Shot { name, subject, views: scene.views, room: None });
        }
    }
    // The paper's Fig. 4: both in the same frame.
    let [published, ours] = clusters::meshes();
    let room = ours.1.bounds().map(|(low, high)| (low.as_vec3(), high.as_vec3()));
    for (name, (way, mesh)) in
        [("fig4_equation_9", published), ("fig4_grains", ours)].into_iter().filter(|(name, _)| is_asked(name))
    {
        say::line(&format!("{name}: {} pieces by {way}", mesh.components().len()));
        shots.push(Shot { name, subject: Subject::Mesh(mesh), views: &CLUSTERS_VIEW, room });
    }
    if shots.is_empty() {
        return Err(format!("no picture has {:?} in its name", args.only.as_deref().unwrap_or_default()));
    }
    Ok(shots)
}
