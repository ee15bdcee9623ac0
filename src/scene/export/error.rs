//! Why an export failed.

use crate::sim::params::ParamsError;
use std::io;
use std::path::PathBuf;

/// Why a file was not written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The extension names no format that can be written.
    #[error("{}: unknown file extension; known: {known}", path.display())]
    UnknownFormat {
        /// The file asked for.
        path: PathBuf,
        /// The extensions that would do.
        known: &'static str,
    },
    /// An option out of its range.
    #[error("export option {0}")]
    Option(ParamsError),
    /// The file system refused.
    #[error("{}: cannot be written: {source}", path.display())]
    Io {
        /// The file asked for.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}
