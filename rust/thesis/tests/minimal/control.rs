//! Controllers of the minimal model: Theorem 6.1, treatments and their limits, saturation, noise.

use snake_core::capabilities::Method;
use snake_core::control::{ControllerConfig, Treatment};
use snake_core::gait::{Reference, Wave};
use snake_core::noise::NoiseConfig;
use snake_core::stepping::ImplicitConfig;
use snake_thesis::minimal::{FrictionLaw, MinimalConfig, MinimalSimulation, MinimalState, SmoothLaw, pd};
use snake_thesis::{IntegratorConfig, ThesisConfig};

use crate::robots::{default_config, error_of_joint_5, io_for_period, soft_start, straight};

fn io() -> MinimalConfig {
    MinimalConfig { controller: ControllerConfig::io(), ..default_config() }
}

/// Input-output linearisation with the thesis's limit of 10 N m.
fn limited() -> ControllerConfig {
    ControllerConfig { torque_limit: Some(10.0), ..ControllerConfig::io() }
}

fn with_step(config: MinimalConfig, step: f64) -> MinimalConfig {
    MinimalConfig { integrator: config.integrator.with_step(step), ..config }
}

fn on(config: MinimalConfig, law: SmoothLaw, tolerance: f64) -> MinimalConfig {
    let integrator = ImplicitConfig { tolerance: Some(tolerance), ..ImplicitConfig::default() }.into();
    MinimalConfig { friction_law: FrictionLaw::Smooth(law), integrator, ..config }
}

/// The largest |w| of a run, and the largest error of joint 5 after 5 s.
fn observe(config: &MinimalConfig, duration: f64) -> (f64, f64) {
    let (mut simulation, gait) = (straight(config), soft_start());
    let (mut w, mut error) = (0.0_f64, 0.0_f64);
    for k in 0..(100.0 * duration) as u32 {
        assert!(simulation.advance(0.01, &gait), "diverged at {} s", simulation.state().time);
        w = w.max(simulation.state().passive_velocity().norm());
        if k >= 500 {
            error = error.max(error_of_joint_5(&simulation, &gait).abs());
        }
    }
    (w, error)
}

/// e = a exp(r_1 t) + b exp(r_2 t): e' - r_2 e decays with r_1 alone, and e' - r_1 e with r_2.
#[test]
fn the_error_on_the_smooth_plant_decays_with_the_roots_of_theorem_6_1() {
    let discriminant = (2.4e3_f64.powi(2) - 4.0 * 4e5).sqrt();
    let roots = [(-2.4e3 + discriminant) / 2.0, (-2.4e3 - discriminant) / 2.0];
    assert!((roots[0] + 180.2).abs() < 0.05 && (roots[1] + 2219.8).abs() < 0.05, "{roots:?}");
    let wave = Wave::default();
    let config = on(io(), SmoothLaw::PRINTED, 1e-12);
    let mut simulation = MinimalSimulation::new(&config).expect("admissible");
    let mut state = MinimalState::zero(13);
    for j in 0..10 {
        let target = wave.target(j, 0.0);
        state.q[3 + j] = target.angle + 0.02 * (j as f64 - 4.0);
        state.rate[3 + j] = target.rate + 5.0 - j as f64;
    }
    simulation.place(&state);
    let modes = |simulation: &MinimalSimulation, j: usize| {
        let state = simulation.state();
        let target = wave.target(j, state.time);
        let (e, rate) = (state.phi()[j] - target.angle, state.phi_rate()[j] - target.rate);
        [rate - roots[1] * e, rate - roots[0] * e]
    };
    let start: Vec<_> = (0..10).map(|j| modes(&simulation, j)).collect();
    let time = 1e-3;
    assert!(simulation.advance(time, &wave));
    for (j, start) in start.iter().enumerate() {
        for (mode, end) in modes(&simulation, j).iter().enumerate() {
            let root = (end / start[mode]).ln() / time;
            let error = (root / roots[mode] - 1.0).abs();
            assert!(error < 1e-6, "joint {j}: {root} against {}", roots[mode]);
        }
    }
}

/// Although the gait exceeds the theorem's bound on |phi_d'| forty times.
#[test]
fn the_velocities_of_the_virtual_joints_stay_bounded_in_all_runs() {
    let laws = [FrictionLaw::SetValued, FrictionLaw::Smooth(SmoothLaw::PRINTED)];
    for friction_law in laws {
        for config in [io(), default_config()] {
            let integrator = ImplicitConfig { step: Some(0.01), ..ImplicitConfig::default() }.into();
            let (w, _) = observe(&MinimalConfig { friction_law, integrator, ..config }, 20.0);
            assert!(w < 10.0, "{w}");
        }
    }
}

