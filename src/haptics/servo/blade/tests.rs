use super::super::{Coupling, ForceLoop, ServoSample, ServoSettings};
use super::*;
use crate::haptics::device::DeviceState;
use assert_no_alloc::assert_no_alloc;
use glam::{DMat3, EulerRot};

const PERIOD: f64 = 1e-3;
const RIGID: Coupling = Coupling { stiffness: f64::INFINITY, damping: 0.0, stiffness_max: f64::INFINITY };
const SPRING: Coupling = Coupling { stiffness: 400.0, damping: 0.5, stiffness_max: 500.0 };

/// R L of the lower edge and of a side \[N\], the flanks' traction, what is borne across \[N\].
const EDGE: f64 = 0.09;
const SIDE: f64 = 0.06;
const FLANK: f64 = 0.3;
const BEARING: f64 = 0.8;
/// Of the clay, across the blade and in its plane \[N/m\].
const STIFFNESS: [f64; 2] = [7000.0, 5000.0];

/// A knife in clay, its edge at -Y `gap` \[m\] before whole clay.
fn knife(gap: f64, flank: f64) -> ContactModel {
    let edge = |outward, gap, force| EdgeTouch { outward, gap, force };
    let sides = [DVec3::X, DVec3::Y, DVec3::NEG_X].map(|m| edge(m, 0.0, if m == DVec3::Y { 0.0 } else { SIDE }));
    let blade = BladeContact {
        flank,
        bearing: [BEARING; 2],
        edges: [edge(DVec3::NEG_Y, gap, EDGE), sides[0], sides[1], sides[2]],
        ..BladeContact::default()
    };
    let [across, along] = STIFFNESS;
    ContactModel {
        frame: 1,
        rate: 1.0,
        normal: DVec3::Z,
        stiffness: DMat3::from_diagonal(DVec3::new(along, along, across)),
        blade: Some(blade),
        ..ContactModel::NONE
    }
}

/// In air `gap` \[m\] above clay that bears by its depth.
fn above(gap: f64) -> ContactModel {
    let mut model = knife(gap, 0.0);
    let blade = model.blade.as_mut().expect("a blade");
    (blade.flank, blade.flank_growth) = (-50.0 * gap, DVec3::NEG_Y * 50.0);
    (blade.bearing, blade.bearing_growth) = ([-150.0 * gap; 2], [DVec3::NEG_Y * 150.0; 2]);
    (1..EDGES_MAX).for_each(|i| blade.edges[i].force = 0.0);
    model
}

struct Bench {
    force: ForceLoop,
    tick: u32,
    rotation: DQuat,
    last: Option<ServoSample>,
    /// Energy that the hand has put in, by the mean force of two ticks \[J\].
    energy: f64,
}

impl Bench {
    fn new(coupling: Coupling, model: &ContactModel) -> Self {
        let settings = ServoSettings { coupling, ..ServoSettings::default() };
        let mut bench = Self { force: ForceLoop::new(settings), tick: 0, rotation: DQuat::IDENTITY, last: None, energy: 0.0 };
        bench.at(DVec3::ZERO);
        bench.force.receive(model);
        bench
    }

    fn at(&mut self, position: DVec3) -> DVec3 {
        self.tick += 1;
        let (time, rotation) = (f64::from(self.tick) * PERIOD, self.rotation);
        let (velocity, buttons, motor_temperature, is_muted) = (DVec3::ZERO, 0, 0.0, false);
        let state = DeviceState { time, position, rotation, velocity, buttons, motor_temperature, is_muted };
        let sample = assert_no_alloc(|| self.force.step(&state, PERIOD));
        if let Some(last) = self.last.replace(sample) {
            self.energy -= 0.5 * (last.clay_force + sample.clay_force).dot(sample.hand - last.hand);
        }
        sample.clay_force
    }

    /// From where it is to a place in some ticks, and the force there.
    fn go(&mut self, to: DVec3, ticks: u32) -> DVec3 {
        let from = self.last.map_or(DVec3::ZERO, |last| last.hand);
        (1..=ticks).map(|i| self.at(from.lerp(to, f64::from(i) / f64::from(ticks)))).last().expect("a tick")
    }
}

