//! Input-output linearisation of the planar model: smooth two-point model in the controller, set-valued system.

use snake_core::control::ControllerConfig;
use snake_core::gait::{Reference, Wave};
use snake_core::scene::{START_7_5, SceneConfig};
use snake_core::simulation::PlanarSimulation;
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::{START_FREE, ground, table_7_5};

fn io(torque_limit: Option<f64>) -> ControllerConfig {
    ControllerConfig { torque_limit, ..ControllerConfig::io() }
}

fn undulating(scene: &SceneConfig, start: [f64; 3], law: ControllerConfig, config: ImplicitConfig) -> PlanarSimulation {
    let mut simulation = PlanarSimulation::new(&Default::default(), scene, &law, &config).expect("admissible");
    let angles: Vec<f64> = (0..10).map(|joint| Wave::default().target(joint, 0.0).angle).collect();
    simulation.place_chain(start[0], start[1], start[2], &angles);
    simulation
}

fn largest_error(simulation: &mut PlanarSimulation, duration: f64) -> f64 {
    let wave = Wave::default();
    let (mut worst, mut time) = (0.0_f64, 0.0);
    while time < duration {
        let report = simulation.advance(0.05, &wave);
        assert!(!report.diverged && report.unconverged == 0, "{report:?}");
        time += 0.05;
        if time > 0.5 {
            for joint in 0..10 {
                let error = simulation.state().joint_angle(joint) - wave.target(joint, simulation.state().time).angle;
                worst = worst.max(error.abs());
            }
        }
    }
    worst.to_degrees()
}

#[test]
fn it_tracks_at_any_step_far_better_than_pd() {
    let pd = ControllerConfig { kp: 200.0, kd: 1.2, ..ControllerConfig::default() };
    for step in [0.005, 0.025, 0.05] {
        let config = ImplicitConfig { step: Some(step), ..ImplicitConfig::default() };
        let error = |law| largest_error(&mut undulating(&ground([0.2, 0.5]), START_FREE, law, config), 4.0);
        let (ours, theirs) = (error(io(None)), error(pd));
        println!("{step} s: IO {ours:.4} deg, PD {theirs:.4} deg");
        assert!(ours < 0.15 * theirs, "{step} s: {ours} {theirs} degrees");
    }
}

#[test]
fn among_pegs_it_makes_way_within_its_torque_limit() {
    let scene = table_7_5();
    let mut simulation = undulating(&scene, START_7_5, io(Some(10.0)), ImplicitConfig::default());
    let start = simulation.state().pose[5].x;
    let mut largest = 0.0_f64;
    for _ in 0..90 {
        let report = simulation.advance(0.05, &Wave::default());
        assert!(!report.diverged);
        largest = simulation.joint_torque().iter().fold(largest, |a, tau| a.max(tau.abs()));
    }
    let speed = (simulation.state().pose[5].x - start) / 4.5;
    println!("{speed:.4} m/s, at most {largest:.2} N m");
    assert!(largest <= 10.0 * (1.0 + 1e-12) && speed > 0.14, "{speed} m/s, {largest} N m");
}
