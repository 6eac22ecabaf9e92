//! Whole scenes drawn at random, the same in every run unless the environment variable SNAKE_ENV_FUZZ is "search"; a scene
//! that fails is shrunk to the simplest that does, kept beside this file and replayed.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use snake_core::gait::Wave;
use snake_stress::draw::Draw;
use snake_stress::requirements::{Bounds, broken};

/// A number, uniform in its logarithm.
fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> + Clone {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

fn zero_or(numbers: impl Strategy<Value = f64> + 'static) -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(0.0), 4 => numbers]
}

fn waves() -> impl Strategy<Value = Wave> {
    let numbers = (0.0..1.0, decades(0.1, 20.0), -1.5..1.5, -0.2..0.2);
    numbers.prop_map(|(amplitude, omega, beta, gamma)| Wave { amplitude, omega, beta, gamma, phase: 0.0 })
}

prop_compose! {
    fn robots()(
        links in 2_usize..16,
        weights in vec(decades(1e-4, 1.0), 1..16),
        bends in vec(-0.6..0.6, 1..16),
        velocity in [-3.0..3.0, -3.0..3.0],
    ) -> (usize, Vec<f64>, Vec<f64>, [f64; 2]) {
        (links, weights, bends, velocity)
    }
}

prop_compose! {
    fn scenes()(
        (links, weights, bends, velocity) in robots(),
        friction in [zero_or(decades(1e-3, 10.0)), zero_or(decades(1e-3, 10.0))],
        kp in zero_or(decades(1.0, 1e6)),
        kd in zero_or(decades(1e-2, 1e2)),
        torque_limit in option::of(decades(1e-2, 30.0)),
        wave in waves(),
        pegs in vec([decades(2e-3, 0.2).boxed(), (0.0..1.0).boxed(), (0.0..1.0).boxed()], 0..30),
        step in prop::sample::select(vec![1e-3, 5e-3, 1e-2, 2.5e-2, 5e-2]),
        order in 1_u32..=2,
        tolerance in prop::sample::select(vec![1e-6, 1e-8]),
    ) -> Draw {
        Draw { links, weights, friction, kp, kd, torque_limit, wave, bends, velocity, pegs, step, order, tolerance }
    }
}

/// Where contradicting contacts or a recovery at high leverage spoil geometry and energy is told in docs/stress.md;
/// here, that every state is sane, every joint closed and every stage certified or counted.
const BOUNDS: Bounds =
    Bounds { penetration: 0.25, energy: f64::INFINITY, drift: f64::INFINITY, unconverged: u64::MAX, residual: 1e-4 };

/// A scene without drives and friction.
fn limp(draw: &Draw) -> Draw {
    Draw { kp: 0.0, kd: 0.0, friction: [0.0; 2], ..draw.clone() }
}

fn config() -> ProptestConfig {
    let searches = std::env::var("SNAKE_ENV_FUZZ").is_ok_and(|mode| mode == "search");
    let rng_seed = if searches { RngSeed::Random } else { RngSeed::Fixed(1) };
    ProptestConfig { cases: 48, rng_seed, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn any_scene_stays_sane_joined_and_certified(draw in scenes()) {
        let broken = broken(&draw.case("scene", 0.5).run(), &BOUNDS);
        prop_assert!(broken.is_empty(), "{broken:?}");
    }

    #[test]
    fn a_limp_robot_in_free_flight_gains_no_energy(draw in scenes()) {
        let figures = Draw { pegs: Vec::new(), ..limp(&draw) }.case("free", 0.5).run();
        // Round-off of a few hundred steps.
        prop_assert!(figures.relative_created < 1e-12, "{} J", figures.created);
    }

    /// Where a coarse step turns a light link into a peg, undoing the penetration takes energy from nowhere; see
    /// docs/stress.md. Links of one kind at fine steps do not.
    #[test]
    fn a_limp_robot_among_pegs_gains_no_energy(draw in scenes()) {
        let draw = Draw { weights: vec![1.0], step: draw.step.min(5e-3), ..limp(&draw) };
        let figures = draw.case("pegs", 0.5).run();
        prop_assert!(figures.relative_created < 0.01, "{} J", figures.created);
    }

    #[test]
    fn a_scene_runs_the_same_twice(draw in scenes()) {
        let run = || draw.case("scene", 0.2).run();
        prop_assert_eq!(run(), run());
    }
}
