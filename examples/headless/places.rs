//! Where the results go: found out before hours are spent.

use crate::args::Args;
use crate::say;
use bevy_clay::prelude::*;
use bevy_clay::scene::export::whole::{check_writable, remove_leftovers};
use bevy_clay::scene::export::{PARTICLES, numbered};
use std::fs;
use std::path::{Path, PathBuf};

/// A path by its names from the root, as far as the system knows where that is.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.into())
}

/// The files of a run.
pub(crate) struct Places {
    pub(crate) folder: PathBuf,
    pub(crate) surface: Option<PathBuf>,
    pub(crate) particles: Option<PathBuf>,
    pub(crate) metrics: Option<PathBuf>,
    pub(crate) summary: PathBuf,
}

impl Places {
    /// Makes the folder, clears it of what killed runs left, and finds out whether every file can be written.
    ///
    /// # Errors
    /// One line that names the folder or the file that cannot be written, or that is an input of the run.
    pub(crate) fn prepare(args: &Args, scene: &Scene) -> Result<Self, String> {
        let folder = args.out.clone();
        let is_new = !folder.exists();
        fs::create_dir_all(&folder).map_err(|e| format!("{}: the output folder cannot be made: {e}", folder.display()))?;
        match remove_leftovers(&folder) {
            Ok(0) => {}
            Ok(count) => say::line(&format!("{}: removed {count} unfinished file(s) of runs that were killed", folder.display())),
            Err(error) => say::warning(&format!("{}: unfinished files of runs that were killed stay: {error}", folder.display())),
        }
        let outputs = &scene.outputs;
        let places = Self {
            surface: outputs.surface.as_ref().map(|name| folder.join(name)),
            particles: outputs.particles.then(|| folder.join(PARTICLES)),
            metrics: outputs.metrics.then(|| folder.join("metrics.csv")),
            summary: folder.join("summary.json"),
            folder,
        };
        places.check(args, scene).inspect_err(|_| {
            if is_new {
                // It is empty. If it cannot be removed, the refusal is what matters.
                let _ = fs::remove_dir(&places.folder);
            }
        })?;
        Ok(places)
    }

    fn check(&self, args: &Args, scene: &Scene) -> Result<(), String> {
        let base = args.scene().parent().unwrap_or(Path::new("."));
        let meshes = scene.clay.iter().filter_map(|body| match body {
            Body::Mesh(mesh) => Some(base.join(&mesh.path)),
            _ => None,
        });
        let inputs: Vec<PathBuf> =
            meshes.chain([args.scene().to_path_buf()]).filter_map(|file| file.canonicalize().ok()).collect();
        // Of bodies in files of their own the first stands for all: how many there will be is not known.
        let surface = match scene.outputs.export.bodies {
            BodyFiles::Together => self.surface.clone(),
            BodyFiles::Apart => self.surface.as_deref().map(|path| numbered(path, 1)),
        };
        let results: Vec<_> =
            [surface, self.particles.clone(), self.metrics.clone(), Some(self.summary.clone())].into_iter().flatten().collect();
        let is_result = |record: &&PathBuf| results.iter().any(|place| absolute(place) == absolute(record));
        if let Some(record) = args.record.as_ref().filter(is_result) {
            return Err(format!("{}: is a result of this run and would be overwritten by its recording", record.display()));
        }
        for place in results.iter().chain(&args.record) {
            check_writable(place).map_err(|e| e.to_string())?;
            if place.canonicalize().is_ok_and(|place| inputs.contains(&place)) {
                return Err(format!("{}: is an input of this run and would be overwritten", place.display()));
            }
        }
        Ok(())
    }
}
