//! Undo: the clay as it stood before each of the last strokes.

use crate::stroke::{StrokeNews, Work};
use bevy::prelude::*;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use bevy_clay::prelude::*;
use std::collections::VecDeque;

/// Most strokes that can be taken back.
const DEPTH: usize = 32;

/// The states to go back to, the newest last.
#[derive(Resource, Default)]
pub(crate) struct History {
    states: VecDeque<Task<Result<Snapshot, String>>>,
    /// Whether the last stroke is to be taken back.
    pub(crate) is_wanted: bool,
}

impl History {
    pub(crate) fn len(&self) -> usize {
        self.states.len()
    }
}

/// Keeps the state before each stroke, and before offcuts go, copied away from the main thread.
pub(crate) fn keep(
    mut news: MessageReader<StrokeNews>,
    mut requests: MessageReader<ClayRequest>,
    engine: Query<&ClayEngine>,
    mut history: ResMut<History>,
) {
    let strokes = news.read().filter(|n| matches!(n, StrokeNews::Began)).count();
    let drops = requests.read().filter(|r| matches!(r, ClayRequest::DropOffcuts(_))).count();
    for _ in 0..strokes + drops {
        let Some(state) = engine.single().ok().and_then(|engine| engine.request_state().ok()) else { continue };
        let make = async move { state.await.map(|make| make()).map_err(|e| e.to_string()) };
        history.states.push_back(AsyncComputeTaskPool::get().spawn(make));
        if history.states.len() > DEPTH {
            history.states.pop_front();
        }
    }
}

/// Takes the last stroke back.
#[expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]
pub(crate) fn take_back(
    clay: Single<(Entity, Has<ClayChange>), With<Clay>>,
    work: Res<Work>,
    mut history: ResMut<History>,
    mut notice: ResMut<ClayNotice>,
    mut commands: Commands,
) {
    if !std::mem::take(&mut history.is_wanted) || work.stroke.is_some() {
        return;
    }
    let (clay, is_changing) = *clay;
    if is_changing {
        notice.warn("another change of the clay is under way");
        return;
    }
    match history.states.pop_back() {
        Some(state) => {
            let done = format!("stroke taken back, {} left to take back", history.states.len());
            commands.entity(clay).insert(ClayChange::of_task(done, state));
        }
        None => notice.warn("there is no stroke to take back"),
    }
}
