//! Clays as files: `NAME.clay.ron`, which people read and write.
//!
//! ```ron
//! (
//!     extends: "plasticine.clay.ron",
//!     name: "my plasticine",
//!     yield_stress: "25 kPa",
//!     law: Worked(loss: "40 %", rate: 2, rest_time: "10 min"),
//! )
//! ```
//!
//! Numbers are SI; one in quotes carries a unit that fits the field (Pa kPa MPa GPa; kg/m^3 g/cm^3; mm cm m;
//! s min h; % for ratios; Pa s^n kPa s^n). What a file leaves out is as in the file that it extends, or as in
//! [`ClayMaterial::default`]. A key that nobody knows is a warning.
//!
//! A file that is named by another (`extends`, a scene's `material: File(..)`) is looked for in the folder of
//! that other file, then in `assets/clays` of the working directory, then among the clays of this crate,
//! which are compiled in.

mod field;
mod parse;
mod unit;

use super::error::SceneError;
use super::line::{named, short};
use super::stamp::FileStamp;
use super::text::read_text;
use crate::sim::material::{ClayMaterial, Preset};
use crate::sim::params::ParamsError;
use field::{Kind, law, number_mut};
use parse::{Entry, Place, Sheet, Value};
use std::path::{Path, PathBuf};

/// Where clays lie that are not beside the file that names them, from the working directory.
const FOLDER: &str = "assets/clays";
/// What a clay file's name ends with.
const ENDING: &str = ".clay.ron";
/// The longest clay file [bytes]: the clays of this crate take 1 kB.
const BYTES_MAX: u64 = 1 << 20;
/// The longest chain of files that extend each other.
const CHAIN_MAX: usize = 16;

macro_rules! built_in {
    ($($name:literal),*) => {
        [$(($name, include_str!(concat!("../../../assets/clays/", $name)))),*]
    };
}

/// The clays of this crate: file names and texts.
const BUILT_IN: [(&str, &str); 8] = built_in!(
    "soft.clay.ron",
    "plasticine.clay.ron",
    "stiff.clay.ron",
    "wax.clay.ron",
    "putty.clay.ron",
    "paper.clay.ron",
    "paper_as_published.clay.ron",
    "vr_doh.clay.ron"
);

/// The name of the file that holds a preset.
pub fn preset_file(preset: Preset) -> &'static str {
    match preset {
        Preset::SoftClay => "soft.clay.ron",
        Preset::Plasticine => "plasticine.clay.ron",
        Preset::StiffClay => "stiff.clay.ron",
        Preset::Wax => "wax.clay.ron",
        Preset::Putty => "putty.clay.ron",
        Preset::Paper => "paper.clay.ron",
        Preset::VrDoh => "vr_doh.clay.ron",
    }
}

/// A clay as its file says it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClayFile {
    /// What to call it: the name in the file, else the file's own.
    pub name: String,
    /// The material, every value checked.
    pub material: ClayMaterial,
    /// What is odd about the file or those that it extends but does no harm, one line each.
    pub warnings: Vec<String>,
    /// The fields that the file or those that it extends name.
    named: Vec<&'static str>,
}

impl ClayFile {
    /// Reads the clay file at `path`.
    ///
    /// # Errors
    /// One line that names file, line and field: a file that cannot be read or is no clay, a unit or a value
    /// that does not fit its field, a file that is extended and not there, files that extend each other in a
    /// circle.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_stamped(path, &mut vec![])
    }

    /// [`Self::load`]; `stamps` gains every file that was read or looked for, as it was before: once one of
    /// them is out of date, another load may give another clay.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_stamped(path: &Path, stamps: &mut Vec<FileStamp>) -> Result<Self, SceneError> {
        let source = find(path, stamps).unwrap_or_else(|| Source::File(path.to_path_buf()));
        Reader { chain: vec![], stamps }.load(&source)
    }

    /// Reads the text of a clay file that stands nowhere: the clays that it extends are those of this crate
    /// or in `assets/clays`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn from_ron(text: &str) -> Result<Self, SceneError> {
        let mut stamps = vec![];
        Reader { chain: vec![], stamps: &mut stamps }.read(text, "clay", Path::new(""))
    }

    /// The clay of this file where `before` was: the softening about tools, which belongs to the hand and not
    /// to the clay, stays unless the file or one that it extends names it.
    pub fn in_place_of(&self, before: &ClayMaterial) -> ClayMaterial {
        let mut material = self.material;
        for name in ["softening", "softening_length"].into_iter().filter(|name| !self.named.contains(name)) {
            let mut before = *before;
            if let (Some(new), Some(old)) = (number_mut(&mut material, name), number_mut(&mut before, name)) {
                *new = *old;
            }
        }
        material
    }
}

