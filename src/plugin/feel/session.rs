//! The app's end of a hand's loop: what runs it, what it is told, what it says.

use super::drive::{Bond, Drive};
use super::events::HapticFault;
use super::faults::{Cause, FaultNews, LastingFaults};
use super::settings::{ArmChoice, HapticSettings, SimulatedHand};
use super::track::{Latency, SAMPLES_MAX};
use super::vibration::Vibrations;
use crate::haptics::clock;
use crate::haptics::device::DeviceInfo;
use crate::haptics::device::failover::{Failover, FailoverEvent, Retry};
use crate::haptics::device::fault::DeviceError;
use crate::haptics::device::vibration::VibrationSink;
use crate::haptics::guarded::{GuardedServo, HandOrders, HandPulse, TickTiming};
use crate::haptics::servo::{ServoSample, ServoSettings};
use crate::sim::params::ParamsError;
use bevy::platform::cell::SyncCell;
use bevy::prelude::*;
use std::collections::VecDeque;

/// Room for samples on their way to the clay's thread: two seconds of 1 kHz, more than a thread that runs at
/// all is held up.
const RING: usize = 2000;

/// What runs the hand's loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HapticPhase {
    /// Nothing: no tool has [`HapticSettings`].
    #[default]
    Closed,
    /// The loop changes hands.
    Changing,
    /// The arm that was asked for.
    Arm,
    /// The simulated arm in the place of one that is away.
    StandIn,
    /// Nothing any more: the loop itself has failed. Settings of another [`device`](HapticSettings::device)
    /// begin anew.
    Failed,
}

/// How late things are, from stage to stage, since the session began.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HapticLatency {
    /// From the hand's pose to its force, as far as it is this program's: what a tick of the loop takes. How
    /// long the device itself takes, it does not say.
    pub pose_to_force: Latency,
    /// From the last pose of the hand that a model of the clay knows of to when the hand's loop has that
    /// model.
    pub pose_to_model: Latency,
    /// Between two models.
    pub model_interval: Latency,
    /// Age of the clay's latest frame, in each sample of the hand.
    pub model_age: Latency,
    /// From the hand's pose to the end of the app's frame that draws its tool there: when that is seen lies
    /// with the graphics driver and the screen.
    pub pose_to_picture: Latency,
}

/// The arm that an app's tool is in the hand of, as a resource: closed until a tool has [`HapticSettings`].
/// The force itself is made in a thread of the device's own, the clay's plans in one of the clay's.
#[derive(Resource, Default)]
pub struct HapticSession {
    pub(super) live: Option<Live>,
    /// Counts the times that force was let go and come back.
    restarts: u32,
    pub(super) is_priority_told: bool,
    unopened: Option<Unopened>,
    /// What is wrong with the settings that were not taken.
    pub(super) refused: Option<ParamsError>,
    pub(super) vibrations: Vibrations,
}

/// A tool for whose hand no thread was to be had.
struct Unopened {
    tool: Entity,
    settings: HapticSettings,
    message: String,
}

/// A session that is open.
pub(super) struct Live {
    pub(super) tool: Entity,
    /// What it was opened for.
    device: ArmChoice,
    simulated: SimulatedHand,
    failover: SyncCell<Failover>,
    settings_in: triple_buffer::Input<ServoSettings>,
    orders_in: triple_buffer::Input<HandOrders>,
    pulses: triple_buffer::Output<Option<HandPulse>>,
    /// What was written last.
    written: (ServoSettings, HandOrders),
    pub(super) drive: Drive,
    pub(super) bond: Option<Bond>,
    phase: HapticPhase,
    info: Option<DeviceInfo>,
    pub(super) faults: LastingFaults,
    pulse: Option<HandPulse>,
    samples: VecDeque<ServoSample>,
    /// How many of them have come with the latest look.
    fresh: usize,
    latency: HapticLatency,
    /// Time of the pose that the next picture will show \[s\].
    pub(super) drawn: Option<f64>,
}

