//! Looks after a 3D Systems Touch, from the cable to the loop: `cargo run --no-default-features --example
//! doctor [-- --library FILE --seconds N --move --play FILE]`.
//!
//! It says what is there and what is not, with what helps, and moves nothing unless it is asked to. Exit
//! code 0 if a force loop would run, 1 if not.

use bevy_clay::haptics::device::hd::library::{HdLibrary, candidates, dependencies, load};
use bevy_clay::haptics::device::touch::{Calibration, Touch, TouchOptions};
use bevy_clay::haptics::device::trace::{ForcePlayback, Trace};
use bevy_clay::haptics::device::usb;
use bevy_clay::haptics::device::{DeviceInfo, DevicePhase, DeviceState, HapticDevice, RunningDevice, Servo};
use bevy_clay::haptics::safety::{SafetyChain, SafetySettings};
use clap::Parser;
use glam::DVec3;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Looks after a 3D Systems Touch.
#[derive(Debug, Parser)]
struct Args {
    /// File of libHD; without one it is looked for.
    #[arg(long)]
    library: Option<PathBuf>,
    /// How long the loop is measured [s].
    #[arg(long, default_value_t = 2.0, value_parser = seconds)]
    seconds: f64,
    /// Pushes the stylus gently up and down, with .3 N: hold it.
    #[arg(long = "move")]
    has_force: bool,
    /// Pushes as a recording says (force.csv of a scene with a hand), all of it, behind the stages of safety.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["has_force", "seconds"])]
    play: Option<PathBuf>,
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|s| (0.1..=60.0).contains(s)).ok_or_else(|| "from 0.1 to 60".to_string())
}

/// Greatest force of `--move` \[N\]: a third of what a Touch holds for ever; felt, and stopped by a finger.
const FORCE: f64 = 0.3;
/// How often it goes up and down \[Hz\].
const FREQUENCY: f64 = 0.5;

/// A line of the report: what, and how it is with it. A report that nobody reads is no fault.
fn say(what: &str, how: impl std::fmt::Display) {
    drop(writeln!(io::stdout(), "{what:<14}{how}"));
}

