use super::*;
use crate::scene::pieces::Pieces;
use crate::scene::resample::resample;
use crate::sim::prelude::*;
use glam::{DQuat, DVec3};
use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// What a history is to make of a state, written down plainly.
fn canonical(state: &Snapshot) -> Snapshot {
    let mut state = Snapshot { forecasts: None, ..state.clone() };
    state.particles.sort_by_key(|p| p.id);
    state.particles.iter_mut().for_each(|p| (p.velocity, p.affine, p.anchors) = Default::default());
    state
}

/// Everything in a state, bit by bit: -0 is not 0, and a NaN is itself.
fn bits(state: &Snapshot) -> Vec<u8> {
    state.to_bytes()
}

/// A word of a particle: any, or one that comparisons and sums of floats treat apart.
fn word() -> impl Strategy<Value = u32> {
    prop_oneof![any::<u32>(), Just(0), Just((-0.0f32).to_bits()), Just(f32::NAN.to_bits()), Just(0xffc0_1234)]
}

/// A particle of any numbers.
fn particle() -> impl Strategy<Value = Particle> {
    let words = prop::collection::vec(word(), size_of::<Particle>() / 4);
    (words, 0u32..12).prop_map(|(words, id)| Particle { id, ..bytemuck::pod_read_unaligned(bytemuck::cast_slice(&words)) })
}

/// Clay of a few particles in any order; ids now and then twice.
fn state() -> impl Strategy<Value = Snapshot> {
    let same_ids = prop::collection::vec(particle(), 4).prop_map(|mut all| {
        (0..).zip(&mut all).for_each(|(id, p)| p.id = id);
        all
    });
    let some = prop_oneof![prop::collection::vec(particle(), 0..12), same_ids.prop_shuffle()];
    let head = (1u32..4, prop::sample::select(&Preset::ALL), -1e3..1e3f64, any::<bool>());
    (some, head).prop_map(|(particles, (grid, preset, time, has_forecasts))| {
        let walls = Walls { high: [Wall::Slip, Wall::Stick, Wall::Separate], ..Walls::default() };
        let domain = Domain::new(DVec3::splat(-0.1), DVec3::splat(0.3), 0.01 * f64::from(grid), walls).expect("domain");
        let forecasts = has_forecasts.then(|| [Forecast { reach: time, ..Forecast::default() }; 2]);
        Snapshot { time, forecasts, ..Snapshot::new(domain, preset.material(), particles) }
    })
}

/// What is done to a history.
#[derive(Clone, Debug)]
enum Act {
    Record(Snapshot),
    /// A state whose particles are those of the one before, each a little other.
    Stroke(u32),
    Undo,
    Amend(Snapshot),
    Redo,
    SetBudget(usize),
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        2 => state().prop_map(Act::Record),
        4 => any::<u32>().prop_map(Act::Stroke),
        4 => Just(Act::Undo),
        1 => state().prop_map(Act::Amend),
        4 => Just(Act::Redo),
        1 => (1000usize..20_000).prop_map(Act::SetBudget),
    ]
}

/// A list of states and a cursor.
#[derive(Default)]
struct Model {
    states: Vec<Snapshot>,
    cursor: usize,
    evicted: u64,
}

impl Model {
    fn record(&mut self, state: &Snapshot) {
        self.states.truncate(self.cursor + 1);
        self.states.push(canonical(state));
        self.cursor = self.states.len() - 1;
    }

    fn amend(&mut self, now: &Snapshot) {
        self.states.get_mut(self.cursor).into_iter().for_each(|state| *state = canonical(now));
    }

    fn undo(&mut self) -> Option<Snapshot> {
        let back = self.cursor.checked_sub(1)?;
        self.cursor = back;
        Some(self.states[back].clone())
    }

    fn redo(&mut self) -> Option<Snapshot> {
        let state = self.states.get(self.cursor + 1)?.clone();
        self.cursor += 1;
        Some(state)
    }

