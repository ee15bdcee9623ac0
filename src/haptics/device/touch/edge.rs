//! The calls to the library, units and types in and out: SI on this side, what HDAPI has on the other.

use super::super::DeviceInfo;
use super::super::fault::DeviceError;
use super::super::hd::sys::{Api, ErrorInfo, Handle, INVALID_HANDLE, calibration, error, name};
use glam::{DMat3, DQuat, DVec3};
use std::ffi::{CStr, c_char, c_int, c_ulong};

/// How many errors are read at once, so that a library which makes one by being asked ends.
pub(super) const ERRORS_MAX: usize = 8;
/// Metres in HDAPI's millimetre.
const MM: f64 = 1e-3;
/// What a Touch is taken to have where its driver says nothing of it. Greatest force \[N\], stiffness \[N/m\]
/// and damping \[N s/m\]: CHAI3D, `CPhantomDevices.cpp`; continuous force \[N\], least motion \[m\] and reach \[m\]:
/// the maker's sheet, from memory.
const USUAL: Usual = Usual {
    force_max: 3.3,
    continuous_force_max: 0.88,
    stiffness_max: 400.0,
    damping_max: 4.0,
    resolution: 55e-6,
    workspace: DVec3::new(0.08, 0.06, 0.035),
};

/// See [`USUAL`].
struct Usual {
    force_max: f64,
    continuous_force_max: f64,
    stiffness_max: f64,
    damping_max: f64,
    resolution: f64,
    workspace: DVec3,
}

/// Whether a device knows where its arm is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibration {
    /// It does.
    Known,
    /// It can find out by itself.
    Findable,
    /// Someone has to put the stylus into the inkwell.
    Needed,
}

/// A device's calls.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) api: &'static Api,
    handle: Handle,
    /// Whether the driver tells how warm the motors are.
    has_temperature: bool,
    /// How it is calibrated, as bits.
    style: u32,
}

/// A device that is open; closed when it is dropped.
#[derive(Debug)]
pub(super) struct Open {
    pub(super) edge: Edge,
}

impl Drop for Open {
    fn drop(&mut self) {
        let Edge { api, handle, .. } = self.edge;
        // SAFETY: the device is open, and its scheduler has stopped or never ran.
        unsafe {
            (api.make_current_device)(handle);
            (api.disable)(name::FORCE_OUTPUT);
            (api.disable_device)(handle);
        }
    }
}

/// What a device senses in a tick, in SI.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensed {
    pub(super) position: DVec3,
    pub(super) rotation: DQuat,
    pub(super) velocity: DVec3,
    pub(super) buttons: u32,
    pub(super) motor_temperature: f64,
}

impl Sensed {
    pub(super) fn is_finite(&self) -> bool {
        self.position.is_finite() && self.rotation.is_finite() && self.velocity.is_finite()
    }
}

impl Open {
    /// Opens the device of that name, or the default one.
    pub(super) fn new(api: &'static Api, device: Option<&CStr>) -> Result<Self, DeviceError> {
        let mut edge = Edge { api, handle: INVALID_HANDLE, has_temperature: false, style: 0 };
        edge.drain();
        // SAFETY: a name that ends with zero, or null for the default device.
        edge.handle = unsafe { (api.init_device)(device.map_or(std::ptr::null(), CStr::as_ptr)) };
        let error = edge.take_error();
        if edge.handle == INVALID_HANDLE {
            return Err(edge.refusal(error.unwrap_or(ErrorInfo { code: error::DEVICE_FAULT, ..Default::default() })));
        }
        let mut open = Self { edge };
        open.edge.drain();
        open.edge.doubles::<6>(name::MOTOR_TEMPERATURE);
        open.edge.has_temperature = open.edge.take_error().is_none();
        open.edge.style = open.edge.integer(name::CALIBRATION_STYLE) as u32;
        open.edge.drain();
        Ok(open)
    }
}

impl Edge {
    fn doubles<const N: usize>(&self, name: u32) -> [f64; N] {
        // Room for the longest answer, whatever a driver takes for its length.
        let mut values = [0.0; 16];
        // SAFETY: no answer is longer than 16 doubles.
        unsafe { (self.api.get_double)(name, values.as_mut_ptr()) };
        std::array::from_fn(|i| values[i])
    }

