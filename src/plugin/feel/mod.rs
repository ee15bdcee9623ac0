//! Feel: a tool of the app in the hand that holds a haptic arm.
//!
//! | file         | takes                         | makes                                                   |
//! |--------------|-------------------------------|---------------------------------------------------------|
//! | [`settings`] | what an app wants             | [`HapticSettings`], for the hand's loop                 |
//! | [`session`]  | an arm, or its stand-in       | [`HapticSession`], the app's end of the loop            |
//! | `drive`      | the hand's ways, plans' orders | the clay's thread: plans in, contact models out        |
//! | `space`      | models in the clay's frame    | models in the world                                     |
//! | [`track`]    | samples, models               | two seconds of samples, times from stage to stage       |
//! | `faults`     | what a device tells           | when faults begin and end                               |
//! | `contact`    | samples, reports              | when contact and cuts begin and end                     |
//! | `vibration`  | forces on tools               | controllers that shake                                  |
//! | [`events`]   | contact, cuts, faults         | what an app is told                                     |
//!
//! The loop of force runs in the device's own thread
//! ([`GuardedServo`](crate::haptics::guarded::GuardedServo)), never in a schedule of the app. Here are the
//! systems that hand settings to it and show what comes of it: ninety times a second by the clock on the
//! wall, so that a paused app has its hand on the switch still, and once a frame at most.

mod contact;
pub(super) mod drive;
pub mod events;
mod faults;
pub mod session;
pub mod settings;
mod space;
pub mod track;
mod vibration;

pub use session::HapticSession;

use super::clay::{Clay, ClayReport};
use super::engine::{self, Armed, ClayEngine};
use super::events::{ClayChanged, DropOffcuts, RedoClay, ResampleClay, ResetClay, UndoClay};
use super::held::HeldTime;
use super::report;
use super::schedule::{ClaySystems, schedule};
use super::tool::{SculptTool, ToolForce};
use crate::haptics::priority;
use bevy::prelude::*;
use bevy::time::common_conditions::on_real_timer;
use contact::Contact;
use drive::Bond;
use events::{HapticContact, HapticCut, HapticReady};
use session::{Live, News};
use settings::HapticSettings;
use std::time::Duration;
use vibration::Vibrations;

/// Puts tools with [`HapticSettings`] into the hand. Without it they are tools like any other.
#[derive(Clone, Copy, Debug, Default)]
pub struct HapticPlugin;

/// Time between two looks at the hand \[s\].
const EXCHANGE: Duration = Duration::from_micros(11_111);

impl Plugin for HapticPlugin {
    fn build(&self, app: &mut App) {
        let schedule = schedule(app);
        // Without reports there are none to read.
        app.add_message::<ClayReport>()
            .init_resource::<HapticSession>()
            .init_resource::<Contact>()
            .add_observer(|asked: On<UndoClay>, session: ResMut<HapticSession>| unsettle(asked.entity, session))
            .add_observer(|asked: On<RedoClay>, session: ResMut<HapticSession>| unsettle(asked.entity, session))
            .add_observer(|asked: On<ResetClay>, session: ResMut<HapticSession>| unsettle(asked.entity, session))
            .add_observer(|asked: On<ResampleClay>, session: ResMut<HapticSession>| unsettle(asked.entity, session))
            .add_observer(|asked: On<DropOffcuts>, session: ResMut<HapticSession>| unsettle(asked.entity, session))
            .add_observer(|done: On<ClayChanged>, session: ResMut<HapticSession>| unsettle(done.entity, session))
            .add_systems(PreUpdate, (open, exchange, lead).chain().run_if(on_real_timer(EXCHANGE)))
            .add_systems(schedule, bind.in_set(ClaySystems::Report).after(engine::admit).before(report::report))
            .add_systems(schedule, (cut, shake).chain().in_set(ClaySystems::Report).after(report::feel))
            .add_systems(Last, draw);
    }
}

/// Lets the force go and come back slowly where the clay that is felt is about to be another.
fn unsettle(clay: Entity, mut session: ResMut<HapticSession>) {
    if session.clay() == Some(clay) {
        session.restart_force();
    }
}

/// A tool in the hand.
type Held<'a> = (Entity, &'a HapticSettings, &'a SculptTool, &'a Transform);

