//! Mesh and particle files: STL, PLY, OBJ and 3MF in millimetres, GLB in metres.
//!
//! Every mesh goes the same way: [`print_ready`] makes it a closed, oriented manifold of separate shells,
//! [`bodies`] sorts the shells into bodies with their cavities, [`mod@simplify`] takes triangles away if that
//! is asked for, and a writer per format does the rest. A file appears whole or not at all ([`whole`]).

pub mod bodies;
mod error;
mod glb;
mod obj;
mod ply;
mod report;
pub mod simplify;
mod stl;
mod threemf;
mod unit;
pub mod whole;

pub use error::ExportError;
pub use report::{BodyReport, ExportReport};

use crate::sim::params::{Bounds, LENGTH, ParamsError};
use crate::sim::snapshot::Snapshot;
use crate::surface::mesh::Mesh;
use crate::surface::stitch::print_ready;
use bodies::{Body, bodies_of};
use serde::{Deserialize, Serialize};
use simplify::simplify_checked;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use unit::MM;
use whole::write_whole;

/// Name of the particles' file in a run's folder.
pub const PARTICLES: &str = "particles.ply";

/// Mesh file formats that can be written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExportFormat {
    /// Binary STL, mm.
    #[default]
    Stl,
    /// Binary little-endian PLY, mm.
    Ply,
    /// OBJ, mm; an object per body.
    Obj,
    /// Binary glTF 2.0, metres as its specification has it; a node per body.
    Glb,
    /// 3MF, mm; an object per body, turned so that the clay's up (+Y) is the format's (+Z).
    ThreeMf,
}

impl ExportFormat {
    /// Every format.
    pub const ALL: [Self; 5] = [Self::Stl, Self::Ply, Self::Obj, Self::Glb, Self::ThreeMf];

    /// Their extensions, as messages name them.
    pub const KNOWN: &str = ".stl, .ply, .obj, .glb or .3mf";

    /// The file extension.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Stl => "stl",
            Self::Ply => "ply",
            Self::Obj => "obj",
            Self::Glb => "glb",
            Self::ThreeMf => "3mf",
        }
    }

    /// The format that a file's extension names, upper or lower case.
    ///
    /// # Errors
    /// An extension that names none.
    pub fn from_path(path: &Path) -> Result<Self, ExportError> {
        let extension = extension(path);
        let format = Self::ALL.into_iter().find(|f| f.extension() == extension);
        format.ok_or_else(|| ExportError::UnknownFormat { path: path.into(), known: Self::KNOWN })
    }

    /// File units per metre.
    fn scale(self) -> f32 {
        if self == Self::Glb { 1.0 } else { MM }
    }

    fn write(self, out: &mut BufWriter<&File>, bodies: &[Mesh]) -> io::Result<()> {
        match self {
            Self::Stl => stl::write(out, bodies),
            Self::Ply => ply::write(out, bodies),
            Self::Obj => obj::write(out, bodies),
            Self::Glb => glb::write(out, bodies),
            Self::ThreeMf => threemf::write(out, bodies),
        }
    }
}

/// Which file a body goes into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum BodyFiles {
    /// All into one.
    #[default]
    Together,
    /// Each into its own: `name-1.stl`, `name-2.stl`, ... by falling volume. Files of an earlier export that
    /// had more bodies stay.
    Apart,
}

/// How to export; the default keeps every body and every triangle and writes one file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ExportOptions {
    /// Which file a body goes into.
    pub bodies: BodyFiles,
    /// Least volume of a body [m^3], its cavities taken off; what is smaller is left out and reported.
    pub volume_min: f64,
    /// Distance \[m\] by which simplification may move the surface, root mean square (on a ball, the worst
    /// vertex moved 1.2 to 1.9 times as far); bodies that touch along a cut may then overlap by as much.
    /// `None` for every triangle.
    pub simplify: Option<f64>,
}

/// The least volume of a body: at the greatest, that of a cube whose edge is the greatest length.
const VOLUME_MIN: Bounds = Bounds::new(
    0.0,
    LENGTH.high * LENGTH.high * LENGTH.high,
    " m^3",
    "must be a volume in cubic metres, 0 for every body",
    "a cube 10 km high",
);

impl ExportOptions {
    /// Checks the ranges.
    ///
    /// # Errors
    /// The first option out of its range.
    pub fn validate(&self) -> Result<(), ParamsError> {
        VOLUME_MIN.check("volume_min", self.volume_min)?;
        self.simplify.map_or(Ok(()), |error| LENGTH.check("simplify", error))
    }
}

/// Writes a mesh as separate, closed bodies with outward triangles into one file of the extension's format.
///
/// # Errors
/// An extension that no [`ExportFormat`] has, or a file that cannot be written; then nothing is left at
/// `path` that was not there before.
pub fn write_mesh(path: &Path, mesh: &Mesh) -> Result<ExportReport, ExportError> {
    write_bodies(path, mesh, &ExportOptions::default())
}

