//! Files that appear whole or not at all.
//!
//! A file is written beside its place under a name of its own, `.bevy_clay-PROCESS-NUMBER.tmp`, and renamed
//! when it is whole. While it is written it is locked, so that [`remove_leftovers`] tells those of runs that
//! were killed from those of runs that go on, also where a process has an earlier one's number.

use super::error::ExportError;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

const PREFIX: &str = ".bevy_clay-";
const SUFFIX: &str = ".tmp";

/// Writes beside `path` and renames.
pub(super) fn write_whole(path: &Path, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<(), ExportError> {
    Unfinished::write(path, write)?.finish()
}

/// Finds out whether a file could be written at `path`, and leaves no trace.
///
/// # Errors
/// What the system says against it: no folder, a folder in the file's place, a name that is too long, no
/// rights, no room for a single file more.
pub fn check_writable(path: &Path) -> Result<(), ExportError> {
    let error = |source| ExportError::Io { path: path.into(), source };
    match fs::symlink_metadata(path) {
        Ok(data) if data.is_dir() => return Err(error(io::ErrorKind::IsADirectory.into())),
        Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(error(e)),
        _ => {}
    }
    Unfinished::begin(path).map(drop)
}

/// Removes what runs that were killed left in `folder` of files they were writing; says how many there were.
///
/// # Errors
/// A folder that cannot be read, or a file that cannot be removed.
pub fn remove_leftovers(folder: &Path) -> io::Result<usize> {
    let mut count = 0;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if !(name.starts_with(PREFIX) && name.ends_with(SUFFIX) && entry.file_type()?.is_file()) {
            continue;
        }
        let file = match File::open(entry.path()) {
            // Another run renamed or removed it meanwhile.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            file => file?,
        };
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => continue,
            // Where there are no locks nothing tells what is whose: it stays.
            Err(TryLockError::Error(_)) => continue,
        }
        fs::remove_file(entry.path())?;
        count += 1;
    }
    Ok(count)
}

/// A file beside its place, gone when it is dropped before it got there.
struct Unfinished<'a> {
    path: &'a Path,
    temporary: PathBuf,
    /// Held open for its lock.
    file: File,
}

impl<'a> Unfinished<'a> {
    /// An empty file.
    fn begin(path: &'a Path) -> Result<Self, ExportError> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let error = |source| ExportError::Io { path: path.into(), source };
        if path.file_name().is_none() {
            return Err(error(io::ErrorKind::InvalidFilename.into()));
        }
        loop {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let temporary = path.with_file_name(format!("{PREFIX}{}-{number}{SUFFIX}", std::process::id()));
            let file = match File::create_new(&temporary) {
                // Of a process that was killed and had this number.
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => continue,
                file => file.map_err(error)?,
            };
            // Some network folders know no locks; then nobody takes the file for a leftover.
            let _ = file.lock();
            // Between the two lines above it looked like a leftover, and may have been removed as one.
            if temporary.exists() {
                return Ok(Self { path, temporary, file });
            }
        }
    }

    /// A file with its contents.
    fn write(path: &'a Path, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<Self, ExportError> {
        let unfinished = Self::begin(path)?;
        let mut out = BufWriter::new(&unfinished.file);
        let written = write(&mut out).and_then(|()| out.into_inner()?.sync_all());
        written.map_err(|source| ExportError::Io { path: path.into(), source })?;
        Ok(unfinished)
    }

    /// Puts the file in its place.
    fn finish(self) -> Result<(), ExportError> {
        fs::rename(&self.temporary, self.path).map_err(|source| ExportError::Io { path: self.path.into(), source })
    }
}

impl Drop for Unfinished<'_> {
    fn drop(&mut self) {
        // Gone already after a rename; and a temporary file that cannot be removed adds nothing to the error
        // that is told.
        let _ = fs::remove_file(&self.temporary);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is being written stays, what nobody writes any more goes, and other files are nobody's business.
    #[test]
    fn leftovers_go_and_files_under_way_stay() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        for name in [".bevy_clay-1-0.tmp", ".bevy_clay-77-3.tmp", "mine.tmp", ".other.tmp"] {
            fs::write(at(name), "left").expect("file");
        }
        let place = at("a.txt");
        let under_way = Unfinished::begin(&place).expect("begun");
        assert_eq!(remove_leftovers(folder.path()).expect("removed"), 2);
        assert!(under_way.temporary.exists() && at("mine.tmp").exists() && at(".other.tmp").exists());
        under_way.finish().expect("finished");
        assert!(place.exists() && fs::read_dir(folder.path()).expect("folder").count() == 3);
    }

    /// A folder in the file's place and a name beyond what systems take are told before anything is written;
    /// a name of 255 letters is none too long.
    #[test]
    fn places_that_take_no_file_are_told() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("taken.stl")).expect("folder");
        for name in ["taken.stl", &"n".repeat(300), "no/such/folder.stl"] {
            let error = check_writable(&at(name)).expect_err(name).to_string();
            assert!(error.contains("cannot be written"), "{error}");
        }
        assert_eq!(fs::read_dir(folder.path()).expect("folder").count(), 1);
        let long = at(&"n".repeat(255));
        check_writable(&long).expect("a place");
        write_whole(&long, |_| Ok(())).expect("written");
    }
}
