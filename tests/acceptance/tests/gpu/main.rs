//! The GPU engine against the f64 oracle and against the native engine, by its real shaders.
//!
//! `CLAY_GPU=off|auto|require`: without an adapter the tests are listed as ignored, or, where one is
//! required, fail.

mod bodies;
mod handout;
mod passes;
mod robust;
mod scene;
mod stopped;

use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use clay_acceptance::agreement::{self, Agreement, Case, assert_close};
use clay_acceptance::restart;
use libtest_mimic::{Arguments, Failed, Trial};

thread_local! {
    /// The engine whose shaders all tests of a thread share; why there is none. Each thread has a device of
    /// its own: one alone does not keep a processor busy that stands in for it. It stays to the end of the
    /// process: a device does not end with a thread's locals.
    static ENGINE: Result<Shared, String> = match GpuMode::from_env() {
        Ok(GpuMode::Off) => Err("CLAY_GPU=off".into()),
        Ok(GpuMode::Auto | GpuMode::Require) => engine_that_stays(),
        Err(e) => Err(e),
    };
}

/// An engine to have siblings of, and whether a processor stands in for its device.
#[derive(Clone, Copy)]
struct Shared {
    engine: &'static GpuEngine,
    is_software: bool,
}

fn engine_that_stays() -> Result<Shared, String> {
    let device = GpuDevice::headless().map_err(|e| e.to_string())?;
    let is_software = device.is_software();
    let engine = GpuEngine::new(device).map_err(|e| e.to_string())?;
    Ok(Shared { engine: Box::leak(Box::new(engine)), is_software })
}

fn shared() -> Result<Shared, Failed> {
    ENGINE.with(|shared| shared.clone().map_err(Failed::from))
}

fn engine() -> Result<GpuEngine, Failed> {
    Ok(shared()?.engine.sibling())
}

/// The engine against the cases; where a processor stands in for its device, against those that are `chosen`.
fn agrees(cases: fn() -> Vec<Agreement>, chosen: fn(Vec<Agreement>) -> Vec<Agreement>) -> Result<(), Failed> {
    let Shared { engine, is_software } = shared()?;
    let mut engine = engine.sibling();
    let cases = if is_software { chosen(cases()) } else { cases() };
    for case in cases {
        assert_close(&mut engine, &case);
    }
    Ok(())
}

/// Of cases of every shape with every contact those in which each shape has one, all contacts in turn: the
/// law of contact knows no shape. The native engine, which no processor stands in for, is judged by all.
fn one_contact_each(cases: Vec<Agreement>) -> Vec<Agreement> {
    let contacts = Contact::ALL.len();
    let is_of_turn = |i: usize| i % contacts == i / contacts % contacts;
    cases.into_iter().enumerate().filter(|(i, _)| is_of_turn(*i)).map(|(_, case)| case).collect()
}

/// Of the plates one across each edge, in whole clay and in cut clay.
fn one_across_each_edge(mut cases: Vec<Agreement>) -> Vec<Agreement> {
    cases.truncate(3);
    cases
}

/// Two runs give the same bits, through re-bins, a wall, a ball and a blade; and through two cuts and a
/// blade, where up to nine classes of clay enter the same blocks' lists. A frame each: of three, the last is
/// run twice where plans are restarted.
fn runs_are_bit_identical(engine: &mut GpuEngine) -> Result<(), Failed> {
    for case in std::iter::once(agreement::mixed()).chain(agreement::recut().into_iter().map(|a| a.case)) {
        let one = agreement::run(engine, &case, 1);
        assert!(one == agreement::run(engine, &case, 1), "two runs");
    }
    Ok(())
}

fn anchors_end_where_the_touch_does(engine: &mut GpuEngine) -> Result<(), Failed> {
    agreement::assert_anchors_end_where_the_touch_does(engine);
    Ok(())
}

fn sides_end_where_the_plate_does(engine: &mut GpuEngine) -> Result<(), Failed> {
    agreement::assert_sides_end_where_the_plate_does(engine);
    Ok(())
}

fn given_up_frames_leave_no_trace(engine: &mut GpuEngine) -> Result<(), Failed> {
    agreement::assert_given_up_frames_leave_no_trace(engine);
    Ok(())
}

/// Engines of the same shaders.
fn siblings(engine: &GpuEngine) -> impl FnMut() -> Box<dyn Engine> {
    || Box::new(engine.sibling())
}

