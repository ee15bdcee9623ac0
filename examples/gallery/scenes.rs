//! The scenes of the pictures, and the run that ends in each.

use bevy::math::Vec3;
use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::prelude::*;
use std::path::Path;

/// A scene and what is drawn of its end.
pub(crate) struct GalleryScene {
    /// Names of the pictures; one that ends with `equation_9` shows the surface as the paper makes it.
    pub(crate) pictures: &'static [&'static str],
    /// Ways from the clay to the cameras, one for each part of the picture.
    pub(crate) views: &'static [Vec3],
    /// The scene (RON).
    text: &'static str,
    /// Folder that paths in it start from, within the project.
    folder: &'static str,
    /// Pieces that the clay is in at the end.
    pieces: usize,
}

/// What a run left.
pub(crate) struct Sculpted {
    pub(crate) snapshot: Snapshot,
    pub(crate) surface: SurfaceSource,
    pub(crate) pieces: usize,
}

const ASIDE: Vec3 = Vec3::new(0.9, 0.75, 0.55);

pub(crate) const SCENES: [GalleryScene; 4] = [
    // A cut as thin as nothing, its lips in contact: the paper's Fig. 3.
    GalleryScene {
        pictures: &["fig3_equation_9", "fig3_two_sided"],
        views: &[Vec3::new(0.5, 0.75, 0.95)],
        text: include_str!("cut.ron"),
        folder: ".",
        pieces: 2,
    },
    GalleryScene { pictures: &["three_slabs"], views: &[ASIDE], text: include_str!("slabs.ron"), folder: ".", pieces: 3 },
    GalleryScene { pictures: &["half_open"], views: &[ASIDE], text: include_str!("half_open.ron"), folder: ".", pieces: 1 },
    GalleryScene {
        pictures: &["bunny"],
        views: &[Vec3::new(0.35, 0.35, 0.95), Vec3::new(-0.9, 0.5, 0.35)],
        text: include_str!("../../assets/scenes/bunny_carve.ron"),
        folder: "assets/scenes",
        pieces: 2,
    },
];

impl GalleryScene {
    /// Runs the scene to its end.
    ///
    /// # Errors
    /// A run that had to stop; clay that is not in as many pieces as it was cut into.
    pub(crate) fn run(&self, is_quick: bool) -> Result<Sculpted, String> {
        let mut scene = ClayScene::from_ron(self.text).map_err(|e| e.to_string())?;
        if is_quick {
            scene.cell_width *= 2.0;
        }
        let built = scene.build(&Path::new(env!("CARGO_MANIFEST_DIR")).join(self.folder)).map_err(|e| e.to_string())?;
        let mut engine = NativeEngine::new();
        engine.load(&built.snapshot).map_err(|e| e.to_string())?;
        let mut planner = built.planner();
        for frame in 0..built.frame_count() {
            let Decision::Run(plan) = built.next(frame, &mut planner) else { continue };
            engine.submit(plan).map_err(|e| e.to_string())?;
            planner.sent();
            let mut last = engine.wait().map_err(|e| e.to_string())?;
            planner.note(&mut last);
            if last.health.contains(Health::GIVEN_UP) {
                return Err(format!("{}: the run stopped at {:.3} s: {}", self.pictures[0], last.time, last.health));
            }
        }
        let snapshot = engine.save().map_err(|e| e.to_string())?;
        let surface = engine.surface().ok_or("the engine has no surface")?;
        let pieces = bodies(&extract(&surface, &SurfaceSettings::default()));
        if pieces != self.pieces && !is_quick {
            return Err(format!("{}: the clay is in {pieces} pieces, not {}", self.pictures[0], self.pieces));
        }
        Ok(Sculpted { snapshot, surface, pieces })
    }
}

/// Bodies that the surface encloses, crumbs left out.
fn bodies(surface: &bevy_clay::surface::mesh::Mesh) -> usize {
    const CRUMB: f64 = 1e-3;
    let least = CRUMB * surface.volume();
    surface.components().iter().filter(|body| body.volume() > least).count()
}