fn main() -> ExitCode {
    let args = Args::parse();
    let trace = match args.play.as_deref().map(Trace::read).transpose() {
        Ok(trace) => trace,
        Err(error) => {
            say("recording", error);
            return ExitCode::FAILURE;
        }
    };
    say_usb();
    let Some(library) = say_library(args.library.as_deref()) else { return ExitCode::FAILURE };
    let options = TouchOptions {
        library: Some(library.name.into()),
        has_force: args.has_force || trace.is_some(),
        ..TouchOptions::default()
    };
    let touch = match Touch::open(options) {
        Ok(touch) => touch,
        Err(error) => {
            say("device", error);
            return ExitCode::FAILURE;
        }
    };
    say_device(&touch);
    let is_well = run(touch, &args, trace);
    say("verdict", if is_well { "a force loop would run" } else { "a force loop would not run: see above" });
    if is_well { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// What is plugged in.
fn say_usb() {
    if !cfg!(target_os = "linux") {
        return say("USB", "looked at on Linux alone");
    }
    match usb::devices(Path::new(usb::LINUX)) {
        Ok(devices) if devices.is_empty() => say("USB", "no device of a known kind: plugged in, and switched on?"),
        Ok(devices) => devices.iter().for_each(|device| say("USB", format!("{} {} {}", device.id, device.kind, device.product))),
        Err(error) => say("USB", format!("{}: {error}", usb::LINUX)),
    }
}

/// The library, or why there is none, and what it would need.
fn say_library(file: Option<&Path>) -> Option<HdLibrary> {
    match load(file) {
        Ok(library) => {
            say("library", library.name.display());
            Some(library)
        }
        Err(error) => {
            say("library", &error);
            if file.is_none() {
                let names: Vec<_> = candidates().iter().map(|name| name.display().to_string()).collect();
                say("looked for", names.join(", "));
            }
            for (name, package, found) in dependencies() {
                let how = found.map_or_else(|error| format!("no: {error} ({package})"), |()| "there".into());
                say("needs", format!("{name}: {how}"));
            }
            None
        }
    }
}

fn say_device(touch: &Touch) {
    touch.words().iter().for_each(|(what, word)| say(what, word));
    let info = touch.info();
    say("axes", format!("{} sensed, {} driven, {} buttons", info.freedoms[0], info.freedoms[1], info.buttons));
    let [least, most] = info.workspace.map(|corner| (corner * 1e3).round());
    say("reach", format!("{least} to {most} mm"));
    say("force", format!("{:.2} N at most, {:.2} N for long", info.force_max, info.continuous_force_max));
    let settings = SafetySettings::default();
    say("force given", format!("{:.2} N at most", settings.force_max.min(0.9 * info.force_max)));
    say("stiffness", format!("{:.0} N/m, damping {:.1} N s/m, as its maker says", info.stiffness_max, info.damping_max));
    say(
        "calibration",
        match touch.calibration() {
            Calibration::Known => "done",
            Calibration::Findable => "the device does it by itself when the loop starts",
            Calibration::Needed => "missing: put the stylus into the inkwell and leave it there for a moment",
        },
    );
}

/// What is pushed.
enum Push {
    Nothing,
    /// Gently up and down, since so many seconds.
    Wave(f64),
    Recording(ForcePlayback),
}

/// Measures ticks, and pushes behind the stages of safety.
struct Meter {
    ticks: rtrb::Producer<f64>,
    chain: SafetyChain,
    push: Push,
}

impl Servo for Meter {
    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        // The ring is read while the loop runs; a tick that finds it full is not measured.
        _ = self.ticks.push(dt);
        let force = match &mut self.push {
            Push::Nothing => return DVec3::ZERO,
            Push::Wave(time) => {
                *time += dt;
                DVec3::Y * FORCE * (std::f64::consts::TAU * FREQUENCY * *time).sin()
            }
            Push::Recording(playback) => playback.tick(state, dt),
        };
        self.chain.apply(force, 0.0, state, dt)
    }
}

/// Runs the loop and says how it went; whether it did.
fn run(touch: Touch, args: &Args, trace: Option<Trace>) -> bool {
    let info = touch.info().clone();
    let (ticks, mut measured) = rtrb::RingBuffer::new(8192);
    let chain = SafetyChain::new(SafetySettings::default(), &info);
    let seconds = trace.as_ref().map_or(args.seconds, Trace::duration);
    let push = match trace {
        Some(trace) => Push::Recording(ForcePlayback::new(trace)),
        None if args.has_force => Push::Wave(0.0),
        None => Push::Nothing,
    };
    let mut running = match Box::new(touch).run(Box::new(Meter { ticks, chain, push })) {
        Ok(running) => running,
        Err(not) => {
            say("loop", not.error);
            return false;
        }
    };
    let (mut spans, mut low, mut high) = (vec![], DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut has_fault = false;
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < seconds && running.phase() == DevicePhase::Running {
        std::thread::sleep(Duration::from_millis(10));
        spans.extend(std::iter::from_fn(|| measured.pop().ok()));
        has_fault |= say_events(running.as_mut());
        if let Some(state) = running.state() {
            (low, high) = (low.min(state.position), high.max(state.position));
        }
    }
    has_fault |= say_events(running.as_mut());
    let state = running.state();
    running.stop();
    // The first tick has none before it.
    spans.drain(..1.min(spans.len()));
    say_spans(&mut spans, &info);
    if let Some(state) = state {
        let place = (state.position * 1e4).round() / 10.0;
        say("stylus", format!("at {place} mm, moved by {:.1} mm, buttons {:b}", (high - low).length() * 1e3, state.buttons));
        say("motors", format!("{:.0} % of the temperature at which they stop", 100.0 * state.motor_temperature));
    }
    !has_fault && state.is_some()
}

/// What happened since; whether a fault did.
fn say_events(running: &mut dyn RunningDevice) -> bool {
    let mut has_fault = false;
    while let Some(event) = running.event() {
        has_fault |= event.has_begun;
        say("fault", event);
    }
    has_fault
}

/// Rate and jitter of the ticks.
fn say_spans(spans: &mut [f64], info: &DeviceInfo) {
    if spans.is_empty() {
        return say("loop", "no ticks");
    }
    spans.sort_by(f64::total_cmp);
    let count = spans.len() as f64;
    let mean = spans.iter().sum::<f64>() / count;
    let deviation = (spans.iter().map(|span| (span - mean).powi(2)).sum::<f64>() / count).sqrt();
    let at = |share: f64| 1e3 * spans[((count - 1.0) * share) as usize];
    say("loop", format!("{:.1} Hz over {count} ticks, {:.0} Hz by its maker", 1.0 / mean, info.rate));
    let late = spans.iter().filter(|span| **span > 2e-3).count();
    say(
        "jitter",
        format!(
            "{:.0} us; ticks of {:.3} ms (1 %), {:.3} (50 %), {:.3} (99 %), {:.3} at most; {late} above 2 ms",
            1e6 * deviation,
            at(0.01),
            at(0.5),
            at(0.99),
            at(1.0),
        ),
    );
}