#[track_caller]
fn near(found: DVec3, wanted: DVec3, within: f64) {
    assert!((found - wanted).length() <= within, "{found} is not {wanted}");
}

fn mm(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z) * 1e-3
}

/// A knife that goes on bears R L of its edge and what its flanks bear, against its way; held, it stays;
/// drawn back it is pulled by its flanks alone; in its own cut it bears no more, and beyond that R L again.
#[test]
fn edge_bears_its_toughness_where_it_cuts() {
    for coupling in [RIGID, SPRING] {
        for flank in [0.0, FLANK] {
            let mut bench = Bench::new(coupling, &knife(0.0, flank));
            let cutting = bench.go(mm(0.0, -4.0, 0.0), 80);
            near(cutting, DVec3::Y * (EDGE + flank), 1e-9);
            let stretch = (EDGE + flank) / coupling.stiffness.min(1e9);
            // The damper takes the tool on by the time constant of the hand's velocity, 25 um of 400 N/m.
            near(bench.go(mm(0.0, -4.0, 0.0), 200), cutting, if coupling == RIGID { 1e-9 } else { 0.012 });
            near(bench.go(mm(0.0, -1.0, 0.0), 60), DVec3::NEG_Y * flank, 1e-9);
            // The blade is 4 mm deep less what the coupling gave.
            let deepest = 4e-3 - stretch;
            let again = DVec3::NEG_Y * (deepest + flank / coupling.stiffness.min(1e9) - 0.2e-3);
            near(bench.go(again, 60), DVec3::Y * flank, 1e-9);
            near(bench.go(mm(0.0, -6.0, 0.0), 60), DVec3::Y * (EDGE + flank), 1e-9);
        }
    }
}

/// Each edge bears what is against its own advance: to the side the side's, askew each its part.
#[test]
fn edges_bear_by_direction() {
    let mut bench = Bench::new(RIGID, &knife(0.0, 0.0));
    near(bench.go(mm(2.0, 0.0, 0.0), 40), DVec3::NEG_X * SIDE, 1e-9);
    // It still stands before what it would cut; nothing is against the way up.
    near(bench.go(mm(2.0, 3.0, 0.0), 40), DVec3::NEG_X * SIDE, 1e-9);
    // Both edges cut where it goes askew.
    let mut askew = Bench::new(RIGID, &knife(0.0, 0.0));
    near(askew.go(mm(-3.0, -3.0, 0.0), 60), DVec3::new(SIDE, EDGE, 0.0), 1e-9);
    // The blade's frame is its own: edges turn with it.
    let mut turned = Bench::new(RIGID, &ContactModel { normal: DVec3::X, ..knife(0.0, 0.0) });
    turned.rotation = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    turned.at(DVec3::ZERO);
    near(turned.go(mm(0.0, 0.0, -2.0), 40), DVec3::Z * SIDE, 1e-9);
}

/// A blade in air bears nothing, however it goes, until it comes to the clay.
#[test]
fn edge_in_air_bears_nothing() {
    for coupling in [RIGID, SPRING] {
        let mut bench = Bench::new(coupling, &above(2e-3));
        for place in [mm(0.0, -1.9, 0.0), mm(3.0, -1.0, 0.5), mm(-2.0, 0.0, -1.0), mm(0.0, -1.99, 0.0)] {
            near(bench.go(place, 40), DVec3::ZERO, 0.0);
        }
        let deep = bench.go(mm(0.0, -4.0, 0.0), 60);
        let depth = -bench.last.expect("a tick").tool.y - 2e-3;
        near(DVec3::Y * deep.y, DVec3::Y * (EDGE + 50.0 * depth), 0.05 * EDGE);
        near(bench.go(mm(0.0, 1.0, 0.0), 60), DVec3::ZERO, 0.0);
    }
}

