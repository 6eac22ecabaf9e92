//! Gains of each axis of each joint in 3D: links at either end of a heavy one, each axis against its closed form.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Wave};
use snake_core::robot::{Motor, PerAxis, PerLink, RobotConfig};
use snake_core::simulation::SpatialSimulation;
use snake_core::spatial::{Pose, joint_angle, orientation_of, turning};
use snake_test_support::planar::{ground, links};
use snake_test_support::spatial::implicit;

/// Inertia of a link of Aiko about its joint.
const INERTIA: f64 = 1.32e-3 + (7.5 / 11.0) * 0.061 * 0.061;

/// Two links of Aiko at the ends of one that does not move, without weight.
fn anchored() -> RobotConfig {
    RobotConfig {
        mass: PerLink::Each(vec![7.5 / 11.0, 1e4, 7.5 / 11.0]),
        inertia: PerLink::Each(vec![1.32e-3, 1e4, 1.32e-3]),
        roll_inertia: PerLink::Each(vec![9.4e-4, 1e4, 9.4e-4]),
        gravity: 1e-9,
        ..links(3)
    }
}

#[test]
fn each_axis_spins_up_along_the_line_of_its_own_motor() {
    let motor = |stall_torque: f64, no_load_speed: f64, rotor_inertia: f64| Motor {
        stall_torque,
        no_load_speed,
        rotor_inertia,
        ..Motor::default()
    };
    let motors = [[motor(0.4, 1.0, 0.0), motor(0.1, 2.0, 2e-3)], [motor(0.2, 0.5, 1e-3); 2]];
    let of_joints = vec![PerLink::Each(motors[0].into()), PerLink::Same(motors[1][0])];
    let robot = RobotConfig { motor: Some(PerAxis::Each(of_joints)), ..anchored() };
    let pd = ControllerConfig::default();
    let mut simulation =
        SpatialSimulation::new(&robot, &ground([0.0; 2]), &pd, &implicit(1e-4, 2)).expect("admissible");
    let head = Pose { position: Vector3::z(), orientation: orientation_of(0.0, 0.0, 0.0) };
    simulation.place_chain(head, &[Vector2::zeros(); 2]);
    let wave = Gait::Wave(Wave { gamma: 1.0, ..Wave::still() });
    simulation.advance(0.01, &CardanGait { yaw: wave.clone(), pitch: wave });
    for (joint, motors) in motors.into_iter().enumerate() {
        let relative = turning(&simulation.state().twist[joint + 1]) - turning(&simulation.state().twist[joint]);
        let rates = [relative.y.abs(), relative.x.abs()];
        for (axis, motor) in motors.iter().enumerate() {
            let constant = (INERTIA + motor.rotor_inertia) * motor.no_load_speed / motor.stall_torque;
            let expected = motor.no_load_speed * (1.0 - f64::exp(-0.01 / constant));
            assert!((rates[axis] / expected - 1.0).abs() < 1e-3, "{joint}, {axis}: {} for {expected}", rates[axis]);
        }
    }
}

#[test]
fn each_axis_swings_at_its_own_gain_and_gives_its_own_torque() {
    let kp = PerAxis::Each(vec![PerLink::Each(vec![20.0, 5.0]), PerLink::Same(8.0)]);
    let limit = PerAxis::Each(vec![PerLink::Same(f64::INFINITY), PerLink::Each(vec![1.0, 0.03])]);
    let robot = RobotConfig { kp: Some(kp), kd: Some(0.0.into()), torque_limit: Some(limit), ..anchored() };
    let pd = ControllerConfig::default();
    let mut simulation =
        SpatialSimulation::new(&robot, &ground([0.0; 2]), &pd, &implicit(2e-4, 2)).expect("admissible");
    let head = Pose { position: Vector3::z(), orientation: orientation_of(0.0, 0.0, 0.0) };
    let start = [[0.02, 0.02], [0.02, 0.02]];
    simulation.place_chain(head, &start.map(Vector2::from));
    let still = CardanGait { yaw: Gait::Wave(Wave::still()), pitch: Gait::Wave(Wave::still()) };
    let gains = [[20.0, 5.0], [8.0, 8.0]];
    for k in 1..=4 {
        simulation.advance(0.005, &still);
        let t = 0.005 * f64::from(k);
        for joint in 0..2 {
            let pose = &simulation.state().pose;
            let angles = joint_angle(&pose[joint], &pose[joint + 1]);
            for axis in 0..2 {
                let swing = start[joint][axis] * ((gains[joint][axis] / INERTIA).sqrt() * t).cos();
                // The last axis starts beyond its largest torque: 0.03 N m, not 0.16.
                let pushed = 0.02 - 0.5 * 0.03 / INERTIA * t * t;
                let expected = if joint == 1 && axis == 1 { pushed } else { swing };
                let error = angles[axis] - expected;
                assert!(error.abs() < 2e-5, "joint {joint}, axis {axis} at {t}: {error:e}");
            }
        }
    }
}
