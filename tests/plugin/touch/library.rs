//! The library that stands for libHD, and a process of its own for each test that has one: an app finds it by
//! its environment, and a process has one device.

use libloading::Library;
use std::ffi::{CString, c_char};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

/// Where a test's own process has the library's true place from.
const CHILD: &str = "CLAY_FAKE_HD";
/// Where an app has libHD's place from.
const LIBRARY: &str = "OPENHAPTICS_LIBHD";

/// Builds the library, which no test of this crate is linked with, and finds it. None in the published
/// package, which has no devices to test with.
pub(super) static BUILT: LazyLock<Option<PathBuf>> = LazyLock::new(|| {
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fake_hd/Cargo.toml");
    if !package.exists() {
        return None;
    }
    let test = std::env::current_exe().expect("a path");
    // TARGET/PROFILE/deps/plugin-HASH.
    let target = test.ancestors().nth(3).expect("a target folder");
    let built = Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--manifest-path"])
        .arg(package)
        .arg("--target-dir")
        .arg(target)
        .status()
        .expect("cargo");
    assert!(built.success(), "no library to test with: {built}");
    let name = format!("{}fake_hd{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    Some(target.join("debug").join(name))
});

/// Runs `test` in a process of its own that is to take `file` for libHD, the library's own without one: what
/// it logged. None in that process, and where there is no library.
pub(super) fn alone(name: &str, file: Option<&Path>, test: impl FnOnce()) -> Option<String> {
    if std::env::var_os(CHILD).is_some() {
        test();
        return None;
    }
    let built = BUILT.as_ref()?;
    let output = Command::new(std::env::current_exe().expect("a path"))
        .args([name, "--exact", "--nocapture"])
        .env(CHILD, built)
        .env(LIBRARY, file.unwrap_or(built))
        .env("NO_COLOR", "1")
        .env_remove("FAKEHD_PLAN")
        .env_remove("RUST_LOG")
        .output()
        .expect("a process");
    let log = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned()).concat();
    assert!(output.status.success() && log.contains("1 passed"), "{name}: {}\n{log}", output.status);
    Some(log)
}

/// The library's true place, in a test's own process.
pub(super) fn true_place() -> PathBuf {
    std::env::var_os(CHILD).expect("a process of a test").into()
}

/// Entries of the library's own, in a test's own process.
pub(super) struct Control {
    plan: unsafe extern "system" fn(*const c_char) -> u8,
    hand: unsafe extern "system" fn(f64, f64, f64),
    motors: unsafe extern "system" fn(*mut f64),
    count: unsafe extern "system" fn(*const c_char) -> u64,
}

impl Control {
    /// Of the library that the app takes for libHD.
    pub(super) fn new() -> Self {
        // SAFETY: the library of the package `fake_hd`, with the types of its `control`; it is never
        // unloaded.
        unsafe {
            let library = Box::leak(Box::new(Library::new(std::env::var_os(LIBRARY).expect("a file")).expect("the library")));
            Self {
                plan: *library.get(b"fakehd_plan").expect("an entry"),
                hand: *library.get(b"fakehd_hand").expect("an entry"),
                motors: *library.get(b"fakehd_motors").expect("an entry"),
                count: *library.get(b"fakehd_count").expect("an entry"),
            }
        }
    }

    /// Has that happen to the device from now on, see `tests/fake_hd/src/plan.rs`.
    pub(super) fn plan(&self, text: &str) {
        let plan = CString::new(text).expect("a text");
        // SAFETY: a text.
        assert_eq!(unsafe { (self.plan)(plan.as_ptr()) }, 1, "{text:?}");
    }

    /// How far up the hand means to be, in the device's frame \[m\].
    pub(super) fn hand(&self, height: f64) {
        // SAFETY: takes numbers.
        unsafe { (self.hand)(0.0, height, 0.0) }
    }

    /// Force on the motors \[N\].
    pub(super) fn motors(&self) -> [f64; 3] {
        let mut force = [0.0; 3];
        // SAFETY: room for three.
        unsafe { (self.motors)(force.as_mut_ptr()) };
        force
    }

    /// How often something happened.
    pub(super) fn count(&self, what: &str) -> u64 {
        let what = CString::new(what).expect("a text");
        // SAFETY: a text.
        unsafe { (self.count)(what.as_ptr()) }
    }
}
