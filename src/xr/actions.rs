//! OpenXR's actions: made once, suggested for every profile, read late in each frame.

use super::hand::{Controller, Side, XrControllers};
use super::profiles::{Input, PROFILES};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy_mod_openxr::action_binding::OxrSuggestActionBinding;
use bevy_mod_openxr::action_set_attaching::OxrAttachActionSet;
use bevy_mod_openxr::action_set_syncing::OxrSyncActionSet;
use bevy_mod_openxr::exts::OxrEnabledExtensions;
use bevy_mod_openxr::helper_traits::ToIsometry3d;
use bevy_mod_openxr::resources::{OxrFrameState, OxrInstance};
use bevy_mod_openxr::session::OxrSession;
use bevy_mod_xr::session::XrTrackingRoot;
use bevy_mod_xr::spaces::{XrPrimaryReferenceSpace, XrSpace};
use openxr::{Action, ActionSet, Haptic, Path, Posef, SpaceLocationFlags, Vector2f};

/// The actions, as long as the app runs.
#[derive(Resource)]
pub(super) struct Actions {
    set: ActionSet,
    sides: [Path; 2],
    poses: [Action<Posef>; 3],
    trigger: Action<f32>,
    squeeze: Action<f32>,
    stick: Action<Vector2f>,
    stick_click: Action<bool>,
    menu: Action<bool>,
    pub(super) shake: Action<Haptic>,
    /// Whether the bindings were suggested: they outlive a session.
    is_suggested: bool,
}

/// The inputs that are poses.
const POSES: [Input; 3] = [Input::Grip, Input::Aim, Input::Tool];

impl Actions {
    fn new(instance: &OxrInstance) -> openxr::Result<Self> {
        let set = instance.create_action_set("bevy_clay", "Sculpting", 0)?;
        let sides = [instance.string_to_path(Side::Left.path())?, instance.string_to_path(Side::Right.path())?];
        fn action<T: openxr::ActionTy>(set: &ActionSet, sides: &[Path], input: Input) -> openxr::Result<Action<T>> {
            let (name, shown) = input.names();
            set.create_action(name, shown, sides)
        }
        let pose = |input| action(&set, &sides, input);
        Ok(Self {
            poses: [pose(POSES[0])?, pose(POSES[1])?, pose(POSES[2])?],
            trigger: action(&set, &sides, Input::Trigger)?,
            squeeze: action(&set, &sides, Input::Squeeze)?,
            stick: action(&set, &sides, Input::Stick)?,
            stick_click: action(&set, &sides, Input::StickClick)?,
            menu: action(&set, &sides, Input::Menu)?,
            shake: action(&set, &sides, Input::Shake)?,
            is_suggested: false,
            set,
            sides,
        })
    }

    /// The path of a side.
    pub(super) fn side(&self, side: Side) -> Path {
        self.sides[side.index()]
    }

    /// The handle of an input's action.
    fn raw(&self, input: Input) -> openxr::sys::Action {
        match input {
            Input::Grip => self.poses[0].as_raw(),
            Input::Aim => self.poses[1].as_raw(),
            Input::Tool => self.poses[2].as_raw(),
            Input::Trigger => self.trigger.as_raw(),
            Input::Squeeze => self.squeeze.as_raw(),
            Input::Stick => self.stick.as_raw(),
            Input::StickClick => self.stick_click.as_raw(),
            Input::Menu => self.menu.as_raw(),
            Input::Shake => self.shake.as_raw(),
        }
    }
}

/// Spaces of the poses of both sides, as long as the session lasts.
#[derive(Resource)]
pub(super) struct Spaces([[XrSpace; 3]; 2]);

/// Makes the actions.
pub(super) fn create(instance: Res<OxrInstance>, mut commands: Commands) {
    match Actions::new(&instance) {
        Ok(actions) => commands.insert_resource(actions),
        Err(error) => error!("the hands are not heard: {error}"),
    }
}

