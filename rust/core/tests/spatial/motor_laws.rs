//! Motors of joints in 3D: stages by two methods, flight, and a gear that holds a robot up.

use nalgebra::{Vector2, Vector3};
use snake_core::control::ControllerConfig;
use snake_core::gait::{CardanGait, Gait, Reference, Wave};
use snake_core::robot::{AxesConfig, Motor, RobotConfig};
use snake_core::simulation::SpatialSimulation;
use snake_core::solver::{CoupledStage, SolveStatus};
use snake_core::spatial::{
    CoulombNewton, Fallback, Newton, Pose, Spatial, Stage, StageSolution, certify, orientation_of, turning,
};
use snake_test_support::flat::work_of_motors_goes_into_links_rotors_and_friction;
use snake_test_support::planar::{LIMP, Random, ground, links, random_motor};
use snake_test_support::spatial::{DEGREE, implicit, undulation};
use snake_test_support::spatial_stage::stacked;

use super::stage::{blank, moving};

fn still() -> CardanGait {
    CardanGait { yaw: Gait::Wave(Wave::still()), pitch: Gait::Wave(Wave::still()) }
}

fn with_motors(stage: &mut Stage, random: &mut Random) {
    for drive in stage.joints.iter_mut().flatten() {
        let motor = random_motor(drive.drive.abs() + drive.stiffness, random);
        drive.limit = drive.limit.min(motor.stall);
        stage.motors.push(motor);
    }
}

#[test]
fn stages_with_motors_are_solved_alike_by_two_methods() {
    let mut random = Random::new(78);
    let (mut on_line, mut stuck, mut fallbacks, mut worst) = (0, 0, 0, 0.0_f64);
    for trial in 0..300 {
        let mut stage = moving(&mut random, 2 + trial % 9);
        with_motors(&mut stage, &mut random);
        let mut start = blank(&stage);
        start.gear.resize(stage.motors.len(), 0.0);
        let mut ours = start.clone();
        assert!(Newton::new(stage.links.len()).solve_one(&stage, &mut ours, 1e-9, 300).converged, "trial {trial}");
        let mut theirs = start.clone();
        if !CoulombNewton::new(stage.links.len()).solve(&stage, &mut theirs, 1e-9).1 {
            fallbacks += 1;
            let (_, status) = Fallback::new(stage.links.len()).solve_hard(&stage, &mut theirs, 1e-8, u32::MAX);
            assert_eq!(status, SolveStatus::Solved, "trial {trial}");
        }
        let apart = (stacked(&ours.twist) - stacked(&theirs.twist)).amax();
        assert!(apart < 2e-6, "trial {trial}: {apart:e}");
        worst = worst.max(certify(&stage, &ours).residual()).max(certify(&stage, &theirs).residual());
        for (axis, motor) in stage.motors.iter().enumerate() {
            let (joint, k) = (axis / 2, axis % 2);
            let (rate, drive) = (ours.rate[joint][k], ours.actuator[joint][k]);
            let line = (motor.stall - motor.fall * rate.abs()).max(0.0);
            on_line += usize::from(drive * rate > 0.0 && line > 0.0 && (drive.abs() - line).abs() < 1e-12);
            stuck += usize::from(ours.gear[axis].abs() < 0.99 * motor.friction && rate.abs() < 1e-7);
            let (mut first, mut second): (StageSolution, _) = (ours.clone(), ours.clone());
            first.actuator[joint][k] += 1e-3;
            second.gear[axis] += 1e-3;
            for off in [first, second] {
                assert!(certify(&stage, &off).residual() > 1e-4, "trial {trial}, axis {axis}");
            }
        }
    }
    println!("{on_line} axes on their lines, {stuck} stuck, {fallbacks} by the fallback, residuals to {worst:.1e} m/s");
    assert!(on_line > 50 && stuck > 30 && fallbacks < 60 && worst < 1e-7);
}

