//! A tool in the hand of an arm: the simulated one, in real time. What is asserted of time is that things
//! come.

use super::*;
use bevy_clay::haptics::device::fault::{DeviceError, DeviceEvent, Fault};
use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath, Operator, SimulatedArm, SimulatedDevice};
use bevy_clay::haptics::device::{DeviceInfo, DevicePhase, DeviceState, HapticDevice, NotStarted, RunningDevice, Servo};
use bevy_clay::haptics::guarded::HandPulse;
use bevy_clay::haptics::safety::Stage;
use bevy_clay::haptics::servo::{ForceScale, Placement};
use bevy_clay::plugin::feel::settings::ArmOpener;
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Where the ball is before it comes down, and where the hand means to go: 6 mm deep.
pub(super) const ABOVE: DVec3 = DVec3::new(0.02, 0.030, 0.02);
pub(super) const DEEP: DVec3 = DVec3::new(0.02, 0.019, 0.02);

/// What the app was told of its arm.
#[derive(Resource, Default)]
pub(super) struct Told(pub(super) Vec<String>);

/// A hand that goes down, stays for a second and comes up again, over and over: a force that has faded comes
/// back once the tool is free. `origin` is the device's in the world.
pub(super) fn hand(origin: DVec3) -> SimulatedHand {
    let arm = ArmSettings { operator: Operator::FIRM, ..ArmSettings::default() };
    let press = |i: u32| {
        let way = [(0.3, ABOVE), (0.7, DEEP), (1.7, DEEP), (2.1, ABOVE)];
        way.map(|(time, at)| (f64::from(i) * 2.1 + time, at - origin))
    };
    SimulatedHand { arm, path: HandPath::new((0..200).flat_map(press)) }
}

/// The hand feels a fifth of what the clay does: it would not come in otherwise.
pub(super) fn settings() -> HapticSettings {
    HapticSettings { force: ForceScale { gain: 0.2, ..ForceScale::default() }, ..HapticSettings::simulated(hand(DVec3::ZERO)) }
}

/// An app by the clock on the wall, with a cube and a ball in a hand: both.
pub(super) fn sculpt(settings: HapticSettings) -> (App, Entity, Entity) {
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 0.0));
    app.world_mut().entity_mut(clay).insert(ClayHistory::default());
    app.init_resource::<Told>()
        .add_observer(|news: On<HapticReady>, mut told: ResMut<Told>| {
            told.0.push(format!("ready: {}, stand-in: {}", news.device, news.is_stand_in));
        })
        .add_observer(|news: On<HapticFault>, mut told: ResMut<Told>| {
            told.0.push(format!("fault: {:?}, begun: {}, {}", news.fault, news.has_begun, news.message));
        })
        .add_observer(|news: On<HapticContact>, mut told: ResMut<Told>| told.0.push(format!("contact: {}", news.has_begun)))
        .add_observer(|news: On<ClayChanged>, mut told: ResMut<Told>| told.0.push(format!("changed: {:?}", news.change)));
    app.insert_resource(TimeUpdateStrategy::Automatic);
    let tool = app.world_mut().spawn((SculptTool::ball(DX as f32), settings)).id();
    (app, clay, tool)
}

/// Updates by the clock on the wall until `done`.
pub(super) fn live(app: &mut App, what: &str, mut done: impl FnMut(&World) -> bool) {
    let start = Instant::now();
    loop {
        app.update();
        if done(app.world()) {
            return;
        }
        let (told, pulse) = (&app.world().resource::<Told>().0, pulse(app.world()));
        assert!(start.elapsed() < PATIENCE, "waited in vain: {what}; {told:?}; {pulse:?}");
        std::thread::sleep(Duration::from_millis(4));
    }
}

pub(super) fn session(world: &World) -> &HapticSession {
    world.resource::<HapticSession>()
}

/// The name of the device that has the hand.
pub(super) fn device(world: &World) -> &str {
    session(world).device().map_or("", |info| &info.name)
}

pub(super) fn pulse(world: &World) -> Option<&HandPulse> {
    session(world).pulse()
}

