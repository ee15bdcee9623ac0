//! How the arm's hand was served: rate, jitter, age of what is known of the clay. Said when the run ends;
//! what a machine makes of it is no fault of the app's.

use super::{CheckArgs, say};
use crate::arm;
use bevy::prelude::*;
use bevy_clay::haptics::guarded::TickTiming;
use bevy_clay::haptics::safety::Stage;
use bevy_clay::prelude::*;

/// Watches the arm, and ends a script when the hand has gone its way.
pub(super) struct ArmCheckPlugin;

impl Plugin for ArmCheckPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Served>()
            .add_systems(Update, watch.after(ClaySystems::Show))
            .add_systems(Last, conclude.run_if(on_message::<AppExit>));
    }
}

/// How the hand was served so far.
#[derive(Resource, Default)]
pub(super) struct Served {
    /// Of the first sample seen \[s\].
    began: Option<f64>,
    spells: u32,
    last: TickTiming,
    /// Of all spells: sums of rate \[Hz\] and jitter \[s\], least and greatest, the longest time between ticks
    /// \[s\].
    rate: (f64, f64),
    jitter: (f64, f64),
    interval_max: f64,
    force_max: f64,
    /// Whether the hand has gone its way.
    pub(super) is_over: bool,
}

fn watch(session: Res<HapticSession>, args: Res<CheckArgs>, mut served: ResMut<Served>) {
    let (Some(pulse), Some(last)) = (session.pulse(), session.samples().last()) else { return };
    let began = *served.began.get_or_insert(last.time);
    served.is_over = args.script && last.time - began >= arm::duration();
    served.force_max = session.samples().map(|s| s.hand_force.length()).fold(served.force_max, f64::max);
    let timing = pulse.timing;
    if timing.spell != served.last.spell {
        served.spells += 1;
        let least = if served.spells == 1 { timing.rate } else { served.rate.1.min(timing.rate) };
        served.rate = (served.rate.0 + timing.rate, least);
        served.jitter = (served.jitter.0 + timing.jitter, served.jitter.1.max(timing.jitter));
        served.interval_max = served.interval_max.max(timing.interval_max);
        served.last = timing;
    }
}

fn conclude(session: Res<HapticSession>, served: Res<Served>) {
    let Some(pulse) = session.pulse() else { return say("the arm never ticked") };
    let (spells, latency) = (f64::from(served.spells.max(1)), session.latency());
    let ms = |time: f64| time * 1e3;
    say(&format!(
        "{}: {:.0} Hz (least {:.0}), jitter {:.0} us (most {:.0}), ticks {:.1} ms apart at most, {:.1} us each, {} samples lost",
        session.device().map_or("no arm", |info| &info.name),
        served.rate.0 / spells,
        served.rate.1,
        served.jitter.0 / spells * 1e6,
        served.jitter.1 * 1e6,
        ms(served.interval_max),
        latency.pose_to_force.mean * 1e6,
        pulse.lost
    ));
    let (age, interval, model, picture) =
        (latency.model_age, latency.model_interval, latency.pose_to_model, latency.pose_to_picture);
    say(&format!(
        "models of the clay {:.0} a second, {:.0} ms apart at most, {:.0} ms old on average, {:.0} at most; pose to model {:.0} ms, pose to picture {:.0} ms",
        1.0 / interval.mean.max(1e-9),
        ms(interval.greatest),
        ms(age.mean),
        ms(age.greatest),
        ms(model.mean),
        ms(picture.mean)
    ));
    let acted = Stage::ALL.iter().filter(|stage| pulse.safety.ticks(**stage) > 0);
    let acted: Vec<_> = acted
        .map(|stage| format!("{} {} ({} ticks)", stage.name(), pulse.safety.episodes(*stage), pulse.safety.ticks(*stage)))
        .collect();
    say(&format!("at most {:.2} N on the hand; stages of safety that acted: {}", served.force_max, acted.join(", ")));
}
