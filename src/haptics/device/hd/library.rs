//! Finding and loading libHD: never linked, never unloaded.

use super::sys::Api;
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::path::Path;
use std::sync::Mutex;

/// The environment's word for where libHD is: a file, tried before all others.
pub const VARIABLE: &str = "OPENHAPTICS_LIBHD";
/// Where libHD may be, best first. The first two of a system are for any version, the others those that are
/// known.
#[cfg(not(windows))]
pub const NAMES: &[&str] =
    &["libHD.so", "libHD.so.3.4", "/usr/lib/libHD.so.3.4.0", "/usr/lib/x86_64-linux-gnu/libHD.so.3.4", "libHD.so.3.0"];
/// Where libHD may be, best first; the folder is what its installer proposes, from memory.
#[cfg(windows)]
pub const NAMES: &[&str] = &["HD.dll", r"C:\OpenHaptics\Developer\3.5.0\lib\x64\HD.dll"];
/// What libHD itself needs, with what brings it. Found by its own loader, so by name.
#[cfg(not(windows))]
pub const DEPENDENCIES: &[(&str, &str)] = &[
    ("libPhantomIOLib42.so", "the Touch device driver of 3D Systems"),
    ("libncurses.so.5", "the package libncurses5"),
    ("libtinfo.so.5", "the package libtinfo5"),
    ("libstdc++.so.6", "the package libstdc++6"),
];
/// What libHD itself needs, with what brings it.
#[cfg(windows)]
pub const DEPENDENCIES: &[(&str, &str)] = &[("PhantomIOLib42.dll", "the Touch device driver of 3D Systems")];

/// Parts of a loader's error, and what helps against it; the first that fits is given.
const HINTS: [(&str, &str); 10] = [
    ("PhantomIOLib", "libHD is there and the driver is not: install the Touch device driver of 3D Systems"),
    ("libncurses.so.5", "install libncurses5 (Debian 12, Ubuntu up to 22.04: apt-get install libncurses5)"),
    ("libtinfo.so.5", "install libtinfo5 (Debian 12, Ubuntu up to 22.04: apt-get install libtinfo5)"),
    ("lacks ", "another library bears the name of libHD: set OPENHAPTICS_LIBHD to the file of OpenHaptics 3.4"),
    ("wrong ELF class", "this libHD is for 32 bits: install OpenHaptics for 64 bits"),
    ("invalid ELF header", "this file is no library: set OPENHAPTICS_LIBHD to the file of OpenHaptics 3.4"),
    ("version `", "this system's C or C++ library is too old for this libHD"),
    ("ermission denied", "this user may not read the library: look at its file's permissions"),
    ("os error 193", "this HD.dll is for 32 bits, or no library: install OpenHaptics for 64 bits"),
    ("os error 126", "HD.dll or something it needs is not there: install OpenHaptics and the Touch device driver"),
];
/// What helps where there is nothing by any of the names.
const HINT_NONE: &str =
    "install OpenHaptics and the Touch device driver of 3D Systems, or set OPENHAPTICS_LIBHD to the file libHD.so (HD.dll)";

/// Why there is no libHD: every file that was tried, with the loader's own words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadError {
    /// The file or name, and what the loader said.
    pub tries: Vec<(OsString, String)>,
}

impl LoadError {
    /// What helps: for the try that came furthest.
    pub fn hint(&self) -> &'static str {
        // A try that failed for what the library needs, or for what it is, says more than five that found no
        // file.
        let fits = |(part, _): &&(&str, &str)| self.tries.iter().any(|(_, error)| error.contains(part));
        HINTS.iter().find(fits).map_or(HINT_NONE, |(_, hint)| hint)
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no library of a Touch. {}.", self.hint())?;
        self.tries.iter().try_for_each(|(name, error)| {
            let name = name.to_string_lossy();
            // Most loaders begin with it.
            if error.starts_with(&*name) { write!(f, "\n  {error}") } else { write!(f, "\n  {name}: {error}") }
        })
    }
}

impl std::error::Error for LoadError {}

/// A libHD that was loaded.
#[derive(Clone, Copy, Debug)]
pub struct HdLibrary {
    /// Its functions.
    pub api: &'static Api,
    /// By what it was found.
    pub name: &'static OsStr,
}

/// Those that were loaded, each for good: the driver keeps threads of its own, which would run on in memory
/// that is gone.
static LOADED: Mutex<Vec<HdLibrary>> = Mutex::new(Vec::new());

/// What is tried without a file of one's own: the environment's, and then [`NAMES`].
pub fn candidates() -> Vec<OsString> {
    let own = std::env::var_os(VARIABLE).filter(|name| !name.is_empty());
    // Who names a file wants that one, and no other in its place.
    own.map_or_else(|| NAMES.iter().map(OsString::from).collect(), |own| vec![own])
}

