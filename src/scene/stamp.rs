//! What tells that a file has changed.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// A file, or its absence, at some moment: its length and when it was last written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileStamp {
    path: PathBuf,
    /// None if there is no file.
    state: Option<(u64, Option<SystemTime>)>,
}

impl FileStamp {
    /// The file at `path` now.
    pub fn of(path: &Path) -> Self {
        let state = std::fs::metadata(path).ok().map(|data| (data.len(), data.modified().ok()));
        Self { path: path.to_path_buf(), state }
    }

    /// Where the file is or would be.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The same file now.
    pub fn renewed(&self) -> Self {
        Self::of(&self.path)
    }
}
