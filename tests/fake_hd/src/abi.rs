//! Types and numbers of HDAPI, as far as this library answers for them.

use std::ffi::{CStr, c_int, c_uint, c_void};

/// A scheduled callback.
pub type Callback = unsafe extern "system" fn(*mut c_void) -> c_uint;

/// What went wrong: returned by value.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ErrorInfo {
    /// The library's number for it.
    pub code: c_uint,
    /// The driver's number for it.
    pub internal: c_int,
    /// The device.
    pub handle: c_uint,
}

pub(crate) const NO_DEVICE: c_uint = 0xffff_ffff;
/// The one device.
pub(crate) const DEVICE: c_uint = 0;

pub(crate) const INVALID_ENUM: u32 = 0x0100;
pub(crate) const INVALID_VALUE: u32 = 0x0101;
pub(crate) const INVALID_OPERATION: u32 = 0x0102;
pub(crate) const INVALID_INPUT_TYPE: u32 = 0x0103;
pub(crate) const BAD_HANDLE: u32 = 0x0104;
pub(crate) const WARM_MOTORS: u32 = 0x0200;
pub(crate) const EXCEEDED_MAX_FORCE: u32 = 0x0201;
pub(crate) const EXCEEDED_MAX_FORCE_IMPULSE: u32 = 0x0202;
pub(crate) const EXCEEDED_MAX_VELOCITY: u32 = 0x0203;
pub(crate) const DEVICE_FAULT: u32 = 0x0300;
pub(crate) const DEVICE_ALREADY_INITIATED: u32 = 0x0301;
pub(crate) const COMM_ERROR: u32 = 0x0302;
pub(crate) const TIMER_ERROR: u32 = 0x0304;
pub(crate) const ILLEGAL_BEGIN: u32 = 0x0400;
pub(crate) const ILLEGAL_END: u32 = 0x0401;
pub(crate) const SCHEDULER_FULL: u32 = 0x0501;

/// An error's words.
pub(crate) fn words(code: u32) -> &'static CStr {
    match code {
        0 => c"No error",
        INVALID_ENUM => c"Invalid enumeration",
        INVALID_VALUE => c"Invalid value",
        INVALID_OPERATION => c"Invalid operation",
        INVALID_INPUT_TYPE => c"Invalid type of input",
        BAD_HANDLE => c"Bad handle",
        WARM_MOTORS => c"Motors too warm",
        EXCEEDED_MAX_FORCE => c"Force above the greatest",
        EXCEEDED_MAX_FORCE_IMPULSE => c"Force changed too fast",
        EXCEEDED_MAX_VELOCITY => c"Arm too fast",
        DEVICE_FAULT => c"Device fault",
        DEVICE_ALREADY_INITIATED => c"Device opened already",
        COMM_ERROR => c"No answer from the device",
        TIMER_ERROR => c"Timer error",
        ILLEGAL_BEGIN => c"Frame begun twice",
        ILLEGAL_END => c"Frame ended that was not begun",
        SCHEDULER_FULL => c"No room for callbacks",
        _ => c"Another error",
    }
}