/// What chapter 6 leaves open: the printed box law, not smoothing as such, makes the difference.
#[test]
fn the_smoothed_ellipse_agrees_with_the_set_valued_law_and_the_box_does_not() {
    let set_valued = observe(&with_step(default_config(), 0.01), 12.0).1;
    let ellipse = observe(&on(default_config(), SmoothLaw::Ellipse { smoothing: 1e-3 }, 1e-6), 12.0).1;
    let arctan = observe(&on(default_config(), SmoothLaw::PRINTED, 1e-6), 12.0).1;
    assert!((ellipse / set_valued - 1.0).abs() < 5e-3, "{ellipse} {set_valued}");
    assert!((arctan / set_valued - 1.47).abs() < 0.02, "{arctan} {set_valued}");
}

#[test]
fn implicit_feedback_has_no_limit_on_the_step() {
    let limited = MinimalConfig { controller: limited(), ..default_config() };
    for step in [0.001, 0.018, 0.05, 0.2] {
        for (config, bound) in [(io(), 0.05_f64), (limited.clone(), 0.05), (default_config(), 0.5)] {
            let (_, error) = observe(&with_step(config, step), 10.0);
            assert!(error.to_degrees() < bound, "{step} s: {} degrees", error.to_degrees());
        }
    }
}

/// Whether a straight robot whose joint 5 is pushed comes to rest, its torques held for `period`.
fn recovers(law: ControllerConfig, period: f64) -> bool {
    let controller = ControllerConfig { treatment: Treatment::Period(period), ..law };
    let integrator = ImplicitConfig { step: Some(period), tolerance: Some(1e-7), ..ImplicitConfig::default() }.into();
    let config = MinimalConfig { controller, integrator, ..default_config() };
    let mut simulation = MinimalSimulation::new(&config).expect("admissible");
    let mut state = MinimalState::zero(13);
    state.q[7] = 0.01;
    simulation.place(&state);
    let still = Wave { amplitude: 0.0, ..Wave::default() };
    let mut speed = f64::INFINITY;
    for _ in 0..3 {
        if !simulation.advance(100.0 * period, &still) {
            return false;
        }
        speed = simulation.state().phi_rate().iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    }
    speed < 0.1
}

/// 2 / K_D = 0.833 ms.
#[test]
fn held_input_output_linearisation_with_the_printed_gains_fails_beyond_0_83_ms() {
    assert!(recovers(ControllerConfig::io(), 7.5e-4));
    assert!(!recovers(ControllerConfig::io(), 9.5e-4));
}

#[test]
fn gains_from_the_control_period_are_stable_at_any_period() {
    for period in [1e-3, 1e-2, 5e-2] {
        assert!(recovers(io_for_period(period), period), "{period} s");
    }
}

#[test]
fn explicit_pd_fails_beyond_0_576_ms() {
    assert!(recovers(pd(), 5e-4));
    assert!(!recovers(pd(), 7e-4));
}

#[test]
fn no_torque_exceeds_its_limit_and_stationary_motion_does_not_notice() {
    for law in [FrictionLaw::SetValued, FrictionLaw::Smooth(SmoothLaw::PRINTED)] {
        let error_with = |torque_limit| {
            let controller = ControllerConfig { torque_limit, ..ControllerConfig::io() };
            let config = MinimalConfig { friction_law: law, controller, ..default_config() };
            let (mut simulation, gait) = (straight(&config), soft_start());
            let (mut largest, mut error) = (0.0_f64, 0.0_f64);
            for k in 0..800 {
                assert!(simulation.advance(0.01, &gait));
                largest = simulation.torque().iter().fold(largest, |a, tau| a.max(tau.abs()));
                if k >= 500 {
                    error = error.max(error_of_joint_5(&simulation, &gait).abs());
                }
            }
            assert!(largest <= torque_limit.unwrap_or(f64::INFINITY) * (1.0 + 1e-12));
            error
        };
        let (free, limited) = (error_with(None), error_with(Some(10.0)));
        assert!((free - limited).abs() < 2e-6, "{free:e} {limited:e}");
    }
}

/// The stage's limit is that of the solver with error control, which clips (T 6.58) at each instant.
#[test]
fn at_its_limit_the_torque_is_the_clipped_one() {
    let set_valued = MinimalConfig { controller: limited(), ..default_config() };
    let smooth = on(set_valued.clone(), SmoothLaw::Ellipse { smoothing: 1e-3 }, 1e-6);
    let (mut one, mut other, gait) = (straight(&set_valued), straight(&smooth), soft_start());
    let mut worst = 0.0_f64;
    for _ in 0..60 {
        assert!(one.advance(0.05, &gait) && other.advance(0.05, &gait));
        for (a, b) in one.state().phi().iter().zip(other.state().phi()) {
            worst = worst.max((a - b).abs());
        }
    }
    assert!(worst < 0.01, "{worst} rad; the joints are off by 0.15 rad meanwhile");
}

