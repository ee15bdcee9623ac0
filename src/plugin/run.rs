//! A clay's engine and what is planned for it, behind one lock: the app's systems drive it, or the thread of
//! an arm. Nothing that is done under the lock waits.

use super::plans::Plans;
use super::space::ClaySpace;
use crate::sim::engine::{Engine, EngineError};
use crate::sim::frame::FrameReport;
use crate::sim::material::ClayMaterial;
use crate::sim::planner::{Policy, ToolSamples};
use crate::sim::tool::Tool;
use bevy::prelude::*;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What the app says of a clay and its tools: what plans come from, beside time and ways.
#[derive(Clone, Debug)]
pub(super) struct Orders {
    pub(super) policy: Policy,
    pub(super) material: ClayMaterial,
    /// Seconds of clay per second of the clock that it follows [-].
    pub(super) speed: f64,
    /// Whether its time stands.
    pub(super) stands: bool,
    /// The tool that an arm holds, if it touches this clay.
    pub(super) arm: Option<ArmOrders>,
    /// When the app said so, by the host's clock \[s\].
    pub(super) written: f64,
}

/// The tool that an arm holds, as a clay sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ArmOrders {
    pub(super) key: u64,
    pub(super) tool: Tool,
    pub(super) space: ClaySpace,
}

/// A frame that has ended, with the entities of its tools.
pub(super) struct Ended {
    pub(super) report: FrameReport,
    pub(super) tools: Vec<Entity>,
}

/// See the [module](self).
pub(super) struct Run {
    engine: Box<dyn Engine>,
    pub(super) plans: Plans,
    /// None until the app has planned once.
    pub(super) orders: Option<Orders>,
    /// Whether another engine is about to take over: no more frames are planned.
    pub(super) is_leaving: bool,
    /// Whether an arm's thread plans and polls: the app's systems then do neither.
    pub(super) is_driven: bool,
    /// Frames that the app has not seen.
    ended: VecDeque<Ended>,
    /// Why there will be no next frame.
    fault: Option<EngineError>,
}

impl Run {
    pub(super) fn engine(&mut self) -> &mut dyn Engine {
        self.engine.as_mut()
    }

    /// Why there will be no next frame.
    pub(super) fn fault(&self) -> Option<&EngineError> {
        self.fault.as_ref()
    }

    /// Takes in the frames that have ended; `see` sees each before the app does. Names each kind of trouble
    /// once.
    pub(super) fn poll(&mut self, clay: Entity, mut see: impl FnMut(&Plans, &FrameReport)) {
        while self.fault.is_none() {
            match self.engine.poll() {
                Ok(Some(mut report)) => {
                    let tools = self.plans.note(&mut report);
                    see(&self.plans, &report);
                    let news = report.health.without(self.plans.logged);
                    if !news.is_ok() {
                        warn!("clay {clay}, frame {}: {news}", report.plan_id);
                        self.plans.logged.insert(news);
                    }
                    self.ended.push_back(Ended { report, tools });
                }
                Ok(None) => return,
                Err(error) => self.fault = Some(error),
            }
        }
    }

    /// The frames that the app has not seen.
    pub(super) fn take_ended(&mut self) -> VecDeque<Ended> {
        std::mem::take(&mut self.ended)
    }

    /// Lets `time` \[s\] pass by a clock that stands at `now` \[s\], which the tools' samples have too, and hands
    /// the engine a frame if one is due: that frame's id. `arm` is what an arm's tool did.
    pub(super) fn advance(&mut self, clay: Entity, time: f64, now: f64, arm: Option<ToolSamples>) -> Option<u64> {
        let orders = self.orders.as_ref().filter(|_| self.fault.is_none())?;
        if orders.stands {
            self.plans.lift();
            return None;
        }
        self.plans.planner.policy = orders.policy;
        self.plans.pass(time, orders.speed, now, arm);
        if self.is_leaving {
            // The next engine goes on with what the tools did meanwhile.
            return None;
        }
        match self.plans.step(self.engine.as_mut(), &orders.material) {
            Ok(sent) => return sent,
            Err(EngineError::Params(error)) => self.plans.refuse(clay, error),
            Err(error) => self.fault = Some(error),
        }
        None
    }

    /// Has an arm's thread drive, or the app's systems again. Their clocks are not the same: tools are put
    /// down anew.
    pub(super) fn set_driven(&mut self, is_driven: bool) {
        if std::mem::replace(&mut self.is_driven, is_driven) != is_driven {
            self.plans.lift();
            self.orders = None;
        }
    }

    /// Lets the clay's time stand.
    pub(super) fn stand(&mut self) {
        self.plans.lift();
        if let Some(orders) = &mut self.orders {
            orders.stands = true;
        }
    }
}

/// A [`Run`] that several hold.
#[derive(Clone)]
pub(super) struct SharedRun(Arc<Mutex<Run>>);

impl SharedRun {
    pub(super) fn new(engine: Box<dyn Engine>, plans: Plans) -> Self {
        let run = Run { engine, plans, orders: None, is_leaving: false, is_driven: false, ended: VecDeque::new(), fault: None };
        Self(Arc::new(Mutex::new(run)))
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Run> {
        // What a panic of another thread left is what it had got to: a frame more or less.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether both are the same engine's.
    pub(super) fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}
