//! An arm beside the headset: its tool is where the device is in the room, one to one, scaled, and without
//! the hand as long as the clutch is held.

use super::act::space;
use super::work::{squeeze, with_hand, work};
use super::{Step, is_ready, session};
use crate::start::Extent;
use bevy::prelude::*;
use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath, Operator, SimulatedArm, SimulatedDevice};
use bevy_clay::haptics::device::{DeviceInfo, DeviceState, HapticDevice, NotStarted, RunningDevice, Servo};
use bevy_clay::haptics::guarded::HandPulse;
use bevy_clay::haptics::servo::{Placement, ServoSample};
use bevy_clay::plugin::feel::settings::ArmOpener;
use bevy_clay::prelude::*;
use bevy_clay::scene::placement::PlacementFile;
use glam::DVec3;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// How high over the clay's top the hand goes, how low it comes at first, and by how much lower with each
/// stroke, of the tool's radius: what a stroke before has pressed away bears nothing; and how long it takes
/// from the one to the other \[s\].
const HIGH: f64 = 1.5;
const LOW: f64 = 0.3;
const LOWER: f64 = 0.1;
const STROKE: f64 = 1.0;
/// Least force that is one \[N\].
const FORCE: f64 = 0.05;
/// The second button: the clutch.
const CLUTCH: u32 = 2;

/// The buttons that are held.
#[derive(Resource, Clone, Default)]
struct Buttons(Arc<AtomicU32>);

/// A simulated arm with a hand on its buttons.
struct ButtonedArm {
    arm: SimulatedDevice,
    info: DeviceInfo,
    buttons: Buttons,
}

impl HapticDevice for ButtonedArm {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn run(self: Box<Self>, servo: Box<dyn Servo>) -> Result<Box<dyn RunningDevice>, NotStarted> {
        Box::new(self.arm).run(Box::new(ButtonedServo { servo, buttons: self.buttons }))
    }
}

struct ButtonedServo {
    servo: Box<dyn Servo>,
    buttons: Buttons,
}

impl Servo for ButtonedServo {
    fn begin(&mut self, info: &DeviceInfo) {
        self.servo.begin(info);
    }

    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        self.servo.tick(&DeviceState { buttons: self.buttons.0.load(Ordering::Relaxed), ..*state }, dt)
    }
}

/// An arm whose hand goes up and down over its origin, lower each time.
fn opener(radius: f64, buttons: Buttons) -> ArmOpener {
    let low = |i: u32| LOW - LOWER * f64::from(i / 2);
    let at = |i: u32| (f64::from(i) * STROKE, DVec3::Y * radius * if i.is_multiple_of(2) { HIGH } else { low(i) });
    let path = HandPath::new((0..100).map(at));
    ArmOpener(Arc::new(move || {
        let arm = SimulatedArm::new(ArmSettings { operator: Operator::STYLUS, ..default() }, path.clone());
        let info = arm.info();
        Ok(Box::new(ButtonedArm { arm: SimulatedDevice::new(arm), info, buttons: buttons.clone() }))
    }))
}

fn settings(world: &mut World) -> Mut<'_, HapticSettings> {
    world.query::<&mut HapticSettings>().single_mut(world).expect("one tool of an arm")
}

/// The radius of the arm's ball \[m\].
fn radius(world: &mut World) -> f64 {
    let (tool, _) = world.query::<(&SculptTool, &HapticSettings)>().single(world).expect("one tool of an arm");
    -tool.shape.distance(DVec3::ZERO)
}

fn pulse(world: &World) -> Option<HandPulse> {
    world.resource::<HapticSession>().pulse().copied()
}

/// Where the top of the clay is in the room.
fn top(world: &mut World) -> DVec3 {
    let Extent { middle, floor, .. } = *world.resource::<Extent>();
    let top = middle.with_y(2.0 * middle.y - floor).as_dvec3();
    space(world).point_to_world(top).as_dvec3()
}

/// A hand that was seen: in the device's frame, in the room, and the force on it \[N\].
type Sight = (DVec3, DVec3, f64);

/// What was seen of it, and the greatest forces of the clay and on the hand \[N\].
#[derive(Resource, Default)]
struct Seen {
    sights: Vec<Sight>,
    clay: f64,
    felt: f64,
}

fn see(world: &mut World) {
    let sight = pulse(world).map(|pulse| (pulse.state.position, pulse.sample.hand, pulse.sample.hand_force.length()));
    let session = world.resource::<HapticSession>();
    let most = |of: fn(&ServoSample) -> f64| session.samples().map(of).fold(0.0, f64::max);
    let (clay, felt) = (most(|s| s.clay_force.length()), most(|s| s.hand_force.length()));
    let mut seen = world.resource_mut::<Seen>();
    seen.sights.extend(sight);
    seen.clay = seen.clay.max(clay);
    seen.felt = seen.felt.max(felt);
}

/// Looks at the hand in every frame for `seconds`, or until the clay has pushed if it is to.
fn watch(name: &'static str, seconds: f64, is_to_touch: bool) -> Step {
    let is_over = move |world: &mut World, now: f64| {
        see(world);
        now >= seconds && (!is_to_touch || world.resource::<Seen>().clay > FORCE)
    };
    Step { is_over: Box::new(is_over), ..Step::new(name, 0.0, |world| world.insert_resource(Seen::default())) }
}

