//! Where the results go: found out before hours are spent.

use crate::args::Args;
use crate::{pictures, say};
use bevy_clay::prelude::*;
use bevy_clay::scene::export::whole::{check_writable, remove_leftovers};
use bevy_clay::scene::export::{PARTICLES, is_numbered, numbered};
use bevy_clay::scene::line::named;
use bevy_clay::scene::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

/// The picture after frame `frame`.
pub(crate) fn picture(folder: &Path, frame: u64) -> PathBuf {
    folder.join(format!("frame_{frame:04}.png"))
}

/// A path without links in its folders.
fn place_of(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.into(),
    }
}

/// A file by the place that its path names and by the one that a link there leads to: results are put in the
/// former, a recording in the latter, and an input is lost with either.
fn places_of(path: &Path) -> [PathBuf; 2] {
    let place = place_of(path);
    [path.canonicalize().unwrap_or_else(|_| place.clone()), place]
}

/// The files of a run.
pub(crate) struct Places {
    pub(crate) folder: PathBuf,
    pub(crate) surface: Option<PathBuf>,
    pub(crate) particles: Option<PathBuf>,
    pub(crate) metrics: Option<PathBuf>,
    pub(crate) force: Option<PathBuf>,
    pub(crate) summary: PathBuf,
    pictures: Vec<PathBuf>,
    /// Folders made for them, the innermost first.
    made: Vec<PathBuf>,
}

impl Places {
    /// Makes the folder, clears it of what killed runs left, and finds out whether every file can be written.
    ///
    /// # Errors
    /// One line that names the folder or the file that cannot be written, or that is an input of the run.
    /// Folders that were made are gone again.
    pub(crate) fn prepare(args: &Args, built: &BuiltScene) -> Result<Self, String> {
        let (folder, outputs) = (args.out.clone(), &built.scene.outputs);
        let missing = folder.ancestors().take_while(|part| !part.as_os_str().is_empty() && !part.exists());
        let are_drawn = pictures::ARE_DRAWN || args.wants_pictures();
        let pictured = if are_drawn { args.pictured(built) } else { vec![] };
        let places = Self {
            surface: outputs.surface.as_ref().map(|name| folder.join(name)),
            particles: outputs.particles.then(|| folder.join(PARTICLES)),
            metrics: outputs.metrics.then(|| folder.join("metrics.csv")),
            force: built.scene.hand().map(|_| folder.join("force.csv")),
            summary: folder.join("summary.json"),
            pictures: pictured.into_iter().map(|frame| picture(&folder, frame)).collect(),
            made: missing.map(Path::to_path_buf).collect(),
            folder,
        };
        places.make().and_then(|()| places.check(args, built)).inspect_err(|_| places.withdraw())?;
        Ok(places)
    }

    /// There is no run after all: removes the folders that were made.
    pub(crate) fn withdraw(&self) {
        for folder in &self.made {
            // They are empty. If one cannot be removed, the refusal is what matters.
            let _ = fs::remove_dir(folder);
        }
    }

    fn make(&self) -> Result<(), String> {
        let folder = named(&self.folder);
        fs::create_dir_all(&self.folder).map_err(|e| format!("{folder}: the output folder cannot be made: {e}"))?;
        match remove_leftovers(&self.folder) {
            Ok(0) => {}
            Ok(count) => say::line(&format!("{folder}: removed {count} unfinished file(s) of runs that were killed")),
            Err(error) => say::warning(&format!("{folder}: unfinished files of runs that were killed stay: {error}")),
        }
        Ok(())
    }

    fn check(&self, args: &Args, built: &BuiltScene) -> Result<(), String> {
        let apart = self.surface.as_deref().filter(|_| built.scene.outputs.export.bodies == BodyFiles::Apart);
        // Of bodies in files of their own the first stands for all: how many there will be is not known.
        let surface = apart.map(|path| numbered(path, 1)).or_else(|| self.surface.clone());
        let files = [surface, self.particles.clone(), self.metrics.clone(), self.force.clone(), Some(self.summary.clone())];
        let files: Vec<PathBuf> = files.into_iter().flatten().chain(self.pictures.iter().cloned()).collect();
        let taken: Vec<_> = files.iter().map(|file| (file, places_of(file))).collect();
        let parts = apart.map(place_of);
        // The result that would be written over a file at `places`.
        let over = |places: &[PathBuf; 2]| {
            let file = taken.iter().find(|(_, taken)| taken.iter().any(|place| places.contains(place)));
            let part = places.iter().find(|place| parts.as_ref().is_some_and(|parts| is_numbered(parts, place)));
            file.map(|(file, _)| file.to_path_buf()).or_else(|| Some(self.folder.join(part?.file_name()?)))
        };
        let is_lost = |place: &Path| format!("{}: is an input of this run and would be overwritten", named(place));
        let inputs = built.inputs.iter().map(FileStamp::path).chain([args.scene()]).filter(|input| input.exists());
        let inputs: Vec<_> = inputs.map(places_of).collect();
        if let Some(record) = &args.record {
            let places = places_of(record);
            if over(&places).is_some() {
                let record = named(record);
                return Err(format!("{record}: is a result of this run and would be overwritten by its recording"));
            }
            if inputs.iter().any(|input| places.iter().any(|place| input.contains(place))) {
                return Err(is_lost(record));
            }
        }
        if let Some(place) = inputs.iter().find_map(over) {
            return Err(is_lost(&place));
        }
        // A picture that nobody asked for may be missed.
        let needed = files.iter().filter(|file| args.wants_pictures() || !self.pictures.contains(file));
        needed.chain(&args.record).try_for_each(|file| check_writable(file).map_err(|e| e.to_string()))
    }
}
