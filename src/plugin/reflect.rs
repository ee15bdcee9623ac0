//! Reflection of the solver's own types, which do not know Bevy: an inspector shows and edits them field by
//! field.
//!
//! Each definition repeats the type's; a field or variant that is missing here does not compile.

use super::clay::{Clay, ClaySettings};
use super::clock::{ClayClock, ClayGravity};
use super::feel::settings::HapticSettings;
use super::status::{ClayError, ClayMetrics, ClayStatus};
use super::tool::{SculptTool, ToolForce, ToolStatus, TouchesOnly};
use crate::haptics::device::simulated::{ArmSettings, HandPath, Operator};
use crate::haptics::safety::SafetySettings;
use crate::haptics::servo::{Coupling, ForceScale, Mode, Placement};
use crate::scene::file::ClayScene;
use crate::sim::health::Health;
use crate::sim::material::{ClayLaw, ClayMaterial, Weld};
use crate::sim::params::ParamsError;
use crate::sim::planner::{Backlog, InertiaScaling, IntegratorChoice, StepAccuracy};
use crate::sim::tool::{Contact, Profile, ToolShape};
use bevy::prelude::*;
use bevy::reflect::{impl_reflect, impl_reflect_opaque};
use glam::{DQuat, DVec3};

impl_reflect!(
    #[reflect(Component, Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[type_path = "bevy_clay::sim::material"]
    struct ClayMaterial {
        density: f64,
        young_modulus: f64,
        poisson_ratio: f64,
        yield_stress: f64,
        softening: f64,
        softening_length: f64,
        hardening_modulus: f64,
        viscosity: f64,
        flow_index: f64,
        toughness: f64,
        law: ClayLaw,
        weld: Weld,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
    #[type_path = "bevy_clay::sim::material"]
    enum Weld {
        Pressed,
        Sticky,
        Off,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
    #[type_path = "bevy_clay::sim::material"]
    enum ClayLaw {
        Softened,
        Worked { loss: f64, rate: f64, rest_time: f64 },
        AsPublished,
        AsPublishedDefaultD,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
    #[type_path = "bevy_clay::sim::planner"]
    enum Backlog {
        WorkOff,
        Drop,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
    #[type_path = "bevy_clay::sim::planner"]
    enum IntegratorChoice {
        Explicit,
        Auto,
        Implicit,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
    #[type_path = "bevy_clay::sim::planner"]
    enum StepAccuracy {
        Interactive,
        Fine,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
    #[type_path = "bevy_clay::sim::planner"]
    enum InertiaScaling {
        Off,
        Accurate,
        Fast,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[type_path = "bevy_clay::sim::tool"]
    enum ToolShape {
        Sphere { radius: f64 },
        Capsule { radius: f64, half_length: f64 },
        Box { half_size: DVec3 },
        Blade { half_width: f64, half_height: f64 },
        PointedBlade { half_width: f64, half_height: f64 },
        BentBlade { profile: Profile, half_height: f64 },
        Wire { half_length: f64 },
        Cone { radius: f64, half_height: f64 },
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default)]
    #[type_path = "bevy_clay::haptics::servo"]
    enum Mode {
        PaperAnchor { relaxes: bool },
        GodObject,
        ContactImpulse,
        Coupled,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default)]
    #[type_path = "bevy_clay::haptics::servo"]
    struct Coupling {
        stiffness: f64,
        damping: f64,
        stiffness_max: f64,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default)]
    #[type_path = "bevy_clay::haptics::servo"]
    struct ForceScale {
        gain: f64,
        knee: f64,
        ceiling: f64,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default)]
    #[type_path = "bevy_clay::haptics::servo"]
    struct Placement {
        position: DVec3,
        rotation: DQuat,
        scale: f64,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default)]
    #[type_path = "bevy_clay::haptics::safety"]
    struct SafetySettings {
        force_max: f64,
        slew_max: f64,
        speed_max: f64,
        ramp: f64,
        damping_max: f64,
        stiffness_min: f64,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq)]
    #[type_path = "bevy_clay::haptics::device::simulated"]
    struct Operator {
        mass: f64,
        damping: f64,
        stiffness: f64,
    }
);

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default)]
    #[type_path = "bevy_clay::haptics::device::simulated"]
    struct ArmSettings {
        mass: f64,
        damping: f64,
        friction: f64,
        resolution: f64,
        period: f64,
        jitter: f64,
        delay: usize,
        force_max: f64,
        operator: Operator,
    }
);

impl_reflect_opaque!((in bevy_clay::haptics::device::simulated) HandPath(Clone, Debug, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in bevy_clay::scene::file) ClayScene(Clone, Debug, PartialEq, Serialize, Deserialize));
impl_reflect_opaque!((in bevy_clay::sim::health) Health(Clone, Debug, PartialEq, Default));
impl_reflect_opaque!((in bevy_clay::sim::params) ParamsError(Clone, Debug, PartialEq));
impl_reflect_opaque!((in bevy_clay::plugin::status) ClayError(Clone, Debug, PartialEq));
impl_reflect_opaque!((in bevy_clay::sim::tool) Profile(Clone, Debug, PartialEq, Serialize, Deserialize));

impl_reflect!(
    #[reflect(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
    #[type_path = "bevy_clay::sim::tool"]
    enum Contact {
        Stick,
        Slip,
        Separate { friction: f64 },
    }
);

/// Registers the types that inspectors and scenes may hold. Without it both know nothing of clay.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReflectPlugin;

impl Plugin for ReflectPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<Clay>()
            .register_type::<ClayMaterial>()
            .register_type::<ClaySettings>()
            .register_type::<ClayStatus>()
            .register_type::<ClayMetrics>()
            .register_type::<ClayClock>()
            .register_type::<ClayGravity>()
            .register_type::<HapticSettings>()
            .register_type::<SculptTool>()
            .register_type::<ToolForce>()
            .register_type::<ToolStatus>()
            .register_type::<TouchesOnly>()
            .register_type_data::<ClayMaterial, ReflectDefault>();
    }
}