/// Whether the hand is in the clay with its whole force, or what is left of it once the hand was shaken: a
/// thread that had to wait for the processor is a loop with a delay.
pub(super) fn is_felt(world: &World) -> bool {
    let has_come = |pulse: &HandPulse| pulse.safety.gain > 0.99 || pulse.safety.is_active(Stage::Buzz);
    pulse(world).is_some_and(|pulse| has_come(pulse) && pulse.sample.hand_force.y > 0.05)
}

pub(super) fn has_told(world: &World, part: &str) -> bool {
    world.resource::<Told>().0.iter().any(|told| told.contains(part))
}

/// Height of the clay under the ball \[m\].
fn height_under_the_ball(app: &App, clay: Entity) -> f64 {
    let state = state(app, clay);
    let places = state.particles.iter().map(|p| state.domain.to_world(p.grid()));
    let under = places.filter(|p| (p.x - ABOVE.x).hypot(p.z - ABOVE.z) < 0.6 * DX);
    under.map(|p| p.y).fold(0.0, f64::max)
}

/// The tool goes where the hand leads it, the clay gives way, hand and app feel it, and the app hears of it.
#[test]
fn tool_in_the_hand_dents_the_clay_and_is_felt() {
    let (mut app, clay, tool) = sculpt(settings());
    let before = height_under_the_ball(&app, clay);
    live(&mut app, "a force", is_felt);
    live(&mut app, "the hand at its place", |world| pulse(world).is_some_and(|p| p.sample.hand.y < 0.022));
    let sample = pulse(app.world()).expect("a tick").sample;
    let place = app.world().get::<Transform>(tool).expect("a place").translation;
    assert!(place.as_dvec3().distance(sample.tool) < 1e-6, "drawn at {place}, led to {}", sample.tool);
    // The hand waits for no clay.
    let start = Instant::now();
    while before - height_under_the_ball(&app, clay) < 5e-4 {
        assert!(start.elapsed() < PATIENCE, "no dent");
        app.update();
    }
    live(&mut app, "a force on the tool", |world| world.get::<ToolForce>(tool).is_some_and(|force| force.force.y > 0.1));
    assert!(has_told(app.world(), "ready: simulated arm, stand-in: false") && has_told(app.world(), "contact: true"));
    let session = session(app.world());
    assert_eq!((session.tool(), session.clay(), session.message()), (Some(tool), Some(clay), None));
    let latency = session.latency();
    assert!(latency.pose_to_picture.count > 10 && latency.pose_to_model.mean > 0.0 && latency.model_age.count > 100);
    let force = latency.pose_to_force;
    assert!(force.count > 100 && force.mean > 0.0 && force.greatest >= force.mean, "{force:?}");
    assert!(session.device().is_some_and(|info| info.force_max == 3.3 && info.rate == 1000.0), "{:?}", session.device());
    assert!(session.samples().zip(session.samples().skip(1)).all(|(a, b)| a.time < b.time));
}

/// A main thread that is held up for 200 ms leaves no gap in what the hand knows of the clay: frames are
/// planned, run and published meanwhile. By the main thread there would be two at most.
#[test]
fn stalled_main_thread_leaves_no_gap_in_the_models() {
    let (mut app, clay, _) = sculpt(settings());
    live(&mut app, "a force", is_felt);
    let start = Instant::now();
    loop {
        let from = session(app.world()).samples().last().expect("a sample").time;
        let models = session(app.world()).latency().pose_to_model.count;
        std::thread::sleep(Duration::from_millis(200));
        // The first look after the stall: nothing was seen to by the app meanwhile.
        live(&mut app, "a look", |world| session(world).samples().last().is_some_and(|s| s.time > from));
        let session = session(app.world());
        let models = session.latency().pose_to_model.count - models;
        let frames: BTreeSet<u64> = session.samples().filter(|s| s.time > from).map(|s| s.frame).collect();
        if models >= 6 && frames.len() >= 6 {
            break;
        }
        // Another program may have had the machine; a clay that waits for the main thread never gets there.
        assert!(start.elapsed() < PATIENCE, "{models} models, {} frames felt in a stall", frames.len());
    }
    // What ended meanwhile is reported.
    let reports = app.world().resource::<Reports>().0.iter().map(|r| r.report.plan_id).collect::<Vec<_>>();
    assert!(reports.windows(2).all(|pair| pair[1] == pair[0] + 1), "{reports:?}");
    assert_eq!(status(&app, clay).error, None);
}