    /// The present state with other low digits, its particles in another order.
    fn stroke(&self, seed: u32) -> Option<Snapshot> {
        let mut state = self.states.get(self.cursor)?.clone();
        for (i, p) in (0..).zip(&mut state.particles) {
            let digits = seed.rotate_left(7 * i) & 0xfff;
            p.offset = p.offset.map(|x| f32::from_bits(x.to_bits() ^ digits));
            p.hardening = f32::from_bits(p.hardening.to_bits().wrapping_add(digits));
            p.velocity = [1.0; 3];
        }
        // Particles of one id keep their order.
        state.particles.sort_by_key(|p| p.id.wrapping_mul(seed | 1));
        state.time += 1.0;
        Some(state)
    }

    /// Lets go what the history let go: from the ends, no more than it had to.
    fn evict(&mut self, history: &History) {
        let newer = self.states.len().saturating_sub(self.cursor + 1) - history.redo_count();
        let older = self.cursor - history.undo_count();
        assert!(newer == 0 || history.undo_count() == 0, "the oldest go first");
        self.states.truncate(self.states.len() - newer);
        self.states.drain(..older);
        self.cursor -= older;
        self.evicted += (newer + older) as u64;
        assert_eq!(self.evicted, history.evicted());
        assert!(history.bytes() <= history.budget() || history.undo_count() + history.redo_count() == 0);
    }
}

/// Does `act` to both; what came back of it.
fn step(model: &mut Model, history: &mut History, act: Act) -> (Option<Snapshot>, Option<Snapshot>) {
    let sound = |state: Result<Option<Snapshot>, HistoryError>| state.expect("sound memory");
    match act {
        Act::Record(state) => {
            model.record(&state);
            history.record(state);
        }
        Act::Stroke(seed) => {
            if let Some(state) = model.stroke(seed) {
                return step(model, history, Act::Record(state));
            }
        }
        Act::Undo => return (model.undo(), sound(history.undo())),
        Act::Amend(now) => {
            model.amend(&now);
            history.amend(now);
        }
        Act::Redo => return (model.redo(), sound(history.redo())),
        Act::SetBudget(budget) => history.set_budget(budget),
    }
    (None, None)
}

proptest! {
    /// Wherever one goes among the states of any walk, each has the bits that it was recorded with.
    #[test]
    fn walks_lead_to_the_states_of_a_plain_list(acts in prop::collection::vec(act(), 1..40)) {
        let (mut model, mut history) = (Model::default(), History::new(History::BUDGET_DEFAULT));
        for act in acts {
            let (expected, state) = step(&mut model, &mut history, act.clone());
            prop_assert_eq!(state.as_ref().map(bits), expected.as_ref().map(bits), "{:?}", act);
            model.evict(&history);
        }
        // All of them, there and back again, where none is evicted on the way.
        history.set_budget(History::BUDGET_DEFAULT);
        for state in model.states[..model.cursor].iter().rev() {
            prop_assert_eq!(history.undo().expect("sound memory").as_ref().map(bits), Some(bits(state)));
        }
        prop_assert!(history.undo().expect("sound memory").is_none());
        for state in model.states.iter().skip(1) {
            prop_assert_eq!(history.redo().expect("sound memory").as_ref().map(bits), Some(bits(state)));
        }
        prop_assert!(history.redo().expect("sound memory").is_none());
    }
}

/// A block of 12 x 8 x 8 cells of 2 mm on a floor; 8 particles a cell.
fn clay() -> Snapshot {
    const DX: f64 = 0.002;
    let (low, high) = (DVec3::new(-0.02, 0.0, -0.016), DVec3::new(0.02, 0.032, 0.016));
    let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], ..Walls::default() };
    let domain = Domain::new(low, high, DX, walls).expect("domain");
    let at = |i: u32| DVec3::new(f64::from(i % 24) - 11.5, f64::from(i / 24 % 16) + 0.5, f64::from(i / 384) - 7.5) * 0.5 * DX;
    let volume = (0.125 * DX.powi(3)) as f32;
    let particles = (0..24 * 16 * 16).map(|i| Particle::at(domain.to_grid(at(i)), volume, i)).collect();
    Snapshot::new(domain, Preset::SoftClay.material(), particles)
}