    fn integer(&self, name: u32) -> c_int {
        let mut values = [0; 16];
        // SAFETY: no answer is longer than 16 ints.
        unsafe { (self.api.get_integer)(name, values.as_mut_ptr()) };
        values[0]
    }

    /// Words of the library; empty where it has none.
    pub(super) fn string(&self, name: u32) -> String {
        // SAFETY: the library's own text, or null.
        let text = self.text(unsafe { (self.api.get_string)(name) });
        self.drain();
        text
    }

    /// A text of the library.
    fn text(&self, text: *const c_char) -> String {
        if text.is_null() {
            return String::new();
        }
        // SAFETY: what the library hands out is static and ends with zero.
        unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
    }

    /// The newest error, if there is one.
    pub(super) fn take_error(&self) -> Option<ErrorInfo> {
        // SAFETY: asks for nothing but the stack.
        let error = unsafe { (self.api.get_error)() };
        (error.code != error::SUCCESS).then_some(error)
    }

    /// Forgets errors of what was asked on trial.
    fn drain(&self) {
        for _ in 0..ERRORS_MAX {
            if self.take_error().is_none() {
                break;
            }
        }
    }

    /// The library's refusal, in words.
    pub(super) fn refusal(&self, error: ErrorInfo) -> DeviceError {
        // SAFETY: any number may be asked about.
        let text = self.text(unsafe { (self.api.get_error_string)(error.code) });
        let hint = match error.code {
            error::ALREADY_INITIATED => "Another program has the device: close it",
            error::INVALID_LICENSE => "OpenHaptics wants a licence: see its own documents",
            0x0500..=0x05ff => "Another part of this program uses the scheduler",
            _ => {
                "Is it plugged in and switched on, set up as \"Default Device\" in the driver's Touch Setup, and may this user use it (docs/haptics.md)?"
            }
        };
        DeviceError::Refused { code: error.code, internal: error.internal, text, hint }
    }

    /// What the device says of itself.
    pub(super) fn info(&self) -> DeviceInfo {
        let or = |value: f64, usual: f64| if value.is_finite() && value > 0.0 { value } else { usual };
        let one = |name: u32| self.doubles::<1>(name)[0];
        let [x0, y0, z0, x1, y1, z1] = self.doubles::<6>(name::MAX_WORKSPACE_DIMENSIONS);
        let [least, most] = [DVec3::new(x0, y0, z0) * MM, DVec3::new(x1, y1, z1) * MM];
        let has_reach = least.is_finite() && most.is_finite() && least.cmplt(most).all();
        let info = DeviceInfo {
            name: self.string(name::DEVICE_MODEL_TYPE),
            serial: self.string(name::DEVICE_SERIAL_NUMBER),
            freedoms: [name::INPUT_DOF, name::OUTPUT_DOF].map(|name| self.integer(name).clamp(0, 6) as u32),
            force_max: or(one(name::NOMINAL_MAX_FORCE), USUAL.force_max),
            continuous_force_max: or(one(name::NOMINAL_MAX_CONTINUOUS_FORCE), USUAL.continuous_force_max),
            stiffness_max: or(one(name::NOMINAL_MAX_STIFFNESS) / MM, USUAL.stiffness_max),
            damping_max: or(one(name::NOMINAL_MAX_DAMPING) / MM, USUAL.damping_max),
            workspace: if has_reach { [least, most] } else { [-USUAL.workspace, USUAL.workspace] },
            resolution: USUAL.resolution,
            rate: or(self.integer(name::UPDATE_RATE).into(), 1000.0),
            buttons: 2,
        };
        self.drain();
        info
    }

    /// Makes the force ready: cut to the device's greatest, with the driver's own ramp; on, if it may be. It
    /// is live once the scheduler runs.
    pub(super) fn prepare(&self, is_on: bool) {
        // SAFETY: the device is open; switches that it does not have leave an error, which is read next.
        unsafe {
            (self.api.make_current_device)(self.handle);
            (self.api.disable)(name::FORCE_OUTPUT);
            (self.api.enable)(name::MAX_FORCE_CLAMPING);
            (self.api.enable)(name::FORCE_RAMPING);
        }
        self.switch_force(is_on);
        self.drain();
    }

