//! What is in hands beside a ball of an arm: blades, tools of the mouse, controllers that shake; and settings
//! that are saved.

use super::feel::{DEEP, Told, hand, has_told, is_felt, live, sculpt, session, settings};
use super::*;
use bevy::ecs::entity::EntityHashMap;
use bevy::reflect::serde::{ReflectDeserializer, ReflectSerializer};
use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath, Operator};
use bevy_clay::haptics::device::vibration::{Shake, VibrationSink};
use bevy_clay::haptics::servo::{Coupling, Mode, Placement};
use bevy_clay::plugin::feel::settings::ArmOpener;
use serde::de::DeserializeSeed;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// A blade in the hand cuts: the app hears of each cut, with tool and clay, and of none before.
#[test]
fn cut_of_the_hand_is_told() {
    #[derive(Resource, Default)]
    struct Cuts(Vec<(Entity, Entity)>);
    let at = |y: f64, z: f64| DVec3::new(0.02, y, z);
    // Down and up beside the middle after a while in the air, then elsewhere, and so on: the hand waits for
    // no app, and one that is held up misses a stroke.
    let stroke = |i: u32| {
        let (begin, z) = (1.0 + 2.0 * f64::from(i), if i.is_multiple_of(2) { 0.018 } else { 0.023 });
        [(begin, at(0.06, z)), (begin + 0.5, at(0.02, z)), (begin + 1.0, at(0.06, z))]
    };
    let arm = ArmSettings { operator: Operator::FIRM, ..ArmSettings::default() };
    let hand = SimulatedHand { arm, path: HandPath::new([(0.0, at(0.06, 0.018))].into_iter().chain((0..100).flat_map(stroke))) };
    let (mut app, clay, tool) = sculpt(HapticSettings::simulated(hand));
    app.world_mut().entity_mut(tool).insert(SculptTool::blade(8.0 * DX as f32, 8.0 * DX as f32));
    app.init_resource::<Cuts>().add_observer(|news: On<HapticCut>, mut cuts: ResMut<Cuts>| cuts.0.push((news.entity, news.clay)));
    live(&mut app, "the hand", |world| has_told(world, "ready: "));
    assert!(app.world().resource::<Cuts>().0.is_empty(), "in the air");
    live(&mut app, "a cut", |world| !world.resource::<Cuts>().0.is_empty());
    let is_up = |world: &World| session(world).samples().last().is_some_and(|sample| sample.hand.y > 0.058);
    live(&mut app, "a blade in the air", is_up);
    let first = app.world().resource::<Cuts>().0.len();
    live(&mut app, "another cut", |world| world.resource::<Cuts>().0.len() > first);
    assert!(app.world().resource::<Cuts>().0.iter().all(|cut| *cut == (tool, clay)), "{:?}", app.world().resource::<Cuts>().0);
}

/// A tool that the app moves and one in the hand touch the same clay in the same frames, each with its own
/// force; the hand feels its own tool's.
#[test]
fn tools_of_mouse_and_arm_touch_at_once() {
    let (mut app, clay, tool) = sculpt(settings());
    let at = |x: f64| Transform::from_translation((DVec3::new(x, 2.0, 4.0) * DX).as_vec3());
    let mouse = app.world_mut().spawn((SculptTool::ball(2.0 * DX as f32), at(8.5))).id();
    live(&mut app, "a force", is_felt);
    // To and fro at the clay's side, ever further in.
    let start = Instant::now();
    while !is_touched_by_both(&app, clay, [tool, mouse]) {
        let time = start.elapsed().as_secs_f64();
        app.world_mut().entity_mut(mouse).insert(at(8.0 - 0.5 * (9.0 * time).sin() - (0.1 * time).min(1.5)));
        live(&mut app, "a frame", |_| true);
        assert!(start.elapsed() < PATIENCE, "the tools do not touch at once");
    }
    live(&mut app, "a force", is_felt);
    assert!(app.world().get::<ToolStatus>(mouse).is_some_and(|status| status.error.is_none()));
    assert_eq!((session(app.world()).tool(), status(&app, clay).error.clone()), (Some(tool), None));
}

