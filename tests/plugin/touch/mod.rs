//! A Touch in an app, by the driver as it is, which loads a library with all the entries of libHD: what an
//! app hears of it, and that it goes on whatever becomes of the device. How soon force is gone is measured
//! by the device's clock in that library's own tests.

mod library;

use super::feel::{ABOVE, DEEP, Told, device, hand, has_told, is_felt, live, pulse, sculpt, session, settings};
use super::*;
use bevy::log::LogPlugin;
use bevy_clay::haptics::safety::Stage;
use bevy_clay::haptics::servo::Placement;
use library::{Control, alone, true_place};
use std::path::Path;

/// The device's origin is above the clay.
fn touch() -> HapticSettings {
    let placement = Placement { position: ABOVE, ..Placement::default() };
    HapticSettings { device: ArmChoice::Touch, simulated: hand(ABOVE), placement, ..settings() }
}

/// An app with a Touch, which logs.
fn app_with_a_touch() -> (App, Entity) {
    let (mut app, clay, _) = sculpt(touch());
    app.add_plugins(LogPlugin::default());
    (app, clay)
}

/// Updates with a hand that goes into the clay and out of it, over and over, until it is felt.
fn press(app: &mut App, control: &Control) {
    let start = Instant::now();
    live(app, "a force", |world| {
        let is_down = start.elapsed().as_secs_f64() % 2.0 < 1.5;
        control.hand(if is_down { DEEP.y - ABOVE.y } else { 0.0 });
        // The device's own motors push the hand out.
        is_felt(world) && control.motors()[1] > 0.05
    });
}

/// What was told of faults.
fn faults(app: &App) -> Vec<&str> {
    app.world().resource::<Told>().0.iter().filter_map(|told| told.strip_prefix("fault: ")).collect()
}

/// Waits until clay and hand have gone on.
fn goes_on(app: &mut App, clay: Entity) {
    let (time, ticks) = (metrics(app, clay).time, pulse(app.world()).map_or(0, |pulse| pulse.timing.ticks));
    live(app, "clay and hand that go on", |world| {
        let clay_goes_on = world.get::<ClayMetrics>(clay).is_some_and(|m| m.time > time + 0.05);
        clay_goes_on && pulse(world).is_some_and(|p| p.timing.ticks > ticks + 50)
    });
}

/// The warnings about the arm in a log.
fn warnings(log: &str) -> Vec<&str> {
    log.lines().filter(|line| line.contains("WARN") && line.contains("haptic arm: ")).collect()
}

/// A Touch is found, opened and felt. Unplugged, it pushes nothing, is told of once, and the simulated arm
/// has the hand, however often it is tried in vain; plugged in again it is back by itself, and told of again.
#[test]
fn touch_is_felt_and_comes_back_after_its_cable() {
    let log = alone("touch::touch_is_felt_and_comes_back_after_its_cable", None, || {
        let (mut app, clay) = app_with_a_touch();
        let control = Control::new();
        live(&mut app, "the arm", |world| has_told(world, "ready: Fake Touch, stand-in: false"));
        press(&mut app, &control);
        assert_eq!((session(app.world()).phase(), faults(&app)), (HapticPhase::Arm, vec![]));
        control.plan("unplug");
        live(&mut app, "the loss", |world| has_told(world, "fault: Some(Lost)"));
        assert_eq!(control.motors(), [0.0; 3]);
        live(&mut app, "the stand-in", |world| session(world).phase() == HapticPhase::StandIn);
        goes_on(&mut app, clay);
        let tries = control.count("open");
        live(&mut app, "a try in vain", |_| control.count("open") > tries);
        goes_on(&mut app, clay);
        let lost = "Some(Lost), begun: true, the device does not answer (unplugged, or switched off): no force until it is back";
        assert!(matches!(faults(&app)[..], [told] if told.starts_with(lost)), "{:?}", faults(&app));
        assert!(session(app.world()).message().is_some_and(|message| message.contains("does not answer")));
        control.plan("");
        live(&mut app, "the arm again", |world| session(world).phase() == HapticPhase::Arm);
        assert!(
            matches!(faults(&app)[..], [_, told] if told.starts_with("Some(Lost), begun: false, over: ")),
            "{:?}",
            faults(&app)
        );
        assert_eq!((device(app.world()), session(app.world()).message()), ("Fake Touch", None));
        press(&mut app, &control);
        assert_eq!(faults(&app).len(), 2, "{:?}", faults(&app));
    });
    assert!(log.is_none_or(|log| warnings(&log).len() == 1));
}