/// The hinge of two links in flight spins up as in the plane, about an axis in any direction.
#[test]
fn a_free_hinge_spins_up_along_the_torque_speed_line() {
    let motor =
        Motor { stall_torque: 0.4, no_load_speed: 1.0, rotor_inertia: 1e-5, gear_ratio: 10.0, ..Motor::default() };
    let constant = (0.5 * 1.32e-3 + 1e-3) * motor.no_load_speed / motor.stall_torque;
    for name in ["yaw", "pitch"] {
        let axes = AxesConfig::Same(name.to_owned());
        let config = RobotConfig { gravity: 1e-12, axes, motor: Some(motor.into()), ..links(2) };
        let pd = ControllerConfig::default();
        let integrator = implicit(1e-2 * constant, 2);
        let mut pair = SpatialSimulation::new(&config, &ground([0.0; 2]), &pd, &integrator).expect("admissible");
        let head = Pose { position: Vector3::new(0.0, 0.0, 9.0), orientation: orientation_of(0.4, 0.1, 0.2) };
        pair.place_chain(head, &[Vector2::zeros()]);
        let wave = Gait::Wave(Wave { gamma: 1.0, ..Wave::still() });
        let report = pair.advance(constant, &CardanGait { yaw: wave.clone(), pitch: wave });
        let [first, second] = [0, 1].map(|i| turning(&pair.state().twist[i]).norm());
        let expected = motor.no_load_speed * (1.0 - f64::exp(-1.0));
        assert!(((first + second) / expected - 1.0).abs() < 1e-4, "{name}: {first} + {second} for {expected}");
        assert_eq!(report.unconverged, 0);
    }
}

#[test]
fn work_goes_into_links_rotors_and_friction() {
    let yaws = std::array::from_fn(|joint| undulation().target(joint, 0.0).yaw.angle);
    work_of_motors_goes_into_links_rotors_and_friction::<Spatial>(&[4e-3, 2e-3], &yaws);
}

/// A gear that does not turn back holds a raised head up without a drive, at rest; one with little friction does not.
#[test]
fn a_gear_holds_a_raised_head_without_a_drive() {
    for (gear_friction, stands) in [(10.0, true), (0.05, false)] {
        let motor = Motor { stall_torque: 1.0, no_load_speed: 1.0, gear_friction, ..Motor::default() };
        let config = RobotConfig { motor: Some(motor.into()), ..links(8) };
        let mut robot =
            SpatialSimulation::new(&config, &ground([0.5, 0.5]), &LIMP, &implicit(5e-3, 2)).expect("admissible");
        // Links 3 to 8 lie in a bow, so that the robot does not tip over.
        let bend = |joint: usize| if joint < 2 { Vector2::new(0.0, -20.0) } else { Vector2::new(40.0, 0.0) };
        let posture: Vec<_> = (0..7).map(|joint| bend(joint) * DEGREE).collect();
        let head = Pose { position: Vector3::zeros(), orientation: orientation_of(0.0, -40.0 * DEGREE, 0.0) };
        robot.place_chain(head, &posture);
        robot.rest_on_ground();
        let placed = robot.state().pose[0].position.z;
        robot.advance(1.0, &still());
        let before = robot.state().pose[0].position.z;
        let report = robot.advance(3.0, &still());
        assert_eq!(report.unconverged, 0, "{report:?}");
        let (sunk, fastest) = (
            before - robot.state().pose[0].position.z,
            robot.state().twist.iter().map(|twist| twist.norm()).fold(0.0, f64::max),
        );
        println!("gear of {gear_friction} N m: head from {placed:.3} to {before:.3} m, then {sunk:e} m at {fastest:e}");
        if stands {
            assert!(placed > 0.12 && before > placed - 0.01 && sunk.abs() < 1e-9 && fastest < 1e-9);
        } else {
            assert!(before < 0.1);
        }
    }
}
