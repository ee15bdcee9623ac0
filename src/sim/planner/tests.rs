use super::super::material::Preset;
use super::super::params::{Domain, Walls};
use super::super::tool::{Contact, PoseSample, Tool, ToolShape};
use super::afford::FRAME_MIN;
use super::*;
use glam::DVec3;

/// What becomes of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    Run,
    GiveUp,
    Refuse,
}

const BALL: Tool = Tool { shape: ToolShape::Sphere { radius: 0.008 }, contact: Contact::Slip };

fn planner() -> Planner {
    let domain = Domain::new(DVec3::ZERO, DVec3::ONE, 0.01, Walls::default()).expect("a room");
    Planner::new(&Snapshot::new(domain, Preset::SoftClay.material(), vec![]))
}

fn at(x: f64) -> Pose {
    Pose { position: DVec3::X * x, ..Pose::default() }
}

fn ball(x: f64) -> ToolSamples {
    ToolSamples::now(7, BALL, at(x))
}

fn run(planner: &mut Planner) -> Option<FramePlan> {
    match planner.next(&Preset::SoftClay.material()) {
        Decision::Run(plan) => Some(plan),
        Decision::Idle => None,
    }
}

/// The report of a frame that ran in `wall` \[s\].
fn report(plan: &FramePlan, wall: f64) -> FrameReport {
    let mut report = FrameReport { steps: plan.steps, ..FrameReport::new(plan) };
    report.timings.total = wall;
    report
}

/// The pieces of a tool's way in a plan: start, end, speed.
fn pieces(plan: &FramePlan) -> Vec<(f64, f64, f64)> {
    let samples = plan.tools.first().map_or(&[][..], |path| &path.samples);
    let piece = |w: &[PoseSample]| {
        let [a, b] = [w[0].pose.position.x, w[1].pose.position.x];
        (a, b, (b - a) / (w[1].time - w[0].time))
    };
    samples.windows(2).map(piece).collect()
}

/// Runs a tool along x, a step per frame of the app, through frames with these fates; a report comes every
/// `lag` frames. Returns what was swept.
fn sweep(fates: &[Fate], lag: u32) -> Vec<(f64, f64, f64)> {
    let mut planner = planner();
    let mut fates = fates.iter().copied();
    let (mut under_way, mut is_failing, mut swept) = (std::collections::VecDeque::new(), false, vec![]);
    for frame in 0..200u32 {
        planner.pass(0.01, &[ball(1e-3 * f64::from(frame.min(40)))]);
        if let Some(plan) = run(&mut planner) {
            let fate = fates.next().unwrap_or(Fate::Run);
            if fate == Fate::Refuse {
                planner.refused();
            } else {
                is_failing |= fate == Fate::GiveUp;
                under_way.push_back((plan, is_failing));
                planner.sent();
            }
        }
        if frame % lag == 0
            && let Some((plan, is_given_up)) = under_way.pop_front()
        {
            let mut report = report(&plan, 1e-3);
            if is_given_up {
                report.health = Health::GIVEN_UP;
                is_failing &= !under_way.is_empty();
            } else {
                swept.extend(pieces(&plan));
            }
            planner.note(&mut report);
        }
    }
    swept
}

/// Whatever frames fail, the clay sees the tool's whole way, each piece once and in order.
#[test]
fn tool_never_jumps_over_a_frame() {
    let fates = [Fate::Run, Fate::GiveUp, Fate::Refuse];
    for script in 0..3usize.pow(6) {
        let script: Vec<Fate> = (0..6).map(|i| fates[script / 3usize.pow(i) % 3]).collect();
        for lag in [1, 2, 5] {
            let swept = sweep(&script, lag);
            assert_eq!(swept[0].0, 0.0, "{script:?}, {lag}");
            assert!(swept.windows(2).all(|w| w[0].1 == w[1].0), "{script:?}, {lag}: {swept:?}");
            assert!(swept.iter().all(|(a, b, _)| a <= b), "{script:?}, {lag}: {swept:?}");
            assert_eq!(swept[swept.len() - 1].1, 0.04, "{script:?}, {lag}");
        }
    }
}