/// A text of a clay.
#[derive(Clone, Debug, PartialEq)]
enum Source {
    File(PathBuf),
    BuiltIn(&'static str, &'static str),
}

impl Source {
    /// What to call it in errors.
    fn name(&self) -> String {
        match self {
            Self::File(path) => named(path),
            Self::BuiltIn(name, _) => (*name).to_string(),
        }
    }

    /// What tells it from every other one.
    fn identity(&self) -> PathBuf {
        match self {
            Self::File(path) => path.canonicalize().unwrap_or_else(|_| path.clone()),
            Self::BuiltIn(name, _) => PathBuf::from(name),
        }
    }
}

/// The clay at `path`, or, for a bare file name, in [`FOLDER`] or of this crate.
fn find(path: &Path, stamps: &mut Vec<FileStamp>) -> Option<Source> {
    let mut places = vec![path.to_path_buf()];
    let bare = path.file_name().filter(|_| path.components().count() == 1 || path.starts_with(FOLDER));
    places.extend(bare.map(|name| Path::new(FOLDER).join(name)));
    for place in places {
        // A file that is not there now may be there later.
        stamps.push(FileStamp::of(&place));
        if place.exists() {
            return Some(Source::File(place));
        }
    }
    let (name, text) = BUILT_IN.iter().find(|(name, _)| bare.is_some_and(|bare| bare == *name))?;
    Some(Source::BuiltIn(name, text))
}

/// The clay that a file of `folder` names `reference`: in that folder, or where every clay is looked for.
fn find_from(reference: &str, folder: &Path, stamps: &mut Vec<FileStamp>) -> Option<Source> {
    let beside = folder.join(reference);
    stamps.push(FileStamp::of(&beside));
    if beside.exists() { Some(Source::File(beside)) } else { find(Path::new(reference), stamps) }
}

/// The clay that a scene, the file `scene` in `folder`, names `reference`; see [`ClayFile::load_stamped`].
pub(super) fn load_from(
    reference: &str,
    scene: &str,
    folder: &Path,
    stamps: &mut Vec<FileStamp>,
) -> Result<ClayFile, SceneError> {
    let source = find_from(reference, folder, stamps).ok_or_else(|| SceneError::Params {
        file: scene.to_string(),
        error: ParamsError::new("material", quoted(reference), missing(folder)),
    })?;
    Reader { chain: vec![], stamps }.load(&source)
}

/// What to say of a file that is nowhere.
fn missing(folder: &Path) -> String {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let names = BUILT_IN.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    format!("is neither in {} nor in {FOLDER} nor one of {names}", named(folder))
}

/// Reads files that extend each other.
struct Reader<'a> {
    /// The files on the way here: their identities and names.
    chain: Vec<(PathBuf, String)>,
    stamps: &'a mut Vec<FileStamp>,
}

