//! The thread of a clay that an arm touches: ways of its tool in, plans to the engine, contact models out,
//! ninety times a second, whatever the main thread is held up by.
//!
//! The app's systems write what plans come from ([`Orders`]) and see the frames that have ended; here they
//! are planned and polled, by the functions that plan and poll all clay. An app that has said nothing for as
//! long as counts as sleep ([`SLEPT`]) has its clay stand: models age, and the force goes.

use super::space::{model_to_world, pose_of};
use super::track::Track;
use crate::haptics::arm_tool::ArmTool;
use crate::haptics::model::ContactModel;
use crate::haptics::servo::ServoSample;
use crate::haptics::{clock, guarded, priority};
use crate::plugin::clock::SLEPT;
use crate::plugin::run::{ArmOrders, Orders, Run, SharedRun};
use crate::sim::frame::FrameReport;
use crate::sim::planner::{Backlog, ToolSamples};
use crate::sim::tool::PoseSample;
use bevy::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Time between two plans \[s\]: 90 a second, which the stability of the loop of force was measured at.
pub(in crate::plugin) const PERIOD: f64 = 1.0 / 90.0;
/// Time between two looks at engine and hand \[s\]: a model waits no longer than a tick to be published.
const LOOK: Duration = Duration::from_millis(1);
/// A tool that goes faster than this in the device's frame did not go there [m/s]: a hand's loop is without
/// force from 1 on, and no hand throws an arm at 5.
const JUMP_SPEED: f64 = 5.0;
/// A hand that was not seen for this long \[s\] has been nobody knows where: fifty ticks.
const UNSEEN: f64 = 0.05;

/// What the plans of a clay come from that an arm touches: touches are read, frames are short, and ways that
/// the clay had no time for are not gone late. `app_speed` is that of the app's clock.
pub(in crate::plugin) fn arm(orders: &mut Orders, app_speed: f64) {
    orders.policy.outputs.touch = true;
    orders.policy.wall = Some(PERIOD);
    orders.policy.backlog = Backlog::Drop;
    orders.speed *= app_speed;
    orders.stands |= orders.speed == 0.0;
}

/// The clay that is felt.
#[derive(Clone)]
pub(super) struct Bond {
    pub(super) clay: Entity,
    pub(super) run: SharedRun,
}

/// What app and thread share. Locks are held for as long as a copy takes.
#[derive(Default)]
struct Shared {
    is_to_end: AtomicBool,
    /// World lengths that a length of the device makes [-], as bits.
    scale: AtomicU64,
    bond: Mutex<Option<Bond>>,
    track: Mutex<Track>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A copy that a panic interrupted is one more or less.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The app's hold on the thread, which ends with it.
pub(super) struct Drive {
    shared: Arc<Shared>,
    /// Joined by nobody: it ends within a look.
    _thread: JoinHandle<()>,
}

impl Drive {
    /// Starts the thread for these ends of a servo's channels.
    ///
    /// # Errors
    /// The system starts no thread.
    pub(super) fn start(
        samples: rtrb::Consumer<ServoSample>,
        models: triple_buffer::Input<ContactModel>,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let mut driver = Driver {
            shared: shared.clone(),
            samples,
            models,
            arm: ArmTool::default(),
            bond: None,
            seen: None,
            led: None,
            is_anew: false,
            last: clock::now(),
            due: clock::now(),
        };
        let run = move || {
            // Where it may not be raised it runs as it is: `priority::refusal` keeps why.
            _ = priority::raise();
            while !driver.shared.is_to_end.load(Ordering::Relaxed) {
                driver.look();
                std::thread::sleep(LOOK);
            }
        };
        let _thread = std::thread::Builder::new().name("haptic clay".into()).spawn(run)?;
        Ok(Self { shared, _thread })
    }

    /// Which clay is felt from now on; none for none.
    pub(super) fn bind(&self, bond: Option<Bond>) {
        *locked(&self.shared.bond) = bond;
    }

    /// World lengths that a length of the device makes [-].
    pub(super) fn set_scale(&self, scale: f64) {
        self.shared.scale.store(scale.to_bits(), Ordering::Relaxed);
    }

    /// What was seen since the last call.
    pub(super) fn track(&self) -> Track {
        locked(&self.shared.track).take()
    }
}

impl Drop for Drive {
    fn drop(&mut self) {
        self.shared.is_to_end.store(true, Ordering::Relaxed);
    }
}

/// What the thread has.
struct Driver {
    shared: Arc<Shared>,
    samples: rtrb::Consumer<ServoSample>,
    models: triple_buffer::Input<ContactModel>,
    arm: ArmTool,
    bond: Option<Bond>,
    /// The last sample, and the last that the tool was led by, in the clay's frame.
    seen: Option<ServoSample>,
    led: Option<PoseSample>,
    /// Whether the tool is to be put down anew.
    is_anew: bool,
    /// When time was last let pass, and when it is next \[s\].
    last: f64,
    due: f64,
}

impl Driver {
    /// Looks once at hand and engine; plans where a plan is due.
    fn look(&mut self) {
        let now = clock::now();
        self.rebind(now);
        let Some(Bond { clay, run }) = self.bond.clone() else {
            self.take_samples(None);
            return;
        };
        let mut run = run.lock();
        if !run.is_driven {
            drop(run);
            self.take_samples(None);
            return;
        }
        let orders = run.orders.as_ref().and_then(|orders| orders.arm);
        self.take_samples(orders.as_ref());
        self.poll(clay, &mut run, orders.as_ref());
        // One frame at a time: one that waits for another would be of ways that are old when it begins.
        if now >= self.due && run.engine().pending() == 0 {
            self.advance(clay, &mut run, orders.as_ref(), now);
        }
    }