/// A slow engine gets frames as short as it needs to answer soon, a fast one frames of a thirtieth of a
/// second; the rest of the clock is given up.
#[test]
fn frames_are_as_long_as_the_engine_affords() {
    for (wall, longest) in [(0.5, 1e-2 / 10.0), (1e-3, FRAME_MAX), (1e3, FRAME_MIN)] {
        let mut planner = planner();
        planner.policy.wall = Some(0.05);
        planner.pass(1e-3, &[]);
        let plan = run(&mut planner).expect("a frame");
        planner.sent();
        planner.note(&mut FrameReport { dt: 1e-3, steps: 10, ..report(&plan, wall) });
        planner.pass(1.0, &[]);
        let plan = run(&mut planner).expect("a frame");
        assert!((plan.duration() - longest).abs() < 1e-12, "{wall}: {}", plan.duration());
        assert!((plan.duration() + planner.given_up() - 1.0).abs() < 1e-12);
    }
}

/// What a hand does in slow motion, a tenth of its own time: goes 2 cm at 0.1 m/s on a way that turns back,
/// stands for a second, and lets go if told to.
fn slow_motion(backlog: Backlog, lets_go: bool) -> (Vec<(f64, f64, f64)>, Planner, usize) {
    let mut planner = planner();
    planner.policy = Policy { wall: Some(1.0 / 60.0), backlog, ..Policy::default() };
    let (mut swept, mut frames) = (vec![], 0);
    for frame in 0..4000u32 {
        let time = 0.01 * f64::from(frame);
        let x = if time < 0.15 { 0.1 * time } else { (0.03 - 0.1 * time).max(0.01) };
        let held = [ball(x)];
        planner.pass(0.01, if lets_go && time > 1.0 { &[] } else { &held });
        if let Some(plan) = run(&mut planner) {
            planner.sent();
            frames += usize::from(!plan.tools.is_empty());
            swept.extend(pieces(&plan));
            // A hundredth of a second of clay takes a tenth of wall time.
            let wall = 10.0 * plan.duration();
            planner.note(&mut report(&plan, wall));
        }
    }
    (swept, planner, frames)
}

/// In slow motion a tool is as fast as the hand was, and late; in the end it has gone the whole way, and time
/// in which it stood was not waited for.
#[test]
fn slow_tools_keep_the_hand_speed() {
    let (swept, planner, _) = slow_motion(Backlog::WorkOff, false);
    assert!(swept.windows(2).all(|w| (w[0].1 - w[1].0).abs() < 1e-15), "{swept:?}");
    for (a, b, speed) in swept.iter().filter(|(a, b, _)| (a - b).abs() > 1e-9) {
        // A clock's slack may be swept with a frame.
        assert!((0.099..0.126).contains(&speed.abs()), "{a} to {b} at {speed}");
    }
    let furthest = swept.iter().map(|p| p.1).fold(0.0, f64::max);
    assert!((furthest - 0.015).abs() < 1e-9 && (swept[swept.len() - 1].1 - 0.01).abs() < 1e-12, "{furthest}");
    assert!(planner.lag() < 0.02, "{}", planner.lag());
    assert_eq!(planner.tool_pose(7).map(|p| (p.position.x - 0.01).abs() < 1e-12), Some(true));
}

/// A backlog that is dropped leaves corners out, not the speed, and never jumps.
#[test]
fn dropped_backlog_cuts_corners() {
    let (swept, planner, _) = slow_motion(Backlog::Drop, false);
    assert!(swept.windows(2).all(|w| (w[0].1 - w[1].0).abs() < 1e-15), "{swept:?}");
    assert!(swept.iter().all(|p| p.2.abs() < 0.126), "{swept:?}");
    let way: f64 = swept.iter().map(|p| (p.1 - p.0).abs()).sum();
    let last = swept[swept.len() - 1].1;
    assert!(way < 0.0199 && (last - 0.01).abs() < 1e-12, "{way}, to {last}");
    assert!(planner.lag() <= LAG_MAX + 0.02, "{}", planner.lag());
}