/// Runs `tool` along a straight way in a frame of 0.01 s; the clay after it.
fn stroke(clay: &Snapshot, shape: ToolShape, rotation: DQuat, way: [DVec3; 2]) -> Snapshot {
    let mut engine = NativeEngine::new();
    engine.load(clay).expect("sound clay");
    let sample = |time, position| PoseSample { time, pose: Pose { position, rotation } };
    let tool = Tool { shape, contact: Contact::default() };
    let path = ToolPath { id: 1, tool, sheet: 0, samples: vec![sample(0.0, way[0]), sample(0.01, way[1])] };
    let mut planner = Planner::new(clay);
    let Decision::Run(plan) = planner.frame(&clay.material, 0.01, &[path]) else { panic!("nothing is under way") };
    engine.submit(plan).expect("a sound plan");
    assert_eq!(engine.wait().expect("an engine").health, Health::default());
    engine.save().expect("clay")
}

/// Presses a ball into the clay at `x` \[m\] by 2 mm.
fn press(clay: &Snapshot, x: f64) -> Snapshot {
    let ball = ToolShape::Sphere { radius: 0.006 };
    stroke(clay, ball, DQuat::IDENTITY, [DVec3::new(x, 0.022, 0.0), DVec3::new(x, 0.02, 0.0)])
}

/// Strokes of an engine, a cut with its offcut dropped and another grid: all undone, clay that has settled
/// with it, all redone, bit by bit; an engine goes on from each that was undone.
#[test]
fn strokes_of_an_engine_are_undone_and_redone() {
    let mut states = vec![clay()];
    for x in [-0.006, 0.006, -0.002] {
        states.push(press(&states[states.len() - 1], x));
    }
    let blade = ToolShape::Blade { half_width: 0.014, half_height: 0.012 };
    let along_x = DQuat::from_rotation_y(FRAC_PI_2);
    states.push(stroke(&states[3], blade, along_x, [DVec3::Y * 0.03, DVec3::Y * 0.012]));
    states.push(press(&states[4], 0.006));
    let pieces = Pieces::of(&states[5]);
    assert_eq!(pieces.count(), 2, "the blade goes through");
    states.push(pieces.kept(&states[5], |piece| piece == 0));
    states.push(resample(&states[6], 0.0025).expect("another grid"));
    states.push(press(&states[7], -0.003));

    let mut history = History::new(History::BUDGET_DEFAULT);
    states.iter().for_each(|state| history.record(state.clone()));
    let last = states.len() - 1;
    states[last] = press(&states[last], 0.0);
    history.amend(states[last].clone());
    for state in states[..last].iter().rev() {
        let undone = history.undo().expect("sound memory").expect("a state");
        assert!(bits(&undone) == bits(&canonical(state)));
        press(&undone, 0.0);
    }
    for state in &states[1..] {
        let redone = history.redo().expect("sound memory").expect("a state");
        assert!(bits(&redone) == bits(&canonical(state)));
    }
    assert_eq!((history.undo_count(), history.redo_count(), history.evicted()), (last, 0, 0));
}

/// A state takes half of its memory at most.
#[test]
fn states_are_packed() {
    let state = press(&clay(), 0.0);
    let plain = size_of::<Particle>() * state.particles.len();
    let packed = Packed::of(state).size();
    assert!(3 * packed < plain, "{packed} of {plain}");
}

/// States of one particle, at times of `range`.
fn specks(range: std::ops::Range<u32>) -> impl DoubleEndedIterator<Item = Snapshot> {
    let clay = Snapshot { particles: vec![Particle::at(DVec3::splat(7.0), 1e-9, 0)], ..clay() };
    range.map(move |i| Snapshot { time: f64::from(i), ..clay.clone() })
}

fn time(state: Result<Option<Snapshot>, HistoryError>) -> Option<f64> {
    state.expect("sound memory").map(|state| state.time)
}

/// What was undone is forgotten once the clay goes another way, and not before.
#[test]
fn redo_is_forgotten_when_another_state_is_recorded() {
    let mut history = History::new(History::BUDGET_DEFAULT);
    specks(0..4).for_each(|state| history.record(state));
    assert_eq!([time(history.undo()), time(history.undo())], [Some(2.0), Some(1.0)]);
    assert_eq!((history.undo_count(), history.redo_count()), (1, 2));
    specks(9..10).for_each(|state| history.record(state));
    assert_eq!((history.undo_count(), history.redo_count()), (2, 0));
    assert_eq!((time(history.redo()), time(history.undo()), time(history.redo())), (None, Some(1.0), Some(9.0)));
}