/// Faults of a Touch that runs: each takes the force, is told when it begins and when it ends, and the force
/// comes back.
#[test]
fn faults_of_a_touch_begin_and_end_each_for_itself() {
    let log = alone("touch::faults_of_a_touch_begin_and_end_each_for_itself", None, || {
        let (mut app, clay) = app_with_a_touch();
        let control = Control::new();
        press(&mut app, &control);
        // The second begins while the first lasts.
        control.plan("warm");
        live(&mut app, "warm motors", |world| has_told(world, "fault: Some(WarmMotors), begun: true, the motors are too hot"));
        assert_eq!(control.motors(), [0.0; 3]);
        control.plan("warm;nan_pose");
        live(&mut app, "no place", |world| has_told(world, "fault: Some(Pose), begun: true"));
        assert_eq!(control.motors(), [0.0; 3]);
        control.plan("warm");
        live(&mut app, "a place", |world| has_told(world, "fault: Some(Pose), begun: false"));
        assert!(session(app.world()).message().is_some_and(|message| message.contains("too hot")), "the first lasts");
        goes_on(&mut app, clay);
        control.plan("");
        live(&mut app, "cool motors", |world| has_told(world, "fault: Some(WarmMotors), begun: false"));
        assert_eq!((session(app.world()).phase(), session(app.world()).message()), (HapticPhase::Arm, None));
        press(&mut app, &control);
        assert_eq!(faults(&app).len(), 4, "{:?}", faults(&app));
    });
    assert!(log.is_none_or(|log| warnings(&log).len() == 2));
}

/// A Touch at clay that is paused pushes nothing once its models are old, which is no fault of the device,
/// and pushes again when the clay goes on.
#[test]
fn touch_does_not_push_at_clay_that_stands() {
    let log = alone("touch::touch_does_not_push_at_clay_that_stands", None, || {
        let (mut app, clay) = app_with_a_touch();
        let control = Control::new();
        press(&mut app, &control);
        app.world_mut().get_mut::<ClayClock>(clay).expect("a clock").paused = true;
        live(&mut app, "old models", |world| pulse(world).is_some_and(|p| p.sample.age > 0.2));
        assert_eq!(control.motors(), [0.0; 3]);
        assert!(pulse(app.world()).is_some_and(|p| p.safety.is_active(Stage::Age)));
        app.world_mut().get_mut::<ClayClock>(clay).expect("a clock").paused = false;
        press(&mut app, &control);
        assert_eq!(faults(&app), Vec::<&str>::new());
    });
    assert!(log.is_none_or(|log| warnings(&log).is_empty()));
}

/// Without libHD the simulated arm has the hand, and one message says what is missing; once it is installed
/// the Touch is there.
#[test]
fn missing_library_leaves_the_simulated_arm_until_it_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("libHD.so");
    let log = alone("touch::missing_library_leaves_the_simulated_arm_until_it_is_there", Some(&file), || {
        let (mut app, clay) = app_with_a_touch();
        is_told_once(&mut app, clay, "install OpenHaptics");
        let file = std::env::var_os("OPENHAPTICS_LIBHD").expect("a file");
        // Under another name first: what is written in part is no library.
        let part = Path::new(&file).with_extension("part");
        std::fs::copy(true_place(), &part).and_then(|_| std::fs::rename(&part, &file)).expect("installed");
        live(&mut app, "the arm", |world| session(world).phase() == HapticPhase::Arm);
        assert!(matches!(faults(&app)[..], [_, told] if told.starts_with("None, begun: false, over: ")), "{:?}", faults(&app));
        press(&mut app, &Control::new());
    });
    assert!(log.is_none_or(|log| warnings(&log).len() == 1));
}

/// So it is with another library by the name of libHD. A tool that is let go of takes its faults along.
#[cfg(target_os = "linux")]
#[test]
fn wrong_library_leaves_the_simulated_arm() {
    let log = alone("touch::wrong_library_leaves_the_simulated_arm", Some(Path::new("libm.so.6")), || {
        let (mut app, clay) = app_with_a_touch();
        is_told_once(&mut app, clay, "another library bears the name of libHD");
        let tool = session(app.world()).tool().expect("a tool");
        app.world_mut().entity_mut(tool).remove::<HapticSettings>();
        live(&mut app, "an open hand", |world| session(world).phase() == HapticPhase::Closed);
        assert!(matches!(faults(&app)[..], [_, told] if told.starts_with("None, begun: false, over: ")), "{:?}", faults(&app));
    });
    assert!(log.is_none_or(|log| warnings(&log).len() == 1));
}

/// No libHD: one fault, which says what helps, and an app that goes on with the simulated arm, felt.
fn is_told_once(app: &mut App, clay: Entity, hint: &str) {
    live(app, "the reason", |world| has_told(world, hint));
    assert_eq!(session(app.world()).phase(), HapticPhase::StandIn);
    assert!(session(app.world()).message().is_some_and(|message| message.contains(hint)));
    live(app, "a force", is_felt);
    // It is tried again after 2 s.
    let start = Instant::now();
    live(app, "a try in vain", |_| start.elapsed() > Duration::from_secs(3));
    goes_on(app, clay);
    assert!(
        matches!(faults(app)[..], [told] if told.starts_with("None, begun: true, no library of a Touch")),
        "{:?}",
        faults(app)
    );
}
