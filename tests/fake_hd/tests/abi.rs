//! The library as C sees it: every entry is there and does what HDAPI's documents say of it.

use libloading::{Library, Symbol};
use std::ffi::{CString, c_char, c_int, c_long, c_uchar, c_uint, c_ulong, c_ushort, c_void};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

/// What libHD 3.0 and 3.4 export, both.
const ENTRIES: [&str; 36] = [
    "hdBeginFrame",
    "hdCheckCalibration",
    "hdCheckCalibrationStyle",
    "hdDeploymentLicense",
    "hdDisable",
    "hdDisableDevice",
    "hdEnable",
    "hdEndFrame",
    "hdGetBooleanv",
    "hdGetCurrentDevice",
    "hdGetDoublev",
    "hdGetError",
    "hdGetErrorString",
    "hdGetFloatv",
    "hdGetIntegerv",
    "hdGetLongv",
    "hdGetSchedulerTimeStamp",
    "hdGetString",
    "hdInitDevice",
    "hdIsEnabled",
    "hdMakeCurrentDevice",
    "hdScaleGimbalAngles",
    "hdScheduleAsynchronous",
    "hdScheduleSynchronous",
    "hdSetBooleanv",
    "hdSetDoublev",
    "hdSetFloatv",
    "hdSetIntegerv",
    "hdSetLongv",
    "hdSetSchedulerRate",
    "hdStartScheduler",
    "hdStopScheduler",
    "hdUnschedule",
    "hdUpdateCalibration",
    "hdUpdateCalibrationMessage",
    "hdWaitForCompletion",
];

static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let name = format!("{}fake_hd{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let test = std::env::current_exe().expect("a path");
    let file: PathBuf = test
        .ancestors()
        .skip(1)
        .map(|folder| folder.join(&name))
        .find(|file| file.exists())
        .expect("the library beside the test");
    // SAFETY: the library of this package.
    unsafe { Library::new(file) }.expect("the library")
});

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
struct ErrorInfo {
    code: c_uint,
    internal: c_int,
    handle: c_uint,
}

/// An entry by its name, of a type.
macro_rules! entry {
    ($name:literal: fn($($type:ty),*) $(-> $result:ty)?) => {{
        // SAFETY: the type is HDAPI's.
        let entry: Symbol<'_, unsafe extern "system" fn($($type),*) $(-> $result)?> = unsafe { LIBRARY.get($name.as_bytes()) }.expect($name);
        *entry
    }};
}

/// Calls an entry.
macro_rules! call {
    ($name:literal: fn($($type:ty),*) $(-> $result:ty)?; $($argument:expr),*) => {{
        let entry = entry!($name: fn($($type),*) $(-> $result)?);
        // SAFETY: arguments of HDAPI's types, pointers with room for all values.
        unsafe { entry($($argument),*) }
    }};
}

/// Anew, by a plan; one test at a time.
fn plan(text: &str) -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    let guard = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let text = CString::new(text).expect("a text");
    assert_eq!(call!("fakehd_reset": fn(*const c_char) -> c_uchar; text.as_ptr()), 1);
    guard
}

fn open() -> c_uint {
    call!("hdInitDevice": fn(*const c_char) -> c_uint; std::ptr::null())
}

fn error() -> ErrorInfo {
    call!("hdGetError": fn() -> ErrorInfo;)
}

fn double(name: c_uint) -> [f64; 16] {
    let mut values = [0.0; 16];
    call!("hdGetDoublev": fn(c_uint, *mut f64); name, values.as_mut_ptr());
    values
}

fn advance(ticks: u64) -> u64 {
    call!("fakehd_advance": fn(u64) -> u64; ticks)
}

type Callback = unsafe extern "system" fn(*mut c_void) -> c_uint;

fn schedule(callback: Callback, priority: u16) -> c_ulong {
    call!("hdScheduleAsynchronous": fn(Callback, *mut c_void, c_ushort) -> c_ulong; callback, std::ptr::null_mut(), priority)
}

#[test]
fn every_entry_is_there() {
    for name in ENTRIES {
        // SAFETY: looked up, not called.
        assert!(unsafe { LIBRARY.get::<*const c_void>(name.as_bytes()) }.is_ok(), "{name}");
    }
}

#[test]
fn errors_come_by_value_newest_first() {
    let _one = plan("virtual");
    let none = CString::new("nobody").unwrap();
    assert_eq!(call!("hdInitDevice": fn(*const c_char) -> c_uint; none.as_ptr()), 0xffff_ffff);
    call!("hdEnable": fn(c_uint); 0x9999);
    assert_eq!(error().code, 0x0100);
    assert_eq!(error(), ErrorInfo { code: 0x0300, internal: -7, handle: error().handle });
    assert_eq!(error().code, 0);
    assert_eq!((open(), open(), error().code), (0, 0xffff_ffff, 0x0301));
}

#[test]
fn a_thread_has_no_device_until_it_takes_one() {
    let _one = plan("virtual");
    open();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            assert_eq!(call!("hdGetCurrentDevice": fn() -> c_uint;), 0xffff_ffff);
            double(0x2050);
            assert_eq!(error().code, 0x0104);
            call!("hdMakeCurrentDevice": fn(c_uint); 0);
            double(0x2050);
            assert_eq!(error().code, 0);
        });
    });
}

