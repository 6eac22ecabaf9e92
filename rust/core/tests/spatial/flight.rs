//! Energy of limp chains in flight: what the schemes make of it by the angle a link turns in a step.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Wave};
use snake_core::robot::RobotConfig;
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, orientation_of, twist_of};
use snake_core::stepping::ImplicitConfig;
use snake_test_support::planar::ground;

/// How long chains fly \[s\].
const DURATION: f64 = 1.0;

/// A straight limp chain far above the ground that spins as one body about an axis across it \[rad/s\].
fn spinning(links: usize, spin: f64, step: f64, order: u32) -> SpatialSimulation {
    let robot = RobotConfig { links, gravity: 1e-6, ..RobotConfig::default() };
    let limp = ControllerConfig { kp: 0.0, kd: 0.0, ..ControllerConfig::default() };
    let integrator = ImplicitConfig { step: Some(step), order, ..ImplicitConfig::default() };
    let mut simulation = SpatialSimulation::new(&robot, &ground([0.0; 2]), &limp, &integrator).expect("admissible");
    let head = Pose { position: Vector3::new(0.0, 0.0, 100.0), orientation: orientation_of(0.4, 0.3, 0.2) };
    simulation.place_chain(head, &vec![Vector2::zeros(); links - 1]);
    let mut state = simulation.state().clone();
    let centre = state.pose.iter().map(|pose| pose.position).sum::<Vector3<f64>>() / links as f64;
    let spin = state.pose[0].orientation * Vector3::new(0.6, 0.8, 0.0) * spin;
    for (pose, twist) in state.pose.iter().zip(&mut state.twist) {
        let velocity = spin.cross(&(pose.position - centre));
        *twist = twist_of(velocity, pose.orientation.inverse_transform_vector(&spin));
    }
    simulation.place(&state);
    simulation
}

/// Change of the kinetic energy over its start, per radian that the chain turned.
fn change(links: usize, spin: f64, step: f64, order: u32) -> f64 {
    let still = CardanGait { yaw: Gait::Wave(Wave::still()), pitch: Gait::Wave(Wave::still()) };
    let mut simulation = spinning(links, spin, step, order);
    let kinetic = |simulation: &SpatialSimulation| simulation.state().kinetic_energy(simulation.robot());
    let before = kinetic(&simulation);
    let report = simulation.advance(DURATION, &still);
    assert!(!report.diverged && report.unconverged == 0, "{report:?}");
    (kinetic(&simulation) / before - 1.0) / (spin * DURATION)
}

/// Euler's steps lose energy. The second stage carries what joints did in the first one on, along axes that have turned
/// meanwhile; what that gives the chain falls with the cube of the angle of a step, and so does no harm where links
/// turn by a tenth of a radian. (Where steps are divided for events it is less.)
#[test]
fn energy_in_flight_rises_with_the_cube_of_the_angle_of_a_step() {
    for links in [2, 3, 11] {
        for spin in [5.0, 20.0, 51.0] {
            for angle in [0.05, 0.1, 0.2] {
                let [first, second] = [1, 2].map(|order| change(links, spin, angle / spin, order));
                println!("{links} links, {spin} rad/s, {angle} rad a step: {first:.1e}, {second:.1e} a radian");
                assert!(first < 0.0, "Euler: {links} links, {spin} rad/s, {angle} rad a step: {first:e}");
                assert!(second < 0.1 * angle.powi(3), "{links} links, {spin} rad/s, {angle} rad a step: {second:e}");
            }
        }
    }
}