/// A hitch leaves tools late; an engine that affords it runs longer frames until they are not, and the clay
/// never gets ahead of the clock.
#[test]
fn backlog_of_a_hitch_is_worked_off() {
    for backlog in [Backlog::WorkOff, Backlog::Drop] {
        let mut planner = planner();
        planner.policy = Policy { backlog, ..Policy::default() };
        let (mut clock, mut clay, mut lags) = (0.0, 0.0, vec![]);
        for frame in 0..60u32 {
            let time = if frame == 10 { 0.25 } else { 0.01 };
            clock += time;
            // Always on the move.
            planner.pass(time, &[ball(0.1 * clock)]);
            let plan = run(&mut planner).expect("a frame");
            planner.sent();
            clay += plan.duration();
            assert!(plan.duration() <= FRAME_MAX + 1e-12, "{backlog:?}, frame {frame}");
            assert!((clay + planner.given_up() - clock).abs() < 1e-9, "{backlog:?}, frame {frame}");
            assert!(pieces(&plan).iter().all(|p| p.2 < 0.126), "{backlog:?}, frame {frame}: {:?}", pieces(&plan));
            planner.note(&mut report(&plan, 1e-3));
            lags.push(planner.lag());
        }
        assert!(lags[10] > 0.2 - 2.0 * FRAME_MAX && lags[59] < 1e-9, "{backlog:?}: {lags:?}");
    }
}

/// Put down again before a frame has swept the way before, a tool is in no plan twice: whoever planned, and
/// however long nothing could be planned.
#[test]
fn quick_second_visit_waits_for_the_first() {
    for (busy, gap) in [(0, 1), (3, 1), (5, 1), (6, 2)] {
        let mut planner = planner();
        let mut swept = vec![];
        for frame in 0..30u32 {
            // Held from 2 on, let go of at 4, and held again elsewhere.
            let again = 4 + gap;
            let held = match frame {
                2..4 => vec![ball(0.001 * f64::from(frame))],
                _ if frame >= again => vec![ball(0.5 + 0.001 * f64::from(frame))],
                _ => vec![],
            };
            planner.pass(0.01, &held);
            if (2..2 + busy).contains(&frame) {
                continue;
            }
            let plan = run(&mut planner).expect("a frame");
            assert!(plan.validate().is_ok(), "busy {busy}, gap {gap}, frame {frame}: {:?}", plan.tools);
            planner.sent();
            swept.extend(
                plan.tools.iter().map(|t| (t.samples[0].pose.position.x, t.samples[t.samples.len() - 1].pose.position.x)),
            );
            planner.note(&mut report(&plan, 1e-3));
        }
        assert!(swept.iter().all(|(a, b)| (a - b).abs() < 0.05), "busy {busy}, gap {gap}: a jump: {swept:?}");
        assert!(swept.iter().any(|p| p.0 < 0.1), "busy {busy}, gap {gap}: {swept:?}");
        // The second visit is swept from where it began.
        let began = swept.iter().find(|p| p.0 > 0.4).expect("a second visit").0;
        assert!((began - 0.504 - 0.001 * f64::from(gap)).abs() < 1e-9, "busy {busy}, gap {gap}: {swept:?}");
        assert!((swept[swept.len() - 1].1 - 0.529).abs() < 1e-9, "busy {busy}, gap {gap}: {swept:?}");
    }
}

/// Tools are told apart by their keys alone: any number of them at once, each called by one name in plans and
/// reports for as long as it is held, and by none when the clay has seen the last of it.
#[test]
fn tools_are_told_apart_by_their_keys() {
    let mut planner = planner();
    let hand = |key: u64| ToolSamples { key, ..ball(0.1 * key as f64) };
    let mut names = vec![];
    for frame in 0..8u64 {
        // Two hands; the second changes its tool at frame 4.
        planner.pass(0.01, &[hand(3), if frame < 4 { hand(5) } else { hand(9) }]);
        let plan = run(&mut planner).expect("a frame");
        assert_eq!(plan.validate(), Ok(()));
        planner.sent();
        let ids: Vec<u32> = plan.tools.iter().map(|t| t.id).collect();
        names.push(ids.clone());
        planner.note(&mut report(&plan, 1e-3));
        assert_eq!(
            ids.iter().map(|id| planner.tool_key(*id)).collect::<Vec<_>>(),
            [Some(3), Some(if frame < 4 { 5 } else { 9 })]
        );
    }
    assert!(names[..4].iter().all(|n| *n == names[0]) && names[4..].iter().all(|n| *n == names[4]), "{names:?}");
    assert!(names[0][0] == names[4][0] && names[0][1] != names[4][1], "{names:?}");
    assert_eq!(planner.tool_key(names[0][1]), None);
}