fn restarted_scene_has_the_same_bits(engine: &mut GpuEngine) -> Result<(), Failed> {
    restart::assert_scene_restarts(siblings(engine));
    Ok(())
}

fn restarted_plans_have_the_same_bits(engine: &mut GpuEngine) -> Result<(), Failed> {
    for case in std::iter::once(agreement::mixed()).chain(agreement::recut().into_iter().map(|a| a.case)) {
        restart::assert_plans_restart(siblings(engine), &case.snapshot, &vec![case.plan; 3], &[2]);
    }
    Ok(())
}

/// A blade that has come, has parted nothing and has gone: the run that went on keeps the passes of clay with
/// cuts, the restarted one begins with those of clay that has none.
fn restart_with_fewer_classes_has_the_same_bits(engine: &mut GpuEngine) -> Result<(), Failed> {
    let Case { snapshot, mut plan } = agreement::mixed();
    plan.steps = 30;
    let (mut with_blade, mut without) = (plan.clone(), plan);
    let [blade, _] = &mut with_blade.tools[..] else { return Err("a blade and a ball".into()) };
    assert!(blade.tool.shape.is_blade());
    blade.samples.iter_mut().for_each(|sample| sample.pose.position.y += 0.1);
    without.tools.remove(0);
    let plans = [with_blade, without.clone(), without.clone(), without];
    restart::assert_plans_restart(siblings(engine), &snapshot, &plans, &[1, 2]);
    engine.load(&snapshot).map_err(|e| e.to_string())?;
    engine.submit(plans[0].clone()).map_err(|e| e.to_string())?;
    assert!(engine.wait().map_err(|e| e.to_string())?.tools[0].tagged == 0, "the blade meets the clay");
    Ok(())
}

fn replayed_scene_has_the_same_bits(engine: &mut GpuEngine) -> Result<(), Failed> {
    restart::assert_replays(siblings(engine));
    Ok(())
}

/// Every law agrees with the oracle, or a plan with it is refused by its name; and it is those of the paper
/// that are.
fn laws_agree_or_are_refused(engine: &mut GpuEngine) -> Result<(), Failed> {
    for agreement in agreement::all_laws() {
        let law = agreement.case.plan.material.law;
        if !law.is_as_published() {
            assert_close(engine, &agreement);
            continue;
        }
        engine.load(&agreement.case.snapshot).map_err(|e| e.to_string())?;
        let error = engine.submit(agreement.case.plan).expect_err("a refusal").to_string();
        assert!(error.contains(&format!("law = {}:", law.identifier())), "{error}");
    }
    Ok(())
}

/// Plans with the methods of others are refused by their names.
fn other_methods_are_refused(engine: &mut GpuEngine) -> Result<(), Failed> {
    let case = agreement::mixed();
    engine.load(&case.snapshot).map_err(|e| e.to_string())?;
    for cutting in CuttingMethod::ALL.into_iter().filter(|method| !method.keeps_cuts()) {
        let error = engine.submit(FramePlan { cutting, ..case.plan.clone() }).expect_err("a refusal").to_string();
        assert!(error.contains(&format!("cutting = {}:", cutting.identifier())), "{error}");
    }
    Ok(())
}