#[test]
fn actuators_sleep_until_they_awake() {
    let controller = ControllerConfig { active_from: 0.35, ..ControllerConfig::io() };
    let mut simulation = straight(&MinimalConfig { controller, ..default_config() });
    assert!(simulation.advance(0.35, &soft_start()));
    assert!(simulation.torque().iter().all(|&tau| tau == 0.0));
    assert!(simulation.advance(0.05, &soft_start()));
    assert!(simulation.torque().iter().any(|&tau| tau != 0.0));
}

/// Actuators that awake at the end of an interval do so there, however the clock has been rounded: a solver that took
/// the jump for a part of its past would give up.
#[test]
fn a_jump_at_the_end_of_an_interval_is_met() {
    let controller = ControllerConfig { active_from: 1.0, ..pd() };
    let smooth = on(MinimalConfig { controller, ..default_config() }, SmoothLaw::PRINTED, 1e-8);
    let angles = |interval: f64, count: u32| {
        let mut simulation = straight(&smooth);
        assert!((0..count).all(|_| simulation.advance(interval, &soft_start())), "intervals of {interval} s");
        simulation.state().phi().to_vec()
    };
    // Ten times 0.1 is just below 1.
    for (a, b) in angles(0.1, 15).iter().zip(angles(1.5, 1)) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn sleeping_actuators_and_held_torques_need_no_short_steps() {
    let asleep = ControllerConfig { active_from: 2.0, ..ControllerConfig::io() };
    let held = io_for_period(0.02);
    let still = Wave { amplitude: 0.0, ..Wave::default() };
    for controller in [asleep, ControllerConfig { treatment: Treatment::Period(0.02), ..held }] {
        let mut simulation = straight(&MinimalConfig { controller, ..default_config() });
        assert!(simulation.advance(0.1, &still), "short steps at the start");
        assert!(simulation.advance(0.2, &still));
        assert_eq!(simulation.statistics().steps, 10, "{controller:?}");
    }
}

/// 3 degrees and 0.972 rad/s at once, asked of the inertia that joint 6 then feels.
#[test]
fn the_jumps_of_the_soft_start_take_1326_newton_metres_of_the_printed_gains_and_10_3_of_pd() {
    for (law, expected) in [(ControllerConfig::io(), 1326.5), (pd(), 10.28)] {
        for (method, treatment) in [(Method::Thesis, Treatment::Implicit), (Method::Implicit, Treatment::Step)] {
            let controller = ControllerConfig { treatment, ..law };
            let integrator = by(method);
            let (mut simulation, gait) =
                (straight(&MinimalConfig { controller, integrator, ..default_config() }), soft_start());
            let mut largest = 0.0_f64;
            for _ in 0..4000 {
                assert!(simulation.advance(2.5e-4, &gait));
                largest = simulation.torque().iter().fold(largest, |a, tau| a.max(tau.abs()));
            }
            assert!((largest / expected - 1.0).abs() < 2e-3, "{law:?}, {method:?}: {largest}");
        }
    }
}

/// A method in the steps of the thesis.
fn by(method: Method) -> IntegratorConfig {
    match method {
        Method::Thesis => ThesisConfig::default().into(),
        Method::Implicit => ImplicitConfig { step: Some(2.5e-4), ..ImplicitConfig::default() }.into(),
    }
}

fn noisy(seed: u64, method: Method, treatment: Treatment) -> Vec<f64> {
    let degree = std::f64::consts::PI / 180.0;
    let noise = NoiseConfig {
        position: 0.1,
        heading: 0.1 * degree,
        joint_angle: 0.1 * degree,
        velocity: 0.1,
        yaw_rate: 0.1 * degree,
        joint_rate: 0.1 * degree,
    };
    let controller = ControllerConfig { treatment, ..ControllerConfig::io() };
    let integrator = by(method);
    let mut simulation = straight(&MinimalConfig { controller, integrator, noise, seed, ..default_config() });
    assert!(simulation.advance(0.2, &soft_start()));
    simulation.state().q.clone()
}

/// As in the thesis; noise has no meaning between measurements.
#[test]
fn noise_is_measured_every_quarter_of_a_millisecond_by_default() {
    let sampled = Treatment::Period(2.5e-4);
    assert_eq!(noisy(1, Method::Implicit, Treatment::Implicit), noisy(1, Method::Implicit, sampled));
}

#[test]
fn noise_is_a_function_of_its_seed() {
    for (method, treatment) in [
        (Method::Thesis, Treatment::Implicit),
        (Method::Implicit, Treatment::Implicit),
        (Method::Implicit, Treatment::Step),
        (Method::Implicit, Treatment::Period(5e-4)),
    ] {
        assert_eq!(noisy(1, method, treatment), noisy(1, method, treatment));
        assert_ne!(noisy(1, method, treatment), noisy(2, method, treatment));
    }
}