/// Across its plane clay holds a blade on both sides: by its spring, and by what it bears at most.
#[test]
fn clay_holds_a_blade_across_both_ways() {
    for way in [1.0, -1.0] {
        let mut bench = Bench::new(RIGID, &knife(0.0, FLANK));
        near(bench.go(mm(0.0, 0.0, 0.1 * way), 10), DVec3::NEG_Z * (0.1e-3 * way * STIFFNESS[0]), 1e-9);
        near(bench.go(mm(0.0, 0.0, 0.5 * way), 20), DVec3::NEG_Z * (BEARING * way), 1e-9);
        near(bench.go(mm(0.0, 0.0, 0.4 * way), 10), DVec3::NEG_Z * (way * (BEARING - 0.1e-3 * STIFFNESS[0])), 1e-9);
        near(bench.go(mm(0.0, 0.0, -0.4 * way), 40), DVec3::Z * (BEARING * way), 1e-9);
    }
}

/// A number between 0 and 1, the same each time.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1u64 << 53) as f64
}

/// Whatever way a hand takes, turns of the blade and frames that change all numbers on it, it gets no energy
/// of it once it is back in the air.
#[test]
fn no_cycle_gains_energy() {
    for coupling in [RIGID, SPRING] {
        for seed in 0..24 {
            let mut seed = seed;
            let mut bench = Bench::new(coupling, &above(1e-3));
            let mut place = DVec3::ZERO;
            for _ in 0..12 {
                place = DVec3::new(random(&mut seed) - 0.5, -random(&mut seed), random(&mut seed) - 0.5) * 5e-3;
                bench.rotation =
                    DQuat::from_euler(EulerRot::XYZ, 0.1 * random(&mut seed), 0.1 * random(&mut seed), 0.2 * random(&mut seed));
                bench.go(place, 25 + (50.0 * random(&mut seed)) as u32);
            }
            bench.go(place.with_y(3e-3), 80);
            let last = bench.go(mm(0.0, 3.0, 0.0), 20);
            near(last, DVec3::ZERO, 0.0);
            assert!(bench.energy > 1e-4, "{} J after {seed}", bench.energy);
        }
    }
}

/// The same of each small loop about a place in clay: what is pressed, drawn and pushed askew in any order.
#[test]
fn small_loops_give_nothing_back() {
    for (size, flank) in [(0.02, FLANK), (0.2, FLANK), (0.5, 0.0), (2.0, 0.1)] {
        let mut seed = 5;
        let mut bench = Bench::new(RIGID, &knife(0.0, flank));
        let mut least = f64::INFINITY;
        for _ in 0..30 {
            let before = bench.energy;
            let at = bench.last.expect("a tick").hand;
            for _ in 0..3 {
                let way = DVec3::new(random(&mut seed) - 0.5, random(&mut seed) - 0.5, random(&mut seed) - 0.5);
                bench.go(at + mm(size, size, size) * way, 400);
            }
            bench.go(at, 400);
            least = least.min(bench.energy - before);
        }
        // A loop may end with less strain in the clay than it began with; all of them may not.
        assert!(bench.energy > -1e-15 && least > -1e-4, "{} J of all, {least} J of one", bench.energy);
    }
}

/// What one frame says of a blade is felt over the time of a frame, without a step; clay that is gone is felt
/// no more.
#[test]
fn frames_of_blades_change_no_force_at_once() {
    let mut bench = Bench::new(SPRING, &knife(0.0, FLANK));
    let mut last = bench.go(mm(0.3, -3.0, 0.2), 60);
    let frames: [fn() -> ContactModel; 3] =
        [|| knife(0.0, 0.05), || knife(1e-3, 0.6), || ContactModel { normal: DVec3::ZERO, ..knife(0.0, FLANK) }];
    for (frame, model) in (2..).zip(frames) {
        let model = model();
        let now = f64::from(bench.tick) * PERIOD;
        let force = if model.normal == DVec3::ZERO { DVec3::ZERO } else { last };
        let position = bench.last.expect("a tick").tool;
        bench.force.receive(&ContactModel { frame, span: [now - 5.0 * PERIOD, now], force, position, ..model });
        for _ in 0..14 {
            let next = bench.go(mm(0.3, -3.0, 0.2), 1);
            assert!((next - last).length() < 0.1, "frame {frame}: {} N in a tick", (next - last).length());
            last = next;
        }
    }
    near(last, DVec3::ZERO, 0.0);
}