/// Paused clay has no models, and its force goes; it comes back with the clay's time.
#[test]
fn paused_clay_ages_and_is_not_felt() {
    let (mut app, clay, _) = sculpt(settings());
    live(&mut app, "a force", is_felt);
    app.world_mut().get_mut::<ClayClock>(clay).expect("a clock").paused = true;
    live(&mut app, "no force", |world| pulse(world).is_some_and(|p| p.sample.hand_force == DVec3::ZERO && p.sample.age > 0.14));
    assert!(pulse(app.world()).expect("a tick").safety.is_active(Stage::Age));
    live(&mut app, "the last frame", |world| engine(world, clay).pending() == 0);
    app.update();
    let (models, time) = (session(app.world()).latency().pose_to_model.count, metrics(&app, clay).time);
    let ticks = pulse(app.world()).expect("a tick").timing.ticks;
    live(&mut app, "more ticks", |world| pulse(world).is_some_and(|p| p.timing.ticks > ticks + 100));
    assert_eq!((session(app.world()).latency().pose_to_model.count, metrics(&app, clay).time), (models, time));
    app.world_mut().get_mut::<ClayClock>(clay).expect("a clock").paused = false;
    live(&mut app, "models", |world| session(world).latency().pose_to_model.count > models + 5);
    // The app's own clock too.
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    live(&mut app, "age", |world| pulse(world).is_some_and(|p| p.sample.age > 0.14));
}

/// The switch takes all force and gives it back, without a jump.
#[test]
fn force_is_switched_off_and_on() {
    let (mut app, _, tool) = sculpt(settings());
    live(&mut app, "a force", is_felt);
    let switch = |app: &mut App, is_on| app.world_mut().get_mut::<HapticSettings>(tool).expect("settings").has_force = is_on;
    switch(&mut app, false);
    // The clay presses on, and its models are young: nothing else takes the force.
    let is_off = |p: &HandPulse| p.safety.gain == 0.0 && p.sample.hand_force == DVec3::ZERO && !p.safety.is_active(Stage::Age);
    live(&mut app, "no force", |world| pulse(world).is_some_and(|p| is_off(p) && p.sample.clay_force.y > 0.1));
    switch(&mut app, true);
    live(&mut app, "a force", is_felt);
    assert_no_jump(&app);
}

/// No force changes by more than .3 N in a millisecond.
fn assert_no_jump(app: &App) {
    let samples: Vec<_> = session(app.world()).samples().collect();
    for pair in samples.windows(2) {
        let (time, change) = (pair[1].time - pair[0].time, pair[1].hand_force.distance(pair[0].hand_force));
        assert!(change <= 300.0 * time + 1e-9, "{change} N in {time} s");
    }
}

/// After an undo the force goes to nothing and comes back slowly, and so it does when the app asks for it.
#[test]
fn force_goes_and_comes_back_after_an_undo_and_for_a_menu() {
    let (mut app, clay, _) = sculpt(settings());
    live(&mut app, "a state to go back to", |world| world.get::<ClayHistory>(clay).is_some_and(|h| h.bytes() > 0));
    live(&mut app, "a force", is_felt);
    let before = ramp_ticks(app.world());
    app.world_mut().trigger(UndoClay { entity: clay });
    live(&mut app, "a ramp", |world| ramp_ticks(world) > before + RAMP);
    assert_no_jump(&app);
    // The hand may have begun its next stroke: what could be redone is gone with that.
    live(&mut app, "undone clay", |world| has_told(world, "changed: Undone"));
    live(&mut app, "a force", is_felt);
    assert_no_jump(&app);
    let before = ramp_ticks(app.world());
    app.world_mut().resource_mut::<HapticSession>().restart_force();
    live(&mut app, "a ramp", |world| ramp_ticks(world) > before + RAMP);
    live(&mut app, "a force", is_felt);
    assert_no_jump(&app);
}

/// Least ticks of a ramp from nothing to all.
const RAMP: u64 = 700;

/// Ticks in which force came or went.
fn ramp_ticks(world: &World) -> u64 {
    pulse(world).expect("a tick").safety.ticks(Stage::Ramp)
}