    /// Takes up another clay.
    fn rebind(&mut self, now: f64) {
        let bond = locked(&self.shared.bond).clone();
        let is_same = match (&self.bond, &bond) {
            (Some(old), Some(new)) => old.run.is_same(&new.run),
            (None, None) => true,
            _ => false,
        };
        if !is_same {
            self.bond = bond;
            self.arm.forget();
            self.led = None;
            self.last = now;
            self.due = now;
            // What was known is not of this clay.
            self.models.write(guarded::gone(now));
        }
    }

    /// Takes in what the hand did.
    fn take_samples(&mut self, orders: Option<&ArmOrders>) {
        let scale = f64::from_bits(self.shared.scale.load(Ordering::Relaxed));
        let mut track = locked(&self.shared.track);
        while let Ok(sample) = self.samples.pop() {
            let before = self.seen.replace(sample);
            let is_none =
                before.is_some_and(|before| has_jumped(sample.time - before.time, before.tool.distance(sample.tool), scale));
            self.is_anew |= is_none;
            track.see(sample);
            let Some(ArmOrders { space, .. }) = orders else { continue };
            let pose = space.pose_to_clay(pose_of(&sample));
            // Nor did it where the clay went away under it: swept in one tick, that way would take the clay
            // minutes.
            self.is_anew |= self.led.is_some_and(|led| {
                has_jumped(sample.time - led.time, space.scale() * led.pose.position.distance(pose.position), scale)
            });
            self.led = Some(PoseSample { time: sample.time, pose });
            if !self.is_anew {
                self.arm.push(sample.time, pose);
            }
        }
    }

    /// Publishes the models of frames that have ended.
    fn poll(&mut self, clay: Entity, run: &mut Run, orders: Option<&ArmOrders>) {
        let Self { arm, models, shared, .. } = self;
        run.poll(clay, |plans, report: &FrameReport| {
            let Some(ArmOrders { key, space, .. }) = orders else { return };
            let mut ids = report.touches.iter().map(|touch| touch.id);
            let Some(id) = ids.find(|id| plans.planner.tool_key(*id) == Some(*key)) else { return };
            let stamp = clock::now();
            if let Some(model) = arm.note(report, id, stamp) {
                models.write(model_to_world(&model, space));
                locked(&shared.track).publish(stamp, model.span[1]);
            }
        });
    }

    /// Lets time pass, and plans a frame.
    fn advance(&mut self, clay: Entity, run: &mut Run, orders: Option<&ArmOrders>, now: f64) {
        let time = now - std::mem::replace(&mut self.last, now);
        self.due = if now > self.due + PERIOD { now + PERIOD } else { self.due + PERIOD };
        let Some(written) = run.orders.as_ref().map(|orders| orders.written) else { return };
        if time > SLEPT || now - written > SLEPT {
            // Nobody has looked after the clay: it stands, and the tool is put down anew.
            run.plans.lift();
            return;
        }
        if std::mem::take(&mut self.is_anew) {
            // Left out once, it has been let go of.
            self.arm.forget();
        }
        if orders.is_none() {
            self.arm.forget();
        }
        let way = self.arm.way();
        let tool = orders.zip(way).map(|(orders, way)| ToolSamples {
            key: orders.key,
            tool: orders.tool,
            samples: way.samples.iter().map(|s| PoseSample { time: now + s.time, pose: s.pose }).collect(),
        });
        let speed = run.orders.as_ref().map_or(1.0, |orders| orders.speed);
        if let Some(id) = run.advance(clay, time, now, tool) {
            self.arm.sent(id, run.plans.planner.lag() / speed);
        }
    }
}

/// Whether no hand went so far \[m\] in `time` \[s\], from one sample to the next.
fn has_jumped(time: f64, distance: f64, scale: f64) -> bool {
    time > UNSEEN || time <= 0.0 || distance > scale * JUMP_SPEED * time.max(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plugin::space::ClaySpace;
    use crate::sim::tool::{Contact, Tool, ToolShape};
    use glam::DVec3;

    /// A tool that holds still is put down anew where the clay is carried away under it, not where the clay
    /// goes as slowly as a hand: the way back would be swept, for minutes.
    #[test]
    fn clay_that_goes_away_is_no_way_of_the_hand() {
        for (went, is_anew) in [(0.0, false), (4e-3, false), (0.6, true)] {
            let (mut hand, samples) = rtrb::RingBuffer::new(8);
            let (models, _) = triple_buffer::triple_buffer(&ContactModel::NONE);
            let mut driver = Driver {
                shared: Arc::default(),
                samples,
                models,
                arm: ArmTool::default(),
                bond: None,
                seen: None,
                led: None,
                is_anew: false,
                last: 0.0,
                due: 0.0,
            };
            driver.shared.scale.store(1f64.to_bits(), Ordering::Relaxed);
            let tool = Tool { shape: ToolShape::Sphere { radius: 4e-3 }, contact: Contact::default() };
            for (time, x) in [(1.0, 0.0), (1.001, went)] {
                let sample = ServoSample { time, tool: DVec3::Y, ..ServoSample::default() };
                hand.push(sample).expect("room");
                let transform = GlobalTransform::from(Transform::from_xyz(x as f32, 0.0, 0.0).with_scale(Vec3::splat(4.0)));
                let space = ClaySpace::new(&transform).expect("a frame");
                driver.take_samples(Some(&ArmOrders { key: 1, tool, space }));
            }
            assert_eq!(driver.is_anew, is_anew, "{went} m");
        }
    }
}
