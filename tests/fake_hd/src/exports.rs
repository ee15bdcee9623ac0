//! The functions of HDAPI.
#![expect(missing_docs, reason = "they are HDAPI's, and documented there")]

use crate::abi::{BAD_HANDLE, Callback, DEVICE, DEVICE_FAULT, ErrorInfo, INVALID_ENUM, INVALID_VALUE, NO_DEVICE, words};
use crate::values::{Kind, string};
use crate::world::{CURRENT, FORCE_OUTPUT, WORLD};
use crate::{lock, scheduler};
use std::ffi::{CStr, c_char, c_double, c_float, c_int, c_long, c_uchar, c_uint, c_ulong, c_ushort, c_void};

/// # Safety
/// A text, or null.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn hdInitDevice(name: *const c_char) -> c_uint {
    // SAFETY: the caller's promise.
    let name = (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) });
    let mut world = lock(&WORLD);
    if name.is_some_and(|name| name != c"Default Device") {
        world.error(DEVICE_FAULT);
        return NO_DEVICE;
    }
    world.open()
}

#[unsafe(no_mangle)]
pub extern "system" fn hdDisableDevice(handle: c_uint) {
    lock(&WORLD).close(handle);
}

#[unsafe(no_mangle)]
pub extern "system" fn hdMakeCurrentDevice(handle: c_uint) {
    if handle == DEVICE { CURRENT.set(handle) } else { lock(&WORLD).error(BAD_HANDLE) }
}

#[unsafe(no_mangle)]
pub extern "system" fn hdGetCurrentDevice() -> c_uint {
    CURRENT.get()
}

#[unsafe(no_mangle)]
pub extern "system" fn hdBeginFrame(handle: c_uint) {
    lock(&WORLD).begin(handle);
}

#[unsafe(no_mangle)]
pub extern "system" fn hdEndFrame(handle: c_uint) {
    lock(&WORLD).end(handle);
}

#[unsafe(no_mangle)]
pub extern "system" fn hdGetError() -> ErrorInfo {
    lock(&WORLD).take_error()
}

#[unsafe(no_mangle)]
pub extern "system" fn hdGetErrorString(code: c_uint) -> *const c_char {
    words(code).as_ptr()
}

#[unsafe(no_mangle)]
pub extern "system" fn hdEnable(capability: c_uint) {
    switch(capability, true);
}

#[unsafe(no_mangle)]
pub extern "system" fn hdDisable(capability: c_uint) {
    switch(capability, false);
}

fn switch(capability: u32, is_on: bool) {
    let mut world = lock(&WORLD);
    if !(FORCE_OUTPUT..=0x4004).contains(&capability) {
        return world.error(INVALID_ENUM);
    }
    if world.has_device() {
        if is_on {
            world.enabled.insert(capability)
        } else {
            world.enabled.remove(&capability)
        };
        if capability == FORCE_OUTPUT && !is_on {
            world.motors = [0.0; 3];
        }
    }
}

#[unsafe(no_mangle)]
pub extern "system" fn hdIsEnabled(capability: c_uint) -> c_uchar {
    u8::from(lock(&WORLD).is_on(capability))
}

/// Getters and setters of a type each.
macro_rules! values {
    ($($get:ident $set:ident $type:ty, $kind:expr, $is_double:literal;)*) => {$(
        /// # Safety
        /// Room for as many values as the name has.
        #[unsafe(no_mangle)]
        pub unsafe extern "system" fn $get(name: c_uint, to: *mut $type) {
            let values = lock(&WORLD).read(name, $kind, $is_double).unwrap_or_default();
            for (i, value) in values.into_iter().enumerate() {
                // SAFETY: the caller's promise.
                unsafe { *to.add(i) = value as $type };
            }
        }

        /// # Safety
        /// As many values as the name has.
        #[unsafe(no_mangle)]
        pub unsafe extern "system" fn $set(name: c_uint, from: *const $type) {
            let mut world = lock(&WORLD);
            if let Some(count) = world.settable(name, $kind) {
                // SAFETY: the caller's promise.
                let values: Vec<f64> = (0..count).map(|i| unsafe { *from.add(i) } as f64).collect();
                world.set(name, &values);
            }
        }
    )*};
}

values! {
    hdGetBooleanv hdSetBooleanv c_uchar, Kind::Boolean, false;
    hdGetIntegerv hdSetIntegerv c_int, Kind::Integer, false;
    hdGetLongv hdSetLongv c_long, Kind::Long, false;
    hdGetFloatv hdSetFloatv c_float, Kind::Real, false;
    hdGetDoublev hdSetDoublev c_double, Kind::Real, true;
}

#[unsafe(no_mangle)]
pub extern "system" fn hdGetString(name: c_uint) -> *const c_char {
    string(name).map_or_else(
        || {
            lock(&WORLD).error(INVALID_ENUM);
            std::ptr::null()
        },
        CStr::as_ptr,
    )
}

#[unsafe(no_mangle)]
pub extern "system" fn hdCheckCalibration() -> c_uint {
    let mut world = lock(&WORLD);
    if world.has_device() { world.calibration() } else { 0x5002 }
}

#[unsafe(no_mangle)]
pub extern "system" fn hdCheckCalibrationStyle() -> c_uint {
    if lock(&WORLD).has("auto") { 2 } else { 4 }
}

#[unsafe(no_mangle)]
pub extern "system" fn hdUpdateCalibration(style: c_uint) {
    lock(&WORLD).calibrate(style);
}

#[unsafe(no_mangle)]
pub extern "system" fn hdUpdateCalibrationMessage(style: c_uint) {
    lock(&WORLD).calibrate(style);
}

#[unsafe(no_mangle)]
pub extern "system" fn hdStartScheduler() {
    scheduler::start();
}

#[unsafe(no_mangle)]
pub extern "system" fn hdStopScheduler() {
    scheduler::stop();
}

#[unsafe(no_mangle)]
pub extern "system" fn hdSetSchedulerRate(rate: c_ulong) {
    // It has one rate.
    if rate != 1000 {
        lock(&WORLD).error(INVALID_VALUE);
    }
}

/// Time since the tick began \[s\]: in virtual time none.
#[unsafe(no_mangle)]
pub extern "system" fn hdGetSchedulerTimeStamp() -> c_double {
    0.0
}

#[unsafe(no_mangle)]
pub extern "system" fn hdScheduleAsynchronous(callback: Callback, data: *mut c_void, priority: c_ushort) -> c_ulong {
    scheduler::add(callback, data, priority, false)
}

#[unsafe(no_mangle)]
pub extern "system" fn hdScheduleSynchronous(callback: Callback, data: *mut c_void, priority: c_ushort) {
    scheduler::run_once(callback, data, priority);
}

#[unsafe(no_mangle)]
pub extern "system" fn hdUnschedule(job: c_ulong) {
    scheduler::remove(job);
}

/// Whether it is still to run; with 1 for `code` it is waited for first.
#[unsafe(no_mangle)]
pub extern "system" fn hdWaitForCompletion(job: c_ulong, code: c_uint) -> c_uchar {
    u8::from(!scheduler::wait(job, code == 1))
}

#[unsafe(no_mangle)]
pub extern "system" fn hdDeploymentLicense(_vendor: *const c_char, _application: *const c_char, _key: *const c_char) -> c_uchar {
    1
}

/// # Safety
/// Room for 16 values.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn hdScaleGimbalAngles(_x: c_double, _y: c_double, _z: c_double, to: *mut c_double) {
    for i in 0..16 {
        // SAFETY: the caller's promise.
        unsafe { *to.add(i) = f64::from(u8::from(i % 5 == 0)) };
    }
}