    /// Stops the scheduler and takes the callback out.
    pub(super) fn stop(&self, job: c_ulong) {
        // SAFETY: in the order that HDAPI asks for.
        unsafe {
            (self.api.stop_scheduler)();
            (self.api.unschedule)(job);
        }
        self.drain();
    }

    /// Makes the device the one that this thread's calls are about.
    pub(super) fn make_current(&self) {
        // SAFETY: the device is open.
        unsafe { (self.api.make_current_device)(self.handle) }
    }

    /// Whether the arm's place is known.
    pub(super) fn calibration(&self) -> Calibration {
        // SAFETY: the device is the current one.
        match unsafe { (self.api.check_calibration)() } {
            calibration::OK => Calibration::Known,
            calibration::NEEDS_UPDATE => Calibration::Findable,
            _ => Calibration::Needed,
        }
    }

    /// Finds the arm's place, with the output off. Where the stylus has to be in the inkwell and is not,
    /// nothing.
    pub(super) fn calibrate(&self, calibration: Calibration) {
        let has = |style: u32| self.style & style != 0;
        let style = match calibration {
            Calibration::Known => return,
            Calibration::Findable if has(calibration::STYLE_AUTO) => calibration::STYLE_AUTO,
            _ if has(calibration::STYLE_INKWELL) && (calibration == Calibration::Findable || self.is_in_inkwell()) => {
                calibration::STYLE_INKWELL
            }
            // Encoders are reset by whoever holds the arm at its zero and says so: not by a loop.
            _ => return,
        };
        // SAFETY: the device is the current one, and pushes nothing.
        unsafe { (self.api.update_calibration)(style) }
    }

    fn is_in_inkwell(&self) -> bool {
        let mut value = [0; 16];
        // SAFETY: no answer is longer than 16 booleans.
        unsafe { (self.api.get_boolean)(name::CURRENT_INKWELL_SWITCH, value.as_mut_ptr()) };
        value[0] != 0
    }

    /// Switches the motors on or off, if they are not.
    pub(super) fn switch_force(&self, is_on: bool) {
        // SAFETY: the device is the current one.
        unsafe {
            match ((self.api.is_enabled)(name::FORCE_OUTPUT) != 0, is_on) {
                (false, true) => (self.api.enable)(name::FORCE_OUTPUT),
                (true, false) => (self.api.disable)(name::FORCE_OUTPUT),
                _ => {}
            }
        }
    }

    /// Begins a tick's frame: the force is zero until another is set.
    pub(super) fn begin(&self) {
        // SAFETY: called in the scheduler's callback, once a tick.
        unsafe { (self.api.begin_frame)(self.handle) }
    }

    /// Reads what the device senses, within a frame.
    pub(super) fn sense(&self) -> Sensed {
        let transform = self.doubles::<16>(name::CURRENT_TRANSFORM);
        let column = |c: usize| DVec3::new(transform[4 * c], transform[4 * c + 1], transform[4 * c + 2]);
        let axes = DMat3::from_cols(column(0), column(1), column(2));
        let temperature = if self.has_temperature { self.doubles::<6>(name::MOTOR_TEMPERATURE) } else { [0.0; 6] };
        Sensed {
            position: DVec3::from_array(self.doubles(name::CURRENT_POSITION)) * MM,
            // A matrix that is none gives a quaternion that is none: see `is_finite`.
            rotation: if axes.is_finite() { DQuat::from_mat3(&axes).normalize() } else { DQuat::NAN },
            velocity: DVec3::from_array(self.doubles(name::CURRENT_VELOCITY)) * MM,
            buttons: self.integer(name::CURRENT_BUTTONS) as u32,
            motor_temperature: temperature.into_iter().fold(0.0, f64::max),
        }
    }

    /// Sets the force \[N\] of the frame.
    pub(super) fn push(&self, force: DVec3) {
        // SAFETY: within a frame; three doubles.
        unsafe { (self.api.set_double)(name::CURRENT_FORCE, force.to_array().as_ptr()) }
    }

    /// Ends the frame: the force goes to the motors.
    pub(super) fn end(&self) {
        // SAFETY: a frame was begun; if not, the library says so and does nothing.
        unsafe { (self.api.end_frame)(self.handle) }
    }
}
