//! Tools of an app: entities whose ways are swept through the clay, never jumped.

use crate::sim::params::ParamsError;
use crate::sim::tool::{Contact, Pose, PoseSample, Tool, ToolPath, ToolShape};
use bevy::prelude::*;
use std::collections::{HashMap, VecDeque};

/// A tool that acts on every clay of the app. Its pose is the entity's [`Transform`], below those of its parents; its way from frame to frame is
/// swept.
#[derive(Component, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Component, Default)]
#[require(Transform)]
pub struct SculptTool {
    /// Names the tool in reports. No two active tools may have the same.
    pub id: u32,
    /// Shape and contact; the entity's uniform scale scales the shape.
    pub tool: Tool,
    /// Whether the tool touches clay. One that is taken away and put down elsewhere does not sweep from where it was.
    pub is_active: bool,
}

impl Default for SculptTool {
    /// A ball of 8 mm radius.
    fn default() -> Self {
        let tool = Tool { shape: ToolShape::Sphere { radius: 0.008 }, contact: Contact::default() };
        Self { id: 1, tool, is_active: true }
    }
}

/// Where something of uniform scale is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    pub(super) pose: Pose,
    pub(super) scale: f64,
}

impl Placement {
    /// The place of an entity of kind `name`.
    ///
    /// # Errors
    /// A transform that is not finite, or whose scale is not uniform and positive.
    pub(super) fn new(name: &'static str, transform: &GlobalTransform) -> Result<Self, ParamsError> {
        const UNIFORM_WITHIN: f32 = 1e-3;
        let (scale, rotation, position) = transform.to_scale_rotation_translation();
        if !transform.affine().is_finite() {
            return Err(ParamsError::new(name, position, "must be finite"));
        }
        let is_uniform = (scale - Vec3::splat(scale.x)).abs().max_element() <= UNIFORM_WITHIN * scale.x.abs();
        if scale.x <= 0.0 || !is_uniform {
            return Err(ParamsError::new(name, scale, "must have a uniform, positive scale"));
        }
        let pose = Pose { position: position.as_dvec3(), rotation: rotation.as_dquat().normalize() };
        Ok(Self { pose, scale: f64::from(scale.x) })
    }

    /// `other`, given beside this one, as seen from it.
    pub(super) fn seen(&self, other: &Self) -> Self {
        let pose = Pose {
            position: self.pose.to_local(other.pose.position) / self.scale,
            rotation: (self.pose.rotation.inverse() * other.pose.rotation).normalize(),
        };
        Self { pose, scale: other.scale / self.scale }
    }
}

/// A pose and the time [s] of the app's clock since the one before it.
#[derive(Clone, Copy, Debug)]
struct Step {
    time: f64,
    pose: Pose,
}

/// A tool's way since the pose that the clay last saw.
#[derive(Clone, Debug)]
struct Way {
    from: Pose,
    steps: Vec<Step>,
}

/// Most steps of a way: a frame of 33 ms has no use for more, and clay that stands must not hoard them.
const STEPS_MAX: usize = 32;

impl Way {
    fn add(&mut self, time: f64, pose: Pose) {
        match self.steps.last_mut() {
            // The clock stood still: only the last pose counts.
            Some(last) if time <= 0.0 => last.pose = pose,
            _ => self.steps.push(Step { time, pose }),
        }
        if self.steps.len() > STEPS_MAX {
            // Every second pose goes; the last one stays.
            let merged = self
                .steps
                .rchunks(2)
                .rev()
                .map(|pair| Step { time: pair.iter().map(|s| s.time).sum(), pose: pair[pair.len() - 1].pose });
            self.steps = merged.collect();
        }
    }

    /// The way as samples over `duration` [s].
    fn samples(&self, duration: f64) -> Vec<PoseSample> {
        // Times closer than this tell rounding, not speed.
        let apart = 1e-6 * duration;
        let total: f64 = self.steps.iter().map(|s| s.time).sum();
        let mut samples = vec![PoseSample { time: 0.0, pose: self.from }];
        let mut clock = 0.0;
        for (left, step) in (0..self.steps.len()).rev().zip(&self.steps) {
            clock += step.time;
            let time = if left == 0 { duration } else { duration * (clock / total) };
            if samples.len() > 1 {
                samples.pop_if(|last| time - last.time <= apart);
            }
            if time > apart {
                samples.push(PoseSample { time, pose: step.pose });
            }
        }
        samples
    }
}

/// The ways of all tools: what is to be swept next, and what is under way.
///
/// A frame that the engine gave up left the clay as it stood before: what its tools did is swept again by the next frame that is planned after
/// all frames under way have ended.
#[derive(Debug, Default)]
pub(super) struct Ways {
    next: HashMap<Entity, Way>,
    sent: VecDeque<HashMap<Entity, Way>>,
    lost: Vec<HashMap<Entity, Way>>,
}

impl Ways {
    /// Takes in where the active tools are now, `time` [s] of the app's clock after the last call. Returns the ids of those that were put down since.
    pub(super) fn observe(&mut self, time: f64, tools: &[(Entity, SculptTool, Placement)]) -> Vec<u32> {
        let mut put_down = vec![];
        self.next.retain(|entity, _| tools.iter().any(|(e, ..)| e == entity));
        for (entity, tool, place) in tools {
            match self.next.get_mut(entity) {
                Some(way) => way.add(time, place.pose),
                None => {
                    self.next.insert(*entity, Way { from: place.pose, steps: vec![] });
                    put_down.push(tool.id);
                }
            }
        }
        put_down
    }

    /// The paths of a frame of `duration` [s], in the order of the tools' ids.
    pub(super) fn paths(&self, duration: f64, tools: &[(Entity, SculptTool, Placement)]) -> Vec<ToolPath> {
        let path = |(entity, tool, place): &(Entity, SculptTool, Placement)| {
            let samples = self.next.get(entity)?.samples(duration);
            Some(ToolPath {
                id: tool.id,
                tool: Tool { shape: tool.tool.shape.scaled(place.scale), ..tool.tool },
                sheet: 0,
                samples,
            })
        };
        let mut paths: Vec<_> = tools.iter().filter_map(path).collect();
        paths.sort_by_key(|p| p.id);
        paths
    }

    /// The frame of [`Self::paths`] was taken by the engine.
    pub(super) fn send(&mut self) {
        self.sent.push_back(self.next.clone());
        for way in self.next.values_mut() {
            way.from = way.steps.last().map_or(way.from, |s| s.pose);
            way.steps.clear();
        }
    }

    /// The oldest frame under way ended; if it was given up, its sweep is owed to the clay.
    pub(super) fn end(&mut self, is_given_up: bool) {
        let Some(ways) = self.sent.pop_front() else { return };
        if is_given_up {
            self.lost.push(ways);
        } else {
            self.lost.clear();
        }
        if !self.sent.is_empty() {
            return;
        }
        for lost in self.lost.drain(..).rev() {
            for (entity, way) in lost {
                if let Some(next) = self.next.get_mut(&entity) {
                    next.from = way.from;
                    next.steps.splice(..0, way.steps);
                }
            }
        }
    }

    /// The frames under way will never end.
    pub(super) fn lose_all(&mut self) {
        while !self.sent.is_empty() {
            self.end(true);
        }
    }

    /// Whether the next frame has to wait until those under way have ended, because one was given up.
    pub(super) fn is_mending(&self) -> bool {
        !self.lost.is_empty()
    }

    /// Forgets the tools' ways: they are put down anew.
    pub(super) fn lift(&mut self) {
        self.next.clear();
        self.lost.clear();
        self.sent.iter_mut().for_each(HashMap::clear);
    }
}