/// Opens, closes and instructs the session as the first tool with settings says.
fn open(
    tools: Query<Held>,
    mut session: ResMut<HapticSession>,
    mut contact: ResMut<Contact>,
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let first = tools.iter().map(|(tool, ..)| tool).min();
    let Some((tool, settings, sculpt, place)) = first.and_then(|tool| tools.get(tool).ok()) else {
        if session.live.is_some() {
            close(&mut session, &mut contact, &mut commands);
        }
        session.bypass_change_detection().end_failure().into_iter().for_each(|over| commands.trigger(over));
        return;
    };
    if let Err(error) = settings.validate() {
        if session.refused.as_ref() != Some(&error) {
            warn!("tool {tool}: the arm keeps the settings that it had: {error}");
            session.refused = Some(error);
        }
        return;
    }
    session.refused = None;
    let shape = sculpt.shape.scaled(f64::from(place.scale.x));
    let servo = settings.servo(&shape);
    if session.is_of(tool, settings) {
        session.write(settings, servo);
    } else if !session.has_failed(tool, settings) {
        close(&mut session, &mut contact, &mut commands);
        session.end_failure().into_iter().for_each(|over| commands.trigger(over));
        if let Err(error) = session.open(tool, settings, servo) {
            error!("tool {tool} is in no hand: {error}");
            commands.trigger(session.fail(tool, settings, &error));
        }
    }
}

/// Ends the session, and with it what lasts: contact, faults.
fn close(session: &mut HapticSession, contact: &mut Contact, commands: &mut Commands) {
    let Some(live) = &mut session.live else { return };
    let (entity, mut over) = (live.tool, vec![]);
    live.faults.end_all(&mut over);
    over.into_iter().for_each(|news| commands.trigger(news.event(entity)));
    part(live, contact, commands);
    session.close();
}

/// The tool is at another clay, or at none: contact with the one before is over.
fn part(live: &Live, contact: &mut Contact, commands: &mut Commands) {
    let was_touching = std::mem::take(contact).is_touching();
    if let Some(Bond { clay, .. }) = live.bond.as_ref().filter(|_| was_touching) {
        commands.trigger(HapticContact { entity: live.tool, clay: *clay, has_begun: false });
    }
}

/// Looks at the hand, and tells what has happened to it.
fn exchange(mut session: ResMut<HapticSession>, mut contact: ResMut<Contact>, mut commands: Commands, held: Res<HeldTime>) {
    let _watch = held.watch();
    if let Some(words) = priority::refusal().filter(|_| !session.is_priority_told) {
        warn!("threads of force and clay have no more right than others ({words}): they are late where the machine is busy");
        session.is_priority_told = true;
    }
    let felt = session.clay();
    let Some(live) = &mut session.live else { return };
    let entity = live.tool;
    for news in live.look() {
        match news {
            News::Ready { is_stand_in } => {
                let device = live.device_name().to_string();
                info!("tool {entity} is in the hand of the {device}");
                commands.trigger(HapticReady { entity, device, is_stand_in });
            }
            News::Fault(news) => {
                if news.has_begun {
                    warn!("haptic arm: {}", news.message);
                } else {
                    info!("haptic arm: {}", news.message);
                }
                commands.trigger(news.event(entity));
            }
        }
    }
    let Some(clay) = felt else { return };
    for sample in live.fresh() {
        if let Some(has_begun) = contact.touch(sample.is_touching, sample.time) {
            commands.trigger(HapticContact { entity, clay, has_begun });
        }
    }
}

/// The tool's entity follows the hand, for drawing. The clay has the hand's own samples.
fn lead(
    mut session: ResMut<HapticSession>,
    mut tools: Query<(&mut Transform, Option<&ChildOf>)>,
    parents: Query<&GlobalTransform>,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let Some(live) = &mut session.live else { return };
    let Some(sample) = live.latest().copied() else { return };
    let Ok((mut transform, parent)) = tools.get_mut(live.tool) else { return };
    let pose = space::pose_of(&sample);
    let scale = transform.scale;
    let in_world = Transform::from_translation(pose.position.as_vec3()).with_rotation(pose.rotation.as_quat());
    let parent = parent.and_then(|parent| parents.get(parent.parent()).ok());
    let placed = match parent {
        Some(parent) => GlobalTransform::from(in_world).reparented_to(parent),
        None => in_world,
    };
    live.drawn = Some(sample.time);
    transform.set_if_neq(Transform { scale, ..placed });
}

/// Binds the arm to the clay that is felt, as soon as an engine of the processor runs it.
fn bind(
    clays: Query<(Entity, Option<&ClayEngine>), With<Clay>>,
    armed: Query<Entity, With<Armed>>,
    tools: Query<&HapticSettings>,
    mut session: ResMut<HapticSession>,
    mut contact: ResMut<Contact>,
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let asked = session.tool().and_then(|tool| tools.get(tool).ok()).map(|settings| settings.clay);
    let first = || clays.iter().map(|(clay, _)| clay).min();
    let wanted = asked.and_then(|clay| clay.or_else(first)).filter(|clay| clays.contains(*clay));
    armed.iter().filter(|clay| Some(*clay) != wanted).for_each(|clay| {
        commands.entity(clay).try_remove::<Armed>();
    });
    if let Some(clay) = wanted.filter(|clay| !armed.contains(*clay)) {
        commands.entity(clay).try_insert(Armed);
    }
    let run = wanted.and_then(|clay| Some((clay, clays.get(clay).ok()?.1?)));
    let bond = run.filter(|(_, engine)| !engine.runs_on_device()).map(|(clay, engine)| Bond { clay, run: engine.run.clone() });
    let Some(live) = session.bypass_change_detection().live.as_mut() else { return };
    let is_same = match (&live.bond, &bond) {
        (Some(old), Some(new)) => old.run.is_same(&new.run),
        (None, None) => true,
        _ => false,
    };
    if is_same {
        return;
    }
    part(live, &mut contact, &mut commands);
    if let Some(old) = live.bond.take() {
        old.run.lock().set_driven(false);
    }
    if let Some(new) = &bond {
        new.run.lock().set_driven(true);
    }
    live.drive.bind(bond.clone());
    live.bond = bond;
    session.restart_force();
}