/// A device whose plug may be pulled and whose buttons may be pressed; else it is the simulated arm.
#[derive(Clone, Default)]
struct Plug {
    is_pulled: Arc<AtomicBool>,
    buttons: Arc<AtomicU32>,
}

impl Plug {
    fn opener(&self) -> ArmChoice {
        let plug = self.clone();
        let open = move || -> Result<Box<dyn HapticDevice>, DeviceError> {
            if plug.is_pulled.load(Ordering::Relaxed) {
                return Err(DeviceError::Library("the plug is pulled".into()));
            }
            let SimulatedHand { arm, path } = hand(DVec3::ZERO);
            let device = SimulatedDevice::new(SimulatedArm::new(arm, path));
            let info = DeviceInfo { name: "plugged arm".into(), ..device.info().clone() };
            Ok(Box::new(PluggedDevice { plug: plug.clone(), info, device: Box::new(device) }))
        };
        ArmChoice::Other(ArmOpener(Arc::new(open)))
    }
}

struct PluggedDevice {
    plug: Plug,
    info: DeviceInfo,
    device: Box<SimulatedDevice>,
}

/// The servo with buttons pressed.
struct Pressed(Box<dyn Servo>, Arc<AtomicU32>);

impl Servo for Pressed {
    fn begin(&mut self, info: &DeviceInfo) {
        self.0.begin(info);
    }

    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        self.0.tick(&DeviceState { buttons: self.1.load(Ordering::Relaxed), ..*state }, dt)
    }
}

impl HapticDevice for PluggedDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn run(self: Box<Self>, servo: Box<dyn Servo>) -> Result<Box<dyn RunningDevice>, NotStarted> {
        let Self { plug, info, device } = *self;
        let running = device.run(Box::new(Pressed(servo, plug.buttons.clone())))?;
        Ok(Box::new(RunningPlugged { plug, info, running, was_told: false }))
    }
}

struct RunningPlugged {
    plug: Plug,
    info: DeviceInfo,
    running: Box<dyn RunningDevice>,
    was_told: bool,
}

impl RunningDevice for RunningPlugged {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn phase(&self) -> DevicePhase {
        if self.plug.is_pulled.load(Ordering::Relaxed) { DevicePhase::Lost } else { self.running.phase() }
    }

    fn state(&mut self) -> Option<DeviceState> {
        self.running.state()
    }

    fn event(&mut self) -> Option<DeviceEvent> {
        let is_news = self.phase() == DevicePhase::Lost && !std::mem::replace(&mut self.was_told, true);
        is_news.then_some(DeviceEvent { time: 0.0, fault: Fault::Lost, has_begun: true, code: 0, internal: 0 })
    }

    fn stop(self: Box<Self>) -> Option<Box<dyn Servo>> {
        self.running.stop()
    }
}

/// A device that is lost gives its hand to the simulated arm, once it is back it has it again; app and clay
/// go on and are told.
#[test]
fn lost_device_leaves_the_hand_to_the_simulated_arm() {
    let plug = Plug::default();
    let (mut app, clay, _) = sculpt(HapticSettings { device: plug.opener(), ..settings() });
    live(&mut app, "the arm", |world| has_told(world, "ready: plugged arm, stand-in: false"));
    live(&mut app, "a force", is_felt);
    plug.is_pulled.store(true, Ordering::Relaxed);
    live(&mut app, "the loss", |world| has_told(world, "fault: Some(Lost), begun: true, the device does not answer"));
    live(&mut app, "the stand-in", |world| session(world).phase() == HapticPhase::StandIn);
    assert!(session(app.world()).message().is_some_and(|message| message.contains("does not answer")));
    let (time, ticks) = (metrics(&app, clay).time, pulse(app.world()).expect("a tick").timing.ticks);
    live(&mut app, "clay and hand that go on", |world| {
        let clay_goes_on = world.get::<ClayMetrics>(clay).is_some_and(|m| m.time > time + 0.05);
        clay_goes_on && pulse(world).is_some_and(|p| p.timing.ticks > ticks + 50)
    });
    assert_eq!(device(app.world()), "simulated arm");
    plug.is_pulled.store(false, Ordering::Relaxed);
    live(&mut app, "the arm again", |world| session(world).phase() == HapticPhase::Arm);
    assert_eq!((device(app.world()), session(app.world()).message()), ("plugged arm", None));
    assert!(has_told(app.world(), "begun: false, over: "));
    live(&mut app, "a force", is_felt);
}