/// Suggests a list of bindings for each profile that the runtime knows.
pub(super) fn suggest(
    actions: Option<ResMut<Actions>>,
    extensions: Res<OxrEnabledExtensions>,
    mut suggested: MessageWriter<OxrSuggestActionBinding>,
) {
    let Some(mut actions) = actions.filter(|actions| !actions.is_suggested) else { return };
    actions.is_suggested = true;
    for profile in PROFILES.iter().filter(|profile| (profile.is_known)(extensions.raw())) {
        let mut paths: HashMap<Input, Vec<_>> = HashMap::default();
        profile.suggestions().for_each(|(input, path)| paths.entry(input).or_default().push(path.into()));
        suggested.write_batch(paths.into_iter().map(|(input, bindings)| OxrSuggestActionBinding {
            action: actions.raw(input),
            interaction_profile: profile.path.into(),
            bindings,
        }));
    }
}

/// Attaches the actions to a new session, with those of the app's own that ask for it by the same message,
/// and makes the spaces of their poses.
pub(super) fn attach(
    actions: Option<Res<Actions>>,
    session: Option<Res<OxrSession>>,
    mut attached: MessageWriter<OxrAttachActionSet>,
    mut commands: Commands,
) {
    let (Some(actions), Some(session)) = (actions, session) else { return };
    attached.write(OxrAttachActionSet(actions.set.clone()));
    let space =
        |side: usize, pose: usize| session.create_action_space(&actions.poses[pose], actions.sides[side], Isometry3d::IDENTITY);
    let of = |side| Ok([space(side, 0)?, space(side, 1)?, space(side, 2)?]);
    match of(0).and_then(|left| Ok(Spaces([left, of(1)?]))) {
        Ok(spaces) => commands.insert_resource(spaces),
        Err(error) => {
            let error: openxr::sys::Result = error;
            error!("the hands are not seen: {error}");
        }
    }
}

/// The spaces go with their session.
pub(super) fn detach(mut controllers: ResMut<XrControllers>, mut commands: Commands) {
    commands.remove_resource::<Spaces>();
    *controllers = XrControllers::default();
}

/// Asks for the state of the actions in this frame.
pub(super) fn sync(actions: Option<Res<Actions>>, mut synced: MessageWriter<OxrSyncActionSet>) {
    synced.write_batch(actions.map(|actions| OxrSyncActionSet(actions.set.clone())));
}

/// What controllers are read by; there is all of it while a session lasts.
type Heard<'w> = (Option<Res<'w, Actions>>, Option<Res<'w, Spaces>>, Option<Res<'w, OxrSession>>);

/// Reads the controllers, as late in the frame as the clay can use them: poses are those that the runtime
/// expects when the frame is shown, as it knows them now.
pub(super) fn read(
    (actions, spaces, session): Heard,
    (base, frame): (Option<Res<XrPrimaryReferenceSpace>>, Option<Res<OxrFrameState>>),
    root: Query<&GlobalTransform, With<XrTrackingRoot>>,
    mut controllers: ResMut<XrControllers>,
) {
    let (Some(actions), Some(spaces), Some(session)) = (actions, spaces, session) else { return };
    let (Some(base), Some(frame)) = (base, frame) else { return };
    let root = root.iter().next().map_or(Isometry3d::IDENTITY, GlobalTransform::to_isometry);
    let time = frame.predicted_display_time;
    controllers.time = time.as_nanos() as f64 * 1e-9;
    for side in Side::ALL {
        let path = actions.side(side);
        let pose = |index: usize| {
            let is_active = actions.poses[index].is_active(&session, path).unwrap_or(false);
            let located = is_active.then(|| session.locate_space(&spaces.0[side.index()][index], &base, time).ok()).flatten()?;
            let needed = SpaceLocationFlags::POSITION_VALID | SpaceLocationFlags::ORIENTATION_VALID;
            located.location_flags.contains(needed).then(|| root * located.pose.to_xr_pose())
        };
        let number = |action: &Action<f32>| action.state(&session, path).map_or(0.0, |s| s.current_state);
        let pressed = |action: &Action<bool>| action.state(&session, path).is_ok_and(|s| s.current_state);
        let stick = actions.stick.state(&session, path).map_or(Vec2::ZERO, |s| Vec2::new(s.current_state.x, s.current_state.y));
        *controllers.get_mut(side) = Controller {
            grip: pose(0),
            aim: pose(1),
            tool: pose(2),
            trigger: number(&actions.trigger),
            squeeze: number(&actions.squeeze),
            stick,
            stick_click: pressed(&actions.stick_click),
            menu: pressed(&actions.menu),
        };
    }
}