type Test = (&'static str, Box<dyn FnOnce() -> Result<(), Failed> + Send>);

fn with_engine(name: &'static str, test: fn(&mut GpuEngine) -> Result<(), Failed>) -> Test {
    (name, Box::new(move || test(&mut engine()?)))
}

fn cases(name: &'static str, cases: fn() -> Vec<Agreement>) -> Test {
    (name, Box::new(move || agrees(cases, |all| all)))
}

/// Those that software Vulkan takes too long for; of them it gets the `chosen`.
fn slow_cases(name: &'static str, cases: fn() -> Vec<Agreement>, chosen: fn(Vec<Agreement>) -> Vec<Agreement>) -> Test {
    (name, Box::new(move || agrees(cases, chosen)))
}

fn main() {
    let arguments = Arguments::from_args();
    let tests = [
        // The longest first: at the end it would run alone.
        with_engine("engines_carve_the_same_bunny", scene::engines_carve_the_same_bunny),
        with_engine("each_pass_agrees", passes::each_pass_agrees),
        cases("impact_agrees", agreement::impact),
        cases("walls_in_a_corner_agree", agreement::walls_in_a_corner),
        cases("asymmetric_deformation_agrees", agreement::asymmetric_deformation),
        slow_cases("solid_tools_agree", agreement::solid_tools, one_contact_each),
        slow_cases("found_tools_agree", agreement::found_tools, one_contact_each),
        cases("tools_in_a_corner_agree", agreement::tools_in_a_corner),
        slow_cases("thin_plates_agree", agreement::thin_plates, one_across_each_edge),
        with_engine("anchors_end_where_the_touch_does", anchors_end_where_the_touch_does),
        with_engine("sides_end_where_the_plate_does", sides_end_where_the_plate_does),
        cases("laws_agree", agreement::laws),
        with_engine("all_laws_agree_or_are_refused", laws_agree_or_are_refused),
        with_engine("other_methods_are_refused", other_methods_are_refused),
        cases("volume_averaging_agrees", agreement::averaging),
        cases("blades_agree", agreement::blades),
        cases("flanks_of_worked_clay_agree", agreement::worked_flanks),
        cases("other_blades_agree", agreement::other_blades),
        slow_cases("all_blades_agree", agreement::all_blades, one_contact_each),
        cases("kept_cut_agrees", agreement::kept_cut),
        cases("crossed_cuts_agree", agreement::crossed_cuts),
        cases("cut_through_cuts_agrees", agreement::recut),
        cases("parted_clay_agrees", agreement::parted),
        cases("welding_agrees", agreement::welding),
        cases("left_pressed_agrees", agreement::left_pressed),
        cases("carried_sides_agree", agreement::carrying),
        cases("bodies_agree", agreement::bodies),
        with_engine("found_bodies_agree", bodies::found_bodies_agree),
        with_engine("found_bodies_are_handed_out", bodies::found_bodies_are_handed_out),
        with_engine("restarted_bodies_have_the_same_bits", bodies::restarted_bodies_have_the_same_bits),
        with_engine("runs_are_bit_identical", runs_are_bit_identical),
        with_engine("given_up_frames_leave_no_trace", given_up_frames_leave_no_trace),
        with_engine("frames_hand_out_what_was_asked_for", handout::frames_hand_out_what_was_asked_for),
        with_engine("state_is_there_for_the_asking", handout::state_is_there_for_the_asking),
        with_engine("restarted_scene_has_the_same_bits", restarted_scene_has_the_same_bits),
        with_engine("restarted_plans_have_the_same_bits", restarted_plans_have_the_same_bits),
        with_engine("restart_with_fewer_classes_has_the_same_bits", restart_with_fewer_classes_has_the_same_bits),
        with_engine("replayed_scene_has_the_same_bits", replayed_scene_has_the_same_bits),
        with_engine("nan_particle_is_contained", robust::nan_particle_is_contained),
        with_engine("impossible_frame_is_given_up", robust::impossible_frame_is_given_up),
        with_engine("frame_behind_a_given_up_one_does_not_run", robust::frame_behind_a_given_up_one_does_not_run),
        with_engine("fast_blade_is_given_room", robust::fast_blade_is_given_room),
        with_engine("fast_clay_is_redone_with_smaller_steps", robust::fast_clay_is_redone_with_smaller_steps),
        with_engine("bursting_clay_gets_room", robust::bursting_clay_gets_room),
        with_engine("hardly_any_clay_runs", robust::hardly_any_clay_runs),
        with_engine("crowded_blocks_repeat", robust::crowded_blocks_repeat),
        with_engine("too_many_tools_are_refused", robust::too_many_tools_are_refused),
        with_engine("two_engines_share_nothing", robust::two_engines_share_nothing),
        ("limits_are_named", Box::new(robust::limits_are_named)),
        ("lost_device_is_told", Box::new(robust::lost_device_is_told)),
        ("device_lost_in_a_frame_is_told", Box::new(robust::device_lost_in_a_frame_is_told)),
        ("state_that_went_with_its_device_is_told", Box::new(robust::state_that_went_with_its_device_is_told)),
        ("lost_device_answers_requests", Box::new(stopped::lost_device_answers_requests)),
        ("failed_link_answers_requests", Box::new(stopped::failed_link_answers_requests)),
        ("search_for_a_device_is_silent", Box::new(robust::search_for_a_device_is_silent)),
    ];
    let mode = GpuMode::from_env().unwrap_or_else(|e| panic!("{e}"));
    let is_ignored = mode != GpuMode::Require && ENGINE.with(Result::is_err);
    let trials = tests.into_iter().map(|(name, run)| Trial::test(name, run).with_ignored_flag(is_ignored)).collect();
    libtest_mimic::run(&arguments, trials).exit();
}