/// How far the hand and the tool went along what was seen \[m\], and the greatest force at a look \[N\].
fn ways(world: &World) -> (f64, f64, f64) {
    let sights = &world.resource::<Seen>().sights;
    let spread = |of: fn(&Sight) -> DVec3| {
        let from = sights.first().map_or(DVec3::ZERO, of);
        sights.iter().map(|sight| of(sight).distance(from)).fold(0.0, f64::max)
    };
    (spread(|s| s.0), spread(|s| s.1), sights.iter().map(|s| s.2).fold(0.0, f64::max))
}

/// That the tool went `scale` times as far as the hand, into clay that pushed.
fn scaled(name: &'static str, scale: f64) -> Step {
    Step::check(name, move |world| {
        let (hand, tool, _) = ways(world);
        let Seen { clay, felt, .. } = world.resource::<Seen>();
        let said = format!(
            "the hand goes {:.1} mm, the tool {:.1}; the clay pushes with up to {clay:.2} N, of which {felt:.2} are felt",
            hand * 1e3,
            tool * 1e3
        );
        if hand > 0.01 && (tool / hand - scale).abs() < 1e-6 { Ok(said) } else { Err(said) }
    })
}

/// The steps; a placement is written into `file`, and read from there.
pub(super) fn steps(file: PathBuf) -> Vec<Step> {
    let is_held = |world: &mut World| {
        let session = world.resource::<HapticSession>();
        session.phase() == HapticPhase::Arm && session.clay().is_some() && session.pulse().is_some()
    };
    let mut steps = vec![
        Step::wait("the session is focused, both hands are seen, the clay is shown", is_ready),
        Step::wait("the arm's hand has its tool", is_held),
    ];
    steps.extend(stands_by());
    steps.extend([
        Step::new("a hand on the buttons", 0.5, |world| {
            let buttons = Buttons::default();
            world.insert_resource(buttons.clone());
            let radius = radius(world);
            settings(world).device = ArmChoice::Other(opener(radius, buttons));
        })
        .until(is_held),
        watch("up and down", 4.0 * STROKE, true),
        scaled("one to one", 1.0),
        Step::check("a placement from a file", move |world| {
            let before = settings(world).placement;
            // Where the first stroke was lowest the hand is still; from there on the tool goes twice as far.
            let position = before.position - DVec3::Y * LOW * radius(world);
            let text = format!("(position: ({}, {}, {}), scale: 2)", position.x, position.y, position.z);
            fs::write(&file, text).map_err(|error| format!("{}: {error}", file.display()))?;
            let placement = PlacementFile::load(&file).map_err(|error| error.to_string())?;
            settings(world).placement = placement;
            if placement == (Placement { position, scale: 2.0, ..Placement::default() }) {
                Ok(format!("{}", file.display()))
            } else {
                Err(format!("{placement:?}"))
            }
        }),
        Step::new("the force comes back", 1.0, |_| ()),
        watch("up and down", 4.0 * STROKE, true),
        scaled("scaled", 2.0),
    ]);
    steps.extend(clutch());
    steps.push(Step::new("the arm is put away", 2.0, |world| {
        let tool = world.query_filtered::<Entity, With<HapticSettings>>().single(world).expect("a tool");
        world.despawn(tool);
    }));
    steps.extend(session::lose_device());
    steps
}

/// An arm of which nobody said where it is goes with the work.
fn stands_by() -> Vec<Step> {
    let stands = |world: &mut World| {
        let (top, placement) = (top(world), settings(world).placement);
        let off = placement.position.distance(top);
        let said = format!("its origin {:.3} mm from the clay's top", off * 1e3);
        if off < 1e-5 { Ok(said) } else { Err(said) }
    };
    let carry = |to: f32| {
        move |world: &mut World| {
            let hand = Isometry3d::from_xyz(to, 1.0, -0.2);
            with_hand(world, Side::Left, |scripted| scripted.go(hand, 0.3));
        }
    };
    vec![
        Step::check("an arm that was put nowhere stands by the clay", stands),
        Step::new("the support hand comes", 0.6, carry(-0.3)),
        Step::new("closes", 0.4, |world| squeeze(world, 1.0, 0.0)),
        Step::new("carries the work", 0.6, carry(-0.2)),
        Step::new("opens", 0.4, |world| squeeze(world, 0.0, 0.0)),
        Step::check("and goes with it", move |world| {
            let at = work(world).translation;
            Ok(format!("the work at ({:.2}, {:.2}, {:.2}) m, {}", at.x, at.y, at.z, stands(world)?))
        }),
    ]
}

/// The hand goes on and the tool stands, as long as the clutch is held.
fn clutch() -> Vec<Step> {
    let hold = |buttons: u32| move |world: &mut World| world.resource::<Buttons>().0.store(buttons, Ordering::Relaxed);
    let is_clutched = |world: &mut World| pulse(world).is_some_and(|pulse| pulse.is_clutched);
    vec![
        Step::new("the clutch is held", 0.2, hold(CLUTCH)).until(is_clutched),
        watch("up and down", 2.0 * STROKE, false),
        Step::check("clutch", |world| {
            let (hand, tool, force) = ways(world);
            let said = format!("the hand goes {:.1} mm, the tool {:.1}, with at most {force:.2} N", hand * 1e3, tool * 1e3);
            if hand > 0.01 && tool == 0.0 && force == 0.0 { Ok(said) } else { Err(said) }
        }),
        Step::new("let go", 0.3, hold(0)).until(move |world| !is_clutched(world)),
    ]
}
