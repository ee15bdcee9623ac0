//! A recorded hand: a file of ticks, and a device that plays it.
//!
//! The file is text, so that it can be plotted and compared:
//!
//! ```text
//! # bevy_clay haptic trace 1
//! # device Touch
//! # force_max 3.3
//! # continuous_force_max 0.88
//! time,x,y,z,qx,qy,qz,qw,vx,vy,vz,buttons,fx,fy,fz
//! 0.001,0.01,0,0,0,0,0,1,0,0,0,0,0.5,0,0
//! ```
//!
//! A line a tick: time \[s\], place \[m\] and turn of the tip, its velocity \[m/s\], buttons as bits, force on the
//! hand \[N\]; all by the device's axes. Numbers are written so that they are read to the same bit. Times
//! rise.

use super::fault::{DeviceError, DeviceEvent};
use super::{DeviceInfo, DevicePhase, DeviceState, HapticDevice, NotStarted, RunningDevice, Servo};
use glam::{DQuat, DVec3};
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const HEAD: &str = "# bevy_clay haptic trace 1";
const COLUMNS: &str = "time,x,y,z,qx,qy,qz,qw,vx,vy,vz,buttons,fx,fy,fz";

/// A tick of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceTick {
    /// What was sensed. Its motors are cold, and it is not muted: a trace does not hold either.
    pub state: DeviceState,
    /// Force on the hand \[N\].
    pub force: DVec3,
}

/// Writes a trace, tick by tick.
#[derive(Debug)]
pub struct TraceWriter<W: Write> {
    to: W,
    line: String,
}

impl<W: Write> TraceWriter<W> {
    /// Begins a trace of a device.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn new(mut to: W, info: &DeviceInfo) -> io::Result<Self> {
        // A name is one line.
        let name: String = info.name.chars().filter(|c| !c.is_control()).collect();
        writeln!(to, "{HEAD}\n# device {name}\n# force_max {}", info.force_max)?;
        writeln!(to, "# continuous_force_max {}\n{COLUMNS}", info.continuous_force_max)?;
        Ok(Self { to, line: String::new() })
    }

    /// Writes a tick.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&mut self, tick: &TraceTick) -> io::Result<()> {
        let DeviceState { time, position: p, rotation: q, velocity: v, buttons, .. } = tick.state;
        let f = tick.force;
        self.line.clear();
        let numbers = [time, p.x, p.y, p.z, q.x, q.y, q.z, q.w, v.x, v.y, v.z];
        // Writing to a string does not fail.
        numbers.iter().for_each(|number| _ = write!(self.line, "{number},"));
        writeln!(self.to, "{}{buttons},{},{},{}", self.line, f.x, f.y, f.z)
    }

    /// Ends the trace.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// A trace that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// The device that it was recorded on, as far as a trace tells.
    pub info: DeviceInfo,
    /// Its ticks, in the order of their times.
    pub ticks: Vec<TraceTick>,
}

impl Trace {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or is no trace: which line, and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, DeviceError> {
        let wrong = |line: usize, what: String| DeviceError::Trace { path: path.display().to_string(), line, what };
        let text = std::fs::read_to_string(path).map_err(|error| wrong(0, error.to_string()))?;
        Self::from_text(&text).map_err(|(line, what)| wrong(line, what))
    }

    /// Reads a trace's text; if it is none, the line and what is wrong with it.
    fn from_text(text: &str) -> Result<Self, (usize, String)> {
        let mut lines = (1..).zip(text.lines());
        if lines.next().is_none_or(|(_, head)| head != HEAD) {
            return Err((1, format!("not `{HEAD}`")));
        }
        let mut info = usual();
        let mut ticks: Vec<TraceTick> = vec![];
        for (number, line) in lines {
            if let Some(word) = line.strip_prefix("# ") {
                let (name, value) = word.split_once(' ').unwrap_or((word, ""));
                let force = || parse(value).filter(|force| *force > 0.0).ok_or((number, format!("{value}: no force")));
                match name {
                    "device" => info.name = value.into(),
                    "force_max" => info.force_max = force()?,
                    "continuous_force_max" => info.continuous_force_max = force()?,
                    _ => return Err((number, format!("{name}: unknown"))),
                }
            } else if line != COLUMNS {
                let tick = tick(line).map_err(|what| (number, what))?;
                if ticks.last().is_some_and(|last| last.state.time >= tick.state.time) {
                    return Err((number, format!("{} s: times do not rise", tick.state.time)));
                }
                ticks.push(tick);
            }
        }
        if let [first, .., last] = &ticks[..] {
            info.rate = (ticks.len() - 1) as f64 / (last.state.time - first.state.time);
        }
        Ok(Self { info, ticks })
    }

    /// How long a tick takes \[s\]: to the one before, or the mean for the first.
    fn dt(&self, tick: usize) -> f64 {
        let time = |i: usize| self.ticks[i].state.time;
        if tick == 0 { 1.0 / self.info.rate } else { time(tick) - time(tick - 1) }
    }

    /// From its first tick to its last \[s\].
    pub fn duration(&self) -> f64 {
        self.ticks.first().zip(self.ticks.last()).map_or(0.0, |(first, last)| last.state.time - first.state.time)
    }

    /// Plays all of it to a servo in virtual time: what it asks for, tick by tick \[N\].
    pub fn play(&self, servo: &mut dyn Servo) -> Vec<DVec3> {
        servo.begin(&self.info);
        (0..self.ticks.len()).map(|i| servo.tick(&self.ticks[i].state, self.dt(i))).collect()
    }
}

