//! Actions of an app's own beside the plugin's: a set with a button, attached with the others.

use super::Step;
use super::work::with_hand;
use bevy::prelude::*;
use bevy_clay::prelude::*;
use bevy_mod_openxr::action_binding::{OxrSendActionBindings, OxrSuggestActionBinding};
use bevy_mod_openxr::action_set_attaching::OxrAttachActionSet;
use bevy_mod_openxr::action_set_syncing::{OxrActionSetSyncSet, OxrSyncActionSet};
use bevy_mod_openxr::resources::OxrInstance;
use bevy_mod_openxr::session::OxrSession;
use bevy_mod_xr::session::XrSessionCreated;
use openxr::{Action, ActionSet, Path};

/// What hands of Monado's remote driver are.
const PROFILE: &str = "/interaction_profiles/valve/index_controller";
/// A button that the plugin leaves alone.
const BUTTON: &str = "/user/hand/right/input/a/click";

/// Hears a button of its own.
pub(super) struct OwnActionsPlugin;

impl Plugin for OwnActionsPlugin {
    fn build(&self, app: &mut App) {
        let is_there = resource_exists::<Own>;
        app.add_systems(Startup, create.run_if(resource_exists::<OxrInstance>))
            .add_systems(OxrSendActionBindings, suggest.run_if(is_there))
            .add_systems(XrSessionCreated, attach.run_if(is_there))
            .add_systems(PreUpdate, sync.before(OxrActionSetSyncSet).run_if(is_there));
    }
}

#[derive(Resource)]
struct Own {
    set: ActionSet,
    press: Action<bool>,
    is_suggested: bool,
}

fn create(instance: Res<OxrInstance>, mut commands: Commands) -> Result {
    let set = instance.create_action_set("own", "An app's own", 0)?;
    let press = set.create_action("own_press", "A button", &[])?;
    commands.insert_resource(Own { set, press, is_suggested: false });
    Ok(())
}

/// Once: suggestions outlive a session.
fn suggest(mut own: ResMut<Own>, mut suggested: MessageWriter<OxrSuggestActionBinding>) {
    if !std::mem::replace(&mut own.is_suggested, true) {
        let (action, bindings) = (own.press.as_raw(), vec![BUTTON.into()]);
        suggested.write(OxrSuggestActionBinding { action, interaction_profile: PROFILE.into(), bindings });
    }
}

fn attach(own: Res<Own>, mut attached: MessageWriter<OxrAttachActionSet>) {
    attached.write(OxrAttachActionSet(own.set.clone()));
}

fn sync(own: Res<Own>, mut synced: MessageWriter<OxrSyncActionSet>) {
    synced.write(OxrSyncActionSet(own.set.clone()));
}

/// Whether the button is heard as pressed.
fn is_pressed(world: &World) -> bool {
    let (Some(own), Some(session)) = (world.get_resource::<Own>(), world.get_resource::<OxrSession>()) else { return false };
    own.press.state(session, Path::NULL).is_ok_and(|state| state.current_state)
}

/// The button of the app's own, beside the trigger that is the plugin's.
pub(super) fn steps() -> Vec<Step> {
    let press = |is: bool| {
        move |world: &mut World| {
            with_hand(world, Side::Right, |hand| (hand.a, hand.trigger) = (is, if is { 0.05 } else { 0.0 }));
        }
    };
    let are_heard = |world: &mut World, is: bool| {
        let trigger = world.resource::<XrControllers>().get(Side::Right).trigger;
        is_pressed(world) == is && (trigger > 0.0) == is
    };
    vec![
        Step::new("a button of the app's own", 0.1, press(true)).until(move |world| are_heard(world, true)),
        Step::new("let go", 0.1, press(false)).until(move |world| are_heard(world, false)),
        Step::check("actions of the app's own", |_| Ok("heard beside the plugin's".into())),
    ]
}
