//! Declarations of HDAPI, written anew from its facts: names, types and numbers of the functions called here.
//!
//! | C                          | here                 | note                                         |
//! |----------------------------|----------------------|----------------------------------------------|
//! | HHD, HDenum, HDerror       | `c_uint`             | no device is 0xffff_ffff                     |
//! | HDulong, HDSchedulerHandle | `c_ulong`            | 8 bytes on 64-bit Linux, 4 on Windows        |
//! | HDboolean                  | `c_uchar`            | no Rust `bool`: any byte may come            |
//! | HDstring                   | `*const c_char`      | static, never freed                          |
//! | HDErrorInfo                | [`ErrorInfo`]        | 12 bytes, returned by value                  |
//!
//! Calls and callbacks are `extern "system"`: C on Linux and 64-bit Windows, stdcall on 32-bit Windows. A
//! device's state may be read in its scheduler's callback alone, between [`begin_frame`](Api::begin_frame)
//! and [`end_frame`](Api::end_frame); `begin_frame` makes the device the current one and zeroes the force.

use std::ffi::{c_char, c_int, c_uchar, c_uint, c_ulong, c_ushort, c_void};

/// A device.
pub type Handle = c_uint;
/// A callback's answer.
pub type CallbackCode = c_uint;
/// A scheduled callback.
pub type Callback = unsafe extern "system" fn(*mut c_void) -> CallbackCode;

/// What went wrong, popped from the library's one stack of errors.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ErrorInfo {
    /// The library's number for it.
    pub code: c_uint,
    /// The driver's number for it.
    pub internal: c_int,
    /// The device.
    pub handle: Handle,
}

/// No device.
pub const INVALID_HANDLE: Handle = 0xffff_ffff;
/// The callback is not called again.
pub const CALLBACK_DONE: CallbackCode = 0;
/// The callback is called in the next tick.
pub const CALLBACK_CONTINUE: CallbackCode = 1;
/// Called first in a tick.
pub const MAX_PRIORITY: c_ushort = 65535;

/// Numbers of errors.
pub mod error {
    /// None.
    pub const SUCCESS: u32 = 0;
    /// A motor is too hot.
    pub const WARM_MOTORS: u32 = 0x0200;
    /// The first of the errors about forces: too great a one.
    pub const EXCEEDED_MAX_FORCE: u32 = 0x0201;
    /// The last of them.
    pub const FORCE_ERROR: u32 = 0x0204;
    /// The device failed.
    pub const DEVICE_FAULT: u32 = 0x0300;
    /// Another program, or this one, has it open.
    pub const ALREADY_INITIATED: u32 = 0x0301;
    /// It does not answer.
    pub const COMM_ERROR: u32 = 0x0302;
    /// It is not set up.
    pub const COMM_CONFIG_ERROR: u32 = 0x0303;
    /// Its clock failed.
    pub const TIMER_ERROR: u32 = 0x0304;
    /// The first of the scheduler's errors: a priority that is none.
    pub const INVALID_PRIORITY: u32 = 0x0500;
    /// The licence is not valid.
    pub const INVALID_LICENSE: u32 = 0x0600;
}

/// Numbers of what can be read, set and switched.
pub mod name {
    /// Buttons held, a bit each \[1 int\].
    pub const CURRENT_BUTTONS: u32 = 0x2000;
    /// Whether the stylus is in the inkwell \[1 boolean\].
    pub const CURRENT_INKWELL_SWITCH: u32 = 0x2002;
    /// Place of the tip \[3 doubles, mm\].
    pub const CURRENT_POSITION: u32 = 0x2050;
    /// Velocity of the tip, smoothed by the driver \[3 doubles, mm/s\].
    pub const CURRENT_VELOCITY: u32 = 0x2051;
    /// Pose of the tip, column-major, its place in \[12..15\] \[16 doubles, mm\].
    pub const CURRENT_TRANSFORM: u32 = 0x2052;
    /// Kind of device.
    pub const DEVICE_MODEL_TYPE: u32 = 0x2501;
    /// Version of the driver.
    pub const DEVICE_DRIVER_VERSION: u32 = 0x2502;
    /// Maker.
    pub const DEVICE_VENDOR: u32 = 0x2503;
    /// Serial number.
    pub const DEVICE_SERIAL_NUMBER: u32 = 0x2504;
    /// Version of the library.
    pub const VERSION: u32 = 0x2500;
    /// Corners of what the arm reaches \[6 doubles, mm\].
    pub const MAX_WORKSPACE_DIMENSIONS: u32 = 0x2550;
    /// Axes sensed \[1 int\].
    pub const INPUT_DOF: u32 = 0x2553;
    /// Axes driven \[1 int\].
    pub const OUTPUT_DOF: u32 = 0x2554;
    /// How it is calibrated \[1 int\].
    pub const CALIBRATION_STYLE: u32 = 0x2555;
    /// Ticks a second \[1 int\].
    pub const UPDATE_RATE: u32 = 0x2600;
    /// Greatest stiffness \[1 double, N/mm\].
    pub const NOMINAL_MAX_STIFFNESS: u32 = 0x2602;
    /// Greatest force \[1 double, N\].
    pub const NOMINAL_MAX_FORCE: u32 = 0x2603;
    /// Greatest force for long \[1 double, N\].
    pub const NOMINAL_MAX_CONTINUOUS_FORCE: u32 = 0x2604;
    /// Temperatures of motors, 1 at the limit \[6 doubles\].
    pub const MOTOR_TEMPERATURE: u32 = 0x2605;
    /// Greatest damping \[1 double, N s/mm\].
    pub const NOMINAL_MAX_DAMPING: u32 = 0x2609;
    /// Force on the hand \[3 doubles, N\].
    pub const CURRENT_FORCE: u32 = 0x2700;
    /// Whether forces are given.
    pub const FORCE_OUTPUT: u32 = 0x4000;
    /// Whether forces above the greatest are cut to it.
    pub const MAX_FORCE_CLAMPING: u32 = 0x4001;
    /// Whether forces come slowly after a start and an error.
    pub const FORCE_RAMPING: u32 = 0x4002;
}