/// The oldest states go, then the newest of those that were undone; never the present one.
#[test]
fn states_beyond_the_budget_go_the_oldest_first() {
    let mut history = History::new(History::BUDGET_DEFAULT);
    let sizes: Vec<usize> = specks(0..10).map(|state| (history.record(state), history.bytes()).1).collect();
    let each = sizes[9] - sizes[8];
    // Room for the present state and four more.
    history.set_budget(sizes[0] + 4 * each + each / 2);
    assert_eq!((history.undo_count(), history.evicted()), (4, 5));
    specks(10..12).for_each(|state| history.record(state));
    assert_eq!((history.undo_count(), history.evicted()), (4, 7));
    assert_eq!([time(history.undo()), time(history.undo()), time(history.undo())], [10.0, 9.0, 8.0].map(Some));
    history.set_budget(sizes[0] + 2 * each + each / 2);
    assert_eq!((history.undo_count(), history.redo_count(), history.evicted()), (0, 2, 9));
    assert_eq!([time(history.redo()), time(history.redo()), time(history.redo())], [Some(9.0), Some(10.0), None]);
    // No room for one: the present state stays, and there is nothing to undo.
    history.set_budget(1);
    assert_eq!((history.undo_count(), history.redo_count(), history.evicted()), (0, 0, 11));
    specks(20..22).for_each(|state| history.record(state));
    assert_eq!((history.undo_count(), history.evicted(), history.bytes() > 1), (0, 13, true));
    assert_eq!(time(history.undo()), None);
    history.set_budget(History::BUDGET_DEFAULT);
    specks(22..23).for_each(|state| history.record(state));
    assert_eq!(time(history.undo()), Some(21.0));
}

/// -0 and NaN, with their bits, are numbers like others; velocities are 0.
#[test]
fn odd_numbers_come_back_by_their_bits() {
    let odd = [-0.0, f32::NAN, f32::from_bits(0xffc0_1234), f32::INFINITY, f32::MIN_POSITIVE / 2.0, 1.0];
    let particle = Particle {
        offset: [odd[0], odd[1], odd[2]],
        elastic_strain: odd,
        velocity: [-0.0; 3],
        affine: [[f32::NAN; 3]; 3],
        hardening: -0.0,
        structure: odd[2],
        rest_volume: odd[1],
        id: u32::MAX,
        ..Particle::default()
    };
    let state = Snapshot { particles: vec![particle; 2], ..clay() };
    let mut history = History::new(History::BUDGET_DEFAULT);
    history.record(state.clone());
    history.record(clay());
    let undone = history.undo().expect("sound memory").expect("a state");
    assert_eq!(bits(&undone), bits(&canonical(&state)));
    assert_eq!(undone.particles[1].offset.map(f32::to_bits), odd[..3].iter().map(|x| x.to_bits()).collect::<Vec<_>>()[..]);
    assert_eq!(undone.particles[1].velocity.map(f32::to_bits), [0; 3]);
}

/// Memory that is not as it was written is told, and changes nothing.
#[test]
fn damaged_memory_is_told() {
    let mut history = History::new(History::BUDGET_DEFAULT);
    [clay(), press(&clay(), 0.0), press(&clay(), 0.004)].into_iter().for_each(|state| history.record(state));
    let sound = history.states[1].planes.clone();
    for length in [0, 1, sound.len() / 2, sound.len() - 100] {
        history.states[1].planes.truncate(length);
        let told = history.undo().map(|_| ()).expect_err("it is cut short").to_string();
        assert!(told.starts_with("a state kept for undo cannot be unpacked: ") && told.lines().count() == 1, "{told}");
        assert_eq!((history.undo_count(), history.redo_count()), (2, 0));
        history.states[1].planes.clone_from(&sound);
    }
    let undone = history.undo().expect("sound again").expect("a state");
    assert_eq!(bits(&undone), bits(&canonical(&press(&clay(), 0.0))));
}