/// The device's frame may be turned, scaled and elsewhere; the clutch lets the hand go on without the tool.
#[test]
fn hand_is_placed_scaled_and_clutched() {
    let plug = Plug::default();
    let turn = glam::DQuat::from_rotation_y(0.7);
    let placed = Placement { position: DVec3::new(0.3, 0.1, -0.2), rotation: turn, scale: 1.0 };
    let aside = HapticSettings { device: plug.opener(), placement: placed, ..settings() };
    let (mut app, _, tool) = sculpt(aside);
    let is_placed = |placement: Placement| {
        move |world: &World| pulse(world).is_some_and(|p| p.sample.hand.distance(placement.point(p.state.position)) < 1e-12)
    };
    live(&mut app, "a hand elsewhere", is_placed(placed));
    let scaled = Placement { scale: 3.0, ..placed };
    let set = |app: &mut App, placement| {
        app.world_mut().get_mut::<HapticSettings>(tool).expect("settings").placement = placement;
    };
    set(&mut app, scaled);
    live(&mut app, "a larger world", is_placed(scaled));
    // A scale that is none is not taken, and is named.
    set(&mut app, Placement { scale: 0.0, ..placed });
    live(&mut app, "a refusal", |world| session(world).refused().is_some_and(|e| e.to_string().contains("scale")));
    set(&mut app, scaled);
    live(&mut app, "no refusal", |world| session(world).refused().is_none());
    // The second button is the clutch.
    plug.buttons.store(2, Ordering::Relaxed);
    live(&mut app, "the clutch", |world| pulse(world).is_some_and(|p| p.is_clutched));
    assert_eq!(session(app.world()).buttons(), 2);
    let stood = pulse(app.world()).expect("a tick").sample.hand;
    let ticks = pulse(app.world()).expect("a tick").timing.ticks;
    live(&mut app, "more ticks", |world| pulse(world).is_some_and(|p| p.timing.ticks > ticks + 100));
    assert_eq!(pulse(app.world()).expect("a tick").sample.hand, stood);
    plug.buttons.store(0, Ordering::Relaxed);
    live(&mut app, "the hand again", |world| pulse(world).is_some_and(|p| !p.is_clutched));
}

/// An arm's clay runs on the processor and says so; without a tool in the hand the app drives the clay again.
#[test]
fn arm_takes_the_clay_and_gives_it_back() {
    let (mut app, clay, tool) = sculpt(settings());
    app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").engine = EngineChoice::Gpu;
    let is_said = |world: &World| {
        world.get::<ClayStatus>(clay).is_some_and(|s| s.error.as_ref().is_some_and(|e| e.to_string().contains("haptic arm")))
    };
    live(&mut app, "the reason", is_said);
    live(&mut app, "a force", is_felt);
    app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").engine = EngineChoice::Native;
    // Another clay in its place is felt too.
    app.world_mut().entity_mut(clay).insert(Clay::snapshot(cube(4, 0.0)));
    let generation = |world: &World| engine(world, clay).revision().0;
    let before = generation(app.world());
    live(&mut app, "another engine", |world| generation(world) > before);
    let models = session(app.world()).latency().pose_to_model.count;
    live(&mut app, "its models", |world| session(world).latency().pose_to_model.count > models + 5);
    live(&mut app, "a force", is_felt);
    app.world_mut().despawn(tool);
    live(&mut app, "an open hand", |world| session(world).phase() == HapticPhase::Closed);
    let contacts: Vec<_> = app.world().resource::<Told>().0.iter().filter(|told| told.starts_with("contact: ")).collect();
    assert!(contacts.chunks(2).all(|pair| pair == ["contact: true", "contact: false"]), "each has an end: {contacts:?}");
    settle(&mut app, "the last frame", |world| engine(world, clay).pending() == 0);
    tick(&mut app, clay);
    let time = metrics(&app, clay).time;
    (0..3).for_each(|_| tick(&mut app, clay));
    assert!((metrics(&app, clay).time - time - 0.03).abs() < 1e-9, "by the app's clock: {}", metrics(&app, clay).time - time);
}
