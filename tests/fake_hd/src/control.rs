//! Entries of this library's own: what a test says to it and asks of it. Lengths are metres here.

use crate::plan::Plan;
use crate::world::{WORLD, World};
use crate::{lock, scheduler};
use std::ffi::{CStr, c_char, c_uchar};

/// All anew, by a plan; whether it could be read.
///
/// # Safety
/// A text.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn fakehd_reset(plan: *const c_char) -> c_uchar {
    scheduler::stop();
    // SAFETY: the caller's promise.
    let plan = unsafe { CStr::from_ptr(plan) }.to_str().map_err(|error| error.to_string()).and_then(Plan::read);
    let is_read = plan.is_ok();
    *lock(&WORLD) = World::new(plan.unwrap_or_default());
    u8::from(is_read)
}

/// Another plan from now on, all else as it is: a plug that is pulled by hand; whether it could be read.
///
/// # Safety
/// A text.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn fakehd_plan(plan: *const c_char) -> c_uchar {
    // SAFETY: the caller's promise.
    let plan = unsafe { CStr::from_ptr(plan) }.to_str().map_err(|error| error.to_string()).and_then(Plan::read);
    let is_read = plan.is_ok();
    if let Ok(plan) = plan {
        lock(&WORLD).plan = plan;
    }
    u8::from(is_read)
}

/// Lets so many ticks go by; how many the scheduler ran.
#[unsafe(no_mangle)]
pub extern "system" fn fakehd_advance(ticks: u64) -> u64 {
    scheduler::advance(ticks)
}

/// The device's clock \[s\].
#[unsafe(no_mangle)]
pub extern "system" fn fakehd_time() -> f64 {
    lock(&WORLD).time
}

/// Where the hand wants to be \[m\].
#[unsafe(no_mangle)]
pub extern "system" fn fakehd_hand(x: f64, y: f64, z: f64) {
    lock(&WORLD).arm.goal = [x, y, z];
}

/// Force on the motors \[N\].
///
/// # Safety
/// Room for three values.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn fakehd_motors(to: *mut f64) {
    let motors = lock(&WORLD).motors;
    // SAFETY: the caller's promise.
    unsafe { std::ptr::copy_nonoverlapping(motors.as_ptr(), to, 3) };
}

/// Where the arm is \[m\].
///
/// # Safety
/// Room for three values.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn fakehd_place(to: *mut f64) {
    let place = lock(&WORLD).arm.place;
    // SAFETY: the caller's promise.
    unsafe { std::ptr::copy_nonoverlapping(place.as_ptr(), to, 3) };
}

/// How often something happened: `open`, `close`, `frames`, `calibrate`, `calibrate_while_on`,
/// `force_no_number`.
///
/// # Safety
/// A text.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn fakehd_count(what: *const c_char) -> u64 {
    // SAFETY: the caller's promise.
    let what = unsafe { CStr::from_ptr(what) }.to_string_lossy();
    lock(&WORLD).counts.get(what.as_ref()).copied().unwrap_or(0)
}