impl HapticSession {
    /// The tool in the hand.
    pub fn tool(&self) -> Option<Entity> {
        self.live.as_ref().map(|live| live.tool)
    }

    /// The clay that is felt, once its engine runs.
    pub fn clay(&self) -> Option<Entity> {
        Some(self.live.as_ref()?.bond.as_ref()?.clay)
    }

    /// What runs the loop.
    pub fn phase(&self) -> HapticPhase {
        self.live.as_ref().map_or(HapticPhase::Closed, |live| live.phase)
    }

    /// What the device says of itself that runs the loop, or did last; none before the first.
    pub fn device(&self) -> Option<&DeviceInfo> {
        self.live.as_ref()?.info.as_ref()
    }

    /// What is wrong with the arm; none where all is well.
    pub fn message(&self) -> Option<&str> {
        self.live.as_ref()?.faults.message()
    }

    /// What is wrong with the latest settings, where they were not taken: the hand keeps those before.
    pub fn refused(&self) -> Option<&ParamsError> {
        self.refused.as_ref()
    }

    /// The latest tick that was looked at: pose, force, stages of safety, timing. None before the first.
    pub fn pulse(&self) -> Option<&HandPulse> {
        self.live.as_ref()?.pulse.as_ref()
    }

    /// Buttons held: bit i is button i.
    pub fn buttons(&self) -> u32 {
        self.pulse().map_or(0, |pulse| pulse.state.buttons)
    }

    /// The hand's samples of the last two seconds at 1 kHz, the oldest first. Their force on the hand is that
    /// behind the stages of safety.
    pub fn samples(&self) -> impl Iterator<Item = &ServoSample> {
        self.live.iter().flat_map(|live| &live.samples)
    }

    /// How late things are.
    pub fn latency(&self) -> HapticLatency {
        self.live.as_ref().map_or_else(HapticLatency::default, |live| live.latency)
    }

    /// Has a controller shake for what a tool feels, whether an arm holds it or not: for changes of its
    /// force, and for its slip along the clay. It takes the place of the tool's sink before. One that fails
    /// is told as a [`HapticFault`] of the tool, and left alone.
    ///
    /// ```
    /// use bevy_clay::haptics::device::vibration::{Shake, VibrationSink};
    /// use bevy_clay::prelude::*;
    /// # use bevy::prelude::*;
    ///
    /// /// A controller's motor.
    /// struct Motor;
    ///
    /// impl VibrationSink for Motor {
    ///     fn shake(&mut self, shake: &Shake) -> Result<(), String> {
    ///         println!("{:.0} % at {:.0} Hz for {:.3} s", 100.0 * shake.amplitude, shake.frequency, shake.duration);
    ///         Ok(())
    ///     }
    /// }
    ///
    /// fn connect(tools: Query<Entity, Added<SculptTool>>, mut session: ResMut<HapticSession>) {
    ///     tools.iter().for_each(|tool| session.set_vibration(tool, Motor));
    /// }
    /// # bevy::ecs::system::assert_is_system(connect);
    /// ```
    pub fn set_vibration(&mut self, tool: Entity, sink: impl VibrationSink + 'static) {
        self.vibrations.set(tool, Box::new(sink));
    }

    /// Takes a tool's sink away.
    pub fn remove_vibration(&mut self, tool: Entity) {
        self.vibrations.remove(tool);
    }

    /// Lets the force go within 20 ms, and come back slowly: for what takes the hand's mind off the clay, as
    /// a menu does. After an undo and other changes of the clay this is done without asking.
    pub fn restart_force(&mut self) {
        self.restarts = self.restarts.wrapping_add(1);
        let restarts = self.restarts;
        if let Some(live) = &mut self.live {
            live.order(HandOrders { restarts, ..live.written.1 });
        }
    }