/// Whether the arm's tool was pressed up and the other aside in the same frame.
fn is_touched_by_both(app: &App, clay: Entity, [arm, mouse]: [Entity; 2]) -> bool {
    app.world().resource::<Reports>().0.iter().filter(|report| report.clay == clay).any(|report| {
        report.tool(arm).is_some_and(|tool| tool.force.y > 0.1) && report.tool(mouse).is_some_and(|tool| tool.force.x > 0.1)
    })
}

/// A controller that keeps what it is asked for, until it fails.
#[derive(Clone, Default)]
struct Controller {
    shakes: Arc<Mutex<Vec<Shake>>>,
    is_away: Arc<AtomicBool>,
}

impl VibrationSink for Controller {
    fn shake(&mut self, shake: &Shake) -> Result<(), String> {
        if self.is_away.load(Ordering::Relaxed) {
            return Err("its battery is empty".into());
        }
        self.shakes.lock().expect("a lock").push(*shake);
        Ok(())
    }
}

impl Controller {
    fn take(&self) -> Vec<Shake> {
        std::mem::take(&mut self.shakes.lock().expect("a lock"))
    }
}

/// A controller shakes when its tool meets the clay, with the grains that it slips over, and not while it
/// rests on it or is in the air. One that fails is told of and left alone, another takes its place.
#[test]
fn controller_shakes_for_what_its_tool_feels() {
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 0.0));
    app.init_resource::<Told>().add_observer(|news: On<HapticFault>, mut told: ResMut<Told>| {
        told.0.push(format!("{}, {}", news.has_begun, news.message));
    });
    let at = |x: f64, y: f64| Transform::from_translation((DVec3::new(x, y, 4.0) * DX).as_vec3());
    let tool = app.world_mut().spawn((SculptTool::ball(2.0 * DX as f32), at(4.0, 7.0))).id();
    let controller = Controller::default();
    app.world_mut().resource_mut::<HapticSession>().set_vibration(tool, controller.clone());
    let place = |app: &mut App, x: f64, y: f64| {
        app.world_mut().entity_mut(tool).insert(at(x, y));
        tick(app, clay);
    };
    (0..4).for_each(|i| place(&mut app, 4.0 + f64::from(i) * 0.1, 7.0));
    assert_eq!(controller.take(), [], "in the air");
    (0..10).for_each(|i| place(&mut app, 4.0, 6.0 - f64::from(i) * 0.1));
    let met = controller.take();
    assert!(met.iter().any(|shake| shake.amplitude > 0.1 && shake.frequency == 160.0), "{met:?}");
    (0..40).for_each(|_| place(&mut app, 4.0, 5.1));
    controller.take();
    (0..10).for_each(|_| place(&mut app, 4.0, 5.1));
    assert_eq!(controller.take(), [], "at rest on the clay");
    // A tenth of a cell a tick, at .05 m/s.
    (0..10).for_each(|i| place(&mut app, 4.0 - f64::from(i) * 0.1, 5.1));
    let slipped = controller.take();
    let is_of_grains = |shake: &Shake| (40.0..=60.0).contains(&shake.frequency);
    assert!(slipped.iter().any(is_of_grains), "{slipped:?}");
    assert!(slipped.iter().all(|shake| shake.duration <= 0.1), "it ends with its frames: {slipped:?}");

    controller.is_away.store(true, Ordering::Relaxed);
    (0..10).for_each(|i| place(&mut app, 3.0 + f64::from(i) * 0.2, 5.1));
    let told = |app: &App| app.world().resource::<Told>().0.clone();
    assert!(
        matches!(&told(&app)[..], [one] if one.starts_with("true, ") && one.contains("its battery is empty")),
        "{:?}",
        told(&app)
    );
    let other = Controller::default();
    app.world_mut().resource_mut::<HapticSession>().set_vibration(tool, other.clone());
    (0..10).for_each(|i| place(&mut app, 5.0 - f64::from(i) * 0.2, 5.1));
    assert!(!other.take().is_empty());
    assert!(matches!(&told(&app)[..], [_, over] if over.starts_with("false, over: ")), "{:?}", told(&app));
    app.world_mut().resource_mut::<HapticSession>().remove_vibration(tool);
    (0..10).for_each(|i| place(&mut app, 3.0 + f64::from(i) * 0.2, 5.1));
    assert_eq!((other.take(), told(&app).len()), (vec![], 2));
}