/// [`write_mesh`] with options.
///
/// # Errors
/// As [`write_mesh`], or an option out of its range. Of bodies with files of their own each is written for
/// itself: one that fails costs no other, and [`ExportError::Bodies`] says what was written.
pub fn write_bodies(path: &Path, mesh: &Mesh, options: &ExportOptions) -> Result<ExportReport, ExportError> {
    let format = ExportFormat::from_path(path)?;
    options.validate().map_err(ExportError::Option)?;
    let (mesh, repairs) = print_ready(mesh);
    let mut report = ExportReport { repairs, ..ExportReport::default() };
    let (mut meshes, mut bodies) = (Vec::new(), Vec::new());
    for body in bodies_of(&mesh) {
        if body.volume < options.volume_min {
            report.dropped_bodies += 1;
            report.dropped_volume += body.volume;
            continue;
        }
        let (mut mesh, body) = finished(body, options.simplify);
        mesh.positions.iter_mut().flatten().for_each(|x| *x *= format.scale());
        meshes.push(mesh);
        bodies.push(body);
    }
    match options.bodies {
        BodyFiles::Together => {
            write_whole(path, |out| format.write(out, &meshes))?;
            report.files.push(path.to_path_buf());
            report.bodies = bodies;
            Ok(report)
        }
        BodyFiles::Apart => {
            let mut errors = Vec::new();
            for ((number, mesh), body) in (1..).zip(meshes.chunks(1)).zip(bodies) {
                let file = numbered(path, number);
                match write_whole(&file, |out| format.write(out, mesh)) {
                    Ok(()) => {
                        report.files.push(file);
                        report.bodies.push(body);
                    }
                    Err(error) => errors.push(error),
                }
            }
            let mut others = errors.into_iter();
            let Some(first) = others.next() else { return Ok(report) };
            Err(ExportError::Bodies { first: Box::new(first), others: others.collect(), written: Box::new(report) })
        }
    }
}

/// A body's mesh as it is to be written.
fn finished(body: Body, simplify: Option<f64>) -> (Mesh, BodyReport) {
    let Body { mut mesh, volume, cavities } = body;
    let triangles_extracted = mesh.triangles.len();
    let mut not_simplified = None;
    match simplify.map(|error| simplify_checked(&mesh, error)) {
        Some(Ok(simpler)) => mesh = simpler,
        Some(Err(reason)) => not_simplified = Some(reason),
        None => {}
    }
    let triangles = mesh.triangles.len();
    (mesh, BodyReport { volume, cavities, triangles_extracted, triangles, not_simplified })
}

/// `name-3.stl` of `name.stl`: the file of the third body where each has its own.
pub fn numbered(path: &Path, number: usize) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("-{number}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Whether `file` is [`numbered`] of `path` for some body.
pub fn is_numbered(path: &Path, file: &Path) -> bool {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let number = stem.rsplit('-').next().and_then(|digits| digits.parse().ok());
    number.is_some_and(|number| number > 0 && numbered(path, number) == *file)
}

/// Writes a snapshot's particles as a binary little-endian PLY point cloud: position x y z \[mm\], velocity vx
/// vy vz [m/s], volume ratio J, side of the first cut (-1, 0, 1), id.
///
/// # Errors
/// An extension other than `ply`, or a file that cannot be written.
pub fn write_particles(path: &Path, snapshot: &Snapshot) -> Result<(), ExportError> {
    if extension(path) != "ply" {
        return Err(ExportError::UnknownFormat { path: path.into(), known: ".ply" });
    }
    write_whole(path, |out| ply::write_particles(out, snapshot))
}

/// Writes a text file whole.
///
/// # Errors
/// A file that cannot be written; then nothing is left at `path` that was not there before.
pub fn write_text(path: &Path, text: &str) -> Result<(), ExportError> {
    write_whole(path, |out| out.write_all(text.as_bytes()))
}

/// A file `clay-001` and so on of `folder`, which need not be there, that no file and no piece of an earlier
/// export has the name of.
///
/// # Errors
/// A folder without a free name.
pub fn free_file(folder: &Path, format: ExportFormat) -> Result<PathBuf, ExportError> {
    const FILES_MAX: u32 = 10_000;
    // Neither the file nor that of its first piece.
    let name = |number: u32, piece: &str| folder.join(format!("clay-{number:03}{piece}.{}", format.extension()));
    (1..FILES_MAX)
        .find(|number| ["", "-1"].iter().all(|piece| !name(*number, piece).exists()))
        .map(|number| name(number, ""))
        .ok_or_else(|| {
            let source = io::Error::new(io::ErrorKind::AlreadyExists, "there is no free name for another file");
            ExportError::Io { path: folder.into(), source }
        })
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

#[cfg(test)]
mod tests;