/// Tells of cuts that the tool in the hand begins.
fn cut(
    mut reports: MessageReader<ClayReport>,
    session: Res<HapticSession>,
    mut contact: ResMut<Contact>,
    real: Res<Time<Real>>,
    mut commands: Commands,
) {
    let Some(entity) = session.tool() else { return };
    for report in reports.read().filter(|report| Some(report.clay) == session.clay()) {
        let is_cutting = report.tool(entity).is_some_and(|tool| tool.tagged > 0);
        if contact.cut(is_cutting, real.elapsed_secs_f64()) {
            commands.trigger(HapticCut { entity, clay: report.clay });
        }
    }
}

/// Has controllers shake for what tools feel in the frames that have ended. Without frames nothing does:
/// paused clay is still.
fn shake(
    mut session: ResMut<HapticSession>,
    mut reports: MessageReader<ClayReport>,
    tools: Query<(&ToolForce, Option<&HapticSettings>)>,
    transforms: TransformHelper,
    real: Res<Time<Real>>,
    mut commands: Commands,
    held: Res<HeldTime>,
) {
    let _watch = held.watch();
    let has_ended = reports.read().count() > 0;
    let Vibrations { all, over } = &mut session.bypass_change_detection().vibrations;
    over.drain(..).for_each(|fault| commands.trigger(fault));
    // A tool that is gone needs none.
    all.retain(|vibration| tools.contains(vibration.tool));
    for vibration in all.iter_mut().filter(|_| has_ended) {
        let entity = vibration.tool;
        let (Ok((force, settings)), Ok(place)) = (tools.get(entity), transforms.compute_global_transform(entity)) else {
            continue;
        };
        // Force that is switched off is none that a contact lost.
        if settings.is_some_and(|settings| !settings.has_force) {
            vibration.rest();
            continue;
        }
        let force = force.force.as_dvec3();
        if let Some(fault) = vibration.feel(real.elapsed_secs_f64(), place.translation().as_dvec3(), force) {
            warn!("tool {entity}: {}", fault.message);
            commands.trigger(fault);
        }
    }
}

/// Notes when a picture of the tool was handed on.
fn draw(mut session: ResMut<HapticSession>) {
    if let Some(live) = &mut session.bypass_change_detection().live {
        live.note_picture();
    }
}

#[cfg(test)]
mod tests {
    use super::events::HapticFault;
    use super::*;
    use crate::haptics::device::fault::DeviceError;

    #[derive(Resource, Default)]
    struct Told(Vec<(bool, String)>);

    /// A hand for which no thread was to be had is told once, is not tried again for the same settings, and
    /// is over when others come or nobody asks any more.
    #[test]
    fn failure_to_open_has_an_end() {
        let mut world = World::new();
        world.init_resource::<HapticSession>();
        world.init_resource::<Contact>();
        world.init_resource::<HeldTime>();
        world.init_resource::<Told>();
        world.add_observer(|fault: On<HapticFault>, mut told: ResMut<Told>| {
            told.0.push((fault.has_begun, fault.message.clone()));
        });
        let settings = HapticSettings::simulated(settings::SimulatedHand::default());
        let tool = world.spawn((SculptTool::ball(5e-3), Transform::default(), settings.clone())).id();
        let error = DeviceError::Library("no thread".into());
        let fault = world.resource_mut::<HapticSession>().fail(tool, &settings, &error);
        assert!(fault.has_begun && fault.entity == tool);
        let over = (false, format!("over: {error}"));
        world.run_system_cached(open).expect("runs");
        assert!(world.resource::<HapticSession>().live.is_none(), "not tried again");
        assert_eq!(world.resource::<Told>().0, []);
        world.get_mut::<HapticSettings>(tool).expect("settings").simulated.arm.mass *= 2.0;
        world.run_system_cached(open).expect("runs");
        assert!(world.resource::<HapticSession>().live.is_some());
        assert_eq!(world.resource::<Told>().0, std::slice::from_ref(&over));
        world.resource_mut::<HapticSession>().fail(tool, &settings, &error);
        world.despawn(tool);
        world.run_system_cached(open).expect("runs");
        assert_eq!(world.resource::<Told>().0, [over.clone(), over]);
    }
}