/// Answers about calibration.
pub mod calibration {
    /// It knows where its arm is.
    pub const OK: u32 = 0x5000;
    /// It can find out by itself.
    pub const NEEDS_UPDATE: u32 = 0x5001;
    /// Someone has to move its arm.
    pub const NEEDS_MANUAL_INPUT: u32 = 0x5002;
    /// The arm was put where its encoders are zero.
    pub const STYLE_ENCODER_RESET: u32 = 1;
    /// By itself.
    pub const STYLE_AUTO: u32 = 1 << 1;
    /// The stylus is put into the inkwell.
    pub const STYLE_INKWELL: u32 = 1 << 2;
}

/// Declares the functions that are called, and how they are looked up by their names.
macro_rules! api {
    ($($(#[$doc:meta])* $field:ident = $symbol:literal: fn($($type:ty),*) $(-> $result:ty)?;)*) => {
        /// The library's functions. Each must be called as HDAPI says: see the driver.
        #[derive(Clone, Copy, Debug)]
        pub struct Api {
            $($(#[$doc])* pub $field: unsafe extern "system" fn($($type),*) $(-> $result)?,)*
        }

        /// Names of the functions that a library must have.
        pub const SYMBOLS: &[&str] = &[$($symbol),*];

        impl Api {
            /// Looks the functions up.
            ///
            /// # Errors
            /// The names that are not there.
            ///
            /// # Safety
            /// What the library has by these names has these types, and the library stays loaded.
            pub unsafe fn of(library: &libloading::Library) -> Result<Self, Vec<&'static str>> {
                let mut missing = vec![];
                $(
                    // SAFETY: the caller's promise, for this name.
                    let found = unsafe { library.get::<unsafe extern "system" fn($($type),*) $(-> $result)?>($symbol.as_bytes()) };
                    let $field = found.map(|symbol| *symbol).map_err(|_| missing.push($symbol)).ok();
                )*
                if let ($(Some($field),)*) = ($($field,)*) { Ok(Self { $($field),* }) } else { Err(missing) }
            }
        }
    };
}

api! {
    /// Opens a device by its name; null is the default one.
    init_device = "hdInitDevice": fn(*const c_char) -> Handle;
    /// Closes it.
    disable_device = "hdDisableDevice": fn(Handle);
    /// Makes it the one that the thread's calls are about.
    make_current_device = "hdMakeCurrentDevice": fn(Handle);
    /// Begins a tick's frame.
    begin_frame = "hdBeginFrame": fn(Handle);
    /// Ends it: the force goes to the motors.
    end_frame = "hdEndFrame": fn(Handle);
    /// Pops the newest error.
    get_error = "hdGetError": fn() -> ErrorInfo;
    /// Its words.
    get_error_string = "hdGetErrorString": fn(c_uint) -> *const c_char;
    /// Switches on.
    enable = "hdEnable": fn(c_uint);
    /// Switches off.
    disable = "hdDisable": fn(c_uint);
    /// Whether it is on.
    is_enabled = "hdIsEnabled": fn(c_uint) -> c_uchar;
    /// Reads.
    get_boolean = "hdGetBooleanv": fn(c_uint, *mut c_uchar);
    /// Reads.
    get_integer = "hdGetIntegerv": fn(c_uint, *mut c_int);
    /// Reads.
    get_double = "hdGetDoublev": fn(c_uint, *mut f64);
    /// Reads.
    get_string = "hdGetString": fn(c_uint) -> *const c_char;
    /// Sets.
    set_double = "hdSetDoublev": fn(c_uint, *const f64);
    /// What is known of the arm's place.
    check_calibration = "hdCheckCalibration": fn() -> c_uint;
    /// Finds the arm's place.
    update_calibration = "hdUpdateCalibration": fn(c_uint);
    /// Starts ticking.
    start_scheduler = "hdStartScheduler": fn();
    /// Stops ticking, and waits for the tick under way.
    stop_scheduler = "hdStopScheduler": fn();
    /// Calls a callback in each tick, as long as it goes on.
    schedule_asynchronous = "hdScheduleAsynchronous": fn(Callback, *mut c_void, c_ushort) -> c_ulong;
    /// Calls it no more.
    unschedule = "hdUnschedule": fn(c_ulong);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::{align_of, offset_of, size_of};

    /// As gcc lays it out.
    #[test]
    fn error_is_twelve_bytes() {
        assert_eq!((size_of::<ErrorInfo>(), align_of::<ErrorInfo>()), (12, 4));
        assert_eq!((offset_of!(ErrorInfo, code), offset_of!(ErrorInfo, internal), offset_of!(ErrorInfo, handle)), (0, 4, 8));
        assert_eq!(size_of::<c_ulong>(), if cfg!(windows) { 4 } else { size_of::<usize>() });
    }
}