/// The tool in an arm's hand may shake a controller too, and does not while force is switched off.
#[test]
fn tool_of_an_arm_shakes_a_controller() {
    let (mut app, _, tool) = sculpt(settings());
    let controller = Controller::default();
    app.world_mut().resource_mut::<HapticSession>().set_vibration(tool, controller.clone());
    live(&mut app, "a shake", |_| !controller.take().is_empty());
    app.world_mut().get_mut::<HapticSettings>(tool).expect("settings").has_force = false;
    let force = |world: &World| world.get::<ToolForce>(tool).expect("a force").force.y > 0.1;
    live(&mut app, "a tool in the air", |world| !force(world));
    controller.take();
    live(&mut app, "a tool in the clay", force);
    assert_eq!(controller.take(), []);
}

/// Settings are edited and saved field by field: read back they are what they were, but for a function that
/// opens an arm, which no file holds. The clay that they name is another entity in another world.
#[test]
fn reflected_settings_come_back_as_themselves() {
    let mut app = app();
    let tool = app.world_mut().spawn((SculptTool::default(), HapticSettings::simulated(hand(DEEP)))).id();
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let data = registry.get_with_short_type_path("HapticSettings").expect("registered").data::<ReflectComponent>();
    let mut reflected = data.expect("a component").reflect_mut(app.world_mut().entity_mut(tool)).expect("its component");
    *reflected.path_mut::<f64>("force.gain").expect("a field") = 0.25;
    *reflected.path_mut::<f64>("simulated.arm.operator.mass").expect("a field") = 0.07;
    let edited = app.world().get::<HapticSettings>(tool).expect("settings").clone();
    assert_eq!((edited.force.gain, edited.simulated.arm.operator.mass), (0.25, 0.07));
    let all = [
        HapticSettings::default(),
        edited,
        HapticSettings {
            mode: Mode::PaperAnchor { relaxes: true },
            coupling: Coupling { stiffness: f64::INFINITY, ..Coupling::default() },
            placement: Placement { scale: 2.0, rotation: glam::DQuat::from_rotation_y(0.3), ..Placement::default() },
            clutch: None,
            ..HapticSettings::default()
        },
    ];
    let back = |settings: &HapticSettings| {
        let text = ron::to_string(&ReflectSerializer::new(settings, &registry)).expect("a text");
        let mut reader = ron::Deserializer::from_str(&text).expect("a text");
        let read = ReflectDeserializer::new(&registry).deserialize(&mut reader).expect("a value");
        HapticSettings::from_reflect(&*read).expect("settings")
    };
    for settings in all {
        assert_eq!(back(&settings), settings);
    }
    let other = app.world_mut().spawn_empty().id();
    let mut named = HapticSettings { clay: Some(tool), ..HapticSettings::default() };
    HapticSettings::map_entities(&mut named, &mut EntityHashMap::from_iter([(tool, other)]));
    assert_eq!(named.clay, Some(other));
    let own = HapticSettings { device: ArmChoice::Other(ArmOpener::default()), ..HapticSettings::default() };
    let ArmChoice::Other(ArmOpener(open)) = back(&own).device else { panic!("an arm of the app's own") };
    assert!(open().is_err_and(|error| error.to_string().contains("no function was given")));
}