/// Loads libHD from `file`, or from the first of the [`candidates`] that has it.
///
/// # Errors
/// None has it: each with the loader's own words.
pub fn load(file: Option<&Path>) -> Result<HdLibrary, LoadError> {
    let names = file.map_or_else(candidates, |file| vec![file.into()]);
    let mut tries = vec![];
    for name in names {
        match load_one(&name) {
            Ok(library) => return Ok(library),
            Err(error) => tries.push((name, error)),
        }
    }
    Err(LoadError { tries })
}

/// Loads the library of that name, or hands out what was loaded.
fn load_one(name: &OsStr) -> Result<HdLibrary, String> {
    let mut loaded = LOADED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(library) = loaded.iter().find(|library| library.name == name) {
        return Ok(*library);
    }
    // SAFETY: loading runs the library's own initialisers: that of 3D Systems, or the one that the user
    // names.
    let library = unsafe { open(name) }.map_err(|error| plain(&error))?;
    // SAFETY: a library with all of HDAPI's names is taken to be it, and it is never unloaded.
    let api = unsafe { Api::of(&library) }.map_err(|missing| lack(&missing))?;
    std::mem::forget(library);
    let found = HdLibrary { api: Box::leak(Box::new(api)), name: Box::leak(name.to_owned().into_boxed_os_str()) };
    loaded.push(found);
    Ok(found)
}

/// What is wrong with a library without these functions.
fn lack(missing: &[&str]) -> String {
    match missing {
        [first] => format!("it lacks {first}"),
        [first, others @ ..] => format!("it lacks {first} and {} others that libHD has", others.len()),
        [] => String::new(),
    }
}

/// Loads with all its symbols bound, so that none is missing later, within the loop.
///
/// # Safety
/// The library's initialisers are run.
#[cfg(unix)]
unsafe fn open(name: &OsStr) -> Result<libloading::Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // SAFETY: the caller's promise.
    unsafe { Library::open(Some(name), RTLD_NOW | RTLD_LOCAL) }.map(Into::into)
}

/// Loads a library.
///
/// # Safety
/// The library's initialisers are run.
#[cfg(not(unix))]
unsafe fn open(name: &OsStr) -> Result<libloading::Library, libloading::Error> {
    // SAFETY: the caller's promise.
    unsafe { libloading::Library::new(name) }
}

/// The system's own words for an error.
fn plain(error: &libloading::Error) -> String {
    // On Windows the words are those of the error below.
    std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string)
}

/// Whether the loader finds what libHD needs: each with its words if not.
pub fn dependencies() -> Vec<(&'static str, &'static str, Result<(), String>)> {
    let has = |name: &str| {
        // SAFETY: these are what libHD would load itself; system libraries and the driver's.
        let library = unsafe { open(OsStr::new(name)) }.map_err(|error| plain(&error))?;
        // Never unloaded: see `LOADED`.
        std::mem::forget(library);
        Ok(())
    };
    DEPENDENCIES.iter().map(|(name, package)| (*name, *package, has(name))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hint(errors: &[&str]) -> &'static str {
        LoadError { tries: errors.iter().map(|e| ("libHD.so".into(), (*e).to_string())).collect() }.hint()
    }

    #[test]
    fn hints_fit_what_loaders_say() {
        let none = "libHD.so: cannot open shared object file: No such file or directory";
        assert_eq!(hint(&[none]), HINT_NONE);
        let driver = "libPhantomIOLib42.so: cannot open shared object file: No such file or directory";
        assert!(hint(&[none, driver]).contains("Touch device driver"), "the try that came furthest");
        assert!(hint(&["libncurses.so.5: cannot open shared object file: No such file or directory"]).contains("libncurses5"));
        assert!(hint(&["/x/libHD.so: wrong ELF class: ELFCLASS32"]).contains("32 bits"));
        assert!(hint(&["it lacks hdInitDevice"]).contains("another library"));
        assert!(hint(&["%1 is not a valid Win32 application. (os error 193)"]).contains("64 bits"));
        assert!(hint(&["/lib/libc.so.6: version `GLIBC_9.9' not found (required by libHD.so)"]).contains("too old"));
    }

    #[test]
    fn a_library_that_is_not_there_is_told_in_the_loaders_words() {
        let error = load(Some(Path::new("/no/such/libHD.so"))).expect_err("no file");
        assert_eq!(error.tries.len(), 1);
        assert!(error.to_string().contains("/no/such/libHD.so") && error.to_string().contains(HINT_NONE), "{error}");
        #[cfg(target_os = "linux")]
        assert!(error.tries[0].1.contains("cannot open shared object file"), "{error}");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn another_library_is_told_by_what_it_lacks() {
        let error = load(Some(Path::new("libc.so.6"))).expect_err("no libHD");
        assert!(error.to_string().contains("hdInitDevice") && error.hint().contains("another library"), "{error}");
    }
}