/// What made a plan refused is gone with the tool: the frame after runs.
#[test]
fn refused_tools_are_let_go_of() {
    let bad = Tool { shape: ToolShape::Sphere { radius: -1.0 }, ..BALL };
    let not_a_number = PoseSample { time: 0.0, pose: at(f64::NAN) };
    let tools = [vec![ToolSamples { tool: bad, ..ball(0.0) }], vec![ToolSamples { samples: vec![not_a_number], ..ball(0.0) }]];
    for (case, tools) in tools.iter().enumerate() {
        let mut planner = planner();
        let mut verdicts = vec![];
        for frame in 0..8u32 {
            // The bad ones go, one that is sound stays.
            let held = if frame < 3 { tools.clone() } else { vec![ball(0.2)] };
            planner.pass(0.01, &held);
            let Some(plan) = run(&mut planner) else { continue };
            let is_sound = plan.validate().is_ok();
            verdicts.push(is_sound);
            if is_sound {
                planner.sent();
                planner.note(&mut report(&plan, 1e-3));
            } else {
                planner.refused();
            }
        }
        assert!(verdicts[..3].iter().all(|is_sound| !is_sound), "case {case}: {verdicts:?}");
        assert!(verdicts[4..].iter().all(|is_sound| *is_sound), "case {case}: {verdicts:?}");
        assert!((planner.given_up() - 0.01 * verdicts.iter().filter(|v| !**v).count() as f64).abs() < 1e-9, "case {case}");
    }
}

/// A frame that fails whenever it is run is left when its tool is lifted.
#[test]
fn lifting_a_tool_ends_what_fails() {
    let (mut planner, mut clay, mut clock) = (planner(), 0.0, 0.0);
    for frame in 0..20u32 {
        let held = [ball(1e-3 * f64::from(frame))];
        planner.pass(0.01, if frame < 8 { &held } else { &[] });
        clock += 0.01;
        let plan = run(&mut planner).expect("a frame");
        planner.sent();
        let has_run = plan.tools.is_empty();
        assert!(has_run || frame < 10, "frame {frame}");
        assert!(has_run || plan.duration() < 0.0101, "frame {frame}: what failed is tried again longer");
        clay += if has_run { plan.duration() } else { 0.0 };
        let health = if has_run { Health::OK } else { Health::GIVEN_UP };
        planner.note(&mut FrameReport { health, ..report(&plan, 1e-3) });
        assert!((clay + planner.given_up() - clock).abs() < 1e-9, "frame {frame}");
    }
}

/// A tool that was let go of goes to the end of its way if its backlog is worked off, and leaves at once if
/// not.
#[test]
fn let_go_tools_finish_their_way() {
    let ends = |backlog| slow_motion(backlog, true).0.last().map(|p| p.1);
    assert!(ends(Backlog::WorkOff).is_some_and(|x| (x - 0.01).abs() < 1e-12));
    let (_, planner, frames) = slow_motion(Backlog::WorkOff, true);
    assert!(planner.tool_pose(7).is_none() && frames < 1000);
}

/// A tool that is put down again elsewhere does not sweep from where it was, however late it is; each visit
/// is told apart.
#[test]
fn second_visit_is_put_down_anew() {
    let mut planner = planner();
    planner.policy.wall = Some(1.0 / 60.0);
    let (mut swept, blade) =
        (vec![], Tool { shape: ToolShape::Blade { half_width: 0.1, half_height: 0.1 }, contact: Contact::Slip });
    let mut sheets = vec![];
    for frame in 0..3000u32 {
        let x = match frame {
            0..10 => Some(1e-3 * f64::from(frame)),
            12..20 => Some(0.5 + 1e-3 * f64::from(frame)),
            20.. => Some(0.52),
            _ => None,
        };
        let held: Vec<ToolSamples> = x.map(|x| ToolSamples::now(7, blade, at(x))).into_iter().collect();
        planner.pass(0.01, &held);
        if let Some(plan) = run(&mut planner) {
            planner.sent();
            swept.extend(pieces(&plan));
            sheets.extend(plan.tools.iter().map(|t| t.sheet));
            planner.note(&mut report(&plan, 10.0 * plan.duration()));
        }
    }
    let jumps: Vec<_> = swept.windows(2).filter(|w| (w[0].1 - w[1].0).abs() > 1e-12).collect();
    assert_eq!(jumps.len(), 1, "{jumps:?}");
    assert!((jumps[0][0].1 - 0.009).abs() < 1e-12 && (jumps[0][1].0 - 0.512).abs() < 1e-12, "{jumps:?}");
    assert!(swept.iter().all(|p| p.2.abs() < 0.126), "a jump was swept");
    sheets.dedup();
    assert_eq!(sheets.len(), 2, "{sheets:?}");
}