impl Reader<'_> {
    fn load(&mut self, source: &Source) -> Result<ClayFile, SceneError> {
        let name = source.name();
        self.chain.push((source.identity(), name.clone()));
        match source {
            Source::BuiltIn(_, text) => self.read(text, &name, Path::new("")),
            Source::File(path) => {
                self.stamps.push(FileStamp::of(path));
                let text = read_text(path, BYTES_MAX, "clay")?;
                self.read(&text, &name, path.parent().unwrap_or(Path::new("")))
            }
        }
    }

    /// The clay of a text whose file, called `file`, lies in `folder`.
    fn read(&mut self, text: &str, file: &str, folder: &Path) -> Result<ClayFile, SceneError> {
        let sheet = Sheet::read(text, file)?;
        let fault = |(line, column): Place, error: ParamsError| {
            let message = error.to_string();
            SceneError::Parse { file: file.to_string(), line, column, message }
        };
        let mut clay = match sheet.entry("extends") {
            Some((place, Value::Text(reference))) => self.base(reference, file, folder, *place)?,
            _ => ClayFile { name: stem(file), material: ClayMaterial::default(), warnings: vec![], named: vec![] },
        };
        clay.name = match sheet.entry("name") {
            Some((_, Value::Text(name))) => name.clone(),
            _ => stem(file),
        };
        for entry in &sheet.entries {
            set(&mut clay.material, entry).map_err(|error| fault(entry.place, error))?;
            clay.named.push(entry.field.name);
        }
        clay.material.validate().map_err(|error| match sheet.place(error.name) {
            Some(place) => fault(place, error),
            None => SceneError::Params { file: file.to_string(), error },
        })?;
        for ((line, column), key, meant) in &sheet.unknown {
            let guess = meant.map(|name| format!("; did you mean `{name}`?")).unwrap_or_default();
            clay.warnings.push(format!("{file}:{line}:{column}: unknown key `{}` is left out{guess}", short(key)));
        }
        Ok(clay)
    }

    /// The clay that `file` of `folder` extends.
    fn base(&mut self, reference: &str, file: &str, folder: &Path, place: Place) -> Result<ClayFile, SceneError> {
        let fault = |reason: String| {
            let message = ParamsError::new("extends", quoted(reference), reason).to_string();
            SceneError::Parse { file: file.to_string(), line: place.0, column: place.1, message }
        };
        let source = find_from(reference, folder, self.stamps).ok_or_else(|| fault(missing(folder)))?;
        let identity = source.identity();
        if let Some(first) = self.chain.iter().position(|(seen, _)| *seen == identity) {
            let circle: Vec<&str> = self.chain[first..].iter().map(|(_, name)| name.as_str()).collect();
            return Err(fault(format!("goes in a circle: {} -> {}", circle.join(" -> "), source.name())));
        }
        if self.chain.len() >= CHAIN_MAX {
            return Err(fault(format!("is the end of a chain of more than {CHAIN_MAX} files")));
        }
        self.load(&source)
    }
}

impl Sheet {
    /// Place and value of a key.
    fn entry(&self, name: &str) -> Option<(&Place, &Value)> {
        self.entries.iter().find(|entry| entry.field.name == name).map(|entry| (&entry.place, &entry.value))
    }

    /// Where a number is given, be it one of the law's.
    fn place(&self, name: &str) -> Option<Place> {
        let inner = |entry: &Entry| match &entry.value {
            Value::Law(_, numbers) => numbers.iter().find(|number| number.field.name == name).map(|number| number.place),
            _ => None,
        };
        let own = |entry: &Entry| (entry.field.name == name).then_some(entry.place);
        self.entries.iter().find_map(|entry| own(entry).or_else(|| inner(entry)))
    }
}

/// Writes what an entry says into the material.
fn set(material: &mut ClayMaterial, entry: &Entry) -> Result<(), ParamsError> {
    if let Value::Law(name, numbers) = &entry.value {
        let mut given = vec![];
        for number in numbers {
            given.push((number.field.name, si(number)?));
        }
        let number = |name: &str| given.iter().find(|(given, _)| *given == name).map(|(_, value)| *value);
        material.law = law(name, number, material.law).map_err(|missing| {
            ParamsError::new("law", name, format!("needs `{missing}`, which no file that is extended gives"))
        })?;
    } else if let Value::Weld(weld) = entry.value {
        material.weld = weld;
    } else if let Some(number) = number_mut(material, entry.field.name) {
        *number = si(entry)?;
    }
    Ok(())
}

/// The number of an entry in SI units.
fn si(entry: &Entry) -> Result<f64, ParamsError> {
    match (&entry.value, entry.field.kind) {
        (Value::Number(number), _) => Ok(*number),
        (Value::Text(text), Kind::Number(dimension)) => {
            dimension.read(text).map_err(|reason| ParamsError::new(entry.field.name, quoted(text), reason))
        }
        _ => Err(ParamsError::new(entry.field.name, "?", "must be a number")),
    }
}

/// A text as it stands in the file, unless it is long.
fn quoted(text: &str) -> String {
    format!("{:?}", short(text))
}

/// The name of a file without folders and endings.
fn stem(file: &str) -> String {
    let name = Path::new(file).file_name().map_or(file.into(), |name| name.to_string_lossy());
    name.strip_suffix(ENDING).unwrap_or(&name).to_string()
}

#[cfg(test)]
mod tests;
