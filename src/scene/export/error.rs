//! Why an export failed.

use super::report::ExportReport;
use crate::scene::line::named;
use crate::sim::params::ParamsError;
use std::io;
use std::path::PathBuf;

/// Why a file was not written, in one line that names it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The extension names no format that can be written.
    #[error("{}: unknown file extension; known: {known}", named(path))]
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
    #[error("{}: cannot be written: {source}", named(path))]
    Io {
        /// The file asked for.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Some bodies of those that have files of their own were not written.
    #[error("{first}; {} of {} bodies are written", written.bodies.len(), written.bodies.len() + 1 + others.len())]
    Bodies {
        /// Why the first of them was not.
        first: Box<Self>,
        /// Why the others were not.
        others: Vec<Self>,
        /// What was written.
        written: Box<ExportReport>,
    },
}