    /// Opens the arm of these settings for a tool, where none is open. Returns at once: devices are opened
    /// aside.
    ///
    /// # Errors
    /// The system starts no thread.
    pub(super) fn open(&mut self, tool: Entity, settings: &HapticSettings, servo: ServoSettings) -> Result<(), DeviceError> {
        let orders = settings.orders(self.restarts);
        let (guarded, ends) = GuardedServo::new(servo, orders, RING);
        let (stand_in, guarded) = (settings.simulated.opener(), Box::new(guarded));
        let failover = match settings.device.opener() {
            Some(device) => Failover::start(device, stand_in, Retry::default(), guarded)?,
            None => Failover::alone(stand_in, guarded)?,
        };
        let drive = Drive::start(ends.clay.samples, ends.clay.models)?;
        drive.set_scale(servo.placement.scale);
        self.live = Some(Live {
            tool,
            device: settings.device.clone(),
            simulated: settings.simulated.clone(),
            failover: SyncCell::new(failover),
            settings_in: ends.clay.settings,
            orders_in: ends.orders,
            pulses: ends.pulses,
            written: (servo, orders),
            drive,
            bond: None,
            phase: HapticPhase::Changing,
            info: None,
            faults: LastingFaults::default(),
            pulse: None,
            samples: VecDeque::new(),
            fresh: 0,
            latency: HapticLatency::default(),
            drawn: None,
        });
        Ok(())
    }

    /// Notes that no session could be opened; what there is to tell. It lasts until these settings or this
    /// tool are gone ([`Self::end_failure`]).
    pub(super) fn fail(&mut self, tool: Entity, settings: &HapticSettings, error: &DeviceError) -> HapticFault {
        let message = error.to_string();
        self.unopened = Some(Unopened { tool, settings: settings.clone(), message: message.clone() });
        HapticFault { entity: tool, fault: None, has_begun: true, message }
    }

    /// Whether it was tried in vain for these already: it was told, and is not tried again.
    pub(super) fn has_failed(&self, tool: Entity, settings: &HapticSettings) -> bool {
        self.unopened.as_ref().is_some_and(|failed| failed.tool == tool && failed.settings == *settings)
    }

    /// The end of that, where it lasts: it is tried anew, or nobody asks any more.
    pub(super) fn end_failure(&mut self) -> Option<HapticFault> {
        let Unopened { tool, message, .. } = self.unopened.take()?;
        Some(HapticFault { entity: tool, fault: None, has_begun: false, message: format!("over: {message}") })
    }

    /// Ends the session. Returns at once: devices are closed aside.
    pub(super) fn close(&mut self) {
        let Some(live) = self.live.take() else { return };
        if let Some(bond) = &live.bond {
            bond.run.lock().set_driven(false);
        }
        let failover = SyncCell::to_inner(live.failover);
        let end = move || drop(failover.stop());
        if let Err(error) = std::thread::Builder::new().name("haptic device: close".into()).spawn(end) {
            // The closure, and the device with it, has been dropped: that ends it too, on this thread.
            warn!("the haptic device was closed while the app waited: {error}");
        }
    }

    /// Whether what was opened is what the settings ask for.
    pub(super) fn is_of(&self, tool: Entity, settings: &HapticSettings) -> bool {
        self.live.as_ref().is_some_and(|live| {
            let is_same_hand = settings.device != ArmChoice::Simulated || live.simulated == settings.simulated;
            live.tool == tool && live.device == settings.device && is_same_hand
        })
    }

    /// Hands on what the settings say now.
    pub(super) fn write(&mut self, settings: &HapticSettings, servo: ServoSettings) {
        let Some(before) = self.live.as_ref().map(|live| live.written.0.placement) else { return };
        if before != servo.placement {
            self.restart_force();
        }
        let orders = settings.orders(self.restarts);
        let Some(live) = &mut self.live else { return };
        if live.written.0 != servo {
            live.drive.set_scale(servo.placement.scale);
            live.settings_in.write(servo);
            live.written.0 = servo;
        }
        live.order(orders);
    }
}

