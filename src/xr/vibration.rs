//! Controllers that vibrate as clay changes what it pushes back with, and as tools slip along it: the motors
//! of the session, as sinks of [`HapticSession`].

use super::actions::Actions;
use super::hand::{Side, XrHands};
use super::tool::HeldBy;
use crate::haptics::device::vibration::{Shake, VibrationSink};
use crate::plugin::feel::HapticSession;
use bevy::ecs::entity::EntityHashMap;
use bevy::ecs::system::SystemParam;
use bevy::prelude::*;
use bevy_mod_openxr::session::OxrSession;
use openxr::{AnyGraphics, HapticVibration};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// How strong it is.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Reflect)]
#[reflect(Resource)]
pub struct VibrationSettings {
    /// From nothing, 0, to what the forces make, 1.
    pub gain: f32,
}

impl Default for VibrationSettings {
    fn default() -> Self {
        Self { gain: 1.0 }
    }
}

/// Counts the vibrations that sessions took, for those who look for what is wrong.
#[derive(Resource, Clone, Debug, Default)]
pub struct VibrationCount(Arc<AtomicU64>);

impl VibrationCount {
    /// How many there were.
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// What motors are made of.
#[derive(SystemParam)]
pub(super) struct Motors<'w> {
    actions: Option<Res<'w, Actions>>,
    session: Option<Res<'w, OxrSession>>,
    count: Res<'w, VibrationCount>,
}

impl Motors<'_> {
    /// The motor of a side, for as long as this session lasts; none without one.
    fn get(&self, side: Side, gain: f32) -> Option<Motor> {
        let (actions, session) = (self.actions.as_ref()?, self.session.as_ref()?);
        let session: openxr::Session<AnyGraphics> = (***session).clone();
        let (action, side) = (actions.shake.clone(), actions.side(side));
        Some(Motor { action, session, side, gain, count: self.count.clone() })
    }
}

/// The motor of a controller.
struct Motor {
    action: openxr::Action<openxr::Haptic>,
    session: openxr::Session<AnyGraphics>,
    side: openxr::Path,
    gain: f32,
    count: VibrationCount,
}

impl VibrationSink for Motor {
    fn shake(&mut self, shake: &Shake) -> Result<(), String> {
        if self.gain <= 0.0 {
            return Ok(());
        }
        let nanoseconds = (shake.duration * 1e9).clamp(1.0, 1e9) as i64;
        let vibration = HapticVibration::new()
            .amplitude((shake.amplitude as f32 * self.gain).clamp(0.0, 1.0))
            .frequency(shake.frequency as f32)
            .duration(openxr::Duration::from_nanos(nanoseconds));
        self.action.apply_feedback(&self.session, self.side, &vibration).map_err(|error| error.to_string())?;
        self.count.0.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}

/// Gives tools the motors of the hands that hold them, and takes them away with the session.
pub(super) fn give_motors(
    (settings, hands): (Res<VibrationSettings>, Res<XrHands>),
    tools: Query<(Entity, &HeldBy)>,
    motors: Motors,
    haptics: Option<ResMut<HapticSession>>,
    mut given: Local<EntityHashMap<(Side, f32)>>,
) {
    let Some(mut haptics) = haptics else { return };
    given.retain(|tool, _| {
        let stays = motors.session.is_some() && tools.contains(*tool);
        if !stays {
            haptics.remove_vibration(*tool);
        }
        stays
    });
    for (tool, held) in &tools {
        let wanted = (hands.side(held.hand), settings.gain);
        if given.get(&tool) == Some(&wanted) {
            continue;
        }
        if let Some(motor) = motors.get(wanted.0, wanted.1) {
            haptics.set_vibration(tool, motor);
            given.insert(tool, wanted);
        }
    }
}