/// Every sample of a clock of 1 kHz reaches the plan: a hand that shakes at 200 Hz is not smoothed away.
#[test]
fn fast_clock_is_not_decimated() {
    let mut planner = planner();
    // The hand's clock has another zero and runs a little fast.
    let sample = |i: u32| PoseSample { time: 5000.0 + 1.0005e-3 * f64::from(i), pose: at(1e-3 * f64::from(i % 5)) };
    for frame in 0..10u32 {
        let samples = (33 * frame..33 * (frame + 1)).map(sample).collect();
        planner.pass(0.033, &[ToolSamples { key: 7, tool: BALL, samples }]);
        let plan = run(&mut planner).expect("a frame");
        planner.sent();
        let count = plan.tools[0].samples.len();
        assert!((33..=35).contains(&count), "frame {frame}: {count} samples");
        assert!(plan.validate().is_ok());
        planner.note(&mut report(&plan, 1e-3));
    }
}

/// Where the caller's clock goes slowly, the samples of a hand in real time are fitted into it.
#[test]
fn slow_clock_loses_no_pose() {
    let mut planner = planner();
    let sample = |i: u32| PoseSample { time: 1e-3 * f64::from(i), pose: at(1e-3 * f64::from(i % 5)) };
    for frame in 0..10u32 {
        let samples = (16 * frame..16 * (frame + 1)).map(sample).collect();
        planner.pass(1e-3, &[ToolSamples { key: 7, tool: BALL, samples }]);
        let plan = run(&mut planner).expect("a frame");
        planner.sent();
        let count = plan.tools[0].samples.len();
        assert!(frame == 0 || (16..=18).contains(&count), "frame {frame}: {count} samples");
        assert!(plan.validate().is_ok());
        planner.note(&mut report(&plan, 1e-5));
    }
}

/// The plan of frame n is made from the report of frame n - 2, whatever else is known by then.
#[test]
fn plans_know_the_report_before_the_last() {
    let mut planner = planner();
    (planner.policy.gravity, planner.policy.integrator) = (DVec3::ZERO, IntegratorChoice::Explicit);
    let mut steps = vec![];
    for frame in 0..6 {
        planner.pass(0.02, &[]);
        let plan = run(&mut planner).expect("a frame");
        planner.sent();
        steps.push(plan.steps);
        // After frame 1 the clay is fast, once.
        let speed_max = if frame == 1 { 0.4 } else { 0.0 };
        planner.note(&mut FrameReport { speed_max, dt: 1e-5, ..report(&plan, 1e-3) });
    }
    assert!(steps[3] > 2 * steps[0], "{steps:?}");
    assert_eq!([steps[1], steps[2], steps[4], steps[5]], [steps[0]; 4]);
}

/// Where inertia may be scaled frames tell whether there is loose clay. What a change of scale gives to the
/// momentum is in the report of the first frame that has it.
#[test]
fn changes_of_scale_are_accounted_for() {
    let mut planner = planner();
    planner.policy.integrator = IntegratorChoice::Explicit;
    for (inertia, asks) in [(InertiaScaling::Off, false), (InertiaScaling::Accurate, true)] {
        planner.policy.inertia = inertia;
        planner.pass(0.01, &[]);
        assert_eq!(run(&mut planner).map(|plan| plan.outputs.support), Some(asks));
        planner.refused();
    }
    let noted = [(1.0, 1), (4.0, 0), (4.0, 1), (4.0, 1), (2.0, 1)].map(|(scale, steps)| {
        let momentum_before = DVec3::X * scale;
        let mut report = FrameReport { steps, density_scale: scale, momentum_before, ..FrameReport::default() };
        planner.note(&mut report);
        report.rescaled_momentum.x
    });
    assert_eq!(noted, [0.0, 0.0, 3.0, 0.0, -2.0]);
}