/// What is not in a trace: a pen of 1 kHz.
fn usual() -> DeviceInfo {
    DeviceInfo {
        name: String::new(),
        serial: String::new(),
        freedoms: [6, 3],
        force_max: 3.3,
        continuous_force_max: 0.88,
        stiffness_max: 400.0,
        damping_max: 4.0,
        workspace: [DVec3::splat(-0.1), DVec3::splat(0.1)],
        resolution: 55e-6,
        rate: 1000.0,
        buttons: 2,
    }
}

/// A number that is one.
fn parse(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

/// A line's tick.
fn tick(line: &str) -> Result<TraceTick, String> {
    let cells: Vec<&str> = line.split(',').collect();
    let [numbers @ .., buttons, fx, fy, fz] = &cells[..] else { return Err("a line is cut".into()) };
    let number = |text: &&str| parse(text).ok_or_else(|| format!("{text}: no number"));
    let numbers: Vec<f64> = numbers.iter().map(number).collect::<Result<_, _>>()?;
    let force = DVec3::new(number(fx)?, number(fy)?, number(fz)?);
    let buttons = buttons.parse().map_err(|_| format!("{buttons}: no buttons"))?;
    let [time, x, y, z, qx, qy, qz, qw, vx, vy, vz] = numbers[..] else { return Err("a line is cut, or too long".into()) };
    let state = DeviceState {
        time,
        position: DVec3::new(x, y, z),
        rotation: DQuat::from_xyzw(qx, qy, qz, qw),
        velocity: DVec3::new(vx, vy, vz),
        buttons,
        motor_temperature: 0.0,
        is_muted: false,
    };
    Ok(TraceTick { state, force })
}

/// Gives the force of a trace again, by the time since its first tick: what was felt, on an arm. It ends
/// with nothing. A chain of safety belongs behind it: it does not look where the hand is.
#[derive(Debug)]
pub struct ForcePlayback {
    trace: Trace,
    time: f64,
    at: usize,
}

impl ForcePlayback {
    /// From the trace's first tick.
    pub fn new(trace: Trace) -> Self {
        Self { trace, time: 0.0, at: 0 }
    }
}

impl Servo for ForcePlayback {
    fn tick(&mut self, _state: &DeviceState, dt: f64) -> DVec3 {
        self.time += dt;
        let ticks = &self.trace.ticks;
        let since = |i: usize| ticks.get(i).zip(ticks.first()).map(|(tick, first)| tick.state.time - first.state.time);
        while since(self.at + 1).is_some_and(|time| time <= self.time) {
            self.at += 1;
        }
        let is_over = since(ticks.len().saturating_sub(1)).is_none_or(|end| self.time > end + 1.0 / self.trace.info.rate);
        if is_over { DVec3::ZERO } else { ticks[self.at].force }
    }
}

/// A trace as a device, in real time: the hand is where it was, whatever the force.
#[derive(Clone, Debug)]
pub struct TraceDevice(pub Trace);

impl HapticDevice for TraceDevice {
    fn info(&self) -> &DeviceInfo {
        &self.0.info
    }

    fn run(self: Box<Self>, mut servo: Box<dyn Servo>) -> Result<Box<dyn RunningDevice>, NotStarted> {
        let info = self.0.info.clone();
        servo.begin(&info);
        let is_to_end = Arc::new(AtomicBool::new(false));
        let (input, states) = triple_buffer::triple_buffer(&None);
        let asked = is_to_end.clone();
        let spawned = std::thread::Builder::new().name("haptic trace".into()).spawn(move || play(&self.0, servo, input, &asked));
        match spawned {
            Ok(thread) => Ok(Box::new(RunningTrace { info, is_to_end, states, thread: Some(thread) })),
            Err(error) => Err(NotStarted { error: error.into(), servo: None }),
        }
    }
}

/// Plays a trace by the wall's clock.
fn play(
    trace: &Trace,
    mut servo: Box<dyn Servo>,
    mut states: triple_buffer::Input<Option<DeviceState>>,
    is_to_end: &AtomicBool,
) -> Box<dyn Servo> {
    let start = Instant::now();
    for (i, tick) in trace.ticks.iter().enumerate() {
        let due = Duration::from_secs_f64(tick.state.time - trace.ticks[0].state.time);
        std::thread::sleep(due.saturating_sub(start.elapsed()));
        if is_to_end.load(Ordering::Acquire) {
            break;
        }
        servo.tick(&tick.state, trace.dt(i));
        states.write(Some(tick.state));
    }
    servo
}

struct RunningTrace {
    info: DeviceInfo,
    is_to_end: Arc<AtomicBool>,
    states: triple_buffer::Output<Option<DeviceState>>,
    /// None once it was ended.
    thread: Option<JoinHandle<Box<dyn Servo>>>,
}

impl RunningTrace {
    fn end(&mut self) -> Option<Box<dyn Servo>> {
        self.is_to_end.store(true, Ordering::Release);
        self.thread.take().and_then(|thread| thread.join().ok())
    }
}

impl Drop for RunningTrace {
    fn drop(&mut self) {
        drop(self.end());
    }
}

impl RunningDevice for RunningTrace {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn phase(&self) -> DevicePhase {
        let is_over = self.thread.as_ref().is_none_or(JoinHandle::is_finished);
        if is_over { DevicePhase::Ended } else { DevicePhase::Running }
    }

    fn state(&mut self) -> Option<DeviceState> {
        *self.states.read()
    }

    fn event(&mut self) -> Option<DeviceEvent> {
        None
    }

    fn stop(mut self: Box<Self>) -> Option<Box<dyn Servo>> {
        self.end()
    }
}

#[cfg(test)]
#[path = "trace_tests.rs"]
mod tests;
