//! What can be wrong with a scene or a mesh file, each said in one line.

use crate::sim::params::ParamsError;

/// Why a scene cannot be read or built. Every message is one line that names the file and, where there is
/// one, the line, column and field.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A file that cannot be read.
    #[error("{file}: {error}")]
    Read {
        /// The file as named.
        file: String,
        /// What the system said.
        error: std::io::Error,
    },
    /// A file that is too long for what it is to be, or does not end.
    #[error("{file}: is longer than {}, the most that a {kind} may have", bytes_text(*.most as f64))]
    TooLarge {
        /// The file as named.
        file: String,
        /// What it is to be.
        kind: &'static str,
        /// The most \[bytes\].
        most: u64,
    },
    /// Text that is not a scene.
    #[error("{file}:{line}:{column}: {message}")]
    Parse {
        /// The scene file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong there.
        message: String,
    },
    /// A value out of its range.
    #[error("{file}: {error}")]
    Params {
        /// The scene file.
        file: String,
        /// The field, its value and what it has to be.
        error: ParamsError,
    },
    /// A mesh file that is damaged, empty or of an unknown format.
    #[error("{file}:{} {reason}", .line.map(|line| format!("{line}:")).unwrap_or_default())]
    Mesh {
        /// The mesh file.
        file: String,
        /// Line, from 1, in formats of text.
        line: Option<usize>,
        /// What is wrong with it.
        reason: String,
    },
    /// More memory than there is.
    #[error(
        "{file}: cell_width = {cell_width} gives about {particles:.3e} particles on {cells:.3e} cells and takes {}, over the limit of {}; the smallest cell_width that fits is {fits:.3e} m",
        bytes_text(*.bytes), bytes_text(*.limit)
    )]
    Memory {
        /// The scene file.
        file: String,
        /// Cell width asked for \[m\].
        cell_width: f64,
        /// Particles it gives.
        particles: f64,
        /// Cells of the grid.
        cells: f64,
        /// Memory it takes \[bytes\].
        bytes: f64,
        /// Memory allowed \[bytes\].
        limit: f64,
        /// The smallest cell width within the limit \[m\].
        fits: f64,
    },
    /// A piece of clay too thin for the resolution.
    #[error("{file}: clay[{body}] ({name}) is too thin for cell_width = {cell_width}: it holds no particle")]
    NoParticles {
        /// The scene file.
        file: String,
        /// Index in the scene's list of clay.
        body: usize,
        /// The piece in words.
        name: String,
        /// Cell width \[m\].
        cell_width: f64,
    },
    /// Clay beyond the walls.
    #[error(
        "{file}: clay[{body}] ({name}) reaches outside the domain along {axis}: {low:.6} .. {high:.6} m, walls at {wall_low:.6} and {wall_high:.6} m"
    )]
    OutsideDomain {
        /// The scene file.
        file: String,
        /// Index in the scene's list of clay.
        body: usize,
        /// The piece in words.
        name: String,
        /// x, y or z.
        axis: char,
        /// Least coordinate of the clay \[m\].
        low: f64,
        /// Greatest coordinate of the clay \[m\].
        high: f64,
        /// Low wall \[m\].
        wall_low: f64,
        /// High wall \[m\].
        wall_high: f64,
    },
}

/// A number of bytes in MiB or, from 1 GiB on, in GiB.
pub(super) fn bytes_text(bytes: f64) -> String {
    let mib = bytes / f64::from(1 << 20);
    if mib < 1024.0 { format!("{mib:.0} MiB") } else { format!("{:.1} GiB", mib / 1024.0) }
}