/// What a look at the device tells the app.
pub(super) enum News {
    Ready { is_stand_in: bool },
    Fault(FaultNews),
}

impl Live {
    fn order(&mut self, orders: HandOrders) {
        if self.written.1 != orders {
            self.orders_in.write(orders);
            self.written.1 = orders;
        }
    }

    /// Looks at the device, at the hand and at the thread of the clay; what there is to tell.
    pub(super) fn look(&mut self) -> Vec<News> {
        let mut news = vec![];
        while let Some(event) = self.failover.get().poll(clock::now()) {
            self.take(event, &mut news);
        }
        let spell = self.pulse.map_or(0, |pulse| pulse.timing.spell);
        self.pulse = *self.pulses.read();
        if let Some(timing) = self.pulse.map(|pulse| pulse.timing).filter(|timing| timing.spell != spell) {
            let TickTiming { spell_ticks, compute_mean, compute_max, .. } = timing;
            self.latency.pose_to_force.join(Latency { count: spell_ticks.into(), mean: compute_mean, greatest: compute_max });
        }
        let track = self.drive.track();
        self.latency.pose_to_model.join(track.model);
        self.latency.model_interval.join(track.interval);
        self.fresh = track.samples.len();
        for sample in track.samples {
            if sample.age.is_finite() {
                self.latency.model_age.note(sample.age);
            }
            if self.samples.len() == SAMPLES_MAX {
                self.samples.pop_front();
            }
            self.samples.push_back(sample);
        }
        news
    }

    fn take(&mut self, event: FailoverEvent, news: &mut Vec<News>) {
        let mut faults = vec![];
        let mut ready = None;
        match event {
            FailoverEvent::Device(event) if event.has_begun => {
                self.faults.begin(Cause::Device(event.fault), event.to_string(), &mut faults);
            }
            FailoverEvent::Device(event) => self.faults.end_of(event.fault, &mut faults),
            FailoverEvent::Away(error) => {
                self.faults.begin(Cause::Away, error.to_string(), &mut faults);
                self.introduce();
            }
            FailoverEvent::Here | FailoverEvent::StandIn => {
                let is_stand_in = matches!(event, FailoverEvent::StandIn) && self.device != ArmChoice::Simulated;
                self.phase = if is_stand_in { HapticPhase::StandIn } else { HapticPhase::Arm };
                if is_stand_in {
                    self.faults.end_of_device(&mut faults);
                } else {
                    self.faults.end_all(&mut faults);
                }
                self.introduce();
                ready = Some(News::Ready { is_stand_in });
            }
            FailoverEvent::Ended => {
                self.phase = HapticPhase::Failed;
                let message = "the loop of force has failed: there is no force until a device is chosen anew";
                self.faults.begin(Cause::Failed, message.into(), &mut faults);
            }
        }
        news.extend(faults.into_iter().map(News::Fault).chain(ready));
    }

    fn introduce(&mut self) {
        if let Some(running) = self.failover.get().running() {
            self.info = Some(running.info().clone());
        }
    }

    /// The samples that have come with the latest look.
    pub(super) fn fresh(&self) -> impl Iterator<Item = &ServoSample> {
        self.samples.iter().skip(self.samples.len() - self.fresh)
    }

    pub(super) fn device_name(&self) -> &str {
        self.info.as_ref().map_or("", |info| &info.name)
    }

    /// Where the clay's tool was last, and when.
    pub(super) fn latest(&self) -> Option<&ServoSample> {
        self.pulse.as_ref().map(|pulse| &pulse.sample)
    }

    /// A picture that shows the hand's tool has been handed on.
    pub(super) fn note_picture(&mut self) {
        if let Some(time) = self.drawn.take() {
            self.latency.pose_to_picture.note((clock::now() - time).max(0.0));
        }
    }
}