#[test]
fn values_have_types() {
    let _one = plan("virtual;button=3");
    open();
    double(0x2000);
    assert_eq!(error().code, 0x0103, "buttons are no doubles");
    double(0x1234);
    assert_eq!(error().code, 0x0100);
    let mut buttons: c_int = 0;
    call!("hdGetIntegerv": fn(c_uint, *mut c_int); 0x2000, &raw mut buttons);
    let mut encoders: [c_long; 6] = [1; 6];
    call!("hdGetLongv": fn(c_uint, *mut c_long); 0x2010, encoders.as_mut_ptr());
    let mut offset = 1.0f32;
    call!("hdGetFloatv": fn(c_uint, *mut f32); 0x2552, &raw mut offset);
    assert_eq!((buttons, encoders, offset, error().code), (3, [0; 6], 0.0, 0));
    double(0x2552);
    assert_eq!(error().code, 0x0103, "a float alone");
    call!("hdSetDoublev": fn(c_uint, *const f64); 0x2050, [0.0; 3].as_ptr());
    assert_eq!(error().code, 0x0102, "a place cannot be set");
}

#[test]
fn frames_are_one_a_tick_and_begin_with_no_force() {
    let _one = plan("virtual");
    open();
    let end = || call!("hdEndFrame": fn(c_uint); 0);
    let begin = || call!("hdBeginFrame": fn(c_uint); 0);
    end();
    assert_eq!(error().code, 0x0401);
    begin();
    call!("hdSetDoublev": fn(c_uint, *const f64); 0x2700, [1.0, 0.0, 0.0].as_ptr());
    assert_eq!(double(0x2700)[0], 1.0);
    begin();
    assert_eq!(error().code, 0x0400);
    end();
    begin();
    assert_eq!(error().code, 0x0400, "the second of a tick");
    advance(1);
    begin();
    assert_eq!((double(0x2700)[0], error().code), (0.0, 0));
    end();
}

static ORDER: Mutex<Vec<u32>> = Mutex::new(vec![]);

/// Callbacks that say who they are.
unsafe extern "system" fn first(_: *mut c_void) -> c_uint {
    ORDER.lock().expect("a lock").push(1);
    1
}

unsafe extern "system" fn second(_: *mut c_void) -> c_uint {
    ORDER.lock().expect("a lock").push(2);
    1
}

unsafe extern "system" fn once(_: *mut c_void) -> c_uint {
    ORDER.lock().expect("a lock").push(3);
    0
}

#[test]
fn callbacks_run_by_priority_until_they_are_done() {
    let _one = plan("virtual");
    open();
    ORDER.lock().unwrap().clear();
    let jobs = [schedule(second, 10), schedule(once, 32767), schedule(first, 65535)];
    call!("hdStartScheduler": fn(););
    assert_eq!(advance(2), 2);
    assert_eq!(*ORDER.lock().unwrap(), [1, 3, 2, 1, 2]);
    let is_there = |job| call!("hdWaitForCompletion": fn(c_ulong, c_uint) -> c_uchar; job, 0);
    assert_eq!(jobs.map(is_there), [1, 0, 1]);
    call!("hdUnschedule": fn(c_ulong); jobs[2]);
    advance(1);
    assert_eq!(ORDER.lock().unwrap()[5..], [2]);
    call!("hdStopScheduler": fn(););
    assert_eq!(advance(5), 0, "it stands");
    assert_eq!(ORDER.lock().unwrap().len(), 6);
    call!("hdUnschedule": fn(c_ulong); jobs[0]);
}

#[test]
fn a_scheduler_has_room_for_sixteen() {
    let _one = plan("virtual");
    let jobs: Vec<c_ulong> = (0..16).map(|_| schedule(first, 1)).collect();
    assert_eq!(error().code, 0);
    schedule(first, 1);
    assert_eq!(error().code, 0x0501);
    jobs.into_iter().for_each(|job| call!("hdUnschedule": fn(c_ulong); job));
}

static CALLS: AtomicU32 = AtomicU32::new(0);

unsafe extern "system" fn count(_: *mut c_void) -> c_uint {
    CALLS.fetch_add(1, Ordering::Relaxed);
    0
}

/// By the wall's clock too: what waits for a callback gets it; a scheduler that stands is told.
#[test]
fn a_synchronous_callback_has_run_when_it_is_back() {
    let _one = plan("");
    open();
    let run = || call!("hdScheduleSynchronous": fn(Callback, *mut c_void, c_ushort); count, std::ptr::null_mut(), 32767);
    run();
    assert_eq!((CALLS.load(Ordering::Relaxed), error().code), (0, 0x0304));
    call!("hdStartScheduler": fn(););
    run();
    assert_eq!((CALLS.load(Ordering::Relaxed), error().code), (1, 0));
    call!("hdStopScheduler": fn(););
}

#[test]
fn other_entries_answer() {
    let _one = plan("virtual;auto");
    open();
    assert_eq!(call!("hdCheckCalibrationStyle": fn() -> c_uint;), 2);
    assert_eq!(call!("hdCheckCalibration": fn() -> c_uint;), 0x5000);
    call!("hdUpdateCalibrationMessage": fn(c_uint); 2);
    call!("hdSetSchedulerRate": fn(c_ulong); 500);
    assert_eq!(error().code, 0x0101);
    assert_eq!(call!("hdGetSchedulerTimeStamp": fn() -> f64;), 0.0);
    let none = std::ptr::null();
    assert_eq!(call!("hdDeploymentLicense": fn(*const c_char, *const c_char, *const c_char) -> c_uchar; none, none, none), 1);
    let mut turn = [9.0; 16];
    call!("hdScaleGimbalAngles": fn(f64, f64, f64, *mut f64); 1.0, 1.0, 1.0, turn.as_mut_ptr());
    assert_eq!((turn[0], turn[1], turn[15]), (1.0, 0.0, 1.0));
    assert!(call!("hdGetString": fn(c_uint) -> *const c_char; 0x2050).is_null());
    call!("hdDisableDevice": fn(c_uint); 0);
    error();
    call!("hdDisableDevice": fn(c_uint); 0);
    assert_eq!(error().code, 0x0104);
}
